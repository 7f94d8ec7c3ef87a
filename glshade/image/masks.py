"""Masks: the objects that a picture shows as COCO describes them: a box, an area, and the run lengths of a mask.

Run lengths count pixels down the columns, from the left column to the right one: first those outside the mask, then those
inside, and so on. COCO packs them into a text of 6 bits a character (Lin et al. 2014, the library pycocotools).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray


def object_masks(numbers: NDArray[np.integer[Any]]) -> dict[int, dict[str, Any]]:
    """Returns number -> {"bbox": [x, y, width, height], "area": pixels, "counts": packed run lengths}, for each number above 0.

    numbers: (H, W), the number of the object in each pixel, 0 or less for none.
    """
    height = numbers.shape[0]
    flat = numbers.T.reshape(-1)
    first = np.concatenate([[0], np.flatnonzero(flat[1:] != flat[:-1]) + 1])
    length = np.diff(first, append=flat.size)
    value = flat[first]
    # The runs of one number lie side by side in this order, each number's from the top left on.
    order = np.argsort(value, kind="stable")
    order = order[value[order] > 0]
    begins = np.flatnonzero(np.diff(value[order], prepend=0))
    return {int(value[runs[0]]): _mask(first[runs], length[runs], height, flat.size) for runs in np.split(order, begins)[1:]}


def _mask(first: NDArray[Any], length: NDArray[Any], height: int, size: int) -> dict[str, Any]:
    """Returns what `object_masks` says of one number.

    first, length: (N,) where each run begins, and its number of pixels.
    height: number of rows.
    size: number of pixels of the picture.
    """
    last = first + length - 1
    left, right = first // height, last // height
    # A run that goes on in the next column touches the last row and the first one.
    top = np.where(left == right, first % height, 0).min()
    bottom = np.where(left == right, last % height, height - 1).max()
    box = [left.min(), top, right.max() - left.min() + 1, bottom - top + 1]
    gaps = first - np.concatenate([[0], last[:-1] + 1])
    counts = [*np.stack([gaps, length], axis=1).reshape(-1).tolist(), size - int(last[-1]) - 1]
    if not counts[-1]:
        counts.pop()
    return {"bbox": [int(number) for number in box], "area": int(length.sum()), "counts": packed(counts)}


def packed(counts: Iterable[int]) -> str:
    """Returns run lengths as COCO's text: from the fourth on, each is stored as its difference from the last but one.

    A number has 5 bits in each character, the lowest first; a sixth bit says that another character follows.
    """
    counts = list(counts)
    result = bytearray()
    for index, count in enumerate(counts):
        number = count - counts[index - 2] if index > 2 else count
        while True:
            bits, number = number & 31, number >> 5
            done = number == -1 if bits & 16 else number == 0
            # 48 is the character 0, with which the alphabet begins.
            result.append(48 + bits + (0 if done else 32))
            if done:
                break
    return result.decode("ascii")
