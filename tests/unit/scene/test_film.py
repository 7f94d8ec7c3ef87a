"""Film: crops, supersampling, and view transforms to 8 bits."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from pydantic import ValidationError

from glshade import Film, GlshadeError, Image, Renderer, Scene, SceneError, explain, load, reference, verify
from glshade.image.srgb import linear_to_srgb
from glshade.image.view import displayed
from glshade.tradeoff.views import views_around
from glshade.verification.candidates import surfaces

SCENES = Path(__file__).parents[3] / "scenes"
# Windows x, y, width, height with odd and even corners, of a single pixel, at the last corner, and of the whole picture.
CROPS = [(33, 17, 30, 41), (0, 0, 3, 3), (50, 24, 1, 1), (98, 71, 5, 4), (0, 0, 103, 75)]
SIZE = (103, 75)
BALL = {"shape": "sphere", "material": {"brdf": "phong", "kd": [0.8, 0.3, 0.1], "ks": 0.6}}
GLASS = {"brdf": "lambert", "kd": [0.1, 0.4, 0.9], "alpha": 0.5, "alpha_mode": "blend"}
# Blended surfaces warn that they are only sorted by triangle.
pytestmark = pytest.mark.filterwarnings("ignore:blended surfaces")


def on(scene: Scene, **film: Any) -> Scene:
    """Returns the scene with some keys of its film replaced, which are validated like those of a file."""
    return scene.model_copy(update={"film": Film.model_validate({**scene.film.model_dump(), **film})})


def cut(pixels: Any, crop: tuple[int, int, int, int]) -> Any:
    x, y, w, h = crop
    return pixels[y : y + h, x : x + w]


def drawn(renderer: Renderer, scene: Scene, dtype: Any = "float32", **options: Any) -> Any:
    return renderer.render(scene, dtype=dtype, **options).pixels.copy()


@pytest.fixture(scope="module")
def textured() -> Scene:
    return on(load(SCENES / "spatial-variation.toml"), size=SIZE, samples=1)


@pytest.fixture(scope="module")
def layered() -> Scene:
    """An opaque and a blended object before a background with alpha."""
    objects = [BALL, {"shape": "cube", "material": GLASS, "transform": {"translate": [0.5, 0.2, 0.9], "scale": 0.6}}]
    return Scene.model_validate({"objects": objects, "film": {"size": SIZE, "background": (0.2, 0.1, 0.3, 0.5)}})


class TestFaults:
    """Films that are refused."""

    @pytest.mark.parametrize(
        ("film", "place", "message"),
        [
            (
                {"crop": [600, 0, 100, 10], "size": [640, 360]},
                ("crop",),
                "reaches to 700, 10, beyond the picture, which is 640 x 360",
            ),
            ({"crop": [0, 500, 512, 13]}, ("crop",), "reaches to 512, 513, beyond the picture, which is 512 x 512"),
            ({"crop": [np.int64(0), 500, 512, 13]}, ("crop",), "reaches to 512, 513, beyond the picture, which is 512 x 512"),
            ({"crop": [0, 0, 0, 5]}, ("crop", 2), "must be greater than or equal to 1, not 0"),
            ({"crop": [-1, 0, 1, 5]}, ("crop", 0), "must be greater than or equal to 0, not -1"),
            ({"crop": [0, 0, 1]}, ("crop", 3), "is missing: the list is too short"),
            ({"crop": "1,2"}, ("crop",), "must be a list, not '1,2'"),
            ({"supersample": 0}, ("supersample",), "must be greater than or equal to 1, not 0"),
            ({"supersample": 17}, ("supersample",), "must be less than or equal to 16, not 17"),
            ({"supersample": 1.5}, ("supersample",), "must be a whole number, not 1.5"),
            ({"ocio": "ocio://default"}, ("ocio",), "has no effect without a view or a display"),
            ({"ocio": "no.ocio", "view": "Raw"}, ("ocio",), "no.ocio does not exist"),
            ({"view": 3}, ("view",), "must be a string, not 3"),
            (
                {"view": "a", "encoding": "linear"},
                ("encoding",),
                "linear cannot be used together with a view or a display, which encode the picture",
            ),
        ],
    )
    def test_each_is_reported(self, film: dict[str, Any], place: tuple[Any, ...], message: str) -> None:
        with pytest.raises(ValidationError) as caught:
            Film.model_validate(film)
        assert [(error["loc"], error["msg"]) for error in caught.value.errors()] == [(place, message)]

    def test_a_configuration_lies_beside_the_scene(self, tmp_path: Path) -> None:
        (tmp_path / "own.ocio").write_text("")
        (tmp_path / "s.toml").write_text('[film]\nview = "x"\nocio = "own.ocio"\n[[objects]]\nshape = "cube"\n')
        film = load(tmp_path / "s.toml").film
        assert film.ocio == tmp_path / "own.ocio"
        assert Film.model_validate(film.model_dump()) == film


class TestCrop:
    """A window of a picture has exactly the values of the whole picture."""

    @pytest.mark.parametrize("samples", [1, 4])
    @pytest.mark.parametrize("dtype", ["float32", "uint8"])
    def test_the_same_bits(self, dtype: str, samples: int, renderer: Renderer, textured: Scene, layered: Scene) -> None:
        for scene in (textured, layered):
            scene = on(scene, samples=samples)
            whole = drawn(renderer, scene, dtype)
            assert len(np.unique(whole.reshape(-1, whole.shape[2]), axis=0)) > 500
            for crop in CROPS:
                assert np.array_equal(drawn(renderer, on(scene, crop=crop), dtype), cut(whole, crop)), crop
            # The windows leave neither pixels in the frame nor a scissor for later pictures.
            assert np.array_equal(drawn(renderer, scene, dtype), whole)

    @pytest.mark.parametrize("tile", [64, 20])
    @pytest.mark.parametrize("film", [{"samples": 4}, {"supersample": 2}])
    def test_the_same_bits_in_tiles(self, film: dict[str, Any], tile: int, renderer: Renderer, textured: Scene) -> None:
        scene = on(textured, **film)
        whole = drawn(renderer, scene, tile=tile)
        for crop in CROPS:
            assert np.array_equal(drawn(renderer, on(scene, crop=crop), tile=tile), cut(whole, crop)), crop

    def test_the_reference_draws_the_same(self, textured: Scene, layered: Scene) -> None:
        for scene in (textured, layered):
            whole = reference.radiance(scene)
            for crop in CROPS:
                assert np.array_equal(reference.radiance(on(scene, crop=crop)), cut(whole, crop))
                image = reference.render(on(scene, crop=crop))
                assert (image.corner, image.whole) == (crop[:2], SIZE)

    @pytest.mark.slow
    def test_it_is_verified(self, renderer: Renderer, textured: Scene, layered: Scene) -> None:
        for scene in (textured, layered):
            smooth = verify(on(scene, crop=CROPS[0], supersample=2, samples=4), renderer=renderer, max_ambiguous=1)
            assert smooth.unexplained == 0
            assert smooth.picture.shape[:2] == smooth.reference.shape[:2] == smooth.classes.shape == (41, 30)
            whole = verify(scene, renderer=renderer)
            verdict = verify(on(scene, crop=CROPS[0]), renderer=renderer, max_ambiguous=1)
            assert verdict.verdict == "verified"
            assert verdict.picture.shape[:2] == verdict.reference.shape[:2] == verdict.classes.shape == (41, 30)
            assert np.array_equal(verdict.classes, cut(whole.classes, CROPS[0]))
            assert np.array_equal(verdict.reference, cut(whole.reference, CROPS[0]))

    def test_a_fault_in_it_is_found(self, renderer: Renderer, textured: Scene) -> None:
        """The pixel is reported relative to the crop's corner."""
        scene = on(textured, crop=CROPS[0])
        picture = drawn(renderer, scene)
        middle = np.argwhere(verify(scene, picture=picture, renderer=renderer).classes == 1)
        y, x = map(int, middle[len(middle) // 2])
        picture[y, x] += 0.01
        verdict = verify(scene, picture=picture, renderer=renderer)
        assert (verdict.verdict, verdict.unexplained) == ("failed", 1)
        worst = verdict.worst_pixels[0]
        assert (worst.x, worst.y, worst.origin) == (x, y, "shading")
        assert worst.value == pytest.approx(picture[y, x])

    def test_the_surfaces_of_a_window(self, renderer: Renderer, textured: Scene) -> None:
        depth, number = renderer.surfaces(textured)
        seen, certain = surfaces(textured)
        for crop in CROPS:
            scene = on(textured, crop=crop)
            assert all(np.array_equal(a, cut(b, crop)) for a, b in zip(renderer.surfaces(scene), (depth, number), strict=True))
            assert all(np.array_equal(a, cut(b, crop)) for a, b in zip(surfaces(scene), (seen, certain), strict=True))

    def test_openexr_records_the_window(self, tmp_path: Path, renderer: Renderer, textured: Scene) -> None:
        image = renderer.render(on(textured, crop=CROPS[0]), dtype="float32")
        assert (image.corner, image.whole, image.shape) == ((33, 17), SIZE, (41, 30, 3))
        image.save(tmp_path / "x.exr")
        spec = oiio.ImageInput.open(str(tmp_path / "x.exr")).spec()
        assert (spec.x, spec.y, spec.width, spec.height) == CROPS[0]
        assert (spec.full_x, spec.full_y, spec.full_width, spec.full_height) == (0, 0, *SIZE)
        eight = image.encoded()
        assert (eight.corner, eight.linear().whole) == ((33, 17), SIZE)
        eight.save(tmp_path / "x.png")
        spec = oiio.ImageInput.open(str(tmp_path / "x.png")).spec()
        assert (spec.width, spec.height) == (30, 41)
        whole = renderer.render(textured)
        assert (whole.corner, whole.whole) == ((0, 0), None)

    def test_views_of_a_budget_are_whole(self, layered: Scene) -> None:
        for view in views_around(on(layered, crop=(0, 0, 3, 3), supersample=3), 2):
            assert (view.film.window, view.film.pictures) == ((0, 0, *view.film.size), 1)

    def test_it_is_timed(self, renderer: Renderer, textured: Scene) -> None:
        """`drawing` can draw a window too."""
        seconds = renderer.drawing(on(textured, crop=(5, 5, 20, 20), supersample=2, samples=4))
        assert seconds() > 0


class TestSupersample:
    """Supersampled pictures: the mean of pictures that are shifted within the pixel."""

    @pytest.mark.parametrize("n", [2, 3])
    def test_a_larger_picture_averaged_down(self, n: int, renderer: Renderer, layered: Scene) -> None:
        """The n x n shifted pictures look at the middles of the pixels of a picture n times as large."""
        large = drawn(renderer, on(layered, size=(SIZE[0] * n, SIZE[1] * n)))
        expected = large.reshape(SIZE[1], n, SIZE[0], n, 4).mean(axis=(1, 3), dtype=np.float64)
        pixels = drawn(renderer, on(layered, supersample=n))
        error = np.abs(pixels - expected).max(axis=2)
        # The matrices round differently in float32. Beyond that only pixels may differ whose middle lies on an edge.
        assert np.quantile(error, 0.999) < 2e-6
        assert (error > 1e-4).sum() <= 5
        assert np.abs(pixels - drawn(renderer, layered)).max() > 0.1

    @pytest.mark.parametrize("samples", [1, 4])
    def test_the_mean_of_shifted_pictures(self, samples: int, renderer: Renderer) -> None:
        """Each picture is drawn by a camera that is moved by a quarter of a pixel."""
        camera = {"type": "orthographic", "eye": [0, 0, 5], "target": [0, 0, 0], "height": 2.5, "near": 1, "far": 9}
        film = {"size": (40, 40), "samples": samples, "background": (0, 0, 0, 0)}
        base = {"objects": [BALL], "lights": [{"type": "point", "position": [2, 3, 4]}], "film": film}
        pixel = 2.5 / 40
        pictures = []
        for x in (-0.25, 0.25):
            for y in (-0.25, 0.25):
                moved = {"eye": [x * pixel, -y * pixel, 5], "target": [x * pixel, -y * pixel, 0]}
                # The shading does not depend on the position of an orthographic viewer.
                pictures.append(drawn(renderer, Scene.model_validate({**base, "camera": {**camera, **moved}})))
        scene = Scene.model_validate({**base, "camera": camera})
        pixels = drawn(renderer, on(scene, supersample=2))
        error = np.abs(pixels - np.mean(pictures, axis=0, dtype=np.float64)).max(axis=2)
        assert np.quantile(error, 0.98) < 2e-6
        assert np.abs(np.std(pictures, axis=0)).max() > 0.05

    def test_8_bits_are_those_of_the_mean_of_light(self, renderer: Renderer, layered: Scene) -> None:
        scene = on(layered, supersample=2)
        image = renderer.render(scene, dtype="float32").encoded()
        expected = image.pixels.copy()
        assert np.array_equal(drawn(renderer, scene, "uint8"), expected)
        assert {p.encoding for p in explain(scene).programs} == {"linear"}

    def test_alpha_is_averaged_with_its_colour(self, renderer: Renderer) -> None:
        """A white ball before a transparent background: premultiplied colour and alpha are both the covered share of the pixel,
        and the straight colour stays white."""
        white = {"shape": "sphere", "material": {"brdf": "lambert", "kd": 1}}
        film = {"size": (20, 20), "supersample": 4, "background": (0, 0, 0, 0)}
        scene = Scene.model_validate({"objects": [white], "lights": [{"type": "ambient"}], "film": film})
        pixels = drawn(renderer, scene)
        assert pixels[..., 0] == pytest.approx(pixels[..., 3], abs=1e-6)
        shares = np.unique(np.round(pixels[..., 3] * 16, 4))
        assert np.array_equal(shares, np.round(shares))
        assert len(shares) > 5
        eight = drawn(renderer, scene, "uint8")
        assert (eight[..., :3][eight[..., 3] > 0] == 255).all()


CONFIG = """ocio_profile_version: 2
roles: {{default: raw, scene_linear: {linear}}}
file_rules: [!<Rule> {{name: Default, colorspace: raw}}]
displays:
  screen: [!<View> {{name: doubled, colorspace: twice}}, !<View> {{name: plain, colorspace: {linear}}}]
colorspaces:
  - !<ColorSpace> {{name: raw, isdata: true}}
  - !<ColorSpace> {{name: {linear}}}
  - !<ColorSpace> {{name: twice, from_scene_reference: !<MatrixTransform> {{matrix: [2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,0,1]}}}}
"""


def shown(image: Image, film: Film) -> Image:
    """Returns the 8-bit picture that the film's view transform makes of a linear one."""
    return displayed(image, film.encoding, ocio=film.ocio, display=film.display, view=film.view)


class TestViewTransform:
    """View transforms of OpenColorIO, which turn linear pictures into 8-bit pictures."""

    @pytest.fixture(autouse=True)
    def without_ocio_variable(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("OCIO", raising=False)

    @pytest.fixture
    def config(self, tmp_path: Path) -> str:
        (tmp_path / "own.ocio").write_text(CONFIG.format(linear="lin_rec709"))
        return str(tmp_path / "own.ocio")

    def test_srgb_without_tone_mapping_is_ours(self, renderer: Renderer, layered: Scene) -> None:
        """OpenColorIO's sRGB differs from ours by at most one code. The role scene_linear is ACEScg in this configuration: if
        our colours were taken for that, they would be 20 codes off."""
        scene = on(layered, view="Un-tone-mapped", display="sRGB - Display")
        image = renderer.render(scene)
        assert (image.encoding, image.channels) == ("srgb", "RGBA")
        ours = drawn(renderer, layered, "uint8").astype(int)
        assert np.abs(image.pixels.astype(int) - ours).max() <= 1
        assert image.pixels[..., 3].min() == 128
        assert len(np.unique(image.pixels)) > 100

    def test_exposure_comes_first_and_float_stays_linear(self, renderer: Renderer, layered: Scene) -> None:
        view = {"view": "Un-tone-mapped"}
        brighter = drawn(renderer, on(layered, exposure=2), "uint8").astype(int)
        assert np.abs(drawn(renderer, on(layered, exposure=2, **view), "uint8").astype(int) - brighter).max() <= 1
        assert np.array_equal(drawn(renderer, on(layered, **view)), drawn(renderer, layered))

    def test_the_default_view_rolls_off(self, renderer: Renderer) -> None:
        """Highlights of 3 and 12, which sRGB clips to white, have different codes in the default view."""
        ramp = np.repeat(np.float32([0.18, 1, 3, 12])[None, :, None], 3, axis=2)
        film = Film(display="sRGB - Display")
        pixels = shown(Image(ramp), film).pixels[0, :, 0]
        assert np.all(np.diff(pixels.astype(int)) > 3)
        assert shown(Image(ramp), Film()).pixels[0, :, 0].tolist() == [118, 255, 255, 255]

    def test_another_configuration(
        self, config: str, tmp_path: Path, renderer: Renderer, layered: Scene, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Colours are doubled before alpha multiplies them. The background has the colour 0.2 0.1 0.3 and alpha 0.5."""
        scene = on(layered, ocio=config, view="doubled")
        image = renderer.render(scene)
        assert image.encoding == "unknown"
        assert image.pixels[0, 0].tolist() == [102, 51, 153, 128]
        first = image.pixels.copy()
        assert np.array_equal(drawn(renderer, on(scene, crop=CROPS[0]), "uint8"), cut(first, CROPS[0]))
        monkeypatch.setenv("OCIO", config)
        assert np.array_equal(drawn(renderer, on(layered, display="screen"), "uint8"), first)
        image.save(tmp_path / "x.png")
        assert b"sRGB" not in chunks(tmp_path / "x.png")
        with pytest.raises(GlshadeError, match="does not become linear again: render with dtype='float32'"):
            image.save(tmp_path / "x.exr")

    def test_files_say_which_display_they_are_for(self, tmp_path: Path) -> None:
        linear = Image(np.full((2, 2, 3), 0.5, dtype=np.float32))
        files = {}
        for display in ("sRGB - Display", "Display P3 - Display", "Gamma 2.2 Rec.709 - Display"):
            shown(linear, Film(display=display)).save(tmp_path / "x.png")
            files[display] = chunks(tmp_path / "x.png")
        assert b"sRGB" in files["sRGB - Display"]
        assert b"cICP" not in files["sRGB - Display"]
        # ITU-T H.273: 12 stands for the primaries of P3 with white D65, 13 for the transfer curve of sRGB.
        assert files["Display P3 - Display"][b"cICP"][:2] == bytes([12, 13])
        assert not {b"sRGB", b"cICP"} & set(files["Gamma 2.2 Rec.709 - Display"])

    @pytest.mark.parametrize(
        ("film", "message"),
        [
            (
                {"view": "Un-tone-maped"},
                'film.view: "sRGB - Display" of ocio://default has no view "Un-tone-maped"; did you mean "Un-tone-mapped"?',
            ),
            (
                {"view": "x"},
                'film.view: "sRGB - Display" of ocio://default has no view "x"; allowed: ACES 2.0 - SDR 100 nits '
                "(Rec.709), Raw, Un-tone-mapped, Video (colorimetric)",
            ),
            ({"display": "sRGB Display"}, 'film.display: ocio://default has no display "sRGB Display"; did you mean "sRGB'),
            ({"view": "x", "ocio": "ocio://none"}, "film.ocio: ocio://none: Error reading OCIO config"),
        ],
    )
    def test_unknown_views_and_displays(self, film: dict[str, Any], message: str, renderer: Renderer, layered: Scene) -> None:
        with pytest.raises(SceneError) as caught:
            renderer.render(on(layered, **film))
        assert str(caught.value).startswith(message)
        assert "\n" not in str(caught.value)

    def test_configurations_that_cannot_be_used(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        picture = Image(np.ones((1, 1, 3), dtype=np.float32))
        (tmp_path / "other.ocio").write_text(CONFIG.format(linear="lin_mine"))
        (tmp_path / "broken.ocio").write_text("hello: [")
        (tmp_path / "empty.ocio").write_text("ocio_profile_version: 2\nroles: {default: raw}\n")
        for name, message in (
            ("other", "has no colour space for linear Rec. 709"),
            ("broken", "Error reading OCIO config"),
            ("empty", "is no OpenColorIO configuration with displays"),
        ):
            with pytest.raises(SceneError, match=message) as caught:
                shown(picture, Film(view="doubled", ocio=tmp_path / f"{name}.ocio"))
            assert str(caught.value).startswith(f"film.ocio: {tmp_path / name}.ocio")
        monkeypatch.setenv("OCIO", str(tmp_path / "gone.ocio"))
        with pytest.raises(SceneError, match=r"^\$OCIO: .*gone.ocio"):
            shown(picture, Film(view="doubled"))

    def test_a_scene_without_a_view_does_not_load_opencolorio(self, python: Any) -> None:
        code = """
import sys, glshade
glshade.render(glshade.Scene(objects=[glshade.Object(shape="cube")], film=glshade.Film(size=(4, 4))))
print(*(name for name in ("glshade.image.view", "OpenImageIO") if name in sys.modules))
"""
        assert python(code) == ""


def chunks(path: Path) -> dict[bytes, bytes]:
    """Returns the chunks of a PNG file: name -> content."""
    data, start, contents = path.read_bytes(), 8, {}
    while start < len(data):
        (length,) = struct.unpack(">I", data[start : start + 4])
        contents[data[start + 4 : start + 8]] = data[start + 8 : start + 8 + length]
        start += 12 + length
    return contents


def test_sixteen_squared_pictures_stay_finite_and_exact(renderer: Renderer) -> None:
    """The mean of 256 equal numbers is that number."""
    film = {"size": (3, 3), "supersample": 16, "background": (0.1, 1.7, 0.3)}
    scene = Scene.model_validate(
        {"objects": [{**BALL, "transform": {"scale": 1e-3}}], "camera": {"eye": [0, 0, 9]}, "film": film}
    )
    pixels = drawn(renderer, scene)
    assert pixels[0, 0] == pytest.approx([0.1, 1.7, 0.3], rel=1e-6)
    assert drawn(renderer, scene, "uint8")[0, 0] == pytest.approx(linear_to_srgb(np.array([0.1, 1.7, 0.3])) * 255, abs=0.5)
