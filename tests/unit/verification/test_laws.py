"""Laws of pictures: they hold for every shipped scene and for random ones, and each law finds a fault that only it finds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pytest
from hypothesis import given, settings
from support.planted import not_welded
from support.strategies import scenes

import glshade as g
from glshade.assembly import assembly
from glshade.assembly.instance import Instance
from glshade.gl import renderer as gl_renderer
from glshade.lights import Placed, directional
from glshade.mesh import fans
from glshade.radiance import draw as radiance_draw
from glshade.radiance.sampler import Sampler
from glshade.reference.inputs import Inputs
from glshade.scene import override
from glshade.scene.camera import Perspective
from glshade.scene.object import Transform
from glshade.verification.laws import LAWS, check_laws

SCENES = sorted((Path(__file__).parents[3] / "scenes").glob("*.toml"))
SIZE = (48, 32)
BALL = {"type": "icosphere", "subdivisions": 1}
DIRECTIONAL = (
    {"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.75, 0.5), "intensity": 0.85},
    {"type": "directional", "direction": (0.7, -0.3, -0.5), "colour": (0.25, 0.5, 1.0), "intensity": 0.35},
)
POINT = {"type": "point", "position": (1.47, 2.53, 2.21), "intensity": 4.2}


def stage() -> g.Scene:
    """Returns a small scene to which every law applies. It has three objects, one below the other in a chain of parents."""
    objects = [
        {
            "name": "base",
            "shape": BALL,
            "transform": {"translate": (-1.3, 0.1, 0.0), "rotate": (10, 20, 30), "scale": (1, 0.7, 1)},
        },
        {
            "name": "arm",
            "parent": "base",
            "shape": "cube",
            "transform": {"translate": (1.5, 0.4, 0.2), "scale": (0.5, 0.8, 0.4)},
        },
        {
            "name": "hand",
            "parent": "arm",
            "shape": {"type": "torus", "segments": 12, "sides": 8},
            "transform": {"translate": (1.9, 0.3, 0.5), "rotate": (50, -20, 0), "scale": (0.9, 1.2, 1)},
        },
    ]
    colours = ((0.7, 0.3, 0.2), (0.2, 0.6, 0.3), (0.3, 0.4, 0.8))
    materials = [{"brdf": "blinn_phong", "kd": colour, "ks": 0.2, "exponent": 15.0} for colour in colours]
    return g.Scene.model_validate(
        {
            "film": {"size": SIZE, "background": (0.1, 0.2, 0.3)},
            "camera": {"eye": (1.5, 1.25, 5.5), "target": (0.1, 0.2, 0.0), "fov": 35},
            "objects": [
                {**item, "material": material, "normals": "smooth", "threshold": 90.0}
                for item, material in zip(objects, materials, strict=True)
            ],
            "lights": [*DIRECTIONAL, POINT],
        }
    )


def broken(scene: g.Scene, renderer: g.Renderer | None = None) -> set[str]:
    """Returns the names of the laws that the scene breaks."""
    return {finding.law for finding in check_laws(scene, renderer=renderer) if finding.outcome == "broken"}


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
@pytest.mark.slow
def test_shipped_scenes_obey_all_laws(path: Path, renderer: g.Renderer) -> None:
    width, height = g.load(path).film.size
    scene = g.load(path, overrides={"film.size": (64, 64 * height // width), "film.crop": None})
    findings = list(check_laws(scene, renderer=renderer))
    assert {finding.law for finding in findings} == set(LAWS)
    assert [finding for finding in findings if finding.broken] == []
    assert any(finding.outcome == "holds" and finding.pixels > 500 for finding in findings)


@settings(max_examples=20)
@given(scenes())
@pytest.mark.slow
def test_random_scenes_obey_all_laws(renderer: g.Renderer, scene: g.Scene) -> None:
    assert broken(scene, renderer) == set()


def test_all_laws_apply_to_the_stage_and_hold(renderer: g.Renderer) -> None:
    findings = list(check_laws(stage(), renderer=renderer))
    assert {(finding.law, finding.drawn_by) for finding in findings} == {(n, by) for n in LAWS for by in ("reference", "gpu")}
    assert {finding.outcome for finding in findings} == {"holds"}
    assert all(finding.pixels > 1000 and finding.deviation < 1e-4 for finding in findings)


def test_a_law_that_does_not_apply_says_why() -> None:
    scene = g.Scene.model_validate({"film": {"size": (8, 6)}, "objects": [{"shape": "cube"}]})
    reasons = {finding.law: finding.reason for finding in check_laws(scene) if finding.reason}
    assert reasons["parents-flattened"] == "no object has a parent"
    assert reasons["objects-reordered"] == "there is only one object"
    assert reasons["rotations"] == "no object has the key rotate"


def test_parts_of_a_mesh_file_stay_linked_to_their_light(tmp_path: Path) -> None:
    """Laws that change meshes make an object of each part of a mesh file. The light's key `only` names the file's object."""
    corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
    (tmp_path / "two.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.2 0.8\n")
    (tmp_path / "two.obj").write_text(f"mtllib two.mtl\n{corners}usemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n")
    scene = g.Scene.model_validate(
        {
            "film": {"size": (24, 16)},
            "objects": [
                {"name": "two", "mesh": str(tmp_path / "two.obj"), "transform": {"rotate": (10, 20, 0)}},
                {"shape": BALL},
            ],
            "lights": [{**DIRECTIONAL[0], "only": ("two",)}, DIRECTIONAL[1]],
        }
    )
    findings = {finding.law: finding for finding in check_laws(scene)}
    assert findings["triangles-reordered"].outcome == findings["unwelded"].outcome == findings["baked"].outcome == "holds"
    assert not any(finding.broken for finding in findings.values())


def test_blended_objects_keep_their_triangles() -> None:
    material = {"brdf": "lambert", "alpha": 0.5, "alpha_mode": "blend"}
    scene = g.Scene.model_validate({"film": {"size": (24, 16)}, "objects": [{"shape": BALL, "material": material}]})
    findings = {finding.law: finding for finding in check_laws(scene)}
    assert findings["triangles-reordered"].reason == "no object has a mesh that the law can change"
    assert findings["turned"].outcome == "holds"
    assert not any(finding.broken for finding in findings.values())


def test_a_light_with_an_unknown_key_may_not_move_with_the_world() -> None:
    class Lamp(directional.DirectionalLight):
        """A light with a key that no shipped light has."""

        level: float = 0.0

    scene = stage().model_copy(update={"lights": (Lamp(),)})
    findings = list(check_laws(scene, ["turned", "mirrored", "lights-split"]))
    assert [finding.outcome for finding in findings] == ["does not apply", "does not apply", "holds"]
    assert findings[0].reason == "lights of type directional may not move with the world"


def test_laws_have_the_names_of_their_files() -> None:
    assert all(name == law.name for name, law in LAWS.items())
    folder = Path(g.__file__).parent / "verification" / "laws"
    assert {path.stem for path in folder.glob("[!_]*.py")} == {name.replace("-", "_") for name in LAWS}


# A fault: a function that plants it by pytest's monkeypatch.
Plant = Callable[[pytest.MonkeyPatch], None]


def moved(patch: pytest.MonkeyPatch) -> None:
    """Light positions are rounded to float32 before they are made relative to the eye."""
    original = Placed.uniforms

    def uniforms(self: Placed, eye: Any) -> Any:
        return {**original(self, eye), "position": np.subtract(np.float32(self.position), np.float32(eye)).astype(float)}

    patch.setattr(Placed, "uniforms", uniforms)


def turned(patch: pytest.MonkeyPatch) -> None:
    """Directions are divided by their largest component in place of their length."""
    patch.setattr(directional, "direction_and_distance", lambda d: (d / np.abs(d).max(), 1.0))


def mirrored(patch: pytest.MonkeyPatch) -> None:
    """Mirroring transforms are not noticed, so that they turn front faces into back faces."""
    patch.setattr(Instance, "mirrored", False)


def unit(patch: pytest.MonkeyPatch) -> None:
    """Lights are a tenth of a scene unit too near to the eye."""
    original = Placed.uniforms

    def uniforms(self: Placed, eye: Any) -> Any:
        values = original(self, eye)
        return {**values, "position": values["position"] * (1 - 0.1 / np.linalg.norm(values["position"]))}

    patch.setattr(Placed, "uniforms", uniforms)


def rolled(patch: pytest.MonkeyPatch) -> None:
    """The picture is 1 % too wide."""
    original = Perspective.half_size
    patch.setattr(Perspective, "half_size", lambda self, aspect: original(self, 1.01 * aspect))


def objects_reordered(patch: pytest.MonkeyPatch) -> None:
    """An object takes the material of the first object with the same model."""
    original = assembly._pieces

    def pieces(*arguments: Any) -> Any:
        found, objects = original(*arguments)
        first = {piece.material.brdf: piece.material for piece in reversed(found)}
        return assembly._Pieces(replace(piece, material=first[piece.material.brdf]) for piece in found), objects

    patch.setattr(assembly, "_pieces", pieces)


def lights_reordered(patch: pytest.MonkeyPatch) -> None:
    """All lights have the colour of the first one."""
    original = assembly._in_range

    def in_range(assembled: Any, corners: Any) -> Any:
        colour = {"colour": assembled.lights[0].colour}
        return original(replace(assembled, lights=tuple(x.model_copy(update=colour) for x in assembled.lights)), corners)

    patch.setattr(assembly, "_in_range", in_range)


def lights_split(patch: pytest.MonkeyPatch) -> None:
    """At most three lights reach an object."""
    original = assembly._instance

    def instance(*arguments: Any) -> Instance:
        found = original(*arguments)
        return replace(found, lights=found.lights[:3])

    patch.setattr(assembly, "_instance", instance)


def parents_flattened(patch: pytest.MonkeyPatch) -> None:
    """Only the last of several parents counts."""

    def world(placed: Any, item: Any) -> Any:
        own, parent = item.transform.array(), item.parent
        if parent is None:
            return own
        while placed[parent][1] is not None:
            parent = placed[parent][1]
        return placed[parent][0] @ own

    patch.setattr(assembly, "world_of", world)


def rotations(patch: pytest.MonkeyPatch) -> None:
    """Objects are turned about z, then y, then x."""
    original = Transform.array

    def array(self: Transform) -> Any:
        result = original(self)
        if self.matrix is None:
            turns = [original(Transform(rotate=tuple(np.eye(3)[i] * self.rotate[i])))[:3, :3] for i in range(3)]
            result[:3, :3] = turns[0] @ turns[1] @ turns[2] * np.array(self.scale)
        return result

    patch.setattr(Transform, "array", array)


def triangles_reordered(patch: pytest.MonkeyPatch) -> None:
    """A smooth normal is that of the first triangle at the vertex."""

    def first(faces: Any, angles: Any, label: Any, count: int) -> Any:
        found = np.zeros((count, 3))
        found[label[::-1]] = np.repeat(faces, 3, axis=0)[::-1]
        return found

    patch.setattr(fans, "smooth_by_label", first)


def unwelded(patch: pytest.MonkeyPatch) -> None:
    """Normals are smooth only between triangles that share vertices."""
    not_welded(patch)


def baked(patch: pytest.MonkeyPatch) -> None:
    """Normals are transformed like directions along the surface."""
    patch.setattr(radiance_draw, "normal_matrix", lambda linear: linear)


def rates(patch: pytest.MonkeyPatch) -> None:
    """Shading per face uses a normal that is tilted."""
    original = assembly.faceted

    def faceted(mesh: Any) -> Any:
        result = original(mesh)
        tilted = result.normals + np.float32([0.05, 0.0, 0.0])
        return replace(result, normals=tilted / np.linalg.norm(tilted, axis=1, keepdims=True))

    patch.setattr(assembly, "faceted", faceted)


def exposed(patch: pytest.MonkeyPatch) -> None:
    """A stop of exposure multiplies light by 2.1."""
    original = radiance_draw.light_values
    stop = math.log2(2.1)
    patch.setattr(radiance_draw, "light_values", lambda light, eye, exposure: original(light, eye, stop * exposure))


def lights_linked(patch: pytest.MonkeyPatch) -> None:
    """All lights reach all objects."""
    original = assembly._instance

    def instance(scene: g.Scene, piece: Any, view: Any, lights: Any, *more: Any) -> Any:
        return original(scene, piece, view, tuple(x.model_copy(update={"only": None}) for x in lights), *more)

    patch.setattr(assembly, "_instance", instance)


def textured(patch: pytest.MonkeyPatch) -> None:
    """Textures are 1 % too bright."""
    original = Sampler.sample
    patch.setattr(Sampler, "sample", lambda *arguments: 1.01 * original(*arguments))


def swept(patch: pytest.MonkeyPatch) -> None:
    """The values of sweeps are rounded to one digit after the point."""
    original = override.parse

    def parse(text: str) -> Any:
        value = original(text)
        return [round(number, 1) for number in value] if isinstance(value, list) else round(value, 1)

    patch.setattr(override, "parse", parse)


def cropped(patch: pytest.MonkeyPatch) -> None:
    """A crop shows the window one pixel to the right."""
    original = Inputs.wanted.func
    patch.setattr(
        Inputs, "wanted", property(lambda self: original(self) + (self.window[2:] != self.size and self.window[0] == 0))
    )


def tiled(patch: pytest.MonkeyPatch) -> None:
    """The scene is shifted by half a pixel in all tiles but those at the left border."""
    original = gl_renderer.window
    patch.setattr(gl_renderer, "window", lambda clip, size, x, *rest: original(clip, size, x + (0.5 if x > 0 else 0.0), *rest))


FAULTS = {
    function.__name__.replace("_", "-"): function
    for function in (
        *(moved, turned, mirrored, unit, rolled, objects_reordered, lights_reordered, lights_split, parents_flattened),
        *(rotations, triangles_reordered, unwelded, baked, rates, textured, swept, cropped, tiled),
        *(exposed, lights_linked),
    )
}
# The faults of the GPU's renderer, which the reference does not have.
ON_GPU = {"tiled"}


def test_every_law_has_a_fault() -> None:
    assert FAULTS.keys() == LAWS.keys()


@pytest.mark.parametrize("name", FAULTS)
def test_each_law_finds_a_fault_that_no_other_law_finds(
    name: str, renderer: g.Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Meshes that a fault has made must not stay in the cache, and meshes of an earlier test must not be found there.
    monkeypatch.setattr(assembly, "_made", WeakKeyDictionary())
    FAULTS[name](monkeypatch)
    assert broken(stage(), renderer if name in ON_GPU else None) == {name}
