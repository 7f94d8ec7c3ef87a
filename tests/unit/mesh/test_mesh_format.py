"""A mesh format is one file: a new reader, added to a copy of the package, is known everywhere."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glshade.image.file import read
from glshade.mesh.formats import SUFFIXES

ROOT = Path(__file__).parents[3]

READER = '''"""TRI: text with one triangle a line: nine numbers, the positions of its corners."""

import numpy as np

from glshade.mesh.reading.file import MeshFile, text_of


def read(file: MeshFile) -> None:
    """Adds the triangles of a TRI file. Errors: AssetError."""
    corners = np.array(text_of(file.data).split(), dtype=np.float64).reshape(-1, 3)
    triangles = np.arange(len(corners)).reshape(-1, 3)
    file.contents.add(file.path.stem, file.build("", corners, triangles))
'''
CORNERS = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, -1], [0, 1, 0]]], dtype=np.float64)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder with a copy of the package that has one more reader."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "glshade", tmp_path / "copy" / "glshade", ignore=ignored)
    (tmp_path / "copy" / "shaders").symlink_to(ROOT / "shaders")
    (tmp_path / "copy" / "glshade" / "mesh" / "formats" / "tri.py").write_text(READER)
    return tmp_path / "copy"


@pytest.mark.slow
def test_a_new_format_is_one_new_file(copy: Path, tmp_path: Path, glshade: Any) -> None:
    (tmp_path / "a.tri").write_text("\n".join(" ".join(map(str, triangle.ravel())) for triangle in CORNERS))
    rows = ["v {} {} {}".format(*corner) for corner in CORNERS.reshape(-1, 3)]
    (tmp_path / "a.obj").write_text("\n".join([*rows, "f 1 2 3", "f 4 5 6"]))

    def drawn(scene: str) -> Any:
        picture = tmp_path / f"{scene}.png"
        done = glshade("render", tmp_path / scene, "-o", picture, "--set", "film.size=[40, 30]", cwd=copy)
        assert done.returncode == 0, done.stderr
        return read(picture, "linear")[0]

    alone = drawn("a.tri")
    assert len(np.unique(alone.reshape(-1, alone.shape[2]), axis=0)) > 2
    np.testing.assert_array_equal(alone, drawn("a.obj"))
    for suffix in ("tri", "obj"):
        document = {"objects": [{"mesh": f"a.{suffix}", "material": "gold", "transform": {"rotate": [0, 20, 0]}}]}
        (tmp_path / f"{suffix}.json").write_text(json.dumps(document))
    np.testing.assert_array_equal(drawn("tri.json"), drawn("obj.json"))

    (tmp_path / "a.xyz").touch()
    done = glshade("render", tmp_path / "a.xyz", cwd=copy)
    assert ", ".join(sorted([*SUFFIXES, ".tri"])) in done.stderr
    assert ".tri" in glshade("render", "--help", cwd=copy).stdout
    (tmp_path / "broken.tri").write_text("0 0 zero")
    assert "not a readable TRI file" in glshade("render", tmp_path / "broken.tri", cwd=copy).stderr


def test_suffixes_are_known_without_an_import_of_the_readers(python: Any) -> None:
    loaded = python("import sys; from glshade.mesh.file import SUFFIXES; print(*SUFFIXES); print(*sys.modules)").split("\n")
    assert loaded[0] == ".3mf .dae .glb .gltf .obj .off .ply .stl"
    assert [name for name in loaded[1].split() if name.startswith("glshade.mesh.formats")] == ["glshade.mesh.formats"]
