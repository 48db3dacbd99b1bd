"""Figures of a city in tiles are of what counts in one study, and the same."""

import json

import numpy as np
import pytest
from PIL import Image
from support.cities import DAY, SITE, write_city

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


@pytest.mark.parametrize(("size", "near"), [(1.5, 7.6), (4.0, NEAR)])
@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_small_models_count_ground_within_the_same_distance(tmp_path, size, near, receivers):
    lawn = "lawn", 85000 - 20 * size, 447000 - 15 * size, -0.1, 40 * size, 30 * size, 0.1, 0.0
    things = [
        ("box", 85000, 447000, 0, size, size / 2, 0.75 * size, 0.3),
        ("kiosk", 85000 + 2 * size, 447000, 0, 0.4 * size, size / 2, 0.6 * size, 0.1),
        ("tree", 85000 - 4 * size, 447000, 0, 0.4 * size, size / 2, 2 * size, 0.1),
    ]
    files = [write_city(tmp_path / f"{thing[0]}.city.json", [thing]) for thing in (*things, lawn)]
    model = json.loads(files[-1].read_text())
    model["CityObjects"]["lawn"]["type"] = "TINRelief"
    (geometry,) = model["CityObjects"]["lawn"]["geometry"]
    geometry |= {"type": "CompositeSurface", "boundaries": geometry["boundaries"][0][1:2]}
    files[-1].write_text(json.dumps(model))
    options = {**DAY, "every": "2h", "receivers": receivers, "cell": size / 8, "canopy": "tree"}
    site = umbra.Site(**SITE)
    study = umbra.shadow_study(umbra.read(*files), site, **options).result
    whole = study.kind.find_counted(study)
    made = umbra.city_study(files, site, out=tmp_path / "tiles", tiles=10 * size, **options)
    found = find_figures(tmp_path / "tiles").counted
    assert (found.what, found.whole) == (whole.what, pytest.approx(whole.whole, rel=1e-12))
    assert f"within {near:g} m" in found.what
    for name in ("x", "y", "sun_hours"):
        np.testing.assert_array_equal(made.dataset[name], getattr(study, name))
