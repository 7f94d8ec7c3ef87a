"""The command line: its output, its files and its exit codes."""

from __future__ import annotations

import json
import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from support.command import Result, run_command

import glshade
from glshade.image import file as picture_file

SCENE = '[[objects]]\nshape = "sphere"\n[film]\nsize = [24, 16]\n'
BROKEN_DRIVER = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """A function `run(*arguments)` that runs `glshade` in this process, in a folder that holds s.toml."""
    (tmp_path / "s.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)

    return partial(run_command, capsys)


def pictures(folder: Path) -> list[str]:
    """Returns the names of all files in the folder, also hidden ones, except the scene."""
    return sorted(path.name for path in folder.iterdir() if path.name != "s.toml")


class TestRender:
    """The command `glshade render`."""

    def test_writes_the_picture_and_prints_its_path(self, run: Any, tmp_path: Path) -> None:
        assert run("render", "s.toml", "-o", "x.png") == Result(0, "x.png\n", "")
        assert pictures(tmp_path) == ["x.png"]
        assert picture_file.read("x.png")[0].shape == (16, 24, 4)

    def test_the_default_name_is_that_of_the_scene(self, run: Any, tmp_path: Path) -> None:
        assert run("render", "s.toml") == Result(0, "s.png\n", "")
        assert pictures(tmp_path) == ["s.png"]

    @pytest.mark.parametrize("suffix", sorted(picture_file.SUFFIXES))
    def test_every_format(self, suffix: str, run: Any) -> None:
        assert run("render", "s.toml", "-o", f"x{suffix}").code == 0
        reference = glshade.render(glshade.load("s.toml"), dtype="float32").pixels
        # 8-bit formats are off by up to half a code, which is 0.0045 at the bright end of the sRGB curve. JPEG is lossy, and
        # HDR has a mantissa of 8 bits.
        tolerance = {".exr": 0, ".hdr": 5e-3, ".jpg": 0.1, ".jpeg": 0.1}.get(suffix, 4.6e-3)
        assert np.abs(picture_file.read(f"x{suffix}")[0][..., :3] - reference).max() <= tolerance

    def test_options_override_the_film(self, run: Any) -> None:
        assert run("render", "s.toml", "-o", "x.exr", "--size", "9x7", "--exposure", "1", "--samples", "4").code == 0
        assert run("render", "s.toml", "-o", "y.exr", "--size", "9x7", "--samples", "4").code == 0
        twice, once = (picture_file.read(name)[0] for name in ("x.exr", "y.exr"))
        assert twice.shape == (7, 9, 4)
        assert twice[..., :3] == pytest.approx(2 * once[..., :3], rel=1e-6)

    def test_shading_overrides_the_objects(self, run: Any) -> None:
        for shading in ("flat", "gouraud", "phong"):
            assert run("render", "s.toml", "-o", f"{shading}.png", "--shading", shading).code == 0
        assert len({Path(f"{name}.png").read_bytes() for name in ("flat", "gouraud", "phong")}) == 3

    @pytest.mark.parametrize(
        ("arguments", "code", "message"),
        [
            ((), 2, "Missing argument 'SCENE...'"),
            (("s.toml", "--size", "0x3"), 2, "'0x3' is not a size such as 640x480"),
            (("s.toml", "--size", "3"), 2, "'3' is not a size such as 640x480"),
            (("s.toml", "--size", "200000x3"), 2, "'--size': must be less than or equal to 131072, not 200000"),
            (("s.toml", "--samples", "3"), 2, "'3' is not one of '1', '2', '4', '8'"),
            (("s.toml", "--exposure", "nan"), 2, "'--exposure': nan is not a finite number"),
            (("s.toml", "--exposure", "99"), 2, "'--exposure': must be less than or equal to 64, not 99"),
            (("s.toml", "--shading", "fong"), 2, "'fong' is not one of 'flat', 'gouraud', 'phong'"),
            (("s.toml", "--colour"), 2, "No such option"),
            (("none.toml",), 3, "none.toml: there is no such file"),
            (("none.obj",), 3, "none.obj: no such file"),
            ((".",), 3, "neither a scene nor a mesh"),
            (("s.toml", "-o", "x.gif"), 1, "x.gif: cannot write .gif; allowed: .exr, .hdr, .jpeg, .jpg, .png, .tif, .tiff"),
            (("s.toml", "-o", "x"), 1, "x: cannot write a file without extension"),
            (("s.toml", "-o", "no/x.png"), 1, "no/x.png: the folder no does not exist; make it first"),
            (("s.toml", "--device", "99"), 5, "there is no EGL device 99: `glshade devices` lists"),
            (("s.toml", "--device", "-1"), 5, "there is no EGL device -1"),
        ],
    )
    def test_errors(self, arguments: tuple[str, ...], code: int, message: str, run: Any, tmp_path: Path) -> None:
        result = run("render", *arguments)
        assert result.code == code
        assert message in result.err
        assert pictures(tmp_path) == []

    def test_a_faulty_scene_writes_no_picture_and_every_line_names_a_key(self, run: Any, tmp_path: Path) -> None:
        Path("s.toml").write_text('[[objects]]\nshape = "spere"\nmesh = "no.obj"\n[film]\nsize = [0, 16]\nsample = 4\n')
        result = run("render", "s.toml", "-o", "x.png")
        assert result.code == 3
        assert result.out == ""
        lines = result.err.splitlines()
        assert len(lines) == 5
        assert all(line.startswith("glshade: s.toml: ") for line in lines)
        assert pictures(tmp_path) == []

    def test_a_folder_in_the_place_of_the_picture(self, run: Any, tmp_path: Path) -> None:
        Path("x.png").mkdir()
        result = run("render", "s.toml", "-o", "x.png")
        assert (result.code, result.err) == (1, "glshade: x.png: cannot be written: Is a directory\n")
        assert pictures(tmp_path) == ["x.png"]

    @pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
    def test_a_folder_without_rights(self, run: Any, tmp_path: Path) -> None:
        Path("shut").mkdir(mode=0o500)
        result = run("render", "s.toml", "-o", "shut/x.png")
        assert result.code == 1
        assert "shut/x.png: cannot be written" in result.err

    def test_a_failure_keeps_the_old_picture(self, run: Any, tmp_path: Path) -> None:
        run("render", "s.toml", "-o", "x.png")
        before = Path("x.png").read_bytes()
        Path("s.toml").write_text(SCENE.replace("sphere", "cube").replace("24", "0"))
        assert run("render", "s.toml", "-o", "x.png").code == 3
        assert Path("x.png").read_bytes() == before
        assert pictures(tmp_path) == ["x.png"]

    def test_a_texture_that_cannot_be_read(self, run: Any, tmp_path: Path) -> None:
        Path("s.toml").write_text(SCENE + '[objects.material]\nbrdf = "lambert"\nkd = { texture = "t.png" }\n')
        Path("s.toml").write_text(Path("s.toml").read_text().replace("[film]\nsize = [24, 16]\n", ""))
        result = run("render", "s.toml", "-o", "x.png")
        assert (result.code, result.err.count("\n")) == (3, 1)
        assert "objects[0].material.kd.texture: " in result.err
        assert "t.png does not exist" in result.err
        Path("t.png").write_bytes(b"\x89PNG\r\n\x1a\nbut no more")
        result = run("render", "s.toml", "-o", "x.png")
        assert (result.code, result.err.count("\n")) == (3, 1)
        assert "t.png: cannot be read as a picture" in result.err
        assert pictures(tmp_path) == ["t.png"]

    def test_a_mesh_without_texture_coordinates(self, run: Any) -> None:
        glshade.Image(np.zeros((2, 2, 3), dtype=np.uint8)).save("t.png")
        Path("tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        Path("s.toml").write_text(
            '[[objects]]\nmesh = "tri.obj"\nmaterial = { brdf = "lambert", kd = { texture = "t.png" } }\n'
        )
        result = run("render", "s.toml", "-o", "x.png")
        assert result.code == 3
        assert "kd is a texture, but its mesh has no texture coordinates" in result.err

    def test_warnings_are_one_line(self, run: Any) -> None:
        Path("tri.obj").write_text("mtllib none.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        result = run("render", "tri.obj", "--size", "8x8")
        assert result.code == 0
        assert result.err.startswith("glshade: warning: ")
        assert result.err.count("\n") == 1
        assert "none.mtl" in result.err


class TestSet:
    """The option --set KEY=VALUE of all commands that take a scene."""

    def test_it_equals_the_same_value_in_the_file(self, run: Any) -> None:
        changes = ("film.size=[9,7]", "objects.0.material=gold", "materials.gold.roughness=0.4", "objects[0].shading=flat")
        assert run("render", "s.toml", "-o", "x.png", *(word for text in changes for word in ("--set", text))).code == 0
        Path("t.toml").write_text(
            '[[objects]]\nshape = "sphere"\nshading = "flat"\nmaterial = { preset = "gold", roughness = 0.4 }\n'
            "[film]\nsize = [9, 7]\n"
        )
        assert run("render", "t.toml", "-o", "y.png").code == 0
        assert run("render", "t.toml", "-o", "z.png", "--set", "objects.0.material.roughness=0.2").code == 0
        assert np.array_equal(picture_file.read("x.png")[0], picture_file.read("y.png")[0])
        assert not np.array_equal(picture_file.read("x.png")[0], picture_file.read("z.png")[0])

    def test_the_last_value_wins_and_other_options_win_over_set(self, run: Any) -> None:
        changes = ("--set", "film.size=[3,3]", "--set", "film={exposure=1}", "--set", "film.size=[5,4]")
        assert run("render", "s.toml", "-o", "x.png", *changes).code == 0
        assert picture_file.read("x.png")[0].shape == (4, 5, 4)
        assert run("render", "s.toml", "-o", "x.png", *changes, "--size", "6x2").code == 0
        assert picture_file.read("x.png")[0].shape == (2, 6, 4)

    def test_a_mesh(self, run: Any) -> None:
        Path("tri.v2.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        changes = ("--set", "film.size=[8,6]", "--set", 'objects."tri.v2".material=gold', "--set", "film.samples=1")
        assert run("render", "tri.v2.obj", "-o", "x.png", *changes).code == 0
        assert picture_file.read("x.png")[0].shape == (6, 8, 4)

    @pytest.mark.parametrize("command", ["render", "verify", "explain", "tradeoff"])
    @pytest.mark.parametrize(
        ("text", "code", "message"),
        [
            ("film", 2, "'--set': 'film' is not KEY=VALUE such as materials.body.roughness=0.3"),
            ("film.size=[9", 2, "'--set': film.size: '[9' is not a value of TOML: Unclosed array"),
            ("film.samples=3", 3, "s.toml: film.samples: 3 is not one of 1, 2, 4 or 8 (from --set)\n"),
            ("flm.samples=4", 3, 's.toml: flm: unknown key; did you mean "film"? (from --set)\n'),
            ("objects.0.shading.x=4", 3, "s.toml: objects[0].shading: "),
            ("film.size.0.x=4", 3, "s.toml: --set film.size.0.x: film.size.0 is 24, not a table\n"),
            ("objects.ball.shading=flat", 3, 's.toml: --set objects.ball: no item is named "ball"; allowed: 0 to 0\n'),
        ],
    )
    def test_errors(self, command: str, text: str, code: int, message: str, run: Any, tmp_path: Path) -> None:
        result = run(command, "s.toml", "--set", text)
        assert (result.code, result.out) == (code, "")
        assert message in result.err
        assert code == 2 or result.err.count("\n") == 1
        assert pictures(tmp_path) == []

    def test_verify(self, run: Any) -> None:
        result = run("verify", "s.toml", "--json", "--max-ambiguous", "100", "--set", "film.size=[8,6]")
        assert result.code == 0
        assert sum(json.loads(result.out)["counts"].values()) == 48
        result = run("verify", "s.toml", "--size", "200000x3")
        assert result.code == 2
        assert "'--size': must be less than or equal to 131072, not 200000" in result.err


class TestOthers:
    """The other commands."""

    def test_version_and_help(self, run: Any) -> None:
        assert run("--version").out == f"glshade, version {glshade.__version__}\n"
        for arguments in (("--help",), ("-h",), ("render", "-h")):
            assert run(*arguments).code == 0
        listed = run("--help").out
        from glshade.cli import COMMANDS

        assert {"render", "explain", "schema", "devices", "doctor"} <= set(COMMANDS)
        assert all(f"\n  {name} " in listed for name in COMMANDS)

    def test_an_unknown_command(self, run: Any) -> None:
        result = run("rendr", "s.toml")
        assert result.code == 2
        assert 'no command "rendr"; did you mean "render"?' in result.err
        result = run("xyzzy")
        assert result.code == 2
        assert "commands: " in result.err

    def test_schema_is_json(self, run: Any) -> None:
        result = run("schema")
        assert result.code == 0
        assert json.loads(result.out) == glshade.Scene.model_json_schema()

    def test_explain(self, run: Any) -> None:
        result = run("explain", "s.toml")
        assert result.code == 0
        assert "phong per pixel" in result.out
        assert "objects[0]" in result.out
        assert "because of" in result.out
        source = run("explain", "s.toml", "--source", "--shading", "flat").out
        assert source.count("#version 330 core") == 2
        assert "phong per face" in source
        assert "#include" not in source
        assert run("explain", "none.toml").code == 3

    def test_devices(self, run: Any) -> None:
        result = run("devices")
        assert result.code == 0
        listed = json.loads(run("devices", "--json").out)
        assert [device["index"] for device in listed] == list(range(len(listed)))
        assert len(result.out.splitlines()) == len(listed) > 0

    def test_doctor(self, run: Any) -> None:
        result = run("doctor")
        assert result.code == 0
        assert result.out.endswith("all is well\n")
        assert "OpenGL: " in result.out
        result = run("doctor", "--device", "99")
        assert result.code == 5
        assert "NOT WELL: there is no EGL device 99" in result.out


class TestAsAProcess:
    """Properties that need a process of their own to be tested."""

    @pytest.mark.parametrize("command", ["render", "doctor", "devices"])
    def test_a_broken_driver(self, command: str, glshade: Any, tmp_path: Path) -> None:
        (tmp_path / "s.toml").write_text(SCENE)
        arguments = {"render": ("s.toml", "-o", "x.png", "--backend", "egl"), "doctor": ("--backend", "egl"), "devices": ()}
        done = glshade(command, *arguments[command], cwd=tmp_path, **BROKEN_DRIVER)
        assert done.returncode == 5
        assert "Traceback" not in done.stderr
        assert len((done.stderr or done.stdout).splitlines()) == 1 or command == "doctor"
        assert pictures(tmp_path) == []

    @pytest.mark.parametrize("command", ["render", "devices"])
    def test_the_message_about_a_broken_driver_names_the_packages(self, command: str, glshade: Any, tmp_path: Path) -> None:
        (tmp_path / "s.toml").write_text(SCENE)
        done = glshade(command, *(("s.toml", "--backend", "egl") if command == "render" else ()), cwd=tmp_path, **BROKEN_DRIVER)
        assert "libegl1 libgl1-mesa-dri" in done.stderr
        assert "--device" not in done.stderr, "no device was asked for"

    def test_a_mesh_is_parsed_once(self, python: Any, tmp_path: Path) -> None:
        """The second run takes the mesh from the cache and does not import the reader."""
        (tmp_path / "m.stl").write_bytes(
            b"\0" * 80 + b"\1\0\0\0" + np.float32([0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0]).tobytes() + b"\0\0"
        )
        reader = "glshade.mesh.formats.stl"
        code = (
            "import sys; from glshade.cli import run\n"
            "sys.argv = ['glshade', 'render', 'm.stl', '--size', '8x8']\n"
            "try:\n    run()\n"
            f"except SystemExit as e:\n    print(e.code, sorted({{'{reader}', 'rich', 'PIL', 'scipy'}} & set(sys.modules)))"
        )
        cache = str(tmp_path / "cache")
        first = python(code, cwd=tmp_path, XDG_CACHE_HOME=cache).splitlines()[-1]
        picture = (tmp_path / "m.png").read_bytes()
        assert first == f"0 ['{reader}']"
        assert python(code, cwd=tmp_path, XDG_CACHE_HOME=cache).splitlines()[-1] == "0 []"
        assert (tmp_path / "m.png").read_bytes() == picture

    def test_two_runs_write_the_same_bytes(self, glshade: Any, tmp_path: Path) -> None:
        (tmp_path / "s.toml").write_text(SCENE)
        for name in ("a.png", "b.png"):
            assert glshade("render", "s.toml", "-o", name, cwd=tmp_path).returncode == 0
        assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()

    def test_a_closed_pipe_is_not_an_error(self, tmp_path: Path) -> None:
        import subprocess

        command = f"{sys.executable} -m glshade schema | head -c 1; echo ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60, check=True)
        assert (done.stdout, done.stderr) == ("{0\n", "")


def test_exr_stores_its_origin(run: Any) -> None:
    assert run("render", "s.toml", "-o", "x.exr").code == 0
    source = oiio.ImageInput.open("x.exr")
    spec = source.spec()
    assert str(spec.format) == "float"
    assert tuple(spec.channelnames) == ("R", "G", "B")
    from glshade.scene.digest import scene_digest

    assert spec.get_string_attribute("glshade:version") == glshade.__version__
    assert spec.get_string_attribute("glshade:scene") == scene_digest(glshade.load("s.toml"))
    assert spec.get_string_attribute("glshade:renderer")
    assert json.loads(spec.get_string_attribute("glshade:camera"))["type"] == "perspective"
    source.close()
