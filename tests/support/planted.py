"""Planted faults: thirty faults in code that both renderers share, each with a small scene on which it shows.

`verify` cannot see such a fault, because it changes the GPU's picture and the reference's picture alike.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pytest
from PIL import Image

from glshade.arrays import rounded
from glshade.assembly import assembly, values
from glshade.assembly.instance import Instance
from glshade.brdfs.lambert import Lambert
from glshade.brdfs.phong import Phong
from glshade.image import srgb
from glshade.lights import Light, Placed
from glshade.lights.spot import SpotLight
from glshade.lru import Lru
from glshade.mesh import facets, geometry, normals, topology
from glshade.scene import shape
from glshade.scene.camera import Perspective
from glshade.scene.film import Film
from glshade.scene.object import Transform
from glshade.textures import mipmap, storage, texels

Document = dict[str, Any]


@dataclass(frozen=True)
class Fault:
    """A fault in shared code.

    name: the name in the table.
    description: the fault in one line.
    plant: puts a function with the fault in the place of the right one, for as long as the MonkeyPatch lasts.
    scene: returns a scene on which the fault shows. Its argument is the folder for the scene's pictures.
    test: optional, the pytest id of a test of the suite that fails with the fault, for a fault that nothing else catches.
    """

    name: str
    description: str
    plant: Callable[[pytest.MonkeyPatch], None]
    scene: Callable[[Path], Document]
    test: str = ""


@contextmanager
def planted(fault: Fault) -> Iterator[None]:
    """Enters a context in which a fault is there. Meshes that were made before are forgotten at both ends."""
    with pytest.MonkeyPatch.context() as patch:
        fault.plant(patch)
        shape._meshes.clear()
        try:
            yield
        finally:
            shape._meshes.clear()


def everywhere(patch: pytest.MonkeyPatch, right: Any, wrong: Any) -> None:
    """Puts `wrong` in the place of the function `right` in every module that has imported it."""
    for name, module in list(sys.modules.items()):
        if name.startswith("glshade"):
            for key in [key for key, value in vars(module).items() if value is right]:
                patch.setattr(module, key, wrong)


def instances(change: Callable[..., Any]) -> Callable[[pytest.MonkeyPatch], None]:
    """Returns a `plant` that changes the arguments of each instance: change(scene, piece, view, lights, shading)."""
    right = assembly._instance
    return lambda patch: patch.setattr(assembly, "_instance", lambda *given: right(*change(*given[:5]), *given[5:]))


def uniforms(kind: type[Light], change: Callable[[Any], dict[str, Any]]) -> Callable[[pytest.MonkeyPatch], None]:
    """Returns a `plant` that changes some of the values that are uploaded for a light.

    change: returns the changed values, by name, for all values by name.
    """
    right = kind.uniforms

    def wrong(self: Any, eye: Any) -> dict[str, Any]:
        given = right(self, eye)
        return given | change(given)

    return lambda patch: patch.setattr(kind, "uniforms", wrong)


def document(objects: list[Document], lights: list[Document], **more: Any) -> Document:
    """Returns a scene of these objects and lights. more: other keys of a scene."""
    camera = {"eye": [1.5, 1.2, 4.5], "target": [0.0, 0.0, 0.0], "fov": 40.0}
    return {"film": {"size": [48, 36]}, "camera": camera, "objects": objects, "lights": lights} | more


POINT = {"type": "point", "position": [2.0, 2.5, 3.0], "intensity": 12.0}
SUN = {"type": "directional", "direction": [-0.5, -0.7, -0.6], "intensity": 0.8}
AMBIENT = {"type": "ambient", "intensity": 0.2}
SHINY = {"brdf": "phong", "kd": 0.5, "ks": 0.25, "exponent": 12.0}
TILTED = {"rotate": [20.0, 30.0, 40.0]}
WIDE = {"scale": [1.3, 0.5, 0.9], "rotate": [20.0, 30.0, 40.0]}
MIRRORED = {"scale": [-1.0, 1.0, 1.0], "rotate": [20.0, 30.0, 40.0]}


def ball(**keys: Any) -> Document:
    return {"name": "ball", "shape": {"type": "sphere", "segments": 12, "rings": 8}, "material": SHINY} | keys


def cube(**keys: Any) -> Document:
    return {"name": "cube", "shape": "cube", "material": {"brdf": "lambert"}, "transform": TILTED} | keys


def with_ball(**keys: Any) -> Callable[[Path], Document]:
    return lambda folder: document([ball(**keys)], [POINT])


def with_cube(**keys: Any) -> Callable[[Path], Document]:
    return lambda folder: document([cube(**keys)], [POINT])


def lit(*lights: Document) -> Callable[[Path], Document]:
    return lambda folder: document([ball()], list(lights))


def filmed(**keys: Any) -> Callable[[Path], Document]:
    return lambda folder: document([ball()], [POINT, AMBIENT], film={"size": [48, 36]} | keys)


def family(folder: Path) -> Document:
    """Three cubes, each of which is a child of the one before it."""
    step = {"translate": [0.9, 0.3, 0.0], "rotate": [0.0, 35.0, 20.0], "scale": [0.6, 0.8, 0.7]}
    first = cube(name="first", transform={"translate": [-0.8, 0.0, 0.0], "rotate": [10.0, 20.0, 30.0], "scale": 0.7})
    second = cube(name="second", parent="first", transform=step)
    return document([first, second, cube(name="third", parent="second", transform=step)], [POINT])


def linked(folder: Path) -> Document:
    """Returns a ball, a cube and a cone, of which a light reaches the ball alone."""
    left, middle = ball(transform={"translate": [-1.2, 0.0, 0.0]}), cube(transform={"scale": 0.4})
    right = {"name": "cone", "shape": "cone", "transform": {"translate": [1.2, 0.0, 0.0], "scale": 0.8}, "material": SHINY}
    return document([left, middle, right], [POINT | {"only": ["ball"]}, AMBIENT])


def pictured(key: str, transform: Document = TILTED, **keys: Any) -> Callable[[Path], Document]:
    """Returns a function that makes a scene of a cube whose material has a picture of few texels under a key."""

    def scene(folder: Path) -> Document:
        path = folder / "picture.png"
        pixels = np.random.default_rng(1).integers(60, 200, (5, 4, 3))
        Image.fromarray(pixels.astype(np.uint8)).save(path)
        material = {"brdf": "lambert", key: {"texture": str(path)} | keys}
        return document([cube(material=material, transform=transform)], [POINT])

    return scene


def minified(folder: Path) -> Document:
    """Returns a plane with many more texels than pixels."""
    path = folder / "fine.png"
    Image.fromarray(np.random.default_rng(1).integers(0, 256, (256, 256, 3)).astype(np.uint8)).save(path)
    material = {"brdf": "lambert", "kd": {"texture": str(path)}}
    return document([{"shape": "plane", "material": material}], [SUN])


# Twelve faults that are easily made in any renderer.


def _normal_matrix(patch: pytest.MonkeyPatch) -> None:
    everywhere(patch, values.normal_matrix, lambda linear: linear / np.abs(linear).max())


def _field_of_view(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Perspective, "half_size", lambda self, aspect: (aspect * _half(self) * 1.01, _half(self) * 1.01))


def _half(camera: Perspective) -> float:
    return math.tan(math.radians(camera.fov) / 2)


def _not_decoded(patch: pytest.MonkeyPatch) -> None:
    everywhere(patch, srgb.srgb_to_linear, lambda c: np.asarray(c, dtype=np.float32))
    everywhere(patch, storage._linear, lambda codes: codes.astype(np.float32) / np.float32(255))


def _bump_inverted(patch: pytest.MonkeyPatch) -> None:
    right = texels.normals
    everywhere(patch, right, lambda heights, wrap: right(-heights, wrap))


def _mips_by_dropping(patch: pytest.MonkeyPatch) -> None:
    def wrong(pixels: Any) -> Iterator[Any]:
        yield pixels
        while max(pixels.shape[:2]) > 1:
            pixels = np.ascontiguousarray(pixels[:: min(2, pixels.shape[0]), :: min(2, pixels.shape[1])])
            yield pixels

    everywhere(patch, mipmap.levels, wrong)


def _unlinked(scene: Any, piece: Any, view: Any, lights: Any, shading: Any) -> Any:
    return scene, piece, view, tuple(light.model_copy(update={"only": None}) for light in lights), shading


def _pi(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(values, "math", SimpleNamespace(**(vars(math) | {"pi": 3.0})))


def _exposure(patch: pytest.MonkeyPatch) -> None:
    light, ambient = values.light_values, values.ambient_intensity
    everywhere(patch, light, lambda one, eye, stops: light(one, eye, stops * math.log2(2.1)))
    everywhere(patch, ambient, lambda scene, chosen, stops: ambient(scene, chosen, stops * math.log2(2.1)))


def _spot_halved(patch: pytest.MonkeyPatch) -> None:
    right = SpotLight.uniforms

    def wrong(self: SpotLight, eye: Any) -> dict[str, Any]:
        inner = None if self.inner is None else self.inner / 2
        return right(self.model_copy(update={"inner": inner, "outer": self.outer / 2}), eye)

    patch.setattr(SpotLight, "uniforms", wrong)


def _rotation_order(patch: pytest.MonkeyPatch) -> None:
    right = Transform.array

    def wrong(self: Transform) -> Any:
        if self.matrix is not None:
            return right(self)
        result = np.eye(4)
        result[:3, 3] = self.translate
        for turn in np.diag(self.rotate):
            result = result @ right(Transform(rotate=tuple(turn)))
        return result @ np.diag([*self.scale, 1.0])

    patch.setattr(Transform, "array", wrong)


def _upside_down(patch: pytest.MonkeyPatch) -> None:
    right = texels.Texels.read

    def wrong(self: Any) -> Any:
        stored = right(self)
        return replace(stored, levels=tuple(level[::-1] for level in stored.levels))

    patch.setattr(texels.Texels, "read", wrong)


# Eighteen faults in the code of this renderer.


def _parents_swapped(patch: pytest.MonkeyPatch) -> None:
    def wrong(placed: Any, item: Any) -> Any:
        matrix, parent = item.transform.array(), item.parent
        while parent is not None:
            above, parent = placed[parent]
            matrix = matrix @ above
        return matrix

    patch.setattr(assembly, "world_of", wrong)


def _no_grandparents(patch: pytest.MonkeyPatch) -> None:
    def wrong(placed: Any, item: Any) -> Any:
        own = item.transform.array()
        return own if item.parent is None else placed[item.parent][0] @ own

    patch.setattr(assembly, "world_of", wrong)


def not_welded(patch: pytest.MonkeyPatch) -> None:
    """Vertices at equal positions count as different ones."""
    patch.setattr(topology, "weld", lambda positions: np.arange(len(positions)))
    # The topologies of meshes of earlier tests are right.
    patch.setattr(topology, "_of", WeakKeyDictionary())
    patch.setattr(topology, "_recent", Lru(topology.KEPT))


def _crop_shifted(patch: pytest.MonkeyPatch) -> None:
    def wrong(self: Film) -> tuple[int, int, int, int]:
        x, y, w, h = self.crop or (0, 0, *self.size)
        return (x - min(x, 1), y, w, h)

    patch.setattr(Film, "window", property(wrong))


def _hand_kept(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Instance, "mirrored", False)


def _last_ambient(patch: pytest.MonkeyPatch) -> None:
    right = values.ambient_intensity

    def wrong(scene: Any, chosen: Any, stops: float) -> Any:
        return right(scene, tuple([i for i in chosen if scene.lights[i].ignores_normal][-1:]), stops)

    everywhere(patch, right, wrong)


def _mirrored_inside(patch: pytest.MonkeyPatch) -> None:
    right = values.normal_matrix
    everywhere(patch, right, lambda linear: right(linear) * np.sign(np.linalg.det(linear)))


def _three_lights(scene: Any, piece: Any, view: Any, lights: Any, shading: Any) -> Any:
    return scene, piece, view, lights[:3], shading


def _linked_to_the_next(scene: Any, piece: Any, view: Any, lights: Any, shading: Any) -> Any:
    names = [item.name for item in scene.objects]
    following = dict(zip(names, names[1:] + names[:1], strict=True))
    moved = (
        light if light.only is None else light.model_copy(update={"only": tuple(following[name] for name in light.only)})
        for light in lights
    )
    return scene, piece, view, tuple(moved), shading


def _one_corner(patch: pytest.MonkeyPatch) -> None:
    right = geometry.normals_and_angles

    def wrong(mesh: Any) -> Any:
        normals, angles = right(mesh)
        return normals, angles * np.array([1.0, 0.1, 0.1])

    everywhere(patch, right, wrong)


def _corner_for_centroid(patch: pytest.MonkeyPatch) -> None:
    right = facets.faceted

    def wrong(mesh: Any) -> Any:
        split = right(mesh)
        return replace(split, centroids=np.repeat(split.positions[::3], 3, axis=0))

    everywhere(patch, right, wrong)


def _worlds_rounded(patch: pytest.MonkeyPatch) -> None:
    right = assembly.world_of
    patch.setattr(assembly, "world_of", lambda *given: rounded(right(*given)).astype(np.float64))


def _stretched(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Perspective, "half_size", lambda self, aspect: (aspect**2 * _half(self), _half(self)))


def _weak_lobes_lost(patch: pytest.MonkeyPatch) -> None:
    def wrong(self: Phong, ambient: bool) -> Any:
        weak = isinstance(self.ks, tuple) and max(self.ks) < 0.3
        return Lambert(kd=self.kd) if weak else self

    patch.setattr(Phong, "canonical", wrong)


def _threshold_ignored(patch: pytest.MonkeyPatch) -> None:
    right = normals.with_normals
    everywhere(patch, right, lambda mesh, kind, threshold: right(mesh, kind, 180.0))


def _wrap_swapped(patch: pytest.MonkeyPatch) -> None:
    right = texels.Texels.wrap
    assert isinstance(right, property)
    patch.setattr(texels.Texels, "wrap", property(lambda self: right.fget(self)[::-1]))  # type: ignore[misc]


SPOT = {"type": "spot", "position": [2.0, 2.5, 3.0], "direction": [-2.0, -2.5, -3.0], "outer": 20.0, "intensity": 12.0}
DIM = {"type": "directional", "direction": [0.7, -0.4, -0.6], "colour": [0.9, 0.5, 0.2], "intensity": 0.3}

FAULTS = (
    Fault("normal matrix", "normals are transformed like points", _normal_matrix, with_ball(transform=WIDE)),
    Fault(
        "light position",
        "lights stand 0.01 farther to the right",
        uniforms(Placed, lambda given: {"position": given["position"] + np.array([0.01, 0.0, 0.0])}),
        lit(POINT),
    ),
    Fault("field of view", "the field of view is 1 % too wide", _field_of_view, with_cube()),
    Fault("textures not decoded", "sRGB-encoded texels are taken as linear", _not_decoded, pictured("kd")),
    Fault("bump inverted", "bumps are dents", _bump_inverted, pictured("bump_map", height=0.1)),
    Fault(
        "mipmaps by dropping",
        "a mipmap has every second texel of the one before it",
        _mips_by_dropping,
        minified,
        "tests/unit/textures/test_texture.py::test_every_mipmap_has_the_mean_of_the_whole",
    ),
    Fault("linking ignored", "lights reach every object", instances(_unlinked), linked),
    Fault("pi", "pi is 3", _pi, lit(POINT)),
    Fault("exposure base", "a stop of exposure is a factor of 2.1", _exposure, filmed(exposure=1.0)),
    Fault("spot angle", "the cones of spot lights are half as wide", _spot_halved, lit(SPOT)),
    Fault("rotation order", "objects are turned about z first and about x last", _rotation_order, with_cube()),
    Fault("textures upside down", "pictures stand on their heads", _upside_down, pictured("kd")),
    Fault("parents swapped", "the parent's transform is applied before the child's", _parents_swapped, family),
    Fault("grandparents ignored", "only the nearest parent moves an object", _no_grandparents, family),
    Fault(
        "not welded",
        "smoothing stops where triangles have vertices of their own",
        not_welded,
        with_ball(normals="smooth"),
    ),
    Fault("crop shifted", "a crop begins one pixel too far left", _crop_shifted, filmed(crop=[20, 10, 20, 20])),
    Fault(
        "handedness kept",
        "the bitangents of mirrored objects point the other way",
        _hand_kept,
        pictured("bump_map", MIRRORED, height=0.1),
    ),
    Fault(
        "one ambient light",
        "only the last ambient light counts",
        _last_ambient,
        lit(POINT, AMBIENT, AMBIENT | {"colour": [0.9, 0.5, 0.2]}),
    ),
    Fault("mirrored inside out", "normals of mirrored objects point inward", _mirrored_inside, with_ball(transform=MIRRORED)),
    Fault(
        "strength squared",
        "the strength of a light is the square of its intensity",
        uniforms(Light, lambda given: {"intensity": given["intensity"] ** 2}),
        lit(POINT | {"intensity": 3.0}, DIM),
    ),
    Fault(
        "three lights", "the fourth light and all after it are dark", instances(_three_lights), lit(SUN, DIM, AMBIENT, POINT)
    ),
    Fault("linked to the next", "linked lights reach the next object of the file", instances(_linked_to_the_next), linked),
    Fault(
        "fixed distance",
        "the least distance of a light is 4 in any unit of length",
        uniforms(Placed, lambda given: {"r_min": 4.0}),
        lit(POINT),
    ),
    Fault("one corner", "the first corner of a triangle weighs most in normals", _one_corner, with_ball(normals="smooth")),
    Fault(
        "corner for centroid", "flat faces are shaded at their first corner", _corner_for_centroid, with_ball(shading="flat")
    ),
    Fault("worlds rounded", "transforms are rounded before the eye is subtracted", _worlds_rounded, with_cube()),
    Fault("stretched", "the aspect of the picture counts twice", _stretched, with_cube()),
    Fault("weak lobes lost", "a highlight below 0.3 is simplified away", _weak_lobes_lost, lit(POINT)),
    Fault("threshold ignored", "every edge is smooth", _threshold_ignored, with_cube(normals="smooth", threshold=30.0)),
    Fault("wrap swapped", "the wrap modes of u and v are exchanged", _wrap_swapped, pictured("kd", wrap=["clamp", "repeat"])),
)
