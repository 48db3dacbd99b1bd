"""The live page of a study with land far away: dusk, hours and sky, beside Python's."""

import base64
import json
import warnings
from datetime import datetime
from io import BytesIO

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from support.shapes import box
from support.web import SMALL

import umbra
from umbra.errors import InputError
from umbra.lights import Horizon
from umbra.web.bundle import bundle

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna", true_north=12.0)
RIDGE = pd.Series([3.0, 5, 12, 30, 14, 9, 20, 0], index=np.arange(8) * 45.0 + 3)
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"
PLACE = (30.0, -30.0, 1.5)
SHOWN = """({
  behind: umbra.sun.isBehind, lights: umbra.stage.renderer.lights.length,
  told: document.querySelector('.timebar').textContent,
  place: document.body.innerText.includes('the sun is behind the land'),
  figures: [...document.querySelectorAll('.sky dd')].map((e) => e.textContent),
  key: [...document.querySelectorAll('.sky .sky-key span')].map((e) => e.textContent),
  spells: [...document.querySelectorAll('.sky .sky-spells li')].map((e) => e.textContent),
})"""


def test_the_same_suns_are_behind_it(page):
    rng = np.random.default_rng(1)
    land = Horizon("made", "", np.sort(rng.uniform(0, 360, 40)), rng.uniform(0, 60, 40))
    azimuth, altitude = rng.uniform(0, 360, 4000), rng.uniform(-10, 70, 4000)
    asked = json.dumps({"azimuth": land.azimuth.tolist(), "elevation": land.elevation.tolist()})
    suns = json.dumps(np.column_stack([azimuth, altitude]).tolist())
    found = page.ask(
        f"(() => {{ {bundle('land')}\nconst land = {asked};"
        f"return {suns}.map(([a, b]) => $land.hides(land, a, b)); }})()"
    )
    level, up = np.cos(np.radians(altitude)), np.sin(np.radians(altitude))
    turn = np.radians(azimuth)
    toward = np.column_stack([level * np.sin(turn), level * np.cos(turn), up])
    assert np.array_equal(found, land.covers(toward, 0.0))
    assert 500 < sum(found) < 3500


def test_a_page_of_a_study_with_land(page, tmp_path):
    scene = umbra.make_scene(*box((-5, -5, 0), (5, 5, 30)), name="tower").with_facts(ground=0.0)
    asked = {"date": "2026-03-21", "receivers": "points", "points": [PLACE], "horizon": RIDGE}
    study = umbra.shadow_study(scene, SITE, ground=0.0, **asked)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        umbra.show(
            scene,
            SITE,
            date="2026-03-21",
            at="07:30",
            study=study,
            size=SMALL,
            out=tmp_path / "p.html",
        )
    page.open(tmp_path / "p.html", READY)
    own = list(PLACE)
    page.ask(
        f"umbra.set({{place: {{position: {own}.map((v, k) => v - umbra.model.origin[k]), "
        "normal: [0, 0, 1], part: -1}})"
    )
    page.wait("umbra.waits === 0")
    dusk = page.ask(SHOWN)
    assert (dusk["behind"], dusk["lights"], dusk["place"]) == (True, 0, True)
    assert "behind the land" in dusk["told"]
    exact = umbra.sky_view(scene, PLACE, site=SITE, horizon=RIDGE)
    factor, component = (float(words.split()[0]) for words in dusk["figures"])
    assert factor == pytest.approx(exact.sky_view_factor, abs=0.002)
    assert component == pytest.approx(exact.sky_component, abs=0.2)
    assert dusk["key"] == list(exact.blocked_by)
    assert "land" in dusk["key"]
    spells = exact.sun("2026-03-21")
    assert len(dusk["spells"]) == len(spells)
    for words, spell in zip(dusk["spells"], spells, strict=True):
        first, last = words[:8], words[9:17]
        for shown, right in ((first, spell.start), (last, spell.end)):
            at = datetime.strptime(shown, "%H:%M:%S")
            gap = (at.hour - right.hour) * 3600 + (at.minute - right.minute) * 60
            assert abs(gap + at.second - right.second) <= 3
    assert dusk["spells"][0].split("out of ")[1].startswith("the land")
    page.ask("umbra.set({minutes: 12 * 60})")
    page.wait("umbra.waits === 0")
    noon = page.ask(SHOWN)
    assert (noon["behind"], noon["lights"], noon["place"]) == (False, 1, False)


def test_a_view_with_land_and_no_study(page, tmp_path):
    """The land of ``horizon=``: dusk, and a poster without sun as the page draws none."""
    scene = umbra.make_scene(*box((-5, -5, 0), (5, 5, 30)), name="tower").with_facts(ground=0.0)
    when = {"date": "2026-03-21", "at": "07:30"}
    umbra.show(scene, SITE, horizon=RIDGE, size=SMALL, out=tmp_path / "land.html", **when)
    umbra.show(scene, SITE, size=SMALL, out=tmp_path / "open.html", **when)
    shown = {}
    for name in ("land", "open"):
        page.open(tmp_path / f"{name}.html", READY)
        shown[name] = page.ask(SHOWN)
        poster = (tmp_path / f"{name}.html").read_text().split("data:image/webp;base64,")[1]
        image = Image.open(BytesIO(base64.b64decode(poster.split('"')[0])))
        shown[name]["light"] = np.asarray(image.convert("L")).mean()
    assert (shown["land"]["behind"], shown["land"]["lights"]) == (True, 0)
    assert "behind the land" in shown["land"]["told"]
    assert (shown["open"]["behind"], shown["open"]["lights"]) == (False, 1)
    assert shown["land"]["light"] < 0.9 * shown["open"]["light"]
    study = umbra.shadow_study(scene, SITE, date="2026-03-21", cell=4.0)
    with pytest.raises(InputError) as caught:
        umbra.show(scene, SITE, study=study, horizon=RIDGE, size=SMALL, out=tmp_path / "two.html")
    assert caught.value.option == "horizon"
