"""Supervisor: keeps a drawer alive. A drawer that dies or hangs is replaced by one that starts from a snapshot on disk.

A revision that kills the drawer while it is loaded never becomes the one that is drawn. A revision that kills it later, because
only another view runs into the fault, is dropped in favour of the revision before it.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from glshade.live.child import LIMIT, Child, ChildLost
from glshade.live.messages import Answer, Draw, Failed, Load, Loaded, Pick, ReadSource, Restore
from glshade.problem import Problem

# The deaths of the drawer after which a revision is dropped. A single one may be an accident, such as a lack of memory.
MOST_DEATHS = 2


class Supervisor:
    """A drawer that is replaced when it dies.

    loaded: the drawer's newest answer about the revision that it draws; None while there is none
    state: "starting", "ready", or "lost" where no drawer can draw anything
    """

    def __init__(self, drawer: Child, changed: Callable[[str], None]) -> None:
        """Starts nothing yet: the first request does.

        drawer: the drawer's process
        changed: is called when `state` or `shown` has changed, with a sentence about the drawer's death, or an empty text
        """
        self.loaded: Loaded | None = None
        self.state: Literal["starting", "ready", "lost"] = "starting"
        self._drawer = drawer
        self._changed = changed
        # Requests are sent one by one: between a death and the next request, the new drawer has to be given the snapshot.
        self._turn = asyncio.Lock()
        # The process that holds the revision `shown`.
        self._pid: int | None = None
        # Revision -> folder.
        self._snapshots: dict[int, str] = {}
        # The newest request whose revision had no fault.
        self._good: Load | None = None
        # Revision -> number of drawers that died while they drew it.
        self._deaths: Counter[int] = Counter()
        # The revisions that are not drawn again.
        self._dropped: set[int] = set()
        self._is_over = False

    @property
    def shown(self) -> int:
        """The number of the revision that is drawn; 0 while there is none."""
        return self.loaded.shown if self.loaded else 0

    @property
    def snapshot(self) -> str | None:
        """The folder from which another process can load the revision that is drawn; None while there is none."""
        return self._snapshots.get(self.shown)

    async def load(self, request: Load) -> Answer:
        """Returns the answer to the request; `Failed` where the revision kills the drawer."""
        # A page that goes away cancels its wishes. The drawer works on, so the next request has to wait for it.
        return await asyncio.shield(self._load(request))

    async def ask(self, request: Draw | Pick | ReadSource) -> Answer:
        """Returns the answer to the request. If the drawer dies, another one is asked; `Failed` if that dies, too."""
        return await asyncio.shield(self._ask(request))

    async def stop(self) -> None:
        """Ends the drawer. A request that is on its way fails, and starts no other drawer."""
        self._is_over = True
        await self._drawer.stop()

    async def _load(self, request: Load) -> Answer:
        async with self._turn:
            try:
                await self._ready()
                answer = await self._drawer.ask(request)
                if isinstance(answer, Loaded) and answer.restart:
                    answer = await self._load_afresh(request)
            except ChildLost as lost:
                await self._replace(f"The drawer {lost} while it loaded revision {request.revision}.")
                return failed(f"the drawer {lost}; this revision is not tried again until a file changes")
            if isinstance(answer, Loaded):
                self._keep(request, answer)
            return answer

    async def _ask(self, request: Draw | Pick | ReadSource) -> Answer:
        async with self._turn:
            for _ in range(MOST_DEATHS):
                since = time.monotonic()
                try:
                    await self._ready()
                    return await self._drawer.ask(request)
                except ChildLost as lost:
                    self._blame(MOST_DEATHS if time.monotonic() - since >= LIMIT else 1)
                    await self._replace(f"The drawer {lost} while it drew revision {self.shown}.")
            return failed("the drawer died each time it drew this view")

    async def _load_afresh(self, request: Load) -> Answer:
        """Loads a revision by a new process, because a process can run Python files only once. Errors: ChildLost."""
        await self._drawer.stop()
        answer = await self._drawer.ask(request)
        if answer.ok:
            self._pid = self._drawer.pid
            return answer
        # The new process has nothing to draw.
        await self._drawer.stop()
        self._pid = None
        await self._ready()
        if not isinstance(answer, Loaded) or self.loaded is None:
            return answer
        return replace(answer, shown=self.shown, snapshot=None, controls=self.loaded.controls, info=self.loaded.info)

    def _keep(self, request: Load, answer: Loaded) -> None:
        """Notes the revision that the drawer has loaded."""
        self.loaded = answer
        if answer.ok:
            self._good = request
        if answer.snapshot is not None:
            # A folder is used again for a later revision.
            self._snapshots = {number: x for number, x in self._snapshots.items() if x != answer.snapshot}
            self._snapshots[answer.shown] = answer.snapshot

    def _blame(self, deaths: int) -> None:
        """Counts deaths of the drawer against the revision that it drew, and drops a revision with too many."""
        self._deaths[self.shown] += deaths
        if self._deaths[self.shown] >= MOST_DEATHS:
            self._dropped.add(self.shown)
            if self._good is not None and self._good.revision == self.shown:
                self._good = None

    async def _replace(self, text: str) -> None:
        """Starts another drawer at once, so that the next request need not wait for it."""
        if self._is_over:
            return
        self.state = "starting"
        self._changed(text)
        try:
            await self._ready()
        except ChildLost as lost:
            self.state = "lost"
            self._changed(f"No other drawer can be started: it {lost}.")

    async def _ready(self) -> None:
        """Makes sure that the drawer holds the last good revision. Errors: ChildLost."""
        if self._is_over:
            raise ChildLost("was ended with its server")
        if self._drawer.alive and self._drawer.pid == self._pid:
            return
        if self.state == "ready" and self._pid is not None:
            self.state = "starting"
            self._changed("The drawer has ended while it had nothing to do.")
        restored = None
        for folder in self._folders():
            restored = await self._restored(folder)
            if restored is not None:
                break
        self.loaded = restored
        # A drawer that died at once has not written the snapshot of its revision.
        if self._good is not None and self.shown < self._good.revision:
            good, self._good = self._good, None
            answer = await self._drawer.ask(good)
            # The files may have changed since, and have a fault now.
            if isinstance(answer, Loaded) and answer.ok:
                self._keep(good, answer)
        await self._drawer.start()
        self._pid = self._drawer.pid
        self.state = "ready"
        self._changed("")

    def _folders(self) -> list[str]:
        """Returns the folders of the snapshots, that of the newest revision first."""
        return [self._snapshots[revision] for revision in sorted(self._snapshots, reverse=True)]

    async def _restored(self, folder: str) -> Loaded | None:
        """Returns the answer of a drawer that has restored a snapshot; None where it cannot draw it."""
        try:
            answer = await self._drawer.ask(Restore(folder=folder))
        except ChildLost:
            return None
        usable = isinstance(answer, Loaded) and answer.ok and answer.shown not in self._dropped
        return answer if isinstance(answer, Loaded) and usable else None


def failed(text: str) -> Failed:
    """Returns the answer that takes the place of one that a dead drawer did not give."""
    return Failed(id=0, problems=[Problem("", None, None, text, "driver").as_dict()])
