"""Noise of finished pictures: rounding to codes, dithering, and pixels at edges whose surface a driver may choose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.bench.corpus.case import Case
from glshade.bench.corpus.kinds import noise
from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb
from glshade.reference.freedom import LLVMPIPE, UNMEASURED, Freedom

Array = NDArray[Any]


def _jittered(case: Case, kind: str, share: float, channels: slice) -> Array | None:
    """Returns the baseline with a share of its values one code larger or smaller. Values 0 and 255 keep their range."""
    if case.floats:
        return None
    random = case.random(kind)
    pixels = case.baseline.astype(np.int16)
    colours = pixels[..., :3]
    steps = random.choice([-1, 1], colours.shape) * (random.random(colours.shape) < share)
    colours[..., channels] += steps[..., channels].astype(np.int16)
    return np.clip(pixels, 0, 255).astype(np.uint8)


@noise
def jitter_in_few_pixels(case: Case) -> Array | None:
    """0.3 % of the codes differ by 1, as between two machines of one CI service."""
    return _jittered(case, "few", 0.003, slice(None))


@noise
def jitter_in_many_pixels(case: Case) -> Array | None:
    """A third of the codes differ by 1: values near the middle between two codes are rounded either way."""
    return _jittered(case, "many", 0.33, slice(None))


@noise
def jitter_everywhere(case: Case) -> Array | None:
    """Every code differs by 1: dithering, which OpenGL has on by default, meets a driver that rounds to another code."""
    return _jittered(case, "everywhere", 1.0, slice(None))


@noise
def jitter_in_one_channel(case: Case) -> Array | None:
    """The green codes differ by 1 in half of the pixels, as with a format with other bits for green."""
    return _jittered(case, "green", 0.5, slice(1, 2))


def _encoded(case: Case, rounded: Callable[[Array], Array]) -> Array | None:
    """Returns the linear picture as codes. rounded: takes exact codes (H, W, 3) and returns whole ones."""
    if case.floats:
        return None
    result: Array = Image(case.linear).encoded("srgb").pixels.copy()
    colours = case.linear[..., :3].astype(np.float64)
    if case.linear.shape[2] == 4:
        alpha = case.linear[..., 3:]
        colours = np.divide(colours, alpha, out=np.zeros_like(colours), where=alpha > 0)
    result[..., :3] = np.clip(rounded(255 * linear_to_srgb(colours).astype(np.float64)), 0, 255)
    return result


@noise
def rounded_down(case: Case) -> Array | None:
    """Codes are rounded down. OpenGL allows both codes beside a value and prefers the nearer (4.6 core, section 2.3.5.2)."""
    return _encoded(case, lambda codes: np.floor(codes + 1e-3))


@noise
def rounded_up(case: Case) -> Array | None:
    """Codes are rounded up, to the other one of the two codes that OpenGL allows."""
    return _encoded(case, lambda codes: np.ceil(codes - 1e-3))


@noise
def dithered_by_a_code(case: Case) -> Array | None:
    """Codes are dithered by an ordered pattern. Dithering is on by default in OpenGL, and its kind is the driver's choice."""
    height, width = case.baseline.shape[:2]
    pattern = np.tile(np.array([[0.125, 0.625], [0.875, 0.375]]), (height // 2 + 1, width // 2 + 1))[:height, :width, None]
    return _encoded(case, lambda codes: np.floor(codes + pattern))


@noise
def encoded_by_hardware(case: Case) -> Array | None:
    """The encoding is off by up to 0.1 code before rounding, as with a driver's table; Direct3D allows its hardware 0.6."""
    random = case.random("encoded-by-hardware")
    return _encoded(case, lambda codes: np.rint(codes + random.uniform(-0.1, 0.1, codes.shape)))


def _redecided(case: Case, freedom: Freedom, share: float) -> Array:
    """Returns the picture, in which a share of the pixels with several candidates show another one.

    freedom: the freedom of the driver that decides.
    """
    from glshade.verification.candidates import find_candidates
    from glshade.verification.judgement import PixelClass

    expected = find_candidates(case.scene, driver=freedom).expected
    width, height = expected.size
    picture = case.linear.copy()
    random = case.random(f"redecided-{freedom.name}")
    classes = expected.classes
    free = np.isin(classes, (PixelClass.SILHOUETTE, PixelClass.TIE, PixelClass.SEAM))
    free &= random.random(width * height) < share
    # A random candidate of each pixel: the last one that is written wins.
    order = random.permutation(len(expected.pixel))
    order = order[free[expected.pixel[order]]]
    pixels = picture.reshape(-1, picture.shape[2])
    pixels[expected.pixel[order]] = expected.centre[order][:, : picture.shape[2]]
    bare = np.flatnonzero(free & expected.open & (random.random(width * height) < 0.5))
    pixels[bare] = expected.background[: picture.shape[2]]
    return case.of_linear(picture)


@noise
def silhouettes_redecided(case: Case) -> Array:
    """Pixels at outlines and seams show another of the surfaces between which llvmpipe's rounding decides."""
    return _redecided(case, LLVMPIPE, 1.0)


@noise
def few_silhouettes_redecided(case: Case) -> Array:
    """A tenth of the pixels in which a driver with a grid of 4 bits may choose show another surface."""
    return _redecided(case, UNMEASURED, 0.1)
