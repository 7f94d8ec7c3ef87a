"""Listings: `glshade brdfs`, `lights` and `materials` agree with what models, lights and presets declare."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
import warnings
from typing import Any, get_args

import numpy as np
import pytest

from glshade import BRDFS, LIGHTS, Scene
from glshade.catalogue import listing
from glshade.image.srgb import linear_to_srgb
from glshade.presets import PRESETS


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function that runs glshade with arguments and returns (exit code, stdout, stderr)."""

    def run(*arguments: str) -> tuple[int, str, str]:
        from glshade.cli import run as main

        monkeypatch.setattr(sys, "argv", ["glshade", *arguments])
        with pytest.raises(SystemExit) as exit:
            main()
        return int(exit.value.code or 0), *capsys.readouterr()

    with warnings.catch_warnings():
        yield run


class TestBrdfs:
    """The command `glshade brdfs`."""

    def test_json_has_what_the_models_declare(self, run: Any) -> None:
        code, out, err = run("brdfs", "--json")
        assert (code, err) == (0, "")
        listed = {model["name"]: model for model in json.loads(out)}
        assert list(listed) == list(BRDFS)
        for name, model in BRDFS.items():
            entry = listed[name]
            assert entry["class"] == model.__name__
            assert entry["source"] == model.source
            assert entry["anisotropic"] == model.anisotropic
            assert entry["summary"]
            assert entry["description"].split() == str(model.__doc__).split()
            assert [item["name"] for item in entry["parameters"]] == list(model.parameters())
            for item in entry["parameters"]:
                declared = model.parameters()[item["name"]]
                for key in ("description", "low", "high", "unit", "same_as", "base"):
                    assert item[key] == getattr(declared, key)
                assert tuple(item["usual"]) == declared.usual
                assert item["type"] == ("colour" if model.is_colour(item["name"]) else "number")
                # The default is in the form that a scene file has.
                assert getattr(model(**{item["name"]: item["default"]}), item["name"]) == getattr(model(), item["name"])
            assert [item["name"] for item in entry["options"]] == list(model.choices())
            for item in entry["options"]:
                assert tuple(item["choices"]) == get_args(model.model_fields[item["name"]].annotation)
                assert item["default"] == model().chosen()[item["name"]]
            assert {law for law, kept in entry["laws"].items() if not kept["promised"]} == set(model.breaks)
            assert {law: kept["reason"] for law, kept in entry["laws"].items() if kept["reason"]} == dict(model.breaks)
            assert tuple(entry["shares"]) == model.shares
            assert entry["isotropic_where"] == model.isotropic_where
            assert [limit["says"] for limit in entry["limits"]] == [limit.says for limit in model.limits()]
            for limit, declared_limit in zip(entry["limits"], model.limits(), strict=True):
                for key in ("one", "other"):
                    assert BRDFS[limit[key]["brdf"]](**limit[key]) == getattr(declared_limit, key)

    def test_keys_are_an_interface(self) -> None:
        keys = (
            "name class summary description source anisotropic parameters options keys laws shares isotropic_where limits "
            "reference"
        )
        assert list(listing.brdf("phong")) == keys.split()
        assert {"name", "type", "default", "low", "high", "usual", "unit", "description", "same_as", "base"} <= set(
            listing.brdf("phong")["parameters"][0]
        )
        keys = "name class summary description omnidirectional falloffs keys uniforms"
        assert list(listing.light("spot")) == keys.split()
        keys = "name description source brdf material swatch"
        assert list(listing.preset("gold")) == keys.split()

    def test_keys_that_are_neither_parameters_nor_options_are_listed(self, run: Any) -> None:
        assert {key["name"]: key["takes"] for key in listing.brdf("measured")["keys"]} == {
            "file": "path",
            "reciprocity": '"kept", "enforced"',
        }
        assert listing.brdf("phong")["keys"] == []
        _, out, _ = run("brdfs", "measured")
        assert any(line.split()[:2] == ["file", "path"] for line in out.splitlines())

    def test_one_line_for_each_model(self, run: Any) -> None:
        code, out, _ = run("brdfs")
        assert code == 0
        head, *lines = out.splitlines()
        assert head.split()[0] == "model"
        assert [line.split()[0] for line in lines] == list(BRDFS)
        assert not any(line != line.rstrip() or "\x1b" in line for line in lines)
        broken = {line.split()[0] for line in lines if "energy" in line[head.index("breaks") :]}
        assert broken == {name for name in BRDFS if "energy" in BRDFS[name].breaks}

    @pytest.mark.parametrize("name", BRDFS)
    def test_details_of_a_model(self, name: str, run: Any) -> None:
        code, out, _ = run("brdfs", name)
        model = BRDFS[name]
        assert code == 0
        rows = {line.split()[0]: line for line in out.splitlines() if line}
        for key, declared in model.parameters().items():
            assert declared.description in rows[key]
            assert declared.high is None or f"{declared.low:g} to {declared.high:g}" in rows[key]
        for key, choice in model().chosen().items():
            assert choice in rows[key]
        assert f"source: {model.source}" in out
        assert all(reason in out for reason in model.breaks.values())
        assert all(limit.says in out for limit in model.limits())

    def test_several_in_the_order_asked_for(self, run: Any) -> None:
        assert [model["name"] for model in json.loads(run("brdfs", "phong", "lambert", "--json")[1])] == ["phong", "lambert"]
        _, out, _ = run("brdfs", "phong", "lambert")
        assert out.index("phong  ") < out.index("\nlambert  ")

    def test_no_such_model(self, run: Any) -> None:
        code, out, err = run("brdfs", "phong", "fong")
        assert (code, out) == (2, "")
        assert "no model is named 'fong'; did you mean \"phong\"?" in err


class TestLights:
    """The command `glshade lights`."""

    def test_json_has_what_the_lights_declare(self, run: Any) -> None:
        listed = {light["name"]: light for light in json.loads(run("lights", "--json")[1])}
        assert list(listed) == list(LIGHTS)
        for name, model in LIGHTS.items():
            entry = listed[name]
            assert entry["class"] == model.__name__
            assert entry["omnidirectional"] == model.omnidirectional
            assert entry["uniforms"] == model.fields()
            assert entry["description"].split() == str(model.__doc__).split()
            assert [key["name"] for key in entry["keys"]] == [key for key in model.model_fields if key != "type"]
            assert {key["name"] for key in entry["keys"] if key["required"]} == {
                key for key, field in model.model_fields.items() if field.is_required()
            }
        assert listed["point"]["falloffs"] == ["none", "1/r", "1/r^2"]
        assert listed["directional"]["falloffs"] == []
        outer = next(key for key in listed["spot"]["keys"] if key["name"] == "outer")
        assert outer == {
            "name": "outer",
            "default": 30.0,
            "required": False,
            "takes": "number, > 0, <= 180",
            "description": LIGHTS["spot"].model_fields["outer"].description,
        }

    def test_tables(self, run: Any) -> None:
        _, out, _ = run("lights")
        assert [line.split()[0] for line in out.splitlines()[1:]] == list(LIGHTS)
        code, out, _ = run("lights", "spot")
        assert code == 0
        assert "falloffs: none, 1/r, 1/r^2" in out
        assert "position   3 numbers               required" in out
        assert "GLSL struct: vec3 intensity, float r_min" in out
        assert run("lights", "spott")[0] == 2


class TestMaterials:
    """The command `glshade materials`."""

    def test_json(self, run: Any) -> None:
        listed = json.loads(run("materials", "--json")[1])
        assert [preset["name"] for preset in listed] == list(PRESETS)
        for preset in listed:
            declared = PRESETS[preset["name"]]
            assert (preset["description"], preset["source"]) == (declared.description, declared.source)
            assert preset["material"] == declared.material
            assert preset["brdf"] == declared.material["brdf"]

    def test_swatches(self) -> None:
        r, g, b = (round(255 * float(c)) for c in linear_to_srgb(np.array([0.8, 0.4, 0.1])))
        assert listing.swatch(BRDFS["lambert"](kd=(0.8, 0.4, 0.1))) == f"#{r:02x}{g:02x}{b:02x}"
        red, green, blue = (int(listing.preset("gold")["swatch"][i : i + 2], 16) for i in (1, 3, 5))
        assert red > green > blue

    @pytest.mark.parametrize("name", PRESETS)
    def test_a_table_to_paste(self, name: str, run: Any) -> None:
        _, out, _ = run("materials", name)
        pasted = tomllib.loads(out[out.index("[materials") :])
        assert pasted == {"materials": {name: PRESETS[name].material}}
        Scene.model_validate({**pasted, "objects": [{"shape": "sphere", "material": name}]})

    def test_tables(self, run: Any) -> None:
        _, out, _ = run("materials")
        assert [line.split()[0] for line in out.splitlines()[1:]] == list(PRESETS)
        code, _, err = run("materials", "goldd")
        assert code == 2
        assert 'did you mean "gold"?' in err


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_terminal_gets_colours_and_lines_that_fit() -> None:
    import pty

    try:
        parent, child = pty.openpty()
    except OSError as error:
        pytest.skip(f"this system gives no pseudo-terminal, as without /dev/pts: {error}")
    environment = {**os.environ, "COLUMNS": "100", "TERM": "xterm-256color"}
    environment.pop("NO_COLOR", None)
    command = [sys.executable, "-m", "glshade", "materials", "gold", "silver"]
    with subprocess.Popen([*command[:4]], stdout=child, env=environment) as process:
        os.close(child)
        out = b""
        try:
            while piece := os.read(parent, 65536):
                out += piece
        except OSError:
            # Linux reports the end of a terminal as an error.
            pass
        assert process.wait(60) == 0
    os.close(parent)
    text = out.decode()
    assert "\x1b[1m" in text
    assert "gold" in text
    lines = re.sub(r"\x1b\[[0-9;]*m", "", text).splitlines()
    assert max(map(len, lines)) <= 100
