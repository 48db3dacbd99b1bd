"""A browser for the live page."""

import pytest
from support.chromium import Chromium, Page, find_chromium
from support.web import Picture, make_page

READ_BACK = "GPU stall due to ReadPixels"
"""Some drivers warn of what only these tests do: read counts back."""


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


@pytest.fixture(scope="module")
def canvas(tmp_path_factory):
    """A page with the renderer, in a Chromium with WebGL2."""
    if find_chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    with Chromium(webgl=True) as started:
        page = Page(started)
        page.resize(1280, 800)
        page.open(make_page(tmp_path_factory.mktemp("page")), "Boolean(window.load)")
        yield Picture(page)


@pytest.fixture
def picture(canvas):
    """The page with the renderer, which must end without errors."""
    yield canvas
    assert not canvas.page.named("Runtime.exceptionThrown")
    said = [event["entry"] for event in canvas.page.named("Log.entryAdded")]
    said = [entry for entry in said if READ_BACK not in entry["text"]]
    assert not [entry for entry in said if entry["level"] in {"error", "warning"}]
