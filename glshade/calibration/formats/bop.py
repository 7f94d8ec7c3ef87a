"""BOP: a folder with scene_camera.json and scene_gt.json of the benchmark for object poses (Hodan et al. 2018).

Lengths are in millimetres: a scene unit counts as a metre. The camera's axes are x right, y down, z forward.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from glshade.arrays import Float64
from glshade.calibration.calibration import CalibratedPicture
from glshade.calibration.formats import CameraFormat
from glshade.calibration.reading import at, camera, check_count, numbers, pinhole, pose, table
from glshade.calibration.rotation import FLIPPED, inverse_pose
from glshade.errors import AssetError

# Millimetres in a scene unit, which counts as a metre.
MILLIMETRES = 1000.0


class Bop(CameraFormat):
    """A folder with two JSON files, whose keys are the pictures' numbers from 0."""

    folder: ClassVar[bool] = True

    def texts(self, pictures: Sequence[CalibratedPicture]) -> dict[str, str]:
        cameras: dict[str, Any] = {}
        poses: dict[str, Any] = {}
        # An object has the same number in all pictures. BOP counts from 1.
        names = dict.fromkeys(name for picture in pictures for name in picture.calibration.objects)
        ids = {name: number for number, name in enumerate(names, 1)}
        for index, picture in enumerate(pictures):
            seen = picture.calibration
            view = seen.camera_from_world
            cameras[str(index)] = {
                "cam_K": seen.matrix.reshape(-1).tolist(),
                "cam_R_w2c": view[:3, :3].reshape(-1).tolist(),
                "cam_t_w2c": (view[:3, 3] * MILLIMETRES).tolist(),
                "depth_scale": 1.0,
                "width": seen.size[0],
                "height": seen.size[1],
                "file": picture.name,
            }
            poses[str(index)] = [_pose(view @ placed, ids[name], name) for name, placed in seen.objects.items()]
        return {"scene_camera.json": _lines(cameras), "scene_gt.json": _lines(poses)}

    def read(self, path: Path) -> list[CalibratedPicture]:
        found = []
        where = path / "scene_camera.json"
        entries = table(where)
        check_count(len(entries), where)
        for number, row in sorted(entries.items(), key=lambda item: (len(item[0]), item[0])):
            if not isinstance(row, dict):
                raise AssetError(f"{where}: {number}: must be a table with cam_K, cam_R_w2c and cam_t_w2c")
            name = str(row.get("file", number))
            if "cam_R_w2c" not in row:
                raise AssetError(
                    f"{where}: {name}: cam_R_w2c and cam_t_w2c are missing, so the camera has no place in the world"
                )
            with at(where, name):
                moved = numbers(row["cam_t_w2c"], (3,), "cam_t_w2c") / MILLIMETRES
                placed = inverse_pose(pose(row["cam_R_w2c"], moved, where, name)) @ FLIPPED
                intrinsics = pinhole(row["cam_K"], "cam_K")
                # Other programs leave the size out. The principal point lies near the middle of a picture.
                size = row.get("width", round(2 * intrinsics[2])), row.get("height", round(2 * intrinsics[3]))
                found.append(CalibratedPicture(name, camera("perspective", size, intrinsics, placed)))
        return found

    def recognises(self, path: Path) -> bool:
        return (path / "scene_camera.json").is_file()


def _pose(camera_from_object: Float64, number: int, name: str) -> dict[str, Any]:
    """Returns the pose of an object as scene_gt.json holds it. The scale of the object belongs to its model, and is told apart.

    camera_from_object: transform (4, 4) from the object's space to the camera's, with OpenCV's axes [scene units].
    """
    linear = camera_from_object[:3, :3]
    scale = np.linalg.norm(linear, axis=0)
    return {
        "cam_R_m2c": (linear / scale).reshape(-1).tolist(),
        "cam_t_m2c": (camera_from_object[:3, 3] * MILLIMETRES).tolist(),
        "obj_id": number,
        "obj_name": name,
        "obj_scale": scale.tolist(),
    }


def _lines(rows: dict[str, Any]) -> str:
    """Returns a table as JSON with a line for each picture, as the benchmark's own files have it."""
    return "{\n" + ",\n".join(f'  "{key}": {json.dumps(value)}' for key, value in rows.items()) + "\n}\n"
