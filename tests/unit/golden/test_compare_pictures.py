"""Files and folders: what is read, what counts as a difference besides the pixels, and pairs with known verdicts."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from glshade.errors import GlshadeError
from glshade.golden.judge import compare_files, compare_folders
from glshade.golden.result import Outcome, Result
from glshade.golden.rules import RULES
from glshade.image import file as picture_file
from glshade.image.contents import PictureContents

PAIRS = Path(__file__).resolve().parents[4] / "shared" / "data" / "pairs"
# A file name of a byte that no UTF-8 text has, as Python represents it.
NOT_UTF8 = os.fsdecode(b"\xff.png")
RANDOM = np.random.default_rng(1).random((12, 16, 4), dtype=np.float32)
EXR = PictureContents(RANDOM, "linear", premultiplied=True)
PNG = PictureContents((RANDOM[..., :3] * 255).astype(np.uint8), "srgb", premultiplied=False)


def written(path: Path, contents: PictureContents = PNG, **changes: Any) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    picture_file.write(path, replace(contents, **changes))
    return path


def compare(reference: Path, test: Path, rule: str = "codes") -> Result:
    return compare_files(reference, test, RULES[rule]())


def test_the_same_bytes_are_the_same_without_decoding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = (written(tmp_path / name) for name in ("a.png", "b.png"))
    monkeypatch.setattr(picture_file, "read_part", None)
    result = compare(a, b)
    assert (result.name, result.outcome, result.reason, result.layers) == (str(b), Outcome.SAME, "", ())


def test_the_same_pixels_in_other_bytes_are_the_same(tmp_path: Path) -> None:
    a, b = written(tmp_path / "a.png"), written(tmp_path / "b.png", attributes={"camera": "1"})
    assert a.read_bytes() != b.read_bytes()
    assert compare(a, b, "exact").outcome is Outcome.SAME


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("rule", sorted(RULES))
def test_a_value_that_is_not_finite_fails(value: float, rule: str, tmp_path: Path) -> None:
    pixels = RANDOM.copy()
    pixels[3, 4, 1] = value
    a, b = written(tmp_path / "a.exr", EXR), written(tmp_path / "b.exr", EXR, pixels=pixels)
    for reference, test in ((a, b), (b, a), (b, b)):
        result = compare(reference, test, rule)
        assert (result.outcome, result.reason) == (Outcome.FAIL, "a value is infinite or NaN")


@pytest.mark.parametrize("format_of", [".png", ".exr"])
def test_sizes(format_of: str, tmp_path: Path) -> None:
    contents = EXR if format_of == ".exr" else PNG
    a = written(tmp_path / f"a{format_of}", contents)
    b = written(tmp_path / f"b{format_of}", contents, pixels=contents.pixels[:10])
    result = compare(a, b)
    assert (result.outcome, result.reason) == (Outcome.SIZES, "the sizes are 16x12 and 16x10 pixels")


def test_a_missing_or_added_channel_fails(tmp_path: Path) -> None:
    a, b = written(tmp_path / "a.exr", EXR), written(tmp_path / "b.exr", EXR, pixels=RANDOM[..., :3])
    assert compare(a, b).reason == "the test picture lacks A (channels)"
    assert compare(b, a).reason == "the test picture adds A (channels)"
    assert compare(a, b).outcome is compare(b, a).outcome is Outcome.FAIL


def test_channels_in_another_order_are_the_same(tmp_path: Path) -> None:
    a = written(tmp_path / "a.tif", EXR, channels=("R", "G", "B", "A"))
    b = written(tmp_path / "b.exr", EXR, pixels=RANDOM[..., ::-1], channels=("A", "B", "G", "R"))
    assert compare(a, b, "exact").outcome is Outcome.SAME


def test_layers_are_judged_one_by_one(tmp_path: Path) -> None:
    channels = ("R", "G", "B", "depth.Z")
    a = written(tmp_path / "a.exr", EXR, channels=channels)
    pixels = RANDOM.copy()
    pixels[..., 3] += 0.1
    b = written(tmp_path / "b.exr", EXR, channels=channels, pixels=pixels)
    result = compare(a, b, "exact")
    assert result.reason == "layer depth: 192 of 192 pixels differ"
    assert [(layer.name, layer.finding.outcome) for layer in result.layers] == [("", Outcome.SAME), ("depth", Outcome.FAIL)]
    c = written(tmp_path / "c.exr", EXR, channels=("R", "G", "B", "depth.D"))
    assert compare(a, c).reason == "the test picture lacks depth.Z and adds depth.D (channels)"


def write_parts(path: Path, **parts: float) -> Path:
    """Writes an OpenEXR file with several parts, each of one value."""
    specs = []
    for name in parts:
        spec = oiio.ImageSpec(4, 4, 1, "float")
        spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), tuple(specs))
    for index, (spec, value) in enumerate(zip(specs, parts.values(), strict=True)):
        assert index == 0 or output.open(str(path), spec, "AppendSubimage")
        assert output.write_image(np.full((4, 4, 1), value, dtype=np.float32))
    output.close()
    return path


def test_parts_are_compared_too(tmp_path: Path) -> None:
    a = write_parts(tmp_path / "a.exr", beauty=0.5, normal=0.5)
    b = write_parts(tmp_path / "b.exr", beauty=0.5, normal=0.6)
    c = write_parts(tmp_path / "c.exr", beauty=0.5)
    assert compare(a, b).outcome is Outcome.FAIL
    assert compare(a, b).reason.startswith("layer normal: ")
    result = compare(a, c)
    assert result.outcome is Outcome.FAIL
    assert result.reason == "the parts of the file are beauty, normal; in the test picture, they are beauty"


def test_data_window_and_orientation_count(tmp_path: Path) -> None:
    a, b = (
        written(tmp_path / name, EXR, corner=corner, whole=(40, 40)) for name, corner in (("a.exr", (1, 2)), ("b.exr", (2, 2)))
    )
    assert compare(a, b).outcome is Outcome.FAIL
    assert "data windows" in compare(a, b).reason
    c = written(tmp_path / "c.tif")
    picture = oiio.ImageBuf(str(c))
    picture.specmod().attribute("Orientation", 3)
    assert picture.write(str(tmp_path / "d.tif"))
    assert compare(c, tmp_path / "d.tif").reason == "the orientations are 1 and 3 (Exif's numbers)"


def bad_files(folder: Path) -> dict[str, str]:
    """Writes files that cannot be compared, and returns their names with a part of the message of each."""
    good = written(folder / "good.png").read_bytes()
    (folder / NOT_UTF8).write_bytes(good)
    (folder / "cut.png").write_bytes(good[: len(good) // 2])
    (folder / "empty.png").write_bytes(b"")
    (folder / "text.png").write_text("no picture")
    (folder / "page.html").write_text("<p>no picture</p>")
    (folder / "link.png").symlink_to(folder.parent)
    (folder / "loop.png").symlink_to("loop.png")
    os.mkfifo(folder / "pipe.png")
    header = bytearray(good)
    header[16:24] = bytes(8)
    (folder / "zero.png").write_bytes(header)
    header[16:24] = b"\0\0\xea\x60\0\0\xea\x60"
    (folder / "huge.png").write_bytes(header)
    wide = oiio.ImageBuf(np.zeros((4, 4, 3), dtype=np.uint16))
    assert wide.write(str(folder / "wide.png"), "uint16")
    image = pytest.importorskip("PIL.Image", reason="Pillow writes the CMYK picture")
    image.new("CMYK", (4, 4)).save(folder / "cmyk.jpg")
    spec = oiio.ImageSpec(4, 4, 2, "float")
    spec.channelformats, spec.channelnames = ("float", "uint"), ("Y", "object_id")
    output = oiio.ImageOutput.create(str(folder / "ids.exr"))
    assert output.open(str(folder / "ids.exr"), spec)
    assert output.write_image(np.zeros((4, 4, 2), dtype=np.float32))
    output.close()
    (folder / "silent.dpx").write_bytes(b"SDPX" + b"\xff" * 3000)
    (folder / ("x" * 250 + ".png")).write_bytes(good[:9])
    unreadable = "cannot be read as a picture: "
    return {
        "ids.exr": "holds numbers of the type uint;",
        "silent.dpx": unreadable,
        "x" * 250 + ".png": unreadable,
        "cut.png": unreadable,
        "empty.png": unreadable,
        "text.png": unreadable,
        "page.html": unreadable,
        "link.png": "is a folder",
        "loop.png": "Too many levels of symbolic links",
        "pipe.png": "is not a regular file",
        "zero.png": unreadable,
        "huge.png": unreadable,
        "wide.png": "holds numbers of the type uint16",
        "cmyk.jpg": "is CMYK",
        NOT_UTF8: "its name is not UTF-8",
    }


@pytest.mark.parametrize("side", ["reference", "test"])
def test_a_bad_file_is_one_line_and_the_others_are_compared(side: str, tmp_path: Path) -> None:
    messages = bad_files(tmp_path / side)
    other = "test" if side == "reference" else "reference"
    (tmp_path / other).mkdir()
    for name in (*messages, "good.png"):
        # Whatever its name, the content of each file on the other side is the good picture.
        (tmp_path / other / name).write_bytes((tmp_path / side / "good.png").read_bytes())
    results = {result.name: result for result in compare_folders(tmp_path / "reference", tmp_path / "test", RULES["codes"]())}
    assert results.keys() == {*messages, "good.png"}
    assert results["good.png"].outcome is Outcome.SAME
    for name, message in messages.items():
        assert results[name].outcome is Outcome.FILE, name
        assert message in results[name].reason
        assert "\n" not in results[name].reason
        assert not results[name].reason.endswith(": ")


@pytest.mark.parametrize("suffix", ["png", "exr", "tif", "jpg", "hdr", "tga", "bmp"])
def test_a_damaged_file_never_breaks_the_comparison(suffix: str, tmp_path: Path) -> None:
    """A file of any format that is cut off, or has wrong bytes, is a result of one line."""
    good = tmp_path / f"good.{suffix}"
    pixels = oiio.ImageBuf(PNG.pixels)
    assert pixels.write(str(good))
    data, random = good.read_bytes(), np.random.default_rng(1)
    cut = [data[: len(data) * share // 10] for share in range(6)]
    outcomes = []
    for index in range(40):
        damaged = bytearray(cut[index] if index < len(cut) else data)
        for place in random.integers(0, len(data), index - len(cut) + 1 if index >= len(cut) else 0):
            damaged[place] ^= int(random.integers(1, 256))
        bad = tmp_path / f"bad.{suffix}"
        bad.write_bytes(damaged)
        result = compare(good, bad, "exact")
        assert "\n" not in result.reason
        outcomes.append(result.outcome)
    assert set(outcomes[: len(cut)]) == {Outcome.FILE}
    assert Outcome.SAME not in outcomes[len(cut) :] or suffix in ("jpg", "tga", "tif")


def test_a_folder_that_cannot_be_listed_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for side in ("reference", "test"):
        for name in ("good.png", "locked/a.png", "locked/b.png", "locked.png"):
            written(tmp_path / side / name)
    list_folder = os.scandir

    def refused(path: Any) -> Any:
        if Path(path) == tmp_path / "test" / "locked":
            raise PermissionError(13, "Permission denied", path)
        return list_folder(path)

    monkeypatch.setattr(os, "scandir", refused)
    results = list(compare_folders(tmp_path / "reference", tmp_path / "test", RULES["codes"]()))
    assert [(result.name, result.outcome) for result in results] == [
        ("locked", Outcome.FILE),
        ("good.png", Outcome.SAME),
        ("locked.png", Outcome.SAME),
    ]
    assert results[0].reason == f"{tmp_path / 'test' / 'locked'}: the folder cannot be listed: Permission denied"


def test_folders_by_relative_name(tmp_path: Path) -> None:
    reference, test = tmp_path / "reference", tmp_path / "test"
    for name in ("a b.png", "in/x..y.png", "only.png", ".hidden.png"):
        written(reference / name)
    for name in ("a b.png", "in/x..y.png", "new.png"):
        written(test / name, pixels=PNG.pixels + (name == "in/x..y.png") * np.uint8(9))
    results = list(compare_folders(reference, test, RULES["codes"]()))
    assert [(result.name, result.outcome) for result in results] == [
        ("a b.png", Outcome.SAME),
        ("in/x..y.png", Outcome.FAIL),
        ("new.png", Outcome.FILE),
        ("only.png", Outcome.FILE),
    ]
    assert results[2].reason == f"is only in the test folder {test}"


def test_empty_folders_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(GlshadeError, match="hold no files to compare"):
        list(compare_folders(tmp_path, tmp_path, RULES["codes"]()))


def known(folder: str) -> list[Any]:
    """Returns the pairs of a folder of ../shared/data/pairs; one skipped parameter where the folder is absent."""
    found = sorted((PAIRS / folder).rglob("*-expected.png"))
    if not found:
        return [pytest.param(None, marks=pytest.mark.skip(f"../shared/data/pairs/{folder} is absent"))]
    return [pytest.param(path, id=path.name.removesuffix("-expected.png")) for path in found]


def actual(expected: Path) -> Path:
    return expected.with_name(expected.name.replace("-expected", "-actual"))


@pytest.mark.parametrize("expected", known("playwright/should-fail"))
def test_playwright_pairs_that_should_fail(expected: Path) -> None:
    assert compare(expected, actual(expected)).outcome is Outcome.FAIL


@pytest.mark.parametrize("expected", known("playwright/should-match"))
def test_playwright_pairs_that_should_match(expected: Path) -> None:
    # Text whose anti-aliasing differs by several codes is a difference here: `codes` makes no guess about anti-aliasing.
    text = expected.name.startswith("antialiasing")
    assert compare(expected, actual(expected)).outcome is (Outcome.FAIL if text else Outcome.SAME)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_pixelmatch_pairs_differ(number: int) -> None:
    a, b = (PAIRS / "pixelmatch" / f"{number}{side}.png" for side in "ab")
    if not a.exists():
        pytest.skip("../shared/data/pairs/pixelmatch is absent")
    assert compare(a, b).outcome is Outcome.FAIL
    assert compare(a, a).outcome is Outcome.SAME
