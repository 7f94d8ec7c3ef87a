"""Falloffs: lights that weaken with distance by another law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from glshade.golden.faults.fitting import Fitting, SceneFault, literal
from glshade.golden.surfaces import Edit, Surfaces
from glshade.lights import FALLOFFS, Falloff
from glshade.radiance.draw import Draw
from glshade.reference.raster import Fragments

Array = NDArray[Any]


def other_falloffs(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with another falloff of a light, and with the falloffs of several lights changed."""
    surfaces = fitting.surfaces
    lights = [number for number, light in enumerate(surfaces.assembly.lights) if hasattr(light, "falloff")]
    best: list[tuple[str, int, Falloff, Array, float]] = []
    for number in lights:
        now: Falloff = surfaces.assembly.lights[number].falloff  # type: ignore[attr-defined]
        for other in FALLOFFS:
            if other == now:
                continue
            light = surfaces.with_edit(_with_falloffs(surfaces, {number: other}))
            text = f"falloff of light {literal(surfaces.light_name(number))}: {other} in place of {now}"
            yield SceneFault("falloff", text, "shading", light, alone=False)
            best.append(
                (
                    text,
                    number,
                    other,
                    light,
                    fitting.total_share(light),
                )
            )
    best.sort(key=lambda item: -item[4])
    chosen: dict[int, Falloff] = {}
    texts: list[str] = []
    share = 0.0
    for text, number, other, _, _ in best:
        if number in chosen:
            continue
        light = surfaces.with_edit(_with_falloffs(surfaces, {**chosen, number: other}))
        explained = fitting.total_share(light)
        if explained > share + 0.01:
            chosen[number], share = other, explained
            texts.append(text)
            if len(chosen) > 1:
                yield SceneFault("falloff", "; ".join(texts), "shading", light, alone=False)


def _with_falloffs(surfaces: Surfaces, falloffs: Mapping[int, Any]) -> Edit:
    """Returns an edit that gives lights, by their index in the assembly, other falloffs."""

    def edit(draw: Draw, _: Fragments) -> Draw:
        numbers = directed(surfaces, draw)
        lamps = tuple(
            replace(lamp, falloff=falloffs.get(number, lamp.falloff)) for number, lamp in zip(numbers, draw.lamps, strict=True)
        )
        return replace(draw, lamps=lamps)

    return edit


def directed(surfaces: Surfaces, draw: Draw) -> list[int]:
    """Returns the indices, in the assembly's lights, of a draw's lamps."""
    lights = surfaces.assembly.lights
    return [i for i in draw.instance.lights if not lights[i].ignores_normal and not lights[i].omnidirectional]
