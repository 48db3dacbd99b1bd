"""A box or a polygon: which objects meet it, in which CRS, and that none is cut."""

import json

import numpy as np
import pytest
from pyproj import Transformer
from support.model_files import save_city, save_obj
from support.shapes import box, moved

import umbra
from umbra import InputError
from umbra.readers.region import make_region

X, Y = 85_000.0, 447_000.0
HOUSES = {
    f"house {row} {col}": moved(box((0, 0, 0), (6, 4, 5)), (X + 10 * col, Y + 10 * row, 0))
    for row in range(4)
    for col in range(5)
}
TO_DEGREES = Transformer.from_crs("EPSG:28992", "OGC:CRS84", always_xy=True)


@pytest.fixture
def city(tmp_path):
    return save_city(tmp_path / "town.city.json", HOUSES, crs="EPSG:28992")


def names(scene):
    return sorted({part.name for part in scene.parts})


def test_objects_that_meet_a_box_are_kept_whole(city):
    scene = umbra.read(city, bbox=(X + 16, Y + 4, X + 21, Y + 10))
    assert names(scene) == [f"house {row} {col}" for row in (0, 1) for col in (1, 2)]
    np.testing.assert_allclose(scene.bounds()[:, :2], [[X + 10, Y], [X + 26, Y + 14]])
    assert any(
        "objects outside bbox=" in n and "EPSG:28992) left out: 16" in n for n in scene.notes
    )


@pytest.mark.parametrize("says", [False, True])
def test_a_box_may_be_in_degrees(city, says):
    metres = (X + 17, Y + 11, X + 23, Y + 13)
    degrees = TO_DEGREES.transform_bounds(*metres)
    given = ",".join(map(repr, degrees)) + (",EPSG:4326" if says else "")
    assert names(umbra.read(city, bbox=given)) == ["house 1 2"]


def test_a_polygon_keeps_what_its_box_would_but_it_does_not_meet(city, tmp_path):
    pytest.importorskip("shapely", reason="shapely is not installed")
    corners = [(X - 1, Y - 1), (X + 49, Y - 1), (X - 1, Y + 39)]
    text = ", ".join(f"{x} {y}" for x, y in [*corners, corners[0]])
    inside = {
        name
        for name, mesh in HOUSES.items()
        for x, y in [np.min(mesh[0], axis=0)[:2]]
        if (x - X + 1) / 50 + (y - Y + 1) / 40 <= 1
    }
    assert 5 < len(inside) < 15
    for area in (f"POLYGON (({text}))", f"SRID=28992;POLYGON (({text}))"):
        assert set(names(umbra.read(city, area=area))) == inside
    x, y = TO_DEGREES.transform(*zip(*corners, corners[0], strict=True))
    ring = [list(point) for point in zip(x, y, strict=True)]
    path = tmp_path / "area.geojson"
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    assert set(names(umbra.read(city, area=path))) == inside


def test_all_files_are_filtered_in_the_first_ones_crs(city, tmp_path):
    other = save_obj(
        tmp_path / "more.obj",
        {
            "mast": moved(box((0, 0, 0), (1, 1, 9)), (X, Y, 0)),
            "far": moved(box((0, 0, 0), (1, 1, 9)), (X + 900, Y, 0)),
        },
    )
    scene = umbra.read(city, other, bbox=(X, Y, X + 3, Y + 3))
    assert names(scene) == ["house 0 0", "mast"]
    assert len([note for note in scene.notes if "outside bbox=" in note]) == 2


def test_a_file_without_an_object_inside_is_dropped_and_all_of_them_are_an_error(city, tmp_path):
    far = save_obj(tmp_path / "far.obj", {"far": moved(box((0, 0, 0), (1, 1, 9)), (X + 900, Y, 0))})
    scene = umbra.read(city, far, bbox=(X, Y, X + 3, Y + 3))
    assert names(scene) == ["house 0 0"]
    assert any("far.obj" in note and "left out: 1" in note for note in scene.notes)
    with pytest.raises(InputError, match=r"no object meets bbox=.*left out: 20") as caught:
        umbra.read(city, bbox=(X + 500, Y, X + 501, Y + 1))
    assert caught.value.data["option"] == "bbox"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"bbox": "1,2,3"}, "bbox= is XMIN"),
        ({"bbox": (3, 0, 1, 2)}, "the least first"),
        ({"bbox": (0, 0, float("nan"), 2)}, "the least first"),
        ({"bbox": "0,0,1,1,EPSG:1"}, "not known: EPSG:1"),
        ({"area": "POLYGON ((0 0, 1"}, "not WKT"),
        ({"area": "POLYGON EMPTY"}, "no polygon"),
        ({"area": "SRID=1;POLYGON ((0 0, 1 0, 1 1, 0 0))"}, "not known: EPSG:1"),
        ({"area": "nowhere.geojson"}, "neither WKT nor readable GeoJSON"),
        ({"area": "POLYGON ((0 0, 1 0, 1 1, 0 0))", "bbox": (0, 0, 1, 1)}, "both given"),
    ],
)
def test_what_is_no_region_is_named(given, said):
    pytest.importorskip("shapely", reason="shapely is not installed")
    with pytest.raises(InputError, match=said) as caught:
        make_region(given.get("bbox"), given.get("area"))
    assert caught.value.data["option"] in given


def test_metres_for_a_file_in_degrees_are_refused(tmp_path):
    ring = [[4.36, 52.0], [4.361, 52.0], [4.361, 52.001], [4.36, 52.0]]
    feature = {
        "type": "Feature",
        "properties": {"height": 5},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    path = tmp_path / "one.geojson"
    path.write_text(json.dumps(feature))
    assert umbra.read(path, bbox=(4.3605, 52, 4.4, 52.1)).parts
    with pytest.raises(InputError, match="not in degrees, as the file is"):
        umbra.read(path, bbox=(X, Y, X + 5, Y + 5))
    assert umbra.read(
        path,
        bbox=(
            *Transformer.from_crs("OGC:CRS84", "EPSG:28992", always_xy=True).transform_bounds(
                4.36, 52, 4.361, 52.001
            ),
            "EPSG:28992",
        ),
    ).parts
