"""NeRF: the file transforms.json of nerfstudio and instant-ngp.

`transform_matrix` is the camera's pose with OpenGL's axes: x right, y up, looking along -z. The scene's own axes are kept.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from glshade.calibration.calibration import CalibratedPicture, Calibration
from glshade.calibration.formats import CameraFormat
from glshade.calibration.reading import Fault, at, camera, number, numbers, pixels, pose, rows, table

# nerfstudio has these names for the camera models without distortion.
MODELS = {"perspective": "PINHOLE", "orthographic": "ORTHOPHOTO"}
# These keys hold the coefficients of a lens's distortion.
DISTORTIONS = ("k1", "k2", "k3", "k4", "p1", "p2")
# These keys describe the pixels of a picture.
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
        data, found = table(path), []
        for index, frame in enumerate(rows(data, "frames", path)):
            # A key without a value counts as left out.
            values = {key: value for key, value in {**data, **frame}.items() if value is not None}
            name = str(frame.get("file_path", index))
            with at(path, name):
                found.append(CalibratedPicture(name, _camera(values, path, name)))
        return found

    def recognises(self, path: Path) -> bool:
        return path.suffix.lower() == ".json" and path.is_file() and "frames" in table(path)


def _camera(values: dict[str, Any], path: Path, name: str) -> Calibration:
    """Returns the camera of a frame. Errors: Fault; KeyError for a key that is missing; AssetError."""
    if any(number(values.get(key, 0), key) for key in DISTORTIONS):
        raise Fault("its lens is distorted, which cannot be drawn; undistort the pictures")
    model = "fisheye" if values.get("is_fisheye") else values.get("camera_model", MODELS["perspective"])
    kind = next((kind for kind, known in MODELS.items() if known == model), "perspective")
    if kind == "perspective" and model not in ("PINHOLE", "OPENCV", "SIMPLE_PINHOLE"):
        raise Fault(f"the camera model {model} cannot be drawn; PINHOLE can")
    width, height = _size(values, path, name)
    across, down = _focal(values, "fl_x", "camera_angle_x", width), _focal(values, "fl_y", "camera_angle_y", height)
    fx, fy = across or down, down or across
    if not fx:
        raise Fault("fl_x and camera_angle_x are both missing")
    matrix = values["transform_matrix"]
    if isinstance(matrix, list) and len(matrix) == 3:
        matrix = [*matrix, [0.0, 0.0, 0.0, 1.0]]
    placed = numbers(matrix, (4, 4), "transform_matrix")
    intrinsics = (fx, fy, values.get("cx", width / 2), values.get("cy", height / 2))
    return camera(kind, (width, height), intrinsics, pose(placed[:3, :3], placed[:3, 3], path, name), values)


def _size(values: dict[str, Any], path: Path, name: str) -> tuple[int, int]:
    """Returns width and height of a picture [pixels]: those of the table, or else those of the picture itself.

    Errors: Fault where neither tells them.
    """
    if "w" in values and "h" in values:
        return pixels(values["w"], "w"), pixels(values["h"], "h")
    import OpenImageIO as oiio

    for picture in (path.parent / name, path.parent / f"{name}.png"):
        opened = oiio.ImageInput.open(str(picture)) if picture.is_file() else None
        if opened is not None:
            return opened.spec().width, opened.spec().height
    raise Fault("w and h are missing, and there is no such picture whose size could be read")


def _focal(values: dict[str, Any], length: str, angle: str, side: int) -> float | None:
    """Returns a focal length [pixels] by its own key, or else by that of the angle that a side of the picture spans [radians].

    Returns None where neither key is there. Errors: Fault.
    """
    if values.get(length):
        return number(values[length], length)
    if angle not in values:
        return None
    spanned = number(values[angle], angle)
    if not 0 < spanned < math.pi:
        raise Fault(f"{angle} must lie between 0 and pi, not {spanned:g}")
    return side / (2 * math.tan(spanned / 2))
