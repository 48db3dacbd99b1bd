"""Canopy rasters: closed bodies, by hand, and their shadows by rays."""

import numpy as np
import pytest
from support.judge import judge_field
from support.raycaster import RayCaster

import umbra
from umbra import InputError
from umbra.scene.grid import Grid

rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
from rasterio.transform import Affine, from_origin  # noqa: E402

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
EAST, NORTH = 600000.0, 5340000.0


@pytest.fixture
def write(tmp_path):
    def write(heights, name, nodata=None, transform=None, crs="EPSG:32633"):
        heights = np.asarray(heights, np.float64)
        rows, cols = heights.shape
        path = tmp_path / name
        with rasterio.open(
            path, "w", driver="GTiff", height=rows, width=cols, count=1, dtype="float64",
            crs=crs, transform=transform or from_origin(EAST, NORTH + rows, 1, 1), nodata=nodata,
        ) as file:  # fmt: skip
            file.write(heights, 1)
        return path

    return write


def find_volume(corners):
    return np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6


def body(scene):
    (part,) = (k for k, p in enumerate(scene.parts) if p.kind == "Canopy")
    soup = scene.triangles([part])
    return soup.vertices[soup.faces] + scene.origin


def check_closed(scene):
    """Every directed edge has its opposite, so often: no border, no T-junction."""
    corners = body(scene)
    edges = np.stack([corners, np.roll(corners, -1, 1)], 2).reshape(-1, 6)
    there, back = (
        np.unique(e, axis=0, return_counts=True) for e in (edges, edges[:, [3, 4, 5, 0, 1, 2]])
    )
    np.testing.assert_array_equal(there[0], back[0])
    np.testing.assert_array_equal(there[1], back[1])


def test_one_tree_is_a_box_above_its_trunk(write):
    heights = np.zeros((4, 5))
    heights[1, 2] = 8
    scene = umbra.read(f"canopy={write(heights, 'cdsm.tif')}", canopy=["canopy"])
    corners = body(scene)
    assert len(corners) == 12
    low, high = corners.min((0, 1)), corners.max((0, 1))
    np.testing.assert_allclose(low, [EAST + 2, NORTH + 2, 2])
    np.testing.assert_allclose(high, [EAST + 3, NORTH + 3, 8])
    assert find_volume(corners - low) == pytest.approx(6)
    (part,) = scene.parts
    assert (part.name, part.kind, part.layer) == ("cdsm", "Canopy", "canopy")
    assert "1 cells up to 8 m" in " ".join(scene.notes)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "transform",
    [None, Affine(1, 0, EAST, 0, 1, NORTH), Affine(0.8, 0.6, EAST, 0.6, -0.8, NORTH)],
)
def test_any_crowns_are_closed_and_hold_their_volume(write, seed, transform):
    rng = np.random.default_rng(seed)
    heights = rng.integers(0, 4, (9, 11)) * 3.0
    ground = rng.integers(0, 3, (9, 11)) * 2.0
    files = [
        f"dtm={write(ground, 'dtm.tif', transform=transform)}",
        f"crowns={write(heights, 'cdsm.tif', transform=transform)}",
    ]
    scene = umbra.read(*files, canopy=["crowns"], trunk="50%")
    check_closed(scene)
    assert find_volume(body(scene) - scene.origin) == pytest.approx(heights.sum() / 2)


def test_absolute_heights_trunk_zones_and_what_is_left_out(write):
    ground = np.full((3, 4), 100.0)
    ground[:, 2:] = 110
    tops = np.array([[0, 112, 118, 0], [0, 106, 109, 0], [-1, 0, np.nan, 0]], float)
    zone = np.array([[0, 104, 0, 0], [0, 107, 0, 0], [0, 0, 0, 0]], float)
    files = [f"g={write(ground, 'g.tif')}", f"c={write(tops, 'c.tif', nodata=np.nan)}"]
    scene = umbra.read(*files, canopy=["c"], canopy_heights="absolute", trunk=write(zone, "t.tif"))
    # 112 over 104; 118 over the ground at 110; 106 is below its trunk zone, 109 below ground.
    assert find_volume(body(scene) - scene.origin) == pytest.approx((112 - 104) + (118 - 110))
    check_closed(scene)
    assert "left out: 2" in " ".join(scene.notes)
    scene = umbra.read(*files, canopy=["c"], canopy_heights="absolute", trunk=0.5)
    assert find_volume(body(scene) - scene.origin) == pytest.approx(12 / 2 + 8 / 2 + 6 / 2)


def test_without_a_terrain_it_stands_on_the_lowest_of_the_rest(write, tmp_path):
    house = tmp_path / "house.obj"
    corners = [(EAST, NORTH, 171), (EAST + 2, NORTH, 171), (EAST, NORTH + 2, 180)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    house.write_text("\n".join(["o house", *lines, "f 1 2 3", ""]))
    heights = np.zeros((4, 5))
    heights[1, 2] = 8
    scene = umbra.read(f"t={write(heights, 'cdsm.tif')}", house, canopy=["t"], trunk=0)
    assert body(scene)[..., 2].min() == 171
    assert "level ground of z = 171" in " ".join(scene.notes)


def test_another_crs_is_brought_to_the_terrain_s(write):
    heights = np.zeros((6, 6))
    heights[2:4, 2:4] = 9
    second = 1 / 3600
    degrees = from_origin(16.3449, 48.2037, second, second)
    ground = write(np.full((80, 80), 50.0), "g.tif", transform=from_origin(EAST, NORTH, 2, 2))
    crowns = write(heights, "c.tif", crs="EPSG:4326", transform=degrees)
    scene = umbra.read(ground, f"c={crowns}", canopy=["c"], trunk=0)
    assert scene.crs == "EPSG:32633"
    check_closed(scene)
    corners = body(scene)
    assert (corners[..., 2].min(), corners[..., 2].max()) == (50, 59)


def test_shadows_of_crowns_on_a_slope_are_right_by_rays(write):
    rng = np.random.default_rng(2)
    ground = rng.uniform(0, 1, (24, 30)).cumsum(1) / 6
    heights = np.where(rng.uniform(size=(24, 30)) < 0.3, rng.uniform(3, 11, (24, 30)), 0)
    files = [f"dsm={write(ground, 'dsm.tif')}", f"cdsm={write(heights, 'cdsm.tif')}"]
    scene = umbra.read(*files, canopy=["cdsm"])
    check_closed(scene)
    # As a solid, every count by the judge of all height fields.
    soup = scene.triangles()
    low = scene.bounds()[0] - scene.origin
    grid = Grid(low[0] + 1.31, low[1] + 1.27, 0.7, 0.7, 38, 30)
    suns = [(0.6, -0.5, 0.5), (-0.8, -0.3, 0.25), (0.1, 0.9, 0.6)]
    verdicts, counts = judge_field(
        (soup.vertices, soup.faces), grid, suns, ground=low[2], group=scene.groups()[soup.part]
    )
    verdicts.check()
    assert counts.max() > 3
    # As a canopy, on the ground beneath it: each instant by rays through both.
    found = umbra.shadow_study(
        scene, VIENNA, date="2026-09-18", start="08:00", end="17:00", every="1h", masks=True,
        receivers="top", canopy=["cdsm"], transmissivity=0.3, cell=0.83,
        extent=(EAST + 1, NORTH + 1, EAST + 29, NORTH + 23),
    )  # fmt: skip
    x, y = np.meshgrid(found.x.values, found.y.values)
    places = np.stack([x, y, found.receiver_z.values], -1).reshape(-1, 3) - scene.origin
    zenith, light = np.array([0.0, 0.0, 1.0, 0.0]), np.zeros(len(places))
    wrong = 0
    for k, sun in enumerate(found.sun_direction.values):
        hit = []
        for part in (0, 1):
            some = scene.triangles([part])
            rays = RayCaster(some.vertices, some.faces)
            none, closed = np.full(len(places), -1), np.zeros(len(some.faces), bool)
            hit.append(rays.count(places, none, zenith, np.append(sun, 0.0), closed).any)
        dark = found.in_shadow.values[k].ravel() != 0
        weak = found.under_canopy.values[k].ravel() != 0
        # Attached shadow is dark without a hit; a crown counts where nothing is dark.
        wrong += (hit[0] & ~dark).sum() + (weak != (hit[1] & ~dark)).sum()
        light += np.where(dark, 0, np.where(weak, 0.3, 1))
    assert wrong == 0
    assert found.under_canopy.values.mean() > 0.2
    np.testing.assert_allclose(found.sun_hours.values.ravel(), light, atol=1e-5)


@pytest.mark.parametrize(
    ("heights", "options", "match"),
    [
        ([[0, 0], [0, 0]], {}, "no cell with a canopy"),
        ([[0, 512], [0, 0]], {}, "trees of 512 m.*canopy_heights='absolute'"),
        ([[0, 9], [0, 0]], {"trunk": "2"}, "share of the height from 0 to below 1"),
        ([[0, 9], [0, 0]], {"trunk": "no.tif"}, r"trunk zone no\.tif"),
        ([[0, 9], [0, 0]], {"canopy_heights": "absolute"}, "leave canopy_heights='absolute' out"),
        ([[0, 9], [0, 0]], {"canopy_heights": "relative"}, "above-ground or absolute"),
        ([[0, 9], [0, 0]], {"canopy": [], "trunk": "0.3"}, "trunk= is for canopy rasters"),
        ([[0, 9], [0, 0]], {"canopy": ["d"], "canopy_heights": "absolute"}, "none of the files"),
    ],
)
def test_what_is_no_canopy_is_told(write, heights, options, match):
    options = {"canopy": ["c"], **options}
    files = [f"g={write(np.full((2, 2), 200.0), 'g.tif')}", f"c={write(heights, 'c.tif')}"]
    with pytest.raises(InputError, match=match) as caught:
        umbra.read(*files, **options)
    assert "\n" not in str(caught.value)


def test_a_trunk_zone_of_other_cells_is_refused(write):
    zone = write(np.ones((3, 3)), "zone.tif")
    files = [f"c={write(np.full((2, 2), 9.0), 'c.tif')}"]
    with pytest.raises(InputError, match="other cells than the canopy"):
        umbra.read(*files, canopy=["c"], trunk=zone)
