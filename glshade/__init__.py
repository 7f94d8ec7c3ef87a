"""glshade: a GLSL shader suite on headless OpenGL. A scene goes in; a picture, and the proof that it is right, come out.

The public names are listed once, in the stub `__init__.pyi`. Each is imported when it is first used, so that `import glshade`
costs nothing.
"""

from __future__ import annotations

import importlib
import re
from functools import cache
from pathlib import Path
from typing import Any

from glshade.version import __version__ as __version__


@cache
def _homes() -> dict[str, str]:
    """Public name -> the module that the stub imports it from."""
    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    return {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as \w+$", stub, re.MULTILINE)}


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return list(_homes())
    if name.startswith("__") or name not in _homes():
        raise AttributeError(f"module 'glshade' has no attribute {name!r}")
    home = _homes()[name]
    return importlib.import_module(f"glshade.{name}") if home == "glshade" else getattr(importlib.import_module(home), name)


def __dir__() -> list[str]:
    return sorted(_homes())
