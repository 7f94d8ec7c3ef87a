"""rolled: the camera is rolled by 90 degrees, which turns the picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.assembly.assembly import assemble
from glshade.scene.camera import Intrinsics
from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import camera_at, written_out


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    scene = written_out(scene)
    view = assemble(scene).view
    right, up, backward = view.axes
    (x, y), axes = view.centre, np.stack([up, -right, backward])
    rolled = replace(view, axes=axes, half_width=view.half_height, half_height=view.half_width, centre=(y, -x))
    width, height = scene.film.size
    film = scene.film.model_copy(update={"size": (height, width)})
    camera = camera_at(rolled, isinstance(scene.camera, Intrinsics))
    return np.rot90(draw(scene.model_copy(update={"camera": camera, "film": film})))


LAW = Law(name="rolled", description="a camera rolled by 90 degrees gives the turned picture", picture=_picture)
