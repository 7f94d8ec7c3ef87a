"""Minimality: a program's text has only the features that the scene needs, and removing any of them changes the picture."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray
from support.extremes import ORDINARY, ordinary
from support.strategies import scenes
from support.uber import EverythingRenderer

from glshade import BRDFS, LIGHTS, Image, Mesh, Renderer, Scene, explain, load
from glshade.assembly.assembly import Assembly, assemble
from glshade.assembly.instance import Instance
from glshade.gl.preparation import DrawCall, Prepared
from glshade.glsl.definitions import uncommented
from glshade.glsl.generator import generate
from glshade.glsl.plan import ProgramPlan
from glshade.glsl.planner import plan_instance
from glshade.glsl.shaders import SHIPPED
from glshade.glsl.source import Source, Stage
from glshade.glsl.uniforms import exposed_uniforms, light_uniforms, object_uniforms, textures
from glshade.lights import FALLOFFS
from glshade.verification.trials import VISIBLE

# These scenes have most features of lights and rates. The slow tests run the others.
FEW = ("lights-add", "shading-rates", "simple-model", "spot")
SCENES = sorted((Path(__file__).resolve().parents[3] / "scenes").glob("*.toml"))
each_shipped = pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
SUN: dict[str, Any] = {"type": "directional", "name": "sun", "direction": [-0.4, -0.6, -0.7]}
LAMP: dict[str, Any] = {"type": "point", "position": [2, 2, 3], "intensity": 8.0, "colour": [1, 0.5, 0.25]}
SKY: dict[str, Any] = {"type": "ambient", "intensity": 0.2}


def text_of(source: Source) -> str:
    """Returns both stages without comments."""
    assert source.fragment is not None
    return uncommented(source.vertex.text + source.fragment.text)


class TestNothingElseIsThere:
    """No function, struct, uniform or file that the instance does not use."""

    @each_shipped
    def test_shipped(self, path: Path) -> None:
        for shading in (None, "flat", "gouraud"):
            self.holds(assemble(load(path), shading))

    @settings(max_examples=75)
    @given(scene=scenes())
    def test_any(self, scene: Scene) -> None:
        self.holds(assemble(scene))

    def holds(self, assembly: Assembly) -> None:
        for instance in assembly.instances:
            plan = plan_instance(instance, assembly, "srgb")
            source = generate(plan)
            self.files(plan, source)
            self.models_and_lights(plan, source)
            self.uniforms(plan, source, instance, assembly)
            for stage in (source.vertex, source.fragment):
                assert stage is not None
                assert not set(functions(stage.text)) - reachable(stage.text)

    def files(self, plan: ProgramPlan, source: Source) -> None:
        """The text has, from each folder of alternative files, only those that the plan names."""
        assert source.fragment is not None
        places = {file for stage in (source.vertex, source.fragment) for file, _ in stage.lines if not file.startswith("<")}
        files = {str(Path(file).relative_to(SHIPPED)) for file in places}
        there = {folder: {Path(file).stem for file in files if file.startswith(folder)} for folder in FOLDERS}
        assert there["brdf/"] == ({plan.brdf} if plan.directed or plan.ambient == "varying" else set())
        assert there["light/"] == {group.type for group in plan.lights} | ({"ambient"} if plan.ambient == "varying" else set())
        assert there["falloff/"] == {FALLOFFS[group.falloff].name for group in plan.lights} - {""}
        assert there["viewer/"] == ({plan.viewer} if plan.directed else set())
        # Several encodings share the functions of output/encoding.glsl.
        assert there["output/"] - {"encoding"} == {plan.encoding}
        assert plan.arithmetic == "fast" or not there["fast/"]
        for name, wanted in {
            "normal_transform": plan.directed,
            "tangent_transform": plan.tangents,
            "tangent_frame": plan.tangents,
            "normal_map": plan.normal_map,
            "direction_map": plan.direction_map,
            "turned_frame": plan.turned or plan.direction_map,
            "horizon": plan.directed,
        }.items():
            assert (f"surface/{name}.glsl" in files) == wanted, name

    def models_and_lights(self, plan: ProgramPlan, source: Source) -> None:
        words = set(re.findall(r"\w+", text_of(source)))
        lit = plan.directed or plan.ambient == "varying"
        assert words & {BRDFS.class_name(name) for name in BRDFS} == ({BRDFS.class_name(plan.brdf)} if lit else set())
        types = {group.type for group in plan.lights} | ({"ambient"} if plan.ambient == "varying" else set())
        assert words & {LIGHTS.class_name(name) for name in LIGHTS} == {LIGHTS.class_name(name) for name in types}
        for word, wanted in {
            "texture": plan.mapped or bool(plan.alpha_from),
            "discard": plan.alpha == "mask",
            "brdf_cos": plan.directed,
            "ambient_reflectance": plan.ambient == "varying",
            "Frame": plan.directed,
        }.items():
            assert (word in words) == wanted, word

    def uniforms(self, plan: ProgramPlan, source: Source, instance: Instance, assembly: Assembly) -> None:
        """The text declares exactly the uniforms for which there are values."""
        values = {"u_clip_from_world", *object_uniforms(plan, instance, assembly.view.eye), *textures(plan, instance.material)}
        values |= set(light_uniforms(plan, assembly, instance.lights, 0.0))
        values |= {"u_viewer"} if plan.directed and plan.viewer == "orthographic" else set()
        values |= set(exposed_uniforms(plan, instance, assembly, 0.0))
        values |= {f"u_{group.key}_count" for group in plan.lights if not group.count}
        # A light that does not fall off has no r_min.
        values -= {f"u_{group.key}_r_min" for group in plan.lights if group.falloff == "none"}
        declared = {declaration.name for stage in source.stages for declaration in stage.declarations("uniform")}
        assert declared == values
        assert set(re.findall(r"^uniform \w+ (\w+)", text_of(source), re.M)) == values


FOLDERS = ("brdf/", "light/", "falloff/", "viewer/", "output/", "fast/")


def functions(text: str) -> dict[str, str]:
    """Name -> the bodies of all functions of that name."""
    bodies: dict[str, str] = {}
    for match in re.finditer(r"^\w+ (\w+)\([^{;]*\) \{\n.*?^\}", uncommented(text), re.M | re.S):
        bodies[match[1]] = bodies.get(match[1], "") + match[0].split("{", 1)[1]
    return bodies


def reachable(text: str) -> set[str]:
    """Returns the names of the functions that main() reaches."""
    bodies, reached, ahead = functions(text), set(), ["main"]
    while ahead:
        name = ahead.pop()
        if name in bodies and name not in reached:
            reached.add(name)
            ahead += re.findall(r"\b(\w+)\(", bodies[name])
    return reached


def test_what_is_not_reached_is_found_out() -> None:
    """The helpers above recognise an unreached function."""
    text = "float f(float x) {\n    return x;\n}\nfloat g() {\n    return f(1.0);\n}\nvoid main() {\n    h(2.0);\n}\n"
    assert set(functions(text)) - reachable(text) == {"f", "g"}
    assert reachable(text.replace("h(2.0)", "g()")) == {"main", "f", "g"}


@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_lambert_takes_no_power(rate: Any, encoding: str) -> None:
    item = {"shape": "sphere", "material": {"brdf": "lambert"}}
    film = {"size": [8, 8], "encoding": encoding}
    (plan,) = explain(Scene.model_validate({"objects": [item], "lights": [SUN, LAMP, SKY], "film": film}), rate).programs
    assert plan.encoding == encoding
    assert not set(re.findall(r"\w+", text_of(generate(plan)))) & {"pow", "exp", "exp2", "log", "log2", "cospow"}


class TestWhatIsAddedAndNotUsed:
    """Unused materials and textures, and lights of other objects, change no text."""

    @pytest.fixture
    def picture(self, tmp_path: Path) -> Path:
        Image(np.full((2, 2, 3), 0.5, dtype=np.float32)).save(tmp_path / "t.png")
        return tmp_path / "t.png"

    @each_shipped
    def test_changes_nothing(self, path: Path, picture: Path) -> None:
        scene = load(path)
        names = {item.name for item in scene.objects if item.name}
        unused: dict[str, Any] = {f"unused-{name}": BRDFS[name].model_validate({}) for name in BRDFS}
        unused["unused-texture"] = BRDFS["lambert"].model_validate(
            {"kd": {"texture": picture}, "normal_map": {"texture": picture}}
        )
        other: Any = {
            "name": "elsewhere",
            "shape": "sphere",
            "material": unused["unused-texture"],
            "transform": {"scale": [1e-3] * 3},
        }
        (item,) = Scene.model_validate({"objects": [other]}).objects
        lights = [
            LIGHTS[name].model_validate(
                {"only": ["elsewhere"], **({"position": [0, 9, 0]} if "position" in LIGHTS[name].model_fields else {})}
            )
            for name in LIGHTS
        ]
        assert "elsewhere" not in names
        assert scene.lights is not None
        more = scene.model_copy(
            update={
                "materials": {**scene.materials, **unused},
                "objects": [*scene.objects, item],
                "lights": [*scene.lights, *lights],
            }
        )
        before, after = texts(scene), texts(more)
        added = after.pop("elsewhere")
        # The programs of the other objects are the same, because the added lights reach only the added object.
        assert [source for sources in after.values() for source in sources] == [
            s for sources in before.values() for s in sources
        ]
        assert all("SpotLight" in source.fragment.text for source in added if source.fragment)


def texts(scene: Scene) -> dict[str, list[Source]]:
    """Object -> the programs that draw it."""
    plan = explain(scene)
    programs: dict[str, list[Source]] = {}
    for name, index in plan.draws:
        programs.setdefault(name, []).append(generate(plan.programs[index]))
    return programs


def without(plan: ProgramPlan) -> Iterator[tuple[str, Source]]:
    """Yields (feature, the program without it) of every feature that can be removed."""
    for group in plan.lights:
        yield f"light {group.key}", generate(replace(plan, lights=tuple(other for other in plan.lights if other != group)))
    for name in plan.textured:
        source = generate(plan)
        # Emission and occlusion have functions of their own; a parameter is set in the function of the material.
        start = rf"m\.{name} = " if name not in ("emission", "occlusion") else rf"return .*u_{name} \* "
        read = re.compile(rf"(^    {start}.*?)texture\([^()]*\)", re.M)
        assert any(read.search(stage.text) for stage in (source.vertex, source.fragment) if stage)
        yield f"texture of {name}", Source(*(white(stage, read) for stage in (source.vertex, source.fragment) if stage))
    changes: dict[str, dict[str, Any]] = {
        "ambient": {"ambient": "none"} if plan.ambient != "none" else {},
        "normal map": {"normal_map": False} if plan.normal_map else {},
        "mirrored map": {"normal_span": (1, 1)} if plan.normal_span != (1, 1) else {},
        "tangents": {"anisotropic": False, "turned": False, "direction_map": False} if plan.anisotropic else {},
        "tangents turned": {"turned": False} if plan.turned else {},
        "tangents by a map": {"direction_map": False} if plan.direction_map else {},
        "vertex colours": {"vertex_colours": False} if plan.vertex_colours else {},
        "both sides": {"both_sides": False} if plan.both_sides else {},
        "alpha": {"alpha": "opaque", "alpha_from": None} if plan.alpha != "opaque" else {},
        "alpha of a texture": {"alpha_from": None} if plan.alpha_from else {},
        "emission": {"emission": "unused"} if plan.emission != "unused" else {},
        "occlusion": {"occlusion": "unused"} if plan.occlusion != "unused" else {},
    }
    for feature, change in changes.items():
        if change:
            yield feature, generate(replace(plan, **change))


def white(stage: Stage, read: re.Pattern[str]) -> Stage:
    """Returns the stage with a white texel in place of the one that is read."""
    return replace(stage, text=read.sub(r"\1vec4(1.0)", stage.text))


class Mutilated(Renderer):
    """A renderer that draws some plans with another program. The values that it sets stay as they are."""

    def __init__(self) -> None:
        super().__init__()
        self.programs: dict[Source, Source] = {}
        self.culled = False

    def __enter__(self) -> Mutilated:
        return self

    def drawn(self, scene: Scene) -> NDArray[np.float32]:
        # The renderer caches prepared scenes by the rewriting function, so each call needs a new function.
        self.rewrite = lambda source: self.programs.get(source, source)
        pixels: NDArray[np.float32] = self.render(scene, dtype="float32").pixels.copy()
        return pixels

    def draw(self, prepared: Prepared, clip: NDArray[np.float32], calls: Iterable[DrawCall] | None = None) -> None:
        chosen = prepared.calls if calls is None else calls
        super().draw(prepared, clip, map(without_backs, chosen) if self.culled else chosen)


def without_backs(call: DrawCall) -> DrawCall:
    """Returns the draw call with back faces culled."""
    return replace(call, instances=tuple(replace(instance, back_faces=False) for instance in call.instances))


@pytest.fixture(scope="module")
def mutilated() -> Iterator[Mutilated]:
    with Mutilated() as renderer:
        yield renderer


def differences(scene: Scene, renderer: Mutilated) -> dict[str, float]:
    """Feature -> the largest change of the picture when it is removed, the least of all programs that have it."""
    width, height = scene.film.size
    size = (128, max(round(height * 128 / width), 1))
    scene = scene.model_copy(update={"film": scene.film.model_copy(update={"size": size, "samples": 1, "encoding": "linear"})})
    clean, found = renderer.drawn(scene), dict[str, float]()
    try:
        renderer.culled = True
        backs = float(np.abs(renderer.drawn(scene) - clean).max())
        renderer.culled = False
        for plan in explain(scene).programs:
            for feature, source in without(plan):
                # An open mesh is drawn from both sides even if no back face is visible; then the feature cannot show.
                if feature == "both sides" and backs == 0:
                    continue
                renderer.programs = {generate(plan): source}
                change = float(np.abs(renderer.drawn(scene) - clean).max())
                found[feature] = min(change, found.get(feature, np.inf))
    finally:
        renderer.programs, renderer.culled = {}, False
    return found


class TestNothingCanBeTakenAway:
    """Every feature of a plan is visible in the picture."""

    @pytest.mark.parametrize(
        "path", [pytest.param(p, marks=() if p.stem in FEW else pytest.mark.slow, id=p.stem) for p in SCENES]
    )
    def test_shipped(self, path: Path, mutilated: Mutilated) -> None:
        found = differences(load(path), mutilated)
        assert found
        assert not {feature: change for feature, change in found.items() if not change > VISIBLE}

    @pytest.mark.parametrize(
        "rate", [pytest.param("flat", marks=pytest.mark.slow), pytest.param("gouraud", marks=pytest.mark.slow), "phong"]
    )
    def test_what_no_shipped_scene_has(self, rate: str, mutilated: Mutilated, tmp_path: Path) -> None:
        random = np.random.default_rng(1)
        rgba = random.uniform(0.2, 1.0, (8, 8, 4)).astype(np.float32)
        Image(rgba).save(tmp_path / "rgba.png")
        Image(np.dstack([rgba[..., :2], np.ones((8, 8))]).astype(np.float32)).save(tmp_path / "map.png")
        picture, bumps = {"texture": tmp_path / "rgba.png"}, {"texture": tmp_path / "map.png"}
        ball = Scene.model_validate({"objects": [{"shape": {"type": "sphere", "segments": 24, "rings": 12}}]}).objects[0].shape
        assert ball is not None
        mesh = ball.mesh()
        colours = random.uniform(0.2, 1.0, (len(mesh.positions), 4))
        # Half a ball, open to the viewer.
        behind = mesh.positions[mesh.triangles].mean(axis=1)[:, 2] < 0.2
        bowl = Mesh.build(mesh.positions, mesh.triangles[behind], mesh.normals, mesh.uvs, colours)
        brushed: dict[str, Any] = {"brdf": "ashikhmin_shirley", "pu": 10.0, "pv": 200.0, "kd": 0.3}
        materials: list[dict[str, Any]] = [
            {**brushed, "tangent_direction": {**bumps, "rotate": 30.0}},
            {"brdf": "lambert", "alpha_mode": "mask", "kd": picture, "alpha_cutoff": 0.6},
            {"brdf": "metal", "alpha_mode": "mask", "alpha_cutoff": 0.6},
            {"brdf": "phong", "bump_map": {**bumps, "height": 0.2}, "kd": 0.3},
            {"brdf": "lambert", "kd": picture},
        ]
        shown: set[str] = set()
        for material in materials:
            item = {"mesh": bowl, "material": material, "shading": rate}
            camera = {"eye": [0.5, 1, 4], "target": [0, 0, 0]}
            scene = Scene.model_validate(
                {"objects": [item], "lights": [SUN, LAMP, SKY], "camera": camera, "film": {"size": [64, 64]}}
            )
            found = differences(scene, mutilated)
            assert not {feature: change for feature, change in found.items() if not change > VISIBLE}, material
            shown |= set(found)
        wanted = {
            "tangents",
            "tangents turned",
            "tangents by a map",
            "vertex colours",
            "both sides",
            "alpha",
            "alpha of a texture",
        }
        assert shown >= wanted | {"ambient", "normal map", "texture of kd", "light white_directional"}


@pytest.fixture(scope="module")
def everything() -> Iterator[EverythingRenderer]:
    with EverythingRenderer() as renderer:
        yield renderer


class TestAgainstEverything:
    """A program with all features draws the same pictures as the program with only the needed ones."""

    # Each program is within ORDINARY of the model's value, so the two are within twice that of each other.
    WITHIN = 2 * ORDINARY

    def same(self, scene: Scene, everything: EverythingRenderer, renderer: Renderer) -> None:
        expected = renderer.render(scene, dtype="float32").pixels.copy()
        pixels = everything.render(scene, dtype="float32").pixels.copy()
        assert len(explain(scene).programs) == 1
        assert np.ptp(expected[..., :3]) > 0.05
        assert (np.abs(pixels - expected) / np.maximum(1, np.abs(expected))).max() <= self.WITHIN

    def scene(self, material: Any, light: Any, **more: Any) -> Scene:
        item = {"shape": {"type": "sphere", "segments": 48, "rings": 24}, "material": material}
        film = {"size": [64, 64], "encoding": "linear"}
        return Scene.model_validate({"objects": [{**item, **more}], "lights": [light], "film": film})

    @pytest.mark.parametrize("name", BRDFS)
    def test_any_model(self, name: str, everything: EverythingRenderer, renderer: Renderer) -> None:
        spot = {"type": "spot", "position": [2, 2, 3], "direction": [-2, -2, -3], "intensity": 5.0, "falloff": "1/r"}
        lights = [SKY] if name == "ambient" else [SUN, LAMP, spot, {**spot, "type": "gltf_spot"}]
        for material, light in zip([BRDFS[name].model_validate({}), *ordinary(name, 3)], lights, strict=False):
            self.same(self.scene(material, light), everything, renderer)

    def test_any_feature(self, everything: EverythingRenderer, renderer: Renderer, tmp_path: Path) -> None:
        pixels = np.random.default_rng(1).uniform(0.2, 0.9, (8, 8, 4)).astype(np.float32)
        Image(pixels).save(tmp_path / "t.png")
        picture = {"texture": tmp_path / "t.png"}
        brushed: dict[str, Any] = {"brdf": "ward", "alpha_x": 0.1, "alpha_y": 0.4, "kd": picture}
        cut = {"brdf": "lambert", "kd": picture, "alpha_mode": "mask", "alpha_cutoff": 0.6}
        self.same(self.scene({**brushed, "tangent_direction": {**picture, "rotate": 30.0}}, LAMP), everything, renderer)
        self.same(self.scene({"brdf": "phong", "kd": picture, "normal_map": picture}, SUN), everything, renderer)
        self.same(self.scene(cut, LAMP, sides="both"), everything, renderer)
        self.same(self.scene(cut, SKY), everything, renderer)
