"""Law: no more light leaves a surface than arrives. A model that says it breaks this must break it.

The reflectances that share one budget (`shares`) sum to 1 at most; everything else is as it comes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from extremes import at_extremes, choices, unit
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import materials

from glshade import BRDFS
from glshade.brdfs import Brdf
from glshade.catalogue.albedo import albedo

KEPT = [name for name in BRDFS if "energy" not in BRDFS[name].breaks]
BROKEN = [name for name in BRDFS if "energy" in BRDFS[name].breaks]
# From the normal to 1e-3 above the horizon; off the axes, so that an anisotropic lobe is cut askew.
VIEWERS = unit([(0.6 * np.sin(a), 0.8 * np.sin(a), np.cos(a)) for a in (0.0, 0.4, 0.9, 1.3, 1.5, np.pi / 2 - 1e-3)])
# Of the quadrature.
WITHIN = 1e-5


def in_budget(material: Brdf) -> Brdf:
    """The material with its shares made smaller where they sum to more than 1."""
    names = material.shares
    if not names:
        return material
    shares = np.array([getattr(material, name) for name in names], dtype=np.float64)
    shares /= np.maximum(shares.sum(axis=0).max(), 1.0)
    return material.model_copy(update={name: tuple(share.tolist()) for name, share in zip(names, shares, strict=True)})


def highest(material: Brdf) -> float:
    return float(albedo(material, VIEWERS, within=WITHIN).max())


@pytest.mark.parametrize("name", KEPT)
@settings(max_examples=8)
@given(data=st.data())
def test_at_ordinary_parameters(name: str, data: Any) -> None:
    assert highest(in_budget(data.draw(materials(name)))) <= 1 + WITHIN


@pytest.mark.parametrize("name", KEPT)
def test_white_as_it_gets(name: str) -> None:
    """Every colour at its highest, over the ends of the scalars."""
    for material in at_extremes(name, 24):
        assert highest(in_budget(material)) <= 1 + WITHIN, material


@pytest.mark.parametrize("name", BROKEN)
def test_what_breaks_it_does(name: str) -> None:
    assert len(BRDFS[name].breaks["energy"]) > 10, "the reason"
    assert max(highest(in_budget(material)) for material in at_extremes(name, 24)) > 1 + 10 * WITHIN


@pytest.mark.parametrize("name", BRDFS)
def test_what_is_declared_can_be_shared(name: str) -> None:
    for share in BRDFS[name].shares:
        assert share in BRDFS[name].parameters()
    for chosen in choices(BRDFS[name]):
        assert BRDFS[name](**chosen).chosen() == chosen
