"""Pictures of scenes with spectra: drawn, verified, and stored by wavelength."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from glshade import Renderer
from glshade.errors import SceneError
from glshade.gl.preparation import ApproximateWarning
from glshade.glsl.generator import generate
from glshade.glsl.planner import explain
from glshade.scene.camera import Perspective
from glshade.scene.file import load
from glshade.scene.scene import Scene
from glshade.verification.judgement import PixelClass
from glshade.verification.laws import check_laws
from glshade.verification.trials import try_mutations
from glshade.verification.verification import verify

SCENES = Path(__file__).resolve().parents[2] / "scenes"
ASSETS = SCENES / "assets"
METAL = {
    "brdf": "metal",
    "eta": {"spectrum": [[300, 1.8], [450, 1.5], [520, 0.6], [600, 0.2], [880, 0.2]]},
    "k": {"spectrum": [[300, 1.9], [450, 1.9], [520, 2.2], [600, 3.0], [880, 5.4]]},
    "roughness": 0.5,
}
PAPER = {"brdf": "phong", "kd": {"spectrum": ASSETS / "paper.spd", "scale": 0.9}, "reradiation": ASSETS / "brightener.csv"}
LIGHTS = [
    {"type": "directional", "name": "lamp", "direction": (-1, -1, -2), "colour": {"spectrum": "A"}},
    {"type": "point", "name": "tube", "position": (2, 2, 2), "colour": {"spectrum": "F11"}},
    {"type": "directional", "name": "uv", "direction": (1, -1, -2), "colour": {"spectrum": ASSETS / "ultraviolet.spd"}},
    {"type": "ambient", "name": "sky", "intensity": 0.2},
]


def scene(*materials: Any, lights: Any = LIGHTS, **film: Any) -> Scene:
    return Scene.model_validate(
        {
            "film": {"size": (24, 16), **film},
            "camera": {"eye": (0, 0, 4), "target": (0, 0, 0)},
            "objects": [
                {
                    "shape": {"type": "sphere", "segments": 16, "rings": 8},
                    "material": material,
                    "transform": {"translate": (2.1 * number - 1.05 * (len(materials) - 1), 0, 0)},
                }
                for number, material in enumerate(materials)
            ],
            "lights": lights,
        }
    )


@pytest.mark.parametrize("seen_from", [(-4.0, 0.3, 1.5), (4.0, 0.3, 1.5)], ids=["opaque behind", "opaque in front"])
def test_blended_surfaces_show_every_spectrum(seen_from: Any, renderer: Renderer) -> None:
    """Each triangle gets the light of all lamps and bands before the next one is blended over it."""
    blended = {"alpha": 0.6, "alpha_mode": "blend", "sides": "both"}
    given = scene({**METAL, **blended}, METAL, {**PAPER, **blended}, bands=6)
    given = given.model_copy(update={"camera": Perspective(eye=seen_from, target=(0, 0, 0))})
    with pytest.warns(ApproximateWarning):
        verdict = verify(given, renderer=renderer, max_ambiguous=1.0)
    assert not verdict.comparison.unexplained
    assert (verdict.classes == PixelClass.INTERIOR).sum() > 20


@pytest.mark.slow
@pytest.mark.parametrize("rate", ["flat", "gouraud", "phong"])
def test_pictures_with_spectra_are_verified(rate: Any, renderer: Renderer) -> None:
    # In such a small picture, edges are a large share of the pixels.
    verdict = verify(scene(METAL, PAPER, bands=6), shading=rate, renderer=renderer, max_ambiguous=1.0)
    assert verdict.words == "verified"
    assert verdict.unexplained == 0


def test_the_layers_of_the_lights_add_up_to_the_picture(renderer: Renderer) -> None:
    found = scene(METAL, PAPER, bands=3, aovs=["lights"])
    layers = renderer.layers(found)
    lights = [layers.arrays[f"light_{light['name']}"] for light in LIGHTS]
    np.testing.assert_allclose(sum(lights), layers.image.pixels, atol=2e-5)
    assert all(light.max() > 1e-3 for light in lights)


def test_one_spectrum_of_light_changes_only_numbers(renderer: Renderer) -> None:
    """The program of a paint with a spectrum is that of an RGB paint, and so are its costs."""
    lamp = [{"type": "directional", "colour": {"spectrum": "A"}}]
    rgb = [{"type": "directional", "colour": (1, 0.5, 0.2)}]
    plans = [
        explain(scene({"brdf": "phong", "kd": kd}, lights=lights)).programs
        for kd, lights in (({"spectrum": ASSETS / "paper.spd"}, lamp), ((0.8, 0.7, 0.6), rgb))
    ]
    assert plans[0] == plans[1]
    assert "bands" not in "".join(stage.text for plan in plans[0] for stage in generate(plan).stages)
    renderer.render(scene({"brdf": "phong", "kd": {"spectrum": ASSETS / "paper.spd"}}, lights=lamp))
    assert renderer.last_prepared is not None
    assert len(renderer.last_prepared.calls) == 1


def test_other_cameras_draw_the_same_as_a_new_renderer(renderer: Renderer) -> None:
    found = scene(METAL, PAPER, bands=3)
    cameras = [found.camera.model_copy(update={"eye": eye}) for eye in ((1, 1, 4), (-2, 0, 3))]
    renderer.render(found)
    pictures = renderer.render_many(found, cameras)
    with Renderer() as other:
        for camera, picture in zip(cameras, pictures, strict=True):
            np.testing.assert_array_equal(picture, other.render(found.through(camera)).pixels)


def test_formats_without_negative_numbers_are_refused_for_bands(renderer: Renderer) -> None:
    small = scene(METAL, lights=LIGHTS[3:])
    with pytest.raises(SceneError, match="has nothing below zero, which bands of wavelengths need"):
        renderer.render(small.model_copy(update={"quality": small.quality.model_copy(update={"storage": "r11f_g11f_b10f"})}))


@pytest.mark.slow
def test_laws_hold_with_spectra(renderer: Renderer) -> None:
    names = ["swept", "exposed", "textured", "lights-split"]
    found = list(check_laws(scene(METAL, {**PAPER, "emission": {"blackbody": 1500}}, bands=3), names, renderer=renderer))
    assert {finding.law for finding in found} == set(names)
    assert {finding.outcome for finding in found} == {"holds"}


@pytest.mark.parametrize("name", ["bands-reversed", "bands-transposed"])
def test_faults_of_the_bands_are_caught(name: str, renderer: Renderer) -> None:
    (outcome,) = try_mutations(scene(METAL, lights=LIGHTS[:1], bands=3), [name], renderer=renderer)
    assert outcome.verdict is not None
    assert outcome.verdict.unexplained > 0


def test_a_spectral_file_has_a_channel_for_each_band(tmp_path: Path, renderer: Renderer) -> None:
    """The names and attributes are those of Fichet, Pacanowski and Wilkie 2021."""
    found = scene(PAPER, METAL, bands=3, aovs=["spectrum"])
    layers = renderer.layers(found, dtype="float32")
    layers.save(tmp_path / "picture.exr")
    file = oiio.ImageInput.open(str(tmp_path / "picture.exr"))
    spec = file.spec()
    names = [name for name in spec.channelnames if name.startswith("S0.")]
    middles = [380 + 400 / 3 * (number + 0.5) for number in range(3)]
    assert sorted(names) == [f"S0.{middle:.6f}nm".replace(".", ",").replace("S0,", "S0.") for middle in middles]
    assert spec.getattribute("spectralLayoutVersion") == "1.0"
    pixels = file.read_image(oiio.FLOAT)
    np.testing.assert_array_equal(pixels[..., spec.channelindex(names[0])], layers.arrays[names[0]][..., 0])
    assert all(layers.arrays[name].max() > 0 for name in names)
    file.close()


def sphere(picture: Any, number: int) -> np.ndarray:
    """Returns the mean colour (3,) of a small part of one of the four spheres of a shipped scene."""
    height, width = picture.pixels.shape[:2]
    x = int(width * (0.1406, 0.3698, 0.6302, 0.8594)[number])
    return picture.pixels[height // 2 - 3 : height // 2 + 3, x - 3 : x + 3, :3].mean(axis=(0, 1))


def test_metamers_are_alike_by_day_and_apart_under_a_tube(renderer: Renderer) -> None:
    found = load(SCENES / "metamers.toml", [("film.size", "[240, 75]"), ("film.samples", "1")])
    picture = renderer.render(found, dtype="float32")
    day, tube = (np.abs(sphere(picture, a) - sphere(picture, a + 1)).max() for a in (0, 2))
    assert day < 1e-3
    assert tube > 0.05


def test_a_brightener_glows_in_ultraviolet_light(renderer: Renderer) -> None:
    found = load(SCENES / "fluorescence.toml", [("film.size", "[240, 75]"), ("film.samples", "1")])
    picture = renderer.render(found, dtype="float32")
    plain, bright, dark, glowing = (sphere(picture, number) for number in range(4))
    assert bright[2] > plain[2] + 0.05
    # The plain paper shows the light of the room alone.
    assert dark.max() < 0.05
    assert glowing[2] > 0.2
