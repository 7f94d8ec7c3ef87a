"""Session: the state of `glshade dev` that all pages share. It owns the drawer, the judge and the watcher.

A change of a file makes a new revision, which the drawer loads. A revision with a fault is not shown: the drawer goes on
drawing the last good one, and the state says that it is stale.
"""

from __future__ import annotations

import asyncio
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from glshade.live.child import Child, ChildLost
from glshade.live.messages import (
    Answer,
    Draw,
    Failed,
    Heat,
    Load,
    Loaded,
    MeasureDigits,
    Pick,
    Probe,
    ReadSource,
    Reference,
    Request,
    Restore,
    ShowVariable,
    Trace,
    Verify,
)
from glshade.live.supervisor import Supervisor, failed
from glshade.live.watcher import Watcher
from glshade.live.wire import View

# The pages that may be open at the same time.
MOST_PAGES = 16


@dataclass(frozen=True)
class Settings:
    """Everything that a session is started with.

    scene: path of the scene or mesh file
    overrides: texts KEY=VALUE, as `--set` takes them
    shaders: paths of the user's shader folders
    models: paths of the user's model folders
    size: width and height in place of the film's [pixels]; None keeps the film's
    backend: OpenGL backend, as Renderer takes it
    device: index of the EGL device; None selects the default
    """

    scene: str
    overrides: tuple[str, ...] = ()
    shaders: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    size: tuple[int, int] | None = None
    backend: str = "auto"
    device: int | None = None


class Page(Protocol):
    """A connected page, as the session knows it."""

    def refresh(self, pictures: bool = False) -> None:
        """Sends the state again, and with `pictures` the pictures of all panes."""

    def tell(self, text: str) -> None:
        """Sends a sentence for the user of the page."""


class TooManyPages(Exception):
    """MOST_PAGES pages are open."""


class Session:
    """The drawer, the judge, the watcher and the pages of one `glshade dev`.

    revision: number of the newest revision of the files
    """

    def __init__(self, settings: Settings, report: Callable[[dict[str, Any]], None]) -> None:
        """Starts no process yet: `run` does.

        settings: the scene, its overrides and folders, and the driver
        report: takes each event, a table of JSON types whose key "event" names its kind
        """
        self.revision = 0
        self._settings = settings
        self._report = report
        # It holds the snapshots of good revisions, also when the drawer that wrote them has been killed.
        self._folder = tempfile.TemporaryDirectory(prefix="glshade-dev-", ignore_cleanup_errors=True)
        device = "" if settings.device is None else settings.device
        options = settings.backend, device, self._folder.name
        self._supervisor = Supervisor(Child("glshade.live.drawer", *options), self._drawer_changed)
        self._judge = Child("glshade.live.judge", *options, limit=None, nice=19)
        self._watcher = Watcher()
        self._problems: list[dict[str, Any]] = []
        self._last_death = ""
        self._milliseconds: dict[str, float] = {}
        self._judging = asyncio.Lock()
        # The page for which the judge works; None while it is idle.
        self._judges_for: Page | None = None
        # The process of the judge, and the number of the revision that it holds.
        self._judge_holds: tuple[int | None, int] | None = None
        self._pages: set[Page] = set()

    @property
    def shown(self) -> int:
        """The number of the revision that is drawn; 0 while there is none."""
        return self._supervisor.shown

    @property
    def stale(self) -> bool:
        """Whether the pictures show an older revision than that of the files."""
        return self.shown != self.revision

    async def run(self) -> None:
        """Loads the scene, and again after each change of its files, until it is cancelled."""
        self._watcher.watch([self._settings.scene, *self._settings.shaders, *self._settings.models])
        try:
            await self._load([])
            async for paths in self._watcher.changes():
                await self._load(sorted(map(str, paths)))
        finally:
            await asyncio.gather(self._supervisor.stop(), self._judge.stop())
            self._folder.cleanup()

    def announce(self, event: str, **table: Any) -> None:
        """Reports an event."""
        self._report({"event": event, **table})

    @contextmanager
    def connected(self, page: Page) -> Iterator[None]:
        """Returns a context in which a page takes part. Errors: TooManyPages."""
        if len(self._pages) >= MOST_PAGES:
            raise TooManyPages(f"{MOST_PAGES} pages are open, which is the most")
        self._pages.add(page)
        self.announce("pages", count=len(self._pages))
        try:
            yield
        finally:
            self._pages.discard(page)
            self.announce("pages", count=len(self._pages))

    def state(self) -> dict[str, Any]:
        """Returns the state as a page gets it."""
        loaded = self._supervisor.loaded
        return {
            "scene": Path(self._settings.scene).name,
            "revision": self.revision,
            "stale": self.stale,
            "stale_of": self.shown if self.stale and self.shown else None,
            "drawer": self._supervisor.state,
            "problems": self._problems,
            "controls": loaded.controls if loaded else {},
            "info": loaded.info if loaded else {},
            "milliseconds": self._milliseconds,
            "watching": len(self._watcher.paths),
        }

    async def picture(self, view: View, still: bool, page: Page) -> Answer | None:
        """Returns the picture of a view, or the reason why there is none; None where a newer wish has cancelled it."""
        if view.source == "reference":
            return await self._ask_judge(Reference(view=view.table()), page)
        if view.source == "heat":
            return await self._ask_judge(Heat(view=view.table()), page)
        if view.source == "variable":
            return await self._ask_judge(ShowVariable(view=view.table()), page)
        return await self._supervisor.ask(Draw(view=view.table(), still=still))

    async def still_picture(self, view: View) -> Answer:
        """Returns the lossless picture of a view, or the reason why there is none."""
        return await self._supervisor.ask(Draw(view=view.table(), still=True))

    async def pick(self, view: View, x: int, y: int) -> Answer:
        """Returns the object at a pixel of a view, or the reason why there is no answer."""
        return await self._supervisor.ask(Pick(view=view.table(), x=x, y=y))

    async def probe(self, view: View, x: int, y: int, page: Page) -> Answer | None:
        """Returns the values of a pixel of a view, or the reason why there are none; None where the wish was cancelled."""
        return await self._ask_judge(Probe(view=view.table(), x=x, y=y), page)

    async def trace(self, view: View, x: int, y: int, page: Page) -> Answer | None:
        """Returns the variables at a pixel of a view, or the reason why there are none; None where the wish was cancelled."""
        return await self._ask_judge(Trace(view=view.table(), x=x, y=y), page)

    async def source(self, view: View, number: int) -> Answer:
        """Returns the files of an object's program, or the reason why there are none. number: index of the object."""
        return await self._supervisor.ask(ReadSource(view=view.table(), object=number))

    async def digits(self, view: View, number: int, page: Page) -> Answer | None:
        """Returns the lines of an object's program that lose digits, or the reason why they are not known; None where the wish
        was cancelled. number: index of the object
        """
        return await self._ask_judge(MeasureDigits(view=view.table(), object=number), page)

    async def verify(self, view: View, page: Page) -> Answer | None:
        """Returns the verdict about a view, or the reason why there is none; None where the wish was cancelled."""
        return await self._ask_judge(Verify(view=view.table()), page)

    def cancel_judge(self, page: Page | None = None) -> bool:
        """Ends the judge if it works for a page, or with None for any page. The next wish starts another judge.

        Returns whether it worked.
        """
        works = self._judges_for is not None and page in (None, self._judges_for)
        if works:
            self._judges_for = None
            self._judge.kill()
        return works

    async def write(self, values: Mapping[str, Any]) -> tuple[bool, str]:
        """Writes values into the scene file.

        values: key -> value, with keys as `--set` takes them
        Returns whether they were written, and a sentence about it.
        """
        # These modules import much that the server needs for nothing else.
        from glshade.errors import SceneError
        from glshade.live.writing import write

        loaded = self._supervisor.loaded
        if loaded is None:
            return False, "There is no picture yet, so nothing was written."
        try:
            await asyncio.to_thread(write, self._settings.scene, values, loaded.info["digest"])
        except SceneError as error:
            return False, str(error)
        return True, f"{len(values)} values were written into {Path(self._settings.scene).name}."

    async def _load(self, paths: list[str]) -> None:
        """Makes a new revision, which is drawn if it has no fault.

        paths: the files that have changed
        """
        watched = _age(paths)
        was_judging = self.cancel_judge()
        self.revision += 1
        self._last_death = ""
        settings = self._settings
        request = Load(
            revision=self.revision,
            scene=settings.scene,
            overrides=settings.overrides,
            shaders=settings.shaders,
            models=settings.models,
            size=settings.size,
        )
        began = time.time()
        answer = await self._supervisor.load(request)
        if isinstance(answer, Loaded):
            self._problems = answer.problems
            self._milliseconds = {"watch": watched, **answer.milliseconds}
            self._watcher.watch([*answer.dependencies, *answer.folders], since=began)
        elif isinstance(answer, Failed):
            self._problems = answer.problems
        # A picture of the reference that was cancelled is asked for again, also where the new revision has a fault.
        self._refresh(pictures=was_judging or not self.stale)
        self.announce(
            "revision",
            revision=self.revision,
            shown=self.shown,
            ok=not self.stale,
            files=paths,
            problems=self._problems,
            milliseconds=self._milliseconds,
        )

    def _refresh(self, pictures: bool = False) -> None:
        for page in self._pages:
            page.refresh(pictures)

    def _drawer_changed(self, text: str) -> None:
        """Tells the pages that a drawer has died or started."""
        if text:
            self._last_death = text
            self.announce("drawer", state=self._supervisor.state, text=text)
            for page in self._pages:
                page.tell(text)
        elif self.stale and not self._problems and self._last_death:
            # The newest revision had no fault when it was loaded, but killed the drawer later.
            self._problems = failed(self._last_death).problems
        self._refresh(pictures=self._supervisor.state == "ready")

    async def _ask_judge(self, request: Request, page: Page) -> Answer | None:
        """Returns the judge's answer about the revision that is drawn; None where the wish was cancelled."""
        async with self._judging:
            snapshot = self._supervisor.snapshot
            if snapshot is None:
                return failed("there is no picture yet")
            self._judges_for = page
            try:
                if not self._judge.alive or self._judge_holds != (self._judge.pid, self.shown):
                    answer = await self._judge.ask(Restore(folder=snapshot))
                    if not isinstance(answer, Loaded) or not answer.ok:
                        return answer
                    self._judge_holds = self._judge.pid, answer.shown
                return await self._judge.ask(request)
            except ChildLost as lost:
                return None if self._judges_for is None else failed(f"the judge {lost}")
            finally:
                self._judges_for = None


def _age(paths: list[str]) -> float:
    """Returns the time since the newest of these files was written [ms]; 0 if there is none."""
    times = [0.0]
    for path in paths:
        with suppress(OSError):
            times.append(os.stat(path).st_mtime)
    return max(time.time() - max(times), 0.0) * 1e3 if max(times) else 0.0
