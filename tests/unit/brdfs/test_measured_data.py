"""Real measurements look as the surfaces do: the blue paint is blue, the colour-shifting paint shifts, the tape shines back.

The files are those of ../shared/data/measured; the first table of a scattered file takes some ten seconds.
"""

from __future__ import annotations

import colorsys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade import BRDFS, Renderer, Scene, evaluate, verify

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "measured"
SUN = {"type": "directional", "direction": [-0.4, -0.6, -0.7]}
NAMES = ("krylon_blue.brdf", "mystique.brdf", "pink-felt-1d.alta", "retro-3M-jaune.dat")

pytestmark = pytest.mark.slow


def measured(name: str, **keys: Any) -> Any:
    """Returns the material of a file; skips the test where the file is absent."""
    path = FOLDER / name
    if not path.exists():
        pytest.skip(f"{name} is not in ../shared/data/measured")
    return BRDFS["measured"](file=path, **keys)


def toward(angle: Any) -> Any:
    """Returns unit directions (..., 3) in the plane of x and z. angle: from the normal (...) [degrees]."""
    radians = np.radians(angle)
    return np.stack([np.sin(radians), np.zeros_like(radians), np.cos(radians)], axis=-1)


def test_the_blue_paint_is_blue() -> None:
    away_from_the_highlight = evaluate(measured("krylon_blue.brdf"), toward(20.0), toward([0.0, 20.0, 40.0]))
    assert np.all(away_from_the_highlight[:, 2] > 1.5 * away_from_the_highlight[:, :2].max(axis=1))


def test_the_hue_of_the_colour_shifting_paint_turns() -> None:
    def hue(angle: float) -> float:
        """Returns the hue [degrees] at ten degrees beside the highlight of light at an angle [degrees]."""
        f = evaluate(measured("mystique.brdf"), toward(angle), toward(10 - angle))
        return 360 * colorsys.rgb_to_hsv(*(f / f.max()))[0]

    assert 120 < hue(15.0) < 180, "green"
    assert not 90 < hue(60.0) < 270, "red"


@pytest.mark.parametrize("tilt", [15.0, 30.0, 45.0])
def test_the_tape_is_bright_where_the_viewer_stands_beside_the_light(tilt: float) -> None:
    tape = measured("retro-3M-jaune.dat")
    beside, apart = (evaluate(tape, toward(tilt), toward(tilt + angle))[0] for angle in (0.0, 20.0))
    assert beside > 8 * apart


@pytest.mark.parametrize("name", NAMES)
def test_every_file_is_verified(name: str, renderer: Renderer) -> None:
    ball = {"shape": {"type": "sphere", "segments": 24, "rings": 12}, "material": measured(name)}
    scene = Scene.model_validate({"objects": [ball], "lights": [SUN], "film": {"size": [48, 48]}})
    verdict = verify(scene, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
