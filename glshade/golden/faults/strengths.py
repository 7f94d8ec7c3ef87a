"""Strengths: parts of the light, of a light, a lobe or an object, that are too strong or too weak."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.golden.faults.fitting import FITTED, Fitting, SceneFault, literal

Array = NDArray[Any]
Flags = NDArray[np.bool_]

# Of the parts of the light that explain most alone, this many are tried as the first of a pair. The factors of a pair are
# fitted by turns, the first one's first.
FIRST, TURNS = 2, (0, 1, 0, 1)
# The factors of a colour's channels count as different if they differ by more than this share.
UNEQUAL = 0.02


@dataclass(frozen=True)
class _Selection:
    """A part of the light: that of some lights, by some lobes, on some objects.

    kind, name: as in SceneFault, without the factor.
    lights: the indices of the lights, where the number of lights stands for emission; an empty tuple stands for all.
    lobe: 0 for diffuse light, 1 for specular light, -1 for both.
    draw: the only draw; -1 for all.
    """

    kind: str
    name: str
    lights: tuple[int, ...] = ()
    lobe: int = -1
    draw: int = -1

    def text(self, factor: str, of: str = "{of}") -> str:
        """Returns the fault that the part is multiplied by a factor, as `SceneFault.text`. of: what follows the part's name."""
        return f"{self.name}{of} x {factor}"

    def of(self, atoms: Array, drawn: NDArray[np.intp]) -> Array:
        """Returns the selected light (K, 3).

        atoms: (L + 1, 2, K, 3), diffuse and specular light of each light, and emission as diffuse light.
        drawn: (K,), as in Surfaces.object.
        """
        lights = list(self.lights) or slice(None)
        lobes = slice(None) if self.lobe < 0 else slice(self.lobe, self.lobe + 1)
        part: Array = atoms[lights][:, lobes].sum(axis=(0, 1))
        return part if self.draw < 0 else np.where((drawn == self.draw)[:, None], part, 0.0)


def scaled(fitting: Fitting) -> Iterator[SceneFault]:
    """Yields the pictures with one or two parts of their light multiplied by the factors that fit best."""
    surfaces = fitting.surfaces
    every, specular = surfaces.parts()
    atoms = np.stack([every - specular, specular], axis=1)
    found: list[tuple[float, _Selection]] = []
    by_channel: list[SceneFault] = []
    enough = False
    for selection in _selections(fitting, atoms):
        part = selection.of(atoms, surfaces.object)
        where = fitting.counts & (surfaces.object >= 0) if selection.draw < 0 else fitting.of(selection.draw)
        if not (part[where] != 0).any():
            continue
        shares = [0.0]
        for factor, text in _factors(fitting, part, where):
            light = surfaces.light + (factor - 1) * part
            whole = selection.draw < 0
            fault = SceneFault(selection.kind, selection.text(text), "shading", light, whole=whole, only=selection.draw)
            shares.append(fitting.total_share(light))
            enough = enough or fitting.explains_all(light)
            if len(factor) == 1:
                yield fault
            else:
                by_channel.append(fault)
        found.append((max(shares), selection))
    # One number is simpler than three.
    yield from by_channel
    if not enough:
        found.sort(key=lambda item: -item[0])
        yield from _pairs(fitting, atoms, [selection for _, selection in found])


def _selections(fitting: Fitting, atoms: Array) -> Iterator[_Selection]:
    """Yields the parts of the light whose strength may be wrong, the simplest ones first."""
    lights, own = fitting.surfaces.assembly.lights, fitting.surfaces.assembly.own_light
    # Unlit surfaces show their base colours by a light of their own, which counts as emission.
    emitted = (len(lights),) if own is None else (own, len(lights))
    directed = tuple(number for number, light in enumerate(lights) if not light.omnidirectional)
    for draw in (-1, *fitting.objects):
        for number in range(emitted[0]):
            yield _Selection("light", f"light {literal(fitting.surfaces.light_name(number))}", (number,), draw=draw)
        if atoms[list(emitted)].any():
            yield _Selection("emission", "emission", emitted, draw=draw)
        yield _Selection("light", "all light", draw=draw)
        if len(directed) < len(lights):
            yield _Selection("light", "light of all lights with a direction", directed, draw=draw)
        if atoms[:, 1].any():
            yield _Selection("lobe", "specular", lobe=1, draw=draw)
            yield _Selection("lobe", "diffuse", lobe=0, draw=draw)


def _factors(fitting: Fitting, part: Array, where: Flags) -> Iterator[tuple[Array, str]]:
    """Yields the best factor (1,) of a part (K, 3) and its text, and then one for each channel (3,) where these differ.

    Factors that would be told as 1.00 are left out.
    """
    factor = fitting.factor(part, where)
    factors = np.array([fitting.factor(part, where, slice(channel, channel + 1)) for channel in range(3)])
    if f"{factor:.2f}" != "1.00":
        yield np.array([factor]), f"{factor:.2f}"
    if factors.max() - factors.min() > UNEQUAL * factors.max():
        yield factors, f"({', '.join(f'{f:.2f}' for f in factors)})"


def _pairs(fitting: Fitting, atoms: Array, selections: list[_Selection]) -> Iterator[SceneFault]:
    """Yields the pictures with two parts multiplied: one that explains much alone, and the one that goes best with it.

    selections: the parts, the one that explains most alone first.
    """
    step = max(1, len(fitting.counts) // FITTED)
    few = np.flatnonzero(fitting.counts & (fitting.surfaces.object >= 0))[::step]
    small = fitting.subset(few)
    for first in selections[:FIRST]:
        # Two objects with one fault each are no pair: each has a cause of its own.
        others = (s for s in selections if s != first and (s.draw < 0 or first.draw in (-1, s.draw)))
        tried = [_paired(small, atoms[:, :, few], (first, second)) for second in others]
        pairs = [(share, both, factors) for share, both, factors in tried if np.abs(factors - 1).min() > UNEQUAL / 2]
        if not pairs:
            continue
        _, both, factors = max(pairs, key=lambda pair: pair[0])
        changed = atoms
        for selection, factor in zip(both, factors, strict=True):
            changed = _multiplied(changed, fitting.surfaces.object, selection, factor)
        light = fitting.surfaces.light + (changed - atoms).sum(axis=(0, 1))
        names = [
            selection.text(
                f"{factor:.2f}", "" if selection.draw < 0 else f" of {literal(fitting.surfaces.name(selection.draw))}"
            )
            for selection, factor in zip(both, factors, strict=True)
        ]
        yield SceneFault(both[0].kind, " and ".join(names), "shading", light, alone=False)


def _paired(
    fitting: Fitting, atoms: Array, both: tuple[_Selection, _Selection]
) -> tuple[float, tuple[_Selection, _Selection], Array]:
    """Returns the share of the change that two parts explain together, the parts, and their best factors (2,).

    atoms: (L + 1, 2, K, 3), as in `_Selection.of`.
    """
    surfaces, factors = fitting.surfaces, np.ones(2)
    rest = surfaces.light - atoms.sum(axis=(0, 1))
    for turn in TURNS:
        changed = _multiplied(atoms, surfaces.object, both[1 - turn], factors[1 - turn])
        base = rest + changed.sum(axis=(0, 1))
        factors[turn] = fitting.factor(both[turn].of(changed, surfaces.object), fitting.counts, base=base)
    changed = _multiplied(changed, surfaces.object, both[turn], factors[turn])
    return fitting.total_share(rest + changed.sum(axis=(0, 1))), both, factors


def _multiplied(atoms: Array, drawn: NDArray[np.intp], selection: _Selection, factor: float) -> Array:
    """Returns a copy of the atoms (L + 1, 2, K, 3) with a part of the light multiplied. drawn: (K,), as in Surfaces.object."""
    result = atoms.copy()
    lights = list(selection.lights) or slice(None)
    lobes = slice(None) if selection.lobe < 0 else slice(selection.lobe, selection.lobe + 1)
    where = slice(None) if selection.draw < 0 else drawn == selection.draw
    for light in np.arange(len(atoms))[lights]:
        for lobe in np.arange(2)[lobes]:
            result[light, lobe, where] *= factor
    return result
