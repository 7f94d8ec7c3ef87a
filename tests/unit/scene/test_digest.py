"""The digest of a scene: it depends on every value of the scene and on the content of its files, and on nothing else."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from glshade import Image, Object, Scene, load
from glshade.scene.digest import scene_digest

SPHERE = {"shape": "sphere"}
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def digest(**keys: Any) -> str:
    """Returns the digest of a scene with a sphere and these keys."""
    return scene_digest(Scene.model_validate({"objects": [SPHERE], **keys}))


def test_it_is_64_letters_and_stays() -> None:
    assert len(digest()) == 64
    assert digest() == digest()
    assert digest(objects=[{"shape": {"type": "sphere", "segments": 96}}]) == digest(), "a key that is left out has its default"


def test_every_value_counts() -> None:
    scenes = [
        digest(),
        digest(film={"exposure": 1e-9}),
        digest(film={"size": [512, 511]}),
        digest(camera={"fov": 41}),
        digest(camera={"type": "orthographic"}),
        digest(lights=[]),
        digest(lights=[{"type": "ambient"}]),
        digest(lights=[{"type": "ambient", "intensity": 2}]),
        digest(lights=[{"type": "ambient", "intensity": 2}] * 2),
        digest(objects=[{"shape": "cube"}]),
        digest(objects=[{"shape": {"type": "sphere", "segments": 95}}]),
        digest(objects=[{**SPHERE, "material": {"brdf": "phong"}}]),
        digest(objects=[{**SPHERE, "material": {"brdf": "blinn_phong"}}]),
        digest(objects=[{**SPHERE, "material": {"brdf": "phong", "kd": 0.7}}]),
        digest(objects=[{**SPHERE, "shading": "flat"}]),
        digest(objects=[{**SPHERE, "transform": {"translate": [0, 0, 1e-12]}}]),
    ]
    assert len(set(scenes)) == len(scenes)


def make(folder: Path, grey: float = 0.5, height: str = "1") -> Scene:
    folder.mkdir()
    (folder / "tri.obj").write_text(TRIANGLE.replace("v 0 1 0", f"v 0 {height} 0"))
    Image(np.full((2, 2, 3), grey, dtype=np.float32)).save(folder / "t.png")
    (folder / "s.toml").write_text('[[objects]]\nmesh = "tri.obj"\nmaterial = {brdf = "lambert", kd = {texture = "t.png"}}\n')
    return load(folder / "s.toml")


def test_where_files_lie_does_not_count(tmp_path: Path) -> None:
    first = scene_digest(make(tmp_path / "a"))
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    assert scene_digest(load(tmp_path / "b" / "s.toml")) == first


def test_what_files_hold_counts(tmp_path: Path) -> None:
    first = scene_digest(make(tmp_path / "a"))
    assert scene_digest(make(tmp_path / "b", grey=0.6)) != first
    assert scene_digest(make(tmp_path / "c", height="2")) != first
    same = make(tmp_path / "d")
    assert scene_digest(same) == first
    (tmp_path / "d" / "tri.obj").write_text(TRIANGLE.replace("v 1 0 0", "v 3 0 0"))
    assert scene_digest(same) != first, "the file has changed under the scene"


def test_meshes_made_in_python() -> None:
    def digest_of_mesh(scale: float) -> str:
        return scene_digest(Scene(objects=[Object(mesh=(np.eye(3) * scale, [[0, 1, 2]]))]))

    assert digest_of_mesh(1) == digest_of_mesh(1)
    assert digest_of_mesh(1) != digest_of_mesh(2)


def test_the_material_library_of_a_mesh_counts(tmp_path: Path) -> None:
    (tmp_path / "tri.obj").write_text("mtllib m.mtl\nusemtl m\n" + TRIANGLE)
    (tmp_path / "s.toml").write_text('[[objects]]\nmesh = "tri.obj"\n')
    (tmp_path / "m.mtl").write_text("newmtl m\nKd 1 0 0\n")
    first = scene_digest(load(tmp_path / "s.toml"))
    (tmp_path / "m.mtl").write_text("newmtl m\nKd 0 1 0\n")
    assert scene_digest(load(tmp_path / "s.toml")) != first
