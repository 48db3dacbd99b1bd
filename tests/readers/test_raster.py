"""Height rasters: the surface through cell centres, by hand."""

import json

import numpy as np
import pytest
from support.judge import judge_field

import umbra
from umbra import InputError
from umbra.scene.grid import Grid

rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
from rasterio.transform import Affine, from_origin  # noqa: E402

PLAIN = np.array([[1.0, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]])


@pytest.fixture
def write(tmp_path):
    def write(
        heights, crs="EPSG:32633", transform=None, nodata=None, dtype="float64", name="t.tif",
        units=None, scale=None, bands=1,
    ):  # fmt: skip
        heights = np.asarray(heights, dtype)
        rows, cols = heights.shape
        path = tmp_path / name
        with rasterio.open(
            path, "w", driver="GTiff", height=rows, width=cols, count=bands, dtype=dtype, crs=crs,
            transform=transform or from_origin(600000, 5340000, 2, 1), nodata=nodata,
        ) as file:  # fmt: skip
            for band in range(1, bands + 1):
                file.write(heights, band)
            if units:
                file.units = (units,) * bands
            if scale:
                file.scales = (scale,) * bands
        return path

    return write


def corners(scene):
    soup = scene.triangles()
    return soup.vertices[soup.faces] + scene.origin


def test_vertices_are_the_centres_and_triangles_face_up(write):
    scene = umbra.read(write(PLAIN))
    (part,) = scene.parts
    assert (part.name, part.kind, part.triangles) == ("t", "Raster", 2 * 2 * 3)
    # Cells of 2 by 1 m from the upper left corner.
    expected = {
        (600001 + 2 * col, 5339999.5 - row, PLAIN[row, col]) for row in range(3) for col in range(4)
    }
    assert set(map(tuple, corners(scene).reshape(-1, 3).tolist())) == expected
    a, b, c = corners(scene).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] == 2.0).all()  # twice the area of half a cell
    assert scene.crs == "EPSG:32633"
    assert scene.latitude == pytest.approx(48.2, abs=0.1)
    assert not scene.notes


def test_the_diagonal_is_that_of_the_description(write):
    # Only the far end of the diagonal is high: both triangles reach it.
    scene = umbra.read(write([[0, 0], [0, 3]]))
    assert corners(scene)[..., 2].max(1).tolist() == [3, 3]
    # Only the corner off the diagonal: one of them.
    scene = umbra.read(write([[0, 3], [0, 0]]))
    assert sorted(corners(scene)[..., 2].max(1).tolist()) == [0, 3]


def test_a_raster_from_the_south_and_a_turned_one_face_up(write):
    for transform in (
        Affine(2, 0, 600000, 0, 1, 5340000),
        Affine(0, 1, 600000, 1, 0, 5340000),
        Affine(1, 0.5, 600000, 0.5, -1, 5340000),
    ):
        a, b, c = corners(umbra.read(write(PLAIN, transform=transform))).transpose(1, 0, 2)
        assert (np.cross(b - a, c - a)[:, 2] > 0).all()


@pytest.mark.parametrize(
    ("gone", "triangles"),
    [([(0, 0)], 11), ([(1, 1)], 8), ([(0, 3), (2, 0)], 10), ([(0, 0), (0, 1)], 9)],
)
def test_nodata_leaves_the_triangle_of_the_other_three(write, gone, triangles):
    heights = PLAIN.copy()
    for cell in gone:
        heights[cell] = -9999
    scene = umbra.read(write(heights, nodata=-9999))
    assert len(corners(scene)) == triangles
    assert corners(scene)[..., 2].min() >= 1
    a, b, c = corners(scene).transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    assert f"cells without a height left out: {len(gone)} of 12" in scene.notes[0]


def test_nan_is_nodata_too(write):
    heights = PLAIN.copy()
    heights[0, 0] = np.nan
    assert len(corners(umbra.read(write(heights)))) == 11


def test_feet_scale_and_bands(write):
    scene = umbra.read(write(PLAIN, units="ft"))
    assert corners(scene)[..., 2].max() == pytest.approx(12 * 0.3048)
    assert "from feet" in scene.notes[0]
    scene = umbra.read(write(PLAIN, dtype="int16", scale=0.25))
    assert corners(scene)[..., 2].max() == 3
    assert "bands after the first left out: 1" in umbra.read(write(PLAIN, bands=2)).notes[0]


def test_degrees_become_metres_of_the_zone(write):
    second = 1 / 3600
    scene = umbra.read(write(PLAIN, crs="EPSG:4326", transform=from_origin(16, 48, second, second)))
    assert scene.crs == "EPSG:32633"
    # Three columns of 20.7 m and two rows of 30.9 m, turned by 0.7° against the zone's grid.
    assert np.ptp(scene.bounds(), axis=0) == pytest.approx([3 * 20.73, 2 * 30.89, 11], abs=1)
    assert "converted from EPSG:4326 to EPSG:32633" in " ".join(scene.notes)


def test_feet_in_the_plan_are_refused_by_name(write):
    there = {"crs": "EPSG:2263", "transform": from_origin(980000, 200000, 3, 3)}
    with pytest.raises(InputError, match=r"are in feet.*unit of the heights is not said.*-units"):
        umbra.read(write(PLAIN, **there))
    # Declared, they are converted once.
    top = 12 * 1200 / 3937
    assert umbra.read(write(PLAIN, units="US survey foot", **there)).bounds()[1, 2] == (
        pytest.approx(top)
    )
    there["crs"] = "EPSG:2263+6360"
    for units in ({}, {"units": "US survey foot"}):
        assert umbra.read(write(PLAIN, **there, **units)).bounds()[1, 2] == pytest.approx(top)


@pytest.mark.parametrize(
    ("options", "facts", "said"),
    [
        (
            {"heights": np.full((3, 3), -9999.0)},
            {"value": -9999, "count": 9}, "9 cells at -9999 m",
        ),
        ({"heights": np.full((3, 3), -9999.0), "nodata": -9999}, {"count": 9}, "all are nodata"),
        ({"heights": PLAIN, "dtype": "uint8", "bands": 3}, {"bands": 3}, "is a picture"),
        ({"heights": PLAIN, "dtype": "complex64"}, {"dtype": "complex64"}, "not heights"),
        ({"heights": PLAIN[:1]}, {"cells": (1, 4)}, "has 4x1 cells"),
        ({"heights": PLAIN, "units": "fathom"}, {"unit": "fathom"}, "heights in 'fathom'"),
        ({"heights": [[1, 0], [0, 1]], "nodata": 0}, {}, "no two neighbouring"),
        ({"heights": PLAIN, "transform": Affine(1, 1, 0, 1, 1, 0)}, {}, "no area"),
    ],
)  # fmt: skip
def test_rasters_without_heights_are_refused(write, refuse, options, facts, said):
    assert said in refuse(umbra.read, write(**options), facts=facts)


def test_a_raster_that_does_not_fit_names_the_remedy(write, monkeypatch):
    monkeypatch.setattr("umbra.readers.height_raster.find_memory", lambda: 1000.0)
    with pytest.raises(InputError, match=r"needs 0 GB.*4 times coarser"):
        umbra.read(write(PLAIN))


@pytest.mark.parametrize("cell", [0.7, 2.0])
def test_a_surface_model_with_a_building_is_right_by_rays(write, tmp_path, cell):
    rng = np.random.default_rng(4)
    heights = rng.uniform(0, 1, (30, 40)).cumsum(1) / 8
    for row, col, height in ((4, 6, 9), (15, 20, 14), (20, 5, 6)):
        heights[row : row + 5, col : col + 6] += height
    heights[8:11, 25:30] = -9999
    surface = write(
        heights, nodata=-9999, transform=from_origin(600000, 5340030, 1, 1), name="dsm.tif"
    )
    ring = [(25.3, 3.1), (33.7, 4.2), (32.0, 9.9), (25.3, 8.0)]
    coordinates = [[[600000 + x, 5340000 + y] for x, y in (*ring, ring[0])]]
    feature = {
        "type": "Feature",
        "properties": {"height": 11},
        "geometry": {"type": "Polygon", "coordinates": coordinates},
    }
    crs = {"type": "name", "properties": {"name": "EPSG:32633"}}
    house = tmp_path / "house.geojson"
    house.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": [feature]}))
    scene = umbra.read(surface, house)
    assert len(scene.parts) == 2
    soup = scene.triangles()
    low = scene.bounds()[0] - scene.origin
    grid = Grid(low[0] + 0.31, low[1] + 0.27, cell, cell, int(38 / cell), int(28 / cell))
    suns = [(0.6, -0.5, 0.5), (-0.8, -0.3, 0.25), (0.1, 0.9, 0.6)]
    verdicts, counts = judge_field(
        (soup.vertices, soup.faces), grid, suns, ground=low[2], group=scene.groups()[soup.part]
    )
    verdicts.check()
    assert counts.max() > 0


def test_a_damaged_raster(write):
    path = write(PLAIN)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(InputError, match=r"t\.tif: "):
        umbra.read(path)


def test_without_the_package_the_extra_is_named(write, refuse, monkeypatch):
    path = write(PLAIN)
    monkeypatch.setitem(__import__("sys").modules, "rasterio", None)
    refuse(umbra.read, path, facts={"package": "rasterio", "extra": "gis"})


@pytest.mark.parametrize("more", [{}, {"exact": True}, {"masks": True, "spells": True}])
def test_beside_a_raster_and_on_nodata_nothing_receives(write, more):
    heights = np.full((20, 30), 100.0)
    heights[9:11, 12:15] = 112
    heights[2:6, 20:26] = -9999
    scene = umbra.read(write(heights, nodata=-9999, transform=from_origin(600000, 5340020, 1, 1)))
    site = umbra.find_site(scene)
    options = {"date": "2026-03-21", "receivers": "top", "cell": 0.7, "every": "1h", **more}
    found = umbra.shadow_study(scene, site, **options, who=["*"])
    # By default it is the raster and a margin, of which only the raster receives.
    x, y = np.meshgrid(found.x, found.y)
    inside = (x > 600000.5) & (x < 600029.5) & (y > 5340000.5) & (y < 5340019.5)
    hole = (x > 600019.5) & (x < 600026.5) & (y > 5340013.5) & (y < 5340018.5)
    # A triangle is left at each corner of the hole.
    corner = hole & (np.abs(x - 600023) > 2.5) & (np.abs(y - 5340016) > 1.5)
    sure = ~corner
    there = np.isfinite(found.shadow_hours.values)
    np.testing.assert_array_equal(there[sure], (inside & ~hole)[sure])
    assert there.sum() > 1000
    for name in ("sun_hours", "receiver_z"):
        np.testing.assert_array_equal(np.isfinite(found[name]), there)
    np.testing.assert_array_equal(np.isfinite(found.sole_hours[0]), there)
    assert float(found.receiver_z.min()) == pytest.approx(100)
    if "masks" in more:
        assert not found.in_shadow.values[:, ~there].any()
    # A ground that is named receives, as ever.
    half = np.array([-0.35, -0.35, 0.35, 0.35])
    extent = np.array([x.min(), y.min(), x.max(), y.max()]) + half
    plane = umbra.shadow_study(
        scene, site, **{**options, "cell": None}, ground=100, extent=extent, size=x.shape[::-1]
    )
    assert np.isfinite(plane.shadow_hours).all()
    np.testing.assert_allclose(
        found.shadow_hours.values[there], plane.shadow_hours.values[there], atol=1e-6
    )


def test_a_proposal_on_a_raster_loses_nothing_where_nothing_is(write):
    heights = np.full((20, 30), 100.0)
    heights[2:6, 20:26] = -9999
    tower = np.zeros((20, 30))
    tower[9:12, 20:24] = 106
    where = from_origin(600000, 5340020, 1, 1)
    files = [
        f"existing={write(heights, nodata=-9999, transform=where, name='a.tif')}",
        f"new={write(tower, nodata=0, transform=where, name='b.tif')}",
    ]
    scene = umbra.read(*files)
    found = umbra.shadow_study(
        scene, umbra.find_site(scene), date="2026-03-21", every="1h", receivers="top", cell=0.5,
        proposed=["new"], under="7h",
    )  # fmt: skip
    there = np.isfinite(found.shadow_hours.values)
    assert not np.isfinite(found.hours_lost.values[~there]).any()
    assert not found.newly_under.values[~there].any()
    assert found.newly_under.values.sum() * 0.25 == pytest.approx(
        float(found.neighbour_area_newly_under.sum())
    )
    assert list(found.neighbour.values) == ["a"]
