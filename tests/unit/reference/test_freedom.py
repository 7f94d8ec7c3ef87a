"""What a driver may do, as plain data."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.errors import GlshadeError
from glshade.reference.freedom import LLVMPIPE, UNMEASURED, Freedom
from glshade.reference.raster import MARGIN

number = st.floats(0, 1e3)


@given(
    st.builds(
        Freedom,
        name=st.text(),
        plane=number,
        window=number,
        snap=number,
        rules=st.lists(st.sampled_from(["largest", "length", "sum"]), min_size=1, max_size=3).map(tuple),
        level=number,
        texel=number,
        table=number,
        clips=st.booleans(),
        subpixel_bits=st.integers(4, 32),
        samples=st.integers(0, 64),
        codes=number,
    )
)
def test_json_holds_a_driver(freedom: Freedom) -> None:
    assert Freedom.from_dict(json.loads(json.dumps(freedom.as_dict()))) == freedom


def test_a_dictionary_may_leave_out_keys() -> None:
    assert Freedom.from_dict({}) == LLVMPIPE
    assert Freedom.from_dict({"snap": 0.25}).snap == 0.25


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"grid": 8}, "freedom.grid: no such property"),
        ({"plane": "two"}, "freedom.plane: "),
        ({"plane": float("nan")}, "freedom.plane: must be a finite number"),
        ({"level": -1.0}, "freedom.level: must be a finite number from 0, not -1"),
        ({"rules": ["smallest"]}, "freedom.rules.0: "),
        ({"rules": []}, "freedom.rules: must name at least one"),
        ({"subpixel_bits": 3}, "freedom.subpixel_bits: must be from 4 to 32, not 3"),
        ({"samples": -4}, "freedom.samples: must be at least 0"),
        ({"clips": None}, "freedom.clips: "),
    ],
)
def test_a_wrong_dictionary_is_refused_in_one_line(data: Any, message: str) -> None:
    with pytest.raises(GlshadeError) as error:
        Freedom.from_dict(data)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_the_margin_of_coverage_follows_the_grid() -> None:
    assert LLVMPIPE.margin == MARGIN == 3
    assert UNMEASURED.margin == 256 / 16 + 2
    assert Freedom(subpixel_bits=12).margin == MARGIN, "a finer grid than the reference's moves corners by less"
