"""COLMAP: the text form of a sparse model: a folder with cameras.txt, images.txt and points3D.txt.

A pose leads from world space to the camera's, with x right, y down and z forward. Pixels are counted from the top left corner.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np

from glshade.calibration.calibration import CalibratedPicture
from glshade.calibration.formats import CameraFormat
from glshade.calibration.reading import camera, text
from glshade.calibration.rotation import FLIPPED, inverse_pose, pose_of, quaternion, rotation_of
from glshade.errors import AssetError

# camera model -> the number of its parameters that are focal lengths, for the models whose other parameters, after cx and cy,
# are coefficients of distortion.
FOCAL = {
    "SIMPLE_PINHOLE": 1,
    "PINHOLE": 2,
    "SIMPLE_RADIAL": 1,
    "RADIAL": 1,
    "OPENCV": 2,
}


class Colmap(CameraFormat):
    """A folder with three text files."""

    folder: ClassVar[bool] = True

    def texts(self, pictures: Sequence[CalibratedPicture]) -> dict[str, str]:
        numbers: dict[str, int] = {}
        cameras = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
        images = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)"]
        for index, picture in enumerate(pictures, 1):
            seen = picture.calibration
            intrinsics = f"PINHOLE {seen.size[0]} {seen.size[1]} {seen.fx!r} {seen.fy!r} {seen.cx!r} {seen.cy!r}"
            if intrinsics not in numbers:
                numbers[intrinsics] = len(numbers) + 1
                cameras.append(f"{numbers[intrinsics]} {intrinsics}")
            pose = seen.camera_from_world
            values = " ".join(repr(float(x)) for x in (*quaternion(pose[:3, :3]), *pose[:3, 3]))
            # The line of points that follows each image is empty.
            images += [f"{index} {values} {numbers[intrinsics]} {picture.name}", ""]
        return {
            "cameras.txt": "\n".join(cameras) + "\n",
            "images.txt": "\n".join(images) + "\n",
            "points3D.txt": "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n",
        }

    def read(self, path: Path) -> list[CalibratedPicture]:
        cameras: dict[str, tuple[tuple[int, int], tuple[float, ...]]] = {}
        for line in _lines(path / "cameras.txt"):
            number, model, width, height, *values = line.split()
            cameras[number] = (int(width), int(height)), _numbers(path, number, model, [float(x) for x in values])
        found = []
        # Every other line lists the points of an image, and may be empty.
        for line in list(_lines(path / "images.txt", keep_empty=True))[::2]:
            if not line:
                continue
            _, *values, number, name = line.split(None, 9)
            if number not in cameras:
                raise AssetError(f"{path / 'images.txt'}: {name}: cameras.txt has no camera {number}")
            w, x, y, z, *t = map(float, values)
            pose = inverse_pose(pose_of(rotation_of([w, x, y, z]), np.array(t), f"{path}: {name}")) @ FLIPPED
            size, intrinsics = cameras[number]
            found.append(CalibratedPicture(name, camera("perspective", size, intrinsics, pose)))
        return found

    def recognises(self, path: Path) -> bool:
        if (path / "cameras.bin").is_file() and not (path / "cameras.txt").is_file():
            raise AssetError(f"{path}: is a binary model of COLMAP; convert it by `colmap model_converter --output_type TXT`")
        return (path / "cameras.txt").is_file()


def _numbers(path: Path, number: str, model: str, values: list[float]) -> tuple[float, ...]:
    """Returns fx, fy, cx and cy of a camera. Errors: AssetError for a lens that is distorted."""
    if model not in FOCAL:
        raise AssetError(f"{path / 'cameras.txt'}: camera {number}: the model {model} cannot be drawn; PINHOLE can")
    count = FOCAL[model]
    if any(values[count + 2 :]):
        raise AssetError(f"{path / 'cameras.txt'}: camera {number}: its lens is distorted, which cannot be drawn; undistort it")
    return (values[0], values[count - 1], values[count], values[count + 1])


def _lines(path: Path, keep_empty: bool = False) -> Iterator[str]:
    """Yields the lines of a file without comments. Errors: AssetError."""
    for line in text(path).splitlines():
        line = line.strip()
        if not line.startswith("#") and (line or keep_empty):
            yield line
