"""glshade: a GLSL shader suite on headless OpenGL, which turns a scene into a picture and a proof that the picture is right.

The public names are listed once, in the stub `__init__.pyi`. Each is imported when it is first used, so that `import glshade`
takes almost no time.
"""

from __future__ import annotations

import importlib

from glshade.version import __version__ as __version__

# Public name -> the module that the stub imports it from; empty until the stub has been read.
_table: dict[str, str] = {}


def _homes() -> dict[str, str]:
    """Returns the table of public names, read from the stub at the first call."""
    if not _table:
        # pathlib and re would take longer to import than all the rest of this module.
        with open(f"{__file__.removesuffix('.py')}.pyi", encoding="utf-8") as stub:
            lines = [line.split() for line in stub if line.startswith("from ")]
        _table.update({name: module for _, module, _, name, *_ in lines})
    return _table


def __getattr__(name: str) -> object:
    if name == "__all__":
        return list(_homes())
    if name.startswith("__") or name not in _homes():
        raise AttributeError(f"module 'glshade' has no attribute {name!r}")
    home = _homes()[name]
    return importlib.import_module(f"glshade.{name}") if home == "glshade" else getattr(importlib.import_module(home), name)


def __dir__() -> list[str]:
    return sorted(_homes())
