"""Images: encodings, files that appear whole or not at all, and what comes back from them."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.disk import NoDisk, small_disk

from glshade import AssetError, GlshadeError, Image
from glshade.image.file import SUFFIXES, attributes, read
from glshade.image.srgb import linear_to_srgb, srgb_to_linear

RAMP = np.linspace(0, 1, 48, dtype=np.float32).reshape(4, 4, 3)


def test_srgb_is_iec_61966() -> None:
    # 0.2140 is the linear value of the middle code, 0.5.
    assert linear_to_srgb(np.array([0.0, 0.0031308, 0.21404114, 1.0])) == pytest.approx([0, 0.04045, 0.5, 1], abs=2e-6)
    assert linear_to_srgb(np.array([-1.0, 2.0])) == pytest.approx([0, 1])


@given(st.floats(0, 1, width=32))
def test_encoding_and_decoding_are_inverse(c: float) -> None:
    assert float(linear_to_srgb(srgb_to_linear(np.array(c)))) == pytest.approx(c, abs=1e-6)


def test_every_code_survives() -> None:
    codes = np.arange(256, dtype=np.uint8).reshape(16, 16, 1).repeat(3, axis=2)
    for encoding in ("srgb", "linear"):
        assert np.array_equal(Image(codes, encoding).linear().encoded(encoding).pixels, codes)  # type: ignore[arg-type]


def test_what_is_out_of_range_is_clipped_not_wrapped() -> None:
    pixels = np.float32([[[-1, 2, 1e30], [0.5, 1, 1.001]]])
    assert Image(pixels).encoded().pixels.tolist() == [[[0, 255, 255], [188, 255, 255]]]
    assert Image(pixels).encoded("linear").pixels.tolist() == [[[0, 255, 255], [128, 255, 255]]]


def test_alpha_is_straight_in_8_bits_and_premultiplied_in_float() -> None:
    pixels = np.float32([[[0.25, 0, 0, 0.5], [0, 0, 0, 0], [0.5, 0.5, 0.5, 1]]])
    encoded = Image(pixels).encoded()
    assert encoded.pixels.tolist() == [[[188, 0, 0, 128], [0, 0, 0, 0], [188, 188, 188, 255]]]
    assert encoded.linear().pixels == pytest.approx(pixels, abs=4e-3)


def test_an_image_is_an_array() -> None:
    image = Image(RAMP)
    assert np.asarray(image) is not None
    assert np.array_equal(np.asarray(image), RAMP)
    assert np.array(image, dtype=np.float64).dtype == np.float64
    assert image.shape == (4, 4, 3)
    assert (image.channels, image.colour_space) == ("RGB", "linear Rec. 709")
    assert Image(RAMP[..., [0, 1, 2, 2]]).channels == "RGBA"
    assert repr(image.encoded()) == "<Image 4x4 RGB uint8, sRGB-encoded>"


def test_a_notebook_shows_it(tmp_path: Path) -> None:
    png = Image(RAMP)._repr_png_()
    assert png.startswith(b"\x89PNG")
    (tmp_path / "x.png").write_bytes(png)
    assert read(tmp_path / "x.png")[0][..., :3] == pytest.approx(RAMP, abs=5e-3)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("suffix", [".exr", ".png", ".tif", ".tiff"])
def test_what_is_written_is_read(suffix: str, channels: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    pixels = rng.random((5, 7, channels)).astype(np.float32)
    if channels == 4:
        pixels[..., 3] = pixels[..., 3] * 0.5 + 0.5
        pixels[..., :3] *= pixels[..., 3:]
    Image(pixels).save(tmp_path / f"x{suffix}")
    back, has_alpha = read(tmp_path / f"x{suffix}")
    assert has_alpha is (channels == 4)
    straight = pixels[..., :3] / (pixels[..., 3:] if channels == 4 else 1)
    # Half a code, where the sRGB curve is steepest in linear light (2.27 at 1).
    tolerance = 1e-6 if suffix == ".exr" else 0.5 / 255 * 2.3
    assert back[..., :3] == pytest.approx(straight, abs=tolerance)
    assert back[..., 3] == pytest.approx(pixels[..., 3] if channels == 4 else np.ones((5, 7)), abs=0 if channels == 3 else 2e-3)


def test_exr_keeps_every_bit_and_the_attributes(tmp_path: Path) -> None:
    pixels = np.float32([[[-1.5, 1e-30, 1e30], [0.1, 1 / 3, 7]]])
    Image(pixels, attributes={"glshade:camera": '{"fov":40}', "note": "ä"}).save(tmp_path / "x.exr")
    source = oiio.ImageInput.open(str(tmp_path / "x.exr"))
    assert np.array_equal(source.read_image(oiio.FLOAT), pixels)
    assert source.spec().get_string_attribute("glshade:camera") == '{"fov":40}'
    assert source.spec().get_string_attribute("note") == "ä"
    source.close()


@pytest.mark.parametrize("suffix", sorted(SUFFIXES - {".hdr"}))
def test_a_file_says_what_it_was_told(suffix: str, tmp_path: Path) -> None:
    told = {"glshade:digest": "0123abcd", "note": 'ä "quoted"'}
    Image(RAMP, attributes=told).save(tmp_path / f"x{suffix}")
    assert attributes(tmp_path / f"x{suffix}").items() >= told.items()


def test_what_is_no_picture_says_nothing(tmp_path: Path) -> None:
    (tmp_path / "x.png").write_bytes(b"no picture")
    assert attributes(tmp_path / "x.png") == attributes(tmp_path / "y.png") == attributes(tmp_path) == {}


def test_8_bits_in_a_float_file_are_decoded_with_a_word(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="render with dtype='float32'"):
        Image(np.full((1, 1, 3), 188, dtype=np.uint8), "srgb").save(tmp_path / "x.exr")
    assert read(tmp_path / "x.exr")[0][0, 0, 0] == pytest.approx(0.5, abs=3e-3)


def test_the_same_picture_is_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        for suffix in SUFFIXES:
            Image(RAMP).save(tmp_path / f"{name}{suffix}")
        # Nor does the time of day make a difference, which files have to the second.
        time.sleep(1.1)
    for suffix in SUFFIXES:
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes(), suffix


def test_capitals_are_an_extension_too(tmp_path: Path) -> None:
    Image(RAMP).save(str(tmp_path / "X.PNG"))
    assert os.listdir(tmp_path) == ["X.PNG"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("x.gif", "cannot write .gif; allowed: .exr"),
        ("x", "cannot write a file without extension"),
        ("no/x.png", "does not exist; make it first"),
        ("folder.png", "cannot be written: Is a directory"),
        ("file/x.png", "does not exist; make it first"),
    ],
)
def test_what_cannot_be_written(name: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(GlshadeError) as caught:
        Image(RAMP).save(tmp_path / name)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(tmp_path / name) in str(caught.value)
    assert sorted(os.listdir(tmp_path)) == ["file", "folder.png"]
    assert os.listdir(tmp_path / "folder.png") == []


FULL = """
import os, resource, signal, sys
import numpy as np
from glshade import GlshadeError, Image
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
image = Image(np.random.default_rng(0).random((64, 64, 3)).astype(np.float32))
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    image.save(sys.argv[1])
except GlshadeError as error:
    assert str(error).startswith(f"{sys.argv[1]}: cannot be written: "), error
    assert "\\n" not in str(error)
    print("refused")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a limit on the size of files")
@pytest.mark.parametrize("suffix", sorted(SUFFIXES - {".jpg", ".jpeg"}))
def test_a_full_disk_leaves_the_old_file(suffix: str, tmp_path: Path, python: Any) -> None:
    (tmp_path / f"x{suffix}").write_text("old")
    assert python(FULL, f"x{suffix}", cwd=tmp_path) == "refused"
    assert (tmp_path / f"x{suffix}").read_text() == "old"
    assert os.listdir(tmp_path) == [f"x{suffix}"]


@pytest.mark.parametrize("suffix", sorted(SUFFIXES))
def test_a_disk_without_room_leaves_the_old_file(suffix: str, tmp_path: Path) -> None:
    """In the test above the limit also holds for files in memory, where libjpeg would end the process."""
    image = Image(np.random.default_rng(0).random((64, 64, 3)).astype(np.float32))
    try:
        with small_disk(tmp_path / "disk", 1 << 13) as disk:
            path = disk / f"x{suffix}"
            path.write_text("old")
            with pytest.raises(GlshadeError) as caught:
                image.save(path)
            assert str(caught.value) == f"{path}: cannot be written: No space left on device"
            assert path.read_text() == "old"
            assert os.listdir(disk) == [path.name]
    except NoDisk as error:
        pytest.skip(str(error))


def test_a_picture_without_a_folder_of_open_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Image(RAMP).save(tmp_path / "x.png")
    monkeypatch.setattr("glshade.image.openimageio.OPEN_FILES", "/nonexistent")
    Image(RAMP).save(tmp_path / "y.png")
    assert (tmp_path / "x.png").read_bytes() == (tmp_path / "y.png").read_bytes()


def test_an_interrupted_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Image(RAMP).save(tmp_path / "x.png")
    assert os.listdir(tmp_path) == []


class TestRead:
    """Pictures as textures."""

    def test_grey_and_grey_with_alpha(self, tmp_path: Path) -> None:
        for channels in (1, 2):
            output = oiio.ImageOutput.create(str(tmp_path / "g.png"))
            spec = oiio.ImageSpec(2, 1, channels, "uint8")
            spec.attribute("oiio:UnassociatedAlpha", 1)
            if channels == 2:
                spec.alpha_channel = 1
            output.open(str(tmp_path / "g.png"), spec)
            output.write_image(np.uint8([[[188, 128][:channels], [255, 0][:channels]]]))
            output.close()
            pixels, has_alpha = read(tmp_path / "g.png")
            assert has_alpha is (channels == 2)
            assert pixels[0, 0] == pytest.approx([0.5, 0.5, 0.5, 128 / 255 if channels == 2 else 1], abs=3e-3)
            # Straight alpha: colours survive where it is 0.
            assert pixels[0, 1] == pytest.approx([1, 1, 1, 0 if channels == 2 else 1])

    def test_encodings(self, tmp_path: Path) -> None:
        Image(np.full((1, 1, 3), 188, dtype=np.uint8), "srgb").save(tmp_path / "x.png")
        Image(np.full((1, 1, 3), 0.25, dtype=np.float32)).save(tmp_path / "x.exr")
        assert read(tmp_path / "x.png", "auto")[0][0, 0, 0] == pytest.approx(0.5, abs=3e-3)
        assert read(tmp_path / "x.png", "srgb")[0][0, 0, 0] == pytest.approx(0.5, abs=3e-3)
        assert read(tmp_path / "x.png", "linear")[0][0, 0, 0] == pytest.approx(188 / 255)
        assert read(tmp_path / "x.exr", "auto")[0][0, 0, 0] == 0.25
        assert read(tmp_path / "x.exr", "linear")[0][0, 0, 0] == 0.25

    @pytest.mark.parametrize("content", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n"])
    @pytest.mark.parametrize("suffix", [".png", ".exr", ".jpg", ".xyz"])
    def test_what_is_no_picture(self, suffix: str, content: bytes, tmp_path: Path) -> None:
        path = tmp_path / f"x{suffix}"
        path.write_bytes(content)
        with pytest.raises(AssetError) as caught:
            read(path)
        assert str(caught.value).startswith(f"{path}: cannot be read as a picture: ")
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize("suffix", [".png", ".exr", ".jpg", ".tif"])
    def test_half_a_picture(self, suffix: str, tmp_path: Path) -> None:
        path = tmp_path / f"x{suffix}"
        Image(np.random.default_rng(0).random((64, 64, 3)).astype(np.float32)).save(path)
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(AssetError, match="cannot be read as a picture") as caught:
            read(path)
        assert "\n" not in str(caught.value)

    def test_no_file(self, tmp_path: Path) -> None:
        with pytest.raises(AssetError, match="cannot be read as a picture"):
            read(tmp_path / "no.png")
