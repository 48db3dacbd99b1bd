"""LAS and LAZ: the highest first returns by class, the canopy, the cell, and what is left out."""

import numpy as np
import pytest

import umbra
from umbra import InputError

laspy = pytest.importorskip("laspy", reason="laspy is not installed")
pytest.importorskip("lazrs", reason="lazrs is not installed")

X, Y = 85_000.0, 447_000.0


def save(path, x, y, z, kinds, returns=None, epsg=28992):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = [X, Y, 0], [0.001] * 3
    if epsg:
        import pyproj  # noqa: PLC0415

        header.add_crs(pyproj.CRS.from_epsg(epsg))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = x, y, z
    cloud.classification = np.asarray(kinds, np.uint8)
    cloud.return_number = np.ones(len(x), np.uint8) if returns is None else returns
    cloud.number_of_returns = np.full(len(x), 2, np.uint8)
    cloud.write(path)
    return path


def grid(side=20, per=2):
    """Points half a metre apart over a square."""
    steps = (np.arange(side * per) + 0.5) / per
    x, y = (one.ravel() for one in np.meshgrid(steps, steps))
    return X + x, Y + y


@pytest.fixture
def town(tmp_path):
    """Flat ground at 1, a house of 6 in the west, trees of 9 in the east, a bird at 500."""
    x, y = grid()
    kinds, z = np.full(len(x), 2), np.ones(len(x))
    house, trees = x < X + 5, x > X + 14
    kinds[house], z[house] = 6, 7
    kinds[trees], z[trees] = 5, 10
    under = x[trees], y[trees], np.ones(trees.sum()), np.full(trees.sum(), 2)
    x, y, z, kinds = (np.concatenate(pair) for pair in zip((x, y, z, kinds), under, strict=True))
    returns = np.repeat([1, 2], [1600, trees.sum()]).astype(np.uint8)
    x, y, z = np.append(x, X + 10), np.append(y, Y + 10), np.append(z, 500)
    return save(tmp_path / "town.laz", x, y, z, np.append(kinds, 7), np.append(returns, 1))


def test_ground_buildings_and_trees_come_apart(town):
    scene = umbra.read(town)
    assert scene.crs == "EPSG:28992"
    surface, trees = scene.parts
    assert [(one.name, one.kind) for one in scene.parts] == [
        ("town", "Raster"), ("town trees", "Canopy")
    ]  # fmt: skip
    assert (surface.bounds + scene.origin)[:, 2] == pytest.approx([1, 7])
    # Crowns begin at a quarter of 9 m above the ground of 1 m, which later returns found.
    assert (trees.bounds + scene.origin)[:, 2] == pytest.approx([1 + 9 / 4, 10])
    assert (trees.bounds + scene.origin)[0, 0] == pytest.approx(X + 14, abs=1.01)
    said = " ".join(scene.notes)
    assert "cells of 1 m, from 1,600 first returns" in said
    assert "noise or withheld: 1" in said


def test_without_classes_there_is_one_surface(tmp_path):
    x, y = grid()
    z = np.where(x < X + 5, 7.0, 1.0)
    scene = umbra.read(save(tmp_path / "plain.las", x, y, z, np.zeros(len(x)), epsg=None))
    assert [part.kind for part in scene.parts] == ["Raster"]
    assert scene.sources[0].format == "LAS"
    said = " ".join(scene.notes)
    assert "no classes, so trees are part of the surface" in said
    assert "no CRS is named" in said


def test_small_gaps_are_filled_and_large_ones_left(tmp_path):
    x, y = grid(per=3)
    gap = (np.abs(x - X - 5) < 1) & (np.abs(y - Y - 5) < 1)
    pool = (np.abs(x - X - 14) < 4) & (np.abs(y - Y - 14) < 4)
    keep = ~gap & ~pool
    scene = umbra.read(
        save(tmp_path / "gap.laz", x[keep], y[keep], np.ones(keep.sum()), np.full(keep.sum(), 2))
    )
    (part,) = scene.parts
    corners = part.mesh.vertices[part.mesh.faces]
    middle = corners.mean(1)[:, :2] + scene.origin[:2]
    assert np.abs(middle - [X + 5, Y + 5]).max(1).min() < 0.5
    assert np.abs(middle - [X + 14, Y + 14]).max(1).min() > 1
    assert any("filled from their neighbours" in note for note in scene.notes)


def test_of_a_box_only_its_points_are_read(town):
    scene = umbra.read(town, bbox=(X + 8, Y, X + 12, Y + 20))
    assert [part.kind for part in scene.parts] == ["Raster"]
    assert scene.bounds()[1, 0] <= X + 13
    with pytest.raises(InputError, match="no point inside bbox="):
        umbra.read(town, bbox=(X + 800, Y, X + 900, Y + 20))


def test_damage_and_degrees_are_named(town, tmp_path):
    data = town.read_bytes()
    (tmp_path / "cut.laz").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="damaged point cloud"):
        umbra.read(tmp_path / "cut.laz")
    x, y = grid()
    path = save(tmp_path / "deg.laz", x, y, x * 0, np.full(len(x), 2), epsg=4326)
    with pytest.raises(InputError, match="in degrees"):
        umbra.read(path)
