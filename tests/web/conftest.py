"""A browser for the live page."""

import pytest
from support.chromium import Chromium, Page, find_chromium


@pytest.fixture(scope="module")
def browser():
    if find_chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    with Chromium() as started:
        yield started


@pytest.fixture
def page(browser):
    """A blank page, which must end without errors."""
    browser.events.clear()
    page = Page(browser)
    page.resize(1280, 800)
    yield page
    assert not page.named("Runtime.exceptionThrown")
    said = [event["entry"] for event in page.named("Log.entryAdded")]
    assert not [entry for entry in said if entry["level"] == "error"]
