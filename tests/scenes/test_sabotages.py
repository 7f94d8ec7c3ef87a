"""Sabotages test the verifier: it must find faults in the GLSL that are as small as slips of a programmer can be."""

from __future__ import annotations

import pytest
from support.sabotage import SABOTAGES, SCENES, Sabotage, Saboteur

from glshade import BRDFS, LIGHTS, Renderer

# Sabotages of each kind. The slow test takes the others too.
FEW = {
    "alpha cutoff",
    "beckmann: l and v exchanged in G",
    "field of view larger by 0.1 %",
    "flat: light of a corner, not of the centroid",
    "ggx: F0 of the metallic part",
    "gouraud: interpolated without perspective",
    "lambert: 1/pi",
    "normals transformed like positions",
    "point: exponent of 1/r^2",
    "spot: cone wider by 0.2 %",
    "the test of n.v alone is dropped",
    "vertex colours",
}


@pytest.fixture(scope="module")
def saboteur(renderer: Renderer) -> Saboteur:
    return Saboteur(renderer)


def test_the_table_covers_every_model_and_every_light() -> None:
    assert len({sabotage.name for sabotage in SABOTAGES}) == len(SABOTAGES) >= 60
    assert {sabotage.scene for sabotage in SABOTAGES} == set(SCENES)
    materials = [item.material for scene in SCENES.values() for item in scene.objects]
    assert {material.brdf for material in materials} == set(BRDFS)
    assert {light.type for scene in SCENES.values() for light in scene.lights or ()} == set(LIGHTS)


def test_a_text_that_no_program_contains_is_an_error(saboteur: Saboteur) -> None:
    with pytest.raises(ValueError, match="no program of the scene 'lambert' contains 'INV_TAU'"):
        saboteur.outcome(Sabotage("a typing error", "lambert", "INV_TAU", "INV_PI"))


def test_some_sabotages_are_found(saboteur: Saboteur) -> None:
    chosen = [sabotage for sabotage in SABOTAGES if sabotage.name in FEW]
    assert len(chosen) == len(FEW)
    assert not saboteur.faults(chosen)


@pytest.mark.slow
def test_all_sabotages_are_found(saboteur: Saboteur) -> None:
    faults = saboteur.faults(SABOTAGES)
    assert not faults, "\n".join(faults)


@pytest.mark.slow
def test_without_a_sabotage_nothing_is_found(saboteur: Saboteur) -> None:
    assert {name: saboteur.verdict(name) for name in SCENES} == dict.fromkeys(SCENES, "verified")
