"""Viewer: one page that is connected. It takes the page's wishes, and sends it pictures and answers.

A page may ask faster than the drawer draws, and take pictures more slowly than they are drawn. So nothing queues up: of each
kind of wish only the newest is kept, and each pane has at most one picture on its way that the page has not acknowledged.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import asdict
from typing import Any, Generic, Protocol, TypeVar

from glshade.live import wire
from glshade.live.messages import Answer, Failed, Frame, Judged, LostDigits, Picked, Probed, Source, Traced
from glshade.live.session import Session

# The time in which a page must take a message, before its connection is closed [s].
PATIENCE = 10.0
# Codes of the WebSocket protocol for the reason why a connection is closed.
POLICY_VIOLATION, TRY_AGAIN_LATER = 1008, 1013

T = TypeVar("T")


class Socket(Protocol):
    """The connection to a page, as starlette's WebSocket."""

    async def send_text(self, data: str) -> None: ...
    async def send_bytes(self, data: bytes) -> None: ...
    async def receive_text(self) -> str: ...


class SlowReader(Exception):
    """A page did not take a message within PATIENCE."""


class Newest(Generic[T]):
    """A place for one value, in which a newer value replaces an older one that nobody has taken."""

    def __init__(self) -> None:
        self._value: T | None = None
        self._filled = asyncio.Event()

    def put(self, value: T) -> None:
        """Replaces the value."""
        self._value = value
        self._filled.set()

    async def take(self) -> T:
        """Waits for a value, and takes it."""
        await self._filled.wait()
        self._filled.clear()
        assert self._value is not None
        return self._value


class Pane:
    """One of the pictures of a page.

    index: index of the pane
    wanted: the message that asked for the picture; None before the first one, and where the page has fewer panes
    changed: set while a picture is due
    in_flight: number of the view whose picture the page has not acknowledged; None if there is none
    """

    def __init__(self, index: int) -> None:
        self.index = index
        self.wanted: wire.ViewMessage | None = None
        self.changed = asyncio.Event()
        self.in_flight: int | None = None
        self._free = asyncio.Event()
        self._free.set()

    @property
    def view(self) -> wire.View | None:
        """The view that the pane shows; None where the page has fewer panes."""
        if self.wanted is None or self.index >= len(self.wanted.panes):
            return None
        return self.wanted.panes[self.index]

    def sent(self, number: int) -> None:
        """Notes that a picture is on its way."""
        self.in_flight = number
        self._free.clear()

    def shown(self, number: int) -> None:
        """Notes that the page has acknowledged the pictures up to a number."""
        if self.in_flight is not None and number >= self.in_flight:
            self.in_flight = None
            self._free.set()

    async def due(self) -> None:
        """Waits until a picture is due and the page has acknowledged the one before."""
        await self._free.wait()
        await self.changed.wait()
        self.changed.clear()


class Viewer:
    """A connected page. `run` serves it until the connection ends."""

    def __init__(self, session: Session, socket: Socket) -> None:
        self._session = session
        self._socket = socket
        self._panes = tuple(Pane(index) for index in range(wire.MOST_PANES))
        self._state_due = asyncio.Event()
        self._notes: Newest[str] = Newest()
        self._picks: Newest[wire.PixelMessage] = Newest()
        self._probes: Newest[wire.PixelMessage] = Newest()
        self._judgements: Newest[wire.View] = Newest()
        self._sources: Newest[wire.ObjectMessage] = Newest()
        self._measurements: Newest[wire.ObjectMessage] = Newest()
        self._writes: Newest[wire.WriteMessage] = Newest()

    def tell(self, text: str) -> None:
        """Sends a sentence for the user of the page."""
        self._notes.put(text)

    def refresh(self, pictures: bool = False) -> None:
        """Sends the state again, and with `pictures` the pictures of all panes."""
        self._state_due.set()
        if pictures:
            for pane in self._panes:
                pane.changed.set()

    async def run(self) -> None:
        """Serves the page until the connection ends. Errors: SlowReader, and the errors of the socket."""
        self.refresh()
        works: list[Awaitable[None]] = [
            self._receive(),
            self._send_states(),
            *(self._send_pictures(pane) for pane in self._panes),
            self._serve(self._notes, self._note),
            self._serve(self._picks, self._pick),
            self._serve(self._probes, self._probe),
            self._serve(self._judgements, self._judge),
            self._serve(self._sources, self._source),
            self._serve(self._measurements, self._measure),
            self._serve(self._writes, self._write),
        ]
        tasks = [asyncio.ensure_future(work) for work in works]
        try:
            # None of them returns: the first error ends the connection.
            await asyncio.gather(*tasks)
        finally:
            self._session.cancel_judge(self)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def send(self, kind: str, **table: Any) -> None:
        """Sends a text message. Errors: SlowReader."""
        await self._in_time(self._socket.send_text(wire.as_json({"type": kind, **table})))

    async def _in_time(self, sending: Awaitable[None]) -> None:
        try:
            await asyncio.wait_for(sending, PATIENCE)
        except TimeoutError:
            raise SlowReader(f"a page did not take a message within {PATIENCE:g} s") from None

    async def _receive(self) -> None:
        while True:
            try:
                message = wire.parse(await self._socket.receive_text())
            except KeyError:
                # The message holds bytes, so that it has no text.
                await self.send("error", text="a page sends text messages only")
            except ValueError as error:
                await self.send("error", text=str(error))
            else:
                await self._obey(message)

    async def _obey(self, message: wire.PageMessage) -> None:
        if isinstance(message, wire.ViewMessage):
            self._session.cancel_judge(self)
            for pane in self._panes:
                pane.wanted = message
                pane.changed.set()
        elif isinstance(message, wire.ShownMessage):
            for pane in self._panes:
                if message.pane in (None, pane.index):
                    pane.shown(message.number)
        elif isinstance(message, wire.PixelMessage):
            (self._picks if message.type == "pick" else self._probes).put(message)
        elif isinstance(message, wire.ObjectMessage):
            (self._sources if message.type == "source" else self._measurements).put(message)
        elif isinstance(message, wire.WriteMessage):
            self._writes.put(message)
        elif message.type == "judge":
            if self._panes[0].view is not None:
                self._judgements.put(self._panes[0].view)
        else:
            self.refresh(pictures=True)

    async def _send_states(self) -> None:
        while True:
            await self._state_due.wait()
            self._state_due.clear()
            await self.send("state", **self._session.state())

    async def _send_pictures(self, pane: Pane) -> None:
        while True:
            await pane.due()
            message, view = pane.wanted, pane.view
            # The judge takes seconds for a picture, so it draws only views that stand still.
            if message is None or view is None or (message.moving and view.is_slow):
                continue
            answer = await self._session.picture(view, not message.moving, self)
            if answer is None:
                continue
            header = {"number": message.number, "stale": self._session.stale, "still": not message.moving, **_header(answer)}
            pane.sent(message.number)
            data = answer.data if isinstance(answer, Frame) else b""
            await self._in_time(self._socket.send_bytes(wire.packed(pane.index, header, data)))

    async def _serve(self, wishes: Newest[T], fulfil: Callable[[T], Awaitable[None]]) -> None:
        while True:
            await fulfil(await wishes.take())

    async def _note(self, text: str) -> None:
        await self.send("error", text=text)

    async def _pick(self, message: wire.PixelMessage) -> None:
        view = self._panes[message.pane].view
        if view is not None:
            answer = await self._session.pick(view, message.x, message.y)
            await self._answer("picked", answer, Picked, pane=message.pane, x=message.x, y=message.y)

    async def _probe(self, message: wire.PixelMessage) -> None:
        view = self._panes[message.pane].view
        if view is not None:
            answer = await self._session.probe(view, message.x, message.y, self)
            await self._answer("probed", answer, Probed, pane=message.pane)
            if not isinstance(answer, Probed):
                return
            # The variables come later, because the program has to be compiled and run.
            traced = await self._session.trace(view, message.x, message.y, self)
            table = _table(traced) if isinstance(traced, Traced) else {"text": text_of(traced) if traced else ""}
            await self.send("traced", **{**table, "pane": message.pane, "x": message.x, "y": message.y})

    async def _source(self, message: wire.ObjectMessage) -> None:
        view = self._panes[0].view
        if view is not None:
            answer = await self._session.source(view, message.object)
            table = _table(answer) if isinstance(answer, Source) else {"files": [], "text": text_of(answer)}
            await self.send("source", **{**table, "object": message.object})

    async def _measure(self, message: wire.ObjectMessage) -> None:
        view = self._panes[0].view
        if view is None:
            return
        answer = await self._session.digits(view, message.object, self)
        # A measurement that an edit or another view has cancelled is asked for again by the page.
        if answer is not None:
            table = _table(answer) if isinstance(answer, LostDigits) else {"lines": [], "text": text_of(answer)}
            await self.send("digits", **{**table, "object": message.object})

    async def _judge(self, view: wire.View) -> None:
        await self.send("judged", state="judging", text="", unexplained=0, pixels=[], revision=self._session.shown)
        answer = await self._session.verify(view, self)
        # The verdict on an older view would be read as one on the view that is shown now.
        if isinstance(answer, Judged) and view is self._panes[0].view:
            await self.send("judged", state=answer.verdict, **_table(answer, "verdict"))
        else:
            text = text_of(answer) if isinstance(answer, Failed) else ""
            await self.send("judged", state="none", text=text, unexplained=0, pixels=[], revision=self._session.shown)

    async def _write(self, message: wire.WriteMessage) -> None:
        ok, text = await self._session.write(message.values)
        await self.send("written", ok=ok, text=text)

    async def _answer(self, kind: str, answer: Answer | None, expected: type[Answer], **place: int) -> None:
        """Sends the answer of a child process: its fields, or the reason why there is none."""
        if isinstance(answer, expected):
            await self.send(kind, **{**_table(answer), **place})
        elif answer is not None:
            await self.send("error", text=text_of(answer))


def _header(answer: Answer) -> dict[str, Any]:
    """Returns the keys of a picture's header that come from the drawer or the judge."""
    if not isinstance(answer, Frame):
        return {"width": 0, "height": 0, "mime": "", "revision": 0, "text": text_of(answer)}
    return {key: value for key, value in _table(answer, "data").items() if value is not None}


def _table(answer: Answer, *without: str) -> dict[str, Any]:
    """Returns the fields of an answer that concern a page."""
    table = {key: value for key, value in asdict(answer).items() if key not in ("id", "ok", *without)}
    if "kind" in table:
        # "class" is no name that a field of Python may have.
        table["class"] = table.pop("kind")
    return table


def text_of(answer: Answer) -> str:
    """Returns the reasons of a failure as one line."""
    problems = answer.problems if isinstance(answer, Failed) else []
    return "; ".join(str(problem["message"]) for problem in problems) or "There is no answer."
