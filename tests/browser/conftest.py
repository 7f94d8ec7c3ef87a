"""Fixtures of the tests that look at pages in Debian's Chromium."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from typing import Any

import pytest

# Playwright's own browsers are not installed: Debian's Chromium serves.
CHROMIUM = shutil.which("chromium")
Open = Callable[..., Any]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent.name == "browser":
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install 'glshade[dev]'")
    if CHROMIUM is None:
        pytest.skip("needs Chromium: apt install chromium")
    with sync_api.sync_playwright() as playwright:
        # Chromium's sandbox does not run as root, which a container often is.
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Open]:
    """`open_page(address, width=1440, **context)` opens a page. At the end of the test, its console must hold no errors.

    ready: a selector of what the page holds as soon as it has started; by default a still picture of `glshade dev`.
    """
    contexts: list[Any] = []
    errors: list[str] = []

    def open_page(
        address: str, width: int = 1440, height: int = 900, ready: str = "canvas[data-still=true]", **context: Any
    ) -> Any:
        contexts.append(browser.new_context(viewport={"width": width, "height": height}, **context))
        page = contexts[-1].new_page()
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(address)
        page.wait_for_selector(ready)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert errors == []
