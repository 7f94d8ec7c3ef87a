"""Binaries: linked programs kept on disk, as the driver gives them and takes them back. No GL here; linker.py has it."""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

from glshade.files import cache_folder

# An entry: this line, a digest of the key and of all that follows, the driver's number of the format, the data.
MAGIC = b"glshade program 1\n"
START = len(MAGIC) + hashlib.sha256().digest_size
# Some six thousand programs of Mesa's.
LARGEST = 64 << 20


# The driver's number of the format, and what it gave. (A class for these two would take as long to make as five of them
# to load.)
Binary: TypeAlias = tuple[int, bytes]


class Binaries:
    """A folder of them by key. Nothing that is wrong with it is an error: there is the text to compile."""

    def __init__(self, folder: Path | None = None, largest: int = LARGEST) -> None:
        """folder: left out, the programs' part of the user's cache folder. largest: what it may hold [bytes]."""
        self.folder = folder or cache_folder("programs")
        self._largest = largest
        # What the folder holds [bytes], as far as this process knows; None until it has written.
        self._held: int | None = None

    def recall(self, key: str) -> Binary | None:
        """None where there is none, or not what was kept: a driver may crash on that."""
        try:
            entry = self.path(key).read_bytes()
        except OSError:
            return None
        body = entry[START:]
        if len(body) <= 4 or entry[:START] != MAGIC + _digest(key, body):
            return None
        return struct.unpack_from("<I", body)[0], body[4:]

    def keep(self, key: str, binary: Binary) -> None:
        """Writes an entry, whole or not at all, in place of what is there."""
        kind, data = binary
        body = struct.pack("<I", kind) + data
        entry = MAGIC + _digest(key, body) + body
        path = self.path(key)
        # Not the process's number: its threads may write the same entry.
        beside = path.with_name(f".{key}.{os.urandom(8).hex()}")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            try:
                beside.write_bytes(entry)
                os.replace(beside, path)
            except OSError:
                beside.unlink(missing_ok=True)
                raise
            if self._held is None:
                self._held = sum(size for _, size, _ in self._files())
            else:
                self._held += len(entry)
            if self._held > self._largest:
                self._prune()
        except OSError:
            pass

    def path(self, key: str) -> Path:
        """Where an entry lies."""
        return self.folder / f"{key}.bin"

    def _files(self) -> Iterator[tuple[int, int, str]]:
        """(time, size, path) of every file, those included that a killed process has left unfinished."""
        with os.scandir(self.folder) as found:
            for file in found:
                try:
                    stat = file.stat(follow_symlinks=False)
                except FileNotFoundError:  # another process prunes
                    continue
                yield stat.st_mtime_ns, stat.st_size, file.path

    def _prune(self) -> None:
        """Deletes the oldest files down to half of what is allowed, so that the next program need not do it again."""
        files = sorted(self._files())
        self._held = sum(size for _, size, _ in files)
        for _, size, path in files:
            if self._held <= self._largest // 2:
                break
            Path(path).unlink(missing_ok=True)
            self._held -= size


def _digest(key: str, body: bytes) -> bytes:
    return hashlib.sha256(key.encode() + body).digest()
