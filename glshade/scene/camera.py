"""Camera: where the viewer stands, and the matrices that follow. All in float64; rounding comes with the upload."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from glshade.document import Direction, Document, Finite, Vector3, fault

Array = NDArray[np.float64]
Row4 = tuple[Finite, Finite, Finite, Finite]
Matrix4 = tuple[Row4, Row4, Row4, Row4]

# A fitted view leaves this share of air round the scene.
MARGIN = 1.08
# From where a scene is seen when nobody says: from the front, a little to the right and above.
THREE_QUARTERS = (0.55, 0.4, 1.0)
# The near plane keeps at least this share of the far plane's distance: with reversed float depth that costs no precision.
NEAREST_SHARE = 1e-7


def affine(matrix: Matrix4) -> Matrix4:
    """Refuses what is not an invertible affine matrix."""
    if matrix[3] != (0.0, 0.0, 0.0, 1.0):
        raise fault(f"the last row must be [0, 0, 0, 1], not {list(matrix[3])}: rows top to bottom, column vectors")
    if is_singular(np.array(matrix)[:3, :3]):
        raise fault("is singular: it flattens what it moves")
    return matrix


def is_singular(linear: Array) -> bool:
    """Whether a (3, 3) matrix flattens space, whatever its scale: its columns, made unit, span (almost) no volume."""
    length = np.linalg.norm(linear, axis=0)
    return not bool(np.all(length > 0)) or abs(np.linalg.det(linear / length)) < 1e-9


@dataclass(frozen=True, eq=False)
class View:
    """A camera in its place.

    eye (3,): the origin of camera-relative space. axes (3, 3): rows right, up, backward, unit, in world space.
    half_width, half_height: of the picture at depth 1 (perspective) or at any depth (orthographic). near, far: depths.
    """

    perspective: bool
    eye: Array
    axes: Array
    half_width: float
    half_height: float
    near: float
    far: float

    @property
    def toward_viewer(self) -> Array:
        """(3,): v of an orthographic view."""
        backward: Array = self.axes[2]
        return backward

    def depth(self, points: Array) -> Array:
        """How far in front of the eye plane the world points (..., 3) are."""
        depth: Array = np.asarray(-(points - self.eye) @ self.axes[2])
        return depth

    def clip_from_world(self, zero_to_one: bool = True) -> Array:
        """(4, 4), for camera-relative points. y points down, so that row 0 is the top; depth is reversed: 1 near, 0 far.

        zero_to_one: clip z in [0, w], else in [-w, w] for drivers without glClipControl.
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
        turn = np.eye(4)
        turn[:3, :3] = self.axes
        return projection @ turn


def window(clip: Array, size: tuple[int, int], x: float, y: float, width: int, height: int) -> Array:
    """The clip matrix whose picture is the window at (x, y), `width` by `height` pixels, of the whole picture of `size`."""
    whole_width, whole_height = size
    part = clip.copy()
    part[0] = clip[0] * (whole_width / width) + clip[3] * ((whole_width - 2 * x - width) / width)
    part[1] = clip[1] * (whole_height / height) + clip[3] * ((whole_height - 2 * y - height) / height)
    return part


class Camera(Document):
    """What every camera has: eye, target and up; or matrix; or nothing, and it frames the scene."""

    type: str
    name: str | None = Field(None, description="for messages")
    eye: Vector3 | None = Field(None, description="where the viewer is; left out: where the whole scene is seen")
    target: Vector3 | None = Field(None, description="the point in the middle of the picture; left out: the scene's middle")
    up: Direction = Field((0.0, 1.0, 0.0), description="the direction that is up in the picture")
    matrix: Annotated[Matrix4, AfterValidator(affine)] | None = Field(
        None, description="world from camera, in place of eye, target and up: x right, y up, looking along -z"
    )
    fit: bool = Field(False, description="keep the direction of view, and move to where the whole scene is seen")
    turn: Finite = Field(0.0, description="turned round the target, or the scene's middle, about up: a turntable [degrees]")
    near: Finite | None = Field(None, description="depth of the near plane; left out: from the scene")
    far: Finite | None = Field(None, description="depth of the far plane; left out: from the scene")

    @classmethod
    def cross_faults(cls, data: Any) -> Iterable[tuple[tuple[str | int, ...], str]]:
        if not isinstance(data, Mapping):
            return
        number = int | float
        if data.get("matrix") is not None:
            for key in ("eye", "target", "up"):
                if data.get(key) is not None:
                    yield (key,), "not together with matrix, which says it all"
        near, far = data.get("near"), data.get("far")
        if isinstance(near, number) and isinstance(far, number) and near >= far:
            yield ("near",), f"{near:g} must be less than far, {far:g}"
        if isinstance(near, number) and near <= 0 and data.get("type", "perspective") == "perspective":
            yield ("near",), f"must be greater than 0 in a perspective view, not {near:g}"
        eye, target = data.get("eye"), data.get("target")
        if eye is not None and target is not None and list(eye) == list(target):
            yield ("target",), "is where the eye is: there is no direction of view"

    def axes(self, middle: Array) -> Array:
        """(3, 3): rows right, up, backward, unit and perpendicular. `middle` (3,) stands in for a target left out."""
        if self.matrix is not None:
            backward, up = np.array(self.matrix)[:3, 2], np.array(self.matrix)[:3, 1]
        else:
            target = middle if self.target is None else np.array(self.target)
            backward = np.array(THREE_QUARTERS) if self.eye is None else np.array(self.eye) - target
            up = np.array(self.up)
        if not np.any(backward):
            backward = np.array(THREE_QUARTERS)
        backward = backward / np.linalg.norm(backward)
        right = np.cross(up, backward)
        if np.linalg.norm(right) <= 1e-9 * np.linalg.norm(up):
            # Looking straight along `up`: any other axis will do, the least parallel one is the steadiest.
            right = np.cross(np.eye(3)[np.argmin(np.abs(backward))], backward)
        right = right / np.linalg.norm(right)
        axes: Array = np.stack([right, np.cross(backward, right), backward]) @ self._turned.T
        return axes

    @property
    def _turned(self) -> Array:
        """(3, 3): the rotation of `turn` about `up` (Rodrigues)."""
        x, y, z = np.array(self.up) / np.linalg.norm(self.up)
        across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = math.radians(self.turn)
        turned: Array = np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
        return turned

    @property
    def framing(self) -> bool:
        """Whether the camera looks for the place from where the whole scene is seen."""
        return self.fit or (self.eye is None and self.matrix is None)

    def view(self, points: Array, aspect: float) -> View:
        """The camera in its place. points (N, 3): what has to be seen, or boxes round it; aspect: width over height."""
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        axes = self.axes(middle)
        half_width, half_height = self.half_size(aspect)
        if self.framing:
            around = (points - middle) @ axes.T
            # A speck far from the origin counts as large enough for float64 to tell its sides apart.
            least = 1e-9 * float(np.abs(middle).max())
            if np.abs(around).max() < least:
                around = np.array([[-least] * 3, [least] * 3])
            place, half_width, half_height = self.frame(around, half_width, half_height, aspect)
            eye = middle + place @ axes
        else:
            eye = np.array(self.matrix)[:3, 3] if self.matrix is not None else np.array(self.eye)
            pivot = middle if self.target is None else np.array(self.target)
            eye = pivot + self._turned @ (eye - pivot)
        near, far = self.depth_range(-(points - eye) @ axes[2])
        return View(isinstance(self, Perspective), eye, axes, half_width, half_height, near, far)

    def half_size(self, aspect: float) -> tuple[float, float]:
        """Half the picture's width and height, at depth 1 where the view is perspective."""
        raise NotImplementedError

    def frame(self, points: Array, half_width: float, half_height: float, aspect: float) -> tuple[Array, float, float]:
        """(eye (3,), half_width, half_height) that show the points (N, 3); all in view axes about the points' middle."""
        raise NotImplementedError

    def depth_range(self, depth: Array) -> tuple[float, float]:
        """(near, far): as told, else a little outside of what there is."""
        raise NotImplementedError


class Perspective(Camera):
    """A pinhole."""

    type: Literal["perspective"] = "perspective"
    fov: Annotated[float, Field(gt=0, lt=180)] = Field(40.0, description="vertical field of view [degrees]")

    def half_size(self, aspect: float) -> tuple[float, float]:
        half_height = math.tan(math.radians(self.fov) / 2)
        return half_height * aspect, half_height

    def frame(self, points: Array, half_width: float, half_height: float, aspect: float) -> tuple[Array, float, float]:
        # The eye at (x, y, z) sees a point at (a, b, c) within the picture's right edge where a - x <= half_width (z - c), and
        # so on for the other three: each pair of edges gives the eye's place between them, and a least distance.
        eye = np.zeros(3)
        for axis, half in enumerate((half_width / MARGIN, half_height / MARGIN)):
            over, under = (float((sign * points[:, axis] + half * points[:, 2]).max()) for sign in (1, -1))
            eye[axis] = 0.5 * (over - under)
            eye[2] = max(eye[2], 0.5 * (over + under) / half)
        # A single point, or a speck, is seen from a distance too.
        eye[2] = max(eye[2], float(points[:, 2].max()) + 1e-3 * float(np.ptp(points, axis=0).max()), 1e-30)
        return eye, half_width, half_height

    def depth_range(self, depth: Array) -> tuple[float, float]:
        deepest = float(depth.max())
        far = self.far if self.far is not None else deepest * 1.01 if deepest > 0 else 1.0
        near = self.near if self.near is not None else max(0.9 * float(depth.min()), NEAREST_SHARE * far)
        # One of the two may be told and lie on the wrong side of what the scene suggests for the other.
        return (near, far) if near < far else (near, 2 * near) if self.far is None else (NEAREST_SHARE * far, far)


class Orthographic(Camera):
    """A viewer at infinity: v is constant (lecture slide 49)."""

    type: Literal["orthographic"] = "orthographic"
    height: Annotated[Finite, Field(gt=0)] | None = Field(
        None, description="what the picture's height spans [scene units]; left out: the whole scene"
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
        # Placed, but not told how much to show: as much as it takes about the middle of the picture.
        reach = np.abs((points - view.eye) @ view.axes.T).max(axis=0)
        half_height = MARGIN * max(float(reach[1]), float(reach[0]) / aspect, 1e-30)
        return View(False, view.eye, view.axes, half_height * aspect, half_height, view.near, view.far)

    def depth_range(self, depth: Array) -> tuple[float, float]:
        pad = 0.01 * float(depth.max() - depth.min()) + 1e-6 * float(np.abs(depth).max()) + 1e-30
        near = self.near if self.near is not None else float(depth.min()) - pad
        far = self.far if self.far is not None else float(depth.max()) + pad
        return (near, far) if near < far else (near, near + 1.0) if self.far is None else (far - 1.0, far)


CAMERAS: dict[str, type[Document]] = {"perspective": Perspective, "orthographic": Orthographic}
