"""The carpet of a place: its year by day and hour, as studies count it."""

import numpy as np
import pytest
from support.chromium import Page
from support.shapes import box
from support.web import SMALL

import umbra

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"
PLACE = (0.0, 12.0, 0.0)
SUN, NIGHT, AWAY = -2, -1, -3


@pytest.fixture(scope="module")
def street():
    """A tower in the south of a place, and one in its west."""
    parts = (("south", (-8, -5, 0), (8, 5, 20)), ("west", (-30, 8, 0), (-15, 30, 40)))
    return umbra.make_scene(
        [umbra.Part(name, "", umbra.Mesh(*box(low, high))) for name, low, high in parts], ground=0.0
    )


@pytest.fixture(scope="module")
def carpet(browser, street, tmp_path_factory):
    """The page with a chosen place, which only the last test changes."""
    path = tmp_path_factory.mktemp("year") / "scene.html"
    umbra.show(street, VIENNA, date="2026-03-21", at="15:00", size=SMALL, out=path)
    with Page(browser) as page:
        page.open(path, READY)
        origin = page.ask("umbra.model.origin")
        position = [p - o for p, o in zip(PLACE, origin, strict=True)]
        page.ask(f"umbra.set({{place: {{position: {position}, normal: [0, 0, 1], part: -1}}}})")
        page.wait("document.querySelector('.carpet-key li') !== null")
        yield page
        page.check()


def read_day(carpet, column):
    """Return the cells of a day, (96,), and its date."""
    cells, date = carpet.ask(
        f"(({{carpet}}) => [Array.from({{length: 96}}, (_, row) => carpet.at({column}, row)),"
        f"carpet.suns.dates[{column}]])(umbra.year.shown()[0])"
    )
    return np.array(cells), date


@pytest.mark.parametrize("column", [0, 44, 86, 140])
def test_a_day_of_the_carpet_is_a_study_of_it(carpet, street, column):
    cells, date = read_day(carpet, column)
    study = umbra.shadow_study(
        street, VIENNA, date=date, start="00:00", end="24:00", receivers="points",
        points=[[*PLACE, 0, 0, 1]], masks=True,
    )  # fmt: skip
    is_up = study.result.sun.is_up
    assert ((cells != NIGHT) == is_up).all()
    assert ((cells == SUN) == (is_up & (np.asarray(study.result.masks)[:, 0] == 0))).all()
    assert len(set(cells.tolist())) > 2


def test_casters_are_named_with_their_hours(carpet):
    noon = read_day(carpet, 0)[0][4 * 12]
    evening = read_day(carpet, 86)[0][4 * 17]
    names = carpet.ask("umbra.things.map((one) => one.label)")
    assert [names[noon], names[evening]] == ["south", "west"]
    key = carpet.ask("[...document.querySelectorAll('.carpet-key li')].map((e) => e.innerText)")
    told = [line.split()[-1] for line in key]
    assert "sun" in told
    assert {"south", "west"} <= set(told)
    hours = [float(line.split()[0].replace(",", "")) for line in key]
    assert hours == sorted(hours, reverse=True)
    assert sum(hours) == pytest.approx(4450, abs=30)  # that the sun is up


def test_a_click_in_the_carpet_goes_to_its_day_and_time(carpet):
    carpet.ask("document.querySelector('.carpet').scrollIntoView({block: 'center'})")
    left, top, wide, high = carpet.ask(
        "(r => [r.left, r.top, r.width, r.height])"
        "(document.querySelector('.carpet').getBoundingClientRect())"
    )
    at = left + 22 + (wide - 28) * 0.5, top + 6 + (high - 22) * 0.5
    carpet.mouse("mouseMoved", *at)
    carpet.click(*at)
    carpet.wait("umbra.waits === 0")
    date, minutes = carpet.ask("[umbra.state.date, umbra.state.minutes]")
    assert date == "2026-07-02"
    assert abs(minutes - 720) <= 30
    assert carpet.ask("document.querySelector('.told-cell').textContent").startswith(
        "2 July 2026, "
    )
