"""Cryptomatte: anti-aliased masks of named objects, stored in float layers (Psyop's specification 1.2).

Each pixel holds pairs (id, share), sorted by share with the largest first: the id stands for a name, the share is the part of
the pixel that the named object covers, from 0 to 1. A layer has four channels and so holds two pairs. An id is the hash of a
name, and the hash's 32 bits are stored as the bits of a float.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

# The number of layers that the specification suggests.
LAYERS = 3
# The names under which the files list the masks of objects and of materials.
OBJECT, MATERIAL = "CryptoObject", "CryptoMaterial"


def murmur3_32(data: bytes) -> int:
    """Returns the hash MurmurHash3_x86_32 (Appleby, public domain) with seed 0, from 0 to 2^32 - 1."""

    def scrambled(k: int) -> int:
        k = k * 0xCC9E2D51 & 0xFFFFFFFF
        k = (k << 15 | k >> 17) & 0xFFFFFFFF
        return k * 0x1B873593 & 0xFFFFFFFF

    h, whole = 0, len(data) & ~3
    for start in range(0, whole, 4):
        h ^= scrambled(int.from_bytes(data[start : start + 4], "little"))
        h = (h << 13 | h >> 19) & 0xFFFFFFFF
        h = (h * 5 + 0xE6546B64) & 0xFFFFFFFF
    h ^= scrambled(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    h = (h ^ h >> 16) * 0x85EBCA6B & 0xFFFFFFFF
    h = (h ^ h >> 13) * 0xC2B2AE35 & 0xFFFFFFFF
    return h ^ h >> 16


def id_bits(name: str) -> int:
    """Returns the id of a name, as the 32 bits of a normal float."""
    bits = murmur3_32(name.encode())
    # An exponent of 0 or 255 makes a denormal, an infinity or a NaN, which programs may change. The specification flips the
    # exponent's lowest bit, bit 23, to avoid them.
    return bits ^ 1 << 23 if bits >> 23 & 255 in (0, 255) else bits


def id_floats(names: Sequence[str]) -> NDArray[np.float32]:
    """Returns (N,): the ids of N names, as floats."""
    return np.array([id_bits(name) for name in names], dtype=np.uint32).view(np.float32)


def metadata(layer: str, names: Iterable[str]) -> dict[str, str]:
    """Returns the attributes by which a file declares a set of masks.

    layer: the name of the set, OBJECT or MATERIAL.
    names: the names of its objects or materials, which the manifest lists with their ids.
    """
    prefix = f"cryptomatte/{id_bits(layer):08x}"[:-1]
    manifest = {name: f"{id_bits(name):08x}" for name in names}
    return {
        f"{prefix}/name": layer,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": json.dumps(manifest, separators=(",", ":")),
    }


def ranked(samples: Sequence[NDArray[np.integer]], names: Sequence[str]) -> NDArray[np.float32]:
    """Returns (H, W, 4 LAYERS): the pairs (id, share) of each pixel, the largest share first; unused pairs are 0.

    Where more names share a pixel than there are pairs, the smallest shares are left out.
    samples: one array (H, W) for each sample position in a pixel, at least one array. It holds indices into `names`, and -1 for
        the background.
    """
    first, ids = samples[0], id_floats(names)
    result = np.zeros((*first.shape, 4 * LAYERS), dtype=np.float32)
    named = first >= 0
    result[named, 0], result[named, 1] = ids[first[named]], 1.0
    # Most pixels show one name alone and are finished here. Only the pixels whose samples differ need to be counted.
    mixed = np.flatnonzero(np.any([sample != first for sample in samples[1:]], axis=0))
    if len(mixed):
        indices = np.stack([sample.reshape(-1)[mixed] for sample in samples], axis=1)
        result.reshape(-1, 4 * LAYERS)[mixed] = _pairs(indices, ids)
    return result


def _pairs(indices: NDArray[np.integer], ids: NDArray[np.float32]) -> NDArray[np.float32]:
    """Returns (N, 4 LAYERS): the pairs of N pixels.

    indices: (N, S), an index into `ids` for each of S samples in a pixel, -1 for the background.
    """
    pixels, samples = indices.shape
    # After sorting, equal indices of a pixel form a run, whose length is the number of samples that show the name.
    flat = np.sort(indices, axis=1).reshape(-1)
    start = np.flatnonzero(np.append(True, (flat[1:] != flat[:-1]) | (np.arange(1, len(flat)) % samples == 0)))
    length = np.diff(np.append(start, len(flat)))
    pixel, index = start // samples, flat[start]
    order = np.lexsort((index, -length, pixel))
    order = order[index[order] >= 0]
    pixel, index, length = pixel[order], index[order], length[order]
    # The rank of a run is its distance from the first run of its pixel.
    rank = np.arange(len(pixel)) - np.searchsorted(pixel, pixel)
    kept = rank < 2 * LAYERS
    pairs = np.zeros((pixels, 4 * LAYERS), dtype=np.float32)
    pairs[pixel[kept], 2 * rank[kept]] = ids[index[kept]]
    pairs[pixel[kept], 2 * rank[kept] + 1] = length[kept] / samples
    return pairs
