"""Property: a surface reflects no more light than arrives. A model that declares that it lacks this property must lack it.

Reflectances that share one budget (`Brdf.shares`) are scaled to sum to 1 at most; all other parameters keep their values.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.extremes import at_extremes, choices, spread, unit
from support.strategies import materials

from glshade import BRDFS
from glshade.brdfs import Brdf
from glshade.catalogue.albedo import directional_albedo

KEPT = [name for name in BRDFS if "energy" not in BRDFS[name].breaks]
BROKEN = [name for name in BRDFS if "energy" in BRDFS[name].breaks]
# Directions from the normal to 1e-3 above the horizon. None lies in an axis plane, so that an anisotropic lobe is cut
# obliquely.
VIEWERS = unit([(0.6 * np.sin(a), 0.8 * np.sin(a), np.cos(a)) for a in (0.0, 0.4, 0.9, 1.3, 1.5, np.pi / 2 - 1e-3)])
# The absolute error of the albedo: of a first, coarse value, and of a fine one where the coarse one is too near to 1 to decide.
COARSE, FINE = 1e-3, 1e-5
# The distance from 1 beyond which a coarse albedo decides: ten times the error that its quadrature estimates.
NEAR = 10 * COARSE


def in_budget(material: Brdf) -> Brdf:
    """Returns the material, with its shares scaled down where they sum to more than 1."""
    names = material.shares
    if not names:
        return material
    shares = np.array([getattr(material, name) for name in names], dtype=np.float64)
    shares /= np.maximum(shares.sum(axis=0).max(), 1.0)
    return material.model_copy(update={name: tuple(share.tolist()) for name, share in zip(names, shares, strict=True)})


def highest(material: Brdf) -> float:
    """Returns the largest directional albedo of the material in its budget, to within FINE near 1 and COARSE elsewhere."""
    material = in_budget(material)
    coarse = directional_albedo(material, VIEWERS, within=COARSE).max(axis=1)
    near = np.abs(coarse - 1) <= NEAR
    fine = directional_albedo(material, VIEWERS[near], within=FINE).max(axis=1)
    return float(np.concatenate([coarse[~near], fine]).max())


@pytest.mark.parametrize("name", KEPT)
@settings(max_examples=8)
@given(data=st.data())
def test_at_ordinary_parameters(name: str, data: Any) -> None:
    assert highest(data.draw(materials(name))) <= 1 + FINE


def check_all(found: list[Brdf]) -> None:
    for material in found:
        assert highest(material) <= 1 + FINE, material


@pytest.mark.parametrize("name", KEPT)
def test_white_as_it_gets(name: str) -> None:
    """Every colour has its highest value, and the scalars go to the ends of their ranges, at 12 steps or fewer."""
    check_all(spread(at_extremes(name, 24), 12))


@pytest.mark.slow
@pytest.mark.parametrize("name", KEPT)
def test_white_at_every_step_of_the_scalars(name: str) -> None:
    check_all(at_extremes(name, 48))


@pytest.mark.parametrize("name", BROKEN)
def test_a_declared_exception_breaks_the_law(name: str) -> None:
    assert len(BRDFS[name].breaks["energy"]) > 10, "the reason"
    assert any(highest(material) > 1 + 10 * FINE for material in at_extremes(name, 24))


@pytest.mark.parametrize("name", BRDFS)
def test_declared_shares_are_parameters(name: str) -> None:
    for share in BRDFS[name].shares:
        assert share in BRDFS[name].parameters()
    for chosen in choices(BRDFS[name]):
        assert BRDFS[name](**chosen).chosen() == chosen
