"""GeoParquet: Overture's columns, WKB and GeoArrow, CRS, and row groups that a box spares."""

import json
import sys

import numpy as np
import pytest

import umbra
from umbra import InputError

pa = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
shapely = pytest.importorskip("shapely", reason="shapely is not installed")

from pyarrow import parquet as pq  # noqa: E402 - after the skip

X, Y = 500_000.0, 5_400_000.0


def make_table(count=4, encoding="WKB", *, boxes=True, crs=None, **columns):
    """Squares of 5 m, 10 m apart; the CRS is UTM unless it is said."""
    low = np.column_stack([X + 10.0 * np.arange(count), np.full(count, Y)])
    shapes = shapely.box(*low.T, *(low + 5).T)
    facts = {"encoding": encoding, "geometry_types": ["Polygon"]}
    facts["crs"] = {"id": {"authority": "EPSG", "code": 25832}} if crs is None else crs
    if encoding == "WKB":
        geometry = pa.array(shapely.to_wkb(shapes))
    else:
        points = np.concatenate([shapely.get_coordinates(shape) for shape in shapes])
        pairs = pa.StructArray.from_arrays(
            [pa.array(points[:, 0]), pa.array(points[:, 1])], ["x", "y"]
        )
        rings = pa.ListArray.from_arrays(pa.array(5 * np.arange(count + 1), pa.int32()), pairs)
        geometry = pa.ListArray.from_arrays(pa.array(np.arange(count + 1), pa.int32()), rings)
    data = {"id": [f"house {n}" for n in range(count)], "geometry": geometry, **columns}
    if boxes:
        sides = np.float32(np.column_stack([low - 1, low + 6])).T
        data["bbox"] = pa.StructArray.from_arrays(
            [pa.array(side) for side in sides], ["xmin", "ymin", "xmax", "ymax"]
        )
    geo = {"version": "1.1.0", "primary_column": "geometry", "columns": {"geometry": facts}}
    return pa.table(data).replace_schema_metadata({"geo": json.dumps(geo)})


@pytest.fixture
def read(tmp_path):
    def write_and_read(table, rows=2, **options):
        path = tmp_path / "city.parquet"
        pq.write_table(table, path, row_group_size=rows)
        return umbra.read(path, **options)

    return write_and_read


@pytest.mark.parametrize("encoding", ["WKB", "polygon"])
def test_footprints_are_prisms_with_names_heights_and_crs(read, encoding):
    scene = read(make_table(encoding=encoding, height=[3.0, 4.0, 5.0, 6.0]))
    assert scene.sources[0].format == "GeoParquet"
    assert scene.crs == "EPSG:25832"
    assert [part.name for part in scene.parts] == [f"house {n}" for n in range(4)]
    assert [float(part.bounds[1, 2]) for part in scene.parts] == [3, 4, 5, 6]
    np.testing.assert_allclose(scene.bounds(), [[X, Y, 0], [X + 35, Y + 5, 6]])


def test_overtures_columns_are_known(read):
    names = [{"primary": word} for word in ("A", "B", "C", "D")]
    scene = read(
        make_table(
            height=[9.0, None, 8.0, None], num_floors=[1, 4, None, None],
            min_height=[2.0, None, None, None], is_underground=[False, False, True, False],
            names=names,
        )
    )  # fmt: skip
    assert [part.name for part in scene.parts] == ["A", "B"]
    heights = {part.name: part.bounds[:, 2].tolist() for part in scene.parts}
    assert heights == {"A": [2, 9], "B": [0, 12]}
    said = " ".join(scene.notes)
    assert "underground left out: 1" in said
    assert "from num_floors, 3 m each: 1" in said
    assert "without a height in 'height' left out: 1 (first: 'D')" in said


def test_a_box_reads_only_row_groups_that_meet_it(read, monkeypatch):
    table = make_table(8, height=[5.0] * 8)
    groups = []
    plain = pq.ParquetFile.iter_batches

    def note(self, *words, row_groups, **rest):
        groups.extend(row_groups)
        return plain(self, *words, row_groups=row_groups, **rest)

    monkeypatch.setattr(pq.ParquetFile, "iter_batches", note)
    monkeypatch.setattr(sys, "executable", "")  # reads here, without a child
    scene = read(table, bbox=(X + 41, Y, X + 52, Y + 1))
    assert [part.name for part in scene.parts] == ["house 4", "house 5"]
    assert set(groups) == {2}
    assert "left out: 6" in " ".join(scene.notes)
    again = read(make_table(8, boxes=False, height=[5.0] * 8), bbox=(X + 41, Y, X + 52, Y + 1))
    assert [part.name for part in again.parts] == ["house 4", "house 5"]


def test_degrees_are_what_is_meant_if_no_crs_is_named(tmp_path):
    shape = shapely.to_wkb(shapely.box(11.5, 48.1, 11.5001, 48.1001))
    path = tmp_path / "one.parquet"
    pq.write_table(pa.table({"geometry": [shape], "height": [7.0]}), path)
    scene = umbra.read(path)
    assert scene.crs == "EPSG:32632"
    assert scene.latitude == pytest.approx(48.1, abs=1e-3)


def test_what_is_no_geoparquet_is_named(read, tmp_path):
    with pytest.raises(InputError, match="Parquet without a geometry"):
        read(pa.table({"height": [1.0]}))
    table = make_table(height=[1.0] * 4)
    geo = json.loads(table.schema.metadata[b"geo"])
    geo["columns"]["geometry"]["encoding"] = "linestring"
    lines = table.replace_schema_metadata({"geo": json.dumps(geo)})
    with pytest.raises(InputError, match="encoded as linestring"):
        read(lines)
    path = tmp_path / "cut.parquet"
    path.write_bytes(b"PAR1" + bytes(60))
    with pytest.raises(InputError, match="cannot be read as GeoParquet"):
        umbra.read(path)
