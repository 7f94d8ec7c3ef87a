"""The page of comparisons, opened from the disk: looking at a case, finding one, and approving it."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.results import Run, changed, gradient

from glshade.golden import page as pages
from glshade.golden.page import write_page
from glshade.golden.result import SceneVerdict

Open = Callable[..., Any]
READY = "body[data-shown]"
# The middle of the stage, or a share of its width to the right, as the colour [R, G, B] that its canvas shows there.
COLOUR = """share => {
    const canvas = document.querySelector("#stage canvas");
    return [...canvas.getContext("2d").getImageData(share * canvas.width, canvas.height / 2, 1, 1).data].slice(0, 3);
}"""
RED, BLUE = [200, 30, 20], [10, 40, 220]


def flat(colour: list[int]) -> Any:
    return np.full((40, 60, 3), colour, dtype=np.uint8)


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Eight cases: a change of colour, two shifted pictures, floats, a stale one, one of another size, and two that pass."""
    run = Run(tmp_path)
    grey = gradient((60, 40))
    run.add("red.png", flat(RED), flat(BLUE))
    shift = ({"kind": "shift", "text": "shifted by (1, 0)", "object": "ball", "triangle": 3, "stage": "coverage"},)
    run.add("shift a.png", grey, np.roll(grey, 1, axis=1), causes=shift, verdict=SceneVerdict.REGRESSION)
    run.add("shift b.png", grey, np.roll(grey, 1, axis=1), causes=shift, verdict=SceneVerdict.REGRESSION)
    linear = gradient((60, 40), floats=True)
    run.add("linear.exr", linear, changed(linear, (20, 30), 4))
    run.add("stale.png", grey, changed(grey), outcome="warn", verdict=SceneVerdict.STALE)
    run.add("size.png", grey, grey[:-3])
    run.add("same.png", grey, grey)
    run.add("it's [1] <b>.png", flat(RED), flat(RED))
    return run


@pytest.fixture
def report(run: Run, open_page: Open) -> Open:
    """`report(**options)` opens the page of the run from the disk, with its worst case shown."""
    address = write_page(run.folder, run.finish()).as_uri()
    return lambda ready=READY, hash="", **options: open_page(address + hash, ready=ready, **options)


def names(page: Any) -> list[str]:
    """Returns the names of the rows in the list."""
    return list(page.eval_on_selector_all("#list .row b", "all => all.map(x => x.textContent)"))


def colour(page: Any, share: float = 0.5) -> list[int]:
    # The stage draws at the next frame.
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return list(page.evaluate(COLOUR, share))


def choose(page: Any, name: str) -> None:
    page.locator(".row", has_text=name).locator(".open").click()
    page.wait_for_function("name => document.getElementById('title').textContent === name", arg=name)
    page.wait_for_function("() => document.body.dataset.shown === document.body.dataset.case")


def test_only_what_differs_is_listed_until_asked(report: Open) -> None:
    page = report()
    assert names(page) == ["red.png", "shift a.png", "shift b.png", "linear.exr", "size.png", "stale.png"]
    assert page.inner_text("#title") == "red.png"
    page.keyboard.press("f")
    assert len(names(page)) == 8
    page.select_option("#outcome", "warn")
    assert names(page) == ["stale.png"]
    page.select_option("#outcome", "all")
    page.select_option("#order", "name")
    assert names(page) == sorted(names(page), key=str.lower)
    page.select_option("#verdict", "regression")
    assert names(page) == ["shift a.png", "shift b.png"]


def test_the_filter_finds_words_in_names_and_causes(report: Open) -> None:
    page = report()
    page.keyboard.press("/")
    page.keyboard.type("SHIFTED b.png")
    assert names(page) == ["shift b.png"]
    page.keyboard.type("zzz")
    assert names(page) == []
    assert page.is_visible("#none")
    page.keyboard.press("Escape")
    assert len(names(page)) == 6
    # A letter is a key again, and no part of the filter.
    page.keyboard.press("d")
    assert page.get_attribute("#stage", "data-mode") == "difference"


def test_equal_causes_are_one_group_that_ticks_together(report: Open) -> None:
    page = report()
    group = page.locator("#list .group")
    assert "2 cases" in group.locator("summary").inner_text()
    group.locator("summary input").check()
    assert "2 ticked" in page.inner_text("#approve")
    page.locator("#grouped").uncheck()
    assert page.locator("#list .group").count() == 0
    assert page.locator("#list .row input:checked").count() == 2


def test_side_by_side_and_swipe_show_both_pictures(report: Open) -> None:
    page = report()
    assert page.locator("#stage .pane:visible").count() == 2
    assert colour(page) == RED
    page.keyboard.press("w")
    assert colour(page, 0.4) == RED
    assert colour(page, 0.6) == BLUE
    handle = page.locator("#swipe").bounding_box()
    page.mouse.move(handle["x"] + handle["width"] / 2, handle["y"] + 20)
    page.mouse.down()
    page.mouse.move(handle["x"] + handle["width"] / 2 + 250, handle["y"] + 20, steps=4)
    page.mouse.up()
    assert colour(page, 0.6) == RED
    page.keyboard.press("Home")
    assert colour(page, 0.4) == BLUE
    assert page.get_attribute("#swipe", "aria-valuenow") == "0"


def test_blink_shows_one_picture_after_the_other(report: Open) -> None:
    page = report()
    page.keyboard.press("b")
    for role in ("expected", "actual", "expected"):
        page.wait_for_selector(f"#stage canvas[data-role={role}]")
    page.get_by_role("button", name="Pause").click()
    before = colour(page)
    page.wait_for_timeout(900)
    assert colour(page) == before


def test_who_wants_less_motion_blinks_by_hand(report: Open) -> None:
    page = report(reduced_motion="reduce")
    page.keyboard.press("b")
    page.wait_for_timeout(900)
    assert colour(page) == RED
    page.focus("#stage")
    page.keyboard.press(" ")
    assert colour(page) == BLUE


def test_the_pixel_under_the_pointer_is_read_from_both_pictures(report: Open) -> None:
    page = report()
    box = page.locator("#stage canvas").last.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    rows = [page.inner_text(f"#value-{role}").split() for role in ("expected", "actual", "difference")]
    assert rows == [["expected", "200", "30", "20"], ["actual", "10", "40", "220"], ["difference", "-190", "+10", "+200"]]
    assert page.inner_text("#place") == "x 30, y 20"


def test_zoom_and_place_are_the_same_in_both_panes(report: Open) -> None:
    page = report(hash="#case-1")
    first = page.inner_text("#zoom")
    box = page.locator("#stage canvas").first.bounding_box()
    page.mouse.move(box["x"] + 35, box["y"] + box["height"] / 2 + 5)
    before = page.inner_text("#place")
    page.mouse.wheel(0, -240)
    page.wait_for_function("text => document.getElementById('zoom').textContent !== text", arg=first)
    page.mouse.move(box["x"] + 36, box["y"] + box["height"] / 2 + 5)
    assert page.inner_text("#place") == before, "the pixel under the pointer stays"
    one, other = (
        page.evaluate("i => document.querySelectorAll('#stage canvas')[i].getContext('2d').getTransform().e", i) for i in (0, 1)
    )
    assert one == other
    page.keyboard.press("0")
    assert page.inner_text("#zoom") == first


def test_floats_are_exposed_and_read_with_their_digits(report: Open) -> None:
    page = report()
    choose(page, "linear.exr")
    page.keyboard.press("e")
    assert min(colour(page)) > 240
    for _ in range(4):
        page.keyboard.press("[")
    assert page.inner_text("#stops") == "-2 EV"
    # A quarter of 1, encoded as sRGB.
    assert np.abs(np.array(colour(page)) - 137).max() <= 4
    page.keyboard.press("n")
    assert page.inner_text("#place") == "x 30, y 20"
    rows = [page.inner_text(f"#value-{role}").split() for role in ("expected", "actual", "difference")]
    assert rows[0][1:3] == ["1", "1"]
    assert rows[1][1:3] == ["5", "5"]
    assert rows[2][1:3] == ["4", "4"]


def test_everything_can_be_done_by_the_keyboard(report: Open) -> None:
    page = report()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.keyboard.press("j")
    assert page.inner_text("#title") == "shift a.png"
    assert page.inner_text("#reason").startswith("shifted by (1, 0): ")
    page.keyboard.press("k")
    assert page.inner_text("#title") == "red.png"
    page.keyboard.press("x")
    assert page.is_checked("#tick")
    page.keyboard.press("d")
    assert page.get_attribute("#stage", "data-mode") == "difference"
    page.focus("#stage")
    page.keyboard.press("Shift+ArrowRight")
    assert page.inner_text("#place") == "x 31, y 20"
    assert "expected 200 30 20; actual 10 40 220" in page.inner_text("#announcement")
    page.keyboard.press("?")
    assert page.is_visible("#help")
    keys = page.eval_on_selector_all("#help kbd", "all => all.map(x => x.textContent)")
    handled = page.evaluate("[...'jkxyswbdeacnf/?0+-[]']")
    assert set(handled) <= set(keys)
    page.keyboard.press("Escape")
    assert not page.is_visible("#help")
    # Within the list, the tab key stops at one row only.
    stops = page.eval_on_selector_all("#list .open", "all => all.filter(x => x.tabIndex === 0).length")
    assert stops == 1


def test_every_control_has_a_name(report: Open) -> None:
    page = report()
    page.keyboard.press("x")
    unnamed = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, textarea, a, [role]")].filter((x) => x.checkVisibility()
            && !(x.getAttribute("aria-label") || x.textContent.trim() || x.labels?.[0]?.textContent.trim())
            && !["status", "presentation"].includes(x.getAttribute("role"))).map((x) => x.outerHTML)"""
    )
    assert unnamed == []


def test_a_phone_shows_the_list_and_then_the_case(report: Open) -> None:
    page = report(ready="#list .row", width=360, height=740, has_touch=True, is_mobile=True)

    def overflow() -> int:
        return int(page.evaluate("document.documentElement.scrollWidth - innerWidth"))

    assert not page.is_visible("#case")
    assert overflow() == 0
    page.locator(".row .open").first.tap()
    page.wait_for_selector(READY)
    assert not page.is_visible("#list")
    assert overflow() == 0
    assert colour(page) == RED
    page.go_back()
    assert page.is_visible("#list")
    page.locator(".row .open").first.tap()
    page.get_by_role("button", name="All cases").tap()
    assert page.is_visible("#list")


def test_large_pictures_come_from_files_beside_the_page(
    run: Run, open_page: Open, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(pages, "EMBEDDED", 0)
    file = write_page(run.folder, run.finish())
    page = open_page(file.as_uri(), ready=READY)
    assert colour(page) == RED
    assert "8-bit codes" in page.inner_text("#notice")


def test_the_page_alone_shows_thumbnails(run: Run, browser: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(pages, "EMBEDDED", 0)
    (tmp_path / "mail").mkdir()
    file = shutil.copy(write_page(run.folder, run.finish()), tmp_path / "mail")
    # The browser reports the files that are missing in its console, which is no fault here.
    page = browser.new_page()
    page.goto(Path(file).as_uri())
    page.wait_for_selector(READY)
    assert "thumbnails only" in page.inner_text("#notice")
    assert np.abs(np.array(colour(page)) - RED).max() < 12
    page.keyboard.press("d")
    assert page.get_attribute("#stage", "data-mode") == "difference"
    page.close()


def copied(page: Any) -> str:
    page.get_by_role("button", name="Copy the command").click()
    page.wait_for_function("() => document.getElementById('copied').textContent !== ''")
    return str(page.evaluate("navigator.clipboard.readText()"))


def test_the_copied_command_makes_the_next_comparison_pass(run: Run, open_page: Open, tmp_path: Path) -> None:
    hard = "it's [2] $(x).png"
    run.add(hard, flat(RED), flat(BLUE))
    address = write_page(run.folder, run.finish()).as_uri()
    page = open_page(address, ready=READY, permissions=["clipboard-read", "clipboard-write"])
    for name in (hard, "red.png"):
        page.locator(".row", has_text=name).locator("input").check()
    command = copied(page)
    words = shlex.split(command)
    assert words[:3] == ["glshade", "approve", str(run.folder)]

    def glshade(*arguments: object) -> subprocess.CompletedProcess[str]:
        python = [sys.executable, "-m", "glshade", *map(str, arguments)]
        return subprocess.run(python, cwd=tmp_path, capture_output=True, text=True, check=False)

    done = glshade(*words[1:])
    assert done.returncode == 0, done.stderr
    pairs = json.loads(glshade("compare", run.root, run.made, "--json").stdout)["pairs"]
    passed = {pair["name"] for pair in pairs if pair["outcome"] == "same"}
    assert passed == {hard, "red.png", "same.png", "it's [1] <b>.png"}


def filtered(pixels: Any) -> bytes:
    """Returns a PNG file of pixels (H, W, C) whose rows have all five filters in turn (W3C, PNG)."""
    height, width, count = pixels.shape
    above, rows = np.zeros((width, count), dtype=int), []
    for y in range(height):
        row = pixels[y].astype(int)
        left, corner = (np.vstack([np.zeros((1, count), dtype=int), line[:-1]]) for line in (row, above))
        estimate = left + above - corner
        a, b, c = (np.abs(estimate - neighbour) for neighbour in (left, above, corner))
        paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
        predicted = (0 * row, left, above, (left + above) // 2, paeth)[y % 5]
        rows.append(bytes([y % 5]) + ((row - predicted) % 256).astype(np.uint8).tobytes())
        above = row
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[count]
    header = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes((8, kind, 0, 0, 0))
    data = zlib.compress(b"".join(rows))
    chunks = ((b"IHDR", header), (b"IDAT", data[:20]), (b"IDAT", data[20:]), (b"IEND", b""))
    whole = (len(d).to_bytes(4, "big") + n + d + zlib.crc32(n + d).to_bytes(4, "big") for n, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(whole)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_every_value_of_a_png_file_is_read_as_it_is_stored(open_page: Open, tmp_path: Path, count: int) -> None:
    """Also colours of pixels that are nearly transparent, which a canvas would round."""
    run = Run(tmp_path)
    pixels = np.random.default_rng(count).integers(0, 256, (10, 6, count), dtype=np.uint8)
    case = run.add("any.png", pixels, 255 - pixels)
    (run.folder / case.files["expected"]).write_bytes(filtered(pixels))
    page = open_page(write_page(run.folder, run.finish()).as_uri(), ready=READY)
    page.keyboard.press("e")
    page.focus("#stage")
    page.keyboard.press("Shift+ArrowLeft")
    read = np.zeros_like(pixels)
    for y in range(10):
        for x in range(6):
            go_to(page, x, y)
            read[y, x] = [int(text) for text in page.inner_text("#value-expected").split()[1:]]
    assert (read == pixels).all()


def go_to(page: Any, x: int, y: int) -> None:
    """Moves the mark to a pixel by the keyboard."""
    words = page.inner_text("#place").replace(",", "").split()
    right, down = x - int(words[1]), y - int(words[3])
    for _ in range(abs(right)):
        page.keyboard.press("Shift+ArrowRight" if right > 0 else "Shift+ArrowLeft")
    for _ in range(abs(down)):
        page.keyboard.press("Shift+ArrowDown" if down > 0 else "Shift+ArrowUp")


def test_names_are_shown_as_they_are(run: Run, open_page: Open) -> None:
    name = "<img src=x onerror=alert(1)>.png"
    cases = [case.model_copy(update={"name": name, "reason": name, "notes": (name,)}) for case in run.finish()]
    page = open_page(write_page(run.folder, cases).as_uri(), ready=READY)
    assert page.inner_text("#title") == name
    assert set(names(page)) == {name}
    assert page.locator("img[src=x]").count() == 0


@pytest.mark.slow
def test_a_thousand_cases_are_small_and_open_quickly(tmp_path: Path, open_page: Open) -> None:
    run = Run(tmp_path)
    noise = np.random.default_rng(0).integers(0, 256, (256, 256, 3), dtype=np.uint8)
    run.add("a.png", noise, changed(noise))
    (case,) = run.finish()
    cases = [case.model_copy(update={"id": f"{i:04}", "name": f"folder/{i:04}.png"}) for i in range(1000)]
    file = write_page(run.folder, cases)
    assert file.stat().st_size <= 50_000_000
    start = time.monotonic()
    page = open_page(file.as_uri(), ready=READY)
    assert time.monotonic() - start <= 2.0
    assert page.inner_text("#number") == "1000 cases"
