"""Live: measures `glshade dev`: the time from an edit to its picture, the pictures of a movement, and the cost of waiting.

A client in this process takes the place of the page, and acknowledges each picture at once. It does not decode the pictures,
which takes a browser a few milliseconds.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from glshade.errors import GlshadeError, MissingLibrary
from glshade.glsl.shaders import SHIPPED

# The targets, for a picture of SIDE x SIDE pixels on two cores that are otherwise idle.
EDIT_MEDIAN, EDIT_P95, FURTHER_PROGRAM = 150.0, 220.0, 60.0  # [ms]
MOVE_RATE, MOVE_P95 = 30.0, 60.0  # [1/s], [ms]
IDLE_SHARE = 0.01  # of a core
SIDE = 512
# The models whose files are edited, one after the other: each stands for one program of the scene.
MODELS = ("phong", "blinn_phong", "lambert")
# The pictures of a movement, and how long an idle server is watched [s].
MOVES, REST = 60, 5.0
# `glshade dev` reports the times of the steps between an edit and its picture. The last step is the rest of the whole time.
DELIVER = "deliver"
# The longest time for which the client waits [s].
PATIENCE = 60.0


@dataclass(frozen=True)
class Latency:
    """Times of one kind [ms].

    median: the median of the times
    p95: the time that 95 of 100 do not exceed
    """

    median: float
    p95: float

    @classmethod
    def of(cls, milliseconds: Sequence[float]) -> Latency:
        """Returns the latency that these times have [ms]."""
        return cls(median(milliseconds), float(np.percentile(milliseconds, 95)))

    def as_dict(self) -> dict[str, float]:
        """Returns the times as JSON types."""
        return {"median": round(self.median, 1), "p95": round(self.p95, 1)}


@dataclass(frozen=True)
class Edit:
    """The time from an edit to its picture.

    programs: number of programs that the edit changes
    latency: the whole time [ms]
    steps: step -> median of its time [ms]
    """

    programs: int
    latency: Latency
    steps: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Returns the times as JSON types."""
        steps = {name: round(value, 1) for name, value in self.steps.items()}
        return {"programs": self.programs, "milliseconds": self.latency.as_dict(), "steps": steps}


@dataclass(frozen=True)
class Movement:
    """The pictures while a page moves something.

    name: "orbit", which turns the camera, or "slider", which changes a value of a material
    rate: number of pictures a second
    latency: the time from a move to its picture [ms]
    """

    name: str
    rate: float
    latency: Latency

    @property
    def met(self) -> bool:
        """Whether the targets are met."""
        return self.rate >= MOVE_RATE and self.latency.p95 <= MOVE_P95

    def as_dict(self) -> dict[str, Any]:
        """Returns the figures as JSON types."""
        rate = round(self.rate, 1)
        return {"name": self.name, "per_second": rate, "milliseconds": self.latency.as_dict(), "met": self.met}


@dataclass(frozen=True)
class LiveFigures:
    """All measurements.

    driver: name of the driver
    edits: one for each number of changed programs, ascending from 1
    movements: orbit and slider
    idle: share of one core that the server and its processes take while nothing happens; None where /proc does not exist
    """

    driver: str
    edits: tuple[Edit, ...]
    movements: tuple[Movement, ...]
    idle: float | None

    @property
    def further(self) -> float:
        """The time that one further changed program adds to the median [ms]."""
        first, last = self.edits[0], self.edits[-1]
        return (last.latency.median - first.latency.median) / max(last.programs - first.programs, 1)

    @property
    def met(self) -> bool:
        """Whether all targets are met."""
        first = self.edits[0].latency
        edits = first.median <= EDIT_MEDIAN and first.p95 <= EDIT_P95 and self.further <= FURTHER_PROGRAM
        return edits and all(movement.met for movement in self.movements) and (self.idle or 0.0) <= IDLE_SHARE

    def as_dict(self) -> dict[str, Any]:
        """Returns the measurements as JSON types."""
        return {
            "driver": self.driver,
            "size": [SIDE, SIDE],
            "edits": [edit.as_dict() for edit in self.edits],
            "further_program_milliseconds": round(self.further, 1),
            "movements": [movement.as_dict() for movement in self.movements],
            "idle_share": self.idle and round(self.idle, 4),
            "met": self.met,
        }

    def table(self) -> list[list[str]]:
        """Returns the measurements as rows for people, the heads first."""
        rows = [["measurement", "median", "p95", "target", "of which"]]
        for edit in self.edits:
            name = f"edit of {edit.programs} program" + ("s" if edit.programs > 1 else "")
            target = f"{EDIT_MEDIAN:g}, {EDIT_P95:g} ms" if edit.programs == 1 else f"+{FURTHER_PROGRAM:g} ms a program"
            steps = ", ".join(f"{step} {value:.0f}" for step, value in edit.steps.items())
            rows.append([name, f"{edit.latency.median:.0f} ms", f"{edit.latency.p95:.0f} ms", target, steps])
        for move in self.movements:
            target = f"{MOVE_RATE:g}/s, {MOVE_P95:g} ms"
            times = f"{move.latency.median:.0f} ms", f"{move.latency.p95:.0f} ms"
            rows.append([move.name, *times, target, f"{move.rate:.0f} pictures a second"])
        if self.idle is not None:
            rows.append(["idle", f"{self.idle:.1%}", "", f"{IDLE_SHARE:.0%}", "share of one core"])
        return rows


def measure_live(repeat: int, backend: str = "auto", device: int | None = None) -> LiveFigures:
    """Measures a server that is started for it.

    repeat: number of edits for each number of programs
    backend: OpenGL backend, as Renderer takes it
    device: index of the EGL device; None selects the default
    Errors: MissingLibrary; GlshadeError if the server does not start or a picture does not come.
    """
    try:
        import websockets  # noqa: F401
    except ModuleNotFoundError:
        raise MissingLibrary("`glshade bench live` needs websockets: pip install 'glshade[live]'") from None
    with tempfile.TemporaryDirectory(prefix="glshade-bench-") as folder:
        scene, files = _write_files(Path(folder))
        options = ["--backend", backend, *([] if device is None else ["--device", str(device)])]
        command = [sys.executable, "-m", "glshade", "dev", str(scene), "--json", "--shaders", str(Path(folder, "shaders"))]
        with _server([*command, *options]) as (process, address), _connected(address) as page:
            page.ask({})
            edits = tuple(_edits(page, files[:count], repeat) for count in range(1, len(files) + 1))
            movements = (_moves(page, "orbit", _orbit), _moves(page, "slider", _slider))
            idle = _idle(process.pid, REST)
        return LiveFigures(page.driver, edits, movements, idle)


def _write_files(folder: Path) -> tuple[Path, list[Path]]:
    """Writes the scene and its shader folder. Returns the scene file, and a shader file for each program."""
    shape = '{ type = "sphere", segments = 46, rings = 24 }'
    objects = "".join(
        f'[[objects]]\nshape = {shape}\nmaterial = "{model}"\ntransform = {{ translate = [{2.2 * (x - 1)}, 0, 0] }}\n'
        for x, model in enumerate(MODELS)
    )
    materials = "".join(f'[materials.{model}]\nbrdf = "{model}"\n' for model in MODELS)
    light = '[[lights]]\ntype = "directional"\ndirection = [0.6, -0.7, -0.7]\n'
    scene = folder / "scene.toml"
    scene.write_text(f"{objects}{light}{materials}[film]\nsize = [{SIDE}, {SIDE}]\n", encoding="utf-8")
    files = [folder / "shaders" / "brdf" / f"{model}.glsl" for model in MODELS]
    files[0].parent.mkdir(parents=True)
    for file in files:
        shutil.copy(Path(SHIPPED, "brdf", file.name), file)
    return scene, files


@contextmanager
def _server(command: list[str]) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Returns a context with a server's process and the address of its page. Errors: GlshadeError."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        if not line:
            raise GlshadeError("the server did not start")
        yield process, json.loads(line)["address"]
    finally:
        process.terminate()
        process.communicate()


class _Page:
    """Takes the place of a page in a browser.

    driver: name of the driver, once a state has arrived
    """

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self._number = 0
        self._state: dict[str, Any] = {}

    @property
    def driver(self) -> str:
        return str(self._state.get("info", {}).get("driver", ""))

    def ask(self, view: dict[str, Any], moving: bool = False) -> dict[str, Any]:
        """Returns the header of the picture of a view."""
        self._number += 1
        message = {"type": "view", "number": self._number, "moving": moving, "panes": [view]}
        self._socket.send(json.dumps(message))
        return self.picture(lambda header: header["number"] == self._number)

    def picture(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Returns the header of the next picture that is wanted. Errors: GlshadeError if it does not come."""
        while True:
            try:
                data = self._socket.recv(timeout=PATIENCE)
            except TimeoutError:
                raise GlshadeError(f"no picture has come within {PATIENCE:g} s") from None
            if isinstance(data, str):
                message = json.loads(data)
                if message["type"] == "state":
                    self._state = message
                continue
            _, _, length = struct.unpack_from(">BBI", data)
            header: dict[str, Any] = json.loads(data[6 : 6 + length])
            self._socket.send(json.dumps({"type": "shown", "number": header["number"]}))
            if not header["width"]:
                raise GlshadeError(f"there is no picture: {header['text']}")
            if wanted(header):
                return header

    def steps(self, revision: int) -> dict[str, float]:
        """Returns step -> time of the load of a revision [ms]."""
        while self._state["revision"] != revision:
            message = json.loads(self._socket.recv(timeout=PATIENCE))
            if message["type"] == "state":
                self._state = message
        return dict(self._state["milliseconds"])


@contextmanager
def _connected(address: str) -> Iterator[_Page]:
    """Returns a context with a page at the address that `glshade dev` printed."""
    from websockets.sync.client import connect
    from websockets.typing import Origin

    origin, _, token = address.partition("/?token=")
    headers = {"Authorization": f"Bearer {token}"}
    uri = f"{origin.replace('http', 'ws', 1)}/socket"
    options: dict[str, Any] = {"compression": None, "max_size": None, "proxy": None}
    with connect(uri, origin=Origin(origin), additional_headers=headers, **options) as socket:
        yield _Page(socket)


def _edits(page: _Page, files: Sequence[Path], repeat: int) -> Edit:
    """Measures edits that change these files together."""
    times: list[float] = []
    steps: dict[str, list[float]] = defaultdict(list)
    header = page.ask({})
    # The first edit is not counted, because the driver fills its caches in it.
    for turn in range(repeat + 1):
        # No text has been compiled before, not even by an earlier run.
        factor = 1.0 - 1e-9 * (time.time_ns() % 10**8)
        texts = [re.sub(r"(INV_PI\b)( \* [01]\.\d+)?", rf"\1 * {factor:.9f}", file.read_text()) for file in files]
        start = time.perf_counter()
        for file, text in zip(files, texts, strict=True):
            file.write_text(text, encoding="utf-8")
        header = page.picture(partial(_is_newer, header["revision"]))
        milliseconds = 1e3 * (time.perf_counter() - start)
        loaded = page.steps(header["revision"])
        if turn:
            times.append(milliseconds)
            named = {**loaded, "encode": header["milliseconds"]["encode"]}
            for name, value in {**named, DELIVER: max(milliseconds - sum(named.values()), 0.0)}.items():
                steps[name].append(value)
    return Edit(len(files), Latency.of(times), {name: median(values) for name, values in steps.items()})


def _is_newer(revision: int, header: dict[str, Any]) -> bool:
    """Returns whether a picture shows a later revision."""
    return int(header["revision"]) > revision


def _moves(page: _Page, name: str, view: Callable[[float], dict[str, Any]]) -> Movement:
    """Measures pictures of a movement, of which the next one begins when the last picture has come.

    view: returns the view at a share of the movement, from 0 to 1
    """
    times = []
    # The first pictures decide the size at which the server draws.
    for move in range(-10, MOVES):
        start = time.perf_counter()
        page.ask(view(max(move, 0) / MOVES), moving=True)
        if move >= 0:
            times.append(1e3 * (time.perf_counter() - start))
    page.ask({})
    return Movement(name, 1e3 * len(times) / sum(times), Latency.of(times))


def _orbit(share: float) -> dict[str, Any]:
    angle = 2 * np.pi * share
    eye = [7 * float(np.sin(angle)), 1.5, 7 * float(np.cos(angle))]
    return {"camera": {"type": "perspective", "eye": eye, "target": [0, 0, 0], "up": [0, 1, 0], "fov": 40}}


def _slider(share: float) -> dict[str, Any]:
    return {"set": {"materials.phong.exponent": 10 + 50 * share}}


def _idle(pid: int, seconds: float) -> float | None:
    """Returns the share of one core that a process and its children take [1]; None where /proc does not exist."""
    before = _processor_time(pid)
    if before is None:
        return None
    time.sleep(seconds)
    after = _processor_time(pid)
    return None if after is None else (after - before) / seconds


def _processor_time(pid: int) -> float | None:
    """Returns the processor time of a process and its children [s]; None where /proc does not exist."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        # The fields follow the name, which stands in brackets: the times in user mode and in the kernel are the 12th and 13th.
        ticks = [Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()[11:13] for each in (pid, *children)]
    except OSError:
        return None
    return sum(map(int, np.ravel(ticks))) / os.sysconf("SC_CLK_TCK")
