"""Prints the tolerances of the shipped scenes' pixels as a Markdown table. script/tolerances calls it.

The tolerance of a pixel is half the width of the interval that its value must lie in, in the channel where the interval is
widest [linear]. If a driver may show one of several surfaces, the surface with the widest interval counts. The figures do not
depend on a driver: they show whether a change of the reference's bounds makes `glshade verify` more or less strict.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pages import table

import glshade
from glshade.verification.candidates import find_candidates, one_sample
from glshade.verification.judgement import PixelClass

SCENES = sorted((Path(__file__).resolve().parents[1] / "scenes").glob("*.toml"))
HEADING = ("scene", "pixels with a surface", "ambiguous", "median tolerance", "p99 tolerance", "largest tolerance")


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(
        prog="script/tolerances", description="Prints the tolerances of the shipped scenes' pixels."
    )
    parser.add_argument("--width", type=int, default=320, help="the width of the pictures [pixels]")
    width = parser.parse_args().width
    print(table(HEADING, (row(path, width) for path in SCENES)), end="")


def row(path: Path, width: int) -> Sequence[str]:
    """Returns the cells of one scene. width: the width of its picture [pixels]."""
    scene = glshade.load(path)
    w, h = scene.film.size
    film = scene.film.model_copy(update={"size": (width, max(1, round(h * width / w)))})
    expected = find_candidates(one_sample(scene.model_copy(update={"film": film}))).expected
    tolerance = np.zeros(len(expected.classes))
    np.maximum.at(tolerance, expected.pixel, 0.5 * (expected.high - expected.low).max(axis=1))
    shown = np.unique(expected.pixel)
    ambiguous = np.mean(expected.classes >= PixelClass.SILHOUETTE)
    figures = np.quantile(tolerance[shown], (0.5, 0.99, 1))
    return path.stem, str(len(shown)), f"{ambiguous:.2%}", *(f"{figure:.2e}" for figure in figures)


main()
