"""What `import glshade` offers, and what it costs."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import pytest

import glshade

PUBLIC = [
    *("AssetError", "BRDFS", "ContextError", "Film", "GlshadeError", "Image", "LIGHTS", "Mesh", "NormalMap", "Object"),
    *("Orthographic", "Perspective", "Plan", "Renderer", "Scene", "SceneError", "ShaderError", "Texture", "Transform"),
    *("compare", "evaluate", "explain", "from_pyrender", "load", "reference", "render", "verify", "Verdict"),
]


def test_every_public_name_is_there_and_explained() -> None:
    assert set(PUBLIC) <= set(glshade.__all__), "a promised name is gone"
    assert sorted(glshade.__all__) == dir(glshade)
    for name in glshade.__all__:
        value = getattr(glshade, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, name


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
    # What glshade is compared with is another program; it draws in a process of its own.
    assert all(path.parent.name in ("gl", "driver", "peers") for path in importers)


def test_typed() -> None:
    assert (Path(glshade.__file__).parent / "py.typed").exists()
