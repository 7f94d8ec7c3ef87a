"""The house: imports go one way. Every import counts, also one inside a function and one for the type checker alone."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "glshade"


@cache
def modules() -> dict[str, Path]:
    """Dotted name -> file, of every module of the package."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(module: str) -> set[str]:
    """The modules of the package that a module imports; `from glshade.room import module` counts as that module."""
    found = set()
    for node in ast.walk(ast.parse(modules()[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}:{node.lineno}: relative imports hide where a name comes from"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                found.add(whole if whole in modules() else str(node.module))
    return found & modules().keys() - {module}


def test_no_module_imports_itself_by_way_of_others() -> None:
    after = {module: imports(module) for module in modules()}
    # The package's own names are loaded when they are asked for; its import statements are for the type checker.
    after["glshade"] = set()
    waiting = set(after)
    while waiting:
        free = {module for module in waiting if not after[module] & waiting}
        assert free, f"these import each other: {sorted(waiting)}"
        waiting -= free
