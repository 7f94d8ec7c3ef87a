"""The command `glshade dev` as a whole: a server, its drawer and its judge, and a client in place of a browser."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from support.live import PageClient
from websockets.sync.client import connect
from websockets.typing import Origin

import glshade
from glshade.glsl.shaders import SHIPPED

SCENE = """# One ball.
[[objects]]
shape = "sphere"
material = "body"
[materials.body]
brdf = "phong"
kd = [0.6, 0.1, 0.1]  # red
[[lights]]
type = "directional"
[film]
size = [64, 48]
"""


@dataclass
class Dev:
    """A command that runs.

    folder: folder of the scene file scene.toml, and of the shader folder shaders
    process: the process of the server
    origin, token: the parts of the printed address
    """

    folder: Path
    process: subprocess.Popen[str]
    origin: str
    token: str

    @property
    def scene(self) -> Path:
        return self.folder / "scene.toml"

    @property
    def shader(self) -> Path:
        return self.folder / "shaders" / "brdf" / "phong.glsl"

    @contextmanager
    def page(self) -> Iterator[PageClient]:
        """Returns a context with a page that is connected."""
        headers = {"Authorization": f"Bearer {self.token}"}
        address = f"{self.origin.replace('http', 'ws', 1)}/socket"
        with connect(
            address, origin=Origin(self.origin), additional_headers=headers, compression=None, proxy=None, max_size=None
        ) as socket:
            yield PageClient(socket)

    def get(self, target: str) -> Any:
        """Returns the answer to a request with the token."""
        request = urllib.request.Request(self.origin + target, headers={"Authorization": f"Bearer {self.token}"})
        return urllib.request.urlopen(request, timeout=60)

    def drawer(self) -> int:
        """Returns the id of the drawer's process."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return next(int(pid) for pid in children if b"glshade.live.drawer" in Path(f"/proc/{pid}/cmdline").read_bytes())


@pytest.fixture(scope="module")
def dev(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Dev]:
    """A command that runs, with a copy of the file brdf/phong.glsl in its shader folder."""
    folder = tmp_path_factory.mktemp("dev")
    (folder / "scene.toml").write_text(SCENE)
    (folder / "shaders" / "brdf").mkdir(parents=True)
    (folder / "shaders" / "brdf" / "phong.glsl").write_text((SHIPPED / "brdf" / "phong.glsl").read_text())
    command = [
        sys.executable,
        "-m",
        "glshade",
        "dev",
        str(folder / "scene.toml"),
        "--json",
        "--shaders",
        str(folder / "shaders"),
    ]
    # A pipe would fill up, because nobody reads the events.
    events = folder / "events.jsonl"
    with events.open("w") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.PIPE, text=True)
    try:
        while "\n" not in events.read_text():
            assert process.poll() is None
            time.sleep(0.02)
        origin, _, token = json.loads(events.read_text().partition("\n")[0])["address"].partition("/?token=")
        yield Dev(folder, process, origin, token)
    finally:
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
        assert (process.returncode, errors) == (130, "\nglshade: interrupted\n")


def _shown(page: PageClient, number: int, **view: Any) -> dict[str, Any]:
    """Returns the picture of a view, which is acknowledged."""
    page.view(number, panes=[view])
    while True:
        frame = page.receive("frame")
        page.send("shown", number=frame["number"])
        if frame["number"] == number:
            return frame


def _state(page: PageClient, **wanted: Any) -> dict[str, Any]:
    """Returns the first state that has some values."""
    while True:
        state = page.receive("state")
        if all(state[key] == value for key, value in wanted.items()):
            return state


def _rendered(dev: Dev) -> bytes:
    """Returns the bytes of the picture file of `glshade render`."""
    scene = glshade.load(dev.scene)
    return glshade.render(scene, shaders=[dev.folder / "shaders"]).png()


class TestDev:
    """Each test leaves the files as it found them."""

    def test_a_still_picture_is_that_of_render(self, dev: Dev) -> None:
        answer = dev.get("/frame.png")
        assert answer.headers["Content-Type"] == "image/png"
        assert answer.read() == _rendered(dev)
        with dev.page() as page:
            assert _shown(page, 1)["data"] == _rendered(dev)

    def test_edit_break_and_mend_a_shader(self, dev: Dev) -> None:
        good = dev.shader.read_text()
        with dev.page() as page:
            before = _shown(page, 1)
            dev.shader.write_text(good.replace("INV_PI", "0.5 * INV_PI"))
            edited = page.receive("frame")
            page.send("shown", number=1)
            assert edited["revision"] > before["revision"]
            assert edited["data"] == _rendered(dev) != before["data"]
            dev.shader.write_text(good.replace("vec3 brdf_cos(", "vec3 brdf_cos(("))
            state = _state(page, stale=True)
            assert state["stale_of"] == edited["revision"]
            problem = state["problems"][0]
            line = good[: good.index("vec3 brdf_cos(")].count("\n") + 1
            assert (problem["file"], problem["line"]) == (str(dev.shader), line)
            assert "vec3 brdf_cos((" in problem["excerpt"][line - problem["first_line"]]
            # The last good picture can be turned.
            turned = _shown(
                page, 2, camera={"type": "perspective", "eye": [4, 0, 0], "target": [0, 0, 0], "up": [0, 1, 0], "fov": 40}
            )
            assert (turned["revision"], turned["stale"]) == (edited["revision"], True)
            dev.shader.write_text(good)
            assert _state(page, stale=False)["problems"] == []

    def test_break_and_mend_the_scene(self, dev: Dev) -> None:
        with dev.page() as page:
            dev.scene.write_text(SCENE.replace("kd =", "kq ="))
            problem = _state(page, stale=True)["problems"][0]
            assert (problem["file"], problem["line"], problem["stage"]) == (str(dev.scene), 7, "scene")
            dev.scene.write_text(SCENE)
            assert _state(page, stale=False)["problems"] == []

    @pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="the drawer is looked up in /proc")
    def test_a_drawer_that_is_killed_is_replaced(self, dev: Dev) -> None:
        with dev.page() as page:
            before = _shown(page, 1)
            drawer = dev.drawer()
            os.kill(drawer, signal.SIGKILL)
            after = _shown(page, 2, size=[65, 48])
            assert (after["width"], after["revision"]) == (65, before["revision"])
            assert dev.drawer() != drawer

    def test_the_badge(self, dev: Dev) -> None:
        with dev.page() as page:
            _shown(page, 1)
            page.send("judge")
            assert page.receive("judged")["state"] == "judging"
            assert page.receive("judged")["state"] == "verified"

    def test_a_value_is_written_back(self, dev: Dev) -> None:
        with dev.page() as page:
            _state(page, drawer="ready")
            page.send("write", values={"materials.body.kd": [0.2, 0.4, 0.6]})
            assert page.receive("written")["ok"]
            assert dev.scene.read_text() == SCENE.replace("[0.6, 0.1, 0.1]", "[0.2, 0.4, 0.6]")
            dev.scene.write_text(SCENE)


def _in_place(path: Path, text: str) -> None:
    path.write_text(text)


def _renamed(path: Path, text: str) -> None:
    beside = path.with_name(".beside")
    beside.write_text(text)
    beside.replace(path)


def _with_backup(path: Path, text: str) -> None:
    """Vim moves the old file aside, writes the new one, and deletes the old one."""
    backup = path.with_name(path.name + "~")
    path.rename(backup)
    path.write_text(text)
    backup.unlink()


def _truncated_first(path: Path, text: str) -> None:
    with path.open("w") as file:
        file.flush()
        time.sleep(0.02)
        file.write(text[: len(text) // 2])
        file.flush()
        time.sleep(0.005)
        file.write(text[len(text) // 2 :])


def _gone_and_back(path: Path, text: str) -> None:
    path.unlink()
    time.sleep(0.05)
    path.write_text(text)


def _by_a_link(path: Path, text: str) -> None:
    """Another file becomes the target of a symbolic link."""
    target = path.with_name(f".{time.time_ns()}")
    target.write_text(text)
    old = path.resolve() if path.is_symlink() else None
    link = path.with_name(".link")
    link.symlink_to(target.name)
    link.replace(path)
    if old is not None:
        old.unlink()


SAVES = (_in_place, _renamed, _with_backup, _truncated_first, _gone_and_back, _by_a_link)
EDITS = 1000
# The processes are warm after this number of edits.
WARM = 200


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is looked up in /proc")
def test_a_thousand_edits(dev: Dev) -> None:
    good = dev.shader.read_text()
    variants = [good.replace("INV_PI", f"{0.3 + 0.1 * x:.1f} * INV_PI") for x in range(7)]
    pictures = []
    for text in variants:
        dev.shader.write_text(text)
        pictures.append(_rendered(dev))
    assert len(set(pictures)) == len(pictures)
    picture, memory = pictures[-1], {}
    for edit in range(EDITS):
        is_broken = edit % 3 == 2
        text = variants[edit % 7]
        SAVES[edit % 6](dev.shader, text.replace("vec3 brdf_cos(", "vec3 brdf_cos((") if is_broken else text)
        picture = picture if is_broken else pictures[edit % 7]
        deadline = time.monotonic() + 20
        while True:
            state = json.load(dev.get("/state.json"))
            if state["stale"] == is_broken == bool(state["problems"]) and dev.get("/frame.png").read() == picture:
                break
            assert time.monotonic() < deadline, (edit, SAVES[edit % 6], state["problems"])
            time.sleep(0.01)
        if edit in (WARM, EDITS - 1):
            memory[edit] = _memory(dev.process.pid), _memory(dev.drawer())
    dev.shader.unlink()
    dev.shader.write_text(good)
    server, drawer = zip(*memory.values(), strict=True)
    assert server[1] <= 1.05 * server[0]
    assert drawer[1] <= 1.05 * drawer[0]


def _memory(pid: int) -> int:
    """Returns the memory of a process that is resident [pages]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1])
