"""Leftovers: what a process that was killed had begun to write beside pictures."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path

from glshade.files import beside

NUMBER = re.compile(r"\.(\d+)(?=\.\w+$)")


def remove(outputs: Iterable[str | Path]) -> None:
    """Removes what processes that are gone left beside these files, in one look at each folder."""
    folders: dict[Path, set[str]] = {}
    for output in map(Path, outputs):
        folders.setdefault(output.parent, set()).update((output.name, f"{output.stem}.aovs.exr"))
    for folder, names in folders.items():
        try:
            found = [name for name in os.listdir(folder) if name.startswith(".")]
        except OSError:
            continue
        for name in found:
            match = NUMBER.search(name)
            if match is None or is_running(int(match[1])):
                continue
            whole = name[1 : match.start()] + name[match.end() :]
            if whole in names and beside(Path(whole), int(match[1])).name == name:
                (folder / name).unlink(missing_ok=True)


def is_running(process: int) -> bool:
    """Whether there is a process of this number."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return True
