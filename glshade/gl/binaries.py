"""Binaries: the disk cache of linked programs in the driver's own format. linker.py makes the OpenGL calls."""

from __future__ import annotations

import hashlib
import os
import struct
from contextlib import suppress
from pathlib import Path
from typing import TypeAlias

from glshade.files import Cache, user_cache

# A cache file holds this line, a SHA-256 of the key and of all that follows it, the format number (4 bytes) and the data.
MAGIC = b"glshade program 1\n"
# The offset of the format number [bytes].
START = len(MAGIC) + hashlib.sha256().digest_size

# The driver's number of the binary format, and the binary. It is no dataclass because defining one costs as much time at
# import as loading five binaries.
Binary: TypeAlias = tuple[int, bytes]


class Binaries:
    """A cache of program binaries by key, in the cache folder. A folder that cannot be read or written raises no error."""

    def __init__(self, cache: Cache | None = None) -> None:
        """cache: optional; the cache folder, in whose part "programs" the binaries lie. Default: the user's cache folder."""
        self._cache = cache or user_cache()
        self.folder = self._cache.part("programs")

    def recall(self, key: str) -> Binary | None:
        """Returns the binary of a key; None if no file has it, or if its file is damaged: a damaged binary may
        crash a driver.
        """
        path = self.path(key)
        try:
            entry = path.read_bytes()
        except OSError:
            return None
        self._cache.used(path)
        body = entry[START:]
        if len(body) <= 4 or entry[:START] != MAGIC + _digest(key, body):
            return None
        return struct.unpack_from("<I", body)[0], body[4:]

    def keep(self, key: str, binary: Binary) -> None:
        """Writes the binary of a key, atomically; an earlier one is replaced."""
        kind, data = binary
        body = struct.pack("<I", kind) + data
        entry = MAGIC + _digest(key, body) + body
        path = self.path(key)
        # The temporary name is random. If it had the process's id instead, two threads might write to the same file.
        temporary = path.with_name(f".{key}.{os.urandom(8).hex()}")
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            try:
                temporary.write_bytes(entry)
                os.replace(temporary, path)
            except OSError:
                temporary.unlink(missing_ok=True)
                raise
            self._cache.added(path)

    def path(self, key: str) -> Path:
        """Returns the path of the file of a key."""
        return self.folder / f"{key}.bin"


def _digest(key: str, body: bytes) -> bytes:
    return hashlib.sha256(key.encode() + body).digest()
