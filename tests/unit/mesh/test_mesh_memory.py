"""Mesh files in memory: models stay while somebody holds them, and the rest is bounded by bytes."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any
from weakref import ref

import pytest

from glshade import Scene
from glshade.assembly.assembly import assemble
from glshade.mesh import file as mesh_file
from glshade.mesh.file import load
from glshade.scene import shape
from glshade.scene.file import SceneFile
from glshade.scene.shape import Cube, Plane

OBJ = "v 0 0 {z}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
CUBE, PLANE = Cube(type="cube"), Plane(type="plane")
TRIANGLES = {"objects": [{"mesh": "0.obj"}, {"mesh": "1.obj"}]}


@pytest.fixture(autouse=True)
def no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loader keeps only the newest model, unless somebody holds others."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(mesh_file, "_memory", type(mesh_file._memory)(0))


@pytest.fixture
def paths(tmp_path: Path) -> list[Path]:
    found = [tmp_path / f"{number}.obj" for number in range(3)]
    for number, path in enumerate(found):
        path.write_text(OBJ.format(z=number))
    return found


def forgotten(paths: list[Path], *models: ref[Any]) -> bool:
    """Returns whether the models are gone after another one was loaded."""
    load(paths[2])
    gc.collect()
    return not any(model() for model in models)


def test_a_model_is_not_read_again_while_somebody_holds_it(paths: list[Path]) -> None:
    first = load(paths[0])
    load(paths[1])
    assert load(paths[0]) is first
    model = ref(first)
    del first
    assert forgotten(paths, model)


def test_an_assembly_holds_its_models(paths: list[Path]) -> None:
    scene = Scene.model_validate(TRIANGLES, context={"folder": paths[0].parent})
    assembly = assemble(scene)
    models = [ref(instance.source) for instance in assembly.instances]
    parts = [ref(load(path).parts[0]) for path in paths[:2]]
    load(paths[2])
    assert [load(path) for path in paths[:2]] == [model() for model in models]
    del assembly
    assert forgotten(paths, *models, *parts)


def test_a_scene_file_holds_the_models_of_its_frames(
    paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = tmp_path / "scene.toml"
    track = '[[animation]]\nkey = "objects[0].transform.translate"\nframes = [0, 9]\nvalues = [[0, 0, 0], [0, 0, 1]]\n'
    scene.write_text('[[objects]]\nmesh = "0.obj"\n[[objects]]\nmesh = "1.obj"\n' + track)
    file = SceneFile(scene)
    file.scene(0)

    def fail(*_: Any) -> None:
        raise AssertionError("the file was read again")

    with monkeypatch.context() as patch:
        patch.setattr(mesh_file, "recall", fail)
        assert file.scene(5) is not file.scene(6)
    models = [ref(model) for model in file._models.values()]
    assert len(models) == 2
    del file
    assert forgotten(paths, *models)


def test_equal_shapes_share_a_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their mesh is freed with its last holder, as soon as the limit is exceeded."""
    monkeypatch.setattr(shape, "_meshes", type(shape._meshes)(0))
    mesh = CUBE.mesh()
    PLANE.mesh()
    assert Cube(type="cube").mesh() is mesh
    freed = ref(mesh)
    del mesh
    gc.collect()
    assert freed() is None


# A process loads different STL files and measures how much memory it has taken since the first few of them [bytes].
MEASURE = """
import resource, struct, sys
from pathlib import Path
import numpy as np
from glshade.mesh import file

folder, count, triangles, limit = Path(sys.argv[1]), *map(int, sys.argv[2:])
file._memory.limit = limit or file.REMEMBERED
corners = np.zeros(triangles, dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
corners["corners"] = np.random.default_rng(1).random((triangles, 3, 3))

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()

for number in range(count):
    corners["corners"][0, 0, 0] = number
    path = folder / f"{number}.stl"
    path.write_bytes(bytes(80) + struct.pack("<I", triangles) + corners.tobytes())
    file.load(path)
    path.unlink()
    if number == 20:
        before = resident()
print(resident() - before)
"""


@pytest.mark.parametrize(
    ("count", "triangles", "limit", "slack"),
    [
        (400, 1000, 2 << 20, 6 << 20),
        pytest.param(2000, 5000, 0, 16 << 20, marks=pytest.mark.slow),
    ],
)
def test_many_meshes_do_not_fill_the_memory(
    python: Any, tmp_path: Path, count: int, triangles: int, limit: int, slack: int
) -> None:
    """Without a limit these meshes would take 19 MB, and the slow ones 480 MB."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not say how much memory a process has")
    grown = int(python(MEASURE, tmp_path, count, triangles, limit, XDG_CACHE_HOME=str(tmp_path / "cache")))
    assert grown < (limit or mesh_file.REMEMBERED) + slack
