"""Cache: where what can be made again is kept for the next time."""

from __future__ import annotations

import os
from pathlib import Path


def folder(of: str) -> Path:
    """The part of the user's cache folder that holds `of`: meshes, programs, budgets. It need not be there yet."""
    return Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "glshade" / of
