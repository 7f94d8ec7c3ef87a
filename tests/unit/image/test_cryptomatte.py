"""Cryptomatte: published hashes, ids that are ordinary floats, and pairs ranked by what they cover."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from glshade.image.cryptomatte import LAYERS, id_bits, id_floats, metadata, murmur3_32, ranked


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        # Those that SMHasher's own code gives, tails of every length among them.
        (b"", 0),
        (b"\xff\xff\xff\xff", 0x76293B50),
        (b"\x21\x43\x65\x87", 0xF55B516B),
        (b"\x21\x43\x65", 0x7E4A8634),
        (b"\x21\x43", 0xA0F7B07A),
        (b"\x21", 0x72661CF4),
        (b"\0\0\0\0", 0x2362F9DE),
        (b"\0\0\0", 0x85F0B427),
        (b"\0\0", 0x30F4C306),
        (b"\0", 0x514E28B7),
        # Names, from the specification's examples.
        (b"bunny", 0x13851A76),
        (b"default", 0x42C9679F),
        (b"bunny_porcelain_mat", 0xB24B26D4),
        # Gaffer's tests, which compare with pictures of other renderers.
        (b"/GAFFERBOT/C_torso_GRP/C_head_GRP/C_head_CPT/C_head001_REN", 4226998693),
    ],
)
def test_published_hashes(data: bytes, expected: int) -> None:
    assert murmur3_32(data) == expected


def test_published_ids() -> None:
    """As floats, from Gaffer's tests."""
    names = ["hello", "cube", "sphere", "plane"]
    expected = [6.0705627102400005616e-17, -4.08461912519e15, 2.79018604383e15, 3.66557617593e-11]
    assert id_floats(names) == pytest.approx(expected, rel=1e-7)


@given(st.text())
def test_ids_are_ordinary_floats(name: str) -> None:
    exponent = id_bits(name) >> 23 & 255
    assert 1 <= exponent <= 254
    assert id_bits(name) ^ murmur3_32(name.encode()) in (0, 1 << 23)


def test_names_whose_hash_is_no_ordinary_float() -> None:
    found = {}
    for number in range(4000):
        exponent = murmur3_32(f"n{number}".encode()) >> 23 & 255
        found.setdefault(exponent, f"n{number}")
    assert {0, 255} <= set(found)
    assert id_bits(found[0]) >> 23 & 255 == 1
    assert id_bits(found[255]) >> 23 & 255 == 254
    assert id_bits("") == 1 << 23


def test_metadata() -> None:
    # The key of this layer's name is the one in files of other renderers.
    told = metadata("crypto_object", ["bunny", "Bäume"])
    assert told["cryptomatte/f834d0a/name"] == "crypto_object"
    assert told["cryptomatte/f834d0a/hash"] == "MurmurHash3_32"
    assert told["cryptomatte/f834d0a/conversion"] == "uint32_to_float32"
    manifest = json.loads(told["cryptomatte/f834d0a/manifest"])
    assert manifest == {"bunny": "13851a76", "Bäume": f"{murmur3_32('Bäume'.encode()):08x}"}
    # OpenEXR's old limit on the names of attributes.
    assert max(map(len, told)) <= 31


def test_ranks() -> None:
    names = ["a", "b", "c", "d", "e", "f", "g", "h"]
    a, b, *_ = id_floats(names)
    uniform, mixed, empty, half, many = [0] * 16, [1] * 9 + [0] * 7, [-1] * 16, [1] * 4 + [-1] * 12, [*range(8)] * 2
    points = np.array([uniform, mixed, empty, half, many]).T
    pairs = ranked([row.reshape(1, 5) for row in points], names)
    assert pairs.shape == (1, 5, 4 * LAYERS)
    assert pairs[0, 0].tolist() == [a, 1, *[0] * 10]
    assert pairs[0, 1].tolist() == [b, 9 / 16, a, 7 / 16, *[0] * 8]
    assert not pairs[0, 2].any()
    assert pairs[0, 3].tolist() == [b, 4 / 16, *[0] * 10]
    # Eight equal ones: six have a place, in the order of names.
    assert pairs[0, 4, ::2].tolist() == id_floats(names[:6]).tolist()
    assert pairs[0, 4, 1::2].tolist() == [2 / 16] * 6


@given(hnp.arrays(np.int64, (16, 3, 4), elements=st.integers(-1, 5)))
def test_shares_are_those_of_the_points(points: np.ndarray) -> None:
    names = list("abcdef")
    ids = id_floats(names)
    pairs = ranked(list(points), names)
    shares = pairs[..., 1::2]
    assert np.array_equal(shares.sum(axis=2), (points >= 0).mean(axis=0))
    assert np.all(np.diff(shares, axis=2) <= 0)
    for place, of in enumerate(ids):
        share = np.where(pairs[..., 0::2] == of, shares, 0).sum(axis=2)
        assert np.array_equal(share, (points == place).mean(axis=0)), names[place]
