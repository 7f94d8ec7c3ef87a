"""Robots in URDF files: where their links stand, what they are made of, and what is refused."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from glshade.assembly.assembly import assemble
from glshade.errors import AssetWarning, MissingLibrary, SceneError
from glshade.scene.file import load

pytest.importorskip("yourdfpy", reason="robots need the extra `robots`")

# A post of height 1 with an arm at its top that turns about y, a slider on the arm, and a finger that follows the arm.
ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="post">
    <visual><origin xyz="0 0 0.5"/><geometry><box size="0.2 0.4 1"/></geometry><material name="red"/></visual>
    <collision><geometry><mesh filename="absent.stl"/></geometry></collision>
    <inertial><mass value="not a number"/></inertial>
  </link>
  <link name="arm"><visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual></link>
  <link name="slide"><visual><geometry><sphere radius="0.5"/></geometry></visual></link>
  <link name="finger"><visual><geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="elbow" type="revolute">
    <parent link="post"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 2 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="rail" type="prismatic">
    <parent link="arm"/><child link="slide"/><axis xyz="1 0 0"/><limit lower="0.25" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="follow" type="continuous">
    <parent link="slide"/><child link="finger"/><origin xyz="0 0 3" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 1"/>
    <mimic joint="elbow" multiplier="2" offset="0.5"/>
  </joint>
</robot>
"""
# One triangle in the plane z = 0.
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n"
# One link that draws a mesh.
MESH = """<robot name="m"><link name="body"><visual><origin xyz="0 0 2"/>
<geometry><mesh filename="{name}" scale="1 2 3"/></geometry>{more}</visual></link></robot>"""


def written(folder: Path, text: str, name: str = "robot.urdf") -> Path:
    """Writes a file, and returns its path."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def poses(path: Path, **joints: float) -> dict[str, np.ndarray]:
    """Returns the transforms of the links to the world."""
    scene = load(path, {f"joints.{name}": value for name, value in joints.items()})
    return dict(assemble(scene).objects)


def turned(axis: int, angle: float) -> np.ndarray:
    """Returns the rotation (4, 4) about the axis x, y or z."""
    result, (i, j) = np.eye(4), [(1, 2), (2, 0), (0, 1)][axis]
    result[i, i] = result[j, j] = np.cos(angle)
    result[i, j], result[j, i] = -np.sin(angle), np.sin(angle)
    return result


def moved(x: float, y: float, z: float) -> np.ndarray:
    result = np.eye(4)
    result[:3, 3] = x, y, z
    return result


@settings(max_examples=20, deadline=None)
@given(st.floats(-2, 2), st.floats(0.25, 1))
def test_links_stand_where_the_joints_put_them(tmp_path_factory: pytest.TempPathFactory, elbow: float, rail: float) -> None:
    path = written(tmp_path_factory.getbasetemp(), ARM)
    found = poses(path, elbow=elbow, rail=rail)
    # z up becomes y up, so the robot's x, y, z are the world's x, -z, y.
    up = turned(0, -np.pi / 2)
    arm = moved(0, 0, 1) @ turned(1, elbow)
    slide = arm @ moved(rail, 0, 0)
    finger = slide @ moved(0, 0, 3) @ turned(2, np.pi / 2) @ turned(2, 2 * elbow + 0.5)
    for name, expected in {"post": np.eye(4), "arm": arm, "slide": slide, "finger": finger}.items():
        np.testing.assert_allclose(found[name], up @ expected, atol=1e-12)


def test_joints_without_a_value_stand_at_zero_or_at_the_nearest_limit(tmp_path: Path) -> None:
    found = poses(written(tmp_path, ARM))
    np.testing.assert_allclose(found["slide"][:3, 3], [0.25, 1, 0], atol=1e-12)


def test_shapes_have_their_sizes(tmp_path: Path) -> None:
    boxes = {}
    for item in assemble(load(written(tmp_path, ARM))).instances:
        points = item.mesh.positions @ item.world_from_object[:3, :3].T + item.world_from_object[:3, 3]
        boxes[item.name] = np.stack([points.min(axis=0), points.max(axis=0)])
    np.testing.assert_allclose(boxes["post/0"], [[-0.1, 0, -0.2], [0.1, 1, 0.2]], atol=1e-6)
    np.testing.assert_allclose(boxes["arm/0"], [[-0.1, 0, -0.1], [0.1, 2, 0.1]], atol=1e-6)
    np.testing.assert_allclose(boxes["slide/0"], [[-0.25, 0.5, -0.5], [0.75, 1.5, 0.5]], atol=1e-6)


def test_materials_are_found_by_name_and_are_srgb(tmp_path: Path) -> None:
    text = ARM.replace("1 0 0 1", "0.5 0 1 0.25")
    item = next(item for item in load(written(tmp_path, text)).objects if item.name == "post/0")
    material = item.material
    assert material.kd == pytest.approx((0.21404114, 0, 1))
    assert (material.alpha_mode, material.alpha) == ("blend", 0.25)


@pytest.mark.parametrize("name", ["meshes/t.obj", "package://m/meshes/t.obj", "package://other_name/meshes/t.obj"])
def test_meshes_are_found_in_the_package(tmp_path: Path, name: str) -> None:
    written(tmp_path, "<package/>", "m/package.xml")
    written(tmp_path, OBJ, "m/meshes/t.obj")
    folder = "m" if name.startswith("meshes") else "m/urdf"
    path = written(tmp_path, MESH.format(name=name, more=""), f"{folder}/robot.urdf")
    (item,) = assemble(load(path)).instances
    points = item.mesh.positions @ item.world_from_object[:3, :3].T + item.world_from_object[:3, 3]
    # Scaled by 1, 2, 3, lifted by 2 along z, and turned from z up to y up.
    np.testing.assert_allclose(sorted(points.tolist()), [[0, 2, -2], [0, 2, 0], [1, 2, 0]], atol=1e-6)


def test_a_mesh_file_keeps_its_own_material(tmp_path: Path) -> None:
    colour = '<material name="blue"><color rgba="0 0 1 1"/></material>'
    written(tmp_path, OBJ, "plain.obj")
    written(tmp_path, "mtllib own.mtl\nusemtl own\n" + OBJ, "own.obj")
    written(tmp_path, "newmtl own\nKd 0 1 0\n", "own.mtl")
    given = {
        name: assemble(load(written(tmp_path, MESH.format(name=name, more=colour)))).instances[0].material.kd
        for name in ("plain.obj", "own.obj")
    }
    assert given == {"plain.obj": (0, 0, 1), "own.obj": (0, 1, 0)}


@pytest.mark.parametrize("scale", ["1 2", "0 1 1", "nan"])
def test_a_scale_that_cannot_be_is_refused(tmp_path: Path, scale: str) -> None:
    written(tmp_path, OBJ, "t.obj")
    path = written(tmp_path, MESH.format(name="t.obj", more="").replace("1 2 3", scale))
    with pytest.raises(SceneError, match='link "body"'):
        load(path)


def test_attributes_with_foreign_names_are_ignored(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert load(written(tmp_path, ARM.replace("effort=", "e\u0123=")))
    assert not caplog.records


def test_a_texture_without_texture_coordinates_is_left_out(tmp_path: Path) -> None:
    written(tmp_path, OBJ, "t.obj")
    more = '<material name="x"><texture filename="t.png"/></material>'
    with pytest.warns(AssetWarning, match="no texture coordinates"):
        load(written(tmp_path, MESH.format(name="t.obj", more=more)))


def test_files_outside_the_package_are_refused(tmp_path: Path) -> None:
    written(tmp_path, OBJ, "t.obj")
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner/link.obj").symlink_to(tmp_path / "t.obj")
    # A package is not trusted by its name alone: the folder above the file may be a home folder.
    for name in (
        "../t.obj",
        str(tmp_path / "t.obj"),
        f"file://{tmp_path}/t.obj",
        f"package://{tmp_path.name}/t.obj",
        "link.obj",
    ):
        path = written(tmp_path, MESH.format(name=name, more=""), "inner/robot.urdf")
        with pytest.raises(SceneError, match=r"outside the folder.*--allow-outside") as error:
            load(path)
        assert len(error.value.problems) == 1
        assert len(load(path, allow_outside=True).objects) == 2


# Each fault of a file: what is replaced in ARM, by what, and a part of the message.
FAULTS = {
    "truncated": (ARM[-60:], "", "line"),
    "document type": ("<robot name", '<!DOCTYPE r [<!ENTITY a "b">]><robot name', "DOCTYPE"),
    "other root": ("robot", "scene", "first element"),
    "xacro": ("<material name=", '<xacro:property name="a" value="1"/><material name=', "xacro"),
    "bad number": ('xyz="0 0 1"', 'xyz="0 zero 1"', 'joint "elbow"'),
    "infinite": ('xyz="0 0 1"', 'xyz="0 inf 1"', 'joint "elbow"'),
    "two numbers": ('xyz="0 0 1"', 'xyz="0 1"', 'joint "elbow"'),
    "no axis": ('xyz="0 2 0"', 'xyz="0 0 0"', "axis has no direction"),
    "unknown type": ("prismatic", "rubber", 'joint "rail": its type'),
    "unknown link": ('<child link="arm"', '<child link="leg"', 'joint "elbow": its child "leg"'),
    "circle": ('<parent link="post"', '<parent link="finger"', "circle"),
    "two parents": ('<child link="finger"', '<child link="slide"', 'link "slide": two joints'),
    "two roots": ('<link name="post">', '<link name="lost"/><link name="post">', "2 links that no joint holds"),
    "same name": ('link name="arm"', 'link name="post"', 'link "post": two links'),
    "mimics nothing": ('mimic joint="elbow"', 'mimic joint="knee"', 'joint "follow": mimics "knee"'),
    "mimics itself": ('mimic joint="elbow"', 'mimic joint="follow"', 'joint "follow": mimics itself'),
    "negative size": ('radius="0.5"', 'radius="-0.5"', 'link "slide": the sizes'),
    "limits": ('lower="-2"', 'lower="3"', "lower limit 3 lies above its upper limit 2"),
    "no geometry": ('<sphere radius="0.5"/>', "", 'link "slide"'),
    "colour": ("1 0 0 1", "255 0 0 1", "rgba"),
    "infinite factor": ('multiplier="2"', 'multiplier="nan"', 'joint "follow": has a number that is not finite'),
    "empty": (ARM, "", "line"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_one_line_with_the_place(tmp_path: Path, fault: str) -> None:
    old, new, message = FAULTS[fault]
    assert old in ARM
    path = written(tmp_path, ARM.replace(old, new))
    with pytest.raises(SceneError) as error:
        load(path)
    (line,) = error.value.problems
    assert line.startswith(f"{path}: ")
    assert message in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ({"elbow": 2.5}, 'joint "elbow": 2.5 lies outside its limits, -2 to 2'),
        ({"elbo": 1}, 'joint "elbo": there is no such joint; did you mean "elbow"'),
        ({"follow": 1}, 'follows the joint "elbow"'),
        ({"elbow": "much"}, "must be a number"),
        ({"elbow": float("nan")}, "must be a number"),
    ],
)
def test_a_value_that_a_joint_cannot_have_is_refused(tmp_path: Path, joints: dict[str, float], message: str) -> None:
    with pytest.raises(SceneError) as error:
        poses(written(tmp_path, ARM), **joints)
    (line,) = error.value.problems
    assert message in line


def test_only_robots_have_joints(tmp_path: Path) -> None:
    for path in (written(tmp_path, OBJ, "t.obj"), written(tmp_path, "objects = [{ shape = 'cube' }]", "s.toml")):
        with pytest.raises(SceneError, match="has no joints"):
            load(path, {"joints.elbow": 1})


def test_without_the_library_one_line_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yourdfpy", None)
    with pytest.raises(MissingLibrary, match=r"glshade\[robots\]"):
        load(written(tmp_path, ARM))


def test_info_tells_the_joints(tmp_path: Path) -> None:
    from glshade.cli.info import command

    path = written(tmp_path, ARM)
    result = CliRunner().invoke(command, [str(path), "--json", "--joint", "elbow=1"])
    (facts,) = json.loads(result.stdout)
    states = {joint["name"]: joint for joint in facts["joints"]}
    assert facts["kind"] == "robot"
    assert states["elbow"] == {"name": "elbow", "kind": "revolute", "value": 1, "low": -2, "high": 2, "mimics": None}
    assert states["follow"]["value"] == 2.5
    assert states["follow"]["low"] is None
    text = CliRunner().invoke(command, [str(path)]).stdout
    assert "follows elbow" in text


def test_joints_can_be_swept(tmp_path: Path) -> None:
    from glshade.cli.render import command

    path = written(tmp_path, ARM)
    for value in (0, 1):
        options = ["--sweep", f"joints.elbow={value}", "--joint", "rail=1", "--size", "32x24"]
        result = CliRunner().invoke(command, [str(path), *options, "-o", str(tmp_path / "{joints.elbow}.png")])
        assert result.exit_code == 0, result.output
    pictures = [(tmp_path / f"{value}.png").read_bytes() for value in (0, 1)]
    assert pictures[0] != pictures[1]
