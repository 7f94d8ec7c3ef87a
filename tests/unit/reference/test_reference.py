"""Reference: the float64 renderer agrees with closed forms, with brute force, and with the GPU on complex scenes."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from glshade import Image, Mesh, Renderer, Scene, reference
from glshade.driver.freedom import measure_freedom
from glshade.mesh.primitives import plane, sphere, torus
from glshade.radiance.sampler import Sampler
from glshade.reference import clip
from glshade.reference.inputs import prepare
from glshade.reference.raster import MARGIN, Fragments, rasterise
from glshade.reference.shade import Sampling

Array = NDArray[np.float64]
# Uniforms are float32, so both renderers get this value of pi.
PI = float(np.float32(math.pi))
MESHES = Path(__file__).parents[4] / "shared" / "data" / "meshes"

DOWN = {"type": "orthographic", "eye": (0, 5, 0), "target": (0, 0, 0), "up": (0, 0, -1), "height": 2, "near": 1, "far": 9}
# With a field of view of 90 degrees, a pixel's ray is exactly (x, y, -1), where x and y in [-1, 1] are those of its centre.
AHEAD = {"type": "perspective", "eye": (0, 0, 0), "target": (0, 0, -1), "fov": 90, "near": 0.5, "far": 16}
WHITE = {"brdf": "lambert", "kd": 1.0}
AMBIENT = {"type": "ambient"}


def scene(objects: Any, lights: Any, camera: Any = DOWN, size: tuple[int, int] = (16, 16), **film: Any) -> Scene:
    objects = [objects] if isinstance(objects, dict) else objects
    film = {"size": size, "background": (0, 0, 0, 0), **film}
    return Scene.model_validate({"objects": objects, "lights": lights, "camera": camera, "film": film})


def flat_picture(triangles: Any, size: int, **more: Any) -> Scene:
    """Returns a scene of white triangles whose corners (T, 3, 2) are given in the picture [pixels], y pointing down."""
    corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 2)
    p = np.stack([corners[:, 0] - size / 2, size / 2 - corners[:, 1], np.zeros(len(corners))], axis=1)
    camera = {"type": "orthographic", "eye": (0, 0, 4), "target": (0, 0, 0), "height": size, "near": 1, "far": 8}
    item = {"mesh": (p, np.arange(len(p)).reshape(-1, 3)), "sides": "both", "material": WHITE, **more}
    return scene(item, [AMBIENT], camera, (size, size))


def fragments(view: Scene, margin: float = 0.0) -> Fragments:
    return Fragments.joined(rasterise(prepare(view), margin))


def rays(width: int, height: int) -> Array:
    """Returns the directions (H, W, 3) of the pixels of the camera AHEAD."""
    x, y = np.meshgrid((np.arange(width) + 0.5) * 2 / width - 1, 1 - (np.arange(height) + 0.5) * 2 / height)
    return np.stack([x, y, -np.ones_like(x)], axis=2)


# Light.


@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
def test_plane_under_directional_light(rate: Any) -> None:
    """The light is kd/pi n.l times pi I."""
    light = {"type": "directional", "direction": (0, -1, 0), "colour": (1.0, 0.5, 0.25)}
    pixels = reference.radiance(scene({"shape": "plane", "material": {"brdf": "lambert", "kd": 0.5}}, [light]), shading=rate)
    expected = 0.5 / math.pi * np.array([np.float64(np.float32(math.pi * c)) for c in (1.0, 0.5, 0.25)])
    np.testing.assert_allclose(pixels[..., :3], np.broadcast_to(expected, (16, 16, 3)), rtol=0, atol=1e-12)
    assert (pixels[..., 3] == 1).all()


@pytest.mark.parametrize(("falloff", "power"), [("none", 0), ("1/r", 1), ("1/r^2", 2)])
def test_plane_under_point_light(falloff: str, power: int) -> None:
    """The light is kd/pi cos(theta) pi I / r^power at each pixel, where r is at least r_min."""
    light = {"type": "point", "position": (0.25, 0.5, 0), "falloff": falloff, "r_min": 0.75}
    pixels = reference.radiance(scene({"shape": "plane", "material": WHITE}, [light]))
    x, z = np.meshgrid(*[(np.arange(16) + 0.5) / 8 - 1] * 2)
    r = np.sqrt((x - 0.25) ** 2 + 0.5**2 + z**2)
    expected = PI / math.pi * 0.5 / r / np.maximum(r, 0.75) ** power
    np.testing.assert_allclose(pixels[..., 0], expected, rtol=0, atol=1e-12)


def test_lights_add_reach_what_they_name_and_take_exposure() -> None:
    left = {"name": "left", "shape": "plane", "transform": {"translate": (-1, 0, 0)}, "material": WHITE}
    right = {"name": "right", "shape": "plane", "transform": {"translate": (1, 0, 0)}, "material": WHITE}
    sun = {"type": "directional", "direction": (0, -1, 0), "only": ["left"]}
    pixels = reference.radiance(scene([left, right], [sun, AMBIENT, {**AMBIENT, "intensity": -0.25}], exposure=1.0))
    gain = float(np.float32(2 * math.pi)) / math.pi
    np.testing.assert_allclose(pixels[:, :8, :3], gain + 1.5, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pixels[:, 8:, :3], 1.5, rtol=0, atol=1e-12)


def test_perspective_and_orthographic_viewers() -> None:
    """The highlight of a light beside the viewer shows that v is constant in one view and points to the eye in the other."""
    material = {"brdf": "phong", "kd": 0.0, "ks": 1.0, "exponent": 3.0}
    light = {"type": "directional", "direction": (0, -1, 0)}
    pixels = reference.radiance(scene({"shape": "plane", "material": material}, [light]))
    np.testing.assert_allclose(pixels[..., 0], PI / math.pi, rtol=0, atol=1e-12)
    camera = {"type": "perspective", "eye": (0, 1, 0), "target": (0, 0, 0), "up": (0, 0, -1), "fov": 90, "near": 0.5, "far": 2}
    pixels = reference.radiance(scene({"shape": "plane", "material": material}, [light], camera))
    x, z = np.meshgrid(*[(np.arange(16) + 0.5) / 8 - 1] * 2)
    expected = PI / math.pi * (1 / np.sqrt(1 + x * x + z * z)) ** 3
    np.testing.assert_allclose(pixels[..., 0], expected, rtol=0, atol=1e-12)


def test_flat_gouraud_and_phong_differ_as_they_should() -> None:
    """A face that is lit from nearby is constant (flat), interpolated from its corners (gouraud) or exact (phong)."""
    light = {"type": "point", "position": (0, 1, 0), "falloff": "none"}
    view = scene({"shape": "plane", "material": WHITE}, [light])
    flat, gouraud, phong = (reference.radiance(view, shading=rate)[..., 0] for rate in ("flat", "gouraud", "phong"))
    assert len(np.unique(flat.round(12))) == 1  # both triangles' centroids are equally far
    np.testing.assert_allclose(flat, PI / math.pi / math.sqrt(1 + 2 / 9), atol=1e-7)  # centroids are float32
    np.testing.assert_allclose(gouraud, PI / math.pi / math.sqrt(3), atol=1e-12)
    assert phong.max() > 0.99
    assert phong.min() < 0.65


# Coverage.


def test_one_triangle_covers_the_centres_inside_it() -> None:
    """The right angle is at the upper left. Centres on the left and top edges are covered, those on the third edge are not."""
    pixels = reference.radiance(flat_picture([[(1.5, 2.5), (1.5, 6.5), (5.5, 2.5)]], 8))[..., 3]
    expected = np.array([[1.0 if x >= 1 and y >= 2 and (x - 1) + (y - 2) < 4 else 0.0 for x in range(8)] for y in range(8)])
    np.testing.assert_array_equal(pixels, expected)


def test_a_triangle_too_small_for_a_centre_covers_nothing() -> None:
    pixels = reference.radiance(flat_picture([[(2.6, 2.6), (2.6, 3.4), (3.4, 2.6)]], 8))
    assert not pixels.any()


def test_coverage_is_that_of_exact_arithmetic() -> None:
    """The coverage of random triangles on the sub-pixel grid equals that of Python's integers."""
    random = np.random.default_rng(3)
    corners = random.integers(-3 * 256, 19 * 256, (200, 3, 2))
    corners[:100] = corners[:100] // 128 * 128  # half of them with corners on centres and edges through them
    found = fragments(flat_picture(corners / 256, 16))
    covered = np.zeros((200, 256), dtype=bool)
    covered[found.triangle, found.pixel] = True
    for which, triangle in enumerate(corners.tolist()):
        a, b, c = triangle
        if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) < 0:
            triangle = [a, c, b]
        for pixel in range(256):
            x, y = pixel % 16 * 256 + 128, pixel // 16 * 256 + 128
            inside = True
            for (ax, ay), (bx, by) in zip(triangle, [*triangle[1:], triangle[0]], strict=True):
                distance = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
                inside &= distance > 0 or (distance == 0 and (by < ay or (by == ay and bx > ax)))
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            assert covered[which, pixel] == (inside and area != 0), (triangle, pixel)


def test_shared_edges_have_one_owner() -> None:
    item = {"shape": {"type": "plane", "segments": 7}, "transform": {"rotate": (0, 25, 0), "scale": 3}, "material": WHITE}
    found = fragments(scene(item, [AMBIENT], size=(40, 40)))
    assert sorted(found.pixel.tolist()) == list(range(1600))


def test_margin_adds_the_candidates_near_edges() -> None:
    triangle = [(2.5 - 2 / 256, 0.0), (2.5 - 2 / 256, 8.0), (8.5, 0.0)]
    outside = [(2.5 + 2 / 256, 0.0), (2.5 + 2 / 256, 8.0), (8.5, 0.0)]
    far = [(2.5 + 4 / 256, 0.0), (2.5 + 4 / 256, 8.0), (8.5, 0.0)]
    found = fragments(flat_picture([triangle, outside, far], 8), MARGIN)
    at = {(int(t), int(p)): (bool(c), bool(m)) for t, p, c, m in zip(
        found.triangle, found.pixel, found.covered, found.partial, strict=True
    )}  # fmt: skip
    middle = 8 * 2 + 2
    assert at[0, middle] == (True, True)
    assert at[1, middle] == (False, True)
    assert (2, middle) not in at
    assert at[2, middle + 1] == (True, False)
    assert set(map(tuple, np.stack([found.triangle, found.pixel], 1)[found.covered].tolist())) == set(
        map(
            tuple, (lambda f: np.stack([f.triangle, f.pixel], 1))(fragments(flat_picture([triangle, outside, far], 8))).tolist()
        )
    )


@pytest.mark.parametrize(("sides", "mirror"), [("front", 1), ("front", -1), ("both", 1), ("both", -1)])
def test_back_faces(sides: str, mirror: float) -> None:
    up = {"shape": "plane", "transform": {"translate": (-1, 0, 0), "scale": (mirror, 1, 1)}}
    down = {"shape": "plane", "transform": {"translate": (1, 0, 0), "rotate": (180, 0, 0), "scale": (mirror, 1, 1)}}
    view = scene(
        [{**item, "sides": sides, "material": WHITE} for item in (up, down)], [{"type": "directional", "direction": (0, -1, 0)}]
    )
    pixels = reference.radiance(view)
    np.testing.assert_allclose(pixels[:, :8, 0], PI / math.pi, atol=1e-12)
    # A surface that is seen from behind is shaded with its reversed normal.
    np.testing.assert_allclose(pixels[:, 8:, 0], PI / math.pi if sides == "both" else 0.0, atol=1e-12)
    assert (pixels[:, 8:, 3] == (sides == "both")).all()


# Interpolation and clipping.


SHIFT = np.array([8.0, 8.0, 16.0])


def position_coloured(corners: Any, triangles: Any) -> Mesh:
    """Returns a mesh with the vertex colours (x + 8, y + 8, z + 16) / 32, so that a pixel's colour tells the position that it
    shows.
    """
    p = np.asarray(corners, dtype=np.float64)
    colours = np.column_stack([(p + SHIFT) / 32, np.ones(len(p))])
    return Mesh.build(p, np.asarray(triangles), colours=colours)


def test_interpolation_is_perspective() -> None:
    """A steep wall shows at each pixel the intersection of the ray with its plane, x = -z / 2 - 5."""
    mesh = position_coloured([(-4, -8, -2), (2, -8, -14), (2, 8, -14), (-4, 8, -2)], [(0, 1, 2), (0, 2, 3)])
    pixels = reference.radiance(scene({"mesh": mesh, "sides": "both", "material": WHITE}, [AMBIENT], AHEAD, (32, 32)))
    ray = rays(32, 32)
    distance = -5 / (ray[..., 0] + ray[..., 2] / 2)
    point = ray * distance[..., None]
    on_wall = (distance > 0) & (point[..., 2] < -2) & (point[..., 2] > -14) & (np.abs(point[..., 1]) < 8)
    np.testing.assert_array_equal(pixels[..., 3] > 0, on_wall)
    assert on_wall.sum() > 200
    np.testing.assert_allclose(pixels[on_wall, :3], ((point + SHIFT) / 32)[on_wall], rtol=0, atol=1e-12)


def test_clipping_at_near_and_far() -> None:
    """A floor from behind the eye to beyond the far plane is seen by all rays that hit it between the near and far planes."""
    mesh = position_coloured([(-64, -1, 64), (64, -1, 64), (64, -1, -64), (-64, -1, -64)], [(0, 1, 2), (0, 2, 3)])
    camera = {**AHEAD, "near": 1.5, "far": 12}
    pixels = reference.radiance(scene({"mesh": mesh, "sides": "both", "material": WHITE}, [AMBIENT], camera, (64, 64)))
    ray = rays(64, 64)
    with np.errstate(divide="ignore"):
        depth = -1 / ray[..., 1]
    seen = (depth > 1.5) & (depth < 12)
    np.testing.assert_array_equal(pixels[..., 3] > 0, seen)
    point = ray[seen] * depth[seen][:, None]
    np.testing.assert_allclose(pixels[seen, :3], (point + SHIFT) / 32, rtol=0, atol=1e-11)


def test_cut_polygons_lie_inside_all_planes_and_keep_their_area() -> None:
    random = np.random.default_rng(4)
    triangles = random.normal(size=(500, 3, 4)) * 2
    triangles[..., 3] = 1.0
    polygons, counts = clip.cut(triangles)
    assert polygons.shape == (500, 9, 4)
    inside = polygons[counts >= 3]
    assert (inside @ clip.PLANES.T >= -1e-9).all()
    # Monte Carlo: the share of a triangle's random points inside the planes estimates the share of its area that is left.
    weights = random.dirichlet((1, 1, 1), 4000)
    within = [weights @ (triangles @ plane).T >= 0 for plane in clip.PLANES]
    share = np.logical_and.reduce(within).mean(axis=0)

    def areas(p: Array) -> Array:
        edges = p[:, 1:, :3] - p[:, :1, :3]
        result: Array = 0.5 * np.linalg.norm(np.cross(edges[:, :-1], edges[:, 1:]), axis=2).sum(axis=1)
        return result

    left = np.where(counts >= 3, areas(polygons), 0.0) / areas(triangles)
    assert np.abs(left - share).max() < 0.05


# Depth and blending.


def test_nearest_wins_and_of_equals_the_first() -> None:
    low = {"shape": "plane", "material": {"brdf": "lambert", "kd": (1, 0, 0)}}
    high = {"shape": "plane", "transform": {"translate": (1, 0.5, 0)}, "material": {"brdf": "lambert", "kd": (0, 1, 0)}}
    same = {"shape": "plane", "material": {"brdf": "lambert", "kd": (0, 0, 1)}}
    for order in ([low, high, same], [high, low, same]):
        pixels = reference.radiance(scene(order, [AMBIENT]))[..., :3]
        np.testing.assert_array_equal(pixels[:, :8], np.broadcast_to((1, 0, 0), (16, 8, 3)))
        np.testing.assert_array_equal(pixels[:, 8:], np.broadcast_to((0, 1, 0), (16, 8, 3)))


def test_blended_surfaces_lie_over_each_other_and_over_the_background() -> None:
    glass = {"brdf": "lambert", "alpha": 0.5, "alpha_mode": "blend"}
    near = {"shape": "plane", "transform": {"translate": (0, 1, 0)}, "material": {**glass, "kd": (1, 0, 0)}}
    far = {"shape": "plane", "material": {**glass, "kd": (0, 1, 0), "alpha": 0.25}}
    hidden = {"shape": "plane", "transform": {"translate": (0, -2, 0)}, "material": {**glass, "kd": (0, 0, 1)}}
    solid = {"shape": "plane", "transform": {"translate": (0, -1, 0)}, "material": {"brdf": "lambert", "kd": (0, 0, 0.5)}}
    pixels = reference.radiance(scene([near, far], [AMBIENT], background=(0.5, 0.5, 0.5, 0.5)))
    expected = 0.5 * np.array([1, 0, 0, 1]) + 0.5 * (0.25 * np.array([0, 1, 0, 1]) + 0.75 * np.array([0.25, 0.25, 0.25, 0.5]))
    np.testing.assert_allclose(pixels, np.broadcast_to(expected, pixels.shape), atol=1e-12)
    pixels = reference.radiance(scene([hidden, near, solid, far], [AMBIENT]))
    expected = 0.5 * np.array([1, 0, 0, 1]) + 0.5 * (0.25 * np.array([0, 1, 0, 1]) + 0.75 * np.array([0, 0, 0.5, 1]))
    np.testing.assert_allclose(pixels, np.broadcast_to(expected, pixels.shape), atol=1e-12)


def test_background_is_premultiplied() -> None:
    item = {"shape": "plane", "transform": {"translate": (100, 0, 0)}}
    picture = reference.render(scene(item, [], background=(1.0, 0.5, 0.25, 0.5)))
    np.testing.assert_array_equal(picture.pixels[0, 0], np.array([0.5, 0.25, 0.125, 0.5], dtype=np.float32))
    assert reference.render(scene(item, [], background=(1.0, 0.5, 0.25))).channels == "RGB"


# Textures.

CHECKER = np.array([[[0, 0, 0, 1], [1, 0, 0, 1]], [[0, 1, 0, 1], [0, 0, 1, 0]]], dtype=np.float32)


def test_texels_and_what_lies_between() -> None:
    """Samples have the values of texels and of their interpolation; v = 0 is the bottom row of the picture."""
    sampler = Sampler.of(CHECKER, ("clamp", "clamp"))
    uv = np.array([(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75), (0.5, 0.5), (0.25 + 0.125, 0.25)])
    expected = [CHECKER[1, 0], CHECKER[1, 1], CHECKER[0, 0], CHECKER[0, 1], CHECKER.mean(axis=(0, 1))]
    expected.append(0.75 * CHECKER[1, 0] + 0.25 * CHECKER[1, 1])
    np.testing.assert_allclose(sampler.sample(uv), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("mode", "texels"),
    [("repeat", [2, 0, 1, 2, 0, 1, 2, 0]), ("clamp", [0, 0, 1, 2, 2, 2, 2, 2]), ("mirror", [0, 0, 1, 2, 2, 1, 0, 0])],
)
def test_wrap_modes(mode: Any, texels: list[int]) -> None:
    ramp = np.zeros((1, 3, 4), dtype=np.float32)
    ramp[0, :, 0] = [0, 1, 2]
    centres = (np.arange(-1, 7) + 0.5) / 3
    along_u = Sampler.of(ramp, (mode, "clamp")).sample(np.column_stack([centres, np.zeros(8)]))
    np.testing.assert_allclose(along_u[:, 0], texels, atol=1e-12)
    # The same along v, which is 0 at the bottom.
    along_v = Sampler.of(ramp.transpose(1, 0, 2)[::-1], ("clamp", mode)).sample(np.column_stack([np.zeros(8), centres]))
    np.testing.assert_allclose(along_v[:, 0], texels, atol=1e-12)


def test_levels_of_detail() -> None:
    """Four texels per pixel are level 2. Between levels, samples are interpolated; levels are clamped to those that exist."""
    random = np.random.default_rng(0)
    sampler = Sampler.of(random.random((8, 16, 4), dtype=np.float32), ("repeat", "repeat"))
    step = np.array([[4 / 16, 0.0], [0.0, 4 / 8], [0.0, 1 / 8], [3 / 16, 4 / 8]])
    still = np.zeros_like(step)
    np.testing.assert_allclose(sampler.level(step, still), [2, 2, 0, math.log2(5)], atol=1e-12)
    np.testing.assert_allclose(sampler.level(still, step), [2, 2, 0, math.log2(5)], atol=1e-12)
    uv = random.random((6, 2))

    def at(level: float) -> Any:
        return sampler.sample(uv, np.full(6, level))

    np.testing.assert_allclose(at(1.25), 0.75 * at(1.0) + 0.25 * at(2.0), atol=1e-12)
    np.testing.assert_array_equal(at(-3.0), sampler.sample(uv))
    np.testing.assert_array_equal(at(9.0), at(4.0))
    np.testing.assert_allclose(at(4.0), np.broadcast_to(sampler.texels[:128].mean(axis=0, dtype=float), (6, 4)), atol=1e-6)


def test_footprint_is_that_of_finite_differences(tmp_path: Path) -> None:
    """In perspective, the derivatives of uv across the picture equal finite differences."""
    Image(CHECKER).save(tmp_path / "checker.exr")
    item = {
        "shape": "plane",
        "transform": {"translate": (0, -0.5, -3), "rotate": (20, 0, 0)},
        "material": {"brdf": "lambert", "kd": {"texture": str(tmp_path / "checker.exr")}},
        "sides": "both",
    }
    inputs = prepare(scene(item, [AMBIENT], AHEAD, (24, 24)))
    found = Fragments.joined(rasterise(inputs))
    from glshade.reference.shade import Sampling, surface_at

    def uv(offset: tuple[float, float]) -> Any:
        return surface_at(inputs.draws[0], found, inputs.size, Sampling(offset=offset))

    h = 1e-5
    middle = uv((0, 0))
    for axis, offset in enumerate([(h, 0.0), (0.0, h)]):
        difference = (uv(offset).uv - uv((-offset[0], -offset[1])).uv) / (2 * h)
        np.testing.assert_allclose(middle.footprint[axis], difference, atol=1e-8)


def test_float32_differs_little() -> None:
    view = scene({"shape": "sphere"}, [{"type": "directional"}], {"type": "perspective"}, (32, 32))
    single = reference.radiance(view, sampling=Sampling(dtype=np.float32))
    assert single.dtype == np.float32
    assert 0 < np.abs(single - reference.radiance(view)).max() < 1e-5


# Against the GPU. Unless a test says otherwise, this is the largest difference in any channel; it comes from float32 plane
# equations.
CLOSE = 5e-5


def differing(renderer: Renderer, view: Scene, **options: Any) -> Array:
    """Returns the largest difference (H, W) of the channels between the GPU and the reference."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Both renderers sort blended surfaces in the same approximate way.
        gpu = renderer.render(view, dtype="float32", **options).pixels.astype(np.float64)
    expected = reference.radiance(view, **options)
    assert (expected[..., 3] > 0).mean() > 0.05
    result: Array = np.abs(gpu - expected).max(axis=2)
    return result


def outside(renderer: Renderer, view: Scene, **options: Any) -> NDArray[np.bool_]:
    """Returns the pixels (H, W) whose difference is not explained by an error of 0.1 in the level of detail.

    Drivers may approximate the level (OpenGL 4.6 core, 8.14.1): llvmpipe takes differences within 2 x 2 pixels, and an
    approximate logarithm. Its measured error on planes is 0.05.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gpu = renderer.render(view, dtype="float32", **options).pixels
    decoded = measure_freedom(renderer.context).decoded
    conditions = [Sampling(level=shift, decoded=decoded) for shift in np.linspace(-0.1, 0.1, 9)]
    shifted = [reference.radiance(view, sampling=sampling, **options) for sampling in conditions]
    assert (shifted[0][..., 3] > 0).mean() > 0.1
    low, high = np.min(shifted, axis=0) - CLOSE, np.max(shifted, axis=0) + CLOSE
    result: NDArray[np.bool_] = ((gpu < low) | (gpu > high)).any(axis=2)
    return result


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """The path of a float picture by its name: colours, alphas, normals or fine, which has more texels than pixels."""
    folder = tmp_path_factory.mktemp("pictures")
    random = np.random.default_rng(1)
    normals = random.normal(size=(8, 8, 3)) * 0.25 + (0, 0, 1)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    content = {
        "colours": random.random((8, 8, 3)),
        "alphas": random.random((8, 8, 4)),
        "normals": 0.5 * normals + 0.5,
        "fine": random.random((256, 256, 3)),
    }
    for name, pixels in content.items():
        Image(np.ascontiguousarray(pixels, dtype=np.float32)).save(folder / f"{name}.exr")
    return lambda name: str(folder / f"{name}.exr")


def half_open() -> Mesh:
    """Returns half of a torus, a mesh whose inside is visible."""
    whole = torus(48, 24)
    return Mesh.build(whole.positions, whole.triangles[: len(whole.triangles) // 2], whole.normals, whole.uvs)


def coloured() -> Mesh:
    ball = sphere(24, 12)
    colours = np.random.default_rng(2).random((len(ball.positions), 4))
    return Mesh.build(ball.positions, ball.triangles, ball.normals, ball.uvs, colours)


RATES = ["flat", "gouraud", "phong"]
SUN = {"type": "directional", "direction": (-0.4, -0.6, -0.7)}
LIGHTS = [SUN, {"type": "ambient", "intensity": 0.1}]
AROUND = {"type": "perspective"}
TURNED = {"rotate": (40, 20, 10), "scale": (-1, 1.5, 0.7), "translate": (0.3, 0, 0)}


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("sides", ["both", "front"])
@pytest.mark.parametrize("material", [{"brdf": "phong"}, {"brdf": "ashikhmin_shirley", "pv": 10}], ids=lambda m: m["brdf"])
def test_two_sided_and_mirrored_like_the_gpu(renderer: Renderer, rate: str, sides: str, material: Any) -> None:
    item = {"mesh": half_open(), "sides": sides, "material": material, "transform": TURNED, "shading": rate}
    view = scene(item, LIGHTS, AROUND, (96, 96))
    assert differing(renderer, view).max() < CLOSE


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("mode", ["opaque", "mask", "blend"])
def test_vertex_colours_and_alpha_like_the_gpu(renderer: Renderer, rate: str, mode: str) -> None:
    """A cut-out's edge could differ where alpha equals the cutoff to float32 precision, but here it does not."""
    item = {"mesh": coloured(), "material": {"brdf": "phong", "alpha_mode": mode}, "transform": TURNED, "shading": rate}
    error = differing(renderer, scene(item, LIGHTS, AROUND, (96, 96), background=(0.1, 0.2, 0.3, 0.5)))
    assert np.quantile(error, 0.999) < CLOSE
    assert error.max() < 10 * CLOSE  # colours that change from 0 to 1 within a pixel, at the silhouette


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("what", ["textured", "bumpy", "anisotropic and bumpy", "mask", "blend"])
def test_textures_like_the_gpu(renderer: Renderer, pictures: Callable[[str], str], rate: str, what: str) -> None:
    """Only a few pixels at the silhouette may differ, where the level of detail changes within a block of 2 x 2 pixels."""
    bumps = {"texture": pictures("normals"), "scale": 1.5}
    material: dict[str, Any] = {
        "textured": {"brdf": "phong", "kd": {"texture": pictures("colours")}, "ks": {"texture": pictures("alphas")}},
        "bumpy": {"brdf": "phong", "normal_map": bumps},
        "anisotropic and bumpy": {"brdf": "ashikhmin_shirley", "pv": 10, "normal_map": bumps},
        "mask": {"brdf": "phong", "alpha_mode": "mask", "kd": {"texture": pictures("alphas")}},
        "blend": {"brdf": "phong", "alpha_mode": "blend", "kd": {"texture": pictures("alphas")}},
    }[what]
    item = {"shape": {"type": "torus"}, "material": material, "transform": TURNED, "shading": rate}
    unexplained = outside(renderer, scene(item, LIGHTS, AROUND, (96, 96)))
    assert unexplained.mean() < 0.005


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
def test_wrap_modes_like_the_gpu(renderer: Renderer, pictures: Callable[[str], str], wrap: str) -> None:
    square = plane()
    assert square.uvs is not None
    mesh = Mesh.build(square.positions, square.triangles, square.normals, square.uvs * 3 - 1.2)
    item = {"mesh": mesh, "material": {"brdf": "lambert", "kd": {"texture": pictures("colours"), "wrap": wrap}}}
    assert differing(renderer, scene(item, LIGHTS, DOWN, (96, 96))).max() < CLOSE


def test_minified_texture_like_the_gpu(renderer: Renderer, pictures: Callable[[str], str]) -> None:
    item = {"shape": "plane", "sides": "both", "material": {"brdf": "lambert", "kd": {"texture": pictures("fine")}}}
    view = scene(item, LIGHTS, {"type": "perspective", "eye": (0.3, 1.5, 2.5), "target": (0, 0, 0)}, (96, 96))
    assert differing(renderer, view).max() > CLOSE  # the levels do matter here
    assert outside(renderer, view).mean() < 0.005


@pytest.mark.parametrize("rate", RATES)
def test_floor_through_the_near_plane_like_the_gpu(renderer: Renderer, rate: str) -> None:
    item = {"shape": {"type": "plane", "segments": 5}, "transform": {"scale": 10}, "shading": rate}
    camera = {"type": "perspective", "eye": (0.3, 0.5, 0), "target": (0, 0.3, -1), "near": 0.05, "far": 9}
    light = {"type": "point", "position": (0, 1, -2)}
    assert differing(renderer, scene(item, [light], camera, (96, 96))).max() < CLOSE


def test_coverage_like_the_gpu(renderer: Renderer) -> None:
    """With corners on pixel centres and halfway between them, the driver breaks ties as the reference does."""
    random = np.random.default_rng(0)
    cell = np.stack(np.meshgrid(np.arange(0, 96, 8), np.arange(0, 96, 8)), axis=2).reshape(-1, 1, 2)
    for step in (1, 2, 256):
        view = flat_picture(cell + random.integers(0, 7 * step + 1, (len(cell), 3, 2)) / step + 0.5, 96)
        assert differing(renderer, view).max() < CLOSE


@pytest.mark.parametrize("count", [3, 9])
def test_many_lights_like_the_gpu(renderer: Renderer, count: int) -> None:
    """Few lights are counted exactly, many come from a uniform block."""
    random = np.random.default_rng(count)
    places = [tuple(float(c) for c in place) for place in random.normal(size=(count, 3)) * 3]
    lights = [
        {"type": "point", "position": place, "falloff": falloff, "intensity": 3 / count}
        for place in places
        for falloff in ("none", "1/r", "1/r^2")
    ]
    assert differing(renderer, scene({"shape": "icosphere"}, lights, AROUND, (96, 96))).max() < CLOSE


@pytest.mark.filterwarnings("ignore:.*its animations are not played")
@pytest.mark.parametrize("name", ["spot.obj", "suzanne.obj", "teapot.obj", "Duck.glb", "CesiumMilkTruck.glb", "fuze.obj"])
@pytest.mark.parametrize(
    "rate", [pytest.param("flat", marks=pytest.mark.slow), pytest.param("gouraud", marks=pytest.mark.slow), "phong"]
)
def test_meshes_from_elsewhere_like_the_gpu(renderer: Renderer, name: str, rate: Any) -> None:
    """Meshes of other programs, with their own materials and textures."""
    if not (MESHES / name).is_file():
        pytest.skip(f"{MESHES / name} is not there: these meshes are not part of the repository")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        view = scene({"mesh": str(MESHES / name)}, LIGHTS, AROUND, (128, 128))
        unexplained = outside(renderer, view, shading=rate)
    assert unexplained.mean() < 0.005
