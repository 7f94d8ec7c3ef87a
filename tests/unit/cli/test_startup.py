"""The start of a command: what it loads, and what it leaves to others."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from glshade.gl import egl

# What a scene of plain materials and a PNG file need not load.
UNUSED = {"PIL", "rich", "scipy", "statistics", "trimesh", "matplotlib", "dask"}
SCENE = """\
[film]
size = [16, 16]
[[objects]]
shape = "sphere"
material = { brdf = "lambert" }
"""


def test_a_plain_picture_loads_nothing_that_it_does_not_need(python: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(SCENE, encoding="utf-8")
    code = (
        "import os, sys, glshade.cli; sys.argv = ['glshade', 'render', 'a.toml', '-o', 'a.png']; "
        "os._exit = lambda code: print(code, *sys.modules); glshade.cli.main()"
    )
    code, *loaded = python(code, cwd=tmp_path).splitlines()[-1].split()
    assert code == "0"
    assert (tmp_path / "a.png").is_file()
    assert "glshade.gl.renderer" in loaded
    assert not UNUSED & set(loaded)


def test_the_library_leaves_pythons_settings_alone(python: Any) -> None:
    """Another program's pydantic may have plug-ins, and its garbage is its own."""
    code = "import gc, os, sys; before = gc.get_threshold(); import glshade.scene.scene; "
    code += "print(before == gc.get_threshold(), 'PYDANTIC_DISABLE_PLUGINS' in os.environ)"
    assert python(code).split() == ["True", "False"]


def test_a_missing_driver_is_told_by_whoever_opens_a_context(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(egl, "LIBEGL", "libNoSuchLibrary.so.1")
    monkeypatch.setattr(egl, "_ahead", None)
    egl.load_ahead()
    with pytest.raises(egl.ContextError, match=r"libNoSuchLibrary\.so\.1 cannot be loaded"):
        egl.load_egl()
