"""Quality: every knob reaches the picture as it says, of the whole scene and of one object, and no other part of it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade.brdfs import BRDFS
from glshade.errors import SceneError
from glshade.glsl.plan import explain
from glshade.image.image import Image
from glshade.radiance.readying import ready
from glshade.scene.quality import Quality
from glshade.scene.scene import Scene

Array = np.ndarray[Any, Any]
BALL = {"type": "icosphere", "subdivisions": 2}
KEY = {"type": "directional", "direction": [0.4, -0.5, -0.8], "intensity": 0.8}
LIGHTS = [KEY, {"type": "ambient", "intensity": 0.1}]
GLOSSY = {"brdf": "phong", "kd": [0.4, 0.2, 0.1], "ks": 0.6, "exponent": 60}
# Rounding alone changes a picture by less.
SHOWS = 1e-5
# One choice of each knob but storage, with what makes it show: (quality, material, shading).
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
    """Two balls, of which the first has a quality of its own."""
    own = {} if first is None else {"quality": first}
    return [ball(material, shading, -1.2, **own), ball(material, shading, 1.2)]


def test_every_knob_is_here() -> None:
    assert set(SHOWING) | {"storage"} == set(Quality.model_fields)


class TestReach:
    """Where a choice arrives."""

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
        found = ready(scene).instances
        assert [i.rate for i in found] == ["phong", "gouraud", "gouraud"]
        # Per pixel there is nothing to be cut for.
        assert [len(i.mesh.triangles) for i in found] == [320, 320 * 16, 320 * 4]
        assert found[1].quality == Quality(shading="gouraud", subdivide=2)

    def test_false_and_zero_are_said_as_well(self) -> None:
        own, scene = Quality(normalise=False, subdivide=0), Quality(normalise=True, subdivide=3, arithmetic="fast")
        assert own.over(scene) == Quality(normalise=False, subdivide=0, arithmetic="fast")
        assert Quality().over(scene) == scene


class TestSays:
    """A choice is what one would have written oneself."""

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
        """A level of cutting takes the error of light that is linear in between to a quarter, or nearly."""
        exact = draw([ball()], [KEY], (96, 96))
        off = [
            np.sqrt(np.mean((draw([ball(shading="gouraud")], [KEY], (96, 96), quality={"subdivide": n}) - exact) ** 2))
            for n in range(4)
        ]
        assert all(finer < coarser / 2 for coarser, finer in pairwise(off)), off

    def test_refinement_keeps_its_word(self, draw: Any) -> None:
        exact = draw([ball()], [KEY], (96, 96))
        for tolerance in (0.05, 0.01, 0.002):
            scene = draw.scene([ball(shading="gouraud")], [KEY], (96, 96), quality={"refine": tolerance})
            off = np.abs(draw.renderer.render(scene, dtype="float32").pixels - exact).max()
            assert off < 1.5 * tolerance
            # To a quarter of the tolerance the half of the edge: uniformly cut, this error takes far more.
            assert len(ready(scene).instances[0].mesh.triangles) < 320 * 4**4

    def test_normals_as_they_are_interpolated_are_short(self, draw: Any) -> None:
        matte = ball({"brdf": "lambert", "kd": 1})
        unit, short = (draw([matte], [KEY], (96, 96), quality={"normalise": n}) for n in (True, False))
        assert (short <= unit + 1e-6).all()
        # In the middle of a triangle, at an angle a from its corners, the normal is cos(a) long; edges here are 0.33 rad.
        lit = unit[..., 0] > 0.1
        assert 1 - np.cos(0.33 / np.sqrt(3)) > (1 - short[lit] / unit[lit]).max() > 0.005

    def test_fast_arithmetic_is_off_by_what_its_files_say(self, draw: Any, renderer: Any) -> None:
        """Some p 1.3e-7 of a lobe of height 1; the driver's pow and its vectors' lengths add their own."""
        for p in (1e3, 1e5):
            scene = draw.scene(
                [ball({"brdf": "phong", "kd": 0, "ks": np.pi, "exponent": p})], [{**KEY, "intensity": 1}], (256, 256)
            )
            exact = glshade.reference.render(scene).pixels
            off = [
                np.abs(
                    renderer.render(scene.model_copy(update={"quality": Quality(arithmetic=a)}), dtype="float32").pixels - exact
                )
                for a in ("stable", "fast")
            ]
            lobe = exact > 0.02
            assert lobe.any()
            assert off[0][lobe].max() < off[1][lobe].max() < 8 * p * 1.3e-7


class TestStorage:
    """What linear light is kept in."""

    def kept(self, storage: str, draw: Any) -> tuple[Array, Array]:
        """(as it is kept, as it was)."""
        both = [draw([ball()], LIGHTS, (64, 64), quality={"storage": s}) for s in (storage, "rgba32f")]
        return both[0].astype(np.float64), both[1].astype(np.float64)

    @pytest.mark.parametrize(("storage", "codes"), [("rgba8", 255), ("rgb10_a2", 1023)])
    def test_fixed_point(self, storage: str, codes: int, draw: Any) -> None:
        """Whole codes, none off by one or more: OpenGL 4.6, 2.3.5 prefers the nearest and does not insist."""
        kept, was = self.kept(storage, draw)
        assert np.abs(kept * codes - np.rint(kept * codes)).max() < 1e-3
        assert 0.2 < np.abs(kept - was).max() * codes < 1.001
        assert len(np.unique(np.rint(kept * codes))) > codes / 8

    def test_half_floats(self, draw: Any) -> None:
        kept, was = self.kept("rgba16f", draw)
        assert np.array_equal(kept, kept.astype(np.float16))
        assert 0 < (np.abs(kept - was) / np.spacing(was.astype(np.float16)).astype(np.float64)).max() < 1.001

    def test_eleven_bits(self, draw: Any) -> None:
        """Mantissas of 6, 6 and 5 bits, and no sign (OpenGL 4.6, 2.3.4.3 and 2.3.4.4)."""
        kept, was = self.kept("r11f_g11f_b10f", draw)
        for channel, bits in enumerate((6, 6, 5)):
            mantissa, _ = np.frexp(kept[..., channel])
            assert np.array_equal(mantissa * 2 ** (bits + 1), np.rint(mantissa * 2 ** (bits + 1)))
            some = was[..., channel] > 1e-3
            relative = np.abs(kept - was)[..., channel][some] / was[..., channel][some]
            assert 2.0 ** -(bits + 3) < relative.max() < 2.0**-bits

    def test_auto_is_all_digits(self, draw: Any) -> None:
        kept, was = self.kept("auto", draw)
        assert np.array_equal(kept, was)

    @pytest.mark.parametrize("storage", ["rgba8", "rgb10_a2", "r11f_g11f_b10f", "rgba16f"])
    def test_a_picture_of_8_bits_has_been_through_it(self, storage: str, draw: Any) -> None:
        linear, picture = (
            draw([ball()], LIGHTS, (64, 64), quality={"storage": storage}, dtype=dtype) for dtype in ("float32", "uint8")
        )
        assert np.abs(Image(linear).encoded().pixels.astype(int) - picture).max() <= 1
        # Dark codes of linear light are far apart once they are encoded.
        assert storage != "rgba8" or len(np.unique(picture)) < 160

    def test_light_that_takes_light_away(self, draw: Any) -> None:
        lights = [{**KEY, "intensity": -0.5}]
        for storage, least in (("rgba16f", -0.1), ("rgba32f", -0.1), ("rgba8", 0), ("rgb10_a2", 0)):
            found = draw([ball()], lights, quality={"storage": storage}).min()
            assert found == 0 if least == 0 else found < least
        with pytest.raises(SceneError, match="r11f_g11f_b10f has nothing below zero"):
            draw([ball()], lights, quality={"storage": "r11f_g11f_b10f"})

    def test_no_alpha_in_eleven_bits(self, draw: Any) -> None:
        with pytest.raises(SceneError, match="has no alpha"):
            draw([ball()], [KEY], film={"background": [0, 0, 0, 0.5]}, quality={"storage": "r11f_g11f_b10f"})

    def test_is_not_an_objects(self) -> None:
        with pytest.raises(ValueError, match="is the whole picture's"):
            Scene.model_validate({"objects": [ball(quality={"storage": "rgba8"})]})


class TestHalfAngle:
    """phong to blinn_phong, at four times the exponent."""

    @pytest.mark.parametrize(("model", "to"), [("phong", "blinn_phong"), ("phong_normalised", "blinn_phong_normalised")])
    def test_exponents(self, model: str, to: str) -> None:
        material = BRDFS[model].model_validate({"brdf": model, "kd": [0.1, 0.2, 0.3], "ks": 0.4, "exponent": 30})
        half = material.half_angle()
        assert type(half) is BRDFS[to]
        assert half == BRDFS[to].model_validate({**half.model_dump(), "brdf": to})
        given = material.model_dump(exclude={"brdf", "exponent"})
        assert half.model_dump(exclude={"brdf", "exponent"}) == given
        assert half.exponent == 120

    def test_none_beyond_what_is_allowed(self) -> None:
        assert BRDFS["phong"].model_validate({"brdf": "phong", "exponent": 1e8}).half_angle().exponent == 1e8

    def test_of_a_texture_the_factor(self, tmp_path: Path) -> None:
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
        one, other = (glshade.evaluate(m, l, v) for m in (phong, phong.half_angle()))
        assert np.abs(one - other).max() < 0.02 * one.max()


# What cannot show: (quality, material, shading, lights).
AMBIENT = {"type": "ambient"}
INERT = {
    "normals made unit, per vertex": ({"normalise": False}, GLOSSY, "gouraud", [KEY]),
    "normals made unit, without direction": ({"normalise": False}, GLOSSY, "phong", [AMBIENT]),
    "powers, without direction": ({"arithmetic": "fast"}, GLOSSY, "phong", [AMBIENT]),
    "reflection of what has one formula": ({"fresnel": "schlick"}, GLOSSY, "phong", [KEY]),
    "mirror of what has none": ({"specular": "half_angle"}, {"brdf": "ggx"}, "phong", [KEY]),
    "mirror of no strength": ({"specular": "half_angle"}, {**GLOSSY, "ks": 0}, "phong", [KEY]),
    "cutting, per pixel": ({"subdivide": 2}, GLOSSY, "phong", [KEY]),
    "refining, per pixel": ({"refine": 1e-3}, GLOSSY, "phong", [KEY]),
    "refining, per face": ({"refine": 1e-3}, GLOSSY, "flat", [KEY]),
    "refining what is good enough": ({"refine": 10}, GLOSSY, "gouraud", [KEY]),
    "what is said already": ({"shading": "gouraud"}, GLOSSY, "gouraud", [KEY]),
}


@pytest.mark.parametrize("case", INERT)
def test_what_cannot_show_changes_nothing(case: str, draw: Any) -> None:
    quality, material, shading, lights = INERT[case]
    plain, chosen = (draw.scene([ball(material, shading)], lights, quality=q) for q in ({}, quality))
    assert explain(plain).programs == explain(chosen).programs
    one, other = (ready(scene).instances[0] for scene in (plain, chosen))
    assert (one.mesh.digest, one.material) == (other.mesh.digest, other.material)


@pytest.mark.parametrize(
    ("shading", "quality"),
    [
        ("gouraud", {"subdivide": 2}),
        ("flat", {"subdivide": 1}),
        ("gouraud", {"refine": 0.02}),
        ("phong", {"specular": "half_angle"}),
    ],
)
def test_is_still_verified(shading: str, quality: dict[str, Any], draw: Any, renderer: Any) -> None:
    """The reference draws the very vertices that were cut, so that the whole of the picture is judged."""
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
def test_what_is_refused(quality: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="quality"):
        Scene.model_validate({"objects": [ball()], "quality": quality})
