"""Scenes: the values that they may have, and the messages about values that they may not have."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from pydantic import ValidationError
from support.strategies import LIGHTS_OF_ANY_TYPE, MATERIALS, fitted_cameras, transforms

from glshade import BRDFS, LIGHTS, Film, Mesh, Object, Scene, Transform

SPHERE = {"shape": "sphere"}


def faults(data: Any) -> dict[str, str]:
    """Returns key path -> message for every fault of a scene."""
    with pytest.raises(ValidationError) as caught:
        Scene.model_validate(data)
    messages = {".".join(map(str, error["loc"])): error["msg"] for error in caught.value.errors()}
    assert len(messages) == caught.value.error_count(), "the same place is blamed twice"
    return messages


def fault(**keys: Any) -> tuple[str, str]:
    """Returns (key path, message) of the only fault of a scene."""
    (only,) = faults({"objects": [SPHERE], **keys}).items()
    return only


@pytest.mark.parametrize(
    ("keys", "path", "message"),
    [
        (
            {"colour": 3},
            "colour",
            "unknown key; allowed: animation, camera, cameras, cameras_from, description, film, lights, materials, objects",
        ),
        ({"light": []}, "light", 'unknown key; did you mean "lights"?'),
        ({"film": {"sizes": [1, 1]}}, "film.sizes", 'unknown key; did you mean "size"?'),
        ({"film": {"size": [0, 10]}}, "film.size.0", "must be greater than or equal to 1, not 0"),
        ({"film": {"size": [10, -1]}}, "film.size.1", "must be greater than or equal to 1, not -1"),
        ({"film": {"size": [1, 131073]}}, "film.size.1", "must be less than or equal to 131072, not 131073"),
        ({"film": {"size": [1.5, 2]}}, "film.size.0", "must be a whole number, not 1.5"),
        ({"film": {"size": ["64", 2]}}, "film.size.0", "must be a number, not '64'"),
        ({"film": {"size": [8]}}, "film.size.1", "is missing: the list is too short"),
        ({"film": {"size": [8, 8, 8]}}, "film.size", "must be a list of 2, not of 3"),
        ({"film": {"size": 8}}, "film.size", "must be a list, not 8"),
        ({"film": {"samples": 3}}, "film.samples", "3 is not one of 1, 2, 4 or 8"),
        ({"film": {"encoding": "rgb"}}, "film.encoding", "'rgb' is not one of 'srgb' or 'linear'"),
        ({"film": {"exposure": math.nan}}, "film.exposure", "nan is not a finite number"),
        ({"film": {"exposure": True}}, "film.exposure", "must be a number, not True"),
        ({"film": {"exposure": "1"}}, "film.exposure", "must be a number, not '1'"),
        ({"film": {"background": [1, 2]}}, "film.background", "must be 3 numbers, or 4 with alpha, not 2"),
        ({"film": {"background": [1, 1, 1, 2]}}, "film.background", "alpha must be from 0 to 1, not 2"),
        ({"film": {"background": [1, 1, math.inf]}}, "film.background.2", "inf is not a finite number"),
        ({"film": 3}, "film", "must be a table, not 3"),
        ({"camera": {"type": "perspectve"}}, "camera.type", "unknown type 'perspectve'; did you mean \"perspective\"?"),
        ({"camera": {"fov": 180}}, "camera.fov", "must be less than 180, not 180"),
        ({"camera": {"fov": "wide"}}, "camera.fov", "must be a number, not 'wide'"),
        ({"camera": {"fit": 1}}, "camera.fit", "must be true or false, not 1"),
        ({"camera": {"up": [0, 0, 0]}}, "camera.up", "must not be the zero vector: it has no direction"),
        (
            {"camera": {"eye": [1, 2, 3], "target": [1, 2, 3]}},
            "camera.target",
            "is where the eye is: there is no direction of view",
        ),
        ({"camera": {"near": 3, "far": 2}}, "camera.near", "3 must be less than far, 2"),
        ({"camera": {"near": 0}}, "camera.near", "must be greater than 0 in a perspective view, not 0"),
        ({"camera": {"type": "orthographic", "height": 0}}, "camera.height", "must be greater than 0, not 0"),
        ({"camera": {"type": "orthographic", "height": "tall"}}, "camera.height", "must be a number, not 'tall'"),
        ({"lights": [{"type": "pont"}]}, "lights.0.type", "unknown type 'pont'; did you mean \"point\"?"),
        ({"lights": [{}]}, "lights.0", "lacks the key 'type'; allowed: ambient, directional, gltf_spot, point, spot"),
        ({"lights": ["sun"]}, "lights.0", "must be a table with the key 'type', not 'sun'"),
        ({"lights": {"type": "point"}}, "lights", "must be a list, not {'type': 'point'}"),
        ({"lights": [{"type": "point"}]}, "lights.0.position", "is required"),
        ({"lights": [{"type": "ambient", "intensity": math.inf}]}, "lights.0.intensity", "inf is not a finite number"),
        (
            {"lights": [{"type": "ambient", "colour": "red"}]},
            "lights.0.colour",
            "must be three numbers, or one that stands for three, not 'red'",
        ),
        ({"lights": [{"type": "directional", "direction": [0, 0, 0]}]}, "lights.0.direction", "must not be the zero vector"),
        ({"lights": [{"type": "point", "position": [0, 0, 0], "r_min": 0}]}, "lights.0.r_min", "must be greater than 0, not 0"),
        (
            {"lights": [{"type": "spot", "position": [0, 0, 0], "inner": 40}]},
            "lights.0.inner",
            "40 must not be larger than outer, 30",
        ),
        ({"lights": [{"type": "ambient", "only": ["ball"]}]}, "lights.0.only.0", 'no object is named "ball"; allowed: none'),
        ({"materials": {"m": {"brdf": "fong"}}}, "materials.m.brdf", "unknown brdf 'fong'; did you mean \"phong\"?"),
        ({"materials": {"m": {"brdf": "{x}"}}}, "materials.m.brdf", "unknown brdf '{x}'; allowed: ambient"),
        ({"materials": {"m": {"kd": 1}}}, "materials.m", "lacks the key 'brdf'; allowed: ambient"),
        ({"materials": {"m": {"brdf": "phong", "kd": -1}}}, "materials.m.kd", "must be at least 0, not -1"),
        ({"materials": {"m": {"brdf": "phong", "kd": [1, 2]}}}, "materials.m.kd", "must be three numbers, or one that stands"),
        ({"materials": {"m": {"brdf": "phong", "exponent": 2e8}}}, "materials.m.exponent", "must be at most 1e+08, not 2e+08"),
        ({"materials": {"m": {"brdf": "phong", "exponent": math.nan}}}, "materials.m.exponent", "nan is not a finite number"),
        ({"materials": {"m": {"brdf": "phong", "exponant": 3}}}, "materials.m.exponant", 'did you mean "exponent"?'),
        ({"materials": {"m": {"brdf": "lambert", "alpha": 2}}}, "materials.m.alpha", "must be less than or equal to 1, not 2"),
        ({"objects": []}, "objects", "is empty: there is nothing to draw"),
        ({"objects": "sphere"}, "objects", "must be a list, not 'sphere'"),
        ({"objects": [3]}, "objects.0", "must be a table, not 3"),
        ({"objects": [{}]}, "objects.0", "needs a mesh or a shape: no object names it as its parent"),
        ({"objects": [{"shape": "spere"}]}, "objects.0.shape", "unknown type 'spere'; did you mean \"sphere\"?"),
        ({"objects": [{"shape": {"type": "torus", "minor": 1}}]}, "objects.0.shape.minor", "must be less than 1, not 1"),
        ({"objects": [{**SPHERE, "material": "glod"}]}, "objects.0.material", 'no material or preset is named "glod"; did you'),
        ({"objects": [{**SPHERE, "parent": "x"}]}, "objects.0.parent", 'no object is named "x"; allowed: none'),
        (
            {"objects": [{**SPHERE, "shading": "fong"}]},
            "objects.0.shading",
            "'fong' is not one of 'flat', 'gouraud' or 'phong'",
        ),
        ({"objects": [{**SPHERE, "vertex_colours": "no"}]}, "objects.0.vertex_colours", "must be true or false, not 'no'"),
        (
            {"objects": [{**SPHERE, "transform": {"scale": [1, 0, 1]}}]},
            "objects.0.transform.scale",
            "must not be zero along any axis",
        ),
        ({"objects": [{**SPHERE, "transform": {"scale": 0}}]}, "objects.0.transform.scale", "must not be zero along any axis"),
        ({"objects": [{"mesh": "/nowhere.obj"}]}, "objects.0.mesh", "/nowhere.obj does not exist"),
        ({"objects": [{"mesh": "/"}]}, "objects.0.mesh", "/ is a folder, not a file"),
        ({"objects": [{"mesh": [[], []]}]}, "objects.0.mesh", "mesh has no positions"),
        ({"objects": [{"mesh": 3}]}, "objects.0.mesh", "must be the path of a mesh file"),
    ],
)
def test_one_fault(keys: dict[str, Any], path: str, message: str) -> None:
    fault_path, fault_message = fault(**keys)
    assert fault_path == path or (fault_path == f"{path}.type" and "shape" in path)
    assert message in fault_message
    assert "\n" not in fault_message


def test_every_fault_at_once() -> None:
    assert set(
        faults(
            {
                "film": {"size": [0, 0], "samples": 3},
                "camera": {"fov": 0, "near": 2, "far": 1},
                "materials": {"m": {"brdf": "phong", "kd": -1, "ks": [1], "x": 1}},
                "objects": [
                    {"shape": "sphere", "name": "a", "parent": "b", "material": "n", "transform": {"rotate": [1, 2]}},
                    {
                        "mesh": "/nowhere.ply",
                        "name": "b",
                        "parent": "a",
                        "transform": {"scale": 1, "matrix": np.eye(4).tolist()},
                    },
                ],
                "lights": [{"type": "spot", "inner": 3, "outer": 2, "only": ["c", "a"]}],
            }
        )
    ) == {
        "film.size.0",
        "film.size.1",
        "film.samples",
        "camera.fov",
        "camera.near",
        "materials.m.kd",
        "materials.m.ks",
        "materials.m.x",
        "objects.0.parent",
        "objects.0.material",
        "objects.0.transform.rotate.2",
        "objects.1.mesh",
        "objects.1.parent",
        "objects.1.transform.scale",
        "lights.0.position",
        "lights.0.inner",
        "lights.0.only.0",
    }


def test_a_cycle_of_parents_names_its_links() -> None:
    links = [{**SPHERE, "name": name, "parent": parent} for name, parent in ("ab", "bc", "ca", "db")]
    assert faults({"objects": links}) == {
        "objects.0.parent": "a cycle: a -> b -> c -> a",
        "objects.1.parent": "a cycle: b -> c -> a -> b",
        "objects.2.parent": "a cycle: c -> a -> b -> c",
    }
    assert faults({"objects": [{**SPHERE, "name": "a", "parent": "a"}]}) == {"objects.0.parent": "a cycle: a -> a"}


def test_names_are_unique() -> None:
    twins = [{**SPHERE, "name": "a"}, SPHERE, {**SPHERE, "name": "a"}]
    assert faults({"objects": twins}) == {"objects.2.name": '"a" is already the name of objects[0]'}


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.zeros((4, 4)), "the last row must be [0, 0, 0, 1]"),
        (np.diag([1, 1, 0, 1]), "is singular: it flattens what it moves"),
        ([[1, 2, 3, 0], [2, 4, 6, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "is singular"),
        (np.eye(4)[[0, 1, 3, 2]], "the last row must be [0, 0, 0, 1]"),
        (np.diag([math.nan, 1, 1, 1]), "nan is not a finite number"),
        (np.eye(3), "is missing: the list is too short"),
    ],
)
def test_matrices_that_flatten(matrix: Any, message: str) -> None:
    messages = faults({"objects": [{**SPHERE, "transform": {"matrix": np.asarray(matrix, dtype=float).tolist()}}]})
    assert all(path.startswith("objects.0.transform.matrix") for path in messages)
    assert any(message in text for text in messages.values())


@pytest.mark.parametrize("size", [1e-30, 1e-5, 1e30])
def test_a_matrix_may_be_tiny_or_huge(size: float) -> None:
    assert Transform(matrix=np.diag([size, -size, size, 1]).tolist()).array()[0, 0] == size


def test_a_transform_scales_then_turns_then_moves() -> None:
    world = Transform(translate=(1, 2, 3), rotate=(90, 0, 90), scale=(2, 3, 4)).array()
    # The x axis becomes 2 long, stays under the turn about x, and is turned to y about z. The y axis becomes 3 long and is
    # turned to z. The z axis becomes 4 long, is turned to -y about x and then to x about z.
    assert world @ [1, 0, 0, 1] == pytest.approx([1, 4, 3, 1])
    assert world @ [0, 1, 0, 1] == pytest.approx([1, 2, 6, 1])
    assert world @ [0, 0, 1, 1] == pytest.approx([5, 2, 3, 1])


@given(transform=transforms())
def test_a_transform_is_its_matrix(transform: dict[str, Any]) -> None:
    array = Transform(**transform).array()
    assert np.linalg.det(array[:3, :3]) == pytest.approx(np.prod(transform["scale"]), rel=1e-9)
    again = Transform(matrix=array.tolist())
    assert np.array_equal(again.array(), array)


@given(material=MATERIALS, light=LIGHTS_OF_ANY_TYPE, camera=fitted_cameras(), transform=transforms())
def test_a_scene_survives_json(material: Any, light: Any, camera: Any, transform: Any) -> None:
    sphere = {**SPHERE, "material": material, "transform": transform}
    scene = Scene(objects=[sphere], lights=[light], camera=camera, materials={"m": material})
    assert Scene.model_validate_json(scene.model_dump_json()) == scene


def test_the_defaults() -> None:
    scene = Scene(objects=[SPHERE])
    assert scene.film == Film(size=(512, 512), samples=1, background=(0, 0, 0), encoding="srgb", exposure=0)
    assert scene.camera.type == "perspective"
    assert scene.lights is None
    assert Scene(objects=[SPHERE], lights=[]).lights == ()


def test_values_cannot_be_changed() -> None:
    scene = Scene(objects=[SPHERE])
    with pytest.raises(ValidationError, match="frozen"):
        scene.film = Film()  # type: ignore[misc]
    with pytest.raises(ValidationError, match="frozen"):
        scene.objects[0].shading = "flat"  # type: ignore[misc]


class TestMadeInPython:
    """Scenes that are made in Python, of models in place of tables, and of meshes from other libraries."""

    def test_models_in_place_of_tables(self) -> None:
        material = BRDFS["phong"](kd=0.5)
        light = LIGHTS["point"](position=(0, 0, 1))
        scene = Scene(objects=[Object(shape="sphere", material=material)], lights=[light], film=Film(size=(3, 4)))
        assert scene.objects[0].material is material
        assert scene.lights is not None
        assert scene.lights[0] is light

    def test_numpy_numbers(self) -> None:
        material = BRDFS["phong"](kd=np.float32([0.25, 0.5, 1]), exponent=np.float32(3))
        assert (material.kd, material.exponent) == ((0.25, 0.5, 1), 3)
        assert Film(size=(np.int64(3), 4), exposure=np.float64(1)).exposure == 1
        assert Transform(translate=np.arange(3)).translate == (0, 1, 2)

    def test_a_pair_of_arrays(self) -> None:
        mesh = Object(mesh=(np.eye(3), [[0, 1, 2]])).mesh
        assert isinstance(mesh, Mesh)
        assert np.array_equal(mesh.positions + mesh.origin, np.eye(3))

    def test_a_trimesh(self) -> None:
        box = trimesh.creation.box()
        mesh = Object(mesh=box).mesh
        assert isinstance(mesh, Mesh)
        assert np.array_equal(mesh.triangles, box.faces)
        assert mesh.normals is None, "trimesh computes normals; these are not the mesh's own"

    def test_normals_that_trimesh_computes_change_nothing(self) -> None:
        """trimesh stores normals that it computed itself like normals that it was given, so neither are used."""
        box = trimesh.creation.box()
        before = Object(mesh=box).mesh
        assert box.vertex_normals.shape == (8, 3)
        after = Object(mesh=box).mesh
        assert isinstance(before, Mesh)
        assert isinstance(after, Mesh)
        assert before.digest == after.digest

    def test_the_face_colours_of_a_trimesh(self) -> None:
        box = trimesh.creation.box()
        box.visual.face_colors = np.tile(np.uint8([255, 0, 0, 255]), (12, 1))
        mesh = Object(mesh=box).mesh
        assert isinstance(mesh, Mesh)
        assert len(mesh.triangles) == 12
        assert mesh.colours == pytest.approx(np.tile([1.0, 0, 0, 1], (36, 1)))

    @pytest.mark.parametrize(
        ("mesh", "message"),
        [
            ((np.eye(3), [[0, 1, 3]]), "triangle index 3 is out of range"),
            ((np.eye(3) * np.nan, [[0, 1, 2]]), "not finite"),
            (([], []), "no positions"),
            (trimesh.Trimesh(), "no positions"),
            (("a", "b"), "could not convert string to float"),
        ],
    )
    def test_bad_meshes(self, mesh: Any, message: str) -> None:
        (text,) = faults({"objects": [{"mesh": mesh}]}).values()
        assert message in text

    def test_the_texture_coordinates_of_a_trimesh(self) -> None:
        box = trimesh.creation.box()
        box.visual = trimesh.visual.TextureVisuals(uv=np.linspace(0, 1, 16).reshape(8, 2))
        mesh = Object(mesh=box).mesh
        assert isinstance(mesh, Mesh)
        assert mesh.uvs == pytest.approx(box.visual.uv)
        assert mesh.colours is None

    def test_the_colours_of_a_trimesh_are_decoded(self) -> None:
        box = trimesh.creation.box()
        box.visual.vertex_colors = np.tile(np.uint8([255, 188, 0, 128]), (8, 1))
        mesh = Object(mesh=box).mesh
        assert isinstance(mesh, Mesh)
        # sRGB code 188 is the code whose linear value is nearest to half that of 255.
        assert mesh.colours == pytest.approx(np.tile([1, 0.5, 0, 128 / 255], (8, 1)), abs=4e-3)
