"""Pictures with several samples a pixel are judged as they are drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import glshade as g
from glshade.driver.freedom import measure_freedom
from glshade.reference import picture
from glshade.reference.freedom import UNMEASURED, Freedom
from glshade.verification.candidates import Candidates, find_candidates
from glshade.verification.judgement import PixelClass
from glshade.verification.mutations import MUTATIONS
from glshade.verification.trials import VISIBLE
from glshade.verification.verdict import verdict_of

SIZE = (64, 48)
LIGHTS = [
    {"type": "directional", "direction": (-0.4, -0.6, -0.7), "colour": (1.0, 0.9, 0.8)},
    {"type": "ambient", "intensity": 0.2},
]
CAMERA = {"type": "perspective", "eye": (0.5, 0.8, 4.0), "target": (0.0, 0.0, 0.0), "fov": 35}
SPHERE = {"type": "sphere", "segments": 24, "rings": 12}
SHINY = {"brdf": "phong", "kd": (0.5, 0.4, 0.3), "ks": 0.4, "exponent": 40.0}
FILMS: dict[str, dict[str, Any]] = {
    "two samples": {"samples": 2},
    "four samples": {"samples": 4},
    "eight samples": {"samples": 8},
    "supersampled": {"supersample": 3},
    "both": {"samples": 4, "supersample": 2},
    "with alpha": {"samples": 4, "background": (0.1, 0.2, 0.3, 0.25)},
    "cropped": {"samples": 4, "crop": (10, 5, 37, 30)},
    "a cropped mean": {"supersample": 2, "crop": (10, 5, 37, 30), "background": (0.4, 0.1, 0.2)},
}


def scene(objects: Any = None, lights: Any = LIGHTS, size: tuple[int, int] = SIZE, **film: Any) -> g.Scene:
    objects = objects or [{"shape": SPHERE, "material": SHINY}]
    document = {"film": {"size": size, **film}, "camera": CAMERA, "objects": objects, "lights": lights}
    return g.Scene.model_validate(document)


def draw(renderer: g.Renderer, drawn: g.Scene) -> Any:
    return renderer.render(drawn, dtype="float32").pixels.copy()


def coloured(candidates: Candidates, kind: PixelClass) -> Any:
    """Returns the numbers of the pixels of a class."""
    return np.flatnonzero(candidates.expected.classes == kind)


@pytest.mark.parametrize("shading", ["flat", "gouraud", "phong"])
@pytest.mark.parametrize("name", FILMS)
def test_a_right_picture_is_verified(name: str, shading: Any, renderer: g.Renderer) -> None:
    verdict = g.verify(scene(**FILMS[name]), renderer=renderer, shading=shading)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.left_out == ()
    counts = verdict.comparison.counts
    # With supersampling, the reference knows where the samples are, so that most outlines are narrow enough for a seam.
    assert counts[PixelClass.EDGE] + counts[PixelClass.SEAM] > 100
    assert counts[PixelClass.EDGE] > 20 or FILMS[name].get("samples", 1) == 1
    assert verdict.comparison.counts[PixelClass.BACKGROUND] > 20


@pytest.mark.parametrize("name", ["four samples", "supersampled"])
def test_the_samples_of_the_film_are_drawn_and_judged(name: str, renderer: g.Renderer) -> None:
    smooth = scene(**FILMS[name])
    verdict = g.verify(smooth, renderer=renderer)
    np.testing.assert_array_equal(verdict.picture, draw(renderer, smooth))


def test_a_jagged_picture_is_no_mean_of_nine(renderer: g.Renderer) -> None:
    verdict = g.verify(scene(supersample=3), picture=draw(renderer, scene()), renderer=renderer)
    assert verdict.verdict == "failed"
    assert {pixel.kind for pixel in verdict.worst_pixels} <= {"edge", "seam", "interior"}


def test_one_edge_pixel_outside_of_its_hull_fails(renderer: g.Renderer) -> None:
    smooth = scene(samples=4, background=(0.1, 0.2, 0.3))
    expected = find_candidates(smooth, driver=measure_freedom(renderer.context))
    pixels = draw(renderer, smooth)
    assert verdict_of(pixels, expected).verdict == "verified"
    edges = coloured(expected, PixelClass.EDGE)
    assert len(edges) > 20
    hull = np.searchsorted(expected.expected.pixel, edges)
    for pixel, candidate in zip(edges[::7], hull[::7], strict=True):
        for channel in range(3):
            for end, beyond in ((expected.expected.low, -1e-4), (expected.expected.high, 1e-4)):
                wrong = pixels.copy()
                wrong[pixel // SIZE[0], pixel % SIZE[0], channel] = end[candidate, channel] + beyond
                verdict = verdict_of(wrong, expected, explain=False)
                assert (verdict.verdict, verdict.unexplained) == ("failed", 1)


def test_an_edge_may_show_any_mixture_of_its_surfaces(renderer: g.Renderer) -> None:
    expected = find_candidates(scene(samples=4, background=(0.9, 0.9, 0.9)), driver=measure_freedom(renderer.context))
    smooth = draw(renderer, scene(samples=4, background=(0.9, 0.9, 0.9)))
    edges = coloured(expected, PixelClass.EDGE)
    place = np.searchsorted(expected.expected.pixel, edges)
    edges = edges[(expected.expected.high[place, :3] >= 0.9).all(axis=1)]
    assert len(edges) > 20, "the background shows there"
    for share in (0.0, 0.3, 1.0):
        mixed = smooth.copy()
        y, x = np.divmod(edges, SIZE[0])
        mixed[y, x] = share * mixed[y, x] + (1 - share) * 0.9
        assert verdict_of(mixed, expected, explain=False).unexplained == 0


@pytest.mark.parametrize("samples", [1, 4])
def test_the_inside_of_a_triangle_has_the_same_interval_for_any_number_of_samples(samples: int) -> None:
    plane = [{"shape": "plane", "transform": {"rotate": (70, 0, 0), "scale": (0.9, 1, 0.9)}, "material": SHINY}]
    one, several = (find_candidates(scene(plane, samples=n)).expected for n in (1, samples))
    inside = np.flatnonzero(several.classes == PixelClass.INTERIOR)
    assert len(inside) > 500
    assert (one.classes[inside] == PixelClass.INTERIOR).all()
    rows, others = (np.searchsorted(part.pixel, inside) for part in (one, several))
    np.testing.assert_allclose(several.low[others], one.low[rows], atol=2e-6)
    np.testing.assert_allclose(several.high[others], one.high[rows], atol=2e-6)


def test_a_smooth_mesh_has_seams_and_not_edges() -> None:
    expected = find_candidates(scene(samples=4)).expected
    y, x = np.divmod(np.flatnonzero(expected.classes == PixelClass.EDGE), SIZE[0])
    # The outline is a circle round the middle of the picture; the rest of the mesh's edges agree.
    assert (np.hypot(x - 31.5, y - 23.5) > 15).mean() > 0.7
    assert (expected.classes == PixelClass.SEAM).sum() > 300


@pytest.mark.filterwarnings("ignore:blended")
def test_blended_and_cut_out_surfaces(renderer: g.Renderer, tmp_path: Path) -> None:
    checks = np.zeros((16, 16, 4), dtype=np.float32)
    checks[..., :3] = 0.7
    checks[..., 3] = np.indices((16, 16)).sum(axis=0) // 4 % 2
    g.Image(checks).save(tmp_path / "checks.exr")
    grid = {"texture": str(tmp_path / "checks.exr")}
    objects = [
        {"shape": SPHERE, "material": {"brdf": "lambert"}},
        {
            "shape": "cube",
            "transform": {"scale": (0.8, 0.8, 0.8)},
            "material": {"brdf": "lambert", "kd": grid, "alpha_mode": "mask"},
        },
        {
            "shape": "plane",
            "transform": {"translate": (0, 0, 1.2), "rotate": (80, 0, 0), "scale": (0.6, 1, 0.6)},
            "material": {"brdf": "lambert", "kd": (0.3, 0.5, 0.9), "alpha_mode": "blend", "alpha": 0.4},
        },
    ]
    smooth = scene(objects, samples=4, background=(0.2, 0.1, 0.3, 0.5))
    verdict = g.verify(smooth, renderer=renderer)
    assert verdict.unexplained == 0, str(verdict)
    assert g.verify(smooth, picture=verdict.picture * np.float32(1.01), renderer=renderer).verdict == "failed"


def test_mutations_are_caught(renderer: g.Renderer) -> None:
    smooth = scene([{"shape": {"type": "sphere", "segments": 8, "rings": 5}, "material": SHINY}], samples=4)
    clean = draw(renderer, smooth)
    expected = find_candidates(smooth, driver=measure_freedom(renderer.context))
    visible, missed = 0, []
    for mutation in MUTATIONS.values():
        renderer.rewrite = None if mutation.picture else mutation.rewrite
        try:
            pixels = mutation.picture(clean) if mutation.picture else draw(renderer, smooth)
        finally:
            renderer.rewrite = None
        if not np.abs(pixels - clean).max() <= VISIBLE:
            visible += 1
            missed += [mutation.name] if verdict_of(pixels, expected, explain=False).verdict != "failed" else []
    assert visible > 10
    assert missed == []


def test_edges_alone_prove_nothing(renderer: g.Renderer) -> None:
    """A grass of strips, each thinner than a pixel, has only edges."""
    strips = [
        {
            "shape": "plane",
            "transform": {"rotate": (90, 0, 0), "scale": (0.01, 1, 1), "translate": (x, 0, 0)},
            "material": SHINY,
        }
        for x in np.linspace(-1, 1, 25)
    ]
    verdict = g.verify(scene(strips, samples=4), renderer=renderer)
    assert (verdict.verdict, verdict.unexplained) == ("inconclusive", 0)
    assert verdict.comparison.doubtful > 0.5
    assert verdict.ambiguous < 0.03


coordinate = st.floats(-1.2, 1.2)
corner = st.tuples(coordinate, coordinate, st.floats(-2.0, 1.5))


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    triangles=st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=6),
    film=st.sampled_from(
        [{"samples": 4}, {"samples": 8}, {"samples": 4, "background": (0.1, 0.5, 0.2, 0.5)}, {"supersample": 2}]
    ),
    shading=st.sampled_from(["flat", "gouraud", "phong"]),
)
def test_random_triangles_are_explained(triangles: Any, film: Any, shading: Any, renderer: g.Renderer) -> None:
    mesh = g.Mesh.build(np.array(triangles, dtype=np.float64).reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
    smooth = scene([{"mesh": mesh, "material": SHINY}], size=(40, 30), **film)
    verdict = g.verify(smooth, renderer=renderer, shading=shading)
    assert verdict.unexplained == 0, str(verdict)


# A driver that is not known.


def test_an_unknown_driver_may_draw_eight_samples_in_two_pictures(renderer: g.Renderer) -> None:
    smooth = scene(samples=8)
    pixels = draw(renderer, smooth)
    assert g.verify(smooth, picture=pixels).unexplained == 0
    one, two = (find_candidates(smooth, driver=replace(Freedom(), samples=n)).expected for n in (8, 4))
    assert not np.array_equal(one.low, two.low), "the number of pictures matters"


@pytest.mark.parametrize("bits", [4, 6])
def test_corners_on_a_coarse_grid_are_explained_by_a_driver_with_few_sub_pixel_bits(bits: int, renderer: g.Renderer) -> None:
    """The vertex stage snaps the corners, so that they are where a driver with a coarse grid would put them."""
    drawn = scene(size=(80, 60))
    step = f"{2.0**bits * 0.5:.1f} * vec2({drawn.film.size[0]:.1f}, {drawn.film.size[1]:.1f})"

    def snapping(source: Any) -> Any:
        stage = source.stages[0]
        end = stage.text.rindex("}")
        snap = f"    gl_Position.xy = round(gl_Position.xy / gl_Position.w * {step}) / ({step}) * gl_Position.w;\n"
        return replace(source, vertex=replace(stage, text=stage.text[:end] + snap + stage.text[end:]))

    renderer.rewrite = snapping
    try:
        pixels = draw(renderer, drawn)
    finally:
        renderer.rewrite = None
    coarse = replace(measure_freedom(renderer.context), subpixel_bits=bits, snap=2.0**-bits)
    assert verdict_of(pixels, find_candidates(drawn, driver=coarse)).unexplained == 0
    assert verdict_of(pixels, find_candidates(drawn, driver=UNMEASURED)).unexplained == 0
    assert verdict_of(pixels, find_candidates(drawn)).unexplained > 10, "a driver with 8 bits does not draw this"


def test_the_reference_explains_its_own_picture_with_several_samples() -> None:
    smooth = scene(samples=4, background=(0.1, 0.2, 0.3))
    assert verdict_of(picture.render(smooth).pixels, find_candidates(smooth)).unexplained == 0


@pytest.mark.parametrize("shading", ["gouraud", "phong"])
def test_a_covered_pixel_whose_samples_are_hidden_in_part(shading: Any, renderer: g.Renderer) -> None:
    """A driver may shade the triangle behind an outline at the centroid of the samples that the depth test leaves it."""

    corners = np.array([[-1.0, -0.35, 0.01], [1.1, -0.3, 0.01], [0.9, 0.05, 0.01]])
    places = np.array([[-1.2, -0.3, 0.0], [1.2, -0.3, 0.0], [0.0, 0.3, 0.0]])
    # Behind the upper edge of the triangle in front, the colour grows with the distance from that edge. So the value at the
    # centroid of what is left lies beyond those at the pixel's centre and in front.
    distance = places[:, 1] + 0.35 - 0.4 / 1.9 * (places[:, 0] + 1.0)
    grey = np.repeat(0.5 + 0.8 * distance[:, None], 3, axis=1)
    triangle = np.array([[0, 1, 2]])
    behind = g.Mesh(places, triangle, colours=np.column_stack([grey, np.ones(3)]))
    front = g.Mesh(corners, triangle, colours=np.array([[0.5, 0.5, 0.5, 1.0]] * 3))
    white = {"brdf": "lambert", "kd": 1.0}
    objects = [{"mesh": mesh, "material": white, "normals": "face"} for mesh in (front, behind)]
    for order in (objects, objects[::-1]):
        drawn = scene(order, samples=4)
        candidates = find_candidates(drawn, shading=shading, driver=measure_freedom(renderer.context))
        picture = renderer.render(drawn, dtype="float32", shading=shading).pixels.copy()
        verdict = verdict_of(picture, candidates)
        assert verdict.unexplained == 0, verdict
        assert np.isin(candidates.expected.classes, (PixelClass.SEAM, PixelClass.EDGE)).sum() > 20


@pytest.mark.parametrize("shading", ["gouraud", "phong"])
def test_surfaces_that_cross_within_a_pixel(shading: Any, renderer: g.Renderer) -> None:
    """Both cover the pixel whole, but the depth test leaves each only some of its samples."""
    triangle = np.array([[0, 1, 2]])
    level = np.array([[-1.5, -0.6, 0.0], [1.5, -0.6, 0.0], [0.0, 0.9, 0.0]])
    # The second triangle cuts the first one along a slanted line, beside which its own colour grows quickly.
    leaning = level + np.array([[0, 0, -0.5], [0, 0, 0.4], [0, 0, 0.3]])
    grey = np.repeat((0.5 + 1.0 * leaning[:, 2])[:, None], 3, axis=1)
    first = g.Mesh(level, triangle, colours=np.array([[0.5, 0.5, 0.5, 1.0]] * 3))
    second = g.Mesh(leaning, triangle, colours=np.column_stack([grey, np.ones(3)]))
    white = {"brdf": "lambert", "kd": 1.0}
    light = [{"type": "directional", "direction": (0, 0, -1), "intensity": 0.2}]
    objects = [{"mesh": mesh, "material": white, "normals": "face"} for mesh in (first, second)]
    for order in (objects, objects[::-1]):
        drawn = scene(order, lights=light, samples=4)
        candidates = find_candidates(drawn, shading=shading, driver=measure_freedom(renderer.context))
        picture = renderer.render(drawn, dtype="float32", shading=shading).pixels.copy()
        verdict = verdict_of(picture, candidates)
        assert verdict.unexplained == 0, verdict


def test_slopes_below_the_smallest_normal_number(renderer: g.Renderer) -> None:
    """A driver flushes the slope of light so faint that it changes by less than float32 holds from pixel to pixel."""
    lights = [{"type": "point", "position": (0.5, 3.0, 4.0), "falloff": "none", "intensity": -2e-35}]
    ball = {"shape": {"type": "sphere", "segments": 48, "rings": 24}, "material": SHINY, "shading": "gouraud"}
    verdict = g.verify(scene([ball], lights=lights, size=(240, 160), samples=1), renderer=renderer)
    assert verdict.unexplained == 0, verdict
