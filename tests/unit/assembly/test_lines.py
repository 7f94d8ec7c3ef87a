"""Lines: strips of a width in pixels that face the viewer, in both renderers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from glshade import Scene
from glshade.mesh.mesh import Mesh
from glshade.mesh.strokes import build_strokes, segments
from glshade.reference.picture import render
from glshade.verification.verification import verify

# An orthographic picture of 16 x 16 pixels in which a pixel is one scene unit wide, with 0 at its bottom left corner.
PIXELS = {"type": "orthographic", "eye": (8.0, 8.0, 10.0), "target": (8.0, 8.0, 0.0), "height": 16.0, "near": 1, "far": 20}


def line(*positions: Any, colours: Any = None, normals: Any = None) -> Mesh:
    """Returns the mesh of a line through these positions, with colours (N, 3)."""
    if colours is not None:
        colours = np.column_stack([colours, np.ones(len(positions))])
    return build_strokes(positions, segments(np.arange(len(positions)), "strip"), normals, None, colours)[0]


def scene(mesh: Mesh, **film: Any) -> Scene:
    return Scene.model_validate({"objects": [{"mesh": mesh}], "film": {"size": (16, 16), **film}, "camera": PIXELS})


COORDINATE = st.floats(-3, 19, allow_nan=False)


@given(
    start=st.tuples(COORDINATE, COORDINATE),
    stop=st.tuples(COORDINATE, COORDINATE),
    width=st.sampled_from([1.0, 2.5, 4.0]),
    samples=st.sampled_from([1, 4]),
)
def test_a_line_covers_the_centres_within_half_its_width(start: Any, stop: Any, width: float, samples: int) -> None:
    a, b = np.array(start), np.array(stop)
    length = float(np.linalg.norm(b - a))
    assume(length > 1e-3)
    picture = render(scene(line((*start, 0.0), (*stop, -5.0)), point_size=width, samples=samples)).pixels[::-1, :, 0] > 0
    along = (b - a) / length
    centres = np.stack(np.meshgrid(np.arange(16) + 0.5, np.arange(16) + 0.5), axis=-1) - a
    far, aside = centres @ along, np.abs(centres @ (-along[1], along[0]))
    # A centre at an edge may be covered or not.
    inside = (far > 0.02) & (far < length - 0.02) & (aside < width / 2 - 0.02)
    outside = (far < -0.02) | (far > length + 0.02) | (aside > width / 2 + 0.02)
    assert picture[inside].all()
    assert not picture[outside].any()


@pytest.mark.parametrize("place", [0.0, 0.25, 0.5, 1 / 3])
@pytest.mark.parametrize("slope", [0.0, 1e-9])
def test_a_line_along_the_picture_is_certain_in_every_pixel(renderer: Any, place: float, slope: float) -> None:
    """At a place of 0 both edges of the line would lie exactly on the centres of pixels, where rounding decides."""
    across, upright = line((2, 8 + place, 0), (14, 8 + place + slope, 0)), line((4 + place, 1, 0), (4 + place + slope, 15, 0))
    items = [{"mesh": across}, {"mesh": upright}]
    drawn = Scene.model_validate({"objects": items, "film": {"size": (16, 16)}, "camera": PIXELS})
    verdict = verify(drawn, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.ambiguous == 0
    assert (verdict.picture > 0).any(axis=2).sum() == 12 + 14 - 1


def test_the_colours_of_the_ends_blend_along_a_line(draw: Any) -> None:
    mesh = line((0, 8.5, 0), (16, 8.5, 0), colours=[(1, 0, 0), (0, 0, 1)])
    picture = draw({"mesh": mesh}, [], size=(16, 16), camera=PIXELS)[7]
    assert picture[:, 0] == pytest.approx(1 - (np.arange(16) + 0.5) / 16, abs=1e-5)
    assert picture[:, 2] == pytest.approx((np.arange(16) + 0.5) / 16, abs=1e-5)


def test_a_line_with_normals_is_lit(draw: Any) -> None:
    mesh = line((0, 8.5, 0), (16, 8.5, 0), normals=[(0, np.sqrt(3) / 2, 0.5)] * 2)
    item = {"mesh": mesh, "material": {"brdf": "lambert", "kd": 1.0}}
    picture = draw(item, [{"type": "directional", "direction": (0, 0, -1)}], size=(16, 16), camera=PIXELS)
    assert picture[7, :, 0] == pytest.approx(0.5, abs=1e-5)


def test_a_line_keeps_its_width_from_near_to_far(draw: Any) -> None:
    camera = {"eye": (0, 1, 0), "target": (0, 1, -1), "fov": 60, "near": 0.1, "far": 2000}
    picture = draw(
        {"mesh": line((0.05, 0, -1), (0.05, 0.999, -1000))}, [], size=(64, 64), camera=camera, film={"point_size": 3}
    )
    widths = (picture[..., 0] > 0).sum(axis=1)
    assert set(widths[widths > 0][1:-1]) == {3}


def test_a_line_through_the_near_plane_is_cut_there(draw: Any) -> None:
    camera = {"eye": (0, 0, 0), "target": (0, 0, -1), "fov": 60, "near": 1, "far": 100}
    picture = draw({"mesh": line((0.3, 0, 50), (0.3, 0, -50))}, [], size=(64, 64), camera=camera)[..., 0] > 0
    columns = np.flatnonzero(picture.any(axis=0))
    # At the near plane the line lies 0.3 right of the middle, which is 16.6 pixels.
    assert columns.min() == 32
    assert columns.max() == 48


def test_a_picture_of_lines_is_verified(renderer: Any) -> None:
    rng = np.random.default_rng(7)
    places = rng.normal(size=(60, 3))
    mesh = line(*places, colours=rng.uniform(0.1, 1, (60, 3)))
    drawn = Scene.model_validate({"objects": [{"mesh": mesh}], "film": {"size": (128, 128), "samples": 4}})
    verdict = verify(drawn, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.left_out == ("film.samples = 4",)
