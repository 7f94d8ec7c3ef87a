"""textured: a texture of one colour, times a factor, replaces a number."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.brdfs import Brdf
from glshade.image.image import Image
from glshade.optics.spectra import Spectrum
from glshade.scene.object import Object
from glshade.scene.scene import Scene
from glshade.textures.texture import Texture
from glshade.verification.laws._law import Draw, Law
from glshade.verification.laws._scenes import material_of, mesh_of, with_meshes

# The grey of the texture, sRGB-encoded, and the linear value that it stands for (IEC 61966-2-1). The file holds floats, because
# drivers decode 8-bit codes with errors of their own.
GREY = 188
LINEAR = ((GREY / 255 + 0.055) / 1.055) ** 2.4


def _picture(scene: Scene, draw: Draw) -> NDArray[Any]:
    with TemporaryDirectory(prefix="glshade-") as folder:
        grey = Path(folder) / "grey.exr"
        Image(np.full((4, 4, 3), GREY / 255, dtype=np.float32)).save(grey)

        def textured(item: Object) -> Object | None:
            if mesh_of(item).uvs is None:
                return None
            return item.model_copy(update={"material": _textured(material_of(scene, item), grey)})

        return draw(with_meshes(scene, textured))


def _textured(material: Brdf, grey: Path) -> Brdf:
    """Returns the material with a texture for emission and for each parameter that is a number or a colour."""
    return material.model_copy(
        update={
            name: Texture(texture=grey, factor=np.divide(value, LINEAR).tolist(), encoding="srgb")
            for name in (*material.parameters(), "emission")
            if (value := getattr(material, name)) is not None and not isinstance(value, Texture | Spectrum)
        }
    )


LAW = Law(name="textured", description="a grey texture times a factor replaces each number", picture=_picture)
