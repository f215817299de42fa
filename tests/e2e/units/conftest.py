"""One browser page for all files here: they leave it as it was."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, Playwright, sync_playwright

from tests.e2e.conftest import page_of_modules


@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    """Ends with its folder: while it runs, this thread has an event loop, and others must not."""
    with sync_playwright() as instance:
        yield instance


@pytest.fixture(scope="package")
def modules(playwright: Playwright, chromium: str) -> Iterator[Page]:
    """The page's modules by themselves."""
    with page_of_modules(playwright, chromium) as page:
        yield page
