"""The page of comparisons holds every case, its pictures with all their values, and names that stay names."""

from __future__ import annotations

import base64
import fnmatch
import json
import re
import zlib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.results import Run, changed, gradient

from glshade.errors import GlshadeError, printable
from glshade.golden import page
from glshade.golden.page import write_page
from glshade.image import file as picture_file
from glshade.page.ramp import RAMP

HOSTILE = [
    "<script>alert(1)</script>.png",
    "</script>.png",
    'it\'s "quoted" $(x).png',
    "a\nb.png",
    "u\u2028v.png",
    "b[1]*?.png",
]


class Page(HTMLParser):
    """A page that was written: its rows, as (name, state, reason), and the values that its script reads, by id."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text = path.read_text(encoding="utf-8")
        self.ids: list[str | None] = []
        self.tags: list[str] = []
        self.values: dict[str, Any] = {}
        self.feed(self.text)
        self.close()
        self.cases = self.values["cases"]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.ids.append(dict(attrs).get("id") if tag == "script" else None)

    def handle_data(self, data: str) -> None:
        if self.ids and (id_ := self.ids[-1]) and data.strip():
            self.values[id_] = json.loads(data)

    def case(self, name: str) -> dict[str, Any]:
        """Returns the case of a name, with the pictures that the page embeds for it."""
        (case,) = [case for case in self.cases if case["name"] == name]
        return {**case, **self.values[f"pictures-{case['index']}"]}


def codes(address: str, path: Path) -> Any:
    """Returns the pixels of a picture in base64, which is written to a file."""
    path.write_bytes(base64.b64decode(address.rpartition(",")[2]))
    return picture_file.read_part(path, picture_file.parts(path)[0])


def floats(stored: dict[str, Any]) -> Any:
    """Returns the float32 numbers of an exact picture, decoded as the page's script decodes them."""
    width, height = stored["size"]
    planes = np.frombuffer(zlib.decompress(base64.b64decode(stored["data"])), np.uint8).reshape(4, -1)
    return np.ascontiguousarray(planes.T).view("<f4").reshape(height, width, len(stored["channels"]))


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return Run(tmp_path)


def written(run: Run) -> Page:
    """Returns the page of a run."""
    return Page(write_page(run.folder, run.finish()))


def test_the_page_embeds_pictures_with_all_values(run: Run, tmp_path: Path) -> None:
    plain, linear = gradient(channels=4), gradient(channels=4, floats=True)
    linear[3, 4, 0], broken = np.float32(0.1), linear.copy()
    broken[9, 9, 1] = np.nan
    run.add("plain.png", plain, changed(plain))
    run.add("linear.exr", linear, broken)
    found = written(run)
    exact = found.case("plain.png")["exact"]
    assert (codes(exact["expected"]["data"], tmp_path / "e.png") == plain).all()
    assert (codes(exact["actual"]["data"], tmp_path / "a.png") == changed(plain)).all()
    exact = found.case("linear.exr")["exact"]
    assert exact["actual"]["channels"] == ["R", "G", "B", "A"]
    assert np.array_equal(floats(exact["expected"]), linear)
    assert np.array_equal(floats(exact["actual"]), broken, equal_nan=True)
    assert not list(run.folder.rglob("pixels.js"))


@settings(max_examples=5)
@given(x=st.integers(0, 399), y=st.integers(0, 299), floats=st.booleans())
def test_one_pixel_that_differs_is_seen_in_the_thumbnail(
    x: int, y: int, floats: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("one")
    run = Run(folder)
    picture = gradient((400, 300), floats=floats)
    name = "one.exr" if floats else "one.png"
    # Two codes are the least that the rule finds.
    run.add(name, picture, changed(picture, (y, x), 2))
    small = codes(written(run).case(name)["thumbnails"]["difference"], folder / "d.png")
    differs = (np.abs(small.astype(int) - RAMP[0]).max(axis=2) > 60).nonzero()
    step = -(-400 // small.shape[1])
    assert list(zip(*differs, strict=True)) == [(y // step, x // step)]


def test_the_worst_case_comes_first(run: Run) -> None:
    picture = gradient()
    run.add("a.png", picture, picture)
    run.add("b.png", None, picture)
    run.add("c.png", picture, None)
    run.add("d.png", picture, picture[:-1])
    run.add("e.png", picture, changed(picture, by=90))
    run.add("f.png", picture, 255 - picture)
    found = written(run)
    assert [case["name"] for case in found.cases] == ["f.png", "e.png", "d.png", "c.png", "b.png", "a.png"]
    assert [case["outcome"] for case in found.cases] == ["fail", "fail", "sizes", "file", "missing", "same"]
    assert [case["approvable"] for case in found.cases] == [True, True, True, False, True, False]
    assert "5 of 6 cases to look at" in found.text


def test_equal_causes_are_one_group_and_numbers_do_not_count(run: Run) -> None:
    picture = gradient()
    light = {"kind": "light", "text": "light fill x 0.00"}
    for name, actual in (("a", changed(picture)), ("b", changed(picture, (9, 9))), ("c", picture[:-2]), ("d", picture[:-3])):
        causes = (light,) if name == "a" else ()
        run.add(f"{name}.png", picture, actual, causes=causes)
    groups = {case["name"]: case["group"] for case in written(run).cases}
    assert groups["a.png"] == "light fill x 0.00"
    assert groups["c.png"] == groups["d.png"]
    assert len(set(groups.values())) == 3


def test_names_stay_names(run: Run) -> None:
    """The folder of results accepts no control characters; the page does not rely on that."""
    for index in range(len(HOSTILE)):
        run.add(f"{index}.png", gradient(), changed(gradient()))
    cases = [
        case.model_copy(update={"id": f"test[{name}]", "name": name, "reason": name, "notes": (name,)})
        for case, name in zip(run.finish(), HOSTILE, strict=True)
    ]
    found = Page(write_page(run.folder, cases))
    assert {printable(name) for name in HOSTILE} == {case["name"] for case in found.cases}
    assert "<script>alert" not in found.text
    assert found.tags.count("script") == 1 + 2 + len(found.cases), "the page's own, two of values, and one a case"
    for case in found.cases:
        assert "\n" not in case["only"]


@given(name=st.text(min_size=1, max_size=12) | st.sampled_from(HOSTILE))
def test_the_pattern_of_a_name_matches_it_and_is_safe_to_paste(name: str) -> None:
    pattern = page._pattern(name)
    assert fnmatch.fnmatchcase(name, pattern)
    assert printable(pattern) == pattern
    if printable(name) == name:
        assert not fnmatch.fnmatchcase(name + "x", pattern)
        assert not fnmatch.fnmatchcase("x" + name[1:], pattern) or name[0] == "x"


def test_large_pictures_lie_beside_the_page_and_thumbnails_in_it(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "EMBEDDED", 0)
    picture = gradient()
    run.add("a b/ä.png", picture, changed(picture))
    run.add("passed.png", picture, changed(picture, by=1))
    case = (page_ := written(run)).case("a b/ä.png")
    assert set(page_.case("passed.png")["thumbnails"]) == {"expected", "actual", "difference"}
    assert "exact" not in case
    assert set(case["thumbnails"]) == {"expected", "actual", "difference"}
    (script,) = run.folder.rglob("pixels.js")
    match = re.fullmatch(r'glshadePixels\("([^"]+)", (\{.*\})\);\n', script.read_text(encoding="ascii"))
    assert match
    assert match[1] == case["beside"] == script.relative_to(run.folder).as_posix()
    assert set(json.loads(match[2])) == {"expected", "actual"}


def test_a_palette_is_embedded_as_colours(run: Run, tmp_path: Path) -> None:
    """The page's script decodes no palettes; OpenImageIO turns one into colours."""
    run.add("p.png", gradient(), changed(gradient()))
    header, data = b"\x00\x00\x00\x02\x00\x00\x00\x01\x08\x03\x00\x00\x00", zlib.compress(b"\x00\x00\x01")
    chunks = ((b"IHDR", header), (b"PLTE", bytes((9, 8, 7, 200, 100, 50))), (b"IDAT", data), (b"IEND", b""))
    whole = b"".join(len(d).to_bytes(4, "big") + n + d + zlib.crc32(n + d).to_bytes(4, "big") for n, d in chunks)
    for path in (*run.folder.rglob("actual.png"), *run.folder.rglob("expected.png")):
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + whole)
    stored = written(run).case("p.png")["exact"]["actual"]
    assert base64.b64decode(stored["data"])[25] == 2
    assert codes(stored["data"], tmp_path / "p.png").tolist() == [[[9, 8, 7], [200, 100, 50]]]


@pytest.mark.parametrize("kind", ["truncated", "missing"])
def test_pictures_that_cannot_be_read_do_not_end_the_page(run: Run, kind: str) -> None:
    run.add("a.png", gradient(), changed(gradient()))
    run.add("b.png", gradient(), changed(gradient()))
    (broken,) = [
        path for path in run.folder.rglob("actual.png") if "a" in path.parent.name[:2] or path.parent.name.startswith("a")
    ]
    broken.unlink() if kind == "missing" else broken.write_bytes(broken.read_bytes()[:60])
    found = written(run)
    assert set(found.case("a.png").get("exact", {})) <= {"expected"}
    assert set(found.case("b.png")["exact"]) == {"expected", "actual"}


def test_a_picture_outside_the_folder_is_refused(run: Run) -> None:
    run.add("a.png", gradient(), changed(gradient()))
    (case,) = run.finish()
    outside = case.model_copy(update={"actual": "../made/a.png"})
    with pytest.raises(GlshadeError, match="outside"):
        write_page(run.folder, [outside])
    assert not (run.folder / "index.html").exists()


def test_the_layer_that_differs_is_shown(run: Run, tmp_path: Path) -> None:
    from glshade.image.contents import PictureContents

    names = ["R", "G", "B", "normal.X", "normal.Y", "normal.Z"]
    pixels = np.concatenate([gradient(floats=True), gradient(floats=True) - 1], axis=2)
    run.add("n.exr", gradient(floats=True), gradient(floats=True) * 2)
    other = pixels.copy()
    other[4:9, 4:9, 3] = 1.0
    for role, values in (("expected", pixels), ("actual", other)):
        (path,) = run.folder.rglob(f"{role}.exr")
        picture_file.write(path, PictureContents(values, "linear", premultiplied=True, channels=names))
    (case,) = run.finish()
    layers = ({"name": "", "outcome": "same", "metrics": None}, {"name": "normal", "outcome": "fail", "metrics": None})
    stored = Page(write_page(run.folder, [case.model_copy(update={"layers": layers})])).case("n.exr")
    assert stored["layer"] == "normal"
    assert stored["exact"]["actual"]["channels"] == ["X", "Y", "Z"]
    assert np.array_equal(floats(stored["exact"]["actual"]), other[..., 3:])


def test_no_cases_is_a_page_too(tmp_path: Path) -> None:
    text = write_page(tmp_path, []).read_text(encoding="utf-8")
    assert "No cases" in text
