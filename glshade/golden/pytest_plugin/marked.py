"""Marked tests: tests with the mark `glshade_compare`, which return a picture."""

from __future__ import annotations

import functools
import inspect
import unittest
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from glshade.golden.pytest_plugin.regression import RenderRegression

ARGUMENTS = {"rule", "name", "mask"}


def check_test(item: pytest.Function) -> None:
    """Fails a test whose mark could have no effect, or has arguments that it does not know."""
    wrong = _wrong(item)
    if wrong:
        pytest.fail(f"the mark glshade_compare {wrong}", pytrace=False)


def _wrong(item: pytest.Function) -> str:
    """Returns why the mark cannot be used for a test; empty if it can."""
    if item.cls is not None and issubclass(item.cls, unittest.TestCase):
        return "cannot see what a method of unittest.TestCase returns; write the test as a function or in a plain class"
    if inspect.iscoroutinefunction(item.function) or inspect.isasyncgenfunction(item.function):
        return "needs an ordinary function; in an async test, pass the picture to render_regression.check"
    if inspect.isgeneratorfunction(item.function):
        return "needs a function that returns its picture; this one yields"
    marker = item.get_closest_marker("glshade_compare")
    if marker is not None and (marker.args or not ARGUMENTS.issuperset(marker.kwargs)):
        given = [*map(repr, marker.args), *(f"{name}=" for name in marker.kwargs if name not in ARGUMENTS)]
        return f"takes rule=, name= and mask=, and got {', '.join(given)}"
    return ""


@contextmanager
def comparing(item: pytest.Function, marker: pytest.Mark, regression: RenderRegression) -> Iterator[None]:
    """While the block runs, the test's function compares the picture that it has returned, and returns None.

    So pytest, and plugins that call the function, see an ordinary test.
    """
    function: Any = item.obj

    @functools.wraps(function)
    def compared(*positional: Any, **named: Any) -> None:
        __tracebackhide__ = True
        regression.check_drawn(lambda: function(*positional, **named), **marker.kwargs)

    item.obj = compared
    try:
        yield
    finally:
        item.obj = function
