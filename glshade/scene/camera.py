"""Camera: the keys of cameras, and the views and matrices that follow from them, all in float64 until they are uploaded."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from glshade.calibration.calibration import Calibration, Kind
from glshade.calibration.rotation import FLIPPED, nearest_rotation, rigid
from glshade.document import Direction, Document, Finite, Vector3, fault
from glshade.errors import figure

Array = NDArray[np.float64]
Row4 = tuple[Finite, Finite, Finite, Finite]
Matrix4 = tuple[Row4, Row4, Row4, Row4]

# A camera that frames the scene shows 8 % more than the scene's extent, so that nothing touches the picture's edge.
MARGIN = 1.08
# The direction from the scene to the default eye: in front of the scene, a little to the right and above.
THREE_QUARTERS = (0.55, 0.4, 1.0)
# The default near plane is at least this share of the far plane's depth. Reversed depth in float32 allows so small a share
# without a loss of precision.
NEAREST_SHARE = 1e-7


def affine(matrix: Matrix4) -> Matrix4:
    """Returns the matrix; refuses one that is not affine, or that cannot be inverted."""
    if matrix[3] != (0.0, 0.0, 0.0, 1.0):
        raise fault(f"the last row must be [0, 0, 0, 1], not {list(matrix[3])}: rows top to bottom, column vectors")
    if is_singular(np.array(matrix)[:3, :3]):
        raise fault("is singular: it flattens what it moves")
    return matrix


def _pose(matrix: Matrix4) -> Matrix4:
    """Returns the matrix of a camera; refuses one that is not affine, that flattens space, or that mirrors it."""
    try:
        nearest_rotation(np.array(affine(matrix))[:3, :3])
    except ValueError as error:
        raise fault(f"is no pose of a camera: {error}") from None
    return matrix


def extent(points: Array) -> Array:
    """Returns the least and the largest coordinates (2, 3) of points (N, 3)."""
    # One coordinate at a time: NumPy is ten times as slow along an axis of three.
    return np.array([[coordinate.min() for coordinate in points.T], [coordinate.max() for coordinate in points.T]])


def _cross(a: Array, b: Array) -> Array:
    """Returns the cross product (3,) of two vectors (3,), in a tenth of the time of NumPy's function."""
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def is_singular(linear: Array) -> bool:
    """Returns whether a matrix (3, 3) flattens space, whatever its scale: its columns, made unit, span a volume below 1e-9."""
    length = np.linalg.norm(linear, axis=0)
    return not bool(np.all(length > 0)) or abs(np.linalg.det(linear / length)) < 1e-9


@dataclass(frozen=True, eq=False)
class View:
    """A camera at its final position, from which the matrices follow.

    perspective: whether the view is perspective; else it is orthographic.
    eye: position of the viewer (3,), the origin of camera-relative space [scene units].
    axes: the unit directions right, up and backward as rows (3, 3), in world space.
    half_width: half the width that the picture spans, at depth 1 if perspective, at any depth if orthographic [scene units].
    half_height: half the height that the picture spans, likewise [scene units].
    near: depth of the near plane [scene units].
    far: depth of the far plane [scene units].
    centre: x, y of the point where the camera's axis meets the picture. They go from -1 to 1 across the picture, x to the right
        and y up.
    """

    perspective: bool
    eye: Array
    axes: Array
    half_width: float
    half_height: float
    near: float
    far: float
    centre: tuple[float, float] = (0.0, 0.0)

    @property
    def toward_viewer(self) -> Array:
        """The unit direction to the viewer (3,), which is the same at every point of an orthographic view."""
        backward: Array = self.axes[2]
        return backward

    def depth(self, points: Array) -> Array:
        """Returns the distances (...) of points in front of the eye's plane [scene units].

        points: points (..., 3) in world space, of any leading shape, which the result keeps.
        """
        depth: Array = np.asarray(-(points - self.eye) @ self.axes[2])
        return depth

    def clip_from_world(self, zero_to_one: bool = True) -> Array:
        """Returns the clip matrix (4, 4) for camera-relative points.

        y points down, so that row 0 of the picture is its top. Depth is reversed: it is 1 at the near plane, 0 at the far one.
        zero_to_one: whether clip z lies in [0, w]; else it lies in [-w, w], for drivers without glClipControl.
        """
        n, f = self.near, self.far
        projection = np.zeros((4, 4))
        projection[0, 0] = 1 / self.half_width
        projection[1, 1] = -1 / self.half_height
        if self.perspective:
            projection[2, 2:] = n / (f - n), n * f / (f - n)
            projection[3, 2] = -1
        else:
            projection[2, 2:] = 1 / (f - n), f / (f - n)
            projection[3, 3] = 1
        if not zero_to_one:
            projection[2] = 2 * projection[2] - projection[3]
        if any(self.centre):
            projection[0] += self.centre[0] * projection[3]
            projection[1] -= self.centre[1] * projection[3]
        turn = np.eye(4)
        turn[:3, :3] = self.axes
        return projection @ turn


def calibration_of(view: View, size: tuple[int, int], objects: Mapping[str, Array]) -> Calibration:
    """Returns the calibration of a picture.

    view: the camera at its final position.
    size: width and height of the whole picture [pixels].
    objects: name of an object -> transform (4, 4) from its space to world space [scene units].
    """
    width, height = size
    pose = np.eye(4)
    pose[:3, :3] = view.axes.T
    pose[:3, 3] = view.eye
    return Calibration(
        kind="perspective" if view.perspective else "orthographic",
        size=size,
        fx=width / (2 * view.half_width),
        fy=height / (2 * view.half_height),
        cx=width / 2 * (1 + view.centre[0]),
        cy=height / 2 * (1 - view.centre[1]),
        world_from_camera=pose,
        near=view.near,
        far=view.far,
        objects=objects,
    )


def intrinsics(calibration: Calibration) -> dict[str, Any]:
    """Returns the table of the calibrated camera that sees as a calibration says."""
    width, height = calibration.size
    planes = {"near": calibration.near, "far": calibration.far} if calibration.far > calibration.near else {}
    return {
        "type": "intrinsics",
        "projection": calibration.kind,
        **{key: getattr(calibration, key) for key in ("fx", "fy", "cx", "cy")},
        "width": width,
        "height": height,
        "matrix": calibration.world_from_camera.tolist(),
        **planes,
    }


def window(clip: Array, size: tuple[int, int], x: float, y: float, width: int, height: int) -> Array:
    """Returns the clip matrix (4, 4) that draws a window of a picture as a picture of its own.

    clip: the clip matrix (4, 4) of the whole picture.
    size: width and height of the whole picture [pixels].
    x, y: the window's top left corner [pixels].
    width, height: the window's size [pixels].
    """
    whole_width, whole_height = size
    part = clip.copy()
    part[0] = clip[0] * (whole_width / width) + clip[3] * ((whole_width - 2 * x - width) / width)
    part[1] = clip[1] * (whole_height / height) + clip[3] * ((whole_height - 2 * y - height) / height)
    return part


class Camera(Document):
    """The keys that every camera has: eye, target and up, or matrix. A camera with neither eye nor matrix frames the scene."""

    type: str
    name: str | None = Field(None, description="name of the camera, for messages")
    eye: Vector3 | None = Field(None, description="position of the viewer; left out: a position that shows the whole scene")
    target: Vector3 | None = Field(None, description="point in the middle of the picture; left out: the middle of the scene")
    up: Direction = Field((0.0, 1.0, 0.0), description="direction that points up in the picture")
    matrix: Annotated[Matrix4, AfterValidator(_pose)] | None = Field(
        None, description="world from camera, in place of eye, target and up; numbers of few digits become the nearest rotation"
    )
    convention: Literal["opengl", "opencv"] = Field(
        "opengl",
        description="axes of matrix; opengl: x right, y up, looking along -z; opencv: x right, y down, looking along z",
    )
    fit: bool = Field(False, description="keeps the direction of view, and moves the eye until it sees the whole scene")
    turn: Finite = Field(0.0, description="turns the camera round the target or the scene's middle, about up [degrees]")
    near: Finite | None = Field(None, description="depth of the near plane; left out: in front of the scene")
    far: Finite | None = Field(None, description="depth of the far plane; left out: behind the scene")

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if not isinstance(data, Mapping):
            return
        number = int | float
        if data.get("matrix") is not None:
            for key in ("eye", "target", "up"):
                if data.get(key) is not None:
                    yield (key,), "cannot be used together with matrix, which replaces it"
        near, far = data.get("near"), data.get("far")
        if isinstance(near, number) and isinstance(far, number) and near >= far:
            yield ("near",), f"{figure(near)} must be less than far, {figure(far)}"
        for key, depth in (("near", near), ("far", far)):
            if (
                isinstance(depth, number)
                and depth <= 0
                and data.get("type", "perspective") != "orthographic"
                and (data.get("projection", "perspective") == "perspective")
            ):
                yield (key,), f"must be greater than 0 in a perspective view, not {figure(depth)}"
        eye, target = data.get("eye"), data.get("target")
        if eye is not None and target is not None and list(eye) == list(target):
            yield ("target",), "is where the eye is: there is no direction of view"

    def axes(self, middle: Array) -> Array:
        """Returns the directions right, up and backward as rows (3, 3), unit and perpendicular, in world space.

        middle: the middle of the scene (3,), which is the target if the key `target` is left out [scene units].
        """
        if self.matrix is not None:
            _, up, backward = self._rotation.T
        else:
            target = middle if self.target is None else np.array(self.target)
            backward = np.array(THREE_QUARTERS) if self.eye is None else np.array(self.eye) - target
            up = np.array(self.up)
        if not np.any(backward):
            backward = np.array(THREE_QUARTERS)
        backward = backward / np.linalg.norm(backward)
        right = _cross(up, backward)
        if np.linalg.norm(right) <= 1e-9 * np.linalg.norm(up):
            # The view is along `up`, so another axis has to replace it. The least parallel one loses the fewest digits.
            right = _cross(np.eye(3)[np.argmin(np.abs(backward))], backward)
        right = right / np.linalg.norm(right)
        axes: Array = np.array([right, _cross(backward, right), backward])
        return axes @ self._turned.T if self.turn else axes

    @property
    def _rotation(self) -> Array:
        """The rotation (3, 3) of the matrix, with OpenGL's axes as columns. Warns where the matrix is not close to one."""
        linear = rigid(np.array(self.matrix)[:3, :3], self.name or "camera")
        turned: Array = linear if self.convention == "opengl" else linear @ FLIPPED[:3, :3]
        return turned

    @property
    def _turned(self) -> Array:
        """The rotation matrix (3, 3) of the angle `turn` about `up`, by Rodrigues' formula."""
        x, y, z = np.array(self.up) / np.linalg.norm(self.up)
        across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = math.radians(self.turn)
        turned: Array = np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
        return turned

    @property
    def perspective(self) -> bool:
        """Whether the camera is a pinhole camera; else it is orthographic."""
        return isinstance(self, Perspective) or getattr(self, "projection", None) == "perspective"

    @property
    def framing(self) -> bool:
        """Whether the camera chooses its own position, such that it sees the whole scene."""
        return self.fit or (self.eye is None and self.matrix is None)

    def view(self, points: Array, aspect: float) -> View:
        """Returns the view of a scene.

        points: the scene's vertices, or the corners of boxes round them (N, 3) [scene units].
        aspect: the picture's width divided by its height.
        """
        middle = 0.5 * extent(points).sum(axis=0)
        axes = self.axes(middle)
        half_width, half_height = self.half_size(aspect)
        if self.framing:
            around = (points - middle) @ axes.T
            # A tiny scene far from the origin counts as larger than it is, so that float64 can tell its sides apart.
            least = 1e-9 * float(np.abs(middle).max())
            if np.abs(around).max() < least:
                around = np.array([[-least] * 3, [least] * 3])
            place, half_width, half_height = self.frame(around, half_width, half_height, aspect)
            eye = middle + place @ axes
        else:
            eye = np.array(self.matrix)[:3, 3] if self.matrix is not None else np.array(self.eye)
            pivot = middle if self.target is None else np.array(self.target)
            eye = pivot + (self._turned @ (eye - pivot) if self.turn else eye - pivot)
        near, far = self.depth_range(-(points - eye) @ axes[2])
        return View(self.perspective, eye, axes, half_width, half_height, near, far)

    def half_size(self, aspect: float) -> tuple[float, float]:
        """Returns half the width and half the height of the picture, at depth 1 if perspective [scene units]."""
        raise NotImplementedError

    def frame(self, points: Array, half_width: float, half_height: float, aspect: float) -> tuple[Array, float, float]:
        """Returns (eye (3,), half_width, half_height) of a view that shows all points.

        The eye and the points are in the view's axes, with the middle of the points as origin.
        points: the points that have to be seen (N, 3) [scene units].
        half_width, half_height: the sizes that `half_size` returns. An orthographic camera may return others.
        aspect: the picture's width divided by its height.
        """
        raise NotImplementedError

    def depth_range(self, depth: Array) -> tuple[float, float]:
        """Returns the depths (near, far) of the two planes [scene units].

        They are the values of the keys `near` and `far`. If a key is left out, its plane lies just outside the scene.
        depth: the depths of the scene's points (N,) [scene units].
        """
        raise NotImplementedError


def _place(points: Array, halves: tuple[float, float], centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Returns the nearest place (3,) of a pinhole camera that sees all points (N, 3).

    halves, centre: half the width and half the height at depth 1, and the place of the axis, as in View.
    """
    # An eye at (x, y, z) sees a point (a, b, c) inside the picture's right edge if a - x <= right (z - c). The other edges
    # give similar inequalities. Each pair of opposite edges gives a least z, and then a range of the eye's other coordinate.
    eye = np.zeros(3)
    ranges = []
    for axis, (half, c) in enumerate(zip(halves, centre, strict=True)):
        right, left = half / MARGIN - c * half, half / MARGIN + c * half
        over = float((points[:, axis] + right * points[:, 2]).max())
        under = float((left * points[:, 2] - points[:, axis]).max())
        ranges.append((over - under, left - right))
        eye[2] = max(eye[2], (over + under) / (right + left))
    # The eye must not lie inside a scene that is a single point or almost one.
    eye[2] = max(eye[2], float(points[:, 2].max()) + 1e-3 * float(np.ptp(points, axis=0).max()), 1e-30)
    eye[:2] = [0.5 * (middle + slope * eye[2]) for middle, slope in ranges]
    return eye


class Perspective(Camera):
    """A pinhole camera."""

    type: Literal["perspective"] = "perspective"
    fov: Annotated[float, Field(gt=0, lt=180)] = Field(40.0, description="vertical field of view [degrees]")

    def half_size(self, aspect: float) -> tuple[float, float]:
        half_height = math.tan(math.radians(self.fov) / 2)
        return half_height * aspect, half_height

    def frame(self, points: Array, half_width: float, half_height: float, aspect: float) -> tuple[Array, float, float]:
        return _place(points, (half_width, half_height)), half_width, half_height

    def depth_range(self, depth: Array) -> tuple[float, float]:
        deepest = float(depth.max())
        far = self.far if self.far is not None else deepest * 1.01 if deepest > 0 else 1.0
        near = self.near if self.near is not None else max(0.9 * float(depth.min()), NEAREST_SHARE * far)
        # A plane that the scene suggests may lie beyond the plane that a key gives. Then it is computed from the key alone.
        return (near, far) if near < far else (near, 2 * near) if self.far is None else (NEAREST_SHARE * far, far)


class Orthographic(Camera):
    """A camera at infinity: the direction to the viewer is the same everywhere (lecture slide 49)."""

    type: Literal["orthographic"] = "orthographic"
    height: Annotated[Finite, Field(gt=0)] | None = Field(
        None, description="height that the picture spans [scene units]; left out: enough for the whole scene"
    )

    def half_size(self, aspect: float) -> tuple[float, float]:
        half_height = 0.5 * (self.height or 2.0)
        return half_height * aspect, half_height

    def frame(self, points: Array, half_width: float, half_height: float, aspect: float) -> tuple[Array, float, float]:
        low, high = points.min(axis=0), points.max(axis=0)
        reach = 0.5 * (high - low)
        if self.height is None:
            half_height = MARGIN * max(float(reach[1]), float(reach[0]) / aspect, 1e-30)
        middle = 0.5 * (low + high)
        return (
            np.array([middle[0], middle[1], high[2] + float(np.linalg.norm(reach))]),
            half_height * aspect,
            half_height,
        )

    def view(self, points: Array, aspect: float) -> View:
        view = super().view(points, aspect)
        if self.height is not None or self.framing:
            return view
        # The eye is given but the height is not, so the picture grows about its middle until it shows the whole scene.
        reach = np.abs((points - view.eye) @ view.axes.T).max(axis=0)
        half_height = MARGIN * max(float(reach[1]), float(reach[0]) / aspect, 1e-30)
        return View(False, view.eye, view.axes, half_height * aspect, half_height, view.near, view.far)

    def depth_range(self, depth: Array) -> tuple[float, float]:
        pad = 0.01 * float(depth.max() - depth.min()) + 1e-6 * float(np.abs(depth).max()) + 1e-30
        near = self.near if self.near is not None else float(depth.min()) - pad
        far = self.far if self.far is not None else float(depth.max()) + pad
        return (near, far) if near < far else (near, near + 1.0) if self.far is None else (far - 1.0, far)


class Intrinsics(Camera):
    """A calibrated camera: its pixels need not be square, and its axis need not meet the middle of the picture.

    Pixels are counted from the picture's top left corner, so that the middle of the first pixel is (0.5, 0.5). A film of
    another size shows the same view, stretched to that size: fx and cx grow with its width, fy and cy with its height.

    The numbers are those of the camera matrix of computer vision (Hartley and Zisserman 2004, equation 6.10, without skew).
    """

    type: Literal["intrinsics"] = "intrinsics"
    projection: Kind = Field("perspective", description="orthographic: fx and fy are pixels for each scene unit")
    fx: Annotated[Finite, Field(gt=0)] = Field(description="focal length along x [pixels]")
    fy: Annotated[Finite, Field(gt=0)] = Field(description="focal length along y [pixels]")
    cx: Finite = Field(description="where the axis meets the picture, from its left edge [pixels]")
    cy: Finite = Field(description="where the axis meets the picture, from its upper edge [pixels]")
    width: Annotated[int, Field(ge=1)] = Field(
        description="width that these numbers belong to; also film.size's default [pixels]"
    )
    height: Annotated[int, Field(ge=1)] = Field(description="height that they belong to; also film.size's default [pixels]")

    @property
    def centre(self) -> tuple[float, float]:
        """Where the axis meets the picture, as in View."""
        return 2 * self.cx / self.width - 1, 1 - 2 * self.cy / self.height

    @property
    def _model(self) -> "Perspective | Orthographic":
        """The centred camera that chooses its planes as this one does."""
        planes = {"near": self.near, "far": self.far}
        if self.projection == "perspective":
            return Perspective.model_validate(planes)
        # The check of the planes reads the type, because only an orthographic view may begin behind its eye.
        return Orthographic.model_validate({"type": "orthographic", **planes})

    def view(self, points: Array, aspect: float) -> View:
        view = super().view(points, aspect)
        return replace(view, centre=self.centre)

    def half_size(self, aspect: float) -> tuple[float, float]:
        return self.width / (2 * self.fx), self.height / (2 * self.fy)

    def frame(self, points: Array, half_width: float, half_height: float, aspect: float) -> tuple[Array, float, float]:
        if self.projection == "perspective":
            return _place(points, (half_width, half_height), self.centre), half_width, half_height
        eye, _, _ = self._model.frame(points, half_width, half_height, aspect)
        # The middle of the scene appears in the middle of the picture.
        eye[:2] += np.array(self.centre) * (half_width, half_height)
        return eye, half_width, half_height

    def depth_range(self, depth: Array) -> tuple[float, float]:
        return self._model.depth_range(depth)


CAMERAS: dict[str, type[Document]] = {"perspective": Perspective, "orthographic": Orthographic, "intrinsics": Intrinsics}
