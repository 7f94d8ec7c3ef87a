"""COLMAP: the text form of a sparse model: a folder with cameras.txt, images.txt and points3D.txt.

A pose leads from world space to the camera's, with x right, y down and z forward. Pixels are counted from the top left corner.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

from glshade.calibration.calibration import CalibratedPicture
from glshade.calibration.formats import CameraFormat
from glshade.calibration.reading import Fault, at, camera, check_count, number, numbers, pixels, pose, text
from glshade.calibration.rotation import FLIPPED, inverse_pose, quaternion, rotation_of
from glshade.errors import AssetError

# camera model -> the number of its parameters that are focal lengths, for the models whose other parameters, after cx and cy,
# are coefficients of distortion.
FOCAL = {
    "SIMPLE_PINHOLE": 1,
    "PINHOLE": 2,
    "SIMPLE_RADIAL": 1,
    "RADIAL": 1,
    "OPENCV": 2,
    "FULL_OPENCV": 2,
}


class Colmap(CameraFormat):
    """A folder with three text files."""

    folder: ClassVar[bool] = True

    def texts(self, pictures: Sequence[CalibratedPicture]) -> dict[str, str]:
        known: dict[str, int] = {}
        cameras = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
        images = ["# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)"]
        for index, picture in enumerate(pictures, 1):
            seen = picture.calibration
            intrinsics = f"PINHOLE {seen.size[0]} {seen.size[1]} {seen.fx!r} {seen.fy!r} {seen.cx!r} {seen.cy!r}"
            if intrinsics not in known:
                known[intrinsics] = len(known) + 1
                cameras.append(f"{known[intrinsics]} {intrinsics}")
            view = seen.camera_from_world
            values = " ".join(repr(float(x)) for x in (*quaternion(view[:3, :3]), *view[:3, 3]))
            # The line of points that follows each image is empty.
            images += [f"{index} {values} {known[intrinsics]} {picture.name}", ""]
        return {
            "cameras.txt": "\n".join(cameras) + "\n",
            "images.txt": "\n".join(images) + "\n",
            "points3D.txt": "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n",
        }

    def read(self, path: Path) -> list[CalibratedPicture]:
        # A camera counts only if a picture was taken by it.
        cameras = {number: words for number, *words in map(str.split, _lines(path / "cameras.txt"))}
        where, found = path / "images.txt", []
        images = list(_images(where))
        check_count(len(images), where)
        for line in images:
            _, *values, number, name = words = line.split(None, 9)
            if len(words) < 10:
                raise AssetError(
                    f"{where}: an image needs IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID and NAME: {line[:80]}"
                )
            if number not in cameras:
                raise AssetError(f"{where}: {name}: cameras.txt has no camera {number}")
            with at(path / "cameras.txt", f"camera {number}"):
                size, intrinsics = _numbers(cameras[number])
            with at(where, name):
                turn = numbers(values[:4], (4,), "the quaternion")
                if not turn.any():
                    raise Fault("the quaternion must not be 0")
                placed = inverse_pose(pose(rotation_of(turn), values[4:], where, name)) @ FLIPPED
                found.append(CalibratedPicture(name, camera("perspective", size, intrinsics, placed)))
        return found

    def recognises(self, path: Path) -> bool:
        if (path / "cameras.bin").is_file() and not (path / "cameras.txt").is_file():
            raise AssetError(f"{path}: is a binary model of COLMAP; convert it by `colmap model_converter --output_type TXT`")
        return (path / "cameras.txt").is_file()


def _numbers(words: Sequence[str]) -> tuple[tuple[int, int], tuple[float, ...]]:
    """Returns the size, and fx, fy, cx and cy, of a camera.

    words: MODEL, WIDTH, HEIGHT and PARAMS, as in cameras.txt.
    Errors: Fault, also for a lens that is distorted.
    """
    if len(words) < 3:
        raise Fault("needs MODEL, WIDTH, HEIGHT and PARAMS")
    model, width, height, *texts = words
    if model not in FOCAL:
        raise Fault(f"the model {model} cannot be drawn; PINHOLE can")
    count, values = FOCAL[model], [number(text, "each parameter") for text in texts]
    if len(values) < count + 2:
        raise Fault(f"the model {model} needs {count + 2} parameters or more, not {len(values)}")
    if any(values[count + 2 :]):
        raise Fault("its lens is distorted, which cannot be drawn; undistort it")
    size = pixels(width, "the width"), pixels(height, "the height")
    return size, (values[0], values[count - 1], values[count], values[count + 1])


def _images(path: Path) -> Iterator[str]:
    """Yields the lines of images.txt that describe images. The line after each lists its points, and may be empty."""
    lines = _lines(path, keep_empty=True)
    for line in lines:
        if line:
            yield line
            next(lines, None)


def _lines(path: Path, keep_empty: bool = False) -> Iterator[str]:
    """Yields the lines of a file without comments. Errors: AssetError."""
    for line in text(path).splitlines():
        line = line.strip()
        if not line.startswith("#") and (line or keep_empty):
            yield line
