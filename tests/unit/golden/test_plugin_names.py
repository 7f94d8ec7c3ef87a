"""The names of baselines that the pytest plugin makes from node ids."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from glshade.golden.names import check_name
from glshade.golden.pytest_plugin.names import LONGEST, default_name

identifiers = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,20}", fullmatch=True)
# pytest allows any characters in the id of a parameter, and folders may have any name.
parameters = st.text(st.characters(exclude_categories=["Cs"]), max_size=200)
folders = st.text(st.characters(exclude_characters="/\0", exclude_categories=["Cs"]), min_size=1, max_size=20)


@st.composite
def node_ids(draw: st.DrawFn) -> str:
    path = "/".join([*draw(st.lists(folders | identifiers, max_size=2)), f"test_{draw(identifiers)}.py"])
    test = "::".join(draw(st.lists(identifiers, min_size=1, max_size=3)))
    return f"{path}::{test}" + draw(st.just("") | parameters.map(lambda text: f"[{text}]"))


@pytest.mark.parametrize(
    ("node_id", "name"),
    [
        ("test_ball.py::test_red", "test_ball/test_red"),
        ("tests/test_ball.py::TestRed::test_far[small-2]", "tests/test_ball/TestRed.test_far-small-2"),
        ("test_ball.py::test_red[1.5]", "test_ball/test_red-1.5"),
    ],
)
def test_ordinary_names_are_readable(node_id: str, name: str) -> None:
    assert default_name(node_id) == name


def test_unsafe_characters_are_replaced_and_the_name_stays_unique() -> None:
    names = {default_name(f"test_ball.py::test[{text}]") for text in ("a b", "a_b", "a/b", "a@b", "é", "x" * 300, "x" * 301)}
    assert len(names) == 7
    assert default_name("test_ball.py::test[a b]").startswith("test_ball/test-a_b-")
    assert default_name("../other/test_ball.py::test").startswith("_.-")


@given(node_ids())
def test_every_name_is_allowed(node_id: str) -> None:
    name = default_name(node_id)
    check_name(f"{name}.png")
    assert name.isascii()
    assert all(len(part) <= LONGEST + 9 for part in name.split("/"))


@given(node_ids(), node_ids())
def test_different_tests_have_different_names(one: str, other: str) -> None:
    assert (default_name(one) == default_name(other)) is (one == other)


@given(identifiers, identifiers, parameters)
def test_a_parameter_is_not_taken_for_a_part_of_the_function(function: str, other: str, parameter: str) -> None:
    assert default_name(f"test_a.py::{function}[{parameter}]") != default_name(f"test_a.py::{function}_{other}")
