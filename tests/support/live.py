"""Live: a server of `glshade dev` whose drawer, judge and watcher are replaced, so that no test waits for OpenGL."""

from __future__ import annotations

import asyncio
import http.client
import json
import struct
import threading
from collections.abc import AsyncIterator, Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from support.requests import TOKEN
from websockets.sync.client import ClientConnection, connect

from glshade.live import session as session_module
from glshade.live.access import Access, hosts
from glshade.live.child import ChildLost
from glshade.live.messages import (
    Answer,
    Draw,
    Failed,
    Frame,
    Judged,
    Load,
    Loaded,
    LostDigits,
    MeasureDigits,
    Pick,
    Picked,
    Probe,
    Probed,
    ReadSource,
    Reference,
    Request,
    Restore,
    ShowVariable,
    Source,
    Trace,
    Traced,
    Verify,
)
from glshade.live.server import Listener, serve
from glshade.live.session import Session, Settings

PICTURE = b"the bytes of a picture"


class FakeChild:
    """Answers as a drawer and a judge would. A test replaces `answer` to do otherwise.

    asked: the requests in their order
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        self.asked: list[Request] = []
        self.pid = 0
        self.alive = False
        self.shown = 0
        self.answer: Callable[[Request], Answer | None] = lambda request: None
        self.release = asyncio.Event()
        self.release.set()

    async def start(self) -> None:
        if not self.alive:
            self.pid, self.alive, self.shown = self.pid + 1, True, 0

    async def ask(self, request: Request) -> Answer:
        await self.start()
        self.asked.append(request)
        await self.release.wait()
        if not self.alive:
            raise ChildLost("was ended by SIGKILL")
        answer = self.answer(request) or self._answer(request)
        if isinstance(answer, Loaded) and answer.ok:
            self.shown = answer.shown
        return answer

    def kill(self) -> None:
        self.alive = False
        self.release.set()

    async def stop(self) -> None:
        self.kill()

    def dies(self) -> ChildLost:
        """Ends the process, and returns the error that its request raises."""
        self.alive = False
        return ChildLost("was ended by SIGSEGV")

    def _answer(self, request: Request) -> Answer:
        if isinstance(request, Load):
            return Loaded(
                id=0,
                revision=request.revision,
                shown=request.revision,
                dependencies=["/file"],
                folders=["/folder"],
                snapshot=f"{request.revision}",
            )
        if isinstance(request, Restore):
            return Loaded(id=0, revision=int(request.folder), shown=int(request.folder), snapshot=request.folder)
        if isinstance(request, Verify):
            return Judged(id=0, verdict="verified", text="verified", revision=1)
        if isinstance(request, Pick):
            return Picked(id=0, object="ball", key="objects.0")
        if isinstance(request, Probe):
            black = (0, 0, 0)
            return Probed(id=0, x=request.x, y=request.y, value=black, reference=black, low=black, high=black, kind="interior")
        if isinstance(request, Trace):
            return Traced(id=0, x=request.x, y=request.y, object=0, steps=[{"name": "NoL"}], revision=self.shown)
        if isinstance(request, MeasureDigits):
            lines = [{"file": "a.glsl", "line": 3}]
            return LostDigits(id=0, object=request.object, lines=lines, revision=self.shown)
        if isinstance(request, ReadSource):
            return Source(id=0, object=request.object, name="ball", files=[{"file": "a.glsl"}], revision=self.shown)
        assert isinstance(request, Draw | Reference | ShowVariable)
        width, height = request.view.get("size") or (4, 3)
        return Frame(id=0, data=PICTURE, width=width, height=height, revision=self.shown)


class FakeWatcher:
    """Reports the changes that a test puts into `queue`; None ends the watcher, and the server with it."""

    def __init__(self) -> None:
        self.queue: asyncio.Queue[set[Path] | None] = asyncio.Queue()
        self.paths: list[Path] = []

    def watch(self, paths: Iterable[Path], since: float = 0.0) -> None:
        self.paths = list(paths)

    async def changes(self) -> AsyncIterator[set[Path]]:
        while (paths := await self.queue.get()) is not None:
            yield paths


class Running:
    """A server that runs in a thread.

    port: its port
    drawer, judge, watcher: the replacements of the parts of its session
    events: the events that it has reported
    """

    def __init__(self, settings: Settings) -> None:
        self.events: list[dict[str, Any]] = []
        self.listener = Listener("127.0.0.1", 0)
        self.port = self.listener.port
        self.access = Access(TOKEN, hosts("127.0.0.1", self.port))
        self.loop: asyncio.AbstractEventLoop
        self._ready: Future[None] = Future()
        self._settings = settings
        self.thread = threading.Thread(target=lambda: asyncio.run(self._run()))

    async def _run(self) -> None:
        self.loop = asyncio.get_running_loop()
        self.session = Session(self._settings, self.events.append)
        self.drawer: Any = self.session._supervisor._drawer
        self.judge: Any = self.session._judge
        self.watcher: Any = self.session._watcher
        self._ready.set_result(None)
        await serve(self.session, self.access, self.listener)

    def start(self) -> None:
        self.thread.start()
        self._ready.result(10)
        self.wait_for("revision")

    def change(self, *paths: str) -> None:
        """Reports changed files, and waits for the revision that they make."""
        known = len(self.events)
        self.loop.call_soon_threadsafe(self.watcher.queue.put_nowait, set(map(Path, paths)))
        self.wait_for("revision", known)

    def stop(self) -> None:
        """Ends the server, unless it has ended."""
        if self.thread.is_alive():
            self.loop.call_soon_threadsafe(self.watcher.queue.put_nowait, None)
            self.thread.join(10)
        assert not self.thread.is_alive()

    def wait_for(self, event: str, known: int = 0) -> dict[str, Any]:
        """Returns the first event of a kind after the known ones."""
        for _ in range(500):
            found = [each for each in self.events[known:] if each["event"] == event]
            if found:
                return found[0]
            threading.Event().wait(0.01)
        raise AssertionError(f"no event {event}: {self.events}")

    def get(self, target: str, *headers: tuple[str, str], method: str = "GET") -> http.client.HTTPResponse:
        """Returns the answer to a request with the token; its body has been read into `data`."""
        given = headers or (("Host", f"127.0.0.1:{self.port}"), ("Authorization", f"Bearer {TOKEN}"))
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10)
        try:
            connection.putrequest(method, target, skip_host=True, skip_accept_encoding=True)
            for name, value in given:
                connection.putheader(name, value)
            connection.endheaders()
            answer = connection.getresponse()
            answer.data = answer.read()  # type: ignore[attr-defined]
            return answer
        finally:
            connection.close()

    @contextmanager
    def page(self, **options: Any) -> Iterator[PageClient]:
        """Returns a context with a page that is connected."""
        origin = f"http://127.0.0.1:{self.port}"
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with connect(
            f"ws://127.0.0.1:{self.port}/socket",
            origin=origin,
            additional_headers=headers,
            compression=None,
            proxy=None,
            **options,
        ) as s:
            yield PageClient(s)


class PageClient:
    """A page, as far as the server sees it."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket

    def send(self, kind: str, **table: Any) -> None:
        self.socket.send(json.dumps({"type": kind, **table}))

    def view(self, number: int = 1, moving: bool = False, panes: list[dict[str, Any]] | None = None) -> None:
        self.send("view", number=number, moving=moving, panes=[{}] if panes is None else panes)

    def receive(self, kind: str) -> dict[str, Any]:
        """Returns the next message of a kind, and drops those before it. A picture is of the kind "frame"."""
        while True:
            data = self.socket.recv(timeout=10)
            message = unpacked(data) if isinstance(data, bytes) else json.loads(data)
            if message["type"] == kind:
                return message

    def nothing(self, kind: str, seconds: float = 0.3) -> bool:
        """Returns whether no message of a kind arrives for a time."""
        try:
            while True:
                data = self.socket.recv(timeout=seconds)
                if (unpacked(data) if isinstance(data, bytes) else json.loads(data))["type"] == kind:
                    return False
        except TimeoutError:
            return True


def unpacked(data: bytes) -> dict[str, Any]:
    """Returns the header of a binary message, with the keys "type", "pane" and "data"."""
    version, pane, length = struct.unpack(">BBI", data[:6])
    assert version == 1
    return {**json.loads(data[6 : 6 + length]), "type": "frame", "pane": pane, "data": data[6 + length :]}


@contextmanager
def running(patch: pytest.MonkeyPatch, **settings: Any) -> Iterator[Running]:
    """Returns a context in which a server runs."""
    patch.setattr(session_module, "Child", FakeChild)
    patch.setattr(session_module, "Watcher", FakeWatcher)
    server = Running(Settings(**{"scene": "scene.toml", **settings}))
    server.start()
    try:
        yield server
    finally:
        server.stop()


def failure(message: str) -> Failed:
    """Returns the answer to a request that cannot be fulfilled."""
    return Failed(id=0, problems=[{"message": message}])
