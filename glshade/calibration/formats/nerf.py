"""NeRF: the file transforms.json of nerfstudio and instant-ngp.

`transform_matrix` is the camera's pose with OpenGL's axes: x right, y up, looking along -z. The scene's own axes are kept.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from glshade.calibration.calibration import CalibratedPicture
from glshade.calibration.formats import CameraFormat
from glshade.calibration.reading import camera, table
from glshade.calibration.rotation import pose_of
from glshade.errors import AssetError

# The names of nerfstudio's camera models that have no distortion.
MODELS = {"perspective": "PINHOLE", "orthographic": "ORTHOPHOTO"}
# The coefficients of a lens's distortion.
DISTORTIONS = ("k1", "k2", "k3", "k4", "p1", "p2")
# The keys that describe a picture's pixels.
INTRINSICS = ("w", "h", "fl_x", "fl_y", "cx", "cy", "camera_model")


class Nerf(CameraFormat):
    """A JSON file with a list "frames"; what all frames have in common stands beside the list."""

    orthographic: ClassVar[bool] = True

    def texts(self, pictures: Sequence[CalibratedPicture]) -> dict[str, str]:
        frames: list[dict[str, Any]] = []
        for picture in pictures:
            seen = picture.calibration
            values = (*seen.size, seen.fx, seen.fy, seen.cx, seen.cy, MODELS[seen.kind])
            own = dict(zip(INTRINSICS, values, strict=True))
            frames.append(
                {
                    "file_path": picture.name,
                    "transform_matrix": seen.world_from_camera.tolist(),
                    "near": seen.near,
                    "far": seen.far,
                }
                | own
            )
        common = {}
        for key in INTRINSICS:
            if len({frame[key] for frame in frames}) == 1:
                common[key] = frames[0][key]
                for frame in frames:
                    del frame[key]
        if {"fl_x", "fl_y", "w", "h"} <= common.keys() and common.get("camera_model") == MODELS["perspective"]:
            # The first files of this kind held this angle alone, and many programs still read nothing else.
            common["camera_angle_x"] = 2 * math.atan(common["w"] / (2 * common["fl_x"]))
            common["camera_angle_y"] = 2 * math.atan(common["h"] / (2 * common["fl_y"]))
        return {"": json.dumps({**common, "frames": frames}, indent=1) + "\n"}

    def read(self, path: Path) -> list[CalibratedPicture]:
        data = table(path)
        found = []
        for frame in data["frames"]:
            values = {**data, **frame}
            name = str(frame["file_path"])
            if any(values.get(key) for key in DISTORTIONS):
                raise AssetError(f"{path}: {name}: its lens is distorted, which cannot be drawn; undistort the pictures")
            model = values.get("camera_model", MODELS["perspective"])
            kind = next((kind for kind, known in MODELS.items() if known == model), "perspective")
            if kind == "perspective" and model not in ("PINHOLE", "OPENCV", "SIMPLE_PINHOLE"):
                raise AssetError(f"{path}: {name}: the camera model {model} cannot be drawn; PINHOLE can")
            width, height = _size(values, path, name)
            fx = values.get("fl_x") or _focal(width, values.get("camera_angle_x"))
            fy = values.get("fl_y") or (_focal(height, values["camera_angle_y"]) if "camera_angle_y" in values else fx)
            if not fx:
                raise AssetError(f"{path}: {name}: fl_x and camera_angle_x are both missing")
            numbers: tuple[Any, ...] = (fx, fy, values.get("cx", width / 2), values.get("cy", height / 2))
            rows = np.array(frame["transform_matrix"], dtype=np.float64)[:3]
            found.append(
                CalibratedPicture(
                    name, camera(kind, (width, height), numbers, pose_of(rows[:, :3], rows[:, 3], f"{path}: {name}"), values)
                )
            )
        return found

    def recognises(self, path: Path) -> bool:
        return path.suffix.lower() == ".json" and path.is_file() and "frames" in table(path)


def _size(values: dict[str, Any], path: Path, name: str) -> tuple[int, int]:
    """Returns width and height of a picture [pixels]: those of the table, or else those of the picture itself.

    Errors: AssetError where neither tells them.
    """
    if "w" in values and "h" in values:
        return int(values["w"]), int(values["h"])
    import OpenImageIO as oiio

    for picture in (path.parent / name, path.parent / f"{name}.png"):
        opened = oiio.ImageInput.open(str(picture)) if picture.is_file() else None
        if opened is not None:
            return opened.spec().width, opened.spec().height
    raise AssetError(f"{path}: {name}: w and h are missing, and there is no such picture whose size could be read")


def _focal(width: float, angle: float | None) -> float | None:
    """Returns the focal length of a picture that spans an angle; None without an angle. The angle is in radians."""
    return None if angle is None else width / (2 * math.tan(float(angle) / 2))
