"""Work is counted before it begins, only regular files are opened, and no document ends in a traceback (docs/security.md)."""

from __future__ import annotations

import json
import os
import random
import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import pytest
from support.command import run_command
from support.hostile import Maker, text_of, write_files

from glshade import GlshadeError, Renderer, Scene, SceneError, load, reference
from glshade.limits import LONGEST_CHAIN, MOST_INSTANCES, Limits
from glshade.mesh import file as mesh_file

BALL = '[[objects]]\nname = "ball"\nshape = "sphere"\n'
MATERIAL = 'material = { brdf = "lambert", kd = { texture = "big.png" } }\n'


def scene(folder: Path, text: str) -> Path:
    """Writes a scene of 16 x 16 pixels and returns its path."""
    path = folder / "s.toml"
    path.write_text(f"film.size = [16, 16]\n{text}" if "film.size" not in text else text)
    return path


def big_png(path: Path, side: int) -> None:
    """Writes a grey PNG of side x side pixels without keeping its pixels in memory."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packer = zlib.compressobj(9)
    rows = b"".join(packer.compress(bytes(side + 1)) for _ in range(side)) + packer.flush()
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b""))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '[[objects]]\nshape = { type = "plane", segments = 4096 }\n',
            r"make 33,554,432 triangles; 2,097,152 .*--max-triangles",
        ),
        (BALL + 'shading = "flat"\nquality.subdivide = 8\n', r"make 591,396,864 triangles; .*--max-triangles"),
        ("film.size = [40000, 40000]\n" + BALL, r"film\.size: shades 1,600,000,000 pixels .*--max-pixels"),
        ("film.size = [4000, 4000]\nfilm.supersample = 16\n" + BALL, r"4,096,000,000 pixels"),
    ],
)
def test_more_than_the_limit(tmp_path: Path, text: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = scene(tmp_path, text)
    with pytest.raises(SceneError, match=message):
        reference.render(load(path))
    result = run_command(capsys, "render", path, "-o", tmp_path / "x.png")
    assert result.code == 3
    assert result.err.count("\n") == 1


def test_an_option_raises_the_limit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = scene(tmp_path, BALL)
    assert run_command(capsys, "render", path, "-o", tmp_path / "x.png", "--max-triangles", 100).code == 3
    assert run_command(capsys, "render", path, "-o", tmp_path / "x.png", "--max-triangles", 10_000).code == 0
    result = run_command(capsys, "render", path, "-o", tmp_path / "x.png", "--size", "50000x50000")
    assert (result.code, "--max-pixels" in result.err) == (2, True)
    result = run_command(capsys, "render", path, "-f", "1-20", "--sweep", "quality.normalise=true,false", "--max-tasks", 39)
    assert (result.code, "40 pictures; 39 are allowed" in result.err) == (2, True)


def test_a_scene_of_python_has_no_limits() -> None:
    assert Scene.model_validate({"objects": [{"shape": "cube"}]}).limits.max_pixels > 1 << 60


def test_a_small_file_with_a_large_picture(tmp_path: Path) -> None:
    big_png(tmp_path / "big.png", 12_000)
    assert (tmp_path / "big.png").stat().st_size < 1 << 20
    path = scene(tmp_path, BALL + MATERIAL)
    with pytest.raises(SceneError, match=r"144,000,000 pixels; 33,554,432 are allowed: see --max-texels"):
        reference.render(load(path))


def test_textures_are_counted_together(tmp_path: Path) -> None:
    big_png(tmp_path / "big.png", 100)
    path = scene(tmp_path, "".join(BALL.replace("ball", f"b{k}") + MATERIAL for k in range(2)))
    reference.render(load(path, limits=Limits(max_texels=10_000)))
    path = scene(tmp_path, path.read_text() + BALL + MATERIAL.replace('"big.png"', '"big.png", wrap = "clamp"'))
    with pytest.raises(SceneError, match="20,000 pixels"):
        reference.render(load(path, limits=Limits(max_texels=10_000)))


def test_too_many_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("glshade.assembly.counting.MOST_INSTANCES", 2)
    with pytest.raises(SceneError, match="3 parts are drawn; 2 are allowed"):
        reference.render(load(scene(tmp_path, "".join(BALL.replace("ball", f"b{k}") for k in range(3)))))
    assert MOST_INSTANCES >= 10_000


def test_a_long_chain_of_parents(tmp_path: Path) -> None:
    def chain(count: int) -> str:
        items = [f'{{ name = "o{k}", shape = "cube"' + (f', parent = "o{k - 1}" }}' if k else " }") for k in range(count)]
        return f"objects = [{', '.join(items)}]\n"

    load(scene(tmp_path, chain(LONGEST_CHAIN)))
    with pytest.raises(SceneError, match=f"more than {LONGEST_CHAIN} parents"):
        load(scene(tmp_path, chain(20_000)))


def test_a_buffer_that_many_primitives_share(tmp_path: Path) -> None:
    """A file of 100 kB would make a mesh of a thousand million triangles."""
    accessor = {"componentType": 5126, "count": 3_000_000, "type": "VEC3"}
    primitives = [{"attributes": {"POSITION": 0}}] * 1000
    document = {"asset": {"version": "2.0"}, "accessors": [accessor], "meshes": [{"primitives": primitives}]}
    (tmp_path / "m.gltf").write_text(json.dumps(document))
    with pytest.raises(SceneError, match=r"1,000,000,000 triangles, .*--max-triangles"):
        load(tmp_path / "m.gltf")


def test_a_long_chain_of_nodes(tmp_path: Path) -> None:
    """Neither time nor memory grows with the square of the depth."""
    nodes: list[dict[str, Any]] = [{"children": [index + 1]} for index in range(20_000)]
    accessor = {"componentType": 5126, "count": 3, "type": "VEC3"}
    document = {
        "asset": {"version": "2.0"},
        "accessors": [accessor],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [*nodes, {"mesh": 0}],
    }
    (tmp_path / "m.gltf").write_text(json.dumps(document))
    # An accessor without bytes holds zeros, so that the only triangle is a point.
    with pytest.warns(UserWarning, match="has an area"):
        assert len(mesh_file.load(tmp_path / "m.gltf").parts) == 1


def test_a_polygon_with_many_corners(tmp_path: Path) -> None:
    corners = "".join(f"v {k} {k % 2 * 5 + k * k * 1e-6} 0\n" for k in range(10_002))
    (tmp_path / "m.obj").write_text(f"{corners}f {' '.join(str(k + 1) for k in range(10_002))}\n")
    with pytest.raises(SceneError, match="10,002 corners"):
        load(tmp_path / "m.obj")


@pytest.mark.parametrize("name", ["fifo", "/dev/zero"])
@pytest.mark.parametrize("key", ["scene", "mesh", "texture", "ocio", "shader", "model"])
def test_only_regular_files_are_opened(key: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def special(path: Path) -> str:
        os.mkfifo(path) if name == "fifo" else path.symlink_to(name)
        return path.name

    options: list[object] = []
    path = scene(tmp_path, BALL)
    if key == "scene":
        path = tmp_path / special(tmp_path / "t.toml")
    elif key == "mesh":
        scene(tmp_path, f'[[objects]]\nmesh = "{special(tmp_path / "m.obj")}"\n')
    elif key == "texture":
        special(tmp_path / "big.png")
        scene(tmp_path, BALL + MATERIAL)
    elif key == "ocio":
        scene(tmp_path, f'film.ocio = "{special(tmp_path / "c.ocio")}"\nfilm.view = "x"\n' + BALL)
    elif key == "shader":
        (tmp_path / "own" / "brdf").mkdir(parents=True)
        special(tmp_path / "own" / "brdf" / "phong.glsl")
        options = ["--shaders", tmp_path / "own"]
    else:
        (tmp_path / "own").mkdir()
        special(tmp_path / "own" / "shiny.py")
        options = ["--models", tmp_path / "own"]
    result = run_command(capsys, "explain", path, *options)
    # A shader file that is not regular does not count as one, so the shipped file is used.
    assert result.code == (0 if key == "shader" else 3)
    assert key == "shader" or "is not a regular file" in result.err


def test_a_large_shader_is_refused_before_it_is_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "brdf").mkdir()
    with (tmp_path / "brdf" / "phong.glsl").open("wb") as file:
        file.truncate(300 << 20)
    result = run_command(capsys, "explain", scene(tmp_path, BALL), "--shaders", tmp_path)
    assert result.code == 4
    assert "is larger than" in result.err


WRONG = {
    "a name that is a list": BALL.replace('"ball"', "[]"),
    "a parent that is a list": BALL + "parent = []\n",
    "an eye that is a number": "camera = { eye = 0, target = [0, 0, 0] }\n" + BALL,
    "a tiny field of view": "camera.fov = 5e-324\n" + BALL,
    "a distant eye": "camera.eye = [1e308, 0, 0]\n" + BALL,
    "a large scale": BALL + "transform.scale = 1.7e308\n",
    "a narrow cone": BALL + '[[lights]]\ntype = "spot"\nposition = [0, 1, 0]\nouter = 5e-324\n',
    "401 digits": f"camera.fov = 1{'0' * 400}\n" + BALL,
    "5,000 digits": f"camera.fov = 1{'0' * 5000}\n" + BALL,
    "no such user": '[[objects]]\nmesh = "~nosuchuser/x.obj"\n',
    "a bright background": "film.background = [1e300, 0, 0]\n" + BALL,
    "a far plane at the eye": "camera.far = 0\n" + BALL,
    "scales that add up": "".join(
        BALL.replace("ball", f"b{k}") + "transform.scale = 1e99\n" + (f'parent = "b{k - 1}"\n' if k else "") for k in range(4)
    ),
    "a light too strong for float32": BALL + '[[lights]]\ntype = "point"\nposition = [0, 2, 0]\nintensity = 1e60\n',
    "many brackets": "x = " + "[" * 200_000,
    "a key of many parts": "a." * 300_000 + "b = 1\n",
    "an escape character": BALL.replace("ball", "\\u001b[2J"),
    "a line break": BALL.replace("ball", "a\\nglshade: forged"),
    "a change of direction": BALL.replace("ball", "\\u202e"),
    "a long name": BALL + f'parent = "{"p" * 100_000}"\n',
}


@pytest.mark.parametrize("text", WRONG.values(), ids=WRONG)
def test_one_clear_line(tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    result = run_command(capsys, "render", scene(tmp_path, text), "-o", tmp_path / "x.png")
    assert result.code == 3
    assert result.err.startswith("glshade: ")
    assert all(line.startswith("glshade: ") and line.isprintable() for line in result.err[:-1].split("\n"))
    assert len(result.err) < 1100


def test_half_a_surrogate_pair_in_json(tmp_path: Path) -> None:
    path = tmp_path / "s.json"
    path.write_text('{"objects": [{"name": "\\ud800", "shape": "cube"}]}')
    with pytest.raises(SceneError, match=r"objects\[0\]\.name: has characters that cannot be printed: .ud800"):
        load(path)


def test_the_list_of_faults_ends(tmp_path: Path) -> None:
    path = scene(tmp_path, "".join(f'[[objects]]\nshape = "cube"\nparent = "no{k}"\nwrong{k} = 1\n' for k in range(2000)))
    with pytest.raises(SceneError, match="more faults") as error:
        load(path)
    assert len(error.value.problems) == 51


def test_names_of_files_cannot_forge_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = run_command(capsys, "explain", tmp_path / "a\nglshade: forged\x1b[2J.toml")
    assert result.code == 3
    assert result.err.count("\n") == 1
    assert "\x1b" not in result.err


def test_hostile_documents(tmp_path: Path, renderer: Renderer) -> None:
    """script/prove documents tries 2,600 of them, each with a limit of time and memory."""
    schema = Scene.model_json_schema()
    write_files(tmp_path)
    path = tmp_path / "hostile.json"
    for seed in range(40):
        chance = random.Random(seed)
        path.write_text(text_of(Maker(schema, chance, chance.choice((0.01, 0.1, 0.3)), nearly_valid=seed % 4 == 0).document()))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", RuntimeWarning)
                drawn = load(path, limits=Limits(max_triangles=100_000))
                renderer.render(drawn.model_copy(update={"film": drawn.film.model_copy(update={"size": (8, 8), "crop": None})}))
        except GlshadeError:
            pass
