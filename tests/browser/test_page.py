"""The page by itself, in front of a server that shows it whatever a test wants."""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from glshade.scene.override import parse, split

pytest.importorskip("websockets", reason="needs websockets: pip install 'glshade[dev]'")
from support.fake_live import PROBLEM, FakeLive

Open = Callable[..., Any]


@pytest.fixture
def fake() -> Iterator[FakeLive]:
    fake = FakeLive()
    yield fake
    fake.close()


def sent(fake: FakeLive, page: Any, kind: str) -> list[dict[str, Any]]:
    """Returns the messages of a kind, once there is one; pictures and sliders stand still by then."""
    end = time.monotonic() + 5
    while time.monotonic() < end:
        found = [message for message in fake.received if message["type"] == kind]
        if found and (kind != "view" or not found[-1]["moving"]):
            return found
        page.wait_for_timeout(20)
    raise AssertionError(f"the page sent no {kind}")


def after(fake: FakeLive, page: Any, action: Callable[[], Any]) -> dict[str, Any]:
    """Returns the last view that follows an action."""
    fake.received.clear()
    action()
    return sent(fake, page, "view")[-1]


def drag(page: Any, dx: float, dy: float, **options: Any) -> None:
    box = page.locator("canvas.picture").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down(**options)
    page.mouse.move(x + dx, y + dy, steps=5)
    page.mouse.up(**options)


def text_of(page: Any, selector: str) -> str:
    return str(page.locator(selector).inner_text())


def test_a_still_picture_is_acknowledged_and_judged(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.get_by_role("button", name="Verified").wait_for()
    assert text_of(page, "#scene") == "ball.toml"
    assert text_of(page, "#revision") == "revision 12"
    assert "512 × 512" in text_of(page, "#status")
    assert "lossless" in text_of(page, "#status")
    [view] = sent(fake, page, "view")
    assert view["panes"][0] == {
        "camera": None,
        "set": {},
        "size": None,
        "shading": None,
        "layer": None,
        "paint": None,
        "source": "picture",
    }
    assert [message["number"] for message in sent(fake, page, "shown")] == [view["number"]]


def test_a_drag_turns_the_camera_and_ends_with_a_still_picture(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    view = after(fake, page, lambda: drag(page, 120, 40))
    assert any(message["moving"] for message in sent(fake, page, "view"))
    camera = view["panes"][0]["camera"]
    eye = np.array(camera["eye"])
    assert np.linalg.norm(eye) == pytest.approx(26**0.5, rel=1e-5)
    assert eye[0] < -0.5
    assert eye[1] > 1.5
    assert camera["target"] == [0, 0, 0]

    moved = after(fake, page, lambda: drag(page, 120, 0, button="right"))["panes"][0]["camera"]
    assert np.subtract(moved["eye"], moved["target"]) == pytest.approx(eye, abs=1e-4)
    assert np.linalg.norm(moved["target"]) > 0.5

    page.mouse.wheel(0, -200)
    nearer = sent(fake, page, "view")[-1]
    assert after(fake, page, lambda: page.keyboard.press("0"))["panes"][0]["camera"] is None
    assert nearer is not None


def test_the_keyboard_turns_moves_and_zooms(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.locator("#stage").focus()
    turned = after(fake, page, lambda: page.keyboard.press("ArrowLeft"))["panes"][0]["camera"]
    assert turned["eye"][0] == pytest.approx(-5 * np.sin(np.pi / 36), abs=1e-4)
    nearer = after(fake, page, lambda: page.keyboard.press("+"))["panes"][0]["camera"]
    assert nearer["eye"] == pytest.approx(np.divide(turned["eye"], 1.1), rel=1e-4)
    moved = after(fake, page, lambda: page.keyboard.press("Shift+ArrowUp"))["panes"][0]["camera"]
    assert moved["target"][1] > 0


def test_a_camera_of_the_scene_is_chosen_by_its_name(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    view = after(fake, page, lambda: page.select_option("#camera", "above"))
    assert view["panes"][0]["camera"] == {"name": "above"}


def test_the_camera_never_turns_over(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    eye = page.evaluate("""async () => {
        const { orbit } = await import("/page/camera.js");
        const camera = { type: "perspective", eye: [0, 0, 2], target: [0, 0, 0], up: [0, 1, 0], fov: 40 };
        return [orbit(camera, 0, 100).eye, orbit(camera, 0, -100).eye, orbit({ ...camera, eye: [0, 2, 0] }, 0.1, -0.5).eye];
    }""")
    assert eye[0][1] == pytest.approx(2, abs=1e-3)
    assert eye[0][2] > 0
    assert eye[1][1] == pytest.approx(-2, abs=1e-3)
    assert np.linalg.norm(eye[2]) == pytest.approx(2)


def test_a_slider_changes_a_value_and_undo_takes_it_back(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    row = page.locator("[data-key='materials.red.ks']")
    view = after(fake, page, lambda: row.get_by_role("slider").fill("0.8"))
    assert view["panes"][0]["set"] == {"materials.red.ks": 0.8}
    assert text_of(page, ".count") == "1 value changed"
    assert after(fake, page, lambda: page.get_by_role("button", name="Undo").click())["panes"][0]["set"] == {}
    assert row.get_by_role("slider").input_value() == "0.5"
    assert after(fake, page, lambda: page.keyboard.press("Control+Shift+Z"))["panes"][0]["set"] == {"materials.red.ks": 0.8}
    back = row.get_by_role("button", name="ks: back to the value of the file")
    assert after(fake, page, back.click)["panes"][0]["set"] == {}


def test_a_number_outside_its_bounds_is_not_taken(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    field = page.locator("[data-key='materials.red.exponent'] input[type=number]")
    fake.received.clear()
    field.fill("-3")
    field.blur()
    page.wait_for_timeout(100)
    assert [message for message in fake.received if message["type"] == "view"] == []
    field.fill("2000")
    view = after(fake, page, field.blur)
    assert view["panes"][0]["set"] == {"materials.red.exponent": 2000}


def test_a_colour_picker_gives_linear_values(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    picker = page.locator("[data-key='materials.red.kd'] input[type=color]")
    view = after(fake, page, lambda: picker.fill("#ff8000"))
    assert view["panes"][0]["set"]["materials.red.kd"] == pytest.approx([1, 0.2159, 0], abs=1e-4)
    assert page.evaluate("""async () => {
        const { hexOf, linearOf } = await import("/page/colour.js");
        return [...Array(256).keys()].every((byte) => {
            const hex = "#" + byte.toString(16).padStart(2, "0").repeat(3);
            return hexOf(linearOf(hex)) === hex;
        });
    }""")


def test_another_model_forgets_the_parameters_of_the_old_one(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    after(fake, page, lambda: page.locator("[data-key='materials.red.ks']").get_by_role("slider").fill("0.8"))
    model = page.locator("[data-key='materials.red'] select")
    view = after(fake, page, lambda: model.select_option("ggx"))
    assert view["panes"][0]["set"] == {"materials.red": {"brdf": "ggx"}}


def test_the_copied_options_are_those_of_the_command_line(fake: FakeLive, open_page: Open) -> None:
    values = {
        'materials."v 1\'2".kd': [0.5, 1e-7, 1],
        "objects.0.material": 'gold "leaf"',
        "materials.red": {"brdf": "ggx", "roughness": 0.25},
        "quality.fold": True,
        "lights.0.intensity": -2.5,
    }
    page = open_page(fake.address)
    text = page.evaluate("async (set) => (await import('/page/values.js')).options(set, 'top view')", values)
    words = shlex.split(text)
    assert words[-2:] == ["--camera", "top view"]
    assert words[0:-2:2] == ["--set"] * len(values)
    pairs = [split(word) for word in words[1:-2:2]]
    assert {key: parse(value) for key, value in pairs} == values


def test_copy_puts_the_options_on_the_clipboard(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address, permissions=["clipboard-read", "clipboard-write"])
    assert page.get_by_role("button", name="Copy as --set").is_disabled()
    page.locator("#stage").focus()
    after(fake, page, lambda: page.keyboard.press("ArrowLeft"))
    page.get_by_role("button", name="Copy as --set").click()
    page.get_by_text("Copied.").first.wait_for()
    key, value = split(shlex.split(page.evaluate("navigator.clipboard.readText()"))[1])
    assert key == "camera"
    assert parse(value)["type"] == "perspective"


def test_written_values_are_forgotten_once_the_file_has_them(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    after(fake, page, lambda: page.locator("[data-key='materials.red.ks']").get_by_role("slider").fill("0.8"))
    page.get_by_role("button", name="Write back").click()
    page.get_by_text("Wrote 1 value into ball.toml.").wait_for()
    assert sent(fake, page, "write") == [{"type": "write", "values": {"materials.red.ks": 0.8}}]
    view = after(fake, page, lambda: fake.push(revision=13))
    assert view["panes"][0]["set"] == {}
    assert text_of(page, ".count") == "As in the file"


def test_a_click_picks_the_object_and_shows_its_values(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.locator("canvas.picture").first.click(position={"x": 100, "y": 60})
    page.locator("#object option:checked[value='objects.0']").wait_for(state="attached")
    assert sent(fake, page, "pick")[-1] == {"type": "pick", "pane": 0, "x": 100, "y": 60}
    assert page.locator("[data-key='objects.0.shading']").is_visible()
    view = after(fake, page, lambda: page.locator("[data-key='objects.0.shading'] select").select_option("flat"))
    assert view["panes"][0]["set"] == {"objects.0.shading": "flat"}


def test_the_probe_reads_a_pixel_by_mouse_and_by_keyboard(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.get_by_text("Probe", exact=True).click()
    page.locator("canvas.picture").first.click(position={"x": 10, "y": 20})
    page.get_by_role("heading", name="Pixel 10, 20").wait_for()
    assert "0.212639" in text_of(page, ".readout table")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Pixel 20, 19").wait_for()
    page.keyboard.press("Escape")
    assert page.locator("#probe").is_hidden()


def test_the_variables_of_a_pixel_can_be_shown_as_pictures(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.get_by_text("Probe", exact=True).click()
    page.locator("canvas.picture").first.click(position={"x": 10, "y": 20})
    rows = page.locator(".trace tbody tr")
    rows.last.wait_for()
    assert rows.nth(1).inner_text().split() == ["<surface>:150", "x149", "(2)", "0.123456789", "0.123500000", "3.8"]
    assert [rows.nth(index).get_attribute("class") for index in range(3)] == [None, "bad", None]
    assert rows.nth(2).get_by_role("button", name="m", exact=True).count() == 0
    view = after(fake, page, lambda: rows.nth(1).get_by_role("button", name="x149 (2)").click())
    assert view["panes"][1]["source"] == "variable"
    assert view["panes"][1]["variable"] == {"object": 0, "place": "<surface>:150", "name": "x149", "number": 1}
    assert text_of(page, "figure:nth-of-type(2) .caption") == "x149, <surface>:150"
    assert rows.first.is_visible(), "the probe stays"
    assert after(fake, page, lambda: page.select_option("#view-1", "heat"))["panes"][1]["source"] == "heat"


def test_the_source_marks_lines_that_lose_digits(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.get_by_role("tab", name="Source").click()
    page.locator(".listing .losing").wait_for()
    assert " ".join(text_of(page, ".listing [data-line='2']").split()) == "2 float far = NoH + 8192.0; loses 3.7 digits"
    assert "underline" in page.locator(".losing").evaluate("(e) => getComputedStyle(e).textDecorationLine")
    assert page.get_by_text("2 lines lose more than three digits.").first.is_visible()
    page.select_option("#source-file", "<surface>")
    assert page.locator(".listing .losing").count() == 0, "the line has another text, so another program's line is meant"

    page.get_by_text("Probe", exact=True).click()
    page.locator("canvas.picture").first.click(position={"x": 10, "y": 20})
    page.get_by_role("button", name="<surface>:150").first.click()
    page.locator(".listing .target").wait_for()
    assert text_of(page, ".listing .target").split() == ["150", "float", "x149;"]
    page.wait_for_timeout(100)
    assert page.locator(".listing .target").evaluate("(e) => e.getBoundingClientRect().top") < 900

    fake.received.clear()
    fake.push(revision=13)
    assert sent(fake, page, "source") == [{"type": "source", "object": 0}]
    assert sent(fake, page, "digits") == [{"type": "digits", "object": 0}]


def test_a_picture_may_be_verified_against_its_own_text(fake: FakeLive, open_page: Open) -> None:
    fake.judgement["derived"] = True
    page = open_page(fake.address)
    page.get_by_role("button", name="Verified against its own text").wait_for()


def test_two_views_side_by_side_and_under_a_swipe(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    view = after(fake, page, lambda: page.select_option("#view-1", "heat"))
    assert [pane["source"] for pane in view["panes"]] == ["picture", "heat"]
    page.get_by_text("difference, linear light").wait_for()
    boxes = [page.locator("canvas.picture").nth(index).bounding_box() for index in (0, 1)]
    assert boxes[0]["x"] + boxes[0]["width"] <= boxes[1]["x"]

    page.get_by_text("Swipe", exact=True).click()
    boxes = [page.locator("canvas.picture").nth(index).bounding_box() for index in (0, 1)]
    assert boxes[0] == boxes[1]
    handle = page.get_by_role("slider", name="Position of the swipe")
    handle.press("ArrowLeft")
    assert handle.get_attribute("aria-valuenow") == "48"
    box = handle.bounding_box()
    fake.received.clear()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(boxes[0]["x"] + boxes[0]["width"] / 4, box["y"] + 100, steps=4)
    page.mouse.up()
    assert abs(int(handle.get_attribute("aria-valuenow")) - 25) <= 1
    assert [message for message in fake.received if message["type"] == "view"] == []


@pytest.mark.parametrize(
    ("choice", "changes"),
    [
        ("flat", {"shading": "flat"}),
        ("previous", {"source": "previous"}),
        ("last_good", {"source": "last_good"}),
        ("reference", {"source": "reference"}),
        ("nan", {"paint": "nan"}),
        ("layer:normal", {"layer": "normal"}),
    ],
)
def test_each_view_asks_for_its_picture(fake: FakeLive, open_page: Open, choice: str, changes: dict[str, str]) -> None:
    page = open_page(fake.address)
    plain = sent(fake, page, "view")[-1]["panes"][0]
    view = after(fake, page, lambda: page.select_option("#view-0", choice))
    assert view["panes"][0] == {**plain, **changes}


def test_a_file_is_compared_by_its_path(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.select_option("#view-1", "file")
    page.locator("#file-1").fill("golden.png")
    view = after(fake, page, lambda: page.keyboard.press("Enter"))
    assert view["panes"][1]["source"] == "file:golden.png"


def test_problems_are_shown_with_a_caret_and_cleared(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    fake.push(
        revision=13, problems=[PROBLEM, {**PROBLEM, "line": None, "column": None, "excerpt": []}], stale=True, stale_of=12
    )
    page.get_by_role("heading", name="2 problems").wait_for()
    assert text_of(page, "#notice") == "stale: revision 12"
    assert page.locator("#problems h3").first.inner_text().startswith("shaders/brdf/blinn_phong.glsl:14:27")
    lines = text_of(page, ".excerpt").splitlines()
    assert [line.index("^") for line in lines if "^" in line] == [3 + PROBLEM["caret"] - 1]
    assert page.locator("canvas.picture").first.is_visible()
    fake.push(revision=14, problems=[], stale=False, stale_of=None)
    page.locator("#problems").wait_for(state="hidden")
    assert page.locator("#notice").is_hidden()


def test_unexplained_pixels_can_be_seen(fake: FakeLive, open_page: Open) -> None:
    fake.judgement = {"state": "failed", "text": "Too bright.", "unexplained": 2, "pixels": [[40, 50], [41, 50]]}
    page = open_page(fake.address)
    badge = page.get_by_role("button", name="2 pixels unexplained")
    badge.click()
    assert badge.get_attribute("aria-expanded") == "true"
    assert page.evaluate("document.querySelector('.overlay').getContext('2d').getImageData(0, 0, 512, 512).data.some(Boolean)")
    page.get_by_role("button", name="41, 50").click()
    page.get_by_role("heading", name="Pixel 41, 50").wait_for()


def test_an_edit_takes_the_verdict_back(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.get_by_role("button", name="Verified").wait_for()
    fake.push(revision=13)
    page.get_by_role("button", name="Not judged").wait_for()


def test_programs_name_their_reasons(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    page.get_by_role("tab", name="Values").focus()
    page.keyboard.press("ArrowRight")
    page.get_by_text("blinn_phong, phong").click()
    page.get_by_text("one directional light: the loop is unrolled").wait_for()
    assert page.locator("#values").is_hidden()


def test_values_that_no_longer_fit_are_dropped(fake: FakeLive, open_page: Open) -> None:
    page = open_page(fake.address)
    after(fake, page, lambda: page.locator("[data-key='materials.red.ks']").get_by_role("slider").fill("0.8"))
    view = after(fake, page, lambda: fake.push(revision=13, controls={"groups": []}))
    assert view["panes"][0]["set"] == {}


STATES = {
    "plain": {},
    "stale": {"problems": [PROBLEM], "stale": True, "stale_of": 11},
}


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_scrolls_in_one_direction_only(fake: FakeLive, open_page: Open, state: str, scheme: str) -> None:
    fake.state |= STATES[state]
    page = open_page(fake.address, width=390, height=844, has_touch=True, is_mobile=True, color_scheme=scheme)
    page.select_option("#view-1", "heat")
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    heights = page.evaluate("[...document.querySelectorAll('#toolbar select, .tabs button')].map((e) => e.offsetHeight)")
    assert min(heights) >= 40
    # The pictures lie side by side or one above the other, whichever makes them larger when the texts have found their places.
    # Side by side they have 12 pixels to each side of them: (390 - 3 * 12) / 2.
    page.wait_for_timeout(1000)
    canvas = page.locator("canvas.picture").first.bounding_box()
    assert canvas["width"] >= 177


def test_every_control_has_a_name_for_a_screen_reader(fake: FakeLive, open_page: Open) -> None:
    fake.state |= STATES["stale"]
    page = open_page(fake.address)
    page.select_option("#view-1", "heat")
    page.get_by_text("Swipe", exact=True).click()
    nodes = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]

    def focusable(node: dict[str, Any]) -> bool:
        return any(entry["name"] == "focusable" and entry["value"].get("value") for entry in node.get("properties", []))

    controls = [node for node in nodes if focusable(node) and not node["ignored"] and node["role"]["value"] != "RootWebArea"]
    assert len(controls) > 30
    assert [node for node in controls if not node.get("name", {}).get("value")] == []


def test_the_page_says_that_the_server_is_gone(fake: FakeLive, open_page: Open, browser: Any) -> None:
    context = browser.new_context()
    page = context.new_page()
    page.goto(fake.address)
    page.wait_for_selector("canvas[data-still=true]")
    context.set_offline(True)
    for connection in fake.connections:
        connection.close()
    page.get_by_text("The server does not answer.").first.wait_for()
    assert page.locator("canvas.picture").first.is_visible()
    context.set_offline(False)
    page.locator("#notice").wait_for(state="hidden")
    context.close()
