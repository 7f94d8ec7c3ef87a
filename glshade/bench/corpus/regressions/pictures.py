"""Faults of finished pictures: what goes wrong when a picture is read back, encoded, cropped, stored or pieced together.

Each function takes a case and a strength and returns changed codes (H, W, C), or None where it does not apply to the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glshade.bench.corpus.case import Case, linear_of
from glshade.bench.corpus.kinds import regression
from glshade.image.srgb import linear_to_srgb

Array = NDArray[Any]
Codes = Callable[[Case, Any], Array | None]


def picture_fault(*strengths: Any) -> Callable[[Codes], Codes]:
    """Returns a decorator that adds a function, which returns codes, to the regressions."""

    def add(function: Codes) -> Codes:
        @wraps(function)
        def make(case: Case, strength: Any) -> Array | None:
            codes = function(case, strength)
            return None if codes is None else case.of_codes(codes)

        regression(*strengths)(make)
        return function

    return add


def _mixed(case: Case, colours: Array, share: float) -> Array:
    """Returns the baseline's codes with a share of other colours (H, W, 3), and its own alpha."""
    codes = case.codes.copy()
    codes[..., :3] += share * (colours - codes[..., :3])
    return codes


def _of_light(case: Case, change: Callable[[Array], Array]) -> Array:
    """Returns the baseline's codes after a change of its linear colours (H, W, 3), which are then clipped to [0, 1]."""
    codes = case.codes.copy()
    codes[..., :3] = 255 * linear_to_srgb(change(linear_of(codes[..., :3])))
    return codes


def _moved(codes: Array, down: int, right: int) -> Array:
    """Returns the codes moved by whole pixels. The border's pixels are repeated."""
    height, width = codes.shape[:2]
    rows, columns = np.arange(height) - down, np.arange(width) - right
    moved: Array = codes[np.clip(rows, 0, height - 1)][:, np.clip(columns, 0, width - 1)]
    return moved


def _busiest(codes: Array, side: int) -> tuple[slice, slice]:
    """Returns the square of this side in which the codes differ most, so that a change of the square shows.

    The square is smaller where the picture is.
    """
    colours = codes[..., :3].sum(axis=2)
    side = min(side, *colours.shape)
    spread = ndimage.maximum_filter(colours, side) - ndimage.minimum_filter(colours, side)
    half = side // 2
    height, width = spread.shape
    inner = spread[half : height - side + half + 1, half : width - side + half + 1]
    y, x = np.unravel_index(int(np.argmax(inner)), inner.shape)
    return slice(int(y), int(y) + side), slice(int(x), int(x) + side)


@picture_fault(4, 2, 1)
def shifted_right(case: Case, pixels: int) -> Array:
    """The picture lies some pixels too far right."""
    return _moved(case.codes, 0, pixels)


@picture_fault(4, 2, 1)
def shifted_down(case: Case, pixels: int) -> Array:
    """The picture lies some pixels too low."""
    return _moved(case.codes, pixels, 0)


@picture_fault(0.5, 0.25, 0.1)
def shifted_partly(case: Case, pixels: float) -> Array:
    """The picture is resampled at a place that is a part of a pixel beside the right one."""
    shifted: Array = ndimage.shift(case.codes, (0, pixels, 0), order=1, mode="nearest")
    return shifted


@picture_fault(1.0, 0.5, 0.25)
def mirrored(case: Case, share: float) -> Array:
    """The left and the right of the picture, or of its left part, are exchanged."""
    codes = case.codes.copy()
    width = round(share * codes.shape[1])
    codes[:, :width] = codes[:, :width][:, ::-1].copy()
    return codes


@picture_fault(1.0, 0.5, 0.25)
def upside_down(case: Case, share: float) -> Array:
    """The rows of the picture, or of its upper part, are in the wrong order."""
    codes = case.codes.copy()
    height = round(share * codes.shape[0])
    codes[:height] = codes[:height][::-1].copy()
    return codes


@picture_fault("bgr", "rbg", "grb")
def channels_exchanged(case: Case, order: str) -> Array:
    """Two colour channels are exchanged."""
    codes = case.codes.copy()
    codes[..., :3] = codes[..., ["rgb".index(channel) for channel in order]]
    return codes


@picture_fault(1.0, 0.3, 0.1)
def encoded_twice(case: Case, share: float) -> Array:
    """The picture, or a share of its light, went through the sRGB encoding twice."""
    return _mixed(case, 255 * linear_to_srgb(case.codes[..., :3] / 255), share)


@picture_fault(1.0, 0.3, 0.1)
def not_encoded(case: Case, share: float) -> Array:
    """The picture, or a share of its light, was stored without sRGB encoding."""
    return _mixed(case, 255 * linear_of(case.codes[..., :3]), share)


@picture_fault(0.5, 0.1, 0.04)
def exposed(case: Case, stops: float) -> Array:
    """The exposure is too large."""
    return _of_light(case, lambda c: c * 2**stops)


@picture_fault(0.8, 0.95, 0.98)
def tinted(case: Case, factor: float) -> Array:
    """The light of the blue channel is too weak."""
    return _of_light(case, lambda c: c * np.array([1.0, 1.0, factor]))


@picture_fault(1.0, 0.3, 0.1)
def desaturated(case: Case, share: float) -> Array:
    """Colours are mixed with their grey."""
    return _mixed(case, case.codes[..., :3].mean(axis=2, keepdims=True), share)


@picture_fault(1.3, 1.1, 1.03)
def contrast_raised(case: Case, factor: float) -> Array:
    """Differences from the middle grey are too large."""
    return _mixed(case, np.clip(127.5 + factor * (case.codes[..., :3] - 127.5), 0, 255), 1.0)


@picture_fault(0.5, 0.7, 0.9)
def highlights_clipped(case: Case, share: float) -> Array:
    """Values above a share of the largest value are cut off."""
    clipped: Array = np.minimum(case.codes, share * case.codes[..., :3].max())
    return clipped


@picture_fault(0.2, 0.1, 0.04)
def blacks_raised(case: Case, share: float) -> Array:
    """Black is stored as a dark grey, as in pictures for television."""
    return _mixed(case, np.full_like(case.codes[..., :3], 255.0), share)


@picture_fault(12, 24, 40)
def banded(case: Case, levels: int) -> Array:
    """Channels have only some levels, which shows as bands."""
    step = 255 / (levels - 1)
    return _mixed(case, np.rint(case.codes[..., :3] / step) * step, 1.0)


@picture_fault(12, 6, 3)
def dithered(case: Case, amount: int) -> Array:
    """A pattern of 2 x 2 pixels lies over the picture, far stronger than the single code of dithering."""
    height, width = case.codes.shape[:2]
    pattern = np.tile(np.array([[-1.0, 0.5], [1.0, -0.5]]), (height // 2 + 1, width // 2 + 1))[:height, :width, None]
    return _mixed(case, case.codes[..., :3] + amount * pattern, 1.0)


@picture_fault(1.0, 0.5, 0.25)
def blurred(case: Case, share: float) -> Array:
    """Pixels are mixed with the mean of their 3 x 3 neighbours."""
    return _mixed(case, ndimage.uniform_filter(case.codes[..., :3], (3, 3, 1), mode="nearest"), share)


@picture_fault(1.0, 0.5, 0.25)
def sharpened(case: Case, share: float) -> Array:
    """Differences from the mean of the neighbours are too large."""
    return _mixed(case, ndimage.uniform_filter(case.codes[..., :3], (3, 3, 1), mode="nearest"), -share)


@picture_fault(1.03, 1.01, 1.005)
def scaled(case: Case, factor: float) -> Array:
    """The picture is enlarged about its middle."""
    height, width = case.codes.shape[:2]
    matrix = np.array([1 / factor, 1 / factor, 1.0])
    middle = np.array([(height - 1) / 2, (width - 1) / 2, 0.0])
    enlarged: Array = ndimage.affine_transform(case.codes, matrix, middle - matrix * middle, order=1, mode="nearest")
    return enlarged


@picture_fault(3, 2, 1)
def cropped(case: Case, pixels: int) -> Array:
    """The crop begins some pixels too far left and too high, so that the picture moves."""
    return _moved(case.codes, pixels, pixels)


@picture_fault(8, 2, 1)
def rows_lost(case: Case, rows: int) -> Array:
    """Rows are dropped at the busiest place, and those below move up."""
    top = _busiest(case.codes, rows + 2)[0].start + 1
    return np.concatenate([case.codes[:top], case.codes[top + rows :], np.repeat(case.codes[-1:], rows, axis=0)])


@picture_fault(8, 2, 1)
def columns_lost(case: Case, columns: int) -> Array:
    """Columns are dropped at the busiest place, and those to the right move left."""
    left = _busiest(case.codes, columns + 2)[1].start + 1
    kept, rest = case.codes[:, :left], case.codes[:, left + columns :]
    return np.concatenate([kept, rest, np.repeat(case.codes[:, -1:], columns, axis=1)], axis=1)


@picture_fault(32, 16, 8)
def tile_black(case: Case, side: int) -> Array:
    """A tile was not drawn and is black."""
    codes = case.codes.copy()
    codes[_busiest(codes, side)][..., :3] = 0
    return codes


@picture_fault(48, 24, 12)
def tile_stale(case: Case, side: int) -> Array | None:
    """A tile shows an earlier frame, in which the camera was turned by 10 degrees."""
    from glshade.bench.corpus.regressions.scenes import camera_turned

    earlier = camera_turned(case, 10)
    if earlier is None:
        return None
    codes, place = case.codes.copy(), _busiest(case.codes, side)
    codes[place] = case.codes_of(earlier)[place]
    return codes


@picture_fault(9, 5, 3)
def small_object_gone(case: Case, side: int) -> Array:
    """A small thing is gone: a square shows the mean of the pixels around it."""
    codes = case.codes.copy()
    rows, columns = _busiest(codes, side)
    around = codes[max(rows.start - 1, 0) : rows.stop + 1, max(columns.start - 1, 0) : columns.stop + 1]
    total = around.sum(axis=(0, 1)) - codes[rows, columns].sum(axis=(0, 1))
    codes[rows, columns] = total / (around.shape[0] * around.shape[1] - side * side)
    return codes


@picture_fault(500, 100, 20)
def noise_burst(case: Case, count: int) -> Array:
    """Some pixels have random colours."""
    random = case.random("noise-burst")
    codes = case.codes.copy()
    height, width = codes.shape[:2]
    places = random.choice(height * width, count, replace=False)
    codes[places // width, places % width, :3] = random.uniform(0, 255, (count, 3))
    return codes


@picture_fault(64, 4, 1)
def not_a_number(case: Case, count: int) -> Array | None:
    """Some values of a float picture are NaN."""
    if not case.floats:
        return None
    random = case.random("not-a-number")
    codes = case.codes.copy()
    places = random.choice(codes.shape[0] * codes.shape[1], count, replace=False)
    codes.reshape(-1, codes.shape[2])[places, 0] = np.nan
    return codes


@picture_fault(2, 1, 0.3)
def alpha_multiplied_again(case: Case, times: float) -> Array | None:
    """Colours are multiplied by alpha once more, or twice, or in part."""
    if case.codes.shape[2] < 4:
        return None
    codes = case.codes.copy()
    codes[..., :3] *= (codes[..., 3:] / 255) ** times
    return codes


@picture_fault(1.0, 0.5, 0.05)
def alpha_lost(case: Case, share: float) -> Array | None:
    """What is transparent is opaque, entirely or in part."""
    if case.codes.shape[2] < 4:
        return None
    codes = case.codes.copy()
    codes[..., 3] += share * (255 - codes[..., 3])
    return codes


@picture_fault(40, 70, 90)
def compressed(case: Case, quality: int) -> Array:
    """The picture was stored as JPEG on its way."""
    import OpenImageIO as oiio

    colours = np.ascontiguousarray(np.clip(np.rint(case.codes[..., :3]), 0, 255).astype(np.uint8))
    return _mixed(case, _through_jpeg(colours, quality, oiio).astype(np.float64), 1.0)


def _through_jpeg(colours: Array, quality: int, oiio: Any) -> Array:
    """Returns colours (H, W, 3) uint8 after they were stored as JPEG."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        path = f"{folder}/picture.jpg"
        spec = oiio.ImageSpec(colours.shape[1], colours.shape[0], 3, "uint8")
        spec.attribute("Compression", f"jpeg:{quality}")
        output = oiio.ImageOutput.create(path)
        output.open(path, spec)
        output.write_image(colours)
        output.close()
        source = oiio.ImageInput.open(path)
        pixels = np.asarray(source.read_image("uint8")).reshape(colours.shape)
        source.close()
        return pixels
