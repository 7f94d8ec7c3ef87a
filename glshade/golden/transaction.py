"""Transaction: replaces several files of a folder, all of them or none."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

from glshade.files import replacing

# The beginning of the name of the temporary folder that holds new and old files until all are in place. Folders whose names
# start with a dot are no folders of pictures, so that nothing reads what a killed process has left.
STAGE = ".glshade."


class Transaction:
    """Replaces files one after another. What was there before is kept until the transaction ends."""

    def __init__(self, stage: Path, undo: ExitStack) -> None:
        """stage: an empty folder in the same file system. undo: gets what undoes each step."""
        self._stage, self._undo, self._numbers = stage, undo, count()

    def temporary(self) -> Path:
        """Returns the path of a new temporary file, to be written and then given to `replace`."""
        return self._stage / str(next(self._numbers))

    def replace(self, path: Path, source: Path | None) -> None:
        """Moves a temporary file to `path`; without a source, `path` is deleted. Errors: OSError."""
        _make_folder(path.parent, self._undo)
        old = self.temporary()
        if os.path.lexists(path):
            _keep(path, old)
        self._undo.callback(_restore, path, old)
        if source is None:
            path.unlink(missing_ok=True)
        else:
            with replacing(path) as temporary:
                os.replace(source, temporary)


@contextmanager
def all_or_none(folder: Path) -> Iterator[Transaction]:
    """Yields a transaction in a folder, which is made if it is missing. If the block raises, all files are as before.

    That holds for Ctrl-C, too. A process that is killed leaves the files that it had replaced, each of them complete, and a
    hidden temporary folder. Errors: OSError.
    """
    with ExitStack() as made:
        _make_folder(folder, made)
        with TemporaryDirectory(prefix=STAGE, dir=folder) as stage, ExitStack() as undo:
            yield Transaction(Path(stage), undo)
            # All files are in place, so nothing is undone.
            undo.pop_all()
        made.pop_all()


def _keep(path: Path, old: Path) -> None:
    """Keeps the contents of a file, or a link itself, under the name `old`. Errors: OSError."""
    try:
        os.link(path, old, follow_symlinks=False)
    except (OSError, NotImplementedError):
        # The file system has no hard links.
        shutil.copy2(path, old, follow_symlinks=False)


def _restore(path: Path, old: Path) -> None:
    """Undoes `replace`. Errors: OSError."""
    if os.path.lexists(old):
        os.replace(old, path)
    else:
        path.unlink(missing_ok=True)


def _make_folder(folder: Path, undo: ExitStack) -> None:
    """Makes a folder and those that it lies in, and adds to the stack what removes those that were missing. Errors: OSError."""
    for missing in [path for path in (*reversed(folder.parents), folder) if not path.exists()]:
        undo.callback(_remove_if_empty, missing)
        missing.mkdir(exist_ok=True)


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
