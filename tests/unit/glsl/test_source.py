"""Source: the text of programs is complete and minimal, and the origin of each line is known."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.strategies import LIGHTS_OF_ANY_TYPE, MATERIALS
from support.unused import nothing_unused

from glshade import Image, Mesh, Renderer, Scene, ShaderError, explain
from glshade.glsl.generator import generate
from glshade.glsl.shaders import SHIPPED, Shaders, expand
from glshade.glsl.source import Code, Source

SUN, SKY = {"type": "directional"}, {"type": "ambient"}


def sources(objects: Any, lights: Any = (SUN,), **more: Any) -> list[Source]:
    objects = [objects] if isinstance(objects, dict) else objects
    return [generate(p) for p in explain(Scene.model_validate({"objects": objects, "lights": list(lights), **more})).programs]


def text(found: Source) -> str:
    assert found.fragment is not None
    return found.vertex.text + found.fragment.text


def code(glsl: str) -> str:
    """Returns the text without comments, without the struct Frame and without the function ambient_reflectance."""
    glsl = re.sub(r"//.*", "", glsl)
    return re.sub(r"struct Frame \{.*?\};|vec3 ambient_reflectance\(.*?\n\}", "", glsl, flags=re.S)


def one(material: dict[str, Any], lights: Any = (SUN,), **keys: Any) -> str:
    (found,) = sources({"shape": "sphere", "material": material, **keys}, lights)
    return text(found)


@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
def test_a_program_holds_only_what_it_needs(rate: str) -> None:
    lambert = code(one({"brdf": "lambert"}, shading=rate))
    for word in ("cospow", "exp", "Phong", "ks", "ka", "tangent", "Point", "Spot", "falloff", "ambient(", "sampler", "discard"):
        assert word not in lambert, word
    phong = one({"brdf": "phong"}, shading=rate)
    assert "cospow" in phong
    assert "ambient" not in code(phong), "nobody asks for ka"
    assert "ambient" in code(one({"brdf": "phong"}, [SUN, SKY], shading=rate))
    assert "tangent" in one({"brdf": "ashikhmin_shirley"}, shading=rate)
    dark = one({"brdf": "phong"}, [], shading=rate)
    assert "a_normal" not in dark
    assert "brdf_cos" not in dark


def test_every_include_is_there_once() -> None:
    found = one({"brdf": "ashikhmin_shirley"}, [SUN, SKY, {"type": "spot", "position": [0, 9, 0]}])
    assert "#include" not in found
    assert found.count("#version") == 2
    for stage in found.split("#version")[1:]:
        functions = re.findall(r"^\w+ (\w+\([^)]*\)) \{", stage, re.M)
        assert len(functions) == len(set(functions))


def test_the_same_plan_is_the_same_text() -> None:
    first, second = (sources({"shape": "sphere", "material": {"brdf": "phong"}}) for _ in range(2))
    assert first == second
    assert hash(first[0]) == hash(second[0])


def test_every_line_knows_its_file() -> None:
    (found,) = sources({"shape": "sphere", "material": {"brdf": "phong"}})
    files: set[str] = set()
    for stage in (found.vertex, found.fragment):
        assert stage is not None
        lines = stage.text.splitlines()
        assert len(lines) == len(stage.lines)
        real = [
            (line, file, number) for line, (file, number) in zip(lines, stage.lines, strict=True) if not file.startswith("<")
        ]
        files |= {Path(file).name for _, file, _ in real}
        for line, file, number in real:
            assert Path(file).read_text(encoding="utf-8").splitlines()[number - 1] == line
        assert stage.place(1).endswith(":1")
        assert stage.place(10**6) == stage.place(len(lines))
    assert files >= {"phong.glsl", "cospow.glsl", "directional.glsl"}


class TestIncludes:
    """The include resolver, on small files that the tests write."""

    def files(self, tmp_path: Path, **content: str) -> Path:
        for name, body in content.items():
            (tmp_path / f"{name}.glsl").write_text(body)
        return tmp_path

    def test_once_and_in_place(self, tmp_path: Path) -> None:
        root = self.files(tmp_path, main='a\n#include "x.glsl"\n  #include "y.glsl"\nb\n', x='x\n#include "y.glsl"\n', y="y\n")
        stage = expand("main.glsl", {}, Shaders([root]))
        assert stage.text == "a\nx\ny\nb\n"
        assert [stage.place(i) for i in (1, 2, 3, 4)] == [
            f"{root}/main.glsl:1",
            f"{root}/x.glsl:1",
            f"{root}/y.glsl:1",
            f"{root}/main.glsl:4",
        ]

    def test_a_circle_ends(self, tmp_path: Path) -> None:
        root = self.files(tmp_path, main='#include "x.glsl"\nm\n', x='#include "main.glsl"\n#include "x.glsl"\nx\n')
        assert expand("main.glsl", {}, Shaders([root])).text == "x\nm\n"

    def test_generated_text(self, tmp_path: Path) -> None:
        root = self.files(tmp_path, main="#include <surface>\nm\n", x="x\n")
        surface = Code().add("one\n").include("x.glsl").add("two\n")
        stage = expand("main.glsl", {"surface": surface}, Shaders([root]))
        assert stage.text == "one\nx\ntwo\nm\n"
        assert [stage.place(i) for i in (1, 2, 3)] == ["<surface>:1", f"{root}/x.glsl:1", "<surface>:3"]

    def test_what_is_not_there(self, tmp_path: Path) -> None:
        root = self.files(tmp_path, main='a\n#include "unti.glsl"\n', unit="", empty="#include <surfase>\n")
        with pytest.raises(ShaderError) as caught:
            expand("main.glsl", {}, Shaders([root]))
        assert str(caught.value) == f'{root}/main.glsl:2: no shader file "unti.glsl"; did you mean "unit.glsl"?'
        with pytest.raises(ShaderError, match=r'empty.glsl:1: nothing is generated for <surfase>; did you mean "surface"\?'):
            expand("empty.glsl", {"surface": Code()}, Shaders([root]))
        with pytest.raises(ShaderError, match=r'no shader file "none\.glsl"'):
            expand("none.glsl", {}, Shaders([root]))


@pytest.fixture
def shaders(tmp_path: Path) -> Path:
    """A copy of the shader folder."""
    copy = tmp_path / "shaders"
    shutil.copytree(SHIPPED, copy)
    return copy


@pytest.fixture
def renderer_of(shaders: Path) -> Iterator[Renderer]:
    """A renderer that draws with that copy."""
    with Renderer(shaders=shaders) as renderer:
        yield renderer


@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("brdf/lambert.glsl", "INV_PI * NoL", "INV_PI * NoLL", r"NoLL"),
        ("math/unit.glsl", "return x *", "return x * y *", r"`?'?y'?"),
        ("surface/placement.glsl", "vec4(p_object, 1.0)", "vec4(p_object, 1.0", r"syntax error|unexpected"),
    ],
)
def test_a_broken_shader_names_its_place(
    file: str, old: str, new: str, message: str, rate: str, shaders: Path, renderer_of: Renderer
) -> None:
    path = shaders / file
    lines = path.read_text().splitlines()
    number = next(i for i, line in enumerate(lines, 1) if old in line)
    path.write_text(path.read_text().replace(old, new))
    scene = Scene(objects=[{"shape": "sphere", "shading": rate, "material": {"brdf": "lambert"}}], film={"size": (8, 8)})
    with pytest.raises(ShaderError) as caught:
        renderer_of.render(scene)
    first = str(caught.value).splitlines()[0]
    assert re.match(rf"{re.escape(str(path))}:({number}|{number + 1}):\d+: ", first), first
    assert re.search(message, first)


def test_a_broken_include_names_its_place(shaders: Path, renderer_of: Renderer) -> None:
    path = shaders / "brdf/lambert.glsl"
    path.write_text('#include "surface/framee.glsl"\n' + path.read_text())
    scene = Scene(objects=[{"shape": "sphere", "material": {"brdf": "lambert"}}], film={"size": (8, 8)})
    with pytest.raises(ShaderError) as caught:
        renderer_of.render(scene)
    assert str(caught.value) == f'{path}:1: no shader file "surface/framee.glsl"; did you mean "surface/frame.glsl"?'


def test_the_command_says_the_same(glshade: Any, tmp_path: Path, shaders: Path) -> None:
    """The command ends with exit code 4 and prints one line per message."""
    path = shaders / "brdf/lambert.glsl"
    path.write_text(path.read_text().replace("INV_PI * NoL", "INV_PI * NoLL"))
    (tmp_path / "s.toml").write_text('[[objects]]\nshape = "sphere"\nmaterial = { brdf = "lambert" }\n')
    done = glshade("render", "s.toml", "-o", "x.png", "--shaders", shaders, cwd=tmp_path)
    assert done.returncode == 4
    assert done.stderr.startswith(f"glshade: {path}:")
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "x.png").exists()


def coloured_ball() -> Mesh:
    """Returns a sphere with vertex colours."""
    ball = Scene(objects=[{"shape": {"type": "sphere", "segments": 8, "rings": 4}}]).objects[0].shape
    assert ball is not None
    mesh = ball.mesh()
    return Mesh.build(mesh.positions, mesh.triangles, mesh.normals, mesh.uvs, np.full((len(mesh.positions), 4), 0.5))


@st.composite
def scenes(draw: st.DrawFn) -> dict[str, Any]:
    """Scene files with all features that change programs. `textured` lists the parameters of the material to give a texture."""
    material = draw(MATERIALS)
    maps = ["normal_map", "tangent_direction"] if material.anisotropic else ["normal_map"]
    given = {key: value for key, value in material.model_dump().items() if value is not None}
    if material.anisotropic and draw(st.booleans()):
        given["tangent_direction"] = 30.0
    return {
        "objects": [
            {
                **draw(st.sampled_from([{"shape": "sphere"}, {"shape": "plane"}, {"mesh": coloured_ball()}])),
                "material": {**given, "alpha_mode": draw(st.sampled_from(["opaque", "mask", "blend"]))},
                "shading": draw(st.sampled_from(["flat", "gouraud", "phong"])),
                "sides": draw(st.sampled_from(["auto", "front", "both"])),
                "quality": draw(st.sampled_from([{}, {"normalise": False}, {"arithmetic": "fast"}])),
            }
        ],
        "lights": draw(st.lists(LIGHTS_OF_ANY_TYPE, max_size=4))
        + draw(st.sampled_from([[], [{"type": "point", "position": [0, 9, 0]}] * 9])),
        "camera": {"type": draw(st.sampled_from(["perspective", "orthographic"]))},
        "film": {"size": (4, 4), "samples": draw(st.sampled_from([1, 4]))},
        "textured": draw(st.lists(st.sampled_from([*material.parameters(), *maps]), max_size=3)),
    }


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pictures") / "t.png"
    Image(np.full((2, 2, 3), 0.5, dtype=np.float32)).save(path)
    return path


@settings(max_examples=100)
@given(scene=scenes())
def test_what_is_declared_is_used(scene: Any, renderer: Renderer, picture: Path) -> None:
    """The driver drops no uniform and no attribute, since the plan must leave out the unneeded ones."""
    scene = dict(scene)
    (item,) = scene["objects"]
    item = {**item, "material": {**item["material"], **{name: {"texture": str(picture)} for name in scene.pop("textured")}}}
    for plan in explain(Scene.model_validate({**scene, "objects": [item]})).programs:
        nothing_unused(plan, renderer)


@pytest.mark.parametrize("brdf", ["phong", "ashikhmin_shirley"])
def test_ambient_light_asks_for_no_lobe(brdf: str, renderer: Renderer, tmp_path: Path) -> None:
    Image(np.full((2, 2, 3), 0.5, dtype=np.float32)).save(tmp_path / "t.png")
    item = {"shape": "sphere", "material": {"brdf": brdf, "kd": {"texture": tmp_path / "t.png"}}}
    (plan,) = explain(Scene.model_validate({"objects": [item], "lights": [SKY]})).programs
    nothing_unused(plan, renderer)
