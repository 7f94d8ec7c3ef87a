"""Survey: measures the error of every model at every rate under every light, on one small scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from glshade.brdfs import BRDFS
from glshade.lights import FALLOFFS, LIGHTS
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.verification import verify

# The size of the pictures: width, height [pixels].
SIZE = (256, 144)
RATES: tuple[Rate, ...] = ("flat", "gouraud", "phong")


@dataclass(frozen=True)
class SurveyRow:
    """The result of one verification. Only interior pixels and seams count in the errors.

    model: the model's name.
    rate: flat, gouraud or phong.
    light: the type of the light, followed by its falloff if it has one.
    worst: the largest error [linear].
    p999: the error that 99.9 % of the pixels do not exceed [linear].
    tolerance: the largest tolerance of any pixel [linear].
    used: the largest ratio of a pixel's error to its own tolerance.
    ambiguous: the share of the picture's pixels that are ambiguous.
    verdict: verified, failed or inconclusive.
    """

    model: str
    rate: str
    light: str
    worst: float
    p999: float
    tolerance: float
    used: float
    ambiguous: float
    verdict: str


def survey_models(renderer: Any) -> Iterator[SurveyRow]:
    """Verifies every model at every rate under every light. renderer: the Renderer that draws the pictures."""
    for model in BRDFS:
        for rate in RATES:
            for name, light in lights().items():
                verdict = verify(scene(model, light), renderer=renderer, shading=rate)
                c = verdict.comparison
                used = float(c.used.max(initial=0.0))
                yield SurveyRow(model, rate, name, c.worst, c.p999, c.tolerance, used, c.ambiguous, verdict.verdict)


def lights() -> dict[str, dict[str, Any]]:
    """Returns name -> light as in a scene file, one for each type and falloff. All are about equally bright at the origin."""
    result: dict[str, dict[str, Any]] = {}
    for kind, model in LIGHTS.items():
        keys = model.model_fields
        light: dict[str, Any] = {"type": kind, "colour": (1.0, 0.9, 0.8)}
        if "position" in keys:
            light["position"] = (1.5, 2.0, 3.0)
        if "direction" in keys:
            light["direction"] = (-0.4, -0.55, -0.8)
        if "falloff" not in keys:
            result[kind] = light
            continue
        for falloff, law in FALLOFFS.items():
            # The light's distance from the origin is about 4. The intensity makes up for the falloff at the origin.
            name = f"{kind} {falloff}" if law.power else kind
            result[name] = {**light, "falloff": falloff, "intensity": 4.0**law.power}
    return result


def scene(model: str, light: dict[str, Any]) -> Scene:
    """Returns a scene of a sphere, a torus and a floor in perspective.

    model: the model of all three objects. Its parameters are the defaults, except for the colours.
    light: the only light, as in a scene file.
    """
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
    """Returns the model's default colours, tinted: if two channels were exchanged, the verifier would see an error."""
    result: dict[str, Any] = {}
    for name in BRDFS[model].parameters():
        default = BRDFS[model].model_fields[name].default
        if isinstance(default, tuple):
            result[name] = tuple(float(c) * share for c, share in zip(default, (1.0, 0.8, 0.6), strict=True))
    return result
