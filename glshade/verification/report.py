"""Report: writes the result of a comparison as one self-contained HTML page, with the pictures as files beside it."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import GlshadeError
from glshade.image.image import Image
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
}
UNEXPLAINED = (255, 0, 60)
CLASS_MEANING: dict[PixelClass, str] = {
    PixelClass.BACKGROUND: "no surface can cover the pixel: exactly the background",
    PixelClass.INTERIOR: "one surface certainly covers the pixel and is the nearest",
    PixelClass.SEAM: "an edge between triangles: either of the two",
    PixelClass.SILHOUETTE: "an outline: any of the candidates, or the background",
    PixelClass.TIE: "surfaces at the same depth: any of them",
    PixelClass.MASKED: "left out by the caller",
    PixelClass.WIDE: "float32 does not determine the value",
}
# The colours of the error map, from the least error to the greatest, sRGB-encoded from 0 to 255.
RAMP = np.array([(8, 10, 18), (32, 42, 110), (122, 40, 130), (214, 72, 72), (250, 160, 50), (252, 240, 160)], dtype=np.float64)
# Errors up to this one all have the first colour [linear]. It is smaller than the rounding error of a float32 value near 1.
LEAST = 1e-8
# Pictures narrower than this are enlarged by a whole factor [pixels of the page].
COMFORTABLE = 560


@dataclass(frozen=True, eq=False)
class Report:
    """The contents of a report on a picture of W x H pixels.

    title: the heading.
    verdict: one word, such as "verified".
    reasons: the reasons why the picture is not verified, one sentence for each.
    picture, reference: (H, W, 3 or 4) float32 [linear, premultiplied].
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


def heat(error: Array) -> tuple[Array, float, float]:
    """Returns (map (H, W, 3) uint8, least, greatest) of errors (H, W).

    The map shows the errors as colours, on a logarithmic scale from `least` to `greatest`.
    """
    finite = np.where(np.isfinite(error), error, 0.0)
    greatest = max(float(finite.max(initial=0.0)), 10 * LEAST)
    place = np.log(np.maximum(finite, LEAST) / LEAST) / np.log(greatest / LEAST) * (len(RAMP) - 1)
    place = np.where(np.isfinite(error), place, len(RAMP) - 1)
    lower = np.minimum(place.astype(np.intp), len(RAMP) - 2)
    share = (place - lower)[..., None]
    colours = RAMP[lower] * (1 - share) + RAMP[lower + 1] * share
    return np.rint(colours).astype(np.uint8), LEAST, greatest


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

    All four pictures are written as PNG, and the first three as EXR too. The page embeds the PNG pictures, so it can be read
    without the files.
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
    page.write_text(_page(report, embedded, least, greatest), encoding="utf-8")
    return page


def _shown(pixels: Array) -> Image:
    """Returns linear pixels (H, W, 3 or 4) as an encoded Image for a PNG file. Pixels with infinities or NaN are magenta."""
    broken: NDArray[np.bool_] = np.logical_not(np.isfinite(pixels).all(axis=2))
    image = Image(np.where(broken[..., None], 0, pixels).astype(np.float32)).encoded()
    image.pixels[broken, :3] = (255, 0, 255)
    if pixels.shape[2] == 4:
        image.pixels[broken, 3] = 255
    return image


def _page(report: Report, images: Mapping[str, str], least: float, greatest: float) -> str:
    height, width = report.picture.shape[:2]
    scale = max(1, COMFORTABLE // width)
    counts = report.comparison.counts

    def figure(name: str, caption: str, below: str = "") -> str:
        return (
            f'<figure><img src="data:image/png;base64,{images[name]}" width="{width * scale}" height="{height * scale}" '
            f'alt="{name}"><figcaption><b>{caption}</b>{below}</figcaption></figure>'
        )

    def swatch(colour: tuple[int, int, int]) -> str:
        return f'<i style="background:rgb{colour}"></i>'

    legend = "".join(
        f"<tr><td>{swatch(CLASS_COLOURS[kind])}{kind.name.lower()}</td><td class=n>{counts[kind]}</td>"
        f"<td>{html.escape(CLASS_MEANING[kind])}</td></tr>"
        for kind in PixelClass
    )
    legend += (
        f"<tr><td>{swatch(UNEXPLAINED)}unexplained</td><td class=n>{report.comparison.unexplained}</td>"
        "<td>no candidate's interval contains the value</td></tr>"
    )
    stops = ", ".join(f"rgb({int(r)} {int(g)} {int(b)})" for r, g, b in RAMP)
    bar = (
        f'<div class=bar style="background:linear-gradient(90deg, {stops})"></div>'
        f"<div class=ends><span>{least:.0e} or less</span><span>logarithmic</span><span>{greatest:.1e}</span></div>"
    )
    facts = "".join(f"<tr><th>{html.escape(k)}</th><td>{html.escape(v)}</td></tr>" for k, v in report.facts.items())
    heads = "".join(f"<th>{html.escape(head)}</th>" for head in report.heads)
    rows = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in report.rows)
    reasons = "".join(f"<li>{html.escape(reason)}</li>" for reason in report.reasons)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(report.title)}: {report.verdict}</title>
<style>{_STYLE}</style></head><body>
<header><h1>{html.escape(report.title)}</h1><span class="verdict {report.verdict}">{report.verdict}</span></header>
{f"<ul class=reasons>{reasons}</ul>" if reasons else ""}
<section class=pictures>
{figure("result", "Result", " as drawn, sRGB-encoded")}
{figure("reference", "Reference", " by the float64 reference, sRGB-encoded")}
{figure("error", "Error", " of the largest channel, linear" + bar)}
{figure("classes", "Classes", " how certain the value of each pixel is")}
</section>
<section class=columns>
<div><h2>Pixels</h2><table>{legend}</table></div>
<div><h2>Figures</h2><table class=facts>{facts}</table></div>
</section>
<h2>Worst pixels</h2>
<div class=wide><table class=worst><tr>{heads}</tr>{rows}</table></div>
</body></html>
"""


_STYLE = """
:root { color-scheme: light dark; --ink: #1b1f27; --paper: #fbfbfc; --line: #d9dce2; --quiet: #667085; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8ec; --paper: #14161b; --line: #333842; --quiet: #98a1b0; } }
body { font: 15px/1.5 system-ui, "DejaVu Sans", sans-serif; color: var(--ink); background: var(--paper);
  max-width: 1180px; margin: 0 auto; padding: 28px 24px 60px; }
header { display: flex; align-items: center; gap: 16px; flex-wrap: wrap; }
h1 { font-size: 24px; margin: 0; } h2 { font-size: 17px; margin: 28px 0 8px; }
.verdict { font-weight: 700; padding: 3px 14px; border-radius: 99px; color: #fff; background: #8a6d00; }
.verdict.verified { background: #19753c; } .verdict.failed { background: #b3152f; }
.reasons { margin: 12px 0 0; padding-left: 20px; }
.pictures, .columns { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 420px), 1fr)); }
.pictures { gap: 20px; margin-top: 22px; } .columns { gap: 0 32px; }
figure { margin: 0; } figcaption { color: var(--quiet); font-size: 13px; margin-top: 4px; } figcaption b { color: var(--ink); }
img { width: 100%; height: auto; image-rendering: pixelated; border: 1px solid var(--line); display: block; }
.bar { height: 10px; border-radius: 3px; margin-top: 6px; } .ends { display: flex; justify-content: space-between; }
table { border-collapse: collapse; width: 100%; font-size: 13.5px; }
td, th { text-align: left; vertical-align: top; font-weight: 400; }
td, th { padding: 4px 10px 4px 0; border-bottom: 1px solid var(--line); }
.facts th { color: var(--quiet); white-space: nowrap; } .worst th { color: var(--quiet); }
.n, .worst td, .facts td { font-variant-numeric: tabular-nums; } .n { text-align: right; }
i { display: inline-block; width: 12px; height: 12px; border-radius: 3px; margin-right: 8px; vertical-align: -1px; }
.wide { overflow-x: auto; } .worst td { white-space: nowrap; }
"""
