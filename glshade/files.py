"""Files: those that appear whole or not at all, and the folder of what can be made again."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def beside(path: Path, process: int) -> Path:
    """What a process writes to before it takes the place of `path`."""
    return path.with_name(f".{path.stem}.{process}{path.suffix}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to, which takes its place where the block ends well, and goes where it does not.

    Errors: OSError.
    """
    written = beside(path, os.getpid())
    try:
        yield written
        os.replace(written, path)
    finally:
        written.unlink(missing_ok=True)


def cache_folder(of: str) -> Path:
    """The part of the user's cache folder that holds `of`: meshes, programs, budgets. It need not be there yet."""
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "glshade" / of
