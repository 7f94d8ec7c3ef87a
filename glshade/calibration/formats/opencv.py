"""OpenCV: one JSON file with K, R and t of each picture.

A point X of world space appears at the pixel K (R X + t), divided by its third number. Orthographic pictures are not divided.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from glshade.calibration.calibration import CalibratedPicture
from glshade.calibration.formats import CameraFormat
from glshade.calibration.reading import at, camera, pinhole, pose, rows, table
from glshade.calibration.rotation import FLIPPED, inverse_pose


class Opencv(CameraFormat):
    """A JSON file with a list "pictures" of tables with the keys file, type, width, height, K, R, t, near, far and objects."""

    orthographic: ClassVar[bool] = True

    def texts(self, pictures: Sequence[CalibratedPicture]) -> dict[str, str]:
        table_rows = []
        for picture in pictures:
            seen = picture.calibration
            table_rows.append(
                {
                    "file": picture.name,
                    "type": seen.kind,
                    "width": seen.size[0],
                    "height": seen.size[1],
                    "K": seen.matrix.tolist(),
                    "R": seen.camera_from_world[:3, :3].tolist(),
                    "t": seen.camera_from_world[:3, 3].tolist(),
                    "near": seen.near,
                    "far": seen.far,
                    "objects": {name: pose.tolist() for name, pose in seen.objects.items()},
                }
            )
        told = {
            "convention": "x = K (R X + t), divided by its third number if the type is perspective; "
            "pixels are counted from the top left corner, so that the middle of the first pixel is (0.5, 0.5)",
            "pictures": table_rows,
        }
        return {"": json.dumps(told, indent=1) + "\n"}

    def read(self, path: Path) -> list[CalibratedPicture]:
        found = []
        for index, row in enumerate(rows(table(path), "pictures", path)):
            name = str(row.get("file", index))
            with at(path, name):
                placed = inverse_pose(pose(row["R"], row["t"], path, name)) @ FLIPPED
                size, kind = (row["width"], row["height"]), row.get("type", "perspective")
                found.append(CalibratedPicture(name, camera(kind, size, pinhole(row["K"], "K"), placed, row)))
        return found

    def recognises(self, path: Path) -> bool:
        return path.suffix.lower() == ".json" and path.is_file() and "pictures" in table(path)
