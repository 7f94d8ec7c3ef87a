"""Scenes: the ten small scenes of the corpus. Together they use every shading rate, textures, several samples, blending,
cut-outs, all falloffs, both cameras, presets, a background with alpha, and 8-bit and float pictures.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from glshade.files import replacing
from glshade.image.contents import PictureContents
from glshade.image.file import write

# Width and height of the pictures [pixels]: large enough for highlights and small triangles, small enough for 1,600 pairs.
SIZE = (192, 128)
# Width and height of the texture [texels], and the width of one of its squares.
TEXELS, SQUARE = 64, 8
# The file of the texture, in the folder of the corpus.
TEXTURE = "texture.png"

Document = dict[str, Any]
# Name of a scene -> function that makes its document.
SCENES: dict[str, Callable[[], Document]] = {}
# Scenes whose pictures are stored as floats, in EXR files. The others are stored in 8 bits, in PNG files.
FLOATS = frozenset({"near", "cut-out"})


def scene(function: Callable[[], Document]) -> Callable[[], Document]:
    """Adds a function that makes a scene to SCENES. Its name has "-" for "_"."""
    SCENES[function.__name__.replace("_", "-")] = function
    return function


def write_scene(folder: Path, name: str, size: tuple[int, int] = SIZE) -> Path:
    """Writes the file of a scene and the texture, if they are missing, and returns the path of the scene's file.

    size: width and height of its picture [pixels]. Errors: KeyError for an unknown name; GlshadeError, OSError.
    """
    path = folder / name / "scene.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    if not (folder / TEXTURE).exists():
        write(folder / TEXTURE, PictureContents(_texture(), "srgb", premultiplied=False))
    document = SCENES[name]()
    document["film"] = {"size": list(size), **document.get("film", {})}
    with replacing(path) as beside:
        beside.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return path


def _texture() -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Returns the texture (TEXELS, TEXELS, 4): coloured squares, each with a gradient; half of the squares are transparent."""
    y, x = np.mgrid[:TEXELS, :TEXELS]
    dark = (x // SQUARE + y // SQUARE) % 2
    red, green = 60 + 150 * dark + x % SQUARE * 4, 200 - 120 * dark + y % SQUARE * 4
    return np.stack([red, green, 90 + 2 * (x // SQUARE) * (y // SQUARE), 255 - 255 * dark], axis=2).astype(np.uint8)


def _thing(shape: Any, at: tuple[float, float, float], material: Any, **more: Any) -> Document:
    transform = {"translate": list(at), **more.pop("transform", {})}
    return {"shape": shape, "transform": transform, "material": material, **more}


def _ball(segments: int = 48) -> Document:
    return {"type": "sphere", "segments": segments, "rings": segments // 2}


KEY = {"type": "directional", "name": "key", "direction": [0.55, -0.7, -0.75], "intensity": 0.8}
FILL = {"type": "directional", "name": "fill", "direction": [-1, 0.05, -0.5], "intensity": 0.2, "colour": [0.6, 0.75, 1]}
AMBIENT = {"type": "ambient", "intensity": 0.08}
RIG = [KEY, FILL, AMBIENT]
FLAT_CAMERA = {"type": "orthographic", "eye": [0, 0, 10], "fit": True}
TEXTURED = {"texture": f"../{TEXTURE}"}


@scene
def rates() -> Document:
    """Returns a scene with three models at three shading rates, on coarse spheres, with four samples."""
    materials: Document = {
        "matte": {"brdf": "lambert", "kd": [0.8, 0.33, 0.15]},
        "shiny": {"brdf": "phong", "kd": [0.62, 0.05, 0.07], "ks": 0.65, "exponent": 24},
        "half": {"brdf": "blinn_phong", "kd": [0.03, 0.27, 0.55], "ks": 0.65, "exponent": 60},
    }
    places = [(x, y) for y in range(3) for x in range(3)]
    objects = [
        _thing(_ball(22), (2.3 * x, -2.3 * y, 0), list(materials)[x], shading=("flat", "gouraud", "phong")[y])
        for x, y in places
    ]
    film = {"samples": 4, "background": [0.02, 0.022, 0.028]}
    return {"objects": objects, "lights": RIG, "camera": FLAT_CAMERA, "film": film, "materials": materials}


@scene
def textured() -> Document:
    """Returns a scene with a textured floor in perspective, whose mipmaps show, and a sphere with bumps; one sample."""
    objects = [
        _thing({"type": "plane", "segments": 8}, (0, -1, -4), "floor", transform={"scale": [4, 1, 8]}),
        _thing(_ball(), (-0.8, 0, 0), "bumpy"),
        _thing("cube", (1.1, -0.3, -0.5), "box", transform={"rotate": [0, 35, 0], "scale": [0.7, 0.7, 0.7]}),
    ]
    materials = {
        "floor": {"brdf": "phong", "kd": TEXTURED, "ks": 0.3, "exponent": 30},
        "bumpy": {
            "brdf": "blinn_phong",
            "kd": [0.5, 0.4, 0.2],
            "ks": 0.5,
            "exponent": 50,
            "bump_map": {**TEXTURED, "height": 0.02},
        },
        "box": {"brdf": "lambert", "kd": TEXTURED},
    }
    camera = {"eye": [0, 1.2, 5], "target": [0, -0.4, 0], "fov": 40}
    return {"objects": objects, "lights": RIG, "camera": camera, "materials": materials}


@scene
def falloffs() -> Document:
    """Returns a scene with spheres beside point lights with each falloff, with four samples."""
    objects = [_thing(_ball(), (2.3 * x, -2.3 * y, 0), "chalk", name=f"ball{x}{y}") for y in range(3) for x in range(4)]
    lights: list[Document] = [
        {
            "type": "point",
            "name": f"lamp{y}",
            "position": [-1.8, 0.8 - 2.3 * y, 3],
            "falloff": falloff,
            "intensity": intensity,
            "only": [f"ball{x}{y}" for x in range(4)],
        }
        for y, (falloff, intensity) in enumerate((("none", 0.85), ("1/r", 2.3), ("1/r^2", 6.2)))
    ]
    materials = {"chalk": {"brdf": "lambert", "kd": [0.85, 0.8, 0.7]}}
    film = {"samples": 4, "background": [0.012, 0.014, 0.019]}
    return {"objects": objects, "lights": [*lights, AMBIENT], "camera": FLAT_CAMERA, "film": film, "materials": materials}


@scene
def brushed() -> Document:
    """Returns a scene with anisotropic highlights on a sphere, a cylinder and a torus, with four samples."""
    model = {"brdf": "ashikhmin_shirley", "kd": [0.3, 0.2, 0.13], "ks": [0.8, 0.62, 0.45]}
    materials = {"along": {**model, "pu": 300, "pv": 8}, "across": {**model, "pu": 8, "pv": 300}}
    objects = [
        _thing(_ball(64), (-2.4, 0, 0), "along"),
        _thing({"type": "cylinder", "segments": 64}, (0, 0, 0), "across", transform={"rotate": [-17, 0, -12]}),
        _thing({"type": "torus", "segments": 96, "sides": 48}, (2.6, 0, 0), "along", transform={"rotate": [55, 0, 25]}),
    ]
    lights = [{**KEY, "intensity": 0.22}, {**FILL, "intensity": 0.11}, {**AMBIENT, "intensity": 0.3}]
    film = {"samples": 4, "background": [0.012, 0.014, 0.019]}
    return {"objects": objects, "lights": lights, "camera": FLAT_CAMERA, "film": film, "materials": materials}


@scene
def spots() -> Document:
    """Returns a scene with a red, a green and a blue spot light on a wall in perspective; one sample."""
    places = ((0, 0.85, (1, 0, 0)), (-0.8, -0.5, (0, 1, 0)), (0.8, -0.5, (0, 0, 1)))
    lights: list[Document] = [
        {
            "type": "spot",
            "position": [x, y, 5],
            "direction": [0, 0, -1],
            "inner": 12,
            "outer": 16,
            "falloff": "none",
            "intensity": 0.85,
            "colour": list(colour),
        }
        for x, y, colour in places
    ]
    objects = [
        _thing({"type": "plane", "segments": 64}, (0, 0, 0), "wall", transform={"rotate": [90, 0, 0], "scale": [6, 1, 6]}),
        _thing(_ball(), (0, 0, 0.4), "ball", transform={"scale": [0.5, 0.5, 0.5]}),
    ]
    materials = {
        "wall": {"brdf": "oren_nayar", "kd": 0.9, "sigma": 0.3},
        "ball": {"brdf": "plastic", "kd": 0.5},
    }
    camera = {"eye": [0, 0, 7], "target": [0, 0, 0], "fov": 40}
    return {"objects": objects, "lights": [*lights, {**AMBIENT, "intensity": 0.02}], "camera": camera, "materials": materials}


@scene
def metals() -> Document:
    """Returns a scene with six presets under three lights, supersampled."""
    names = ("gold", "copper", "brushed_steel", "red_plastic", "car_paint", "satin")
    objects = [_thing(_ball(), (2.25 * (i % 3), -2.25 * (i // 3), 0), name) for i, name in enumerate(names)]
    rim = {"type": "directional", "name": "rim", "direction": [-0.45, -0.8, 0.55], "intensity": 0.3}
    film = {"supersample": 2, "background": [0.03, 0.03, 0.03]}
    return {"objects": objects, "lights": [*RIG, rim], "camera": FLAT_CAMERA, "film": film}


@scene
def solids() -> Document:
    """Returns a scene with solids that cut through each other, per vertex, over a background with alpha; one sample."""
    objects = [
        _thing("cube", (-0.6, 0, 0), "red", transform={"rotate": [20, 30, 0]}, shading="gouraud"),
        _thing({"type": "cone", "segments": 48}, (0.5, 0.1, 0.3), "green", transform={"rotate": [0, 0, -20]}),
        _thing(
            {"type": "torus", "segments": 48, "sides": 24},
            (0.2, 0, 0),
            "blue",
            transform={"rotate": [70, 0, 10]},
            shading="gouraud",
        ),
    ]
    materials = {
        "red": {"brdf": "phong", "kd": [0.7, 0.1, 0.08], "ks": 0.3, "exponent": 20},
        "green": {"brdf": "blinn_phong", "kd": [0.1, 0.5, 0.15], "ks": 0.5, "exponent": 80},
        "blue": {"brdf": "minnaert", "kd": [0.15, 0.2, 0.7]},
    }
    camera = {"eye": [1, 1.5, 5.5], "target": [0, 0, 0], "fov": 38}
    film = {"background": [0.2, 0.3, 0.4, 0.25]}
    return {"objects": objects, "lights": RIG, "camera": camera, "film": film, "materials": materials}


@scene
def cut_out() -> Document:
    """Returns a scene with a leaf, cut out by alpha, before a sphere and behind coloured glass; one sample, floats."""
    objects = [
        _thing(_ball(), (0, 0, -1), "ball"),
        _thing("plane", (-0.6, 0, 0.6), "leaf", transform={"rotate": [80, 15, 0]}, sides="both"),
        _thing("plane", (0.9, 0, 1.2), "pane", transform={"rotate": [90, -20, 0], "scale": [0.6, 1, 0.9]}),
    ]
    materials = {
        "ball": {"brdf": "ggx", "kd": [0.5, 0.3, 0.2], "f0": 0.2, "roughness": 0.4},
        "leaf": {"brdf": "lambert", "kd": TEXTURED, "alpha_mode": "mask"},
        "pane": {"brdf": "phong", "kd": [0.1, 0.3, 0.6], "ks": 0.4, "alpha": 0.4, "alpha_mode": "blend"},
    }
    camera = {"eye": [0, 0.6, 6], "target": [0, 0, 0], "fov": 34}
    return {"objects": objects, "lights": RIG, "camera": camera, "materials": materials}


@scene
def near() -> Document:
    """Returns a scene with coarse shapes that cross the picture's border, and values above 1; four samples, floats."""
    objects = [
        _thing({"type": "icosphere", "subdivisions": 2}, (-0.9, 0.2, 0), "bright", shading="flat"),
        _thing({"type": "icosphere", "subdivisions": 3}, (1.2, -0.3, -0.6), "dull"),
        _thing({"type": "plane", "segments": 4}, (0, -1.2, 0), "dull", transform={"scale": [6, 1, 6]}),
    ]
    materials = {
        "bright": {"brdf": "phong", "kd": [0.9, 0.7, 0.3], "ks": 0.9, "exponent": 12},
        "dull": {"brdf": "burley", "kd": [0.3, 0.4, 0.6]},
    }
    lights = [{**KEY, "intensity": 2.5}, {"type": "point", "name": "lamp", "position": [1, 1.5, 2], "intensity": 3}, AMBIENT]
    camera = {"eye": [0, 0.1, 2.6], "target": [0.1, 0, 0], "fov": 52}
    return {"objects": objects, "lights": lights, "camera": camera, "film": {"samples": 4}, "materials": materials}


@scene
def crowd() -> Document:
    """Returns a scene with forty spheres of a few pixels each, whose outlines are a large share of the picture; one sample."""
    objects = [
        _thing(
            {"type": "icosphere", "subdivisions": 2},
            (2.4 * x + 0.3 * (y % 2), -2.4 * y + 0.17 * x, 0.1 * (x * y % 5)),
            ("bone", "ink")[(x + y) % 2],
        )
        for y in range(5)
        for x in range(8)
    ]
    materials = {
        "bone": {"brdf": "oren_nayar", "kd": [0.8, 0.75, 0.6]},
        "ink": {"brdf": "ward", "kd": [0.05, 0.08, 0.2]},
    }
    film = {"background": [0.05, 0.05, 0.06]}
    return {"objects": objects, "lights": RIG, "camera": FLAT_CAMERA, "film": film, "materials": materials}
