"""`glshade dev` as a user has it: files are edited on disk, and a browser shows what becomes of them."""

from __future__ import annotations

import io
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("starlette", reason="needs the extra live: pip install 'glshade[live]'")
from PIL import Image

import glshade

Open = Callable[..., Any]
SIZE = (192, 144)
SCENE = """\
# The comment above the film.
[film]
size = [192, 144]
samples = 4
background = [0.02, 0.02, 0.03]

[camera]
eye = [0, 1, 5]
target = [0, 0, 0]

[materials]
clay = { brdf = "lambert", kd = [0.7, 0.4, 0.2] }   # fired at 1000 degrees
glaze = { brdf = "phong", kd = [0.1, 0.2, 0.5], ks = 0.4, exponent = 30 }

[[objects]]
name = "pot"
shape = { type = "sphere", segments = 16, rings = 8 }
transform = { translate = [-1.1, 0, 0] }
material = "clay"

[[objects]]
name = "cup"
shape = { type = "sphere", segments = 16, rings = 8 }
transform = { translate = [1.1, 0, 0] }
material = "glaze"

[[lights]]
type = "directional"
direction = [-0.4, -0.6, -1]
intensity = 0.9
"""
# The shipped model with a factor from a file that it includes.
LAMBERT = """\
#include "math/constants.glsl"
#include "surface/frame.glsl"
#include "math/tint.glsl"

struct Lambert {
    vec3 kd;
};

vec3 brdf_cos(Lambert m, Frame f, vec3 l, vec3 v) {
    float NoL = dot(f.n, l);
    return NoL > 0.0 && dot(f.n, v) > 0.0 ? tint(m.kd) * (INV_PI * NoL) : vec3(0.0);
}

vec3 ambient_reflectance(Lambert m) {
    return m.kd;
}
"""
TINT = """\
// The colour of the clay.
vec3 tint(vec3 kd) {
    return kd;
}
"""
# The pot's middle, in pixels of the picture.
POT = (50, 72)


class Live:
    """A running `glshade dev` with its files in a folder.

    address: the address of the page, with the token.
    """

    def __init__(self, folder: Path) -> None:
        self.scene = folder / "scene.toml"
        self.tint = folder / "shaders" / "math" / "tint.glsl"
        self.lambert = folder / "shaders" / "brdf" / "lambert.glsl"
        for path, text in ((self.scene, SCENE), (self.tint, TINT), (self.lambert, LAMBERT)):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        command = [sys.executable, "-m", "glshade", "dev", str(self.scene), "--shaders", str(folder / "shaders")]
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
        )
        assert self._process.stdout is not None
        line = next((line for line in self._process.stdout if "http" in line), "")
        found = re.search(r"http://\S+", line)
        assert found, "the command printed no address"
        self.address = found[0]

    def kill(self, module: str) -> None:
        """Kills the child process that runs a module."""
        children = Path(f"/proc/{self._process.pid}/task/{self._process.pid}/children").read_text().split()
        pids = [int(child) for child in children if module in Path(f"/proc/{child}/cmdline").read_text()]
        assert pids, f"no child process runs {module}"
        for pid in pids:
            os.kill(pid, signal.SIGKILL)

    def close(self) -> None:
        self._process.terminate()
        self._process.communicate(timeout=10)


@pytest.fixture
def live(tmp_path: Path) -> Iterator[Live]:
    live = Live(tmp_path)
    yield live
    live.close()


def pixels(page: Any, pane: int = 0) -> np.ndarray[Any, Any]:
    """Returns the pixels (H, W, 4) that a pane shows, 0 to 255."""
    values = page.evaluate(
        """(pane) => {
            const canvas = document.querySelector(`canvas[data-pane="${pane}"]`);
            return [...canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data];
        }""",
        pane,
    )
    return np.array(values, dtype=np.uint8).reshape(SIZE[1], SIZE[0], 4)


def wait_until(page: Any, condition: Callable[[], bool], what: str, seconds: float = 20) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, what
        page.wait_for_timeout(20)


def wait_for_revision(page: Any, least: int) -> None:
    """Waits for a still picture of a revision with at least this number."""

    def shown() -> bool:
        data = page.evaluate("({...document.querySelector('canvas.picture').dataset})")
        return data.get("still") == "true" and int(data["revision"]) >= least

    wait_until(page, shown, f"no picture of revision {least}")


def revision(page: Any) -> int:
    return int(page.locator("canvas.picture").first.get_attribute("data-revision"))


def still(page: Any) -> None:
    """Waits until the newest view that was asked for is shown by a still picture in every pane."""
    page.wait_for_timeout(400)  # longer than the pause after which a movement counts as ended
    wait_until(
        page,
        lambda: page.evaluate(
            "[...document.querySelectorAll('.pane:not([hidden]) canvas.picture')].every((c) => c.dataset.still === 'true')"
            " && !document.querySelector('.waiting')"
        ),
        "no still picture",
    )


def test_an_edit_is_shown_and_a_broken_one_is_not(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    assert "token" not in page.url
    before = pixels(page)
    first = revision(page)

    live.tint.write_text(TINT.replace("return kd;", "return kd * vec3(0.2, 1.0, 1.0);"))
    wait_for_revision(page, first + 1)
    redder, edited = before[POT[1], POT[0]], pixels(page)
    assert edited[POT[1], POT[0], 0] < redder[0] / 2
    second = revision(page)

    live.tint.write_text(TINT.replace("return kd;", "return kd * vec3(0.2, 1.0, 1.0) * strength;"))
    page.get_by_text(f"stale: revision {second}").wait_for()
    place = page.locator("#problems h3 code").first.inner_text()
    assert re.search(r"tint\.glsl:3:\d+$", place)
    assert "strength" in page.locator("#problems .faulty").first.inner_text()
    assert "^" in page.locator("#problems .caret").first.inner_text()
    assert np.array_equal(pixels(page), edited)

    live.tint.write_text(TINT)
    wait_for_revision(page, second + 1)
    page.locator("#problems").wait_for(state="hidden")
    assert page.locator("#notice").is_hidden()
    assert np.array_equal(pixels(page), before)


def test_a_faulty_scene_keeps_the_picture(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    before = pixels(page)
    live.scene.write_text(SCENE.replace("exponent = 30", "exponent = -30"))
    page.locator("#problems article").first.wait_for()
    assert "scene.toml:13" in page.locator("#problems h3 code").first.inner_text()
    assert np.array_equal(pixels(page), before)
    live.scene.write_text(SCENE)
    page.locator("#problems").wait_for(state="hidden")


def test_the_still_pixels_are_those_of_render(live: Live, open_page: Open, tmp_path: Path) -> None:
    page = open_page(live.address)
    picture = tmp_path / "picture.png"
    command = [
        sys.executable,
        "-m",
        "glshade",
        "render",
        str(live.scene),
        "--shaders",
        str(tmp_path / "shaders"),
        "-o",
        str(picture),
    ]
    subprocess.run(command, check=True, capture_output=True)
    expected = np.asarray(Image.open(picture).convert("RGBA"))
    assert np.array_equal(pixels(page), expected)

    page.get_by_role("slider", name="exponent").fill("500")
    still(page)
    assert not np.array_equal(pixels(page), expected)
    page.get_by_role("button", name="Undo").click()
    still(page)
    assert np.array_equal(pixels(page), expected)

    data = page.evaluate("fetch('/frame.png').then((answer) => answer.arrayBuffer()).then((data) => [...new Uint8Array(data)])")
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(bytes(data))).convert("RGBA")), expected)


def test_a_drag_moves_the_picture_and_reset_takes_it_back(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    before = pixels(page)
    page.evaluate("document.addEventListener('glshade:frame', ({ detail }) => (window.moved ||= !detail.still))")
    box = page.locator("canvas.picture").first.bounding_box()
    page.mouse.move(box["x"] + 90, box["y"] + 70)
    page.mouse.down()
    for step in range(10):
        page.mouse.move(box["x"] + 90 + 4 * step, box["y"] + 70)
        page.wait_for_timeout(30)
    page.mouse.up()
    still(page)
    assert page.evaluate("window.moved") is True
    assert not np.array_equal(pixels(page), before)
    page.get_by_role("button", name="Reset").click()
    still(page)
    assert np.array_equal(pixels(page), before)


def test_a_slider_moves_the_picture(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    scale = page.locator("canvas.picture").first.bounding_box()["width"] / SIZE[0]
    page.locator("canvas.picture").first.click(position={"x": scale * POT[0], "y": scale * POT[1]})
    page.locator("#object option:checked[value='objects.0']").wait_for(state="attached")
    page.locator("[data-key='materials.clay.kd'] input[type=color]").fill("#0000ff")
    still(page)
    red, _, blue, _ = pixels(page)[POT[1], POT[0]]
    assert blue > 50 > red


def test_two_rates_under_a_swipe(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    page.select_option("#view-0", "flat")
    page.select_option("#view-1", "gouraud")
    page.get_by_text("Swipe", exact=True).click()
    still(page)
    flat, gouraud = pixels(page, 0), pixels(page, 1)
    assert len(np.unique(flat[POT[1] - 20 : POT[1] + 20, POT[0]], axis=0)) < len(np.unique(gouraud[52:92, POT[0]], axis=0))
    page.get_by_role("slider", name="Position of the swipe").press("End")
    clip = page.evaluate("getComputedStyle(document.querySelectorAll('.frame')[1]).clipPath")
    assert clip == "inset(0px 0px 0px 100%)"


def test_the_previous_revision_can_be_compared(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    before, first = pixels(page), revision(page)
    live.tint.write_text(TINT.replace("return kd;", "return kd.bgr;"))
    wait_for_revision(page, first + 1)
    page.select_option("#view-1", "previous")
    still(page)
    assert np.array_equal(pixels(page, 1), before)
    assert not np.array_equal(pixels(page, 0), before)


def test_write_back_keeps_the_comments(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    first = revision(page)
    slider = page.get_by_role("slider", name="exponent")
    slider.fill("500")
    still(page)
    changed = pixels(page)
    page.get_by_role("button", name="Write back").click()
    wait_for_revision(page, first + 1)
    page.get_by_text("As in the file").wait_for()
    text = live.scene.read_text()
    assert "# The comment above the film." in text
    assert "# fired at 1000 degrees" in text
    written = glshade.load(live.scene).materials["glaze"]
    assert float(slider.evaluate("(input) => Number(input.getAttribute('aria-valuetext'))")) == pytest.approx(written.exponent)
    assert text.count("\n") == SCENE.count("\n")
    still(page)
    assert np.array_equal(pixels(page), changed)


def test_the_badge_says_whether_the_picture_is_right(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    page.get_by_role("button", name="Verified").wait_for(timeout=60_000)

    live.tint.write_text(TINT.replace("return kd;", "return kd * 1.001;"))
    badge = page.get_by_role("button", name="unexplained")
    badge.wait_for(timeout=60_000)
    badge.click()
    page.locator("#verdict .pixels button").first.click()
    page.get_by_role("heading", name="Pixel").wait_for(timeout=60_000)
    page.locator("#probe tr.bad").first.wait_for()


@pytest.mark.skipif(shutil.which("glslangValidator") is None, reason="needs glslangValidator (apt install glslang-tools)")
def test_a_line_that_loses_digits_is_found_and_mended(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    first = revision(page)
    live.tint.write_text(TINT.replace("return kd;", "vec3 far = kd + 8192.0;\n    return far - 8192.0;"))
    wait_for_revision(page, first + 1)
    page.get_by_text("Probe", exact=True).click()
    box = page.locator("canvas.picture").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] * POT[0] / SIZE[0], box["y"] + box["height"] * POT[1] / SIZE[1])
    line = page.get_by_role("button", name="math/tint.glsl:4").first
    line.wait_for(timeout=60_000)
    page.locator(".trace").get_by_role("button", name="far").first.click()
    page.wait_for_selector("canvas[data-pane='1'][data-still=true]", timeout=60_000)
    assert pixels(page, 1)[POT[1], POT[0], 3] == 255
    assert pixels(page, 1)[POT[1], SIZE[0] - POT[0], 3] == 0, "the cup has another program"

    page.get_by_role("button", name="math/tint.glsl:3").first.click()
    page.locator(".listing .losing").wait_for(timeout=60_000)
    assert re.match(r"\s*3\s+vec3 far = kd \+ 8192.0;\s+loses \d\.\d digits", page.locator(".listing .target").inner_text())

    live.tint.write_text(TINT)
    page.get_by_text("No line loses more than three digits.").first.wait_for(timeout=60_000)
    assert page.locator(".listing .losing").count() == 0
    page.get_by_role("button", name="Verified").wait_for(timeout=60_000)


def test_the_reference_and_the_heat_map(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    page.select_option("#view-1", "reference")
    page.wait_for_selector("canvas[data-pane='1'][data-still=true]", timeout=60_000)
    difference = np.abs(pixels(page, 0).astype(int) - pixels(page, 1).astype(int))
    assert np.mean(difference > 1) < 0.05  # at edges, the reference has other samples than the driver
    page.select_option("#view-1", "heat")
    page.locator(".legend .bar").last.wait_for(timeout=60_000)


def test_infinite_pixels_are_painted_and_counted(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    first = revision(page)
    page.select_option("#view-0", "nan")
    page.get_by_text("no pixels are NaN or infinite").wait_for()
    before = pixels(page)
    live.tint.write_text(TINT.replace("return kd;", "return vec3(1.0) / (kd - kd);"))
    wait_for_revision(page, first + 1)
    count = int(re.search(r"(\d+) pixels are NaN or infinite", page.locator("#status").inner_text())[1])
    assert count > 1000
    assert not np.array_equal(pixels(page)[POT[1], POT[0]], before[POT[1], POT[0]])


def test_a_killed_drawer_costs_no_picture(live: Live, open_page: Open) -> None:
    page = open_page(live.address)
    before, first = pixels(page), revision(page)
    live.kill("glshade.live.drawer")
    page.wait_for_timeout(300)
    assert np.array_equal(pixels(page), before)
    live.tint.write_text(TINT.replace("return kd;", "return kd.bgr;"))
    wait_for_revision(page, first + 1)
    assert not np.array_equal(pixels(page), before)


def test_each_page_has_its_own_camera(live: Live, open_page: Open) -> None:
    one = open_page(live.address)
    before = pixels(one)
    other = open_page(live.address)
    other.locator("#stage").focus()
    other.keyboard.press("ArrowLeft")
    still(other)
    assert np.array_equal(pixels(one), before)
    assert not np.array_equal(pixels(other), before)


@pytest.mark.parametrize("layer", ["depth", "normal", "albedo", "cryptomatte"])
def test_a_layer_has_a_picture(live: Live, open_page: Open, layer: str) -> None:
    page = open_page(live.address)
    before = pixels(page)
    page.select_option("#view-0", f"layer:{layer}")
    still(page)
    assert page.locator(".note").first.is_hidden()
    assert not np.array_equal(pixels(page), before)


@pytest.mark.parametrize("width", [390, 1440])
def test_the_page_fits_the_screen(live: Live, open_page: Open, width: int, tmp_path: Path) -> None:
    page = open_page(live.address, width=width, height=844)
    page.screenshot(path=tmp_path / "page.png")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.locator("canvas.picture").first.bounding_box()["width"] >= min(width, SIZE[0]) - 24
