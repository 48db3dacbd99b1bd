"""A terrain file as the ground: rasters in any reference system, in one piece and in tiles."""

import numpy as np
import pytest
from support.model_files import save_city
from support.shapes import box

import umbra

X, Y = 84700.0, 446900.0
CRS = "EPSG:28992"
SITE = umbra.Site(52.0, 4.36, "Europe/Amsterdam")
EXTENT = (X - 60, Y - 60, X + 80, Y + 80)
ASKED = {"date": "2026-03-21", "every": "1h", "cell": 2.0, "extent": EXTENT}


def rise(x, y):
    """Return the height of a hillside [m]: at the edge of the plan 9 m below the lowest foot."""
    return 20.0 + 0.1 * (x - X) + 0.05 * (y - Y)


@pytest.fixture
def town(tmp_path):
    """Return a file of houses that stand on the hillside at their lower left corner."""
    houses = {}
    for i in range(3):
        for j in range(3):
            x, y = X + 20 * i, Y + 20 * j
            houses[f"h{i}{j}"] = box((x, y, rise(x, y)), (x + 10, y + 10, rise(x, y) + 9))
    return save_city(tmp_path / "town.city.json", houses, crs=28992)


def save_land(path, crs, low=(-150, -150), high=(150, 150), step=2.0):
    """Write the hillside as a raster in a reference system."""
    rasterio = pytest.importorskip("rasterio")
    pyproj = pytest.importorskip("pyproj")
    there = pyproj.Transformer.from_crs(CRS, crs, always_xy=True)
    back = pyproj.Transformer.from_crs(crs, CRS, always_xy=True)
    corners = np.array(there.transform(*np.array([(X + a, Y + b) for a, b in (low, high)]).T))
    (west, east), (south, north) = corners
    if (east - west) < 1:  # degrees
        step = step / 100_000
    cols, rows = int((east - west) / step), int((north - south) / step)
    x, y = np.meshgrid(
        west + step * (np.arange(cols) + 0.5), north - step * (np.arange(rows) + 0.5)
    )
    heights = rise(*back.transform(x, y)).astype(np.float32)
    with rasterio.open(
        path, "w", driver="GTiff", width=cols, height=rows, count=1, dtype="float32", crs=crs,
        transform=rasterio.transform.from_origin(west, north, step, step),
    ) as file:  # fmt: skip
        file.write(heights, 1)
    return path


@pytest.mark.parametrize("crs", [CRS, "EPSG:32631", "EPSG:4326"])
@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_land_below_the_lowest_foot_receives_in_one_piece_and_in_tiles(
    tmp_path, town, crs, receivers
):
    land = save_land(tmp_path / "land.tif", crs)
    asked = {**ASKED, "receivers": receivers, "ground": str(land)}
    one = umbra.shadow_study(umbra.read(town), SITE, **asked).dataset
    x, y = np.meshgrid(one.x, one.y)
    z, hours = one.receiver_z.values, one.shadow_hours.values
    assert np.isfinite(hours).all()
    is_land = np.abs(z - rise(x, y)) < 0.02
    assert (is_land | (receivers == "top")).all()
    assert is_land.mean() > 0.9
    assert z.min() < 12  # the lowest foot is at 20 m
    # The same land as one more file of the model.
    layer = umbra.read(town, save_land(tmp_path / "same.tif", CRS))
    top = umbra.shadow_study(layer, SITE, **{**asked, "ground": None, "receivers": "top"})
    both = np.abs(z - top.receiver_z.values) < 0.02
    assert both.mean() > 0.9
    assert np.abs(hours - top.shadow_hours.values)[both].mean() < 0.02
    city = umbra.city_study(town, SITE, out=tmp_path / "city", tiles="60m", **asked).dataset
    for name in ("shadow_hours", "receiver_z"):
        assert city[name].values.tobytes() == one[name].values.tobytes()
    assert city.attrs["ground"] == "ground of land.tif"


def test_buildings_beyond_the_land_are_counted_in_a_note(tmp_path, town):
    land = save_land(tmp_path / "small.tif", CRS, (-4, -4), (33, 14), 1.0)  # under two houses
    asked = {**ASKED, "receivers": "ground", "ground": str(land)}
    study = umbra.shadow_study(umbra.read(town), SITE, **asked)
    city = umbra.city_study(town, SITE, out=tmp_path / "city", tiles="60m", **asked)
    told = [study.dataset.attrs["assumption"], *city.notes]
    assert sum("7 of 9 objects" in line for line in told) == 2


def test_a_model_in_tiles_that_floats_over_the_land_is_told(tmp_path, town):
    land = save_land(tmp_path / "land.tif", CRS)
    high = {f"h{i}": box((X + 20 * i, Y, 70), (X + 20 * i + 9, Y + 9, 79)) for i in range(3)}
    file = save_city(tmp_path / "high.city.json", high, crs=28992)
    asked = {**ASKED, "receivers": "ground", "ground": str(land)}
    city = umbra.city_study(file, SITE, out=tmp_path / "city", tiles="60m", **asked)
    one = umbra.shadow_study(umbra.read(file), SITE, **asked).dataset.attrs["assumption"]
    assert "floats over" in one
    assert one in city.notes
