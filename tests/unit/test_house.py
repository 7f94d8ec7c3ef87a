"""The house: rooms that import one way, and what an import may load.

Every import counts, also one inside a function and one for the type checker alone. CONTRIBUTING.md says what the rooms hold.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "glshade"
# A room imports from the rooms before it.
ROOMS = (
    *("optics", "calibration", "image", "page", "lights", "presets", "textures", "mesh", "measured", "brdfs", "scene"),
    *("assembly", "radiance", "glsl", "spirv", "gl", "reference", "debug", "driver", "verification", "catalogue"),
    *("pyrender", "tradeoff", "golden", "live", "batch", "bench", "cli"),
)
# Modules of no room, which every room may import. They import no room.
BASE = {"errors", "found", "document", "files", "limits", "arrays", "version", "lru", "problem", "github", "startup"}
# `python -m glshade` runs the command line.
ENTRIES = {"", "__main__"}
# docs/tradeoff.md names glshade.tradeoff.study.study, and what is documented keeps its name.
NAMED_AS_THEIR_MODULE = {("glshade.tradeoff.study", "study")}


@cache
def modules() -> dict[str, Path]:
    """Dotted name -> file, of every module of the package."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def tree(module: str) -> ast.Module:
    """Returns the module's syntax tree."""
    return ast.parse(modules()[module].read_text(encoding="utf-8"))


@cache
def imports(module: str) -> frozenset[str]:
    """Returns the modules of the package that a module imports; `from glshade.room import module` counts as that module."""
    found = set()
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}:{node.lineno}: relative imports hide where a name comes from"
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                found.add(whole if whole in modules() else str(node.module))
    return frozenset(found & modules().keys() - {module})


def room(module: str) -> str:
    """Returns the first part of a module's name after `glshade`: its room, or its own name where it is in none."""
    return module.partition(".")[2].partition(".")[0]


def in_room(name: str) -> list[str]:
    return [module for module in modules() if room(module) == name]


def reached(start: list[str]) -> set[str]:
    """Returns the modules that these import, and those that those import, and so on; these included."""
    seen, ahead = set(start), list(start)
    while ahead:
        for module in imports(ahead.pop()) - seen:
            seen.add(module)
            ahead.append(module)
    return seen


def test_no_module_imports_itself_by_way_of_others() -> None:
    after = {module: imports(module) for module in modules()}
    # The package's own names are loaded when they are asked for; its import statements are for the type checker.
    after["glshade"] = frozenset()
    waiting = set(after)
    while waiting:
        free = {module for module in waiting if not after[module] & waiting}
        assert free, f"these import each other: {sorted(waiting)}"
        waiting -= free


def test_every_module_lies_in_a_room_or_is_of_the_base() -> None:
    assert {room(module) for module in modules()} == {*ROOMS, *BASE, *ENTRIES}
    assert {path.name for path in PACKAGE.iterdir() if path.is_dir()} - {"__pycache__", "_shaders"} == set(ROOMS)


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_imports_only_rooms_before_it(name: str) -> None:
    allowed = {*ROOMS[: ROOMS.index(name) + 1], *BASE}
    wrong = {(module, other) for module in in_room(name) for other in imports(module) if room(other) not in allowed}
    assert not wrong


def test_the_base_imports_no_room() -> None:
    wrong = {(module, other) for name in BASE for module in in_room(name) for other in imports(module) if room(other) in ROOMS}
    assert not wrong


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_does_not_import_its_own_lazy_names(name: str) -> None:
    """Inside a room modules import each other's files. An `__init__` that holds code of its own is such a file."""
    package = f"glshade.{name}"
    if not any(isinstance(node, ast.Assign) and "lazily" in ast.dump(node) for node in tree(package).body):
        return
    assert not [module for module in in_room(name) if package in imports(module)]


def test_gl_and_reference_do_not_reach_each_other() -> None:
    """What is compared has to be computed twice."""
    assert not [module for module in reached(in_room("gl")) if room(module) == "reference"]
    assert not [module for module in reached(in_room("reference")) if room(module) == "gl"]


def functions(module: str) -> Iterator[str]:
    """Yields the public functions of a module."""
    for node in tree(module).body:
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield node.name


def test_no_module_has_the_name_of_a_function_of_its_own() -> None:
    """Where a room hands on the function, importing the module later would replace it."""
    files = [module for module in modules() if modules()[module].name != "__init__.py"]
    same = {(module, name) for module in files for name in functions(module) if module.endswith(f".{name}")}
    assert same == NAMED_AS_THEIR_MODULE


def loaded(python: Any, code: str) -> set[str]:
    """Returns the modules that some Python code loads."""
    return set(python(f"{code}; import sys; print(*sys.modules)").split())


HEAVY = {"numpy", "pydantic", "moderngl", "trimesh", "OpenImageIO", "rich", "scipy", "click", "dask", "distributed", "PIL"}


def test_importing_the_package_loads_nothing_but_its_names(python: Any) -> None:
    found = loaded(python, "import glshade")
    assert {name for name in found if name.startswith("glshade")} == {"glshade", "glshade.version"}
    assert not found & HEAVY


def test_help_loads_no_room_but_the_command_line(python: Any) -> None:
    code = "import sys; sys.argv = ['glshade', '--help']; from glshade.cli import cli; cli.main(standalone_mode=False)"
    found = loaded(python, f"{code}; print()")
    rooms = {room(name) for name in found if name.startswith("glshade.")}
    assert rooms & set(ROOMS) <= {"cli", "calibration", "image", "mesh"}, "of the last three, the names of their formats"
    assert not found & (HEAVY - {"click", "rich"})


def test_a_worker_starts_without_what_only_some_pictures_need(python: Any) -> None:
    found = loaded(python, "import glshade.batch.worker")
    rooms = {room(name) for name in found if name.startswith("glshade.")} & set(ROOMS)
    assert not rooms & {"reference", "driver", "verification", "catalogue", "pyrender", "tradeoff", "bench", "cli"}
    assert not found & {"trimesh", "rich", "scipy", "click", "dask", "distributed", "PIL"}


def test_pytest_loads_no_more_of_the_plugin_than_it_must_know(python: Any, tmp_path: Path) -> None:
    """A run of pytest in which no test uses the plugin pays for its options and hooks alone."""
    (tmp_path / "test_nothing.py").write_text("def test_nothing(): pass\n", encoding="utf-8")
    run = "import pytest; assert pytest.main(['-q', '-p', 'no:cacheprovider', 'test_nothing.py']) == 0; print()"
    printed = python(f"{run}; import sys; print(*sys.modules)", cwd=tmp_path)
    found = set(printed.splitlines()[-1].split())
    plugin = "glshade.golden.pytest_plugin"
    assert {name for name in found if name.startswith("glshade")} == {"glshade", "glshade.version", "glshade.golden", plugin}
    assert not found & HEAVY
