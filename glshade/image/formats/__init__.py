"""Picture formats: one module each, found by its presence and named after the suffix of its files.

The module `png` holds the class `Png`, which derives from PictureFormat and says everything about .png files that others need
to know. No list names it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias

from glshade.found import Found

if TYPE_CHECKING:
    from glshade.image.contents import Part, PictureContents

Metadata = Literal["attributes", "description", "nowhere"]
Settings: TypeAlias = Mapping[str, str | int]

# Formats whose files hold a time get this one: without it OpenImageIO would store the time of day, and two files with the same
# picture would differ.
FIXED_TIME = "1970:01:01 00:00:00"


class PictureFormat:
    """A picture format. A subclass states where its format differs from these defaults.

    OpenImageIO writes and reads the files. A format that it does not know overrides write, read, parts, pixel_count and
    attributes.

    floats: True where files hold float32 numbers, linear and not clipped; False where they hold 8-bit numbers.
    alpha: True where files hold alpha; False where only the colours are written.
    layers: True where one file holds a picture and its named layers; False where the layers need a file of their own.
    window: True where a file of a cropped picture holds the crop's place and the size of the whole picture.
    matrices: True where a file holds the camera's matrices.
    metadata: the place of texts about the picture: "attributes" with names of their own, "description" for one JSON object in
        the file's description, or "nowhere".
    description_size: the longest description that files hold [bytes]; None where any length will do.
    settings: OpenImageIO's attributes that say how a file is written, such as the compression.
    """

    floats: ClassVar[bool] = False
    alpha: ClassVar[bool] = True
    layers: ClassVar[bool] = False
    window: ClassVar[bool] = False
    matrices: ClassVar[bool] = False
    metadata: ClassVar[Metadata] = "description"
    description_size: ClassVar[int | None] = None
    settings: ClassVar[Settings] = {}

    def write(self, path: Path, contents: PictureContents) -> None:
        """Writes a file. Errors: OSError, with the reason as its text."""
        from glshade.image import openimageio

        settings = {"Software": "glshade", **self.settings, **self._stored(contents.attributes)}
        openimageio.write(path, contents, settings, self.window, self.matrices)

    def read(self, path: Path) -> PictureContents:
        """Returns the pixels of a file: (H, W, C) uint8 or float32 with C = 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 (RGBA).

        Errors: OSError, with the reason as its text.
        """
        from glshade.image import openimageio

        return openimageio.read(path)

    def parts(self, path: Path) -> list[Part]:
        """Returns the parts of a file from their headers. Errors: OSError, with the reason as its text."""
        from glshade.image import openimageio

        return openimageio.parts(path)

    def pixel_count(self, path: Path) -> int:
        """Returns the number of pixels of the picture in a file, without reading them. Four channels count as one pixel.

        Errors: OSError, with the reason as its text.
        """
        from glshade.image import openimageio

        return openimageio.pixel_count(path)

    def attributes(self, path: Path) -> dict[str, str]:
        """Returns the texts about the picture in a file, by name. Errors: OSError for a file of another format."""
        import json

        from glshade.image import openimageio

        texts = openimageio.attributes(path)
        if self.metadata != "description":
            return texts
        # Some formats, TGA for one, break the description into lines. The JSON that glshade writes has no line breaks.
        description = texts.get("ImageDescription", "").replace("\n", "")
        try:
            described = json.loads(description)
        except ValueError:
            return {}
        return described if isinstance(described, dict) else {}

    def _stored(self, attributes: Mapping[str, str]) -> dict[str, str]:
        """Returns the texts about a picture as the attributes that the file has room for."""
        if not attributes or self.metadata == "nowhere":
            return {}
        if self.metadata == "attributes":
            return dict(attributes)
        kept = dict(attributes)
        described = _json(kept)
        while self.description_size is not None and len(described) > self.description_size and kept:
            # Leave out the longest text first: it is usually the camera, while --resume needs the digest, which is short.
            del kept[max(kept, key=lambda name: len(kept[name]))]
            described = _json(kept)
        return {"ImageDescription": described}


def _json(texts: Mapping[str, str]) -> str:
    # The help of `glshade render` lists the formats, so this module imports nothing that it can do without.
    import json

    return json.dumps(texts, separators=(",", ":"))


FORMATS: Found[PictureFormat] = Found("glshade.image.formats", Path(__file__).parent)
