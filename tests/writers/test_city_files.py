"""Files of a study in tiles: GeoTIFFs and their VRT, map, STAC item; a tile missing."""

import json

import numpy as np
import pytest
from PIL import Image
from support.shapes import box, merge

import umbra

zarr = pytest.importorskip("zarr")
from umbra.tiles.sealed import write_sealed  # noqa: E402
from umbra.writers.city import write_city_files  # noqa: E402
from umbra.writers.city.overview import shrink_hours  # noqa: E402
from umbra.writers.city.store_window import CityResult  # noqa: E402
from umbra.writers.vectors.gis_files import write_geotiff  # noqa: E402

SIDE = 40
MISSING = 4
X0, Y0 = 691_000.0, 5_335_000.0


@pytest.fixture(scope="module")
def study():
    houses = [box((9.0 * i, 8.0 * j, 0), (9.0 * i + 5, 8.0 * j + 4, 4 + i + j))
              for i in range(10) for j in range(8)]  # fmt: skip
    vertices, faces = merge(*houses)
    scene = umbra.Scene.from_arrays(vertices + [X0, Y0, 500], faces, crs="EPSG:25832")
    return umbra.shadow_study(
        scene, umbra.find_site(scene, 48.14, 11.57), date="2026-01-15", every="1h",
        receivers="top", ground=500.0,
        extent=(X0 - 5.0, Y0 - 3, X0 + 97, Y0 + 77), cell=1.0,
    )  # fmt: skip


@pytest.fixture
def folder(study, tmp_path):
    """Write a study's variables as the store of one in tiles, without one of nine tiles."""
    group = zarr.create_group(str(tmp_path / "study.zarr"), zarr_format=3)
    data = study.dataset
    group.attrs.update({k: v for k, v in data.attrs.items() if isinstance(v, (str, int, float))})
    for name in ("x", "y", "time", "shadow_hours", "sun_hours", "receiver_z"):
        array, units = data[name].values, str(data[name].attrs.get("units", "1"))
        if array.dtype.kind == "M":
            array = array.astype("datetime64[us]").astype(np.int64)
            units = "microseconds since 1970-01-01 00:00:00"
        made = group.create_array(
            name, shape=array.shape, chunks=tuple(min(n, SIDE) for n in array.shape),
            dtype=array.dtype, dimension_names=data[name].dims, attributes={"units": units},
            fill_value=np.nan if array.dtype.kind == "f" else 0,
        )  # fmt: skip
        made[...] = array
    rows, cols = data.shadow_hours.shape
    assert (rows, cols) == (80, 102)
    hole = slice(SIDE, 2 * SIDE), slice(SIDE, 2 * SIDE)
    for name in ("shadow_hours", "sun_hours"):
        group[name][hole] = np.nan
    (tmp_path / "tiles").mkdir()
    for number in range(6):
        if number != MISSING:
            (tmp_path / "tiles" / f"{number:06}.json").write_text("{}")
    return tmp_path


def read_hours(study):
    hours = study.shadow_hours.values.copy()
    hours[SIDE : 2 * SIDE, SIDE : 2 * SIDE] = np.nan
    return hours


def test_the_vrt_holds_every_cell_in_its_place(study, folder):
    rasterio = pytest.importorskip("rasterio")
    virtual, *tiles = write_city_files(folder, ["geotiff"])
    assert (virtual.name, len(tiles)) == ("hours.vrt", 5)
    with rasterio.open(virtual) as raster:
        assert raster.descriptions == ("shadow_hours", "sun_hours")
        assert raster.crs.to_epsg() == 25832
        assert tuple(raster.bounds) == (X0 - 5, Y0 - 3, X0 + 97, Y0 + 77)
        np.testing.assert_array_equal(raster.read(1)[::-1], read_hours(study))
        place = X0 + 20.5, Y0 + 10.5
        (value,) = next(iter(raster.sample([place], 1)))
    told = study.shadow_hours.sel(x=place[0], y=place[1], method="nearest")
    assert value == told
    with rasterio.open(tiles[0]) as raster:
        assert raster.profile["tiled"]
        assert raster.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"


def test_large_tiles_have_overviews(study, folder):
    rasterio = pytest.importorskip("rasterio")
    axis = np.arange(1024.0)
    band = np.ones((1024, 1024), np.float32)
    write_geotiff(folder / "big.tif", axis, axis, [("a", "h", band)], cell=(1, 1))
    with rasterio.open(folder / "big.tif") as raster:
        assert raster.overviews(1) == [2, 4]


def test_only_tiles_counted_since_are_written_again(folder):
    pytest.importorskip("rasterio")
    _, *tiles = write_city_files(folder, ["geotiff"])
    before = [path.stat().st_mtime_ns for path in tiles]
    mark = folder / "tiles" / "000002.json"
    write_sealed(mark, {"study": "the same", "files_checksum": "of other results"})
    write_city_files(folder, ["geotiff"])
    after = [path.stat().st_mtime_ns for path in tiles]
    assert [a != b for a, b in zip(before, after)] == [False, False, True, False, False]


@pytest.mark.parametrize("longest", [1600, 25, 7])
def test_the_map_shows_means_of_all_tiles_and_hatches_the_missing(
    study, folder, longest, monkeypatch
):
    monkeypatch.setattr("umbra.writers.city.overview.LONGEST", longest)
    hours, times, _ = shrink_hours(CityResult(folder))
    whole = read_hours(study)
    rows, cols = whole.shape
    assert hours.shape == (-(-rows // times), -(-cols // times))
    for i, j in np.ndindex(hours.shape):
        square = whole[i * times : (i + 1) * times, j * times : (j + 1) * times]
        if np.isnan(square).all():
            assert np.isnan(hours[i, j])
        else:
            assert hours[i, j] == pytest.approx(np.nanmean(square), abs=1e-5)
    (path,) = write_city_files(folder, ["map"])
    assert Image.open(path).size[0] > 800


def test_the_stac_item_is_valid(study, folder):
    (path,) = write_city_files(folder, ["stac"])
    item = json.loads(path.read_text())
    assert (item["stac_version"], item["type"]) == ("1.1.0", "Feature")
    properties = item["properties"]
    assert properties["umbra:tiles_done"] == 5
    assert properties["start_datetime"] == "2026-01-15T08:30:00Z"
    west, south, east, north = item["bbox"]
    assert 11.5 < west < east < 11.6
    assert 48.1 < south < north < 48.2
    assert list(item["assets"]) == ["study"]
    pystac = pytest.importorskip("pystac")
    read = pystac.Item.from_dict(item)
    assert read.assets["study"].roles == ["data"]
    assert read.to_dict()["properties"] == properties
    assert read.geometry["coordinates"][0][0] == read.geometry["coordinates"][0][-1]


def test_another_folder_is_refused(tmp_path):
    with pytest.raises(umbra.InputError, match="holds no study in tiles"):
        write_city_files(tmp_path)
    with pytest.raises(umbra.InputError, match="'png' is not made of a study in tiles"):
        write_city_files(tmp_path, ["png"])
