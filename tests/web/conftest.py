"""The renderer alone, on a page."""

import pytest
from support.chromium import Page
from support.web import Picture, make_page


@pytest.fixture(scope="session")
def canvas(browser, tmp_path_factory):
    """A page with the renderer."""
    with Page(browser) as page:
        page.open(make_page(tmp_path_factory.mktemp("page")), "Boolean(window.load)")
        yield Picture(page)


@pytest.fixture
def picture(canvas):
    """The page with the renderer, which must end without errors and warnings."""
    yield canvas
    canvas.page.check("warning")
    canvas.page.events.clear()
