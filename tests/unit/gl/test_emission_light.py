"""What emission, occlusion and unlit show: exact values on a plane that faces the viewer, by the GPU and by the reference."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import glshade
from glshade import Image, Renderer, reference
from glshade.errors import SceneError
from glshade.image.srgb import linear_to_srgb
from glshade.mesh.mesh import Mesh
from glshade.scene.object import Rate
from glshade.scene.scene import Scene
from glshade.verification.laws import check_laws
from glshade.verification.mutations import MUTATIONS
from glshade.verification.trials import try_mutations

RATES: tuple[Rate, ...] = get_args(Rate)
each_rate = pytest.mark.parametrize("rate", RATES)
SUN = {"type": "directional", "name": "sun", "direction": [0, 0, -1], "intensity": 0.25}
SKY = {"type": "ambient", "name": "sky", "intensity": 0.5}
SIZE = (12, 8)


def square(colour: Any = None) -> Mesh:
    """Returns a square that faces the viewer and fills the picture. colour: the vertices' common colour (3,)."""
    positions = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=float)
    colours = None if colour is None else np.broadcast_to([*colour, 1.0], (4, 4))
    normals = np.broadcast_to([0.0, 0.0, 1.0], (4, 3))
    return Mesh.build(positions, [[0, 1, 2], [0, 2, 3]], normals, positions[:, :2] / 2 + 0.5, colours)


def scene(material: Any, *lights: Any, colour: Any = None, **film: Any) -> Scene:
    return Scene.model_validate(
        {
            "film": {"size": SIZE, **film},
            "camera": {"type": "orthographic", "height": 1.0, "eye": (0, 0, 3), "target": (0, 0, 0)},
            "objects": [{"name": "square", "mesh": square(colour), "material": {"brdf": "lambert", **material}}],
            "lights": list(lights),
        }
    )


def value(renderer: Renderer, made: Scene, rate: Rate | None = None) -> Any:
    """Returns the one colour (3 or 4,) of the picture, which the reference must show too."""
    drawn = renderer.render(made, dtype="float32", shading=rate).pixels
    expected = reference.render(made, shading=rate).pixels
    assert np.ptp(drawn, axis=(0, 1)).max() <= 1e-6
    np.testing.assert_allclose(drawn, expected, rtol=2e-6, atol=1e-7)
    return drawn[0, 0].astype(np.float64)


@pytest.fixture
def grey(tmp_path: Path) -> Path:
    """A picture whose channels are all different, sRGB-encoded."""
    Image(np.full((2, 2, 4), (188, 128, 64, 128), np.uint8), "srgb").save(tmp_path / "grey.png")
    return tmp_path / "grey.png"


def decoded(code: int) -> float:
    return float(((code / 255 + 0.055) / 1.055) ** 2.4)


@each_rate
def test_emission_is_added_to_all_other_light(rate: Rate, renderer: Renderer) -> None:
    material = {"kd": (0.8, 0.4, 0.2), "emission": (0.25, 0.5, 3)}
    for lights, reflected in (((), 0.0), ((SKY,), 0.5), ((SUN, SKY), 0.75)):
        expected = reflected * np.array([0.8, 0.4, 0.2]) + (0.25, 0.5, 3)
        np.testing.assert_allclose(value(renderer, scene(material, *lights), rate), expected, rtol=1e-6)


@each_rate
def test_a_texture_of_emission_is_decoded_like_any_colour(rate: Rate, renderer: Renderer, grey: Path) -> None:
    made = scene({"emission": {"texture": grey, "factor": (1, 2, 3)}})
    shown = reference.render(made, shading=rate).pixels[0, 0] / (1, 2, 3)
    np.testing.assert_allclose(shown, [decoded(code) for code in (188, 128, 64)], rtol=1e-5)
    # A driver decodes codes with an error of its own.
    drawn = renderer.render(made, dtype="float32", shading=rate).pixels[0, 0] / (1, 2, 3)
    np.testing.assert_allclose(255 * linear_to_srgb(drawn), (188, 128, 64), atol=0.5)


def test_a_number_can_be_added_to_a_texture_of_emission(renderer: Renderer, grey: Path) -> None:
    table = {"texture": grey, "encoding": "linear", "factor": -1, "add": (1, 0, 0.5)}
    found = value(renderer, scene({"emission": table}, exposure=1.0))
    np.testing.assert_allclose(found, 2 * np.array([1 - 188 / 255, 0, 0.5 - 64 / 255]), rtol=1e-5)
    assert value(renderer, scene({"emission": {**table, "factor": 0}})).tolist() == [1, 0, 0.5]


def test_a_texel_below_zero_counts_as_zero(renderer: Renderer, tmp_path: Path) -> None:
    Image(np.full((2, 2, 3), (-1, 0.5, 2), np.float32)).save(tmp_path / "t.exr")
    assert value(renderer, scene({"emission": {"texture": tmp_path / "t.exr"}})).tolist() == [0, 0.5, 2]


@settings(max_examples=15)
@given(
    emission=st.tuples(*[st.floats(0, 8, width=32)] * 3),
    alpha=st.floats(0, 1, width=32),
    exposure=st.floats(-4, 4, width=32),
    rate=st.sampled_from(RATES),
)
def test_exposure_and_alpha_multiply_emission(
    renderer: Renderer, emission: Any, alpha: float, exposure: float, rate: Rate
) -> None:
    """A blended surface covers its share of the pixel, and the background shows through the rest."""
    made = scene(
        {"kd": 0, "emission": emission, "alpha": alpha, "alpha_mode": "blend"}, exposure=exposure, background=(0.5, 0.25, 0.125)
    )
    with pytest.warns(UserWarning, match="blended surfaces"):
        found = value(renderer, made, rate)
    expected = alpha * np.array(emission) * 2**exposure + (1 - alpha) * np.array([0.5, 0.25, 0.125])
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


@each_rate
def test_vertex_colours_do_not_change_emission(rate: Rate, renderer: Renderer) -> None:
    found = value(renderer, scene({"kd": 0.8, "emission": 0.25}, SKY, colour=(0.5, 1, 0)), rate)
    np.testing.assert_allclose(found, np.array([0.2, 0.4, 0]) + 0.25, rtol=1e-6)


@pytest.mark.parametrize(
    ("rate", "channel", "stored"), [("flat", "r", 188), ("gouraud", "g", 128), ("phong", "b", 64), ("phong", "a", 128)]
)
def test_occlusion_multiplies_ambient_light_alone(
    rate: Rate, channel: str, stored: int, renderer: Renderer, grey: Path
) -> None:
    """The factor is 1 + strength (x - 1), where x is the stored number, which is not decoded."""
    for strength, kd, reflectance in (
        (0.25, 0.8, 0.8),
        (1.0, {"texture": grey, "encoding": "linear"}, np.array([188, 128, 64]) / 255),
    ):
        occlusion = {"texture": grey, "channel": channel, "strength": strength}
        openness = 1 + strength * (stored / 255 - 1)
        found = value(renderer, scene({"kd": kd, "emission": 0.125, "occlusion": occlusion}, SUN, SKY), rate)
        np.testing.assert_allclose(found, reflectance * (0.25 + 0.5 * openness) + 0.125, rtol=1e-5)


def test_occlusion_outside_of_0_to_1_is_clamped(renderer: Renderer, tmp_path: Path) -> None:
    for texel, openness in ((3.0, 1.0), (-2.0, 0.0)):
        path = tmp_path / f"{texel}.exr"
        Image(np.full((2, 2, 3), texel, np.float32)).save(path)
        found = value(renderer, scene({"kd": 0.5, "occlusion": {"texture": path}}, SKY))
        np.testing.assert_allclose(found, 0.25 * openness, rtol=1e-6)


@each_rate
@pytest.mark.parametrize("lights", [(), (SUN,), (SUN, SKY), None])
def test_an_unlit_surface_shows_its_base_colour(rate: Rate, lights: Any, renderer: Renderer, grey: Path) -> None:
    """With texture, vertex colours, alpha, emission and exposure, and whatever the lights, even the default ones."""
    kd = {"texture": grey, "encoding": "linear", "factor": (1, 0.5, 1)}
    material = {"brdf": "ggx", "kd": kd, "unlit": True, "emission": 0.125, "occlusion": {"texture": grey}}
    made = scene(material, *(lights or ()), colour=(0.5, 1, 0.25), exposure=1.0)
    made = made.model_copy(update={"lights": None}) if lights is None else made
    expected = 2 * (np.array([188, 64, 64]) / 255 * (0.5, 1, 0.25) + 0.125)
    np.testing.assert_allclose(value(renderer, made, rate), expected, rtol=1e-5)


def test_an_unlit_cut_out_has_its_holes(renderer: Renderer, grey: Path) -> None:
    for cutoff, shown in ((0.4, 188 / 255), (0.6, 0.0)):
        kd = {"texture": grey, "encoding": "linear"}
        made = scene({"kd": kd, "unlit": True, "alpha_mode": "mask", "alpha_cutoff": cutoff})
        assert value(renderer, made)[0] == pytest.approx(shown, rel=1e-5)


def test_an_unlit_object_leaves_the_others_as_they_are(renderer: Renderer) -> None:
    made = scene({"kd": 0.5}, SUN, SKY)
    (item,) = made.objects
    far = item.model_copy(update={"name": "far", "material": item.material.model_copy(update={"unlit": True})})  # type: ignore
    far = far.model_copy(update={"transform": far.transform.model_copy(update={"translate": (100, 0, 0)})})
    both = made.model_copy(update={"objects": (item, far)})
    assert value(renderer, both).tolist() == value(renderer, made).tolist()
    assert list(renderer.layers(aov(both, "lights")).arrays) == ["light_sun", "light_sky"]


def aov(made: Scene, *names: str) -> Scene:
    return made.model_copy(update={"film": made.film.model_copy(update={"aovs": names})})


def test_the_layers_are_sums(renderer: Renderer, grey: Path) -> None:
    materials: dict[str, Any] = {
        "glowing": {"brdf": "phong", "emission": {"texture": grey}, "occlusion": {"texture": grey}},
        "lamp": {"brdf": "lambert", "kd": 0.25, "emission": (2, 1, 0.5), "alpha": 0.5, "alpha_mode": "blend"},
        "sign": {"brdf": "ggx", "kd": {"texture": grey}, "unlit": True},
    }
    objects = [
        {"shape": "sphere", "material": name, "transform": {"translate": (2 * i - 2, 0.3 * i, 0.5 * i)}}
        for i, name in enumerate(materials)
    ]
    aovs = ("diffuse", "specular", "emission", "lights", "background", "albedo")
    film = {"size": (60, 40), "background": (0.1, 0.2, 0.3), "aovs": aovs, "exposure": 0.5}
    camera = {"type": "orthographic", "eye": (0, 0, 9), "fit": True}
    table = {"film": film, "materials": materials, "objects": objects, "lights": [SUN, SKY], "camera": camera}
    with pytest.warns(UserWarning, match="blended surfaces"):
        made = renderer.layers(Scene.model_validate(table))
    layer, picture = made.arrays, made.image.pixels
    assert layer["emission"].max() > 1
    for parts in (("diffuse", "specular"), ("light_sun", "light_sky")):
        total = sum(layer[name] for name in (*parts, "emission", "background"))
        np.testing.assert_allclose(total, picture, atol=1e-5 * picture.max())
    # The albedo is that of the surfaces without their emission.
    assert layer["albedo"].max() <= 1


def test_without_emission_its_layer_is_black(renderer: Renderer) -> None:
    layers = renderer.layers(aov(scene({"kd": 0.5}, SUN), "emission", "diffuse")).arrays
    assert layers["emission"].shape == (SIZE[1], SIZE[0], 3)
    assert not layers["emission"].any()


def test_a_value_beyond_float32_is_refused(renderer: Renderer) -> None:
    made = scene({"emission": 1e30}, exposure=60.0)
    for draw in (renderer.render, reference.render):
        with pytest.raises(SceneError, match="square: emission is too large for float32"):
            draw(made)


@pytest.mark.parametrize("rate", ["gouraud", "phong"])
def test_pictures_are_verified_and_a_wrong_emission_is_found(rate: Rate, renderer: Renderer, grey: Path) -> None:
    noise = grey.with_name("noise.png")
    Image(np.random.default_rng(1).integers(0, 256, (8, 8, 3), dtype=np.uint8), "srgb").save(noise)
    ball = {"shape": {"type": "sphere", "segments": 24, "rings": 12}}
    texture = {"texture": noise}
    material = {"brdf": "phong", "kd": texture, "emission": texture, "occlusion": texture}
    made = Scene.model_validate(
        {"film": {"size": (48, 48)}, "objects": [{**ball, "material": material, "shading": rate}], "lights": [SUN, SKY]}
    )
    verdict = glshade.verify(made, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)
    (trial,) = try_mutations(made, ["emission-doubled"], renderer=renderer)
    assert trial.shows
    assert trial.caught
    assert MUTATIONS["emission-doubled"].causes == ("emission",)


@pytest.mark.parametrize("kind", ["emission", "unlit"])
def test_the_laws_hold(kind: str, grey: Path) -> None:
    glowing = {"emission": {"texture": grey}, "occlusion": {"texture": grey}}
    material = {"brdf": "phong", **(glowing if kind == "emission" else {"unlit": True})}
    ball = {"type": "sphere", "segments": 12, "rings": 6}
    objects = [{"name": "ball", "shape": ball, "material": material}]
    made = Scene.model_validate({"film": {"size": (32, 32)}, "objects": objects, "lights": [SUN, SKY]})
    outcomes = {finding.law: finding.outcome for finding in check_laws(made)}
    assert "broken" not in outcomes.values(), outcomes
    assert outcomes["exposed"] == ("holds" if kind == "emission" else "does not apply")
    assert outcomes["textured"] == "holds"
