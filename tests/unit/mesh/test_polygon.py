"""Polygons with any number of corners are cut into triangles that cover them once."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.limits import MOST_CORNERS
from glshade.mesh.reading.polygon import triangulated


def star(count: int, depth: float) -> Any:
    """Returns the outline (count, 2) of a star whose every second corner turns inward."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = np.where(np.arange(count) % 2, 1.0, depth)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def areas(outline: Any) -> Any:
    """Returns the signed areas (N - 2,) of the triangles of an outline (N, 2) that lies askew in space."""
    space = np.column_stack([outline, outline @ [0.5, -0.25]])
    a, b, c = outline[np.array(triangulated(space))].transpose(1, 0, 2)
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def signed_area(outline: Any) -> float:
    x, y = outline.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


@pytest.mark.parametrize("outline", [star(3000, 0.4), star(3000, 1.0)], ids=["concave", "convex"])
def test_three_thousand_corners_take_less_than_a_second(outline: Any) -> None:
    before = time.process_time()
    found = areas(outline)
    assert time.process_time() - before < 1
    assert found.sum() == pytest.approx(signed_area(outline))
    assert (found > 0).all()


@given(st.lists(st.floats(0.1, 10), min_size=5, max_size=40), st.booleans())
def test_a_polygon_is_covered_once(radii: list[float], clockwise: bool) -> None:
    angle = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    outline = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array(radii)[:, None]
    outline = outline[::-1] if clockwise else outline
    found, whole = areas(outline), signed_area(outline)
    assert len(found) == len(radii) - 2
    assert np.abs(found).sum() == pytest.approx(abs(whole))
    assert (found * np.sign(whole) >= -1e-12 * abs(whole)).all()


def test_corners_on_straight_sides_make_no_triangles_without_area() -> None:
    outline = np.array([(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 1), (0, 2), (0, 1)], dtype=float)
    assert (areas(outline) > 0).all()


def test_a_cut_to_a_hole_and_back_is_no_obstacle() -> None:
    """A square with a square hole, whose outline goes along one line twice."""
    outline = np.array([(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)], dtype=float)
    found = areas(outline)
    assert found.sum() == pytest.approx(12)
    assert (found > 0).all()


def test_too_many_corners_are_refused_unless_the_polygon_is_convex() -> None:
    assert len(triangulated(np.column_stack([star(MOST_CORNERS + 2, 1.0), np.zeros(MOST_CORNERS + 2)]))) == MOST_CORNERS
    with pytest.raises(ValueError, match="not convex"):
        triangulated(np.column_stack([star(MOST_CORNERS + 2, 0.5), np.zeros(MOST_CORNERS + 2)]))
