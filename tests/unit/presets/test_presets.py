"""Tests the presets: their files, every way to use one in a scene, and the metals' figures against spectra."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from pydantic import ValidationError

import glshade
from glshade import BRDFS, Scene
from glshade.presets import PRESETS, preset
from glshade.radiance.readying import ready
from glshade.scene.digest import scene_digest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "script"))
conductors = importlib.import_module("conductors")
METALS = tuple(conductors.FILES)


def scene(material: Any, **more: Any) -> Scene:
    return Scene.model_validate({"objects": [{"shape": "cube", "material": material}], **more})


def drawn(of: Scene) -> Any:
    return ready(of).instances[0].material


def fault(material: Any, **more: Any) -> tuple[str, str]:
    with pytest.raises(ValidationError) as error:
        scene(material, **more)
    (one,) = error.value.errors(include_url=False)
    return ".".join(map(str, one["loc"])), one["msg"]


class TestWhatShips:
    @pytest.mark.parametrize("name", PRESETS)
    def test_is_a_material(self, name: str) -> None:
        table = preset(name)
        material = BRDFS[table["brdf"]].model_validate(table)
        assert material == drawn(scene(name))
        assert set(table) <= {"brdf", *material.parameters(), *material.choices()}

    @pytest.mark.parametrize("name", PRESETS)
    def test_says_what_it_is_and_where_from(self, name: str) -> None:
        assert name == name.lower()
        assert len(PRESETS[name].source) > 5
        description = PRESETS[name].description
        assert len(description) > 10
        assert not description.endswith(".")
        assert "\n" not in description

    def test_is_on_its_page(self) -> None:
        done = subprocess.run([sys.executable, ROOT / "script" / "presets.py", "--check"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    def test_none_is_like_another(self) -> None:
        tables = [json.dumps(preset(name), sort_keys=True) for name in PRESETS]
        assert len(set(tables)) == len(tables)

    def test_names_cost_no_reading(self, python: Any) -> None:
        code = "import sys; from glshade.presets import PRESETS; 'gold' in PRESETS; len(list(PRESETS)); "
        assert python(code + "print('tomllib' in sys.modules)") == "False"


class TestInAScene:
    def test_by_name(self) -> None:
        assert drawn(scene("gold")) == BRDFS["metal"].model_validate(preset("gold"))

    def test_the_scenes_own_materials_come_first(self) -> None:
        own = {"brdf": "lambert", "kd": [1, 0, 0]}
        assert drawn(scene("gold", materials={"gold": own})) == BRDFS["lambert"](kd=(1, 0, 0))

    @pytest.mark.parametrize("brdf", [{}, {"brdf": "metal"}])
    def test_with_other_parameters(self, brdf: dict[str, str]) -> None:
        expected = BRDFS["metal"].model_validate({**preset("gold"), "roughness": 0.45})
        table = {"preset": "gold", **brdf, "roughness": 0.45}
        assert drawn(scene(table)) == expected
        assert drawn(scene("dull", materials={"dull": table})) == expected

    def test_what_is_dumped_says_it_all(self) -> None:
        one = scene("gold")
        again = Scene.model_validate(json.loads(one.model_dump_json()))
        assert again == one
        assert scene_digest(again) == scene_digest(one)
        assert scene_digest(one) != scene_digest(scene("silver"))
        assert "gold" in one.materials

    def test_objects_made_in_python(self) -> None:
        one = Scene(objects=[glshade.Object(shape="cube", material="gold")])
        assert drawn(one) == drawn(scene("gold"))

    def test_a_preset_is_the_callers(self) -> None:
        preset("gold")["eta"][0] = 7.0
        assert preset("gold")["eta"][0] != 7.0

    def test_a_wrong_name(self) -> None:
        assert fault("goldd") == ("objects.0.material", 'no material or preset is named "goldd"; did you mean "gold"?')
        assert fault("mine", materials={"mime": {"brdf": "lambert"}})[1].endswith('; did you mean "mime"?')
        place, message = fault({"preset": "goldd"})
        assert place == "objects.0.material.preset"
        assert message == "unknown preset 'goldd'; did you mean \"gold\"?"
        assert fault("x", materials={"x": {"preset": 3}})[0] == "materials.x.preset"

    def test_another_model(self) -> None:
        expected = "must be left out beside preset = \"gold\", which is a metal, not 'phong'"
        assert fault({"preset": "gold", "brdf": "phong"}) == ("objects.0.material.brdf", expected)

    def test_wrong_parameters(self) -> None:
        assert fault({"preset": "gold", "roughnes": 1}) == (
            "objects.0.material.roughnes",
            'unknown key; did you mean "roughness"?',
        )
        assert fault({"preset": "gold", "roughness": 2})[0] == "objects.0.material.roughness"

    @pytest.mark.parametrize(
        ("material", "valid"),
        [
            ("gold", True),
            ({"preset": "gold"}, True),
            ({"preset": "gold", "roughness": 0.4, "alpha": 0.5}, True),
            ({"preset": "gold", "brdf": "metal"}, True),
            ({"preset": "gold", "brdf": "phong"}, False),
            ({"preset": "goldd"}, False),
            ({"preset": "gold", "roughnes": 1}, False),
            ({"preset": "gold", "roughness": 2}, False),
            ({"roughness": 0.4}, False),
            ({}, False),
        ],
    )
    def test_the_schema_knows(self, material: Any, valid: bool) -> None:
        validator = jsonschema.Draft202012Validator(Scene.model_json_schema())
        table = {"objects": [{"shape": "cube", "material": material}], "materials": {"m": {"preset": "silver"}}}
        assert validator.is_valid(table) == valid


@pytest.fixture(scope="module")
def spectra() -> Path:
    try:
        import mitsuba

        mitsuba.set_variant("scalar_rgb")
    except Exception as error:  # without /proc its import ends in a NameError
        pytest.skip(f"Mitsuba, whose spectra these are (in the dev extra where it has wheels), is not here: {error!r}")
    folder = Path(mitsuba.__file__).parent / "data" / "ior"
    if not folder.is_dir():
        pytest.skip(f"this Mitsuba comes without its spectra: no {folder}")
    return folder


# Colours at normal incidence in linear Rec. 709: Akenine-Möller et al. 2018 (Real-Time Rendering, 4th edition), table 9.2.
PUBLISHED = {
    "aluminium": (0.913, 0.922, 0.924),
    "brass": (0.910, 0.778, 0.423),
    "chromium": (0.549, 0.556, 0.554),
    "copper": (0.955, 0.638, 0.538),
    "gold": (1.000, 0.782, 0.344),
    "iron": (0.562, 0.565, 0.578),
    "silver": (0.972, 0.960, 0.915),
    "titanium": (0.542, 0.497, 0.449),
}


class TestMetals:
    """The (eta, k) of a preset gives the colour of the metal, at normal incidence and at other angles."""

    @pytest.mark.parametrize(
        # The published colours are partly from other measurements. The tolerances are the differences between samples of a
        # metal.
        ("name", "within"),
        [
            ("aluminium", 0.01),
            ("brass", 0.002),
            ("copper", 0.03),
            ("gold", 0.025),
            ("silver", 0.065),
            ("chromium", 0.11),
            ("iron", 0.09),
            ("titanium", 0.1),
        ],
    )
    def test_colour_at_normal_incidence(self, name: str, within: float) -> None:
        table = preset(name)
        found = conductors.reflectance(np.array(table["eta"]), np.array(table["k"]), np.ones(3))
        assert found == pytest.approx(np.array(PUBLISHED[name]), abs=within)
        assert (found <= 1).all()

    @pytest.mark.parametrize("name", METALS)
    def test_the_model_has_the_same_fresnel(self, name: str) -> None:
        """The ambient reflectance of a metal is its reflectance at normal incidence."""
        table = preset(name)
        metal = BRDFS["metal"].model_validate(table)
        expected = conductors.reflectance(np.array(table["eta"]), np.array(table["k"]), np.ones(3))
        eta, k = np.array([metal.eta]), np.array([metal.k])
        given = type("M", (), {**{key: np.array([getattr(metal, key)]) for key in metal.parameters()}, "eta": eta, "k": k})
        assert metal.ambient_reflectance(given)[0] == pytest.approx(expected, rel=1e-9)

    @pytest.mark.parametrize(
        # Mitsuba's spectra are other measurements. The tolerances are the differences between samples of a metal.
        ("name", "symbol", "within"),
        [
            ("gold", "Au", 0.045),
            ("silver", "Ag", 0.065),
            ("copper", "Cu", 0.03),
            ("aluminium", "Al", 0.01),
            ("chromium", "Cr", 0.055),
        ],
    )
    def test_mitsubas_spectra_agree(self, name: str, symbol: str, within: float, spectra: Path) -> None:
        spectrum = conductors.from_spd(spectra, symbol)
        theirs = conductors.colour(spectrum)
        table = preset(name)
        ours = conductors.reflectance(np.array(table["eta"]), np.array(table["k"]), conductors.COS[:, None])
        assert np.abs(ours - theirs).max() < within
        fitted = conductors.fit(spectrum)
        # One (eta, k) a channel fits all angles. Gold's red is excepted, because it is outside Rec. 709.
        assert np.where(fitted.f0 > 1, 0, fitted.largest).max() < 0.012
        assert fitted.rms[fitted.f0 <= 1].max() < 0.002

    @pytest.mark.parametrize(("name", "symbol"), [("gold", "Au"), ("silver", "Ag"), ("copper", "Cu"), ("aluminium", "Al")])
    def test_mitsubas_spectra_have_the_published_colours(self, name: str, symbol: str, spectra: Path) -> None:
        """The colours before the fit agree to the published digits."""
        f0 = conductors.colour(conductors.from_spd(spectra, symbol))[0]
        assert np.minimum(f0, 1) == pytest.approx(np.array(PUBLISHED[name]), abs=1e-3)

    def test_a_white_reflector_is_white(self, spectra: Path) -> None:
        assert conductors.rgb_weights(np.arange(360.0, 831.0)).sum(0) == pytest.approx(np.ones(3), abs=1e-12)

    def test_the_fit_finds_what_it_is_given(self, spectra: Path) -> None:
        wavelength = np.array([300.0, 900.0])
        grey = conductors.Spectrum(wavelength, np.full(2, 0.7), np.full(2, 3.5))
        found = conductors.fit(grey)
        assert found.eta == pytest.approx(np.full(3, 0.7), rel=1e-6)
        assert found.k == pytest.approx(np.full(3, 3.5), rel=1e-6)
