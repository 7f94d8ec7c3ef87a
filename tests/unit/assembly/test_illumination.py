"""Illumination: spectra become RGB colours that are drawn like any others, exactly or in bands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.assembly.assembly import Assembly, assemble
from glshade.assembly.part import Part
from glshade.errors import AssetError, SceneError
from glshade.glsl.explanation import explanation_of
from glshade.live.dependencies import leniently_named
from glshade.optics.fresnel import f0_conductor
from glshade.optics.observer import WAVELENGTHS, rgb_weights
from glshade.optics.spectra import ILLUMINANTS, Spectrum
from glshade.radiance.draw import draw_of
from glshade.radiance.surface import Surface, evaluate_surface
from glshade.scene.digest import scene_digest
from glshade.scene.file import load
from glshade.scene.scene import Scene

# A reflectance with structure, and an index of refraction that changes as gold's does.
PAINT = [[380, 0.1], [440, 0.5], [500, 0.15], [560, 0.7], [620, 0.3], [700, 0.9], [780, 0.2]]
ETA = {"spectrum": [[300, 1.8], [450, 1.5], [520, 0.6], [600, 0.2], [880, 0.2]]}
K = {"spectrum": [[300, 1.9], [450, 1.9], [520, 2.2], [600, 3.0], [880, 5.4]]}
LAMP = [[340, 0], [350, 1], [358, 0]]


def scene(material: dict[str, Any], *colours: Any, **film: Any) -> Scene:
    """Returns a scene of one sphere, with a light of each colour that shines along the view."""
    return Scene.model_validate(
        {
            "film": {"size": (8, 8), **film},
            "camera": {"type": "orthographic", "eye": (0, 0, 5), "height": 2.2},
            "objects": [{"name": "ball", "shape": "sphere", "material": {"brdf": "lambert", **material}}],
            "lights": [{"type": "directional", "direction": (0, 0, -1), "colour": colour} for colour in colours],
        }
    )


def shown(seen: Scene, assembly: Assembly | None = None) -> np.ndarray:
    """Returns the light (3,) of the point of the sphere that faces viewer and lights, as the reference computes it."""
    assembly = assembly or assemble(seen)
    point = Surface(np.ones(1), np.array([[0.0, 0.0, -4.0]]), np.array([[0.0, 0.0, 1.0]]), None, None, None)
    return evaluate_surface(draw_of(seen, assembly, assembly.instances[0]), point)[0]


def by_hand(reflectance: np.ndarray, light: Any) -> np.ndarray:
    return (Spectrum.model_validate(light).light() * reflectance) @ rgb_weights()


def curve(rows: Any) -> np.ndarray:
    return Spectrum.model_validate({"spectrum": rows}).values()


@pytest.mark.parametrize("light", [*({"spectrum": name} for name in ILLUMINANTS), {"blackbody": 1800}])
def test_linear_models_show_the_sum_over_the_wavelengths(light: Any) -> None:
    found = scene({"kd": {"spectrum": PAINT}}, light)
    np.testing.assert_allclose(shown(found), by_hand(curve(PAINT), light), atol=1e-6)
    # One spectrum of light takes one material and no more programs than RGB.
    (instance,) = assemble(found).instances
    assert instance.shares == ()


def test_lights_of_several_spectra_add_up() -> None:
    lights = [{"spectrum": "A"}, {"spectrum": "F11"}, {"spectrum": "A", "scale": 2}]
    found = scene({"kd": {"spectrum": PAINT}}, *lights)
    assert [share.lights for share in assemble(found).instances[0].shares] == [(0, 2), (1,)]
    np.testing.assert_allclose(shown(found), sum(by_hand(curve(PAINT), light) for light in lights), atol=4e-6)


def test_a_surface_that_is_grey_at_all_wavelengths_needs_no_shares() -> None:
    found = scene({"kd": {"spectrum": [[300, 0.4], [830, 0.4]]}}, {"spectrum": "A"}, {"spectrum": "F2"})
    (instance,) = assemble(found).instances
    assert instance.shares == ()
    assert instance.material.kd == (0.4, 0.4, 0.4)


def test_models_with_a_constant_part_are_exact_too() -> None:
    """The coat of a strauss or the gloss of a plastic has no colour, and shows the lamp's."""
    glossy = {"brdf": "burley", "roughness": 0.4}
    coated = {"brdf": "paint", "flakes": 0.0, "coat": 1.0, "coat_roughness": 0.8}
    for material in (glossy, coated):
        for light in ({"spectrum": [[500, 0], [520, 1], [540, 0]]}, {"spectrum": [[600, 0], [610, 2], [640, 0]]}):
            found = scene({**material, "kd": {"spectrum": PAINT}}, light)
            spectrum = np.zeros(len(WAVELENGTHS))
            lit = np.flatnonzero(Spectrum.model_validate(light).light())
            for wave in range(lit[0], lit[-1] + 1, 3):
                three = tuple(curve(PAINT)[wave : wave + 3].tolist())
                spectrum[wave : wave + 3] = shown(scene({**material, "kd": three}, 1))
            np.testing.assert_allclose(shown(found), by_hand(spectrum, light), atol=2e-6)


def banded(light: Any, bands: int) -> float:
    """Returns the largest error of the light that a metal reflects of a sky, drawn in bands, against a sum over wavelengths."""
    metal = {"brdf": "metal", "eta": ETA, "k": K}
    found = scene(metal, 1, bands=bands)
    sky = found.model_copy(
        update={
            "lights": (
                Scene.model_validate({"objects": [{"shape": "cube"}], "lights": [{"type": "ambient", "colour": light}]}).lights
                or ()
            )
        }
    )
    values = [Spectrum.model_validate(x).values(held=True)[:, None] for x in (ETA, K)]
    exact = by_hand(f0_conductor(*values)[:, 0], light)
    return float(np.abs(shown(sky) - exact).max())


@pytest.mark.parametrize("name", ILLUMINANTS)
def test_bands_come_close_to_the_sum_over_the_wavelengths(name: str) -> None:
    light = {"spectrum": name}
    assert banded(light, 12) <= 0.035
    assert banded(light, 30) <= 0.004
    assert banded(light, 30) < banded(light, 3)


def test_metals_use_the_number_of_bands_of_the_film() -> None:
    (instance,) = assemble(scene({"brdf": "metal", "eta": ETA, "k": K}, 1, bands=15)).instances
    assert len(instance.shares) == 5
    assert all(share.weights is not None for share in instance.shares)


def test_daylight_shows_rgb_colours_as_they_are() -> None:
    colour = (0.8, 0.3, 0.1)
    (instance,) = assemble(scene({"kd": colour}, {"spectrum": "D65"}, 0.5)).instances
    assert (instance.shares, instance.material.kd) == ((), colour)
    # RGB lights on RGB materials are multiplied as without spectra, also beside a lamp with a spectrum.
    both = assemble(scene({"kd": colour}, (1, 0.5, 0.2), {"spectrum": "A"}))
    assert both.instances[0].shares[0].material.kd == colour
    assert both.lights[0].rgb == (1, 0.5, 0.2)


@settings(max_examples=20)
@given(st.tuples(*[st.floats(0, 1)] * 3))
def test_rgb_colours_beside_spectra_stay_themselves_by_day(colour: tuple[float, float, float]) -> None:
    found = scene({"brdf": "phong", "kd": colour, "ks": {"spectrum": PAINT}}, {"spectrum": "D65"})
    np.testing.assert_allclose(assemble(found).instances[0].material.kd, colour, atol=1e-4)


def test_a_film_with_a_white_of_its_own_shows_that_light_as_white() -> None:
    grey = {"kd": {"spectrum": [[300, 0.5], [830, 0.5]]}}
    warm = shown(scene(grey, {"spectrum": "A"}))
    assert warm[0] > 1.5 * warm[2]
    np.testing.assert_allclose(shown(scene(grey, {"spectrum": "A"}, white="A")), 0.5, atol=1e-6)
    # RGB colours have the spectrum of D65, which looks blue beside A.
    red, _, blue = shown(scene({"kd": 0.5}, 1, white={"blackbody": 2856}))
    assert blue > 1.5 * red


def test_the_white_of_daylight_changes_nothing() -> None:
    colours = ({"kd": (0.8, 0.3, 0.1)}, (1, 0.5, 0.2))
    np.testing.assert_allclose(shown(scene(*colours, white="D65")), shown(scene(*colours)), rtol=1e-9)


def test_the_light_of_an_invisible_lamp_shows_only_by_reradiation(tmp_path: Path) -> None:
    dye = write_dye(tmp_path)
    lamp = {"spectrum": LAMP}
    assert shown(scene({"kd": {"spectrum": PAINT}}, lamp)).max() == 0
    assert shown(scene({"brdf": "metal", "eta": ETA, "k": K}, lamp)).max() == 0
    for brdf in ("lambert", "phong", "oren_nayar", "metal"):
        own = {"ks": 0.0} if brdf == "phong" else {}
        found = scene(
            {"brdf": brdf, "reradiation": dye, **({} if brdf == "metal" else {"kd": {"spectrum": PAINT}}), **own}, lamp
        )
        material = found.objects[0].material
        assert material is not None
        assert not isinstance(material, str)
        assert material.reradiation is not None
        glow = material.reradiation.emitted(Spectrum.model_validate(lamp).light()) @ rgb_weights()
        np.testing.assert_allclose(shown(found), glow, atol=1e-6 * np.abs(glow).max())
        assert glow[2] > 0.1


def write_dye(folder: Path) -> Path:
    (folder / "dye.csv").write_text("x,430,450,470\n330,0,0.01,0\n350,0,0.02,0\n370,0,0.01,0\n", encoding="utf-8")
    return folder / "dye.csv"


def test_reradiation_adds_to_the_reflection(tmp_path: Path) -> None:
    light = {"spectrum": "D65"}
    plain = {"kd": {"spectrum": PAINT}}
    without = shown(scene(plain, light))
    found = scene({**plain, "reradiation": write_dye(tmp_path)}, light)
    assert assemble(found).instances[0].shares == ()
    given_off = found.objects[0].material.reradiation.emitted(Spectrum.model_validate(light).light()) @ rgb_weights()  # type: ignore[union-attr]
    np.testing.assert_allclose(shown(found) - without, given_off, atol=1e-6)
    assert np.abs(given_off).max() > 1e-3


def test_more_energy_out_than_in_is_refused_with_the_wavelength(tmp_path: Path) -> None:
    with pytest.raises(Exception, match=r"reradiation: of light of 350 nm, 1\.2 times its energy"):
        scene({"kd": 0.8, "reradiation": write_dye(tmp_path)}, 1)


def test_emission_of_shorter_waves_is_a_warning(tmp_path: Path) -> None:
    (tmp_path / "odd.csv").write_text("x,400,450\n430,0.001,0\n460,0,0\n", encoding="utf-8")
    with pytest.warns(UserWarning, match="shorter"):
        scene({"kd": 0.1, "reradiation": tmp_path / "odd.csv"}, 1)


def test_emission_has_the_colour_of_its_spectrum() -> None:
    glowing = scene({"kd": 0, "emission": {"spectrum": "F2", "scale": 0.5}})
    np.testing.assert_allclose(
        shown(glowing), Spectrum.model_validate({"spectrum": "F2", "scale": 0.5}).light() @ rgb_weights(), atol=1e-6
    )
    metal = scene({"brdf": "metal", "eta": ETA, "k": K, "emission": {"blackbody": 1500}})
    np.testing.assert_allclose(shown(metal), Spectrum.model_validate({"blackbody": 1500}).light() @ rgb_weights(), atol=3e-6)


def test_parts_of_the_light_add_up(tmp_path: Path) -> None:
    material = {"brdf": "metal", "eta": ETA, "k": K, "emission": 0.1, "reradiation": write_dye(tmp_path)}
    found = scene(material, {"spectrum": "A"}, {"spectrum": "F11"}, {"spectrum": LAMP})
    whole = assemble(found)
    parts = [Part("light", index) for index in range(3)] + [Part("emission")]
    light = [shown(found, part.of(whole)) for part in parts]
    np.testing.assert_allclose(sum(light), shown(found), atol=1e-6)
    assert all(np.abs(each).max() > 0.01 for each in light)


def test_the_albedo_of_a_metal_is_its_colour_by_day() -> None:
    found = scene({"brdf": "metal", "eta": ETA, "k": K}, {"spectrum": "A"})
    values = [Spectrum.model_validate(x).values(held=True)[:, None] for x in (ETA, K)]
    albedo = shown(found, Part("albedo").of(assemble(found)))
    np.testing.assert_allclose(albedo, by_hand(f0_conductor(*values)[:, 0], {"spectrum": "D65"}), atol=1e-6)


def test_spectra_have_bands_of_their_own_layer() -> None:
    """The bands of the layer, multiplied with the observer, are the picture."""
    found = scene({"kd": {"spectrum": PAINT}}, {"spectrum": "A"}, {"blackbody": 5000}, bands=198, aovs=["spectrum"])
    whole = assemble(found)
    bands = np.concatenate([shown(found, Part("spectrum", first).of(whole)) for first in range(0, 198, 3)])
    width = 400 / 198
    middles = 380 + width * (np.arange(198) + 0.5)
    weights = np.stack([np.interp(middles, WAVELENGTHS, column) for column in rgb_weights().T], axis=1)
    np.testing.assert_allclose(width * bands @ weights, shown(found), atol=2e-3)


def said(found: Scene) -> str:
    return "\n".join(f"{feature}: {reason}" for feature, reason in explanation_of(found).plan.reasons)


def test_explain_says_how_spectra_are_drawn_and_where_tables_end() -> None:
    text = said(scene({"kd": {"spectrum": PAINT}}, {"spectrum": "F11"}))
    assert "spectra of lambert integrated exactly: ball" in text
    assert "F11 goes from 380 nm to 780 nm; beyond, it is 0: lights[0]" in text
    assert "the table goes from 380 nm to 780 nm; beyond, it is 0: ball's kd" in text
    metal = {"brdf": "metal", "eta": ETA, "k": {"spectrum": [[400, 2], [700, 4]]}}
    text = said(scene(metal, {"spectrum": "A"}))
    assert "spectra of metal in 12 bands: ball, whose model is not linear in its colours" in text
    assert "the table goes from 400 nm to 700 nm; beyond, its ends hold: ball's k" in text
    assert "spectra" not in said(scene({"kd": 0.5}, 1))


def test_scenes_without_spectra_have_no_illumination() -> None:
    plain = assemble(scene({"kd": 0.5}, 1, (1, 0.5, 0.2)))
    assert plain.illumination is None
    assert plain.instances[0].written is None


def test_digests_tell_spectra_apart_by_content(tmp_path: Path) -> None:
    names = ["one.spd", "two.spd", "three.spd"]
    for name, last in zip(names, (0.2, 0.2, 0.3), strict=True):
        (tmp_path / name).write_text(f"400 0.1\n700 {last}\n", encoding="utf-8")
    one, two, three = (scene_digest(scene({"kd": {"spectrum": tmp_path / name}}, 1)) for name in names)
    assert one == two != three
    assert scene_digest(scene({}, {"spectrum": "A"})) != scene_digest(scene({}, {"spectrum": "F2"}))


FILE = """
objects = [{ shape = "sphere", material = "paint" }]
lights = [{ type = "directional", colour = { spectrum = "A" } }]
[materials.paint]
brdf = "lambert"
kd = { spectrum = "paint.spd" }
[materials.scalar]
brdf = "phong"
"""


def test_scene_files_name_spectra_and_can_be_overridden(tmp_path: Path) -> None:
    (tmp_path / "paint.spd").write_text("400 0.1\n700 0.2\n", encoding="utf-8")
    path = tmp_path / "scene.toml"
    path.write_text(FILE, encoding="utf-8")
    kd = load(path).materials["paint"].kd
    assert kd == Spectrum.model_validate({"spectrum": tmp_path / "paint.spd"})
    assert load(path, [("lights.0.colour", "{ blackbody = 3000 }")]).lights[0].colour.blackbody == 3000  # type: ignore[index]
    assert load(path, [("materials.paint.kd.scale", "0.5")]).materials["paint"].kd.scale == 0.5
    for key, value, says in [
        ("materials.paint.kd", "{ spectrum = 'gone.spd' }", "materials.paint.kd.spectrum: "),
        ("materials.paint.kd", "{ spectrum = 'A' }", "materials.paint.kd: A is the spectrum of a light, not of a surface"),
        ("materials.paint.kd", "{ spectrum = 'paint.spd', factor = 2 }", "materials.paint.kd.factor: unknown key"),
        (
            "materials.scalar.exponent",
            "{ spectrum = 'paint.spd' }",
            "materials.scalar.exponent: is one number, so that it cannot be a spectrum",
        ),
        ("lights.0.colour", "{ spectrm = 'A' }", 'lights[0].colour.spectrm: unknown key; did you mean "spectrum"?'),
        ("film.white", "'F9'", 'film.white.spectrum: no file and no illuminant is named "F9"'),
        ("film.white", "{ spectrum = [[340, 1], [350, 1]] }", "film.white: the table cannot be the white"),
        ("film.bands", "13", "film.bands: must be a multiple of 3"),
    ]:
        with pytest.raises(SceneError) as caught:
            load(path, [(key, value)])
        assert says in str(caught.value)
        assert "\n" not in str(caught.value)


def test_the_files_of_spectra_are_watched(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(FILE + 'reradiation = "dye.csv"\n', encoding="utf-8")
    assert {tmp_path / "paint.spd", tmp_path / "dye.csv"} <= leniently_named(tmp_path / "scene.toml")


def test_reflectances_above_their_range_are_refused_with_the_wavelength() -> None:
    with pytest.raises(Exception, match=r"kd\n.*must be at most 1, not 1.1 \(at 500 nm\)"):
        scene({"brdf": "plastic", "kd": {"spectrum": [[400, 0.5], [500, 1.1], [600, 0.5]]}}, 1)


def test_layers_without_a_spectrum_are_refused(tmp_path: Path) -> None:
    from glshade import Image

    Image(np.full((2, 2, 3), 128, np.uint8), "srgb").save(tmp_path / "grey.png")
    found = scene({"kd": {"texture": tmp_path / "grey.png"}}, 1, aovs=["spectrum"])
    with pytest.raises(SceneError, match=r"film\.aovs: spectrum cannot show ball, whose kd is an RGB texture"):
        Part("spectrum").of(assemble(found))


def test_files_that_vanish_are_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "paint.spd").write_text("400 0.1\n700 0.2\n", encoding="utf-8")
    found = scene({"kd": {"spectrum": tmp_path / "paint.spd"}}, 1)
    (tmp_path / "paint.spd").unlink()
    with pytest.raises(AssetError, match=r"paint\.spd: cannot be read"):
        assemble(found)
