"""Calibration: the numbers that say where a point of the world appears in a picture.

Pixels are counted from the top left corner of the picture, x to the right and y down. So the middle of the top left pixel is
(0.5, 0.5), and the principal point (cx, cy) of a centred picture is (width / 2, height / 2). OpenCV's own functions count from
the middle of that pixel: there, subtract 0.5 from cx and cy.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from glshade.arrays import Float64
from glshade.calibration.rotation import FLIPPED, inverse_pose

Kind = Literal["perspective", "orthographic"]
# The name of the attribute in which a picture file tells how the picture was seen.
CAMERA = "glshade:camera"
# Each pose takes about 200 bytes of a picture's file, and of its line in a manifest.
MOST_OBJECTS = 1000


@dataclass(frozen=True, eq=False)
class Calibration:
    """How a picture was seen.

    kind: "perspective" or "orthographic".
    size: width and height of the picture [pixels].
    fx, fy: the focal lengths [pixels]; of an orthographic view, the pixels that a length of 1 spans [pixels / scene unit].
    cx, cy: the point of the picture where the camera's axis meets it [pixels].
    world_from_camera: the pose (4, 4) of the camera with OpenGL's axes: x right, y up, looking along -z [scene units].
    near, far: the depths between which the picture shows the scene [scene units].
    objects: name of an object -> transform (4, 4) from its space to world space [scene units].
    """

    kind: Kind
    size: tuple[int, int]
    fx: float
    fy: float
    cx: float
    cy: float
    world_from_camera: Float64
    near: float
    far: float
    objects: Mapping[str, Float64] = field(default_factory=dict)

    @property
    def camera_from_world(self) -> Float64:
        """The transform (4, 4) to the camera's space with OpenCV's axes: x right, y down, looking along z."""
        matrix: Float64 = FLIPPED @ inverse_pose(self.world_from_camera)
        return matrix

    @property
    def matrix(self) -> Float64:
        """The camera matrix K (3, 3), which takes a point in OpenCV's axes to its pixel."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def project(self, points: npt.ArrayLike) -> Float64:
        """Returns the pixels (..., 2) at which points (..., 3) of world space appear.

        A point in the plane of a perspective camera's eye has no pixel: its result is infinite or NaN.
        """
        seen = np.asarray(points, dtype=np.float64) @ self.camera_from_world[:3, :3].T + self.camera_from_world[:3, 3]
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = seen[..., :2] / seen[..., 2:] if self.kind == "perspective" else seen[..., :2]
        pixels: Float64 = flat * (self.fx, self.fy) + (self.cx, self.cy)
        return pixels

    def as_dict(self) -> dict[str, Any]:
        """Returns the fields as JSON types."""
        return {
            "type": self.kind,
            "width": self.size[0],
            "height": self.size[1],
            "fx": self.fx,
            "fy": self.fy,
            "cx": self.cx,
            "cy": self.cy,
            "near": self.near,
            "far": self.far,
            "world_from_camera": self.world_from_camera.tolist(),
            "objects": {name: pose.tolist() for name, pose in self.objects.items()},
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Calibration:
        """Returns the calibration whose `as_dict` gave the data.

        Errors: KeyError, TypeError or ValueError for other data.
        """
        pose = np.array(data["world_from_camera"], dtype=np.float64).reshape(4, 4)
        return cls(
            kind="orthographic" if data["type"] == "orthographic" else "perspective",
            size=(int(data["width"]), int(data["height"])),
            **{key: float(data[key]) for key in ("fx", "fy", "cx", "cy", "near", "far")},
            world_from_camera=pose,
            objects={name: np.array(rows, dtype=np.float64) for name, rows in data.get("objects", {}).items()},
        )

    def json(self) -> str:
        """Returns `as_dict` as JSON, for a picture's file. The poses of many objects are left out, and their number is told."""
        data = self.as_dict()
        if len(self.objects) > MOST_OBJECTS:
            data["objects"], data["objects_left_out"] = {}, len(self.objects)
        return json.dumps(data, separators=(",", ":"))

    def exr_matrices(self, corner: tuple[int, int], whole: tuple[int, int]) -> dict[str, Float64]:
        """Returns the matrices (4, 4) of a picture as OpenEXR defines them, for row vectors, by the attributes' names.

        `worldToCamera` leads to left-handed axes: x right, y up, looking along z. `worldToNDC` leads to the whole picture,
        whose corners are (0, 0) at the top left and (1, 1) at the bottom right (OpenEXR, standard attributes).

        corner: x, y of the top left corner of a crop in the whole picture [pixels].
        whole: width and height of the whole picture [pixels].
        """
        seen = np.diag([1.0, -1.0, 1.0, 1.0]) @ self.camera_from_world
        width, height = whole
        ndc = np.zeros((4, 4))
        ndc[0, 0], ndc[1, 1] = self.fx / width, -self.fy / height
        middle = (self.cx + corner[0]) / width, (self.cy + corner[1]) / height
        if self.kind == "perspective":
            ndc[0, 2], ndc[1, 2] = middle
            # The depth is 0 at the near plane and 1 at the far one, as in RenderMan.
            ndc[2, 2:] = self.far / (self.far - self.near), -self.far * self.near / (self.far - self.near)
            ndc[3, 2] = 1.0
        else:
            ndc[0, 3], ndc[1, 3] = middle
            ndc[2, 2:] = 1 / (self.far - self.near), -self.near / (self.far - self.near)
            ndc[3, 3] = 1.0
        return {"worldToCamera": seen.T, "worldToNDC": (ndc @ seen).T}


@dataclass(frozen=True, eq=False)
class CalibratedPicture:
    """A picture file, or the place where a picture was taken, with its calibration.

    name: the path of the picture relative to the folder of the cameras' file; a name of the camera where there is no picture.
    calibration: how it was seen.
    """

    name: str
    calibration: Calibration
