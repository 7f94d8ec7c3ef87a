"""Hypothesis strategies that are derived from what the models and lights declare, so that new ones are tested without edits."""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from glshade import BRDFS, LIGHTS, Scene
from glshade.brdfs import Brdf, Parameter
from glshade.scene.shape import SHAPES as PRIMITIVES


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Returns a strategy for float32 numbers within [low, high], with a uniform logarithm if they span more than a decade."""
    low32, high32 = float(np.float32(low)), float(np.float32(high))
    if low32 > 0 and high32 > 10 * low32:
        spread = st.floats(math.log(low32), math.log(high32)).map(
            lambda x: min(max(float(np.float32(math.exp(x))), low32), high32)
        )
        return spread | st.sampled_from([low32, high32])
    return st.floats(low32, high32, width=32)


def values(model: type[Brdf], name: str, declared: Parameter) -> st.SearchStrategy[Any]:
    """Returns a strategy for values of a parameter within its usual range."""
    number = numbers(*declared.usual)
    return st.tuples(number, number, number) if model.is_colour(name) else number


def materials(name: str, **fixed: Any) -> st.SearchStrategy[Brdf]:
    """Returns a strategy for materials of one model. Parameters are in their usual ranges, except those given in `fixed`."""
    model = BRDFS[name]
    chosen = {key: values(model, key, declared) for key, declared in model.parameters().items() if key not in fixed}
    chosen |= {key: st.sampled_from(get_args(model.model_fields[key].annotation)) for key in model.choices()}
    return st.fixed_dictionaries(chosen).map(lambda parameters: model(**{**parameters, **fixed}))


MATERIALS = st.sampled_from(list(BRDFS)).flatmap(materials)

_coordinate = st.floats(-10, 10, width=32)
POINTS = st.tuples(_coordinate, _coordinate, _coordinate)
DIRECTIONS = POINTS.filter(lambda d: sum(c * c for c in d) > 1e-6)
COLOURS = st.tuples(*[st.floats(0, 4, width=32)] * 3)


@st.composite
def lights(draw: st.DrawFn, name: str, **fixed: Any) -> dict[str, Any]:
    """Draws a light of one type, as a table of a scene file."""
    fields = LIGHTS[name].model_fields
    light: dict[str, Any] = {"type": name, "colour": draw(COLOURS), "intensity": draw(st.floats(-2, 4, width=32))}
    if "position" in fields:
        light["position"] = draw(POINTS)
    if "direction" in fields:
        light["direction"] = draw(DIRECTIONS)
    if "falloff" in fields:
        light["falloff"] = draw(st.sampled_from(["none", "1/r", "1/r^2"]))
        light["r_min"] = draw(st.floats(0.125, 2, width=32))
    if "inner" in fields:
        light["outer"] = draw(st.floats(1, 90, width=32))
        light["inner"] = light["outer"] * draw(st.floats(0, 1))
    return {**light, **fixed}


LIGHTS_OF_ANY_TYPE = st.sampled_from(list(LIGHTS)).flatmap(lights)


@st.composite
def transforms(draw: st.DrawFn) -> dict[str, Any]:
    """Draws a transform that translates, rotates, scales and sometimes mirrors."""
    scale = st.floats(0.125, 4, width=32)
    sign = st.sampled_from([1.0, 1.0, 1.0, -1.0])
    angle = st.floats(-180, 180, width=32)
    return {
        "translate": draw(POINTS),
        "rotate": draw(st.tuples(angle, angle, angle)),
        "scale": tuple(draw(scale) * draw(sign) for _ in range(3)),
    }


@st.composite
def fitted_cameras(draw: st.DrawFn) -> dict[str, Any]:
    """Draws a camera that fits the scene from any direction."""
    camera: dict[str, Any] = {"type": draw(st.sampled_from(["perspective", "orthographic"])), "up": draw(DIRECTIONS)}
    if camera["type"] == "perspective":
        camera["fov"] = draw(st.floats(5, 120))
    if draw(st.booleans()):
        camera |= {"fit": True, "eye": draw(DIRECTIONS), "target": (0.0, 0.0, 0.0)}
    return camera


SHAPES = st.sampled_from(
    [
        *({"type": "sphere", "segments": n, "rings": m} for n, m in ((5, 3), (16, 8), (48, 24))),
        *({"type": name} for name in ("plane", "cube", "cylinder", "cone", "torus") if name in PRIMITIVES),
    ]
)


@st.composite
def scenes(draw: st.DrawFn, size: tuple[int, int] = (96, 64)) -> Scene:
    """Draws a scene with a few shapes of any model at any rate, a few lights of any type, and a camera that fits them all."""
    objects = []
    for material in draw(st.lists(MATERIALS, min_size=1, max_size=3)):
        # Objects are near each other, so that they intersect and hide one another.
        place = {**draw(transforms()), "translate": draw(st.tuples(*[st.floats(-3, 3, width=32)] * 3))}
        rate = draw(st.sampled_from(["flat", "gouraud", "phong"]))
        normals = draw(st.sampled_from(["auto", "face", "smooth"]))
        sides = draw(st.sampled_from(["auto", "both"]))
        objects.append(
            {"shape": draw(SHAPES), "transform": place, "material": material}
            | {"shading": rate, "normals": normals, "sides": sides}
        )
    sources = draw(st.lists(LIGHTS_OF_ANY_TYPE, min_size=1, max_size=4))
    film = {"size": size, "background": draw(st.sampled_from([(0, 0, 0), (0.25, 0.5, 0.125), (0, 0, 0, 0)]))}
    return Scene.model_validate({"film": film, "camera": draw(fitted_cameras()), "objects": objects, "lights": sources})


def directions(count: int, seed: int, below: bool = False) -> NDArray[np.float32]:
    """Returns unit float32 directions (count, 3) of the upper (or lower) hemisphere, some near the horizon."""
    d = np.random.default_rng(seed).normal(size=(count, 3))
    d[:, 2] = np.abs(d[:, 2])
    d[: count // 8, 2] *= 1e-3
    d[0] = (0, 0, 1)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d[:, 2] *= -1 if below else 1
    return d.astype(np.float32)
