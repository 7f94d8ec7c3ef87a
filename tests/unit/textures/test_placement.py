"""Placement: textures that are scaled, turned and moved, texels without smoothing, and numbers added to texels."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from glshade import Image, Mesh, Renderer, Scene, Texture, explain, verify
from glshade.glsl.generator import generate
from glshade.radiance.sampler import Sampler
from glshade.scene.object import Rate
from glshade.textures.texture import UNPLACED
from glshade.verification.mutations import Mutation

RATES: tuple[Rate, ...] = ("flat", "gouraud", "phong")
FRONT: dict[str, Any] = {"type": "orthographic", "eye": [0, 0, 5], "target": [0, 0, 0], "height": 2}
SKY = [{"type": "ambient"}]
LIGHTS: list[dict[str, Any]] = [{"type": "directional", "direction": [-0.3, -0.5, -1]}, {"type": "ambient", "intensity": 0.3}]
# A low view over a floor to the horizon, so that textures are magnified in front and minified behind.
FLOOR = {"type": "perspective", "eye": [0.4, 0.6, 2.2], "target": [0, 0, 0], "fov": 50}
ROUNDING = 2e-6
TURNED: dict[str, Any] = {"uv_scale": [3, -2], "uv_rotate": 30, "uv_offset": [0.1, 7]}
# Seven texels, so that no vertex but those of the whole lies on a border of two.
TEXELS = np.random.default_rng(5).uniform(0.1, 1, (7, 7, 3))


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Any], str]:
    """A function that saves linear values without loss, with row 0 at the top, and returns the path of the file."""
    folder = tmp_path_factory.mktemp("pictures")

    def save(name: str, pixels: Any) -> str:
        pixels = np.asarray(pixels, dtype=np.float32)
        Image(np.repeat(pixels[..., None], 3, axis=2) if pixels.ndim == 2 else pixels).save(folder / f"{name}.exr")
        return str(folder / f"{name}.exr")

    return save


def square(material: dict[str, Any], uvs: Any = ((0, 0), (1, 0), (1, 1), (0, 1))) -> dict[str, Any]:
    """Returns a square that fills the picture of a camera in front of it."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    mesh = Mesh.build(corners, np.array([[0, 1, 2], [0, 2, 3]]), uvs=np.array(uvs, dtype=float))
    return {"mesh": mesh, "material": {"brdf": "lambert", **material}}


def floor(material: dict[str, Any], rate: Rate, size: int = 48, **film: Any) -> Scene:
    """Returns a scene with a floor whose edges lie outside the picture."""
    shape = {"type": "plane", "segments": 12}
    item = {"shape": shape, "sides": "both", "transform": {"scale": 8}, "shading": rate, "material": material}
    film = {"size": (size, size), **film}
    return Scene.model_validate({"film": film, "camera": FLOOR, "objects": [item], "lights": LIGHTS})


class TestPlacement:
    """uv_scale, uv_rotate and uv_offset."""

    @given(
        scale=st.tuples(*[st.floats(0.1, 5) | st.floats(-5, -0.1)] * 2),
        rotate=st.floats(-720, 720),
        offset=st.tuples(*[st.floats(-9, 9)] * 2),
    )
    def test_the_matrix(self, scale: tuple[float, float], rotate: float, offset: tuple[float, float]) -> None:
        """The coordinates are scaled, then turned from u toward v, then moved."""
        placed = Texture.model_construct(uv_scale=scale, uv_rotate=rotate, uv_offset=offset).placement
        a = math.radians(rotate)
        for uv in ((0.0, 0.0), (1.0, 0.0), (0.3, -2.0)):
            x, y = scale[0] * uv[0], scale[1] * uv[1]
            expected = (math.cos(a) * x - math.sin(a) * y + offset[0], math.sin(a) * x + math.cos(a) * y + offset[1])
            assert np.array(placed) @ [*uv, 1.0] == pytest.approx(expected, abs=1e-9)

    def test_quarter_turns_are_exact(self) -> None:
        rows = [Texture(texture=Path(__file__), uv_rotate=angle).placement for angle in (90, 180, -90, 360)]
        assert rows[0] == ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
        assert rows[1] == ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
        assert rows[2] == ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))
        assert rows[3] == UNPLACED

    @pytest.mark.parametrize("rate", RATES)
    def test_it_equals_coordinates_that_are_placed_by_hand(self, rate: Rate, draw: Any, picture: Any) -> None:
        corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
        texture = {"texture": picture("t", TEXELS)}
        rows = np.array(Texture.model_validate({**texture, **TURNED}).placement)
        by_hand = corners @ rows[:, :2].T + rows[:, 2]
        options = {"size": (64, 64), "camera": FRONT, "shading": rate}
        placed = draw(square({"kd": {**texture, **TURNED}}, corners), SKY, **options)
        assert placed == pytest.approx(draw(square({"kd": texture}, by_hand), SKY, **options), abs=2e-5)
        assert np.abs(placed - draw(square({"kd": texture}, corners), SKY, **options)).max() > 0.05

    def test_a_repeat_is_seen_as_often(self, draw: Any, picture: Any) -> None:
        """A scale of 2 shows the picture twice, and one number stands for two."""
        texture = {"texture": picture("t", TEXELS), "filter": "nearest"}
        pixels = draw(square({"kd": {**texture, "uv_scale": 2}}), SKY, (14, 14), camera=FRONT)
        assert pixels == pytest.approx(np.tile(TEXELS, (2, 2, 1)), abs=ROUNDING)

    def test_minified_pictures_are_filtered_where_they_are_drawn(self, draw: Any, picture: Any) -> None:
        """The level of detail follows the placed coordinates: a fine checker is grey from afar."""
        checker = picture("checker", np.indices((64, 64)).sum(axis=0) % 2)
        kd = {"texture": checker, "uv_scale": 4, "uv_rotate": 20}
        assert draw(square({"kd": kd}), SKY, (16, 16), camera=FRONT) == pytest.approx(0.5, abs=0.02)

    @pytest.mark.parametrize("angle", [0, 35, 180])
    def test_bumps_turn_with_their_picture(self, angle: float, draw: Any, picture: Any) -> None:
        """A normal map on turned coordinates bends the normals as the same map on a mesh whose uvs are turned."""
        n = np.random.default_rng(2).uniform(0.2, 0.8, (5, 5, 3))
        n[..., 2] = 1.0
        bumps = {"texture": picture("normals", n)}
        corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
        keys = {"uv_scale": [-2, 1.5], "uv_rotate": angle, "uv_offset": [0.2, 0.1]}
        rows = np.array(Texture.model_validate({**bumps, **keys}).placement)
        by_hand = corners @ rows[:, :2].T + rows[:, 2]
        light = [{"type": "directional", "direction": [-0.6, -0.2, -0.8]}]
        options = {"size": (32, 32), "camera": FRONT}
        placed = draw(square({"normal_map": {**bumps, **keys}}, corners), light, **options)
        assert placed == pytest.approx(draw(square({"normal_map": bumps}, by_hand), light, **options), abs=2e-5)

    def test_one_picture_in_two_places_is_two_textures(self, picture: Any) -> None:
        path = picture("t", TEXELS)
        material = {
            "brdf": "ggx",
            "roughness": {"texture": path, "channel": "g", "uv_scale": 2},
            "metallic": {"texture": path, "channel": "b", "uv_scale": 2},
            "kd": {"texture": path, "encoding": "linear"},
        }
        (plan,) = explain(floor(material, "phong")).programs
        source = generate(plan)
        assert source.fragment is not None
        assert source.fragment.text.count("uniform sampler2D") == 2
        assert len(plan.placed) == 1
        assert "textures placed by a matrix" in str(plan)

    def test_the_numbers_do_not_change_the_program(self, picture: Any) -> None:
        path = picture("t", TEXELS)

        def program(**keys: Any) -> Any:
            return explain(floor({"brdf": "lambert", "kd": {"texture": path, **keys}}, "phong")).programs

        assert program(uv_scale=2) == program(uv_offset=[0.1, 0]) != program()
        assert program(uv_rotate=360) == program(uv_scale=1) == program(filter="nearest") == program()

    @pytest.mark.parametrize("scale", [0, [1, 0], [1, -1e-7], 1e7])
    def test_no_scale_of_0(self, scale: Any) -> None:
        with pytest.raises(ValidationError, match="must be from 1e-06 to 1e\\+06, or the negative of that"):
            Texture(texture=Path(__file__), uv_scale=scale)


class TestNearest:
    """Pictures whose texels are squares of one colour."""

    @pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
    def test_each_texel_is_a_square(self, wrap: str, draw: Any, picture: Any) -> None:
        kd = {"texture": picture("t", TEXELS), "filter": "nearest", "wrap": wrap}
        pixels = draw(square({"kd": kd}), SKY, (35, 35), camera=FRONT)
        assert pixels == pytest.approx(TEXELS.repeat(5, axis=0).repeat(5, axis=1), abs=ROUNDING)

    def test_a_minified_picture_is_smooth(self, draw: Any, picture: Any) -> None:
        checker = np.indices((64, 64)).sum(axis=0) % 2
        near, smooth = (
            draw(square({"kd": {"texture": picture("checker", checker), "filter": which}}), SKY, (16, 16), camera=FRONT)
            for which in ("nearest", "smooth")
        )
        assert (near == smooth).all()

    def test_one_picture_may_be_read_in_both_ways(self, draw: Any, picture: Any) -> None:
        """The two ways are two textures, whatever is drawn first."""
        path = picture("t", TEXELS)
        for which in ("smooth", "nearest", "smooth"):
            pixels = draw(square({"kd": {"texture": path, "filter": which}}), SKY, (35, 35), camera=FRONT)
            assert (np.unique(pixels[..., 0].round(5)).size == 49) == (which == "nearest")

    @given(
        texels=st.integers(1, 9),
        u=st.floats(-3, 3),
        wrap=st.sampled_from(["repeat", "clamp", "mirror"]),
    )
    def test_the_reference_takes_the_texel_that_holds_the_place(self, texels: int, u: float, wrap: Any) -> None:
        row = np.arange(texels * 4, dtype=np.float32).reshape(1, texels, 4)
        sampler = replace(Sampler.of(row, (wrap, wrap)), filter="nearest")
        place = {"repeat": u % 1.0, "clamp": min(max(u, 0.0), 1.0), "mirror": abs((u + 1) % 2 - 1)}[wrap]
        found = sampler.sample(np.array([[u, 0.5]]))[0, 0] / 4
        # A place on a border may count to the texels on both sides.
        assert found - 1e-9 <= place * texels <= found + 1 + 1e-9


class TestAdded:
    """`add`, which a texture's values get after the factor."""

    @pytest.mark.parametrize("rate", RATES)
    def test_gloss_becomes_roughness(self, rate: Rate, draw: Any, picture: Any) -> None:
        gloss = np.random.default_rng(3).uniform(0.2, 0.9, (4, 4))
        keys = {"brdf": "ggx", "kd": 0.3}
        inverted = {"texture": picture("gloss", gloss), "factor": -1, "add": 1}
        options = {"size": (32, 32), "camera": FRONT, "shading": rate}
        pixels = draw(square({**keys, "roughness": inverted}), LIGHTS, **options)
        rough = draw(square({**keys, "roughness": {"texture": picture("rough", 1 - gloss)}}), LIGHTS, **options)
        assert pixels == pytest.approx(rough, abs=1e-5)
        assert (
            np.abs(pixels - draw(square({**keys, "roughness": {"texture": picture("gloss", gloss)}}), LIGHTS, **options)).max()
            > 1e-3
        )

    def test_colours_and_emission(self, draw: Any, picture: Any) -> None:
        texture = {"texture": picture("half", np.full((2, 2), 0.5)), "factor": 0.5, "add": [0.1, 0.2, 0.3]}
        for key, lights, film in (("kd", SKY, {}), ("emission", [], {"exposure": 1})):
            material = {"kd": 0, key: texture}
            expected = np.array([0.35, 0.45, 0.55]) * (2 if film else 1)
            pixels = draw(square(material), lights, (4, 4), camera=FRONT, film=film)
            assert pixels == pytest.approx(np.broadcast_to(expected, (4, 4, 3)), abs=ROUNDING)

    def test_the_sum_is_not_negative(self, draw: Any, picture: Any) -> None:
        texture = {"texture": picture("half", np.full((2, 2), 0.5)), "add": [0.9, -0.9, 0]}
        pixels = draw(square({"kd": texture}), SKY, (4, 4), camera=FRONT)
        assert pixels == pytest.approx(np.broadcast_to([1.4, 0, 0.5], (4, 4, 3)), abs=ROUNDING)


# name -> the material whose pictures are compared with the float64 reference.
FEATURES: dict[str, dict[str, Any]] = {
    "nearest": {"kd": {"filter": "nearest"}},
    "nearest cut-out": {"kd": {"filter": "nearest"}, "alpha_mode": "mask", "alpha_cutoff": 0.6},
    "turned": {"kd": {**TURNED}},
    "turned nearest and bumps": {"kd": {"filter": "nearest", **TURNED}, "normal_map": {"uv_rotate": 20, "filter": "nearest"}},
    "far away": {"kd": {"uv_scale": 0.3, "uv_offset": [1000, -3000]}},
    "added": {"kd": {"factor": -0.7, "add": 0.9}, "emission": {"factor": 0.2, "add": 0.1, "uv_scale": 2}},
}


def feature(name: str, picture: Any) -> dict[str, Any]:
    """Returns the material of a feature, with a picture in each table."""
    alpha = np.random.default_rng(8).uniform(0.2, 1, (7, 7, 1))
    path = picture("rgba", np.concatenate([TEXELS * alpha, alpha], axis=2))
    placed = {key: {"texture": path, **value} if isinstance(value, dict) else value for key, value in FEATURES[name].items()}
    return {"brdf": "phong", **placed}


@pytest.mark.parametrize(
    ("name", "rate"),
    [*((name, "phong") for name in FEATURES), *product(("nearest", "turned nearest and bumps", "added"), ("flat", "gouraud"))],
)
def test_every_feature_is_verified(name: str, rate: Rate, picture: Any, renderer: Renderer) -> None:
    verdict = verify(floor(feature(name, picture), rate), renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    assert np.ptp(verdict.picture) > 0.05


def test_with_several_samples(picture: Any, renderer: Renderer) -> None:
    scene = floor(feature("turned nearest and bumps", picture), "phong", samples=4)
    verdict = verify(scene, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)


@pytest.fixture(scope="module")
def faulty() -> Iterator[Renderer]:
    with Renderer() as renderer:
        yield renderer


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("turned", r"placed_uv\((\w+), \w+, \w+\)", r"\1"),
        ("turned", r"(\w+_across), (\w+_up)\)", r"\2, \1)"),
        ("nearest", r"texture\((u_\w+), (\w+)\)", r"texture(\1, \2 + 0.5 / vec2(textureSize(\1, 0)))"),
        ("nearest", r"texture\((u_\w+), (\w+)\)", r"texture(\1, \2 + 0.05 / vec2(textureSize(\1, 0)))"),
        ("added", r"\+ u_kd_add", "+ 0.99 * u_kd_add"),
    ],
)
def test_a_fault_is_found(name: str, old: str, new: str, picture: Any, faulty: Renderer) -> None:
    faulty.rewrite = Mutation("fault", "made by this test", ((old, new),)).rewrite
    assert verify(floor(feature(name, picture), "phong"), renderer=faulty).verdict == "failed"


def test_smoothing_in_place_of_squares_is_found(picture: Any, faulty: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(moderngl, "NEAREST", moderngl.LINEAR)
    faulty.rewrite = None
    name = f"smoothed {os.getpid()}"
    scene = floor({"brdf": "phong", "kd": {"texture": picture(name, TEXELS), "filter": "nearest"}}, "phong")
    assert verify(scene, renderer=faulty).verdict == "failed"
