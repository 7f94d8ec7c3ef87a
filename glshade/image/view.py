"""View transform: how a linear picture is shown on a display, as an OpenColorIO configuration says; by OpenImageIO."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.document import nearest
from glshade.errors import SceneError
from glshade.image.image import Image
from glshade.scene.scene import Film

# What OpenColorIO carries itself: an ACES configuration for computer graphics.
DEFAULT = "ocio://default"
# What glshade draws in, by the names that configurations have for it; ACES 1's had the last.
LINEAR = ("lin_rec709_scene", "lin_rec709", "lin_srgb", "Linear Rec.709 (sRGB)", "Linear Rec.709", "Utility - Linear - sRGB")
# Colour interop ids of what 8-bit files are taken for where they say nothing.
SRGB = frozenset({"srgb_rec709_display", "srgb_rec709_scene"})


@dataclass(frozen=True)
class ViewTransform:
    """A view of a display in a configuration. space: its name for linear Rec. 709. encoding: of the result, as Image has it."""

    config: str
    display: str
    view: str
    space: str
    encoding: str

    @classmethod
    def of(cls, film: Film) -> ViewTransform:
        """What a film asks for. Errors: SceneError, with the names that there are."""
        if film.ocio is not None:
            return _found(str(film.ocio), "film.ocio", film.display, film.view)
        from_environment = os.environ.get("OCIO")
        return _found(from_environment or DEFAULT, "$OCIO" if from_environment else "film.ocio", film.display, film.view)

    def __call__(self, image: Image) -> Image:
        """uint8 of a float image; colours are transformed before alpha multiplies them. Errors: SceneError."""
        return image.through(self._transformed, self.encoding)

    def _transformed(self, rgb: NDArray[np.float32]) -> NDArray[Any]:
        import OpenImageIO as oiio

        shown = oiio.ImageBufAlgo.ociodisplay(
            oiio.ImageBuf(np.ascontiguousarray(rgb)),
            self.display,
            self.view,
            fromspace=self.space,
            unpremult=False,
            colorconfig=self.config,
        )
        if shown.has_error:
            raise SceneError(f'film.view: "{self.view}" of {self.config}: {" ".join(shown.geterror().split())}')
        pixels: NDArray[Any] = np.asarray(shown.get_pixels(oiio.FLOAT))
        return pixels


def shown(image: Image, film: Film) -> Image:
    """The 8-bit picture of a linear one, as the film has it. Errors: SceneError."""
    return ViewTransform.of(film)(image) if film.transformed else image.encoded(film.encoding)


@lru_cache(maxsize=8)
def _found(name: str, key: str, display: str | None, view: str | None) -> ViewTransform:
    """key: who named the configuration. Configurations take 30 ms to read, so this is kept."""
    import OpenImageIO as oiio

    config = oiio.ColorConfig(name)
    message = " ".join(config.geterror().split())
    displays = list(config.getDisplayNames())
    if message or not displays:
        raise SceneError(f"{key}: {name}: {message or 'is no OpenColorIO configuration with displays'}")
    display = config.getDefaultDisplayName() if display is None else display
    if display not in displays:
        raise SceneError(f'film.display: {name} has no display "{display}"{nearest(display, displays)}')
    views = list(config.getViewNames(display))
    view = config.getDefaultViewName(display) if view is None else view
    if view not in views:
        raise SceneError(f'film.view: "{display}" of {name} has no view "{view}"{nearest(view, views)}')
    space = next((known for known in LINEAR if config.getColorSpaceIndex(known) >= 0), None)
    if space is None:
        raise SceneError(f"{key}: {name} has no colour space for linear Rec. 709 ({', '.join(LINEAR)})")
    target = config.get_color_interop_id(config.getDisplayViewColorSpaceName(display, view)) or "unknown"
    return ViewTransform(name, display, view, space, "srgb" if target in SRGB else target)
