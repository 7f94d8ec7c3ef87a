"""Pictures of materials: a lit sphere, a lobe as a solid, a sphere in a white furnace. Drawn by glshade, without matplotlib."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf
from glshade.catalogue import lobe
from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb
from glshade.mesh.mesh import Mesh
from glshade.scene.camera import Orthographic
from glshade.scene.scene import Film, Object, Scene, Transform

Array = NDArray[np.float64]
Scale = Literal["linear", "log"]
Kind = Literal["polar", "lobe", "sphere", "furnace", "albedo", "fresnel"]
KINDS: tuple[Kind, ...] = get_args(Kind)
# Those that glshade draws itself, on the GPU.
DRAWN: frozenset[Kind] = frozenset({"lobe", "sphere"})
# Those that are pictures, without axes.
PICTURES: frozenset[Kind] = DRAWN | {"furnace"}

# A log scale shows this many decades below the largest value.
DECADES = 4
# Half the width of the view of a lobe, whose largest radius is 1: arrows are longer.
REACH = 1.32
# Of the lobe's arrows: length, and of lobes without a colour of their own (all linear Rec. 709).
ARROW = 1.22
LIGHT_COLOUR, NORMAL_COLOUR, DISC_COLOUR = (0.9, 0.42, 0.0), (0.12, 0.12, 0.13), (0.55, 0.56, 0.58)
NEUTRAL = (0.10, 0.28, 0.60)
# The sky of a furnace as it is shown: half of white, so that a sphere that gives back too much is seen as well.
SKY = 0.5


def radii(height: Array, scale: Scale, most: float) -> Array:
    """(N,) in [0, 1]: how far out values (N,) are drawn, `most` and more at 1; log: over DECADES decades."""
    if most <= 0:
        return np.zeros_like(height)
    share: Array = np.minimum(height / most, 1.0)
    if scale == "linear":
        return share
    result: Array = np.maximum(1 + np.log10(np.maximum(share, 1e-300)) / DECADES, 0.0)
    return result


def sphere(material: Brdf, size: int = 256) -> Scene:
    """A sphere under one directional light from the upper left, seen from afar: the light that leaves from each point."""
    return Scene.model_validate(
        {
            "description": f"A sphere of {material.brdf} under one directional light",
            "objects": [{"shape": {"type": "sphere", "segments": 128, "rings": 64}, "material": material}],
            "lights": [{"type": "directional", "direction": (0.55, -0.6, -0.6)}],
            "camera": {"type": "orthographic", "eye": (0, 0, 4), "target": (0, 0, 0), "height": 2.18},
            "film": {"size": (size, size), "samples": 4, "background": (0, 0, 0, 0)},
        }
    )


def solid(
    material: Brdf,
    incidence: float,
    azimuth: float = 0.0,
    quantity: lobe.Quantity = "f cos",
    scale: Scale = "linear",
    size: int = 400,
    neutral: tuple[float, float, float] = NEUTRAL,
) -> tuple[Scene, float]:
    """(scene, largest value [1/sr]): the lobe of light from the left at `incidence` [radians], its largest value drawn at 1.

    An arrow is the light, another the normal, the disc is the surface. Each direction has the colour of what leaves there; a
    lobe without colour is `neutral`.
    """
    found = lobe.surface(material, incidence, azimuth, quantity)
    height = found.values.max(axis=1)
    endless = lobe.unbounded(material, incidence, azimuth)
    most = lobe.drawn_height(np.arccos(found.directions[:, 2]), height, endless)
    out = radii(height, scale, most)
    # The light ends where the lobe begins.
    to_light = lobe.direction(-incidence)
    end = float(out[np.argmax(found.directions @ to_light)]) + 0.02
    objects = [
        # The surface, a hair below where the lobe stands.
        _object("cylinder", DISC_COLOUR, scale=(1.0, 0.008, 1.0), translate=(0.0, -0.012, 0.0)),
        *_arrow(np.zeros(3), np.array([0.0, ARROW, 0.0]), NORMAL_COLOUR, 0.008),
        *_arrow(ARROW * _world(to_light), end * _world(to_light), LIGHT_COLOUR, 0.014),
    ]
    if most > 0:
        coloured = bool(np.any(np.ptp(found.values, axis=1) > 1e-6 * most))
        share = found.values / np.maximum(height, 1e-300)[:, None]
        colours = share if coloured else np.broadcast_to(neutral, share.shape)
        rgba = np.column_stack([colours, np.ones(len(colours))])
        vertices = _world(found.vertices(out))
        mesh = Mesh.build(vertices, found.triangles, None, None, rgba)
        material_of_lobe: Any = {"brdf": "lambert", "kd": 0.95}
        objects.append(Object(mesh=mesh, material=material_of_lobe, normals="smooth", threshold=180.0, sides="both"))
    lights: Any = [
        {"type": "directional", "direction": (-0.4, -0.8, -1.0), "intensity": 0.85},
        {"type": "directional", "direction": (0.9, -0.2, -0.6), "intensity": 0.2},
        {"type": "ambient", "intensity": 0.14},
    ]
    scene = Scene(
        description=f"The lobe of {material.brdf} at {np.degrees(incidence):g} degrees",
        objects=tuple(objects),
        lights=lights,
        camera=_camera(),
        film=Film(size=(size, size * 3 // 4), samples=4, background=(0.0, 0.0, 0.0, 0.0)),
    )
    return scene, most


def tips(incidence: float) -> dict[str, tuple[float, float]]:
    """name -> (x, y) in the picture of a lobe, from 0 to 1 each, x to the right and y up: the ends of its arrows."""
    camera = _camera()
    view = camera.view(np.array([[-1.0, -1, -1], [1, 1, 1]]), 4 / 3)
    ends = {"l": ARROW * _world(lobe.direction(-incidence)), "n": np.array([0.0, ARROW, 0.0])}
    places = {name: (end - view.eye) @ view.axes.T for name, end in ends.items()}
    return {
        name: (float(0.5 + 0.5 * p[0] / view.half_width), float(0.5 + 0.5 * p[1] / view.half_height))
        for name, p in places.items()
    }


def furnace(material: Brdf, size: int = 256) -> tuple[Image, tuple[float, float]]:
    """(picture, (least, largest) albedo): a sphere under a uniform sky that is shown as a grey of 0.5, linear.

    Darker than the sky: light is lost; brighter: more leaves than arrives.
    """
    found, coverage = lobe.furnace(material, size)
    c = coverage[..., None]
    pixels = SKY * (c * found + (1 - c))
    seen = found[coverage == 1]
    return Image(pixels.astype(np.float32)), (float(seen.min()), float(seen.max()))


def side_by_side(images: list[Image], background: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Image:
    """The pictures in one row, float32 and opaque: where they are transparent, the background (linear Rec. 709)."""
    rows = []
    for image in images:
        pixels = image.linear().pixels
        if image.channels == "RGBA":
            pixels = pixels[..., :3] + (1 - pixels[..., 3:]) * np.array(background, dtype=np.float32)
        rows.append(pixels)
    return Image(np.concatenate(rows, axis=1).astype(np.float32))


def shown(colour: Array) -> tuple[float, float, float]:
    """A linear Rec. 709 colour (3,) as matplotlib takes it: sRGB-encoded, 0 to 1."""
    r, g, b = (float(c) for c in linear_to_srgb(colour))
    return r, g, b


def _camera() -> Orthographic:
    # From the side of the plane of incidence, a little above the surface; the middle of the picture is above the surface too.
    return Orthographic(eye=(0.5, 2.22, 5.0), target=(0.0, 0.52, 0.0), height=2 * REACH * 3 / 4)


def _world(local: Array) -> Array:
    """(..., 3): the local frame with its normal up: x stays, z is y, y goes back."""
    result: Array = local @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    return result


def _object(shape: str, colour: tuple[float, float, float], **transform: Any) -> Object:
    material: Any = {"brdf": "lambert", "kd": colour}
    chosen: Any = shape
    return Object(shape=chosen, material=material, transform=Transform(**transform))


def _arrow(start: Array, end: Array, colour: tuple[float, float, float], radius: float) -> list[Object]:
    """A shaft and a head, from start to end."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    axes = np.stack([across, along, np.cross(across, along)], axis=1)
    head = min(9 * radius, 0.8 * length)
    # Both shapes reach from y = -1 to 1.
    parts = (("cylinder", radius, 0.0, length - head), ("cone", 3.2 * radius, length - head, length))
    objects = []
    for shape, wide, low, high in parts:
        matrix = np.eye(4)
        matrix[:3, :3] = axes * [wide, (high - low) / 2, wide]
        matrix[:3, 3] = start + along * (low + high) / 2
        objects.append(_object(shape, colour, matrix=tuple(map(tuple, matrix.tolist()))))
    return objects
