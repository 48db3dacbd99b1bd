"""Figures of a city in tiles are of what counts in one study, and the same."""

import pytest
from PIL import Image
from support.cities import DAY

import umbra
from umbra.receivers.counted import NEAR
from umbra.writers.city.city_figures import find_figures

YEAR = {"date": "2026", "every_days": 24, "every": "2h", "cell": 6.0}


@pytest.mark.parametrize("receivers", ["ground", "top", "surfaces"])
def test_months_are_told_as_of_one_study(city, tmp_path, receivers):
    options = {**YEAR, "receivers": receivers}
    if receivers == "surfaces":
        del options["cell"]
        options |= {"spacing": 4.0, "no_cast": ["east 0", "east 1", "east 2"], "on": ["west*"]}
    city = city[:2]
    scene = umbra.read(*city)
    study = umbra.shadow_study(scene, umbra.find_site(scene), **options)
    study.write(tmp_path / "whole", pictures=False)
    made = umbra.city_study(city, out=tmp_path / "tiles", tiles=90, **options)
    names = {path.name for path in made.write("geoparquet" if receivers == "surfaces" else "map")}
    assert ("months.png" in names) == (receivers != "surfaces")
    told, whole = ((tmp_path / one / "months.csv").read_text() for one in ("tiles", "whole"))
    assert told == whole
    assert len(told.splitlines()) == 13
    if receivers != "surfaces":
        assert Image.open(tmp_path / "tiles/months.png").size[0] > 800


@pytest.mark.parametrize("extent", [None, (85000, 447050, 85200, 447200)])
def test_what_counts_is_told_as_of_one_study(city, tmp_path, extent):
    options = {**DAY, "every": "2h", "receivers": "ground", "cell": 5.0, "extent": extent}
    scene = umbra.read(*city)
    study = umbra.shadow_study(scene, umbra.find_site(scene), **options).result
    whole = study.kind.find_counted(study)
    umbra.city_study(city, out=tmp_path, tiles=90, **options)
    found = find_figures(tmp_path).counted
    assert (found.what, found.whole) == (whole.what, pytest.approx(whole.whole, rel=1e-12))
    assert (" in the frame" in found.what) == (extent is not None)
    assert f"{NEAR:g} m" in found.what
