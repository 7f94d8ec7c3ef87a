"""pyrender's scenes: conversion and drawing, tested on stand-ins, and compared with pyrender's own pictures where it runs."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade import BRDFS, LIGHTS, GlshadeError, SceneError, from_pyrender
from glshade.gl.preparation import ApproximateWarning
from glshade.mesh.file import AssetWarning
from glshade.pyrender import OffscreenRenderer, RenderFlags
from glshade.pyrender.scene import mesh
from glshade.textures.pixel_array import PixelArray
from glshade.textures.texture import NormalMap, Texture

WIDTH, HEIGHT = 64, 48


class Thing:
    """A stand-in for any object of pyrender, which has the attributes that it is given."""

    def __init__(self, **attributes: Any) -> None:
        self.__dict__.update(attributes)


def texture(source: Any, wrap_s: int = 10497, wrap_t: int = 10497) -> Thing:
    """Returns a Texture. source: pixels (H, W) or (H, W, C). wrap_s, wrap_t: OpenGL's wrap modes; 10497 is REPEAT."""
    return Thing(source=np.asarray(source, dtype=np.uint8), sampler=Thing(wrapS=wrap_s, wrapT=wrap_t))


def surface(**changes: Any) -> dict[str, Any]:
    """Returns the attributes that all materials have. changes: values that replace the defaults."""
    return {
        "name": None,
        "normalTexture": None,
        "occlusionTexture": None,
        "emissiveTexture": None,
        "emissiveFactor": np.zeros(3),
        "alphaMode": "OPAQUE",
        "alphaCutoff": 0.5,
        "doubleSided": False,
        "wireframe": False,
        **changes,
    }


def rough(**changes: Any) -> Thing:
    """Returns a MetallicRoughnessMaterial."""
    own = {"baseColorFactor": np.ones(4), "baseColorTexture": None, "metallicFactor": 0.0, "roughnessFactor": 0.5}
    return Thing(**surface(**{**own, "metallicRoughnessTexture": None, **changes}))


def glossy(**changes: Any) -> Thing:
    """Returns a SpecularGlossinessMaterial, without the property glossinessFactor, which calls itself without end
    in pyrender.
    """
    own = {"diffuseFactor": np.ones(4), "diffuseTexture": None, "specularFactor": np.full(3, 0.25), "_glossinessFactor": 0.75}
    return Thing(**surface(**{**own, "specularGlossinessTexture": None, **changes}))


SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.float32)  # pyrender keeps indices as floats


def square(material: Thing | None = None, **changes: Any) -> Thing:
    """Returns a Primitive: a square from -1 to 1 in the plane z = 0 that faces +z."""
    given = {"positions": SQUARE, "indices": FACES, "normals": None, "texcoord_0": (SQUARE[:, :2] + 1) / 2, "color_0": None}
    return Thing(**{**given, "mode": 4, "poses": None, "material": material or rough(), **changes})


def moved(x: float = 0, y: float = 0, z: float = 0, turn: Any = None) -> Any:
    """Returns a pose (4, 4) at (x, y, z). turn: optional rotation (3, 3)."""
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    if turn is not None:
        pose[:3, :3] = turn
    return pose


def node(
    *primitives: Thing, pose: Any = None, visible: bool = True, name: str | None = None, mesh_name: str | None = None
) -> Thing:
    """Returns a Node with a mesh of these primitives."""
    pose = np.eye(4) if pose is None else pose
    return Thing(mesh=Thing(primitives=list(primitives), is_visible=visible, name=mesh_name), pose=pose, name=name)


def perspective(yfov: float = 1.0, aspect: float | None = None, near: float = 0.1, far: float | None = 50.0) -> Thing:
    """Returns a PerspectiveCamera."""
    return Thing(yfov=yfov, aspectRatio=aspect, znear=near, zfar=far, name=None)


def stage(*nodes: Thing, camera: Thing | None = None, at: Any = None, **changes: Any) -> Thing:
    """Returns a Scene of these nodes, by default seen from (0, 0, 4)."""
    seen_from = Thing(camera=camera or perspective(), pose=moved(z=4) if at is None else at, name=None)
    own = {"mesh_nodes": set(nodes), "main_camera_node": seen_from, "bg_color": np.ones(4), "ambient_light": np.zeros(3)}
    dark: dict[str, set[Thing]] = {f"{kind}_light_nodes": set() for kind in ("directional", "point", "spot")}
    return Thing(**{**own, **dark, "get_pose": lambda node: node.pose, **changes})


@pytest.fixture(scope="module")
def offscreen() -> Iterator[OffscreenRenderer]:
    """A renderer of pictures of WIDTH x HEIGHT pixels, shared by all tests."""
    renderer = OffscreenRenderer(WIDTH, HEIGHT)
    yield renderer
    renderer.delete()


def the_material(primitive: Thing) -> Any:
    """Returns the converted material of a primitive."""
    return from_pyrender(stage(node(primitive))).objects[0].material


# --- conversion ------------------------------------------------------------------------------------------------------


def test_pyrender_is_not_imported(python: Any) -> None:
    assert python("import sys, glshade; glshade.from_pyrender; print('pyrender' in sys.modules)") == "False"


def test_metallic_roughness_is_ggx() -> None:
    made = the_material(
        square(rough(baseColorFactor=np.array([0.5, 0.25, 2.0, 1.0]), metallicFactor=0.25, roughnessFactor=0.75))
    )
    assert made == BRDFS["ggx"](kd=(0.5, 0.25, 1.0), metallic=0.25, roughness=0.75, sides="front")
    assert the_material(square(rough(doubleSided=True))).sides == "both"


def test_specular_glossiness_is_ggx() -> None:
    made = the_material(square(glossy(diffuseFactor=np.array([0.5, 0.25, 1.0, 1.0]))))
    assert made == BRDFS["ggx"](kd=(0.375, 0.1875, 0.75), f0=0.25, metallic=0.0, roughness=0.25, sides="front")


def test_equal_textures_share_their_pixels() -> None:
    codes = np.random.default_rng(0).integers(0, 255, (3, 5, 4))
    codes[..., 3] = 255
    first, second = (the_material(square(rough(baseColorTexture=texture(codes, 33071, 33648)))).kd for _ in range(2))
    assert isinstance(first, Texture)
    assert first.texture is second.texture
    assert first.wrap == ("clamp", "mirror")
    assert isinstance(first.texture, PixelArray)
    np.testing.assert_array_equal(first.texture.pixels, codes)


def test_roughness_is_in_red_and_metallic_in_green() -> None:
    """pyrender uploads glTF's green and blue channels as red and green."""
    codes = np.stack([np.full((2, 2), 51), np.full((2, 2), 102)], axis=-1)
    made = the_material(square(rough(metallicRoughnessTexture=texture(codes), metallicFactor=1.0)))
    for picture, channel, code in ((made.roughness, 0, 51), (made.metallic, 1, 102)):
        assert picture.channel == "rg"[channel]
        assert (picture.texture.pixels[..., channel] == code).all()


def test_a_normal_map_needs_texture_coordinates() -> None:
    assert isinstance(the_material(square(rough(normalTexture=texture(np.full((2, 2, 3), 128))))).normal_map, NormalMap)
    without = the_material(square(rough(normalTexture=texture(np.full((2, 2, 3), 128))), texcoord_0=None))
    assert without.normal_map is None


def test_emission_has_the_square_of_its_factor_as_in_pyrender() -> None:
    made = the_material(square(rough(emissiveFactor=np.array([0.5, 1.0, 0.0]))))
    assert made.emission == (0.25, 1.0, 0.0)
    picture = texture(np.full((2, 2, 3), 128))
    textured = the_material(square(rough(emissiveFactor=np.full(3, 0.5), emissiveTexture=picture))).emission
    assert isinstance(textured, Texture)
    assert textured.factor == (0.25, 0.25, 0.25)
    without = the_material(square(rough(emissiveFactor=np.full(3, 0.5), emissiveTexture=picture), texcoord_0=None))
    assert without.emission == (0.25, 0.25, 0.25)


def test_occlusion_is_read_from_red() -> None:
    made = the_material(square(rough(occlusionTexture=texture(np.full((2, 2), 128)))))
    assert (made.occlusion.channel, made.occlusion.strength) == ("r", 1.0)
    assert the_material(square(rough())).occlusion is None


def test_a_glowing_square_is_drawn_without_light(offscreen: OffscreenRenderer) -> None:
    """pyrender's own picture has the code 255 (0.25)^(1/2.2)."""
    pixels = offscreen.render(stage(node(square(rough(emissiveFactor=np.full(3, 0.5))))))[0]
    assert pixels[HEIGHT // 2, WIDTH // 2].tolist() == [round(255 * 0.25 ** (1 / 2.2))] * 3


def test_only_transparent_surfaces_are_blended() -> None:
    """pyrender marks every material that comes from trimesh as blended."""
    assert the_material(square(rough(alphaMode="BLEND"))).alpha_mode == "opaque"
    glass = np.array([1, 1, 1, 0.5])
    assert the_material(square(rough(alphaMode="BLEND", baseColorFactor=glass))).alpha == 0.5
    holes = texture([[[255, 255, 255, 255], [255, 255, 255, 0]]])
    colours = np.array([[1, 1, 1, 0.5]] * 4, dtype=np.float32)
    for see_through in (
        square(rough(alphaMode="BLEND", baseColorFactor=glass)),
        square(rough(alphaMode="BLEND", baseColorTexture=holes)),
        square(rough(alphaMode="BLEND"), color_0=colours),
    ):
        assert the_material(see_through).alpha_mode == "blend"
    masked = the_material(square(rough(alphaMode="MASK", alphaCutoff=0.25, baseColorTexture=holes)))
    assert (masked.alpha_mode, masked.alpha_cutoff) == ("mask", 0.25)


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"wireframe": True}, "wireframes are drawn solid")],
)
def test_unsupported_parts_of_a_material_are_warned_of(changes: dict[str, Any], message: str) -> None:
    with pytest.warns(AssetWarning, match=message):
        from_pyrender(stage(node(square(rough(**changes)))))


@pytest.mark.parametrize(
    ("mode", "order", "triangles"),
    [
        (4, [0, 1, 2, 2, 3, 0], [[0, 1, 2], [2, 3, 0]]),
        (4, None, [[0, 1, 2]]),
        (5, [0, 1, 3, 2], [[0, 1, 3], [3, 1, 2]]),
        (6, [0, 1, 2, 3], [[0, 1, 2], [0, 2, 3]]),
    ],
)
def test_triangles_strips_and_fans(mode: int, order: Any, triangles: Any) -> None:
    made = mesh(square(mode=mode, indices=None if order is None else np.array(order, dtype=np.float32)))
    assert made is not None
    # A triangle may start at any of its corners, so that all are rotated to start at the least.
    rotated = [[list(np.roll(t, -int(np.argmin(t)))) for t in group] for group in (made.triangles, triangles)]
    assert rotated[0] == rotated[1]


def test_lines_become_strips_as_wide_as_pixels() -> None:
    """The camera is at a distance of 4, with a field of view of 1 radian over 480 pixels."""
    pixel = 2 * math.tan(0.5) * 4 / 480
    line = from_pyrender(stage(node(square(mode=2)))).objects[0].mesh
    assert isinstance(line, glshade.Mesh)
    # The line is a closed loop through the six corners of two triangles.
    assert len(line.triangles) == 6 * 2
    np.testing.assert_allclose(np.ptp(line.positions[:4], axis=0), [2, pixel, 0], rtol=1e-4, atol=1e-7)


def test_points_stay_points() -> None:
    given = square(mode=0)
    scene = from_pyrender(stage(node(given)))
    dots = scene.objects[0].mesh
    assert isinstance(dots, glshade.Mesh)
    assert dots.strokes is not None
    # The square lists the corners of two triangles, so that two of its points are drawn twice.
    np.testing.assert_array_equal(dots.strokes, np.stack([given.indices.reshape(-1)] * 2, axis=1))
    np.testing.assert_array_equal(dots.positions, given.positions)
    assert scene.film.point_size == 1


def test_points_that_are_not_finite_are_left_out() -> None:
    given = square(mode=0)
    given.positions = given.positions.copy()
    given.positions[1, 1] = np.nan
    lost = int((given.indices == 1).sum())
    with pytest.warns(AssetWarning, match=f"{lost} points that are not finite are left out"):
        dots = from_pyrender(stage(node(given))).objects[0].mesh
    assert isinstance(dots, glshade.Mesh)
    assert len(dots.positions) == 3


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_normals_of_points_do_not_turn_to_the_viewer(offscreen: OffscreenRenderer, mirror: float) -> None:
    """As in pyrender, a light behind the viewer does not reach points whose normals point away from both."""

    def brightest(z: float) -> int:
        dots = square(mode=0, normals=np.tile([0.0, 0.0, z], (len(SQUARE), 1)), material=rough(metallicFactor=0.0))
        sun = Thing(light=Thing(color=np.ones(3), intensity=9.0, name=None), pose=moved(z=5), name=None)
        pose = np.diag([mirror, 1.0, 1.0, 1.0])
        shown = stage(node(dots, pose=pose), directional_light_nodes={sun}, bg_color=np.zeros(4))
        return int(offscreen.render(shown)[0].max())

    assert brightest(1) > 50
    assert brightest(-1) == 0


def test_lines_need_a_camera() -> None:
    blind = stage(node(square(mode=1)), node(square()))
    blind.main_camera_node = None
    with pytest.warns(AssetWarning, match="lines are left out"):
        assert len(from_pyrender(blind).objects) == 1
    with pytest.raises(SceneError, match="nothing to draw"):
        from_pyrender(stage())


def test_a_primitive_is_read_again_when_it_has_new_arrays() -> None:
    given = square()
    first = mesh(given)
    assert mesh(given) is first
    given.positions = SQUARE * 2
    again = mesh(given)
    assert again is not None
    assert again.positions.max() == 2


def test_instances_and_invisible_meshes() -> None:
    poses = np.stack([moved(x=1), moved(y=2), np.zeros((4, 4))])
    scene = from_pyrender(stage(node(square(poses=poses), pose=moved(z=3)), node(square(), visible=False)))
    # The third pose flattens the mesh, which then covers no pixel.
    places = {tuple(item.transform.array()[:3, 3]) for item in scene.objects}
    assert places == {(1, 0, 3), (0, 2, 3)}


def many(count: int = 40) -> Any:
    """Returns poses (N, 4, 4) of small squares that stand beside each other; the last one flattens its square."""
    small = np.diag([0.1, 0.1, 0.1, 1.0])
    places = [moved(x=0.3 * (n % 8) - 1, y=0.3 * (n // 8) - 0.6, z=0.01 * n) @ small for n in range(count)]
    return np.stack([*places, np.zeros((4, 4))])


def test_instances_are_one_object_with_one_draw_call(offscreen: OffscreenRenderer, monkeypatch: pytest.MonkeyPatch) -> None:
    poses = many()
    together = stage(node(square(poses=poses), pose=moved(x=0.1)), camera=perspective(), ambient_light=np.ones(3))
    apart = stage(*(node(square(), pose=moved(x=0.1) @ pose) for pose in poses[:-1]), ambient_light=np.ones(3))
    drawn = offscreen.render(together)
    for found, expected in zip(drawn, offscreen.render(apart), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert drawn[1].std() > 0
    offscreen.render(together)
    # Where the camera moves, nothing is assembled, and where the poses change, nothing is compiled.
    with monkeypatch.context() as patched:
        patched.setattr("glshade.gl.renderer.ready", lambda *arguments: pytest.fail("the scene was assembled again"))
        together.main_camera_node.pose = moved(z=5)
        farther = offscreen.render(together)
    assert not np.array_equal(farther[1], drawn[1])
    with monkeypatch.context() as patched:
        patched.setattr("glshade.gl.resources.Program", lambda *arguments: pytest.fail("a program was compiled"))
        poses[:, 1, 3] += 0.2
        assert not np.array_equal(offscreen.render(together)[1], farther[1])
    apart = stage(*(node(square(), pose=moved(x=0.1) @ pose) for pose in poses[:-1]), ambient_light=np.ones(3), at=moved(z=5))
    np.testing.assert_array_equal(offscreen.render(together)[1], offscreen.render(apart)[1])


def test_names_are_kept_and_numbered() -> None:
    red, blue = np.array([1.0, 0, 0, 1]), np.array([0, 0, 1.0, 1])
    paint = rough(name="paint", baseColorFactor=red)
    scene = from_pyrender(
        stage(
            node(square(paint), square(paint), pose=moved(z=0), name="ball", mesh_name="sphere"),
            node(square(rough(name="paint", baseColorFactor=blue)), pose=moved(z=1), mesh_name="cube"),
            node(square(), pose=moved(z=2)),
            node(square(paint), pose=moved(z=3), name="ball.1"),
        )
    )
    assert [item.name for item in scene.objects] == ["ball", "ball.1", "cube", None, "ball.1.1"]
    assert [item.material for item in scene.objects if isinstance(item.material, str)] == ["paint", "paint", "paint.1", "paint"]
    assert {name: material.kd for name, material in scene.materials.items()} == {"paint": (1, 0, 0), "paint.1": (0, 0, 1)}
    film = scene.film.model_copy(update={"aovs": ("object_id", "material_id")})
    with glshade.Renderer() as renderer:
        attributes = renderer.layers(scene.model_copy(update={"film": film})).attributes
    assert json.loads(attributes["glshade:object_id"]) == ["ball", "ball.1", "cube", "objects[3]", "ball.1.1"]
    assert json.loads(attributes["glshade:material_id"]) == ["paint", "paint.1", "objects[3]"]


def test_a_viewport_without_pixels_is_refused() -> None:
    renderer = OffscreenRenderer(0, 5)
    with pytest.raises(SceneError, match="0 x 5 pixels"):
        renderer.render(stage(node(square())))
    renderer.viewport_width = 8
    assert renderer.render(stage(node(square())))[1].shape == (5, 8)
    renderer.delete()


def test_lights_keep_their_photometric_units() -> None:
    sun = Thing(color=np.array([1, 0.5, 0.25]), intensity=math.pi, name="sun")
    lamp = Thing(color=np.ones(3), intensity=2 * math.pi, name=None)
    spot = Thing(color=np.ones(3), intensity=3 * math.pi, name=None, innerConeAngle=0.25, outerConeAngle=0.5)
    down = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    found = from_pyrender(
        stage(
            node(square()),
            ambient_light=np.array([0.1, 0.2, 0.3]),
            directional_light_nodes={Thing(light=sun, pose=moved(turn=down))},
            point_light_nodes={Thing(light=lamp, pose=moved(1, 2, 3))},
            spot_light_nodes={Thing(light=spot, pose=moved(4, 5, 6))},
        )
    ).lights
    assert found is not None
    ambient, directional, point, cone = (light.model_dump() for light in found)
    assert (ambient["type"], ambient["colour"]) == ("ambient", (0.1, 0.2, 0.3))
    # A white Lambertian surface reflects E / pi, and a light's intensity in glshade is the radiance of such a surface.
    assert (directional["intensity"], directional["direction"]) == (pytest.approx(1), (0, -1, 0))
    assert (point["intensity"], point["position"], point["falloff"]) == (pytest.approx(2), (1, 2, 3), "1/r^2")
    assert (cone["type"], cone["direction"]) == ("gltf_spot", (0, 0, -1))
    assert (cone["inner"], cone["outer"]) == (pytest.approx(math.degrees(0.25)), pytest.approx(math.degrees(0.5)))


@pytest.mark.parametrize(("inner", "outer"), [(0.0, 0.785), (0.2, 0.5), (0.3, 0.3), (0.0, math.pi / 2)])
def test_a_spot_fades_as_in_pyrenders_shader(inner: float, outer: float) -> None:
    light: Any = LIGHTS["gltf_spot"].model_validate(
        {"position": (0, 0, 0), "direction": (0, 0, -1), "inner": math.degrees(inner), "outer": math.degrees(outer)}
    )
    angle = np.linspace(0, 1.6, 99)
    p = 2 * np.stack([np.sin(angle), np.zeros(99), -np.cos(angle)], axis=-1)
    _, e = type(light).illuminate(Thing(**light.uniforms(np.zeros(3))), p)
    # These formulas are those of renderer.py and mesh.frag in pyrender.
    scale = 1.0 / max(0.001, np.cos(inner) - np.cos(outer))
    attenuation = np.clip(np.clip(np.cos(angle), 0, 1) * scale - np.cos(outer) * scale, 0, 1) ** 2
    np.testing.assert_allclose(e, attenuation[:, None] * np.ones(3), atol=1e-9)


def test_a_background_is_shown_as_it_is() -> None:
    colour = np.array([0.2, 0.4, 0.6, 1.0])
    film = from_pyrender(stage(node(square()), bg_color=colour)).film
    assert glshade.image.srgb.linear_to_srgb(np.array(film.background)) == pytest.approx(colour[:3], abs=1e-6)
    assert len(from_pyrender(stage(node(square()), bg_color=np.array([0.2, 0.4, 0.6, 0.5]))).film.background) == 4


def test_a_scaled_camera_is_refused() -> None:
    with pytest.raises(SceneError, match="scaled or sheared"):
        from_pyrender(stage(node(square()), at=np.diag([2.0, 2, 2, 1])))


# --- drawing ---------------------------------------------------------------------------------------------------------

TILTED = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
INTRINSICS = Thing(fx=70.0, fy=55.0, cx=25.0, cy=30.0, znear=0.1, zfar=50.0, name=None)
CAMERAS = {
    "perspective": (perspective(), np.array([HEIGHT / 2 / math.tan(0.5)] * 2), (WIDTH / 2, HEIGHT / 2)),
    "endless": (perspective(far=None), np.array([HEIGHT / 2 / math.tan(0.5)] * 2), (WIDTH / 2, HEIGHT / 2)),
    "wide pixels": (
        perspective(aspect=2.0),
        np.array([WIDTH / 4, HEIGHT / 2]) / math.tan(0.5),
        (WIDTH / 2, HEIGHT / 2),
    ),
    "intrinsics": (INTRINSICS, np.array([70.0, 55.0]), (25.0, 30.0)),
}


def middle_depth(renderer: OffscreenRenderer, scene: Thing) -> Any:
    """Returns the depth (H, W) at the middles of the pixels, which SEG samples."""
    return renderer.render(scene, RenderFlags.SEG, dict.fromkeys(scene.mesh_nodes, 255))[1]


@pytest.mark.parametrize("name", CAMERAS)
def test_depth_is_where_the_ray_of_each_pixel_meets_the_plane(offscreen: OffscreenRenderer, name: str) -> None:
    camera, focal, middle = CAMERAS[name]
    scene = stage(node(square(), pose=moved(turn=TILTED)), camera=camera)
    depth = middle_depth(offscreen, scene)
    assert depth.shape == (HEIGHT, WIDTH)
    assert depth.dtype == np.float32
    x = (np.arange(WIDTH) + 0.5 - middle[0]) / focal[0]
    y = -(np.arange(HEIGHT) + 0.5 - middle[1])[:, None] / focal[1]
    # The ray from (0, 0, 4) along (x, y, -1) t meets the plane through the origin.
    n = TILTED[:, 2]
    t = 4 * n[2] / (n[2] - n[0] * x - n[1] * y)
    p = np.stack(np.broadcast_arrays(t * x, t * y, 4 - t), axis=-1) @ TILTED
    inside = np.abs(p[..., :2]).max(axis=-1) < 1
    assert inside.sum() > 200
    np.testing.assert_array_equal(depth > 0, inside)
    t = np.broadcast_to(t, depth.shape)
    np.testing.assert_allclose(depth[inside], t[inside], rtol=1e-6)
    # Without SEG, depth is that of the first of several samples, which has the same offset in each pixel.
    sampled = offscreen.render(scene, RenderFlags.DEPTH_ONLY)
    both = inside & (sampled > 0)
    assert (inside ^ (sampled > 0)).sum() < 60
    # The plane is tilted about y, so that 1 / depth is linear in x, and its difference shows the offset of the sample in x.
    offsets = (1 / sampled[both] - 1 / t[both]) * -4 * n[2] / n[0] * focal[0]
    assert np.abs(offsets).max() < 0.5
    assert np.ptp(offsets) < 1e-3
    np.testing.assert_array_equal(offscreen.render(scene)[1], sampled)


def test_depth_of_an_orthographic_view(offscreen: OffscreenRenderer) -> None:
    """There pyrender is wrong, because it inverts a perspective projection."""
    camera = Thing(xmag=9.0, ymag=1.5, znear=0.1, zfar=50.0, name=None)
    depth = middle_depth(offscreen, stage(node(square(), pose=moved(turn=TILTED)), camera=camera))
    x = (np.arange(WIDTH) + 0.5 - WIDTH / 2) * 3 / HEIGHT
    expected = np.broadcast_to(4 + x * TILTED[0, 2] / TILTED[2, 2], depth.shape)
    assert (depth > 0).sum() > 500
    # Orthographic depth is linear from 0 to 50, in steps of float32 at 1.
    np.testing.assert_allclose(depth[depth > 0], expected[depth > 0], rtol=0, atol=50 / 2**23)


def test_segments_are_the_nodes_that_are_named(offscreen: OffscreenRenderer) -> None:
    left, right, hidden = node(square(), pose=moved(-1.2)), node(square(), pose=moved(1.2)), node(square(), pose=moved(z=1))
    colour, depth = offscreen.render(stage(left, right, hidden), RenderFlags.SEG, {left: 20, right: (1, 2, 3)})
    assert colour.dtype == np.uint8
    assert {tuple(c) for c in colour.reshape(-1, 3)} == {(0, 0, 0), (20, 20, 20), (1, 2, 3)}
    assert tuple(colour[HEIGHT // 2, 15]) == (20, 20, 20)
    assert tuple(colour[HEIGHT // 2, 50]) == (1, 2, 3)
    np.testing.assert_array_equal(depth > 0, colour.any(axis=2))
    assert depth[depth > 0] == pytest.approx(4, rel=1e-6)


def test_flat_shows_base_colours_as_they_are(offscreen: OffscreenRenderer) -> None:
    codes = np.full((2, 2, 4), 200)
    codes[..., 3] = 255
    primitive = square(
        rough(baseColorFactor=np.array([1, 0.5, 0.25, 1]), baseColorTexture=texture(codes)),
        color_0=np.full((4, 4), 0.8, dtype=np.float32),
    )
    colour, _ = offscreen.render(stage(node(primitive)), RenderFlags.FLAT)
    assert tuple(colour[HEIGHT // 2, WIDTH // 2]) == (160, 80, 40)
    assert tuple(colour[0, 0]) == (255, 255, 255)


def test_light_is_encoded_with_a_power(offscreen: OffscreenRenderer) -> None:
    """As in pyrender, the colour is that of base colour times ambient light, to the power of 1 / 2.2."""
    scene = stage(node(square(rough(baseColorFactor=np.array([0.5, 0.2, 0.8, 1])))), ambient_light=np.full(3, 0.5))
    colour, _ = offscreen.render(scene)
    expected = np.rint(255 * np.array([0.25, 0.1, 0.4]) ** (1 / 2.2))
    assert tuple(colour[HEIGHT // 2, WIDTH // 2]) == tuple(expected)


def test_rgba_and_the_background(offscreen: OffscreenRenderer) -> None:
    scene = stage(node(square()), bg_color=np.array([0.2, 0.3, 0.4, 0.0]))
    colour, depth = offscreen.render(scene, RenderFlags.RGBA)
    assert colour.shape == (HEIGHT, WIDTH, 4)
    assert tuple(colour[0, 0]) == (51, 76, 102, 0)
    assert tuple(colour[HEIGHT // 2, WIDTH // 2]) == (0, 0, 0, 255)
    assert depth[0, 0] == 0


def test_cut_outs_have_no_depth(offscreen: OffscreenRenderer) -> None:
    codes = np.full((1, 2, 4), 255)
    codes[0, 1, 3] = 0
    masked = rough(alphaMode="MASK", baseColorTexture=texture(codes, 33071, 33071))
    colour, depth = offscreen.render(stage(node(square(masked)), bg_color=np.ones(4)))
    assert depth[HEIGHT // 2, 25] > 0
    assert depth[HEIGHT // 2, 39] == 0
    assert colour[HEIGHT // 2, 39].tolist() == [255] * 3


def test_back_faces(offscreen: OffscreenRenderer) -> None:
    away = moved(turn=np.diag([-1, 1, -1]))
    assert not offscreen.render(stage(node(square(), pose=away)), RenderFlags.DEPTH_ONLY).any()
    assert offscreen.render(stage(node(square(rough(doubleSided=True)), pose=away)), RenderFlags.DEPTH_ONLY).any()
    skipped = RenderFlags.DEPTH_ONLY | RenderFlags.SKIP_CULL_FACES
    assert offscreen.render(stage(node(square(), pose=away)), int(skipped)).any()


def test_nothing_to_draw_is_background(offscreen: OffscreenRenderer) -> None:
    colour, depth = offscreen.render(stage(bg_color=np.array([1, 0, 0, 1.0])))
    assert (colour == [255, 0, 0]).all()
    assert not depth.any()


def test_segments_have_the_holes_of_cut_outs(offscreen: OffscreenRenderer) -> None:
    codes = np.full((1, 2, 4), 255)
    codes[0, 1, 3] = 0
    cut = node(square(rough(alphaMode="MASK", baseColorTexture=texture(codes, 33071, 33071))))
    colour, depth = offscreen.render(stage(cut), RenderFlags.SEG, {cut: (9, 99, 199)})
    assert {tuple(c) for c in colour.reshape(-1, 3)} == {(0, 0, 0), (9, 99, 199)}
    assert tuple(colour[HEIGHT // 2, 25]) == (9, 99, 199)
    assert not colour[HEIGHT // 2, 39].any()
    np.testing.assert_array_equal(depth > 0, colour.any(axis=2))


def test_blended_surfaces_mix_encoded_colours_and_have_depth(offscreen: OffscreenRenderer) -> None:
    glass = rough(baseColorFactor=np.array([1.0, 0, 0, 0.25]), alphaMode="BLEND")
    scene = stage(node(square(glass), pose=moved(z=1)), node(square()), ambient_light=np.full(3, 0.5))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ApproximateWarning)
        colour, depth = offscreen.render(scene)
    light = 0.5 ** (1 / 2.2)
    np.testing.assert_allclose(colour[HEIGHT // 2, WIDTH // 2], 255 * light * np.array([1, 0.75, 0.75]), atol=1)
    assert depth[HEIGHT // 2, WIDTH // 2] == pytest.approx(3, rel=1e-6)


def test_a_point_is_a_square_of_pixels(offscreen: OffscreenRenderer) -> None:
    # The point is in the middle of a pixel, half a pixel right of and above the middle of the picture.
    half = math.tan(0.5) * 4 / HEIGHT
    dot = node(
        square(mode=0, positions=np.array([[half, half, 0], [0, 0, 9]], dtype=np.float32), indices=None, texcoord_0=None)
    )
    for size in (1, 3, 5):
        offscreen.point_size = size
        colour, depth = offscreen.render(stage(dot), RenderFlags.SEG, {dot: 7})
        y, x = np.nonzero(depth)
        assert (len(y), set(x), set(y)) == (
            size**2,
            set(range(32 - size // 2, 33 + size // 2)),
            set(range(23 - size // 2, 24 + size // 2)),
        )
        assert set(colour[y, x].ravel()) == {7}
        assert depth[depth > 0] == pytest.approx(4, rel=1e-6)
    offscreen.point_size = 1
    # The point faces the viewer, as the square does, and so reflects the same light from there.
    lamp = Thing(color=np.ones(3), intensity=4.0 * 16, name=None)
    lit = stage(dot, point_light_nodes={Thing(light=lamp, pose=moved(z=4))}, bg_color=np.zeros(4))
    faced = stage(node(square(texcoord_0=None)), point_light_nodes=lit.point_light_nodes, bg_color=np.zeros(4))
    point, surface = (offscreen.render(scene, RenderFlags.RGBA)[0] for scene in (lit, faced))
    covered = point[..., 3] / 255
    assert covered.sum() == pytest.approx(1, abs=0.02)
    assert point[..., 0].sum() == pytest.approx(int(surface[23, 32, 0]), abs=3)


def test_lines_are_clipped_at_the_near_plane(offscreen: OffscreenRenderer) -> None:
    """The line runs from a distance of 4 in front of the viewer to behind it, 0.2 to the left."""
    ends = np.array([[-0.2, 0, 0], [-0.2, 0, 9]], dtype=np.float32)
    line = node(square(mode=1, positions=ends, indices=None, texcoord_0=None))
    depth = middle_depth(offscreen, stage(line))
    y, x = np.nonzero(depth)
    assert set(y) <= {HEIGHT // 2 - 1, HEIGHT // 2}
    assert x.min() == 0
    nearest = depth[y, x].min()
    assert 0.1 < nearest < 0.4
    # At the middle of the pixel next to the far end, the line is at a distance of more than 3.5.
    assert 3.5 < depth.max() < 4


def test_wireframes(offscreen: OffscreenRenderer) -> None:
    solid, wire = stage(node(square())), stage(node(square(rough(wireframe=True))))
    filled, lines = ((offscreen.render(scene, RenderFlags.FLAT)[1] > 0) for scene in (solid, wire))
    assert 0 < lines.sum() < filled.sum() / 3
    for scene, flag, expected in (
        (solid, RenderFlags.ALL_WIREFRAME, lines),
        (wire, RenderFlags.ALL_WIREFRAME, lines),
        (solid, RenderFlags.FLIP_WIREFRAME, lines),
        (wire, RenderFlags.FLIP_WIREFRAME, filled),
        (wire, RenderFlags.DEPTH_ONLY, filled),
    ):
        found = offscreen.render(scene, flag)
        np.testing.assert_array_equal((found if flag == RenderFlags.DEPTH_ONLY else found[1]) > 0, expected)


def test_changes_are_seen(offscreen: OffscreenRenderer) -> None:
    """The caches notice every change of a scene, also in arrays that are changed in place."""
    given = square(rough(baseColorFactor=np.array([0.5, 0.2, 0.8, 1])))
    place = node(given)
    scene = stage(place, ambient_light=np.full(3, 0.5))
    pictures = [offscreen.render(scene)[0]]
    np.testing.assert_array_equal(offscreen.render(scene)[0], pictures[0])

    def changed() -> None:
        pictures.append(offscreen.render(scene)[0])
        assert (pictures[-1] != pictures[-2]).any()

    given.material.baseColorFactor[0] = 0.9
    changed()
    scene.ambient_light[1] = 0.9
    changed()
    place.pose[0, 3] = 0.5
    changed()
    scene.main_camera_node.pose[1, 3] = 0.5
    changed()
    given.positions = SQUARE / 2
    changed()
    given.material.baseColorTexture = texture(np.full((2, 2, 3), 100))
    changed()
    given.material.baseColorTexture.source = np.full((2, 2, 3), 200, dtype=np.uint8)
    changed()
    scene.bg_color[0] = 0.25
    changed()


@pytest.mark.filterwarnings("ignore:pyrender. the scene has more than four lights")
def test_more_lights_than_a_page_are_refused(offscreen: OffscreenRenderer) -> None:
    lamps = {Thing(light=Thing(color=np.ones(3), intensity=1.0, name=None), pose=moved(0.01 * i, z=3)) for i in range(300)}
    with pytest.raises(SceneError, match="more than 256 lights of a kind"):
        offscreen.render(stage(node(square()), point_light_nodes=lamps))


def test_normals_are_left_out_with_one_warning(offscreen: OffscreenRenderer) -> None:
    scene = stage(node(square()))
    with pytest.warns(UserWarning, match="viewer alone"):
        offscreen.render(scene, RenderFlags.FACE_NORMALS)
    np.testing.assert_array_equal(offscreen.render(scene, RenderFlags.VERTEX_NORMALS)[0], offscreen.render(scene)[0])


def test_two_renderers_and_two_scenes_in_turn(offscreen: OffscreenRenderer) -> None:
    scenes = [stage(node(square(rough(baseColorFactor=np.array([c, 0, 0, 1.0]))))) for c in (0.2, 0.8)]
    other = OffscreenRenderer(WIDTH, HEIGHT)
    codes = [[r.render(s, RenderFlags.FLAT)[0][24, 32, 0] for s in scenes] for r in (offscreen, other, offscreen)]
    assert codes == [[51, 204]] * 3
    other.delete()
    assert offscreen.render(scenes[0], RenderFlags.FLAT)[0][24, 32, 0] == 51


def test_shadows_are_left_out_with_one_warning(offscreen: OffscreenRenderer) -> None:
    with pytest.warns(AssetWarning, match="not local shading"):
        offscreen.render(stage(node(square())), RenderFlags.SHADOWS_ALL)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        offscreen.render(stage(node(square())), RenderFlags.SHADOWS_SPOT)


def test_a_scene_without_a_camera() -> None:
    blind = stage(node(square()))
    blind.main_camera_node = None
    assert from_pyrender(blind).camera.framing
    renderer = OffscreenRenderer(8, 8)
    with pytest.raises(SceneError, match="no camera"):
        renderer.render(blind)
    renderer.delete()


def test_the_viewport_can_change_and_a_renderer_can_be_deleted() -> None:
    renderer = OffscreenRenderer(8, 8, point_size=2.0)
    assert renderer.point_size == 2.0
    renderer.viewport_width, renderer.viewport_height = 20, 10
    colour, depth = renderer.render(stage(node(square())))
    assert (colour.shape, depth.shape) == ((10, 20, 3), (10, 20))
    renderer.delete()
    renderer.delete()
    with pytest.raises(GlshadeError, match="deleted"):
        renderer.render(stage(node(square())))


# --- comparison with pyrender -----------------------------------------------------------------------------------------

# Draws a scene with the renderer that `argv[1]` names, and writes the pictures to `argv[2]`.
DRAW = """
import sys
import numpy as np
import pyrender
import trimesh
if sys.argv[1] == "glshade":
    from glshade.pyrender import OffscreenRenderer, RenderFlags
else:
    from pyrender import OffscreenRenderer, RenderFlags

def look(x, y, z):
    back = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    right = np.cross([0, 0, 1], back) / np.linalg.norm(np.cross([0, 0, 1], back))
    return np.vstack([np.column_stack([right, np.cross(back, right), back, [x, y, z]]), [0, 0, 0, 1]])

scene = pyrender.Scene(bg_color=[0.2, 0.3, 0.4], ambient_light=[0.02, 0.02, 0.02])
for roughness, metallic, x in ((0.3, 0.0, -0.6), (0.5, 1.0, 0.6)):
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=[0.8, 0.4, 0.2, 1.0], roughnessFactor=roughness, metallicFactor=metallic)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    scene.add(pyrender.Mesh.from_trimesh(ball, material=material), pose=trimesh.transformations.translation_matrix([x, 0, 0]))
scene.add(pyrender.DirectionalLight(intensity=2.0), pose=look(-1, -2, 2))
scene.add(pyrender.PointLight(color=[1, 0.5, 0.2], intensity=2.0), pose=look(1, -1, 1))
scene.add(pyrender.SpotLight(color=[0.2, 0.5, 1.0], intensity=20.0), pose=look(-1, -2, -1))
scene.add(pyrender.IntrinsicsCamera(fx=300, fy=280, cx=150, cy=130, znear=0.1, zfar=10.0), pose=look(0, -2.5, 0.3))
renderer = OffscreenRenderer(320, 240)
colour, _ = renderer.render(scene)
nodes = sorted(scene.mesh_nodes, key=lambda node: node.matrix[0, 3])
segments, depth = renderer.render(scene, RenderFlags.SEG, {node: 100 * (i + 1) for i, node in enumerate(nodes)})
np.savez(sys.argv[2], colour=colour, segments=segments, depth=depth)
"""


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    """The pictures of one scene by (pyrender, glshade), each drawn in a process of its own."""
    if importlib.util.find_spec("pyrender") is None:
        pytest.skip("pyrender is not installed: pip install 'glshade[pyrender]'")
    folder: Path = tmp_path_factory.mktemp("pictures")
    pictures = []
    for renderer in ("pyrender", "glshade"):
        path = folder / f"{renderer}.npz"
        run = subprocess.run(
            [sys.executable, "-c", DRAW, renderer, str(path)],
            capture_output=True,
            text=True,
            env={**os.environ, "PYOPENGL_PLATFORM": "egl"},
            timeout=120,
            check=False,
        )
        if renderer == "pyrender" and run.returncode:
            pytest.skip(f"pyrender cannot draw on this machine: {(run.stderr.strip().splitlines() or ['no message'])[-1]}")
        assert run.returncode == 0, run.stderr
        pictures.append(np.load(path))
    return pictures[0], pictures[1]


def test_depth_and_segments_are_pyrenders(both: tuple[Any, Any]) -> None:
    """With SEG pyrender, too, draws one sample in the middle of each pixel."""
    theirs, ours = both
    np.testing.assert_array_equal(ours["segments"], theirs["segments"])
    np.testing.assert_array_equal(ours["depth"] > 0, theirs["depth"] > 0)
    seen = ours["depth"] > 0
    assert seen.sum() > 10000
    z = ours["depth"][seen].astype(np.float64)
    # A step of pyrender's 24-bit depth from 0.1 to 10 is z^2 (far - near) / (far near) / 2^24.
    step = z**2 * (10 - 0.1) / (10 * 0.1) / 2**24
    steps = np.abs(theirs["depth"][seen] - z) / step
    assert np.percentile(steps, 99) < 4


def test_colours_are_nearly_pyrenders(both: tuple[Any, Any]) -> None:
    theirs, ours = both
    difference = np.abs(ours["colour"].astype(int) - theirs["colour"]).max(axis=2)
    background = ours["colour"] == ours["colour"][0, 0]
    np.testing.assert_array_equal(ours["colour"][0, 0], theirs["colour"][0, 0])
    lit = difference[~background.all(axis=2)]
    # docs/pyrender.md explains the differences between the two reflection models.
    assert np.median(lit) <= 6
    assert np.percentile(lit, 95) <= 16
