"""Survey: the measured error of every model at every rate under every light, on one scene that has what it takes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from glshade.brdfs import BRDFS
from glshade.lights import LIGHTS
from glshade.scene.scene import Rate, Scene
from glshade.verification.verification import verify

SIZE = (256, 144)
RATES: tuple[Rate, ...] = ("flat", "gouraud", "phong")
FALLOFFS = ("none", "1/r", "1/r^2")


@dataclass(frozen=True)
class Row:
    """One verification. Errors: of interior pixels and seams; tolerance: the largest there; used: the most of any pixel's."""

    model: str
    rate: str
    light: str
    worst: float
    p999: float
    tolerance: float
    used: float
    ambiguous: float
    verdict: str


def survey(renderer: Any) -> Iterator[Row]:
    """Every row, drawn with the Renderer."""
    for model in BRDFS:
        for rate in RATES:
            for name, light in lights().items():
                verdict = verify(scene(model, light), renderer=renderer, shading=rate)
                c = verdict.comparison
                used = float(c.used.max(initial=0.0))
                yield Row(model, rate, name, c.worst, c.p999, c.tolerance, used, c.ambiguous, verdict.verdict)


def lights() -> dict[str, dict[str, Any]]:
    """name -> one light of each type and falloff, about as bright as each other at the origin."""
    found: dict[str, dict[str, Any]] = {}
    for kind, model in LIGHTS.items():
        has = model.model_fields
        light: dict[str, Any] = {"type": kind, "colour": (1.0, 0.9, 0.8)}
        if "position" in has:
            light["position"] = (1.5, 2.0, 3.0)
        if "direction" in has:
            light["direction"] = (-0.4, -0.55, -0.8)
        if "falloff" not in has:
            found[kind] = light
            continue
        for power, falloff in enumerate(FALLOFFS):
            # 4: the light's distance from the origin, roughly.
            found[f"{kind} {falloff}" if power else kind] = {**light, "falloff": falloff, "intensity": 4.0**power}
    return found


def scene(model: str, light: dict[str, Any]) -> Scene:
    """A sphere, a torus and a tilted floor of the model at ordinary parameters, in perspective."""
    material = {"brdf": model, **_colours(model)}
    objects = [
        {"shape": {"type": "sphere", "segments": 64, "rings": 32}, "transform": {"translate": (-1.1, 0.1, 0.0)}},
        {"shape": {"type": "torus"}, "transform": {"translate": (1.2, 0.0, 0.0), "rotate": (60, 20, 0)}},
        {"shape": {"type": "plane"}, "transform": {"translate": (0.0, -1.1, 0.0), "scale": (3.0, 1.0, 3.0)}},
    ]
    return Scene.model_validate(
        {
            "film": {"size": SIZE},
            "camera": {"type": "perspective", "eye": (0.5, 1.2, 5.5), "target": (0.0, -0.1, 0.0), "fov": 32},
            "objects": [{**item, "material": material} for item in objects],
            "lights": [light],
        }
    )


def _colours(model: str) -> dict[str, Any]:
    """The model's colours with three channels that are not equal."""
    found: dict[str, Any] = {}
    for name in BRDFS[model].parameters():
        default = BRDFS[model].model_fields[name].default
        if isinstance(default, tuple):
            found[name] = tuple(float(c) * share for c, share in zip(default, (1.0, 0.8, 0.6), strict=True))
    return found
