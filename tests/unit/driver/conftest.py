"""One context and its measurements for all tests of the room, because measuring takes half a second."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from glshade.driver.measurement import measure
from glshade.gl.context import Context, open_context


@pytest.fixture(scope="session")
def context() -> Iterator[Context]:
    context = open_context()
    yield context
    context.release()


@pytest.fixture(scope="session")
def found(context: Context) -> dict[str, Any]:
    return measure(context)


@pytest.fixture(scope="session")
def llvmpipe(context: Context) -> None:
    """Skips the test on any other driver: its figures are those that the shaders were written for."""
    if "llvmpipe" not in context.renderer:
        pytest.skip(f"the figures are llvmpipe's, and this driver is {context.renderer}")
