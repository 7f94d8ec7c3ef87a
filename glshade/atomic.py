"""Files that appear whole or not at all."""

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
