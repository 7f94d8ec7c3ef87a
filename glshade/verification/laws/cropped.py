"""cropped: four crops together are the picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.scene.scene import Scene
from glshade.verification.laws._law import Draw, Law, NotApplicableError


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    width, height = scene.film.size
    if min(width, height) < 2:
        raise NotApplicableError("the picture has a single row or column")
    # The crops have different sizes, so that the crop of another quarter would not fit.
    x, y = max(width // 3, 1), max(2 * height // 3, 1)

    def crop(*window: int) -> NDArray[Any]:
        return draw(scene.model_copy(update={"film": scene.film.model_copy(update={"crop": window})}))

    upper = [crop(0, 0, x, y), crop(x, 0, width - x, y)]
    lower = [crop(0, y, x, height - y), crop(x, y, width - x, height - y)]
    return np.concatenate([np.concatenate(row, axis=1) for row in (upper, lower)])


LAW = Law(name="cropped", description="four crops together are the picture", picture=_picture)
