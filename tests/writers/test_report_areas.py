"""Named areas in a report: outlined on its map, and a click from the table to the map and back."""

import pytest
import shapely
from support.pages import READY, words
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene

VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
AREAS = {
    "yard": shapely.box(-10, 2, 10, 22).difference(shapely.box(-4, 6, 4, 18)),
    "far <b>garden</b>": shapely.box(20, -10, 34, 0),
}
CHOSEN = "[...document.querySelectorAll('tr.chosen')].map((row) => row.cells[0].textContent)"
CLICK = "document.querySelector('tr[data-index=\"{}\"] button').click()"
BACK = "[...document.querySelectorAll('button')].find((b) => b.textContent.includes('to its row'))"


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    tower = Part("tower", "", Mesh(*box((-8, -10, 0), (8, 0, 25))))
    study = umbra.shadow_study(
        make_scene([tower]), VIENNA, date="2026-03-21,2026-12-21", start="10:00", end="14:00",
        every="1h", areas=AREAS, ground=0.0, cell=2.0, extent=(-30, -30, 50, 30),
    )  # fmt: skip
    return study.report(tmp_path_factory.mktemp("areas") / "report.html")


def test_a_click_shows_an_area_on_the_map_and_leads_back(page, report):
    page.open(report, READY)
    for k, name in enumerate(AREAS):
        page.ask(CLICK.format(k))
        assert words(page, "where")[0].startswith(name + ": ")
        assert page.ask(CHOSEN) == [name, name]  # one row of each date
        assert page.ask(f"{BACK}.hidden") is False
        page.ask(f"{BACK}.click()")
        assert page.ask("document.activeElement.textContent") == name
    assert page.ask("document.querySelectorAll('td b').length") == 0
