"""View transform: turns a linear picture into the numbers of a display, as an OpenColorIO configuration defines them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.document import nearest
from glshade.errors import SceneError
from glshade.files import check_regular
from glshade.image.image import Encoding, Image

# The configuration built into OpenColorIO: ACES for computer graphics.
DEFAULT = "ocio://default"
# Names that configurations give to linear Rec. 709, the colour space of glshade's float pictures. The last is from ACES 1.
LINEAR = ("lin_rec709_scene", "lin_rec709", "lin_srgb", "Linear Rec.709 (sRGB)", "Linear Rec.709", "Utility - Linear - sRGB")
# The colour interop ids of sRGB, which programs assume where an 8-bit file names no colour space.
SRGB = frozenset({"srgb_rec709_display", "srgb_rec709_scene"})


@dataclass(frozen=True)
class ViewTransform:
    """A view of a display in an OpenColorIO configuration.

    config: the configuration's file or its name, such as "ocio://default".
    display: the display's name in the configuration.
    view: the name of one of the display's views.
    space: the configuration's name for linear Rec. 709.
    encoding: the encoding of the resulting picture, as Image.encoding has it.
    """

    config: str
    display: str
    view: str
    space: str
    encoding: str

    @classmethod
    def find(cls, ocio: str | Path | None, display: str | None, view: str | None) -> ViewTransform:
        """Returns the view transform that a film asks for.

        ocio: a configuration's file or name; by default $OCIO, else the configuration built into OpenColorIO.
        display: a display's name; by default the configuration's default display.
        view: a view's name; by default the display's default view.
        Errors: SceneError, with the names that the configuration has.
        """
        if ocio is not None:
            return _loaded(str(ocio), "film.ocio", display, view)
        from_environment = os.environ.get("OCIO")
        return _loaded(from_environment or DEFAULT, "$OCIO" if from_environment else "film.ocio", display, view)

    def __call__(self, image: Image) -> Image:
        """Returns a float picture as uint8 with straight alpha. The transform gets colours without alpha.

        Errors: SceneError.
        """
        return image.through(self._transformed, self.encoding)

    def _transformed(self, rgb: NDArray[np.float32]) -> NDArray[Any]:
        """Returns display-encoded colours (H, W, 3) for linear Rec. 709 colours. Errors: SceneError."""
        import OpenImageIO as oiio

        result = oiio.ImageBufAlgo.ociodisplay(
            oiio.ImageBuf(np.ascontiguousarray(rgb)),
            self.display,
            self.view,
            fromspace=self.space,
            unpremult=False,
            colorconfig=self.config,
        )
        if result.has_error:
            raise SceneError(f'film.view: "{self.view}" of {self.config}: {" ".join(result.geterror().split())}')
        pixels: NDArray[Any] = np.asarray(result.get_pixels(oiio.FLOAT))
        return pixels


def displayed(
    image: Image, encoding: Encoding, *, ocio: str | Path | None = None, display: str | None = None, view: str | None = None
) -> Image:
    """Returns a linear picture as uint8, by a view transform if a display or a view is given, and otherwise in `encoding`.

    ocio, display, view: as for ViewTransform.find. Errors: SceneError.
    """
    if display is None and view is None:
        return image.encoded(encoding)
    return ViewTransform.find(ocio, display, view)(image)


@lru_cache(maxsize=8)
def _loaded(name: str, key: str, display: str | None, view: str | None) -> ViewTransform:
    """Returns the view transform in the configuration `name`; cached, because OpenColorIO takes 30 ms to read a configuration.

    key: the place that names the configuration, for messages: "film.ocio" or "$OCIO".
    Errors: SceneError.
    """
    import OpenImageIO as oiio

    if not name.startswith("ocio://"):
        try:
            check_regular(name)
        except (OSError, ValueError) as error:
            raise SceneError(f"{key}: {name}: cannot be read: {getattr(error, 'strerror', error)}") from None
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
