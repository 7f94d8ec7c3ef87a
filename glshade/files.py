"""Files: reads regular files, writes files completely or not at all, and keeps the user's cache folder."""

from __future__ import annotations

import errno
import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from glshade.errors import GlshadeError

# The cache folder is pruned when it holds more than this [bytes].
LIMIT = 512 << 20
# Pruning spares entries that were used within this time [s]: a process that has just read a mesh from an entry may be about
# to read pictures from the same entry.
YOUNG = 60.0


def check_regular(path: str | Path) -> None:
    """Checks that a path leads to a regular file.

    Opening a FIFO would wait for ever, and /dev/zero has no end. Errors: OSError, with the reason in `strerror`.
    """
    _check_mode(os.stat(path).st_mode)


def read_bytes(path: str | Path, largest: int) -> bytes:
    """Returns the bytes of a regular file.

    largest: the size above which the file is refused [bytes].
    Errors: OSError, with the reason in `strerror`.
    """
    # O_NONBLOCK opens a FIFO without waiting for its writer. The file is checked after it is open, so that no other file can
    # take its place in between.
    with open(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb") as file:
        _check_mode(os.fstat(file.fileno()).st_mode)
        data = file.read(largest + 1) if os.fstat(file.fileno()).st_size <= largest else None
    if data is None or len(data) > largest:
        raise OSError(errno.EFBIG, f"is larger than {largest:,} bytes, the most that is read")
    return data


def read_text(path: Path, largest: int, error: type[GlshadeError]) -> str:
    """Returns the text of a file in UTF-8, with or without a byte order mark.

    largest: the size above which the file is refused [bytes].
    error: the class of the error that is raised, in one line that starts with the path, where the file cannot be read.
    """
    try:
        return read_bytes(path, largest).decode("utf-8-sig")
    except FileNotFoundError:
        raise error(f"{path}: there is no such file") from None
    except UnicodeDecodeError as fault:
        raise error(f"{path}: is not UTF-8 text (byte {fault.start})") from None
    except OSError as fault:
        raise error(f"{path}: cannot be read: {fault.strerror}") from None


def _check_mode(mode: int) -> None:
    """Checks the mode of a file. Errors: OSError."""
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "is a folder, not a file")
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is not a regular file")


def beside(path: Path, process: int) -> Path:
    """Returns the temporary file beside `path` to which the process with this id writes before it replaces `path`."""
    return path.with_name(f".{path.stem}.{process}{path.suffix}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a temporary file to write to. The file replaces `path` when the block ends, and is deleted when the block raises.

    After a power failure `path` is the old file or the new one, both complete. Errors: OSError.
    """
    written = beside(path, os.getpid())
    try:
        yield written
        _flush(written, os.O_RDWR)
        os.replace(written, path)
    finally:
        written.unlink(missing_ok=True)
    # Until the folder is on the disk, a power failure may undo the renaming. Only POSIX systems can open a folder.
    with suppress(OSError):
        _flush(path.parent, os.O_RDONLY)


def _flush(path: Path, flags: int) -> None:
    """Waits until a file or a folder is on the disk. flags: how to open it. Errors: OSError."""
    file = os.open(path, flags)
    try:
        os.fsync(file)
    finally:
        os.close(file)


class Cache:
    """A folder of entries that can be made again, divided into parts such as "programs" and "meshes".

    An entry is a file or a folder that lies directly in a part. The modification time of an entry says when it was last
    used. Several processes may use and prune one folder at the same time: an entry may vanish at any moment, so every reader
    must treat a missing or incomplete entry as a cache miss. No method raises OSError.
    """

    def __init__(self, folder: Path, limit: int = LIMIT) -> None:
        """folder: the cache folder, which need not exist yet. limit: the size above which the folder is pruned [bytes]."""
        self.folder, self.limit = folder, limit
        # The number of bytes that this process may still write before it measures the folder again.
        self._allowance = 0

    def part(self, name: str) -> Path:
        """Returns the folder of one part. It need not exist yet."""
        return self.folder / name

    def used(self, entry: Path) -> None:
        """Marks an entry as the most recently used one. Call it whenever an entry is read."""
        with suppress(OSError):
            os.utime(entry)

    def added(self, entry: Path) -> None:
        """Prunes the folder if need be. Call it whenever an entry was written."""
        with suppress(OSError):
            self._allowance -= _size(entry)
        if self._allowance < 0:
            self._allowance = self._prune()

    def _prune(self) -> int:
        """Deletes the least recently used entries until half of the limit is left, if the folder exceeds the limit.

        Returns the number of bytes that may be written before the next call: at most an eighth of the limit, because other
        processes write too; at least a hundredth, so that a folder full of young entries is not measured at every write.
        """
        entries = sorted(self._entries())
        held = sum(size for _, size, _ in entries)
        if held > self.limit:
            oldest_spared = time.time() - YOUNG
            for used, size, entry in entries:
                if held <= self.limit // 2 or used > oldest_spared:
                    break
                _remove(entry)
                held -= size
        return max(min(self.limit - held, self.limit // 8), self.limit // 100)

    def _entries(self) -> Iterator[tuple[float, int, Path]]:
        """Yields (time of the last use [s], size [bytes], path) of every entry and of files that killed processes left."""
        for part in _children(self.folder):
            for entry in _children(part):
                with suppress(OSError):
                    yield entry.lstat().st_mtime, _size(entry), entry


def user_cache() -> Cache:
    """Returns the cache folder of the user: $XDG_CACHE_HOME/glshade, or ~/.cache/glshade."""
    return _cache_in(Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "glshade")


@cache
def _cache_in(folder: Path) -> Cache:
    return Cache(folder)


def _children(folder: Path) -> list[Path]:
    """Returns the files and folders in a folder; an empty list if the folder is missing or cannot be read."""
    try:
        with os.scandir(folder) as found:
            return [Path(child.path) for child in found]
    except OSError:
        return []


def _size(entry: Path) -> int:
    """Returns the size of a file, or of the files in a folder [bytes]. Errors: OSError."""
    if entry.is_symlink() or not entry.is_dir():
        return entry.lstat().st_size
    return sum(child.lstat().st_size for child in _children(entry))


def _remove(entry: Path) -> None:
    """Deletes an entry. It is no error if another process has deleted it already."""
    if entry.is_symlink() or not entry.is_dir():
        with suppress(OSError):
            entry.unlink()
    else:
        import shutil

        shutil.rmtree(entry, ignore_errors=True)
