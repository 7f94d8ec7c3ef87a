"""Faults of scenes: the picture is right for another scene than the one that is asked for.

Each function takes a case and a strength and returns the pixels of the picture, or None where it does not apply to the scene.
A scene is changed as a document of JSON types without default values.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from glshade.bench.corpus.case import Case
from glshade.bench.corpus.kinds import regression

Array = NDArray[Any]
Document: TypeAlias = "dict[str, Any]"


def scene_fault(*strengths: Any) -> Callable[[Callable[[Document, Any], Document | None]], Callable[[Case, Any], Array | None]]:
    """Returns a decorator that adds a function (document, strength) -> changed document to the regressions.

    The function may change the document that it gets. It returns None where the fault does not apply.
    """

    def add(function: Callable[[Document, Any], Document | None]) -> Callable[[Case, Any], Array | None]:
        @wraps(function)
        def make(case: Case, strength: Any) -> Array | None:
            return case.edited(lambda document: function(document, strength))

        return regression(*strengths)(make)

    return add


def _multiplied(value: Any, factor: float) -> Any:
    """Returns a number, a list of numbers or a texture with the given factor; other values as they are."""
    if isinstance(value, dict):
        return {**value, "factor": _multiplied(value.get("factor", 1.0), factor)}
    if isinstance(value, list):
        return [_multiplied(item, factor) for item in value]
    return value * factor if isinstance(value, int | float) else value


def _materials(document: Document, keys: tuple[str, ...], factor: float) -> Document | None:
    """Returns the document with these keys of its materials multiplied; None where no material has one of them."""
    found = False
    for material in document.get("materials", {}).values():
        for key in keys:
            if key in material:
                found = True
                material[key] = _multiplied(material[key], factor)
    return document if found else None


def _transform(document: Document, number: int) -> Document:
    """Returns the transform of an object, which may be changed."""
    transform: Document = document["objects"][number].setdefault("transform", {})
    return transform


def _light_removed(document: Document, number: int) -> Document | None:
    if number >= len(document["lights"]):
        return None
    del document["lights"][number]
    return document


@scene_fault(0, 1, 2)
def light_lost(document: Document, number: int) -> Document | None:
    """The first, the second or the third light is gone."""
    return _light_removed(document, number)


@scene_fault(0.5, 0.9, 0.97)
def light_weaker(document: Document, factor: float) -> Document:
    """The first light is too weak."""
    light = document["lights"][0]
    light["intensity"] = factor * light.get("intensity", 1.0)
    return document


@scene_fault(0.0, 0.5, 0.8)
def ambient_weaker(document: Document, factor: float) -> Document:
    """The ambient light is too weak or gone."""
    for light in document["lights"]:
        if light["type"] == "ambient":
            light["intensity"] = factor * light.get("intensity", 1.0)
    return document


@scene_fault(10.0, 3.0, 1.0)
def light_turned(document: Document, degrees: float) -> Document | None:
    """The first light with a direction shines in another direction."""
    light = next((light for light in document["lights"] if "direction" in light), None)
    if light is None:
        return None
    x, y, z = light["direction"]
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    light["direction"] = [float(cos * x + sin * z), y, float(cos * z - sin * x)]
    return document


@scene_fault(1.0, 0.3, 0.1)
def lamp_moved(document: Document, length: float) -> Document | None:
    """The first light with a position stands elsewhere."""
    light = next((light for light in document["lights"] if "position" in light), None)
    if light is None:
        return None
    light["position"][0] += length
    return document


@scene_fault(0.7, 0.9, 0.97)
def light_tinted(document: Document, factor: float) -> Document:
    """The first light lacks blue."""
    light = document["lights"][0]
    red, green, blue = light.get("colour", [1.0, 1.0, 1.0])
    # The red channel of a light may be 0, and so may the blue one; then another channel shows the fault.
    light["colour"] = [red, green * factor, blue * factor] if not red else [red * factor, green, blue * factor]
    return document


@scene_fault("1/r^2", "1/r", "none")
def falloff_wrong(document: Document, falloff: str) -> Document | None:
    """Light of the lamps falls off by another law."""
    lamps = [light for light in document["lights"] if light["type"] == "point" and light.get("falloff", "1/r^2") != falloff]
    for light in lamps:
        light["falloff"] = falloff
    return document if lamps else None


@scene_fault(0, 1, 2)
def object_lost(document: Document, number: int) -> Document | None:
    """The first, the second or the third object is gone."""
    if number >= len(document["objects"]):
        return None
    gone = document["objects"].pop(number).get("name")
    for light in document["lights"]:
        if gone in (light.get("only") or []):
            light["only"].remove(gone)
    return document


@scene_fault(0.1, 0.03, 0.01)
def object_moved(document: Document, length: float) -> Document:
    """The first object lies elsewhere."""
    transform = _transform(document, 0)
    x, y, z = transform.get("translate", [0, 0, 0])
    transform["translate"] = [x + length, y + length / 2, z]
    return document


@scene_fault(10.0, 3.0, 1.0)
def object_turned(document: Document, degrees: float) -> Document:
    """The second object is turned."""
    transform = _transform(document, 1)
    x, y, z = transform.get("rotate", [0, 0, 0])
    transform["rotate"] = [x + degrees, y + degrees, z]
    return document


@scene_fault(1.1, 1.03, 1.01)
def object_larger(document: Document, factor: float) -> Document:
    """The first object is too large."""
    transform = _transform(document, 0)
    scale = transform.get("scale", [1.0, 1.0, 1.0])
    transform["scale"] = _multiplied(scale, factor)
    return document


@scene_fault(1, 2, 3)
def material_exchanged(document: Document, number: int) -> Document | None:
    """The first object and another one have each other's materials."""
    objects = document["objects"]
    if number >= len(objects) or objects[0]["material"] == objects[number]["material"]:
        return None
    objects[0]["material"], objects[number]["material"] = objects[number]["material"], objects[0]["material"]
    return document


@scene_fault(0.5, 0.9, 0.97)
def diffuse_weaker(document: Document, factor: float) -> Document | None:
    """The diffuse reflectance of all materials is too small."""
    return _materials(document, ("kd",), factor)


@scene_fault(0.0, 0.5, 0.9)
def specular_weaker(document: Document, factor: float) -> Document | None:
    """The specular reflectance of all materials is too small or gone."""
    return _materials(document, ("ks",), factor)


@scene_fault(1.5, 1.1, 1.03)
def roughness_wrong(document: Document, factor: float) -> Document | None:
    """The widths or exponents of all highlights are too large."""
    return _materials(document, ("exponent", "pu", "roughness", "sigma", "alpha_x"), factor)


@scene_fault("flat", "gouraud", "first")
def rate_lower(document: Document, rate: str) -> Document:
    """Objects are shaded per face or per vertex; at the lowest strength, only the first object is, per vertex."""
    for item in document["objects"][:1] if rate == "first" else document["objects"]:
        item["shading"] = "flat" if rate == "flat" else "gouraud"
    return document


@scene_fault(3, 2, 1.3)
def tessellation_coarser(document: Document, factor: float) -> Document | None:
    """Spheres and other round shapes have too few segments."""
    found = False
    for item in document["objects"]:
        shape = item["shape"]
        for key in ("segments", "rings", "sides"):
            # A plane looks the same with fewer segments.
            if isinstance(shape, dict) and key in shape and shape["type"] != "plane":
                shape[key] = max(4, int(shape[key] / factor))
                found = True
    return document if found else None


@scene_fault(10.0, 3.0, 1.0)
def camera_turned(document: Document, degrees: float) -> Document:
    """The camera has gone round the scene."""
    document["camera"]["turn"] = degrees
    return document


@scene_fault(0.2, 0.05, 0.005)
def background_wrong(document: Document, amount: float) -> Document:
    """The background has more red and green."""
    red, green, *rest = document.get("film", {}).get("background", [0.0, 0.0, 0.0])
    document.setdefault("film", {})["background"] = [red + amount, green + amount, *rest]
    return document
