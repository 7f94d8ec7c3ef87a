"""What `import glshade` offers, and what it costs."""

from __future__ import annotations

import ast
import importlib
import inspect
from pathlib import Path
from typing import Any

import pytest

import glshade


def listed() -> dict[str, str]:
    """Public name -> the module it comes from: the imports of the stub, which is the one list of them."""
    stub = ast.parse(Path(glshade.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    found = {}
    for node in stub.body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                assert alias.asname == alias.name, f"{alias.name} would be private to type checkers"
                found[alias.name] = str(node.module)
    return found


def test_the_package_offers_what_the_stub_lists() -> None:
    assert sorted(listed()) == sorted(glshade.__all__) == dir(glshade)
    for name, module in listed().items():
        home = importlib.import_module(module)
        assert getattr(glshade, name) is (
            importlib.import_module(f"glshade.{name}") if home is glshade else getattr(home, name)
        )
        value = getattr(glshade, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, name
            assert value.__name__ == name


def test_a_wrong_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'glshade' has no attribute 'Scen'"):
        _ = glshade.Scen  # type: ignore[attr-defined]


def test_errors_have_one_root_and_an_exit_code_each() -> None:
    codes = {"GlshadeError": 1, "SceneError": 3, "AssetError": 3, "ShaderError": 4, "ContextError": 5}
    for name, code in codes.items():
        error = getattr(glshade, name)
        assert issubclass(error, glshade.GlshadeError)
        assert error.exit_code == code


def test_importing_costs_nothing(python: Any) -> None:
    heavy = "{'moderngl', 'numpy', 'trimesh', 'rich', 'pydantic', 'OpenImageIO', 'click'}"
    assert python(f"import glshade, sys; print(sorted({heavy} & set(sys.modules)))") == "[]"


def test_a_scene_costs_no_context_and_no_trimesh(python: Any) -> None:
    heavy = "{'moderngl', 'trimesh', 'rich', 'OpenImageIO', 'PIL', 'scipy'}"
    code = "import sys; from glshade import Scene; Scene(objects=[{'shape': 'cube'}]); "
    assert python(code + f"print(sorted({heavy} & set(sys.modules)))") == "[]"


def test_only_gl_knows_opengl() -> None:
    root = Path(glshade.__file__).parent
    importers = [path for path in root.rglob("*.py") if "import moderngl" in path.read_text(encoding="utf-8")]
    assert importers
    # The programs that glshade is compared with draw in processes of their own.
    assert all(path.parent.name in ("gl", "peers", "life") for path in importers)


def test_typed() -> None:
    assert (Path(glshade.__file__).parent / "py.typed").exists()
