"""Quality: each choice changes the picture as described, for the whole scene or for one object, and changes nothing else."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade.brdfs import BRDFS
from glshade.errors import SceneError
from glshade.glsl.planner import explain
from glshade.image.image import Image
from glshade.radiance.readying import ready
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene

Array = np.ndarray[Any, Any]
BALL = {"type": "icosphere", "subdivisions": 2}
KEY = {"type": "directional", "direction": [0.4, -0.5, -0.8], "intensity": 0.8}
LIGHTS = [KEY, {"type": "ambient", "intensity": 0.1}]
GLOSSY = {"brdf": "phong", "kd": [0.4, 0.2, 0.1], "ks": 0.6, "exponent": 60}
# A change that is too large for rounding alone.
SHOWS = 1e-5
# key -> (quality, material, shading) such that the quality changes the picture; for every key except storage.
SHOWING = {
    "fresnel": ({"fresnel": "schlick"}, {"brdf": "metal"}, "phong"),
    "specular": ({"specular": "half_angle"}, GLOSSY, "phong"),
    "shading": ({"shading": "flat"}, GLOSSY, "phong"),
    "subdivide": ({"subdivide": 1}, GLOSSY, "gouraud"),
    "refine": ({"refine": 0.02}, GLOSSY, "gouraud"),
    "normalise": ({"normalise": False}, GLOSSY, "phong"),
    "arithmetic": ({"arithmetic": "fast"}, {**GLOSSY, "exponent": 2e3}, "phong"),
}


def ball(material: Any = GLOSSY, shading: str = "phong", x: float = 0.0, **more: Any) -> dict[str, Any]:
    return {"shape": BALL, "material": material, "shading": shading, "transform": {"translate": [x, 0, 0]}, **more}


def pair(first: dict[str, Any] | None, material: Any, shading: str) -> list[dict[str, Any]]:
    """Returns two balls. first: the quality of the first ball; None: it has none of its own."""
    return [ball(material, shading, -1.2, quality=first), ball(material, shading, 1.2)]


def test_every_key_is_tested() -> None:
    assert set(SHOWING) | {"storage"} == set(Quality.model_fields)


class TestReach:
    """The objects that a choice affects."""

    @pytest.mark.parametrize("knob", SHOWING)
    def test_the_whole_picture(self, knob: str, draw: Any) -> None:
        quality, material, shading = SHOWING[knob]
        objects = [ball(material, shading)]
        change = np.abs(draw(objects, [KEY], quality=quality, size=(96, 96)) - draw(objects, [KEY], size=(96, 96)))
        assert change.max() > SHOWS

    @pytest.mark.parametrize("knob", SHOWING)
    def test_one_object_alone(self, knob: str, draw: Any) -> None:
        quality, material, shading = SHOWING[knob]
        camera = {"type": "orthographic", "eye": [0, 0, 5], "height": 2.4}
        plain, chosen = (draw(pair(own, material, shading), [KEY], (192, 96), camera=camera) for own in (None, quality))
        change = np.abs(chosen - plain).max(axis=2)
        assert change[:, :96].max() > SHOWS
        assert change[:, 96:].max() == 0

    def test_an_objects_own_comes_before_the_scenes_and_that_before_the_objects_shading(self) -> None:
        objects = [ball(shading="flat", quality={"shading": "phong"}), ball(shading="flat", quality={"subdivide": 2}), ball()]
        scene = Scene.model_validate({"objects": objects, "quality": {"shading": "gouraud", "subdivide": 1}})
        instances = ready(scene).instances
        assert [i.rate for i in instances] == ["phong", "gouraud", "gouraud"]
        # Meshes that are shaded per pixel are not subdivided.
        assert [len(i.mesh.triangles) for i in instances] == [320, 320 * 16, 320 * 4]
        assert instances[1].quality == Quality(shading="gouraud", subdivide=2)

    def test_false_and_zero_are_choices_too(self) -> None:
        own, scene = Quality(normalise=False, subdivide=0), Quality(normalise=True, subdivide=3, arithmetic="fast")
        assert own.over(scene) == Quality(normalise=False, subdivide=0, arithmetic="fast")
        assert Quality().over(scene) == scene


class TestMeaning:
    """A choice has the same result as a scene that is written that way."""

    def test_shading(self, draw: Any) -> None:
        for shading in ("flat", "gouraud", "phong"):
            ours = draw([ball()], [KEY], quality={"shading": shading})
            assert np.array_equal(ours, draw([ball(shading=shading)], [KEY]))

    def test_fresnel(self, draw: Any) -> None:
        ours = draw([ball({"brdf": "metal"})], [KEY], quality={"fresnel": "schlick"})
        assert np.array_equal(ours, draw([ball({"brdf": "metal", "fresnel": "schlick"})], [KEY]))

    def test_half_angle(self, draw: Any) -> None:
        ours = draw([ball()], [KEY], quality={"specular": "half_angle"})
        assert np.array_equal(ours, draw([ball({**GLOSSY, "brdf": "blinn_phong", "exponent": 240})], [KEY]))

    def test_more_vertices_come_nearer_to_phong(self, draw: Any) -> None:
        """Each subdivision divides the error of linearly interpolated light by almost four."""
        exact = draw([ball()], [KEY], (96, 96))
        errors = [
            np.sqrt(np.mean((draw([ball(shading="gouraud")], [KEY], (96, 96), quality={"subdivide": n}) - exact) ** 2))
            for n in range(4)
        ]
        assert all(finer < coarser / 2 for coarser, finer in pairwise(errors)), errors

    def test_refinement_keeps_its_tolerance(self, draw: Any) -> None:
        exact = draw([ball()], [KEY], (96, 96))
        for tolerance in (0.05, 0.01, 0.002):
            scene = draw.scene([ball(shading="gouraud")], [KEY], (96, 96), quality={"refine": tolerance})
            error = np.abs(draw.renderer.render(scene, dtype="float32").pixels - exact).max()
            assert error < 1.5 * tolerance
            # Four uniform subdivisions would take more triangles.
            assert len(ready(scene).instances[0].mesh.triangles) < 320 * 4**4

    def test_normals_as_they_are_interpolated_are_short(self, draw: Any) -> None:
        matte = ball({"brdf": "lambert", "kd": 1})
        unit, short = (draw([matte], [KEY], (96, 96), quality={"normalise": n}) for n in (True, False))
        assert (short <= unit + 1e-6).all()
        # In the middle of a triangle, at an angle a from its corners, the normal is cos(a) long. The edges span 0.33 rad.
        lit = unit[..., 0] > 0.1
        assert 1 - np.cos(0.33 / np.sqrt(3)) > (1 - short[lit] / unit[lit]).max() > 0.005

    def test_fast_arithmetic_has_the_documented_error(self, draw: Any, renderer: Any) -> None:
        """A lobe of height 1 and exponent p is off by about 1.3e-7 p. The driver's pow and normalize add errors too."""
        for p in (1e3, 1e5):
            scene = draw.scene(
                [ball({"brdf": "phong", "kd": 0, "ks": np.pi, "exponent": p})], [{**KEY, "intensity": 1}], (256, 256)
            )
            exact = glshade.reference.render(scene).pixels
            errors = [
                np.abs(
                    renderer.render(scene.model_copy(update={"quality": Quality(arithmetic=a)}), dtype="float32").pixels - exact
                )
                for a in ("stable", "fast")
            ]
            lobe = exact > 0.02
            assert lobe.any()
            assert errors[0][lobe].max() < errors[1][lobe].max() < 8 * p * 1.3e-7


class TestStorage:
    """The pixel formats of linear light."""

    def stored(self, storage: str, draw: Any) -> tuple[Array, Array]:
        """Returns the picture in the given storage, and the picture in float32."""
        rounded, exact = (draw([ball()], LIGHTS, (64, 64), quality={"storage": s}) for s in (storage, "rgba32f"))
        return rounded.astype(np.float64), exact.astype(np.float64)

    @pytest.mark.parametrize(("storage", "codes"), [("rgba8", 255), ("rgb10_a2", 1023)])
    def test_fixed_point(self, storage: str, codes: int, draw: Any) -> None:
        """Values are whole codes, less than one code off. OpenGL 4.6, 2.3.5 does not require the nearest code."""
        rounded, exact = self.stored(storage, draw)
        assert np.abs(rounded * codes - np.rint(rounded * codes)).max() < 1e-3
        assert 0.2 < np.abs(rounded - exact).max() * codes < 1.001
        assert len(np.unique(np.rint(rounded * codes))) > codes / 8

    def test_half_floats(self, draw: Any) -> None:
        rounded, exact = self.stored("rgba16f", draw)
        assert np.array_equal(rounded, rounded.astype(np.float16))
        assert 0 < (np.abs(rounded - exact) / np.spacing(exact.astype(np.float16)).astype(np.float64)).max() < 1.001

    def test_eleven_bits(self, draw: Any) -> None:
        """The channels have mantissas of 6, 6 and 5 bits, and no sign (OpenGL 4.6, 2.3.4.3 and 2.3.4.4)."""
        rounded, exact = self.stored("r11f_g11f_b10f", draw)
        for channel, bits in enumerate((6, 6, 5)):
            mantissa, _ = np.frexp(rounded[..., channel])
            assert np.array_equal(mantissa * 2 ** (bits + 1), np.rint(mantissa * 2 ** (bits + 1)))
            bright = exact[..., channel] > 1e-3
            relative = np.abs(rounded - exact)[..., channel][bright] / exact[..., channel][bright]
            assert 2.0 ** -(bits + 3) < relative.max() < 2.0**-bits

    def test_auto_keeps_float32(self, draw: Any) -> None:
        rounded, exact = self.stored("auto", draw)
        assert np.array_equal(rounded, exact)

    @pytest.mark.parametrize("storage", ["rgba8", "rgb10_a2", "r11f_g11f_b10f", "rgba16f"])
    def test_8_bit_pictures_are_rounded_to_it_first(self, storage: str, draw: Any) -> None:
        linear, picture = (
            draw([ball()], LIGHTS, (64, 64), quality={"storage": storage}, dtype=dtype) for dtype in ("float32", "uint8")
        )
        assert np.abs(Image(linear).encoded().pixels.astype(int) - picture).max() <= 1
        # In rgba8, dark linear codes are far apart after the encoding, so that many 8-bit codes do not occur.
        assert storage != "rgba8" or len(np.unique(picture)) < 160

    def test_light_that_takes_light_away(self, draw: Any) -> None:
        lights = [{**KEY, "intensity": -0.5}]
        for storage, least in (("rgba16f", -0.1), ("rgba32f", -0.1), ("rgba8", 0), ("rgb10_a2", 0)):
            darkest = draw([ball()], lights, quality={"storage": storage}).min()
            assert darkest == 0 if least == 0 else darkest < least
        with pytest.raises(SceneError, match="r11f_g11f_b10f has nothing below zero"):
            draw([ball()], lights, quality={"storage": "r11f_g11f_b10f"})

    def test_no_alpha_in_eleven_bits(self, draw: Any) -> None:
        with pytest.raises(SceneError, match="has no alpha"):
            draw([ball()], [KEY], film={"background": [0, 0, 0, 0.5]}, quality={"storage": "r11f_g11f_b10f"})

    def test_objects_cannot_choose_it(self) -> None:
        with pytest.raises(ValueError, match="applies to the whole picture"):
            Scene.model_validate({"objects": [ball(quality={"storage": "rgba8"})]})


class TestHalfAngle:
    """The choice half_angle, which turns phong into blinn_phong with four times the exponent."""

    @pytest.mark.parametrize(("model", "to"), [("phong", "blinn_phong"), ("phong_normalised", "blinn_phong_normalised")])
    def test_exponents(self, model: str, to: str) -> None:
        material = BRDFS[model].model_validate({"brdf": model, "kd": [0.1, 0.2, 0.3], "ks": 0.4, "exponent": 30})
        half = material.half_angle()
        assert type(half) is BRDFS[to]
        assert half == BRDFS[to].model_validate({**half.model_dump(), "brdf": to})
        given = material.model_dump(exclude={"brdf", "exponent"})
        assert half.model_dump(exclude={"brdf", "exponent"}) == given
        assert half.exponent == 120

    def test_the_exponent_stays_in_its_range(self) -> None:
        assert BRDFS["phong"].model_validate({"brdf": "phong", "exponent": 1e8}).half_angle().exponent == 1e8

    def test_the_factor_of_a_texture_is_multiplied(self, tmp_path: Path) -> None:
        Image(np.full((2, 2, 3), 128, dtype=np.uint8)).save(tmp_path / "t.png")
        texture = {"texture": str(tmp_path / "t.png"), "factor": 50}
        half = BRDFS["phong"].model_validate({"brdf": "phong", "exponent": texture}).half_angle()
        assert half.exponent.factor == (200, 200, 200)

    @pytest.mark.parametrize("model", sorted(set(BRDFS) - {"phong", "phong_normalised"}))
    def test_others_stay_as_they_are(self, model: str) -> None:
        material = BRDFS[model].model_validate({"brdf": model})
        assert material.half_angle() is material

    def test_a_curved_lobe_is_nearly_the_same_at_normal_incidence(self) -> None:
        """cos(2a)^p and cos(a)^4p agree to the fourth order of a: cos(2a) = 1 - 2a^2, and cos(a)^4 too."""
        phong = BRDFS["phong"].model_validate({"brdf": "phong", "kd": 0, "ks": 1, "exponent": 200})
        a = np.linspace(0, 0.1, 20)
        v = np.stack([np.sin(a), 0 * a, np.cos(a)], axis=1)
        l = np.broadcast_to([0.0, 0.0, 1.0], v.shape)
        mirror, half_angle = (glshade.evaluate(m, l, v) for m in (phong, phong.half_angle()))
        assert np.abs(mirror - half_angle).max() < 0.02 * mirror.max()


# case -> (quality, material, shading, lights) where the quality changes nothing.
AMBIENT = {"type": "ambient"}
INERT = {
    "interpolated normals, per vertex": ({"normalise": False}, GLOSSY, "gouraud", [KEY]),
    "interpolated normals, only ambient light": ({"normalise": False}, GLOSSY, "phong", [AMBIENT]),
    "powers, only ambient light": ({"arithmetic": "fast"}, GLOSSY, "phong", [AMBIENT]),
    "fresnel, for a model without a choice": ({"fresnel": "schlick"}, GLOSSY, "phong", [KEY]),
    "half angle, for a model without a mirror direction": ({"specular": "half_angle"}, {"brdf": "ggx"}, "phong", [KEY]),
    "half angle, for a specular lobe of strength 0": ({"specular": "half_angle"}, {**GLOSSY, "ks": 0}, "phong", [KEY]),
    "subdivision, per pixel": ({"subdivide": 2}, GLOSSY, "phong", [KEY]),
    "refinement, per pixel": ({"refine": 1e-3}, GLOSSY, "phong", [KEY]),
    "refinement, per face": ({"refine": 1e-3}, GLOSSY, "flat", [KEY]),
    "refinement, within the tolerance": ({"refine": 10}, GLOSSY, "gouraud", [KEY]),
    "shading, already the object's own": ({"shading": "gouraud"}, GLOSSY, "gouraud", [KEY]),
}


@pytest.mark.parametrize("case", INERT)
def test_inert_choices_change_nothing(case: str, draw: Any) -> None:
    quality, material, shading, lights = INERT[case]
    plain, chosen = (draw.scene([ball(material, shading)], lights, quality=q) for q in ({}, quality))
    assert explain(plain).programs == explain(chosen).programs
    before, after = (ready(scene).instances[0] for scene in (plain, chosen))
    assert (before.mesh.digest, before.material) == (after.mesh.digest, after.material)


@pytest.mark.parametrize(
    ("shading", "quality"),
    [
        ("gouraud", {"subdivide": 2}),
        ("flat", {"subdivide": 1}),
        ("gouraud", {"refine": 0.02}),
        ("phong", {"specular": "half_angle"}),
    ],
)
def test_pictures_are_still_verified(shading: str, quality: dict[str, Any], draw: Any, renderer: Any) -> None:
    """The reference draws the same subdivided meshes, so that the whole picture is compared."""
    floor = {"shape": {"type": "plane", "segments": 4}, "transform": {"translate": [0, -1, 0], "scale": 3}, "shading": shading}
    scene = draw.scene(
        [ball(shading=shading), floor], [KEY, {"type": "point", "position": [1, 2, 3]}], (96, 64), quality=quality
    )
    verdict = glshade.verify(scene, renderer=renderer)
    assert verdict.verdict == "verified", str(verdict)


@pytest.mark.parametrize(
    "quality",
    [{"subdivide": 9}, {"subdivide": -1}, {"subdivide": 1.5}, {"refine": 0}, {"refine": -1}, {"storage": "rgb8"}, {"speed": 1}],
)
def test_values_that_are_refused(quality: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="quality"):
        Scene.model_validate({"objects": [ball()], "quality": quality})
