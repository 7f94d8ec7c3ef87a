"""Pictures of materials, drawn without matplotlib: a lit sphere, a lobe as a solid, and a sphere in a white furnace."""

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
from glshade.scene.film import Film
from glshade.scene.object import Object, Transform
from glshade.scene.scene import Scene

Array = NDArray[np.float64]
Scale = Literal["linear", "log"]
Kind = Literal["polar", "lobe", "sphere", "furnace", "albedo", "fresnel"]
KINDS: tuple[Kind, ...] = get_args(Kind)
# The kinds of figures that a Renderer draws.
DRAWN: frozenset[Kind] = frozenset({"lobe", "sphere"})
# The kinds of figures that are pictures without axes.
PICTURES: frozenset[Kind] = DRAWN | {"furnace"}

# A logarithmic scale shows this many decades below the largest value.
DECADES = 4
# Half the width of the view of a lobe, whose largest radius is 1. It leaves room for the arrows.
REACH = 1.32
# The distance of the arrows' outer ends from the centre of a lobe.
ARROW = 1.22
# The colours of the arrows and of the surface [linear Rec. 709].
LIGHT_COLOUR, NORMAL_COLOUR, DISC_COLOUR = (0.9, 0.42, 0.0), (0.12, 0.12, 0.13), (0.55, 0.56, 0.58)
# The colour of lobes whose values have the same red, green and blue [linear Rec. 709].
NEUTRAL = (0.10, 0.28, 0.60)
# The sky of a furnace is drawn at half of white, so that a sphere that reflects more light than it receives is visible too.
SKY = 0.5


def radii(height: Array, scale: Scale, most: float) -> Array:
    """Returns the radii (N,) in [0, 1] at which values (N,) are drawn.

    height: (N,), the values.
    scale: "linear", or "log" for a scale of DECADES decades below `most`.
    most: the value that is drawn at radius 1; larger values are drawn at radius 1 too.
    """
    if most <= 0:
        return np.zeros_like(height)
    share: Array = np.minimum(height / most, 1.0)
    if scale == "linear":
        return share
    result: Array = np.maximum(1 + np.log10(np.maximum(share, 1e-300)) / DECADES, 0.0)
    return result


def sphere(material: Brdf, size: int = 256) -> Scene:
    """Returns a scene of a sphere under one directional light from the upper left, in a picture of size x size pixels."""
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
    """Returns (scene, largest value [1/sr]): a lobe as a solid, whose distance from the centre shows the value.

    The light comes from the left. One arrow shows the direction to the light, another the normal, and a disc shows the surface.
    Each point of the lobe has the colour of the light that is reflected in its direction.

    incidence: the angle of the light from the normal [rad].
    azimuth: the angle between the plane of incidence and the tangent [rad].
    quantity: the quantity that the lobe shows.
    scale: the scale of the distance; the largest value has the distance 1.
    size: the picture's width [pixels]; the height is three quarters of the width.
    neutral: the colour of a lobe whose values have the same red, green and blue [linear Rec. 709].
    """
    mesh_of_lobe = lobe.surface(material, incidence, azimuth, quantity)
    height = mesh_of_lobe.values.max(axis=1)
    unbounded = lobe.unbounded(material, incidence, azimuth)
    most = lobe.drawn_height(np.arccos(mesh_of_lobe.directions[:, 2]), height, unbounded)
    radius = radii(height, scale, most)
    # The arrow of the light ends just outside the lobe.
    to_light = lobe.direction(-incidence)
    end = float(radius[np.argmax(mesh_of_lobe.directions @ to_light)]) + 0.02
    objects = [
        # The disc lies slightly below the centre of the lobe, so that the disc hides no part of the lobe.
        _object("cylinder", DISC_COLOUR, scale=(1.0, 0.008, 1.0), translate=(0.0, -0.012, 0.0)),
        *_arrow(np.zeros(3), np.array([0.0, ARROW, 0.0]), NORMAL_COLOUR, 0.008),
        *_arrow(ARROW * _world(to_light), end * _world(to_light), LIGHT_COLOUR, 0.014),
    ]
    if most > 0:
        coloured = bool(np.any(np.ptp(mesh_of_lobe.values, axis=1) > 1e-6 * most))
        share = mesh_of_lobe.values / np.maximum(height, 1e-300)[:, None]
        colours = share if coloured else np.broadcast_to(neutral, share.shape)
        rgba = np.column_stack([colours, np.ones(len(colours))])
        vertices = _world(mesh_of_lobe.vertices(radius))
        mesh = Mesh.build(vertices, mesh_of_lobe.triangles, None, None, rgba)
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
    """Returns name of an arrow -> (x, y) of its outer end in the picture of a lobe, from 0 to 1, x to the right and y up."""
    camera = _camera()
    view = camera.view(np.array([[-1.0, -1, -1], [1, 1, 1]]), 4 / 3)
    ends = {"l": ARROW * _world(lobe.direction(-incidence)), "n": np.array([0.0, ARROW, 0.0])}
    places = {name: (end - view.eye) @ view.axes.T for name, end in ends.items()}
    return {
        name: (float(0.5 + 0.5 * p[0] / view.half_width), float(0.5 + 0.5 * p[1] / view.half_height))
        for name, p in places.items()
    }


def furnace(material: Brdf, size: int = 256) -> tuple[Image, tuple[float, float]]:
    """Returns (picture, (least, largest) albedo) of a sphere under a uniform sky, which is a linear grey of 0.5.

    The sphere is darker than the sky where it loses light, and brighter where it reflects more light than it receives.
    """
    albedo, coverage = lobe.furnace(material, size)
    c = coverage[..., None]
    pixels = SKY * (c * albedo + (1 - c))
    inside = albedo[coverage == 1]
    return Image(pixels.astype(np.float32)), (float(inside.min()), float(inside.max()))


def side_by_side(images: list[Image], background: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Image:
    """Returns the pictures in one row, as float32 and opaque, over a background [linear Rec. 709]."""
    columns = []
    for image in images:
        pixels = image.linear().pixels
        if image.channels == "RGBA":
            pixels = pixels[..., :3] + (1 - pixels[..., 3:]) * np.array(background, dtype=np.float32)
        columns.append(pixels)
    return Image(np.concatenate(columns, axis=1).astype(np.float32))


def matplotlib_colour(colour: Array) -> tuple[float, float, float]:
    """Returns a linear Rec. 709 colour (3,) in the form that matplotlib takes: sRGB-encoded, from 0 to 1."""
    r, g, b = (float(c) for c in linear_to_srgb(colour))
    return r, g, b


def _camera() -> Orthographic:
    """Returns the camera of a lobe: it looks from beside the plane of incidence and slightly above the surface."""
    # The target is above the surface, because the lower half of the picture would be empty otherwise.
    return Orthographic(eye=(0.5, 2.22, 5.0), target=(0.0, 0.52, 0.0), height=2 * REACH * 3 / 4)


def _world(local: Array) -> Array:
    """Returns vectors of the local frame (n = +z) in world space, where the normal is +y and x stays x.

    local: (..., 3), with any leading shape. The result has the same shape.
    """
    result: Array = local @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    return result


def _object(shape: str, colour: tuple[float, float, float], **transform: Any) -> Object:
    """Returns a matte object. colour: linear Rec. 709. transform: the keys of a Transform."""
    material: Any = {"brdf": "lambert", "kd": colour}
    chosen: Any = shape
    return Object(shape=chosen, material=material, transform=Transform(**transform))


def _arrow(start: Array, end: Array, colour: tuple[float, float, float], radius: float) -> list[Object]:
    """Returns the shaft and the head of an arrow from start (3,) to end (3,). radius: that of the shaft."""
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    axes = np.stack([across, along, np.cross(across, along)], axis=1)
    head = min(9 * radius, 0.8 * length)
    # Cylinders and cones reach from y = -1 to 1 and have a radius of 1.
    parts = (("cylinder", radius, 0.0, length - head), ("cone", 3.2 * radius, length - head, length))
    objects = []
    for shape, width, low, high in parts:
        matrix = np.eye(4)
        matrix[:3, :3] = axes * [width, (high - low) / 2, width]
        matrix[:3, 3] = start + along * (low + high) / 2
        objects.append(_object(shape, colour, matrix=tuple(map(tuple, matrix.tolist()))))
    return objects
