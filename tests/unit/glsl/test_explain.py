"""Explanation and Variants: the features of programs with their reasons, interfaces, operations and numbers of variants."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from glshade import BRDFS, Image, Renderer, Scene
from glshade.assembly.assembly import assemble
from glshade.assembly.instance import Instance
from glshade.brdfs import Brdf
from glshade.gl.activity import with_active
from glshade.glsl import plan, variants
from glshade.glsl.explanation import explanation_of as explained
from glshade.glsl.interface import Interface, declared
from glshade.glsl.planner import plan_instance
from glshade.glsl.source import Declaration, Source, Stage
from glshade.scene.file import load
from glshade.scene.object import Rate
from glshade.scene.quality import Quality

SCENES = sorted((Path(__file__).resolve().parents[3] / "scenes").glob("*.toml"))
SUN: dict[str, Any] = {"type": "directional", "name": "sun"}


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    Image(np.full((2, 2, 3), 0.5, dtype=np.float32)).save(tmp_path / "t.png")
    return tmp_path / "t.png"


def ball(**material: Any) -> dict[str, Any]:
    return {"name": "ball", "shape": "sphere", "material": {"brdf": "phong", **material}}


def scene(*objects: Any, lights: Any = (SUN,), **more: Any) -> Scene:
    return Scene.model_validate({"objects": list(objects), "lights": list(lights), "film": {"size": [8, 8]}, **more})


def test_every_feature_of_every_program_has_its_reason(picture: Path) -> None:
    worn = {**ball(kd={"texture": picture}, alpha_mode="mask"), "name": "worn", "sides": "both"}
    found = explained(scene(ball(), worn, lights=[SUN, {"type": "ambient", "name": "sky", "only": ["worn"]}]))
    plain, second = (dict(program.features) for program in found.programs)
    assert plain["brdf phong per pixel"] == "ball"
    assert second["brdf phong per pixel"] == "worn"
    assert plain["light white_directional"] == second["light white_directional"] == "sun"
    assert plain["perspective"] == "camera"
    assert plain["srgb"] == "film"
    only_second = {"texture of kd", "both sides", "alpha mask", "alpha of kd's texture"}
    assert set(second) - set(plain) == only_second | {"light ambient"}
    assert second["light ambient"] == "sky"
    assert all(second[feature].startswith("worn") for feature in only_second)
    assert [program.draws for program in found.programs] == [("ball",), ("worn",)]


def test_what_is_declared(picture: Path) -> None:
    (program,) = explained(
        scene(ball(kd={"texture": picture}), lights=[SUN] * 3 + [{"type": "spot", "position": [0, 9, 0]}] * 9)
    ).programs
    assert program.declared.attributes == {"a_normal": "vec3", "a_position": "vec3", "a_uv": "vec2"}
    assert program.declared.blocks == ("spot_inverse_square_page",)
    uniforms = program.declared.uniforms
    assert uniforms["u_white_directional_l"] == "vec3[3]"
    assert uniforms["u_kd_texture"] == "sampler2D"
    assert uniforms["u_clip_from_world"] == "mat4"
    assert "u_ka" not in uniforms
    assert list(uniforms) == sorted(uniforms)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_the_driver_finds_all_of_it_active(path: Path, renderer: Renderer) -> None:
    for program in with_active(explained(load(path)), renderer.context).programs:
        assert program.active == program.declared


def test_what_the_driver_drops_is_reported(renderer: Renderer) -> None:
    declarations = [Declaration("in", "vec3", "a_p"), Declaration("in", "vec2", "a_uv")]
    declarations += [Declaration("uniform", "vec3", "u_a"), Declaration("uniform", "vec3", "u_b", 2)]

    def stage(head: list[Declaration], body: str) -> Stage:
        text = "\n".join(["#version 330 core", *map(str, head), "void main() {", body, "}"]) + "\n"
        return Stage(text, (("x", 1),) * len(text.splitlines()), tuple(enumerate(head, 1)))

    source = Source(
        stage(declarations, "    gl_Position = vec4(a_p + u_a, 1.0);"),
        stage([Declaration("out", "vec4", "o")], "    o = vec4(1.0);"),
    )
    found = explained(scene(ball()))
    (program,) = found.programs
    odd = replace(found, programs=(replace(program, source=source, declared=declared(source)),))
    assert odd.programs[0].inactive is None
    checked = with_active(odd, renderer.context)
    assert checked.driver
    assert checked.programs[0].active == Interface({"u_a": "vec3"}, {"a_p": "vec3"}, ())
    assert checked.programs[0].inactive == ("a_uv", "u_b")


class TestVariants:
    """The numbers equal those of an enumeration with `plan_instance`, where EXACT_LIGHTS is 1."""

    @pytest.mark.parametrize(("brdf", "kinds"), [("ambient", 0), ("ambient", 1), ("lambert", 0), ("lambert", 1), ("phong", 0)])
    def test_valid_is_what_can_be_planned(self, brdf: str, kinds: int, picture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        # With 8 exact lights there would be too many combinations to enumerate.
        for module in (plan, variants):
            monkeypatch.setattr(module, "EXACT_LIGHTS", 1)
        suns = [SUN, {**SUN, "colour": [1, 0, 0]}, SUN] * kinds
        assembly = assemble(scene(ball(), lights=[*suns, {"type": "ambient"}]))
        sky = len(assembly.lights) - 1
        choices = [(), (0,), (1,), (0, 2)] if kinds else [()]
        lights = [(*chosen, *ambient) for chosen in choices for ambient in ((), (sky,))]
        plans = {plan_instance(each, assembly, "linear") for each in instances(assembly.instances[0], brdf, picture, lights)}
        # Textures that share a file are not counted separately. Two viewers, two encodings and the four uses of emission go
        # with each plan, and with ambient light also the five uses of occlusion: test_emission_plan.py counts these.
        each_shared = {replace(each, shared=()) for each in plans}
        expected = sum(2 * 2 * 4 * (1 if each.ambient == "none" else 5) for each in each_shared)
        assert variants.valid(BRDFS[brdf], kinds) == expected

    def test_there_are_fewer_and_fewer(self) -> None:
        for path in SCENES:
            counts = list(explained(load(path)).variants.as_dict().values())
            assert counts == sorted(counts, reverse=True)
            assert counts[-1] > 0

    def test_each_count_by_itself(self) -> None:
        # The first is written as phong with ks = 0; its canonical form is lambert, which the second already is.
        dull = {**ball(ks=0), "name": "dull"}
        plain = {**ball(), "name": "plain", "material": {"brdf": "lambert"}}
        counts = explained(scene(dull, plain)).variants
        assert (counts.written, counts.canonical, counts.compiled) == (2, 1, 1)
        assert counts.nominal > counts.valid > 1000
        # A second kind of light has 46 counts: 45 numbers of white and coloured ones, at most 8 together, and many.
        more = explained(scene(dull, plain, lights=[SUN, {"type": "point", "position": [0, 9, 0]}])).variants
        assert more.nominal == 46 * counts.nominal


def materials(brdf: str, picture: Path) -> Iterator[Brdf]:
    """Materials with all combinations of the uses of parameters, alpha modes, and with and without a normal map."""
    model, texture = BRDFS[brdf], {"texture": picture}
    uses: dict[str, list[Any]] = {"alpha_mode": ["opaque", "mask", "blend"], "normal_map": [None, texture]}
    for name, parameter in model.parameters().items():
        numbers = (
            [0.5, (0.5, 0.25, 0.5), texture] if model.is_colour(name) else [0.5, *({**texture, "channel": c} for c in "rgba")]
        )
        uses[name] = numbers if parameter.same_as is None else [*numbers, None]
    for values in itertools.product(*uses.values()):
        # Alpha is below the cutoff, so that a mask does cut out.
        yield model.model_validate({"alpha": 0.25, **dict(zip(uses, values, strict=True))})


def instances(instance: Instance, brdf: str, picture: Path, lights: Any) -> Iterator[Instance]:
    switch = (False, True)
    # These settings do not matter without light from a direction: see test_plan.py.
    settings = list(itertools.product(switch, switch, ("stable", "fast"))) if len(lights) > 2 else [(True, True, "stable")]
    for material in materials(brdf, picture):
        for chosen, rate, colours, (both, normalise, arithmetic) in itertools.product(lights, get_args(Rate), switch, settings):
            lit = replace(instance, material=material, lights=chosen, rate=rate, vertex_colours=colours)
            yield replace(lit, back_faces=both, quality=Quality(normalise=normalise, arithmetic=arithmetic))


class TestCommand:
    def test_without_a_driver(self, python: Any) -> None:
        """Without a driver, no OpenGL module is imported."""
        code = (
            "import sys; from glshade.cli import cli; cli.main(sys.argv[1:], standalone_mode=False);"
            "assert not any(name.startswith(('moderngl', 'glcontext', 'glshade.gl.')) for name in sys.modules)"
        )
        output = python(code, "explain", SCENES[0])
        assert "variants: " in output
        assert "light ambient: because of" in output

    def test_with_one(self, glshade: Any) -> None:
        done = glshade("explain", SCENES[0], "--active", "--census")
        assert done.returncode == 0, done.stderr
        assert done.stdout.count("all of them active in the driver") == done.stdout.count("\nprogram ") + 1
        assert "FAULT" not in done.stdout
        assert len(re.findall(r"^  (?:vertex|fragment) operations: (?:\d+ \(.*\)|-)$", done.stdout, re.M)) >= 2

    def test_json(self, glshade: Any) -> None:
        found = json.loads(glshade("explain", SCENES[0], "--json").stdout)
        assert list(found) == ["programs", "variants", "driver"]
        assert list(found["variants"]) == ["nominal", "valid", "written", "canonical", "compiled"]
        for program in found["programs"]:
            assert list(program) == [
                "program",
                "draws",
                "features",
                "declared",
                "active",
                "inactive",
                "operations",
                "source",
            ]
            assert program["inactive"] == []
            assert program["active"] == program["declared"]
            assert program["source"]["vertex"].startswith("#version 330")

    def test_json_where_there_is_no_driver(self, glshade: Any) -> None:
        done = glshade("explain", SCENES[0], "--json", "--device", "99")
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        assert found["driver"] is None
        assert {(program["active"], program["inactive"], program["operations"]) for program in found["programs"]} == {
            (None,) * 3
        }
        # A driver that is asked for explicitly must exist.
        assert glshade("explain", SCENES[0], "--active", "--device", "99").returncode == 5
