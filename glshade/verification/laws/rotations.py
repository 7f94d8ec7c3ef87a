"""rotations: a matrix replaces scale, rotate and translate, one after another."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.object import Transform
from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError
from glshade.verification.laws._scenes import placed

# The axis of a rotation -> the two axes that it turns, from the first toward the second.
PLANES = ((1, 2), (2, 0), (0, 1))


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    if all(item.transform.matrix is not None or not any(item.transform.rotate) for item in scene.objects):
        raise NotApplicableError("no object has the key rotate")
    return draw(
        scene.model_copy(
            update={
                "objects": tuple(
                    item if item.transform.matrix is not None else placed(item, _product(item.transform))
                    for item in scene.objects
                )
            }
        )
    )


def _product(transform: Transform) -> NDArray[np.float64]:
    """Returns the matrix (4, 4) of a transform, as the product of one matrix for each step of the definition."""
    result = np.diag([*transform.scale, 1.0])
    for (first, second), degrees in zip(PLANES, transform.rotate, strict=True):
        turn = np.eye(4)
        turn[[first, second], [first, second]] = math.cos(math.radians(degrees))
        turn[second, first] = math.sin(math.radians(degrees))
        turn[first, second] = -turn[second, first]
        result = turn @ result
    move = np.eye(4)
    move[:3, 3] = transform.translate
    product: NDArray[np.float64] = move @ result
    return product


LAW = Law(name="rotations", description="a matrix replaces rotations about x, y and z, one after another", picture=_picture)
