"""Cells whose centres are a height raster's own: the plan's first and last ones lie on its rim."""

import numpy as np
import pytest
from support.raycaster import RayCaster

import umbra
from umbra.rays.depth import rasterise_depth

rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
from rasterio.transform import from_origin  # noqa: E402

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "30min"}
UP = np.array([0.0, 0.0, 1.0, 0.0])


@pytest.fixture(params=["whole", "nodata"])
def raster(request, tmp_path):
    """Write rough land, in one case with cells of no data at an end and in the middle."""
    rng = np.random.default_rng(3)
    heights = 100 + 0.15 * rng.normal(size=(26, 34)).cumsum(0).cumsum(1)
    if request.param == "nodata":
        heights[15:, 30:] = heights[8:12, 8:15] = -9999
    path = tmp_path / "land.tif"
    with rasterio.open(
        path, "w", driver="GTiff", height=26, width=34, count=1, dtype="float32",
        crs="EPSG:31256", transform=from_origin(2000, 340000, 1, 1), nodata=-9999,
    ) as file:  # fmt: skip
        file.write(heights.astype("float32"), 1)
    return path, heights.astype("float32")[::-1]


def study_land(path, **options):
    extent = (2000, 339974, 2034, 340000)  # as gdalinfo tells
    options = {**DAY, "receivers": "top", "cell": 1.0, "extent": extent, **options}
    return umbra.shadow_study(umbra.read(path), VIENNA, **options)


def cast_rays(scene, study, aside):
    """Tell what is in shadow so far beside the centres: north-east, else where there is land."""
    soup = scene.triangles()
    x, y = np.meshgrid(study.x.values - scene.origin[0], study.y.values - scene.origin[1])
    points = np.zeros((*x.shape, 3))
    own = np.full(x.shape, -1)
    for way in (1, 1), (-1, -1), (1, -1), (-1, 1):
        east, north = aside * way[0], 0.618 * aside * way[1]
        matrix = np.zeros((4, 4))
        matrix[0], matrix[1] = (1, 0, 0, -x[0, 0] - east), (0, 1, 0, -y[0, 0] - north)
        matrix[2, 3] = matrix[3, 2] = 1
        view = rasterise_depth(soup.vertices, soup.faces, matrix, x.shape[::-1])
        new = (own < 0) & (view.face >= 0)
        own[new] = view.face[new]
        points[new] = np.stack([x + east, y + north, view.key], -1)[new]
    a, b, c = (soup.vertices[soup.faces[own.ravel(), k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    rays = RayCaster(soup.vertices, soup.faces)
    is_closed = np.zeros(len(soup.faces), bool)
    masks = []
    for direction in study.sun_direction.values:
        sun = np.append(direction, 0.0)
        found = rays.count(points.reshape(-1, 3), own.ravel(), UP, sun, is_closed).any
        masks.append((found | (normals @ sun[:3] <= 0)).reshape(x.shape))
    return np.array(masks), own >= 0


def test_every_cell_with_a_height_is_judged_as_rays_do(raster):
    path, heights = raster
    study = study_land(path, masks=True)
    there = heights > 0
    np.testing.assert_array_equal(~np.isnan(study.shadow_hours), there)
    known = np.where(there, heights, np.nan)
    np.testing.assert_allclose(study.receiver_z.values, known, atol=2e-3)

    scene = umbra.read(path)
    answers = []
    for aside in (3e-4, 1e-3, 3e-3):
        masks, seen = cast_rays(scene, study, aside)
        np.testing.assert_array_equal(seen, there)
        answers.append(masks)
    certain = (np.array(answers) == answers[0]).all(0) & there
    assert certain.sum() > 0.99 * there.sum() * len(masks)
    wrong = certain & (study.in_shadow.values != answers[0])
    assert not wrong.any(), np.argwhere(wrong)[:5]
    # There are both sun and shadow to be wrong about at the ends.
    for end in answers[0][:, 0], answers[0][:, :, -1]:
        assert 0.01 < end.mean() < 0.99


def test_the_rim_is_the_same_to_whoever_asks(raster):
    path, heights = raster
    hours = study_land(path).shadow_hours.values
    # All cast, so what the land takes is all but attached shadow, and no sun is lost beside it.
    who = study_land(path, who=["*"])
    assert (np.nan_to_num(who.cast_hours.values[0]) <= np.nan_to_num(hours) + 1e-6).all()
    assert np.nansum(who.cast_hours.values[0][:, -1]) > 0
    exact = study_land(path, exact=True).shadow_hours.values
    np.testing.assert_array_equal(np.isnan(exact), heights < 0)
    assert np.nanmax(np.abs(exact - hours)[[0, -1]]) < 0.55
    assert np.nanmax(np.abs(exact - hours)[:, [0, -1]]) < 0.55
