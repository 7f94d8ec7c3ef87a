"""The cameras and lights of a glTF file: found by name, placed by nodes and objects, and drawn in the file's units."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import glshade
from glshade import reference
from glshade.assembly.assembly import assemble
from glshade.errors import AssetWarning, SceneError
from glshade.mesh.file import load
from glshade.scene.file import SceneFile
from tests.support.gltf_file import GltfFile

# A square of 2 by 2 in the plane z = 0 that faces +z.
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 0]], dtype="<f4")
# A white surface without highlights.
WHITE = {
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
    "extensions": {"KHR_materials_specular": {"specularColorFactor": [0.0, 0.0, 0.0]}},
}
PERSPECTIVE = {"type": "perspective", "perspective": {"yfov": math.radians(60), "znear": 0.5}}
ORTHOGRAPHIC = {"type": "orthographic", "orthographic": {"xmag": 2.0, "ymag": 1.5, "znear": 0.0, "zfar": 10.0}}


def square(nodes: list[dict[str, Any]], lights: Any = (), **header: Any) -> GltfFile:
    """Returns a file with a white square, further nodes, and lights of KHR_lights_punctual."""
    file = GltfFile(nodes=[{"mesh": 0}, *nodes], materials=[WHITE], **header)
    if lights:
        file.header["extensions"] = {"KHR_lights_punctual": {"lights": list(lights)}}
    normals = np.tile(np.array([0, 0, 1], dtype="<f4"), (4, 1))
    return file.one({**file.primitive([0, 1, 2, 2, 1, 3], POSITION=SQUARE, NORMAL=normals), "material": 0})


def light(number: int, **node: Any) -> dict[str, Any]:
    """Returns a node with a light."""
    return {"extensions": {"KHR_lights_punctual": {"light": number}}, **node}


def middle(scene: Any) -> Any:
    """Returns the linear colour (3,) in the middle of the scene's picture."""
    pixels = np.asarray(reference.render(scene).pixels)
    return pixels[pixels.shape[0] // 2, pixels.shape[1] // 2, :3]


def test_cameras_are_found_by_the_names_of_their_nodes(tmp_path: Path) -> None:
    nodes = [
        {"name": "front", "camera": 0, "translation": [0, 0, 3], "scale": [2, 2, 2]},
        {"name": "front", "camera": 1, "translation": [0, 0, 5]},
        {"camera": 1},
    ]
    path = square(nodes, cameras=[PERSPECTIVE, {**ORTHOGRAPHIC, "name": "plan"}]).write(tmp_path / "a.glb")
    assert list(load(path).cameras) == ["front", "front.2", "plan"]
    file = SceneFile(path)
    assert file.cameras == ("front", "front.2", "plan")
    front = assemble(file.scene(camera="front")).view
    np.testing.assert_allclose(front.eye, [0, 0, 3])
    np.testing.assert_allclose(front.axes, np.eye(3))
    assert front.perspective
    assert front.half_height == pytest.approx(math.tan(math.radians(30)))
    assert front.near == 0.5
    # Without zfar the view ends behind the scene.
    assert 3 < front.far < 4
    second = assemble(file.scene(camera="front.2")).view
    assert not second.perspective
    assert (second.half_height, second.near, second.far) == (1.5, 0.0, 10.0)
    with pytest.raises(SceneError, match='no camera is named "fromt"; did you mean "front"'):
        file.scene(camera="fromt")


def test_a_camera_of_a_file_moves_with_its_object(tmp_path: Path) -> None:
    square([{"name": "front", "camera": 0, "translation": [0, 0, 3]}], cameras=[PERSPECTIVE]).write(tmp_path / "a.glb")
    objects = [
        {"name": "frame", "transform": {"translate": [10, 0, 0]}},
        {"name": "one", "mesh": "a.glb", "parent": "frame", "transform": {"rotate": [0, 90, 0]}},
    ]
    (tmp_path / "s.json").write_text(json.dumps({"objects": objects}))
    view = assemble(SceneFile(tmp_path / "s.json").scene(camera="front")).view
    np.testing.assert_allclose(view.eye, [13, 0, 0], atol=1e-9)
    np.testing.assert_allclose(view.axes[2], [1, 0, 0], atol=1e-9)
    twice = [*objects, {"name": "two", "mesh": "a.glb"}]
    (tmp_path / "s.json").write_text(json.dumps({"objects": twice}))
    assert SceneFile(tmp_path / "s.json").cameras == ("one/front", "two/front")


@pytest.mark.parametrize(
    ("kind", "node", "expected"),
    [
        # 2 lux that come at 60 degrees to the normal give a white surface the luminance 2 cos(60) / pi [cd/m2].
        ({"type": "directional", "intensity": 2}, {"rotation": [0, 0.5, 0, math.sqrt(0.75)]}, 2 * 0.5 / math.pi),
        # 8 candela at a distance of 2 give 2 lux. The scale of the node changes nothing.
        ({"type": "point", "intensity": 8}, {"translation": [0, 0, 2], "scale": [3, 3, 3]}, 2 / math.pi),
        ({"type": "point", "intensity": 8, "color": [0, 1, 0.5]}, {"translation": [0, 0, 2]}, [0, 2 / math.pi, 1 / math.pi]),
        ({"type": "spot", "intensity": 8}, {"translation": [0, 0, 2]}, 2 / math.pi),
        ({"type": "spot", "intensity": 8}, {"translation": [0, 0, 2], "rotation": [0, 1, 0, 0]}, 0),
    ],
)
def test_lights_shine_in_lux_and_candela(tmp_path: Path, kind: dict[str, Any], node: dict[str, Any], expected: Any) -> None:
    nodes = [light(0, **node), {"name": "front", "camera": 0, "translation": [0, 0, 1]}]
    path = square(nodes, [kind], cameras=[PERSPECTIVE]).write(tmp_path / "a.glb")
    overrides = {"file_lights": True, "film.size": [9, 9], "film.samples": 1}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = SceneFile(path, overrides).scene(camera="front")
    np.testing.assert_allclose(middle(scene), np.broadcast_to(expected, 3), atol=2e-4)


def test_without_the_key_the_default_lights_shine_and_one_line_says_so(tmp_path: Path) -> None:
    lights = [{"type": "point"}, {"type": "directional"}]
    path = square([light(0, translation=[0, 0, 1]), light(1)], lights).write(tmp_path / "a.glb")
    with pytest.warns(AssetWarning, match=r"a\.glb: has 2 lights of its own, but is drawn with the default") as caught:
        scene = glshade.load(path)
    assert len(caught) == 1
    assert [item.type for item in assemble(scene).lights] == ["directional", "directional", "ambient"]
    own = assemble(glshade.load(path, {"file_lights": True})).lights
    assert [item.type for item in own] == ["point", "directional"]


def test_lights_that_need_another_exposure_are_said(tmp_path: Path) -> None:
    """500 pi candela at a distance of 1 show white as 500. The line names the exposure that shows it as 1."""
    lamp = {"type": "point", "intensity": 500 * math.pi}
    path = square([light(0, translation=[0, 0, 1])], [lamp]).write(tmp_path / "a.glb")
    with pytest.warns(
        AssetWarning, match=r"about 500 cd/m\^2; .* is 500 times white; --set film\.exposure=-9\.0 shows it"
    ) as caught:
        glshade.load(path, {"file_lights": True})
    assert len(caught) == 1
    glshade.load(path, {"file_lights": True, "film.exposure": -9.0})


def test_a_scene_that_speaks_of_lights_is_not_warned(tmp_path: Path) -> None:
    square([light(0, translation=[0, 0, 1])], [{"type": "point"}]).write(tmp_path / "a.glb")

    def lights(item: dict[str, Any], **scene: Any) -> list[Any]:
        (tmp_path / "s.json").write_text(json.dumps({"objects": [{"name": "o", "mesh": "a.glb", **item}], **scene}))
        return list(assemble(glshade.load(tmp_path / "s.json")).lights)

    sun = {"type": "directional", "name": "sun"}
    assert [item.name for item in lights({}, lights=[sun])] == ["sun"]
    assert len(lights({"file_lights": False})) == 3
    joined = lights({"file_lights": True, "transform": {"translate": [1, 0, 0], "scale": 2}}, lights=[sun])
    assert [item.type for item in joined] == ["directional", "point"]
    np.testing.assert_allclose(joined[1].position, [1, 0, 2])
    assert [item.type for item in lights({"file_lights": True}, lights=[])] == ["point"]


def test_both_renderers_draw_the_lights_of_a_file_alike(tmp_path: Path) -> None:
    lights = [{"type": "point", "intensity": 4}, {"type": "spot", "intensity": 9, "spot": {"outerConeAngle": 0.6}}]
    nodes = [light(0, translation=[0.5, 0, 1]), light(1, translation=[-0.5, 0, 2])]
    path = square(nodes, lights).write(tmp_path / "a.glb")
    verdict = glshade.verify(glshade.load(path, {"file_lights": True, "film.size": [48, 36], "film.samples": 1}))
    assert verdict.exit_code == 0, str(verdict)


def test_lights_and_cameras_that_cannot_be_placed_are_named(tmp_path: Path) -> None:
    wrong = [light(0), {"name": "none", "camera": 0}]
    flat = {"type": "perspective", "perspective": {"yfov": 0.0, "znear": 0.1}}
    path = square(wrong, [{"type": "laser"}], cameras=[flat]).write(tmp_path / "a.glb")
    with pytest.warns(AssetWarning) as caught:
        model = load(path)
    assert not model.lights
    assert not model.cameras
    text = "\n".join(str(warning.message) for warning in caught)
    assert "light 0 is of the type laser" in text
    assert "cameras[0] has no extent" in text


def test_an_object_without_mesh_and_shape_is_a_frame_for_its_children(tmp_path: Path) -> None:
    def scene(objects: list[dict[str, Any]]) -> Any:
        (tmp_path / "s.json").write_text(json.dumps({"objects": objects}))
        return glshade.load(tmp_path / "s.json")

    frame = {"name": "frame", "transform": {"translate": [0, 7, 0]}}
    child = {"name": "ball", "shape": "sphere", "parent": "frame"}
    (instance,) = assemble(scene([frame, child])).instances
    np.testing.assert_allclose(instance.world_from_object[:3, 3], [0, 7, 0])
    with pytest.raises(SceneError, match=r"objects\[0\]: needs a mesh or a shape: no object names it as its parent"):
        scene([{"name": "frame"}, {"shape": "cube"}])
    with pytest.raises(SceneError, match=r"objects\[0\]: has a mesh and a shape"):
        scene([{"mesh": "a.obj", "shape": "cube"}])
