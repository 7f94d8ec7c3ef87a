"""Watcher: tells which files have changed, however an editor saves them.

Editors write in place, write another file and rename it, delete a file and make it again, or swap a symbolic link. So the
folders are watched and not the files: each folder that a path leads through, and those that its symbolic links lead to. A
message about a folder is only a reason to look. A change counts when two readings of the files agree.
"""

from __future__ import annotations

import asyncio
import hashlib
import math
import os
import time
from collections.abc import AsyncIterator, Iterable
from contextlib import suppress
from pathlib import Path
from stat import S_ISDIR, S_ISREG
from typing import TypeAlias

from watchfiles import awatch

# The time for which messages of the system are gathered [ms]. A reload takes about twice as long, so that the default of
# watchfiles, 50, is too long. A server at rest wakes after each step: with 10 it takes 1.6 % of a core, with 20 1.2 %.
STEP = 20
# The time between two readings that have to agree [s].
AGREE = 0.01
# A file that is missing or empty may be about to be written: it counts only after this time [s].
PATIENCE = 0.2
# The files are looked at after this time [ms] even without a message: some file systems send none, and a message is lost when a
# folder is replaced.
AT_LEAST = 2000
# Larger files are compared by their times, sizes and inodes, because reading them takes too long [bytes].
READ = 1 << 20

# A file that was written less than this time ago may change again without a change of its modification time, which some file
# systems count in steps [s].
RECENT = 0.05
# The suffixes of the files that count in a folder.
SUFFIXES = frozenset({".glsl", ".vert", ".frag", ".py"})

# Modification time [ns], size [bytes] and inode.
Stamp: TypeAlias = tuple[int, int, int]
# The state of a file: a digest or a stamp; None where it is missing.
State: TypeAlias = tuple[object, ...] | None
EMPTY: State = ("empty",)
FOLDER: State = ("folder",)
UNKNOWN: State = ("unknown",)


class Watcher:
    """Watches files and folders.

    paths: the files, and the folders whose shaders, models and folders count, also those that appear later.
    """

    def __init__(self) -> None:
        self.paths: frozenset[Path] = frozenset()
        self._known: dict[Path, State] = {}
        # The digests of files that have not been written for a while, by their stamps.
        self._settled: dict[Path, tuple[Stamp, State]] = {}
        self._restart = asyncio.Event()

    def watch(self, paths: Iterable[str | Path], since: float = math.inf) -> None:
        """Replaces the files and folders that are watched.

        The state of a path that was watched before stays known, so that no change is missed or told twice.

        since: the time at which the caller began to read the files [seconds since the epoch]. A path that was not watched
            before counts as changed if it was written later. Default: what lies there now is known to the caller.
        """
        wanted = frozenset(Path(os.path.abspath(path)) for path in paths)
        if wanted != self.paths:
            self.paths = wanted
            known = self._known
            self._known = {}
            for path in self._files():
                is_doubtful = path not in known and _written(path) > since - RECENT
                self._known[path] = UNKNOWN if is_doubtful else known[path] if path in known else self._state(path)
            self._restart.set()

    async def changes(self) -> AsyncIterator[frozenset[Path]]:
        """Yields the files that have changed since the last time, when two readings of them agree.

        The caller reads the files before it asks for the next change. A file that is written meanwhile is told again, even if
        it has the same content in the end, because the caller may have read another one.
        """
        while True:
            self._restart.clear()
            places = _places(self.paths)
            if not places:
                await self._restart.wait()
                continue
            messages = awatch(
                *places,
                watch_filter=None,
                step=STEP,
                debounce=STEP * 5,
                recursive=False,
                stop_event=self._restart,
                rust_timeout=AT_LEAST,
                yield_on_timeout=True,
                ignore_permission_denied=True,
            )
            # A path that was doubtful when it was first watched has changed already, and no message comes for it.
            async for changed in self._told():
                yield changed
            with suppress(FileNotFoundError):  # a folder has vanished since it was listed
                async for events in messages:
                    async for changed in self._told():
                        yield changed
                    # A folder that was replaced is another folder, whose messages have to be asked for again.
                    if _places(self.paths) != places or any(Path(path) in places for _, path in events):
                        break
            await messages.aclose()

    async def _told(self) -> AsyncIterator[frozenset[Path]]:
        """Yields the files that have changed until nothing has changed while the caller read them."""
        while changed := await self._changed():
            before = self._stamps()
            yield changed
            self._doubt(before)

    async def _changed(self) -> frozenset[Path]:
        """Returns the files that differ from their known states, when two readings agree; their states are then known."""
        before = self._read()
        if before == self._known:
            return frozenset()
        waited = 0.0
        while True:
            await asyncio.sleep(AGREE)
            waited += AGREE
            now = self._read()
            differing = {path for path in now.keys() | self._known.keys() if now.get(path) != self._known.get(path)}
            unfinished = any(now.get(path) in (None, EMPTY) for path in differing)
            if now == before and not (unfinished and waited < PATIENCE):
                self._known = now
                return frozenset(differing)
            before = now

    def _stamps(self) -> dict[Path, Stamp | None]:
        """Returns the stamp of every file that is watched; None for one that is missing."""
        return {path: _stamp(path) for path in self._files()}

    def _doubt(self, before: dict[Path, Stamp | None]) -> None:
        """Makes the files whose stamps have changed count as changed. before: the stamps that they had."""
        now = self._stamps()
        self._known |= {path: UNKNOWN for path in before.keys() | now.keys() if before.get(path) != now.get(path)}

    def _read(self) -> dict[Path, State]:
        """Returns the state of every file that is watched."""
        return {path: self._state(path) for path in self._files()}

    def _state(self, path: Path) -> State:
        """Returns the state of a file: its digest if it is small, else its stamp; of a folder, that it is one."""
        try:
            stat = path.stat()
            stamp = stat.st_mtime_ns, stat.st_size, stat.st_ino
            if S_ISDIR(stat.st_mode):
                return FOLDER
            if not S_ISREG(stat.st_mode) or stat.st_size > READ:
                return stamp
            if stat.st_size == 0:
                return EMPTY
            known = self._settled.get(path)
            if known is not None and known[0] == stamp:
                return known[1]
            with path.open("rb") as file:
                state = (hashlib.blake2b(file.read(), digest_size=16).digest(),)
            if time.time() - stat.st_mtime > RECENT:
                self._settled[path] = stamp, state
            return state
        except (OSError, ValueError):
            return None

    def _files(self) -> set[Path]:
        """Returns the files that are watched: those that were named, and those in the folders that were named."""
        files: set[Path] = set()
        for path in self.paths:
            if path.is_dir():
                files |= _in_folder(path)
            files.add(path)
        return files


def _in_folder(folder: Path) -> set[Path]:
    """Returns the shaders, models and folders in a folder, without hidden ones, such as those that editors write."""
    try:
        with os.scandir(folder) as entries:
            named = {Path(entry.path) for entry in entries if not entry.name.startswith((".", "__"))}
    except OSError:
        return set()
    return {path for path in named if path.suffix in SUFFIXES or path.is_dir()}


def _written(path: Path) -> float:
    """Returns the time at which a path last changed: its file, or a symbolic link to it [seconds since the epoch].

    For a missing path it is the time at which its folder changed. The time is that of the inode's last change, because a file
    that is renamed keeps the time at which its content was written.
    """
    try:
        return max(path.stat().st_ctime, path.lstat().st_ctime)
    except (OSError, ValueError):
        pass
    try:
        return path.parent.stat().st_ctime
    except (OSError, ValueError):
        return 0.0


def _stamp(path: Path) -> Stamp | None:
    """Returns the stamp of a file; None where it is missing. That of a folder changes with every file in it, and counts for
    nothing."""
    try:
        stat = path.stat()
    except (OSError, ValueError):
        return None
    return (0, 0, 0) if S_ISDIR(stat.st_mode) else (stat.st_mtime_ns, stat.st_size, stat.st_ino)


def _places(paths: Iterable[Path]) -> frozenset[Path]:
    """Returns the folders to watch for changes of these paths: those that exist now."""
    places: set[Path] = set()
    for path in paths:
        places |= _through(path)
    return frozenset(places)


def _through(path: Path) -> set[Path]:
    """Returns the folders in which the last part of a path, or a symbolic link on its way, would be replaced."""
    places: set[Path] = set()
    seen: set[Path] = set()
    while path not in seen:
        seen.add(path)
        if path.is_dir():
            places.add(path)
        places.add(_existing(path.parent))
        link = next((part for part in (path, *path.parents) if part.is_symlink()), None)
        if link is None:
            break
        places.add(_existing(link.parent))
        with suppress(OSError):
            path = Path(os.path.normpath(link.parent / os.readlink(link))) / path.relative_to(link)
    return places


def _existing(folder: Path) -> Path:
    """Returns a folder, or the nearest folder above it that exists."""
    return next(place for place in (folder, *folder.parents) if place.is_dir())
