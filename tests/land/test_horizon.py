"""The horizon of a raster of heights: a march in float64, closed forms, any raster of one land."""

import math
import warnings

import numpy as np
import pytest
from pyproj import CRS, Geod, Transformer
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.land import eye_rays as land_view
from umbra.land.eye_rays import LandView, LandWork, view_land
from umbra.land.raster_horizon import find_horizon
from umbra.land.rays import Eye
from umbra.lights import LandRaster

rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
from rasterio.transform import Affine  # noqa: E402


def from_origin(west, north, width, height):
    return Affine(width, 0, west, 0, -height, north)


GEOD = Geod(ellps="WGS84")
LON, LAT = 11.0, 47.2
EAST, NORTH = Transformer.from_crs(4326, 32632, always_xy=True).transform(LON, LAT)
TURNS = 72
NEAR = 500.0


def rise(lon, lat):
    """Return the height of a made Alp: a valley, a ridge, and peaks [m]."""
    x, y = (np.asarray(lon) - LON) * 75.0, (np.asarray(lat) - LAT) * 111.0  # some km
    peaks = ((4.0, 3.0, 2.0, 1.2), (-9.0, 2.0, 1.5, 2.5), (12.0, -7.0, 2.2, 3.0), (1, -6, 1, 0.7))
    height = 600.0 + 2600.0 * np.exp(-(((y + 13.0 + 0.3 * x) / 2.0) ** 2) - (x / 7.0) ** 2)
    for east, north, high, wide in peaks:
        height = height + 900.0 * high * np.exp(-((x - east) ** 2 + (y - north) ** 2) / wide**2)
    return height + 15.0 * np.sin(5.0 * x) * np.cos(4.0 * y)


def save(
    path, crs="EPSG:32632", cell=60.0, cells=700, matrix=None, fill=None, heights=None, **more
):
    """Write the Alp about the site, on any lattice of a reference system."""
    known = CRS.from_user_input(crs)
    there = Transformer.from_crs(4326, known.to_2d(), always_xy=True)
    x, y = there.transform(LON, LAT)
    if matrix is None:
        matrix = from_origin(x - cell * cells / 2 - 7, y + cell * cells / 2 + 11, cell, cell)
    else:
        matrix = Affine.translation(x, y) @ matrix @ Affine.translation(-cells / 2, -cells / 2)
    col, row = np.meshgrid(np.arange(cells) + 0.5, np.arange(cells) + 0.5)
    if heights is None:
        heights = rise(*there.transform(*(matrix @ (col, row)), direction="INVERSE"))
    if fill is not None:
        heights = fill(heights)
    unit, scale = more.pop("unit", None), more.pop("scale", 1.0)
    kind = more.pop("dtype", "float32")
    with rasterio.open(
        path, "w", driver="GTiff", height=cells, width=cells, count=1, dtype=kind,
        crs=more.pop("said", crs), transform=matrix, **more,
    ) as file:  # fmt: skip
        file.write((heights / scale).astype(kind), 1)
        if unit:
            file.units = (unit,)
        file.scales = (scale,)
    return path


def view(path, turns=TURNS, k=0.13, near=NEAR, lon=LON, lat=LAT):
    work = LandWork(str(path), lon, lat, near, 100e3, k, (Eye(0.0, 0.0, 0.0, turns),))
    (found,) = (one for one in view_land(work) if isinstance(one, LandView))
    return found


def march(path, turns=TURNS, k=0.13, step=4.0):
    """Walk away from the site in float64, at bilinear heights; return the highest [degrees]."""
    with rasterio.open(path) as file:
        heights, back = file.read(1).astype(np.float64), ~file.transform
        there = Transformer.from_crs(4326, file.crs, always_xy=True)

    def find(lon, lat):
        col, row = (
            np.asarray(one) - 0.5
            for one in back @ tuple(map(np.asarray, there.transform(lon, lat)))
        )
        i, j = (np.clip(np.floor(one).astype(int), 0, len(heights) - 2) for one in (col, row))
        a, b = col - i, row - j
        found = (1 - b) * ((1 - a) * heights[j, i] + a * heights[j, i + 1])
        found += b * ((1 - a) * heights[j + 1, i] + a * heights[j + 1, i + 1])
        return np.where((np.minimum(a, b) >= 0) & (np.maximum(a, b) <= 1), found, np.nan)

    distance, radius = np.arange(NEAR, 32e3, step), 6_371_000.0 / (1 - k)
    eye = float(find([LON], [LAT])[0])
    angle, highest = distance / radius, []
    for turn in np.arange(turns) * 360.0 / turns:
        same = np.full((3, len(distance)), [[LON], [LAT], [turn]])
        high = find(*GEOD.fwd(*same, distance)[:2])
        slope = ((radius + high) * np.cos(angle) - (radius + eye)) / (
            (radius + high) * np.sin(angle)
        )
        highest.append(math.degrees(math.atan(np.nanmax(slope))))
    return np.array(highest)


@pytest.fixture(scope="module")
def alp(tmp_path_factory):
    return save(tmp_path_factory.mktemp("land") / "alp.tif")


def test_a_march_in_float64(alp):
    """The issue's mark is 0.01 degrees; the rest is the march's own step and its sphere."""
    found, walked = view(alp).elevation, march(alp)
    assert np.ptp(walked) > 15
    assert np.abs(found - walked).max() < 0.003
    assert (found - walked).min() > -0.0005  # a march that samples is never higher


RASTERS = {
    "degrees": {"crs": "EPSG:4326", "matrix": Affine.scale(0.0008, -0.00055)},
    "south up": {"matrix": Affine.scale(60, 60)},
    "turned": {"matrix": Affine.rotation(33) @ Affine.scale(60, -60)},
    "northing first": {"crs": "EPSG:3035"},
    "web map": {"crs": "EPSG:3857", "cell": 88.0},
    "heights in feet": {"unit": "US survey foot", "fill": lambda h: h * 3937 / 1200},
    "packed": {"dtype": "int16", "scale": 0.25},
    "tiled": {"tiled": True, "compress": "deflate", "blockxsize": 128, "blockysize": 128},
}


@pytest.mark.parametrize("name", RASTERS)
def test_any_raster_of_one_land(tmp_path, alp, name):
    """One land on other lattices and units: what cells of 60 m resolve differs by less than 0.1."""
    found = view(save(tmp_path / "land.tif", **RASTERS[name]))
    gap = np.abs(found.elevation - view(alp).elevation)
    assert gap.max() < 0.1
    assert gap.mean() < 0.02


def test_a_plan_in_feet(tmp_path):
    """A plateau in New York's feet stands where it should; its unit must be said."""
    x, y = Transformer.from_crs(4326, 2263, always_xy=True).transform(-74.0, 40.7)
    heights = np.zeros((200, 200))
    heights[:50] = 1000.0  # feet, from 5,000 feet north of the site on
    matrix = from_origin(x - 10_000, y + 10_000, 100, 100)
    path = tmp_path / "feet.tif"
    for unit in ("ft", ""):
        with rasterio.open(path, "w", driver="GTiff", height=200, width=200, count=1,
                           dtype="float32", crs="EPSG:2263", transform=matrix) as file:  # fmt: skip
            file.write(heights.astype("float32"), 1)
            if unit:
                file.units = (unit,)
        if not unit:
            with pytest.raises(InputError):
                view(path, lon=-74.0, lat=40.7)
            break
        found = view(path, turns=4, lon=-74.0, lat=40.7)
        away = 5050.0 * 0.3048  # the last centre below, from which it rises over one cell
        assert found.elevation[0] == pytest.approx(math.degrees(math.atan2(304.8, away)), abs=0.01)
        assert found.elevation[2] < 0


@pytest.mark.parametrize("k", [0.0, 0.13])
def test_the_earth_sinks(tmp_path, k):
    """A wall of 500 m, 20 km north, by the spherical triangle; the plain is below the horizon."""

    def wall(heights):
        flat = np.zeros_like(heights)
        flat[: 700 // 2 - 333] = 500.0  # 333 cells of 60 m
        return flat

    path = save(tmp_path / "wall.tif", fill=wall)
    found = view(path, turns=4, k=k)
    # The row's centres stand 11 m and half a cell from the lattice about the site.
    away = (350 - 16.5) * 60 + 11
    radius = 6_388_000.0 / (1 - k)  # across the meridian's own at 47 degrees, within 0.4 %
    angle = away / radius
    slope = ((radius + 500) * math.cos(angle) - radius) / ((radius + 500) * math.sin(angle))
    assert found.elevation[0] == pytest.approx(math.degrees(math.atan(slope)), abs=0.002)
    assert -0.05 < found.elevation[2] < -0.0015
    assert found.distance[0] == pytest.approx(away, rel=0.002)  # the plan's scale is not 1


HOLES = {
    "value": ({"nodata": -32768.0}, -32768.0),
    "large value": ({"nodata": 3.4e38}, 3.4e38),
    "nan": ({}, np.nan),
    "declared nan": ({"nodata": np.nan}, np.nan),
}


@pytest.mark.parametrize("name", HOLES)
def test_holes_cast_nothing(tmp_path, alp, name):
    """North of the site nothing has a height but near it: what is left is of the rest."""
    more, value = HOLES[name]

    def dig(heights):
        heights = heights.copy()
        heights[:330] = value  # 20 rows, 1.2 km, north of the site
        return heights

    found, whole = view(save(tmp_path / "holes.tif", fill=dig, **more)), view(alp)
    north = np.abs(np.arange(TURNS) * 360 / TURNS - 180) > 85
    assert (found.seen[0], found.seen[TURNS // 2]) == pytest.approx((1200, 21000), rel=0.05)
    assert (whole.elevation - found.elevation)[north].max() > 1
    assert np.array_equal(found.elevation[~north], whole.elevation[~north])
    assert 0.3 < found.missing < 0.6


def test_blocks_leave_no_seams(alp, monkeypatch):
    whole = view(alp)
    monkeypatch.setattr(land_view, "_SIDE", 37)
    parts = view(alp)
    assert np.allclose(parts.elevation, whole.elevation, atol=1e-6)
    assert np.allclose(parts.seen, whole.seen)


def test_far_cells_are_thinned_within_what_is_said(tmp_path, monkeypatch):
    """Of too many cells the far ones are read from overviews: 0.01 degrees on slopes of 45."""
    path = save(tmp_path / "fine.tif", cell=20.0, cells=2000, tiled=True, blockxsize=64,
                blockysize=64)  # fmt: skip
    whole = view(path)
    with rasterio.open(path, "r+") as file:
        file.build_overviews([2, 4], rasterio.enums.Resampling.average)
    monkeypatch.setattr(land_view, "MOST", 1000)
    monkeypatch.setattr(land_view, "_SIDE", 64)
    monkeypatch.setattr(land_view, "_SHARE", 1 / 300)  # ten times as coarse
    thinned = view(path)
    assert thinned.thinned == 4
    assert 1e-4 < np.abs(thinned.elevation - whole.elevation).max() < 0.1


def test_what_is_near_is_the_models(tmp_path):
    """Of a pit's edge, 3 km wide, nothing counts from 4 km on."""

    def edge(heights):
        row, col = np.indices(heights.shape)
        away = np.hypot(row - 350, col - 350) * 60
        return np.where(np.abs(away - 3000) < 300, 500.0, 0.0)

    path = save(tmp_path / "pit.tif", fill=edge)
    assert view(path).elevation.min() > 8
    assert view(path, near=4000.0).elevation.max() < 0


FAULTS = {
    "no reference system": {"said": None},
    "metres of what": {"unit": "fathom"},
    "undeclared": {"fill": lambda h: np.where(np.arange(700) < 50, -9999.0, h)},
    "too high": {"fill": lambda h: h * 30},
    "no height at the site": {"fill": lambda h: h * 0 + np.nan},
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_told(tmp_path, name):
    with pytest.raises(InputError) as caught:
        view(save(tmp_path / "wrong.tif", **FAULTS[name]))
    assert "\n" not in str(caught.value)
    assert ";" in str(caught.value)


def test_a_site_elsewhere_is_told_with_its_distance(alp):
    with pytest.raises(InputError) as caught:
        view(alp, lat=LAT + 1.0)
    assert caught.value.distance == pytest.approx(111_200 - 21_000, rel=0.01)


def test_across_the_antimeridian(tmp_path):
    """A raster in degrees from 179.5 to 180.5 has a site at -179.9."""
    heights = np.zeros((400, 400), np.float32)
    heights[:, :40] = 800.0
    with rasterio.open(tmp_path / "fiji.tif", "w", driver="GTiff", height=400, width=400, count=1,
                       dtype="float32", crs="EPSG:4326",
                       transform=from_origin(179.5, -16.5, 0.0025, 0.0025)) as file:  # fmt: skip
        file.write(heights, 1)
    found = view(tmp_path / "fiji.tif", turns=4, lon=-179.9, lat=-17.0)
    _, _, away = GEOD.inv(-179.9, -17.0, 179.5 + 0.0025 * 39.5, -17.0)
    assert found.distance[3] == pytest.approx(away, rel=1e-3)
    assert found.elevation[3] > 0.5


@pytest.fixture(scope="module")
def house():
    """A house at the site, in UTM."""
    part = umbra.Part("house", "Building", umbra.Mesh(*box((-5, -5, 0), (5, 5, 10))))
    return umbra.make_scene([part])


def test_a_study_with_a_raster(house, alp):
    """A child reads it; what it read is told, and the sun is behind the land."""
    site = umbra.Site(LAT, LON, "Europe/Vienna")
    asked = {"date": "2026-12-21", "receivers": "points", "points": [(0, 40, 0)], "ground": 0.0}
    asked |= {"start": "00:00", "end": "24:00"}
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = umbra.shadow_study(house, site, horizon=alp, horizon_from=NEAR, **asked)
    open_ = umbra.shadow_study(house, site, **asked)
    assert 0.2 < float(found.sun_hours[0]) < float(open_.sun_hours[0]) - 0.5
    seen = view(alp, turns=3600)
    edge = seen.elevation
    highest = max(edge.max(), seen.peaks[:, 1].max())
    assert found.attrs["horizon_highest_deg"] == pytest.approx(highest, abs=1e-9)
    assert any("alp.tif" in str(one.message) and f"{edge.max():.2f}" in str(one.message)
               for one in told)  # fmt: skip
    with pytest.raises(InputError) as caught:
        umbra.shadow_study(house, umbra.Site(10.0, 10.0, "UTC"), horizon=alp, **asked)
    assert caught.value.option == "horizon"
    with pytest.raises(InputError) as caught:  # beyond the raster
        umbra.shadow_study(house, site, horizon=alp, horizon_from=99_000.0, **asked)
    assert caught.value.option == "horizon_from"
    with pytest.raises(InputError) as caught:
        umbra.shadow_study(house, None, horizon=alp, measure="sky_view_factor",
                           **{**asked, "date": None})  # fmt: skip
    assert caught.value.option == "latitude"


@pytest.mark.parametrize("more", [{"horizon_from": 100.0}, {"horizon_from": 100.0, "horizon": 1}])
def test_distances_are_of_rasters(house, tmp_path, more):
    if "horizon" in more:
        more["horizon"] = tmp_path / "land.txt"
        more["horizon"].write_text("1\n" * 8)
    with pytest.raises(InputError) as caught:
        umbra.shadow_study(house, umbra.Site(LAT, LON, "UTC"), date="2026-03-21", **more)
    assert caught.value.option == "horizon_from"


def test_a_lone_peak_between_rays_is_told(tmp_path):
    """Of one cell, narrower than a tenth of a degree, at any azimuth: as high as it is."""

    def spike(heights):
        heights[:] = 500.0
        heights[60, 333] = heights[410, 690] = heights[655, 20] = 1500.0
        return heights

    path = save(tmp_path / "spike.tif", fill=spike, cell=30.0)
    land = find_horizon(LandRaster(path), LON, LAT, 400.0, 10.0)
    with rasterio.open(path) as file:
        there = Transformer.from_crs(file.crs, 4326, always_xy=True)
        for row, col in ((60, 333), (410, 690), (655, 20)):
            turn, _, away = GEOD.inv(LON, LAT, *there.transform(*file.xy(row, col)))
            radius = 6_371_000.0 / 0.87
            slope = (1000.0 - away**2 / 2 / radius) / away
            told = float(land.find_edge(np.array(turn)))
            assert told == pytest.approx(math.degrees(math.atan(slope)), abs=0.01)
            assert float(land.find_edge(np.array(turn + 0.6))) < 0.1
    assert len(land.azimuth) < 3700
