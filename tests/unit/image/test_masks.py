"""Masks: boxes, areas and run lengths say the same as the pixels, in the text that COCO's tools read."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from glshade.image.masks import object_masks, packed


def unpacked(text: str) -> list[int]:
    """Returns the run lengths of COCO's text, by the description of its format."""
    counts: list[int] = []
    place = 0
    while place < len(text):
        number = shift = 0
        while True:
            bits = ord(text[place]) - 48
            place += 1
            number |= (bits & 31) << shift
            shift += 5
            if not bits & 32:
                break
        if bits & 16:
            number -= 1 << shift
        counts.append(number + (counts[-2] if len(counts) > 2 else 0))
    return counts


@given(st.lists(st.integers(0, 2**32), max_size=20))
def test_run_lengths_are_read_back(counts: list[int]) -> None:
    assert unpacked(packed(counts)) == counts


def test_texts_are_those_of_cocos_own_library() -> None:
    # Texts that pycocotools 2.0.11 encoded.
    assert packed([0, 6]) == "06"
    assert packed([5, 2, 2, 2, 1]) == "5220O"


@given(arrays(np.int32, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.integers(-1, 3)))
def test_masks_say_what_the_pixels_say(numbers: NDArray[Any]) -> None:
    found = object_masks(numbers)
    assert set(found) == set(numbers[numbers > 0].tolist())
    for number, mask in found.items():
        counts = unpacked(mask["counts"])
        pixels = np.repeat(np.arange(len(counts)) % 2, counts).reshape(numbers.T.shape).T
        assert (pixels == (numbers == number)).all()
        rows, columns = np.nonzero(pixels)
        assert mask["area"] == len(rows)
        x, y, width, height = mask["bbox"]
        assert (x, y, x + width - 1, y + height - 1) == (columns.min(), rows.min(), columns.max(), rows.max())
