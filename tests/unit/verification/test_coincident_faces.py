"""Faces that lie on each other: a driver may show either, and where both have the same light the pixel is decided."""

from __future__ import annotations

import numpy as np
import pytest

import glshade

# A curved sheet, as vertices (N, 3) and triangles (T, 3).
_STEPS = 10
_X, _Y = np.meshgrid(np.linspace(-1, 1, _STEPS), np.linspace(-1, 1, _STEPS))
VERTICES = np.stack([_X, _Y, 0.3 * np.sin(2 * _X) * np.cos(2 * _Y)], axis=-1).reshape(-1, 3)
_NUMBERS = np.arange(_STEPS * _STEPS).reshape(_STEPS, _STEPS)
_A, _B, _C, _D = (part.ravel() for part in (_NUMBERS[:-1, :-1], _NUMBERS[:-1, 1:], _NUMBERS[1:, 1:], _NUMBERS[1:, :-1]))
TRIANGLES = np.concatenate([np.stack([_A, _B, _C], axis=1), np.stack([_A, _C, _D], axis=1)])
SHEET = VERTICES, TRIANGLES


def _verdict(meshes: list[object], shading: str, samples: int = 1) -> glshade.Verdict:
    scene = glshade.Scene(
        objects=[{"mesh": mesh, "normals": "smooth"} for mesh in meshes],
        film={"size": (120, 90), "samples": samples},
        camera={"eye": (0.5, 0.7, 4.0)},
    )
    return glshade.verify(scene, shading=shading)


@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize(
    "meshes",
    [
        pytest.param([(VERTICES, np.concatenate([TRIANGLES, TRIANGLES]))], id="twice"),
        pytest.param([(VERTICES, np.concatenate([TRIANGLES, TRIANGLES[:, ::-1]]))], id="both sides"),
        pytest.param([SHEET, SHEET], id="two objects"),
    ],
)
def test_the_same_light_is_decided(meshes: list[object], shading: str) -> None:
    verdict = _verdict(meshes, shading)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.comparison.doubtful < 0.02


def test_several_samples_are_decided_too() -> None:
    verdict = _verdict([SHEET, SHEET], "phong", samples=4)
    assert verdict.verdict == "verified", str(verdict)


def test_another_colour_is_not_decided() -> None:
    """Where the two surfaces differ, a driver may show either, and a picture proves nothing."""
    scene = glshade.Scene(
        objects=[{"mesh": SHEET, "material": {"brdf": "lambert", "kd": kd}} for kd in ((0.8, 0.1, 0.1), (0.1, 0.1, 0.8))],
        film={"size": (120, 90)},
        camera={"eye": (0.5, 0.7, 4.0)},
    )
    assert glshade.verify(scene).verdict == "inconclusive"
