"""Cryptomatte: masks by name, anti-aliased, in layers of ordinary pictures (Psyop's specification 1.2).

A pixel has pairs of an id and the share of the pixel that it covers, the largest share first: two pairs a layer. An id is the
hash of a name, its bits taken for a float's.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

# Three layers of two pairs each: what the specification suggests.
LAYERS = 3
OBJECT, MATERIAL = "CryptoObject", "CryptoMaterial"


def murmur3_32(data: bytes) -> int:
    """MurmurHash3_x86_32 (Appleby, public domain) with seed 0."""

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
    """The name's id, as the bits of a float. No NaN, no infinity and no denormal: their exponents lose their lowest bit."""
    bits = murmur3_32(name.encode())
    return bits ^ 1 << 23 if bits >> 23 & 255 in (0, 255) else bits


def id_floats(names: Sequence[str]) -> NDArray[np.float32]:
    """(N,): the names' ids."""
    return np.array([id_bits(name) for name in names], dtype=np.uint32).view(np.float32)


def metadata(layer: str, names: Iterable[str]) -> dict[str, str]:
    """What the file has to say of a layer and of the names in it."""
    prefix = f"cryptomatte/{id_bits(layer):08x}"[:-1]
    manifest = {name: f"{id_bits(name):08x}" for name in names}
    return {
        f"{prefix}/name": layer,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": json.dumps(manifest, separators=(",", ":")),
    }


def ranked(samples: Sequence[NDArray[np.integer]], names: Sequence[str]) -> NDArray[np.float32]:
    """(H, W, 4 LAYERS): ids and shares, the largest first. samples (H, W): at each of a pixel's points, the place among `names`
    of what is there, -1 for nothing. What ranks beyond the layers is left out."""
    first = samples[0]
    ids = id_floats(names)
    result = np.zeros((*first.shape, 4 * LAYERS), dtype=np.float32)
    there = first >= 0
    result[there, 0], result[there, 1] = ids[first[there]], 1.0
    mixed = (
        np.flatnonzero(np.any([sample != first for sample in samples[1:]], axis=0)) if len(samples) > 1 else np.empty(0, int)
    )
    if not len(mixed):
        return result
    # Runs of equal places, pixel after pixel.
    count = len(samples)
    places = np.sort(np.stack([sample.reshape(-1)[mixed] for sample in samples], axis=1), axis=1).reshape(-1)
    change = np.flatnonzero((places[1:] != places[:-1]) | (np.arange(1, len(places)) % count == 0)) + 1
    start = np.concatenate([[0], change])
    length = np.diff(np.append(start, len(places)))
    seen = places[start] >= 0
    pixel, place, length = start[seen] // count, places[start][seen], length[seen]
    order = np.lexsort((place, -length, pixel))
    pixel, place, length = pixel[order], place[order], length[order]
    new = np.flatnonzero(np.append(True, pixel[1:] != pixel[:-1])) if len(pixel) else np.empty(0, int)
    rank = np.arange(len(pixel)) - np.repeat(new, np.diff(np.append(new, len(pixel))))
    kept = rank < 2 * LAYERS
    pairs = np.zeros((len(mixed), 4 * LAYERS), dtype=np.float32)
    pairs[pixel[kept], 2 * rank[kept]] = ids[place[kept]]
    pairs[pixel[kept], 2 * rank[kept] + 1] = length[kept] / count
    result.reshape(-1, 4 * LAYERS)[mixed] = pairs
    return result
