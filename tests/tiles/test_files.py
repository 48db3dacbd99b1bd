"""Further files of a study in tiles hold what its store holds."""

import json

import numpy as np
import pytest
from support.cities import DAY

import umbra


def test_files_are_written_from_the_store(city, tmp_path):
    rasterio = pytest.importorskip("rasterio")
    made = umbra.city_study(
        city, out=tmp_path, tiles=150, receivers="top", cell=2.0,
        extent=(84950, 446950, 85520, 447290), spells=True, **DAY,
    )  # fmt: skip
    paths = made.write()
    assert {"hours.vrt", "map.png", "item.json"} < {path.name for path in paths}
    data = made.dataset.load()
    with rasterio.open(tmp_path / "hours.vrt") as raster:
        assert raster.crs.to_epsg() == 28992
        assert {"shadow_hours", "sun_hours", "longest_sun_hours"} < set(raster.descriptions)
        assert not {"first_sun", "receiver_z"} & set(raster.descriptions)
        for band, name in enumerate(raster.descriptions, 1):
            np.testing.assert_array_equal(raster.read(band)[::-1], data[name], name)
    item = json.loads((tmp_path / "item.json").read_text())
    assert set(item["assets"]) == {"study", "hours", "map"}
    assert item["properties"]["umbra:tiles_done"] == len(made.job.tiles()) == 12
