"""Codes: carries the values that a picture may have from linear light to the encoded numbers of an 8-bit picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glshade.errors import NoReference
from glshade.image.image import Image
from glshade.image.srgb import linear_to_srgb
from glshade.verification.candidates import Candidates, straight

Array = NDArray[Any]

# Encoding -> the function from linear colours, straight and clipped to [0, 1], to encoded ones.
ENCODINGS: dict[str, Callable[[Array], Array]] = {"srgb": linear_to_srgb, "linear": lambda c: c}
# The largest number of an 8-bit code.
LARGEST = 255
# The error of the shaders' sRGB encoding, which is a rational function (shaders/output/encoding.glsl) [codes].
CURVE = 0.005


def encoded(candidates: Candidates, encoding: str) -> Candidates:
    """Returns the candidates of an 8-bit picture with straight alpha, as numbers from 0 to 1: an 8-bit code is divided by 255.

    A code may lie beside the encoded value by the rounding to codes and by the error of the encoding. Linear light already
    contains the film's exposure.
    encoding: the encoding of the colours, "srgb" or "linear".
    Errors: NoReference for another encoding, and for a film with a view transform, whose pictures are not judged.
    """
    if candidates.film.transformed:
        raise NoReference("an 8-bit picture that a view transform made is not judged: judge its linear picture, an EXR file")
    if encoding not in ENCODINGS:
        raise NoReference(f"an 8-bit picture in the encoding {encoding!r} is not judged; {' and '.join(ENCODINGS)} are")
    expected = candidates.expected
    low, high = carried(expected.low, expected.high, candidates.straight, encoding)
    centre, _ = carried(expected.centre, expected.centre, None, encoding)
    background, _ = carried(expected.background[None], expected.background[None], None, encoding)
    room = (candidates.driver.codes + CURVE) / LARGEST
    low, high = low - room, high + room
    expected = replace(expected, background=background[0], room=room, low=low, high=high, centre=np.clip(centre, low, high))
    picture = Image(candidates.picture.astype(np.float32)).encoded("srgb" if encoding == "srgb" else "linear")
    return replace(candidates, expected=expected, picture=picture.pixels, encoding=encoding)


def carried(low: Array, high: Array, colours: tuple[Array, Array] | None, encoding: str) -> tuple[Array, Array]:
    """Returns the two ends (N, 4) of intervals as encoded numbers from 0 to 1, before they are rounded to codes.

    low, high: (N, 4) each, the ends [linear, premultiplied].
    colours: optional; the two ends (N, 3) of the colours without alpha. Default: they follow from low and high.
    encoding: "srgb" or "linear".
    """
    ends = []
    for colour, alpha in zip(colours or straight(low, high), (low[:, 3:], high[:, 3:]), strict=True):
        both = np.concatenate([ENCODINGS[encoding](np.clip(colour, 0.0, 1.0)), np.clip(alpha, 0.0, 1.0)], axis=1)
        ends.append(both.astype(np.float64))
    return ends[0], ends[1]
