"""Leftovers: removes temporary files that killed processes left beside pictures."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path

from glshade.files import beside
from glshade.image.layer_paths import PNG_AOVS, layer_files, layers_path

# The process id in a temporary file's name, which `files.beside` puts before the suffix: .NAME.PROCESS.png.
NUMBER = re.compile(r"\.(\d+)(?=\.\w+$)")


def remove(outputs: Iterable[str | Path]) -> None:
    """Removes temporary files beside these picture files, if their processes have ended. Each folder is listed only once."""
    folders: dict[Path, set[str]] = {}
    for output in map(Path, outputs):
        names = folders.setdefault(output.parent, set())
        names.update((output.name, layers_path(output).name, *(file.name for file in layer_files(output, PNG_AOVS, "png"))))
    for folder, names in folders.items():
        try:
            hidden = [name for name in os.listdir(folder) if name.startswith(".")]
        except OSError:
            continue
        for name in hidden:
            match = NUMBER.search(name)
            if match is None or is_running(int(match[1])):
                continue
            whole = name[1 : match.start()] + name[match.end() :]
            if whole in names and beside(Path(whole), int(match[1])).name == name:
                (folder / name).unlink(missing_ok=True)


def is_running(process: int) -> bool:
    """Returns whether a process with this id exists."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass
    return True
