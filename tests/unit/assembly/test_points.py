"""Points: squares of a size in pixels that face the viewer, in both renderers."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from glshade import Scene, SceneError
from glshade.assembly.assembly import assemble
from glshade.limits import Limits
from glshade.mesh.mesh import Mesh
from glshade.mesh.strokes import build_strokes
from glshade.reference.picture import render
from glshade.verification.verification import verify

# An orthographic picture of 16 x 16 pixels in which a pixel is one scene unit wide, with 0 at its bottom left corner.
PIXELS = {"type": "orthographic", "eye": (8.0, 8.0, 10.0), "target": (8.0, 8.0, 0.0), "height": 16.0, "near": 1, "far": 20}
SMALL = {"size": (16, 16)}


def points(positions: Any, colours: Any = None, normals: Any = None) -> Mesh:
    """Returns the mesh of points at these positions (N, 3), with colours (N, 3)."""
    numbers = np.arange(len(positions))
    if colours is not None:
        colours = np.column_stack([colours, np.ones(len(positions))])
    return build_strokes(positions, np.stack([numbers, numbers], axis=1), normals, None, colours)[0]


def scene(mesh: Mesh, film: Any = None, camera: Any = None, **more: Any) -> Scene:
    return Scene.model_validate({"objects": [{"mesh": mesh}], "film": film or SMALL, "camera": camera or PIXELS, **more})


def shown(pixels: NDArray[Any]) -> set[tuple[int, int]]:
    """Returns the pixels (x, y) that are not black, with y counted from the bottom."""
    rows, columns = np.nonzero(pixels[::-1, :, :3].any(axis=2))
    return set(zip(columns.tolist(), rows.tolist(), strict=True))


PLACE = st.floats(-3, 19, allow_nan=False)


@given(x=PLACE, y=PLACE, size=st.sampled_from([1.0, 2.0, 2.5, 3.0, 7.25]), samples=st.sampled_from([1, 4]))
def test_a_point_covers_the_pixels_whose_centres_lie_in_its_square(x: float, y: float, size: float, samples: int) -> None:
    """With several samples the edges are not moved to the grid, and at the centres of pixels that makes no difference."""
    picture = render(scene(points([(x, y, 0.0)]), {**SMALL, "point_size": size, "samples": samples})).pixels
    near = [[abs(abs(k + 0.5 - at) - size / 2) < 0.02 for k in range(16)] for at in (x, y)]
    inside = [[abs(k + 0.5 - at) < size / 2 for k in range(16)] for at in (x, y)]
    covered = shown(picture)
    for column in range(16):
        for row in range(16):
            if not (near[0][column] or near[1][row]):
                assert ((column, row) in covered) == (inside[0][column] and inside[1][row])


def test_a_point_of_one_pixel_covers_one_pixel_wherever_it_lies() -> None:
    for x in np.linspace(3, 5, 41):
        assert len(shown(render(scene(points([(x, x, 0.0)]))).pixels)) == 1


def test_points_have_the_same_size_at_every_depth(draw: Any) -> None:
    near_and_far = points([(-0.2, 0.0, 1.0), (2000.0, 0.0, -9995.0)])
    camera = {"eye": (0, 0, 5), "target": (0, 0, 0), "fov": 40}
    picture = draw({"mesh": near_and_far}, size=(64, 64), camera=camera, film={"point_size": 6})
    assert len(shown(picture)) == 2 * 6 * 6


def test_points_show_their_colours_whatever_the_light(draw: Any) -> None:
    cloud = points([(4.5, 4.5, 0.0), (11.5, 11.5, 0.0)], [(0.25, 0.5, 1.0), (1.0, 0.0, 0.125)])
    for lights in (None, [], [{"type": "point", "position": (0, 0, 3)}]):
        picture = draw({"mesh": cloud}, lights, size=(16, 16), camera=PIXELS)[::-1]
        assert picture[4, 4, :3] == pytest.approx([0.25, 0.5, 1.0], abs=1e-6)
        assert picture[11, 11, :3] == pytest.approx([1.0, 0.0, 0.125], abs=1e-6)
        assert len(shown(picture)) == 2


def test_a_material_colours_points(draw: Any) -> None:
    cloud = points([(4.5, 4.5, 0.0)], [(0.25, 0.5, 1.0)])
    for colours, expected in ((True, (0.125, 0.125, 0.25)), (False, (0.5, 0.25, 0.25))):
        item = {"mesh": cloud, "material": {"brdf": "lambert", "kd": (0.5, 0.25, 0.25)}, "vertex_colours": colours}
        assert draw(item, [], size=(16, 16), camera=PIXELS)[11, 4, :3] == pytest.approx(expected, abs=1e-6)


def test_points_without_any_colour_are_grey(draw: Any) -> None:
    assert draw({"mesh": points([(4.5, 4.5, 0.0)])}, [], size=(16, 16), camera=PIXELS)[11, 4, :3] == pytest.approx([0.6] * 3)


@pytest.mark.parametrize("side", [1, -1])
def test_points_with_normals_are_lit_on_the_side_of_the_viewer(draw: Any, side: int) -> None:
    """The two normals are 60 degrees off the light, on either side; a normal that points away from the viewer turns round."""
    normals = side * np.array([(np.sqrt(3) / 2, 0.0, 0.5), (0.0, 0.0, 1.0)])
    cloud = points([(4.5, 4.5, 0.0), (11.5, 4.5, 0.0)], normals=normals)
    item = {"mesh": cloud, "material": {"brdf": "lambert", "kd": 1.0}}
    picture = draw(item, [{"type": "directional", "direction": (0, 0, -1)}], size=(16, 16), camera=PIXELS)
    assert picture[11, 4, :3] == pytest.approx([0.5] * 3, abs=1e-5)
    assert picture[11, 11, :3] == pytest.approx([1.0] * 3, abs=1e-5)


def test_the_normals_follow_a_transform_by_unequal_factors(draw: Any) -> None:
    cloud = points([(0.0, 0.0, 0.0)], normals=[(1.0, 0.0, 1.0)])
    item = {
        "mesh": cloud,
        "material": {"brdf": "lambert", "kd": 1.0},
        "transform": {"scale": (0.5, 1.0, 1.0), "translate": (4.5, 4.5, 0.0)},
    }
    picture = draw(item, [{"type": "directional", "direction": (0, 0, -1)}], size=(16, 16), camera=PIXELS)
    assert picture[11, 4, 0] == pytest.approx(1 / np.sqrt(5), abs=1e-5)  # the normal becomes (2, 0, 1)


def test_a_cloud_far_from_the_origin_keeps_its_points_apart() -> None:
    grid = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0), [0.0]), axis=-1).reshape(-1, 3)
    far = np.array([500_000.0, 5_400_000.0, 300.0])
    camera = {**PIXELS, "eye": tuple(np.add(far, (2, 2, 10))), "target": tuple(np.add(far, (2, 2, 0))), "height": 16.0}
    assert len(shown(render(scene(points(grid * 2 + far), camera=camera)).pixels)) == 25


def test_squares_keep_their_shape_under_a_close_camera(draw: Any) -> None:
    """Float32 positions relative to the cloud's own origin could not tell the corners of a square apart here."""
    cloud = points([(1.0, 1.0, 1.0), (-1.0, -1.0, -1.0)])
    camera = {"eye": (1, 1, 1 + 1e-5), "target": (1, 1, 1), "fov": 40, "near": 1e-6, "far": 10}
    assert len(shown(draw({"mesh": cloud}, size=(64, 64), camera=camera, film={"point_size": 9}))) == 81


@pytest.mark.parametrize("normals", [None, [(0, 0, 1)]])
def test_a_camera_that_looks_away_sees_the_background(draw: Any, normals: Any) -> None:
    cloud = points([(0.0, 0.0, 0.0)], [(1, 1, 1)], normals)
    for eye, target in (((0, 0, 5), (0, 0, 9)), ((0, 0, 5), (9, 0, 4.9))):
        assert not draw({"mesh": cloud}, camera={"eye": eye, "target": target}).any()


def test_a_cloud_of_one_point_is_seen(draw: Any) -> None:
    for place in ((0.0, 0.0, 0.0), (7e5, 1.0, -3.0)):
        assert shown(draw({"mesh": points([place])}, film={"point_size": 4}))


def test_a_camera_whose_axis_is_off_the_middle_sees_the_same_points(draw: Any) -> None:
    """Its picture is the right upper quarter of a larger one, whose axis meets it at the bottom left corner."""
    rng = np.random.default_rng(9)
    cloud = points(rng.normal(size=(300, 3)), rng.uniform(0.1, 1, (300, 3)))
    camera = {"eye": (0, 0, 6), "target": (0, 0, 0), "fov": 2 * np.degrees(np.arctan(32 / 64)), "near": 1, "far": 12}
    axis = {"type": "intrinsics", "fx": 64.0, "fy": 64.0, "cx": 0.0, "cy": 32.0, "width": 32, "height": 32}
    part = {**axis, "eye": (0, 0, 6), "target": (0, 0, 0), "near": 1, "far": 12}
    for samples in (1, 4):
        film = {"point_size": 3, "samples": samples}
        whole = draw({"mesh": cloud}, size=(64, 64), camera=camera, film=film)
        quarter = draw({"mesh": cloud}, size=(32, 32), camera=part, film=film)
        assert (np.abs(whole[:32, 32:] - quarter).max(axis=2) > 1e-5).sum() <= 4


@pytest.mark.parametrize("scale", [1e-25, 1e25, 1e60])
def test_clouds_of_extreme_size_look_like_any_other(draw: Any, scale: float) -> None:
    rng = np.random.default_rng(8)
    cloud = points(rng.normal(size=(200, 3)), rng.uniform(0.1, 1, (200, 3)))
    usual, extreme = (draw({"mesh": cloud, "transform": {"scale": factor}}, film={"point_size": 3}) for factor in (1, scale))
    assert (np.abs(usual - extreme).max(axis=2) > 1e-5).sum() <= 4


def test_several_samples_smooth_the_edges(draw: Any) -> None:
    """The samples of all pixels together see the area of the square."""
    cloud = points([(4.25, 4.75, 0.0)], [(1, 1, 1)])
    picture = draw({"mesh": cloud}, size=(16, 16), camera=PIXELS, film={"supersample": 8, "point_size": 2})
    assert picture[..., 0].sum() == pytest.approx(4, abs=1e-4)
    assert len(shown(picture)) == 9


def test_crops_and_tiles_show_the_same_pixels(draw: Any) -> None:
    rng = np.random.default_rng(1)
    cloud = points(rng.uniform(0, 16, (60, 3)) * (1, 1, 0.1), rng.uniform(0.1, 1, (60, 3)))
    film = {"point_size": 3, "samples": 4}
    whole = draw({"mesh": cloud}, size=(16, 16), camera=PIXELS, film=film)
    assert np.array_equal(whole, draw({"mesh": cloud}, size=(16, 16), camera=PIXELS, film=film, tile=8))
    part = draw({"mesh": cloud}, size=(16, 16), camera=PIXELS, film={**film, "crop": (3, 5, 7, 9)})
    assert np.array_equal(whole[5:14, 3:10], part)


@pytest.mark.parametrize("lit", [False, True])
@pytest.mark.parametrize("size", [1, 2.5])
def test_a_picture_of_points_is_verified(renderer: Any, lit: bool, size: float) -> None:
    """It is judged at the centres of the pixels, and says so. Hardly a pixel is ambiguous."""
    rng = np.random.default_rng(3)
    places = rng.normal(size=(1500, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    cloud = points(places, (places + 1) / 2, places if lit else None)
    film = {"size": (128, 128), "samples": 4, "supersample": 2, "point_size": size}
    verdict = verify(Scene.model_validate({"objects": [{"mesh": cloud}], "film": film}), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.ambiguous < 0.005
    assert verdict.left_out == ("film.samples = 4", "film.supersample = 2")
    assert len(shown(verdict.picture)) > 1000


def test_points_beside_triangles_are_verified(renderer: Any) -> None:
    cloud = points(np.random.default_rng(4).uniform(-1, 1, (300, 3)), normals=np.ones((300, 3)))
    objects = [{"mesh": cloud, "material": {"brdf": "ggx"}}, {"shape": "icosphere", "transform": {"scale": 0.6}}]
    verdict = verify(Scene.model_validate({"objects": objects, "film": {"size": (96, 96)}}), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert verdict.left_out == ()


def test_shading_rates_do_not_change_points(draw: Any) -> None:
    cloud = points([(4.5, 4.5, 0.0)], normals=[(1, 0, 1)])
    pictures = [draw({"mesh": cloud}, size=(16, 16), camera=PIXELS, shading=rate) for rate in ("flat", "gouraud", "phong")]
    assert pictures[0].any()
    assert all(np.array_equal(pictures[0], other) for other in pictures[1:])


@pytest.mark.parametrize("material", [{"brdf": "ward"}, {"brdf": "ashikhmin_shirley"}])
def test_models_with_tangents_shade_points(renderer: Any, material: Any) -> None:
    rng = np.random.default_rng(5)
    cloud = points(rng.uniform(2, 14, (40, 3)) * (1, 1, 0.1), normals=rng.normal(size=(40, 3)))
    drawn = Scene.model_validate(
        {"objects": [{"mesh": cloud, "material": material}], "camera": PIXELS, "film": {**SMALL, "point_size": 2}}
    )
    verdict = verify(drawn, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert shown(verdict.picture)


def test_triangles_are_made_once_for_a_view_and_freed_for_the_next() -> None:
    first = scene(points([(4.5, 4.5, 0.0)]))
    made = assemble(first).instances[0].mesh
    assert assemble(first).instances[0].mesh is made
    freed = weakref.ref(made)
    del made
    assemble(first.model_copy(update={"camera": first.camera.model_copy(update={"turn": 20.0})}))
    gc.collect()
    assert freed() is None


def test_points_behind_another_far_plane_come_back() -> None:
    cloud = points([(4.5, 4.5, 0.0), (11.5, 4.5, -5.0)])
    counts = [len(shown(render(scene(cloud, camera={**PIXELS, "far": far})).pixels)) for far in (12, 20, 12)]
    assert counts == [1, 2, 1]


def test_points_outside_the_picture_take_no_memory() -> None:
    cloud = points(np.random.default_rng(6).uniform(-100, 100, (5000, 3)) * (1, 1, 0.01))
    assert len(assemble(scene(cloud)).instances[0].mesh.triangles) < 200


def test_copies_of_a_cloud_count_against_the_limit_of_triangles(tmp_path: Any) -> None:
    from glshade.scene.file import parse

    cloud = points(np.zeros((600, 3)))
    limits = Limits(max_triangles=1000)
    with pytest.raises(SceneError, match="make 1,200 triangles; 1,000 are allowed"):
        assemble(parse({"objects": [{"mesh": cloud}]}, tmp_path / "cloud.toml", limits))


@pytest.mark.parametrize("size", [0, 0.5, 257])
def test_a_point_size_that_is_not_drawn_is_refused(size: float) -> None:
    with pytest.raises(ValueError, match="point_size"):
        scene(points([(0, 0, 0)]), {"point_size": size})
