"""File: the table of a file of measured reflectance, kept in the cache folder, because making one takes seconds."""

from __future__ import annotations

import hashlib
import io
import json
import os
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np

from glshade.errors import AssetError
from glshade.files import user_cache
from glshade.measured.reading import file_bytes, read
from glshade.measured.samples import Samples
from glshade.measured.table import Table
from glshade.measured.tabulation import Reciprocity, is_grained, tabulated

# An entry of the cache holds this line, a SHA-256 of all that follows it, and the data. A change of how tables are made needs
# another number here: it makes earlier entries useless.
MAGIC = b"glshade table 1\n"
START = len(MAGIC) + hashlib.sha256().digest_size


def load(path: str | Path, reciprocity: Reciprocity = "kept") -> Table:
    """Returns the table of a file of measured reflectance.

    It is made when it is first needed, and found in the process or in the user's cache folder later, by the file's content.

    reciprocity: "enforced" draws the geometric mean of f(l, v) and f(v, l), "kept" what was measured.
    Errors: AssetError, one line that starts with the path, where the file is missing or damaged, or its surface has a grain.
    """
    path = Path(path)
    try:
        state = path.stat()
    except OSError:
        return _loaded(path, reciprocity)
    return _kept(path, reciprocity, (state.st_mtime_ns, state.st_size, state.st_ino))


@lru_cache(maxsize=16)
def _kept(path: Path, reciprocity: Reciprocity, state: tuple[int, ...]) -> Table:
    """Returns the table of a file. state: numbers that change when the file does."""
    return _loaded(path, reciprocity)


def _loaded(path: Path, reciprocity: Reciprocity) -> Table:
    data = file_bytes(path)
    digest = hashlib.sha256(MAGIC + reciprocity.encode() + b"\n" + data).hexdigest()
    if (table := _recalled(digest)) is not None:
        return table
    measurement = read(path, data)
    if isinstance(measurement, Samples) and is_grained(measurement):
        raise AssetError(
            f"{path}: was measured on a surface with a grain, whose reflectance depends on four angles; "
            "such data cannot be drawn; fit a model to them: glshade fit"
        )
    table = tabulated(measurement, reciprocity, digest)
    _remember(table)
    return table


def _entry(digest: str) -> Path:
    return user_cache().part("tables") / digest


def _recalled(digest: str) -> Table | None:
    """Returns a table from the cache folder; None if it is not there, or damaged."""
    path = _entry(digest)
    try:
        entry = path.read_bytes()
    except OSError:
        return None
    body = entry[START:]
    if entry[:START] != MAGIC + hashlib.sha256(body).digest():
        return None
    user_cache().used(path)
    with np.load(io.BytesIO(body), allow_pickle=False) as arrays:
        about = json.loads(str(arrays["about"]))
        return Table(arrays["values"], about["turn"], about["retro"], digest, tuple(about["notes"]))


def _remember(table: Table) -> None:
    """Writes a table to the cache folder, whole or not at all. A folder that cannot be written is no error."""
    buffer = io.BytesIO()
    about = json.dumps({"turn": table.turn, "retro": table.retro, "notes": table.notes})
    np.savez(buffer, values=table.values, about=np.array(about))
    body = buffer.getvalue()
    path = _entry(table.digest)
    # The temporary name is random. If it had the process's id instead, two threads might write to the same file.
    temporary = path.with_name(f".{path.name}.{os.urandom(8).hex()}")
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            temporary.write_bytes(MAGIC + hashlib.sha256(body).digest() + body)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
        user_cache().added(path)
