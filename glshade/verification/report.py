"""Report: writes the result of a comparison as one self-contained HTML page, with the pictures as files beside it."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.image.image import Image
from glshade.page import template
from glshade.page.ramp import heat
from glshade.verification.judgement import Comparison, PixelClass

Array = NDArray[Any]

# The colours of the pixel classes, from the palette of Okabe and Ito 2008. People with any kind of colour vision can tell them
# apart.
CLASS_COLOURS: dict[PixelClass, tuple[int, int, int]] = {
    PixelClass.BACKGROUND: (38, 42, 50),
    PixelClass.INTERIOR: (150, 158, 170),
    PixelClass.SEAM: (86, 180, 233),
    PixelClass.SILHOUETTE: (230, 159, 0),
    PixelClass.TIE: (240, 228, 66),
    PixelClass.MASKED: (204, 121, 167),
    PixelClass.WIDE: (213, 94, 0),
    PixelClass.EDGE: (0, 158, 115),
}
UNEXPLAINED, UNEXPLAINED_MEANING = (255, 0, 60), "no candidate's interval contains the value"
CLASS_MEANING: dict[PixelClass, str] = {
    PixelClass.BACKGROUND: "no surface can cover the pixel: exactly the background",
    PixelClass.INTERIOR: "one surface certainly covers the pixel and is the nearest",
    PixelClass.SEAM: "an edge between triangles: either of the two",
    PixelClass.SILHOUETTE: "an outline: any of the candidates, or the background",
    PixelClass.TIE: "surfaces at the same depth: any of them",
    PixelClass.MASKED: "left out by the caller",
    PixelClass.WIDE: "float32 does not determine the value",
    PixelClass.EDGE: "several samples, which may show several surfaces: a mixture of them",
}
# Pictures narrower than this are enlarged by a whole factor [pixels of the page].
COMFORTABLE = 560


@dataclass(frozen=True, eq=False)
class Report:
    """The contents of a report on a picture of W x H pixels.

    title: the heading.
    verdict: one word, such as "verified".
    reasons: the reasons why the picture is not verified, one sentence for each.
    picture, reference: (H, W, 3 or 4) float32 [linear, premultiplied], or uint8 [sRGB-encoded, straight alpha].
    comparison: the comparison of the picture with the reference.
    classes: (H, W), the PixelClass of each pixel.
    facts: name of a figure -> its value as text.
    heads: the column headings of the table of the worst pixels.
    rows: the cells of the table of the worst pixels, a row for each pixel.
    """

    title: str
    verdict: str
    reasons: Sequence[str]
    picture: Array
    reference: Array
    comparison: Comparison
    classes: Array
    facts: Mapping[str, str]
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]


def class_map(classes: Array, excess: Array) -> Array:
    """Returns a map (H, W, 3) uint8 of each pixel in the colour of its class, and of unexplained pixels in red.

    classes: (H, W), the PixelClass of each pixel.
    excess: (H, W), as in Comparison.
    """
    palette = np.array([CLASS_COLOURS[kind] for kind in PixelClass], dtype=np.uint8)
    result: Array = palette[classes]
    result[excess > 0] = UNEXPLAINED
    return result


def write(folder: Path, report: Report) -> Path:
    """Writes index.html and the pictures result, reference, error and classes; returns the path of index.html.

    All four pictures are written as PNG. The error, and the other two if they hold floats, are written as EXR too. The page
    embeds the PNG pictures, so it can be read without the files.
    Errors: GlshadeError where the folder or a file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GlshadeError(f"{folder}: cannot be made: {error.strerror}") from None
    heated, least, greatest = heat(report.comparison.error)
    finite = np.where(np.isfinite(report.comparison.error), report.comparison.error, 0.0)
    floats = {"result": report.picture, "reference": report.reference, "error": np.repeat(finite[..., None], 3, axis=2)}
    for name, pixels in floats.items():
        if pixels.dtype != np.uint8:
            Image(np.ascontiguousarray(pixels, dtype=np.float32)).save(folder / f"{name}.exr")
    bytes_ = {
        "result": _shown(report.picture),
        "reference": _shown(report.reference),
        "error": Image(heated, "srgb"),
        "classes": Image(class_map(report.classes, report.comparison.excess), "srgb"),
    }
    embedded = {}
    for name, image in bytes_.items():
        path = folder / f"{name}.png"
        image.save(path)
        embedded[name] = base64.b64encode(path.read_bytes()).decode("ascii")
    page = folder / "index.html"
    template.write(page, _page(report, embedded, least, greatest))
    return page


def _shown(pixels: Array) -> Image:
    """Returns pixels (H, W, 3 or 4) as an encoded Image for a PNG file. Pixels with infinities or NaN are magenta.

    pixels: uint8, sRGB-encoded, or linear floats with premultiplied alpha.
    """
    if pixels.dtype == np.uint8:
        return Image(pixels, "srgb")
    broken: NDArray[np.bool_] = np.logical_not(np.isfinite(pixels).all(axis=2))
    image = Image(np.where(broken[..., None], 0, pixels).astype(np.float32)).encoded()
    image.pixels[broken, :3] = (255, 0, 255)
    if pixels.shape[2] == 4:
        image.pixels[broken, 3] = 255
    return image


def _page(report: Report, images: Mapping[str, str], least: float, greatest: float) -> str:
    """Returns the page. images: name of a picture -> a PNG file in base64."""
    height, width = report.picture.shape[:2]
    scale = max(1, COMFORTABLE // width)
    captions = {
        "result": ("Result", "as drawn, sRGB-encoded"),
        "reference": ("Reference", "by the float64 reference, sRGB-encoded"),
        "error": ("Error", "of the largest channel"),
        "classes": ("Classes", "how certain the value of each pixel is"),
    }
    counts = report.comparison.counts
    legend = [(kind.name.lower(), CLASS_COLOURS[kind], CLASS_MEANING[kind], counts.get(kind, 0)) for kind in PixelClass]
    return template.render(
        Path(__file__).parent / "report.html.j2",
        report=report,
        state={"verified": "good", "failed": "bad"}.get(report.verdict.partition(" ")[0], "warn"),
        images=images,
        captions=captions,
        size=(width * scale, height * scale),
        legend=[*legend, ("unexplained", UNEXPLAINED, UNEXPLAINED_MEANING, report.comparison.unexplained)],
        least=f"{least:.0e}",
        greatest=f"{greatest:.1e}",
    )
