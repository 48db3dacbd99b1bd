"""Several files in one scene: their names, their CRSs, and where they stand."""

import json
import re

import numpy as np
import pytest
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra import InputError
from umbra.readers import terrain

SQUARE = [(0, 0), (10, 0), (10, 10), (0, 10)]
OBJ = "v 0 0 0\nv {s} 0 0\nv 0 {s} 0\nv 0 0 {s}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def obj(tmp_path):
    def write(name, size=2):
        path = tmp_path / name
        path.write_text(OBJ.format(s=size))
        return path

    return write


@pytest.fixture
def houses(tmp_path):
    """Footprints of 10 x 10 m, 5 m high, at places in a CRS."""

    def write(name, crs, *places, height=5.0):
        features = [
            {
                "type": "Feature",
                "id": f"{name.partition('.')[0]} {number}",
                "properties": {"height": height},
                "geometry": {
                    "type": "Polygon",
                    "coordinates": [[[x + a, y + b] for a, b in (*SQUARE, SQUARE[0])]],
                },
            }
            for number, (x, y) in enumerate(places)
        ]
        document = {"type": "FeatureCollection", "features": features}
        document["crs"] = {"type": "name", "properties": {"name": crs}}
        path = tmp_path / name
        path.write_text(json.dumps(document))
        return path

    return write


def test_one_file_makes_no_layer_unless_it_is_named(obj):
    path = obj("a.obj")
    assert umbra.read(path).parts[0].layer == ""
    assert umbra.read(f"new={path}").parts[0].layer == "new"


def test_layers_are_chosen_by_name(obj):
    scene = umbra.read(f"existing={obj('a.obj')}", f"proposed={obj('b.obj', 3)}", obj("c.city.obj"))
    assert [part.layer for part in scene.parts] == ["existing", "proposed", "c"]
    assert scene.select(["existing"]) == [0]
    assert scene.select([], ["prop*"]) == [0, 2]
    with pytest.raises(InputError, match="the file has c, existing, proposed"):
        scene.select(["propsed"])


def test_things_of_one_name_in_two_layers_are_two(obj):
    one = obj("a.obj")
    scene = umbra.read(f"x={one}", f"y={one}")
    assert [part.name for part in scene.parts] == ["a", "a"]
    assert scene.groups().tolist() == [0, 1]


def test_things_of_one_name_in_two_files_of_a_layer_are_two(obj):
    first, second = obj("a.obj"), obj("b.obj", 3)
    for path in (first, second):
        path.write_text("o house\n" + path.read_text())
    scene = umbra.read(f"town={first}", f"town={second}")
    assert [(part.layer, part.name) for part in scene.parts] == [
        ("town", "house"),
        ("town", "house (2)"),
    ]
    assert scene.select(["house"]) == [0, 1]
    assert "b.obj: names that another file of layer 'town' has, numbered: 1" in scene.notes


def test_a_file_whose_name_has_an_equals_sign_is_a_file(obj, monkeypatch):
    path = obj("a=b.obj")
    monkeypatch.chdir(path.parent)
    assert umbra.read("a=b.obj").parts[0].layer == ""
    assert umbra.read(path).parts[0].layer == ""
    with pytest.raises(InputError, match=r"c\.obj: no such file"):
        umbra.read("new=c.obj")
    with pytest.raises(InputError, match="the name of a file is empty"):
        umbra.read("")
    with pytest.raises(InputError, match="names a layer without a file"):
        umbra.read("new=")


def test_later_files_are_brought_to_the_first_ones_crs(houses):
    first = houses("a.geojson", "EPSG:31256", (2500, 340500))
    # The same corner in UTM 33 north.
    from pyproj import Transformer  # noqa: PLC0415

    there = Transformer.from_crs("EPSG:31256", "EPSG:32633", always_xy=True)
    x, y = there.transform(2520, 340500)
    scene = umbra.read(first, houses("b.geojson", "EPSG:32633", (x, y)))
    assert scene.crs == "EPSG:31256"
    soup = scene.triangles([1])
    low = soup.vertices[soup.faces].min((0, 1)) + scene.origin
    # The grids are turned against each other by 1°: 0.2 m over a house.
    np.testing.assert_allclose(low, [2520, 340500, 0], atol=0.3)
    assert "b.geojson: coordinates were converted from EPSG:32633 to EPSG:31256" in scene.notes


def test_crs_that_differ_in_height_only_are_one(houses):
    first = houses("a.geojson", "EPSG:28992", (85000, 447000))
    scene = umbra.read(first, houses("b.geojson", "EPSG:7415", (85020, 447000)))
    assert not any("converted" in note for note in scene.notes)


def test_an_unknown_crs_beside_a_known_one_is_refused_by_name(houses):
    first = houses("a.geojson", "EPSG:31256", (2500, 340500))
    with pytest.raises(InputError, match=r"a\.geojson is in EPSG:31256 but .*b\.geojson is in my"):
        umbra.read(first, houses("b.geojson", "my own grid", (2500, 340500)))


@pytest.mark.parametrize(
    ("base", "said"),
    [
        (196.0, "is sunk in the terrain 't': half of 3 buildings begin 4.0 m"),
        (198.0, ""),  # a cellar
        (200.5, ""),
        (203.5, "floats over the terrain 't': half of 3 buildings are 3.5 m"),
    ],
)
def test_a_block_over_or_under_the_terrain_is_said(tmp_path, base, said):
    rasterio = pytest.importorskip("rasterio")
    with rasterio.open(
        tmp_path / "t.tif", "w", driver="GTiff", height=40, width=80, count=1, dtype="float64",
        crs="EPSG:31256", transform=rasterio.transform.from_origin(2500, 340540, 1, 1),
    ) as file:  # fmt: skip
        file.write(np.full((40, 80), 200.0), 1)
    lines = []
    # The last stands on the first, as an upper floor does.
    for k, (x, z) in enumerate([(0, 0), (20, 0), (40, 0), (0, 6)]):
        corners = [(0, 0, 0), (8, 0, 0), (0, 8, 0), (0, 0, 6)]
        lines += [f"o {k}"]
        lines += [f"v {2510 + x + a} {340510 + b} {base + z + c}" for a, b, c in corners]
        lines += [f"f {4 * k + a} {4 * k + b} {4 * k + c}"
                  for a, b, c in ((1, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4))]  # fmt: skip
    (tmp_path / "b.obj").write_text("\n".join(lines))
    scene = umbra.read(tmp_path / "t.tif", tmp_path / "b.obj")
    heights = [note for note in scene.notes if "terrain" in note]
    assert len(heights) == bool(said)
    assert all(re.search(f"layer 'b' {said}", note) for note in heights)


@pytest.fixture
def slope(tmp_path):
    """A CityJSON file with a terrain of two triangles, 20 m up in 200 m, and a shed on it."""
    corners = [[0, 0, 100], [200, 0, 120], [200, 200, 120], [0, 200, 100]]
    shed = [[150, 150, 115], [155, 150, 115], [150, 155, 115], [150, 150, 119]]
    geometry = {"type": "CompositeSurface", "lod": "1", "boundaries": [[[0, 1, 2]], [[0, 2, 3]]]}
    walls = [[[4, 6, 5]], [[4, 5, 7]], [[5, 6, 7]], [[6, 4, 7]]]
    path = tmp_path / "land.city.json"
    path.write_text(json.dumps({
        "type": "CityJSON", "version": "2.0", "vertices": corners + shed,
        "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]},
        "CityObjects": {
            "land": {"type": "TINRelief", "geometry": [geometry]},
            "shed": {"type": "Building",
                     "geometry": [{"type": "MultiSurface", "lod": "1", "boundaries": walls}]},
        },
    }))  # fmt: skip
    return path


@pytest.mark.parametrize(("over", "said"), [(30.0, "floats"), (0.0, ""), (-8.0, "is sunk")])
@pytest.mark.parametrize("is_first", [True, False])
def test_blocks_over_or_under_a_terrain_among_other_parts_are_said(
    tmp_path, slope, over, said, is_first
):
    # Far from the terrain's corners, each on the slope's height below its middle.
    blocks = {
        f"block {x}": box((x, y, 100 + (x + 2) / 10 + over), (x + 4, y + 4, 140 + over))
        for x, y in ((40, 90), (90, 40), (100, 110), (120, 60), (160, 100))
    }
    path = save_obj(tmp_path / "blocks.obj", blocks)
    scene = umbra.read(*((slope, path) if is_first else (path, slope)))
    found = [note for note in scene.notes if "terrain" in note]
    assert len(found) == bool(said)
    assert all(f"layer 'blocks' {said}" in one and "of 5 buildings" in one for one in found)


def test_footprints_that_no_terrain_lifts_are_said_to_lie_under_it(houses, slope):
    path = houses("plans.geojson", "EPSG:31256", (50, 90), (90, 50))
    (note,) = [one for one in umbra.read(slope, path).notes if "is sunk" in one]
    assert "of 2 buildings" in note


def test_layers_that_stand_in_one_place_are_said(houses):
    places = [(2500 + 30 * i, 340500) for i in range(4)]
    old = houses("a.geojson", "EPSG:31256", *places)
    new = houses("b.geojson", "EPSG:31256", (2530.5, 340500), (2800, 340500))
    scene = umbra.read(f"old={old}", f"new={new}")
    (note,) = [note for note in scene.notes if "overlap" in note]
    assert "1 of 2 objects of 'new'" in note
    assert "(first: 'b 0' and 'a 1')" in note


def test_footprints_stand_on_the_terrain_of_another_file(houses, tmp_path):
    rasterio = pytest.importorskip("rasterio")
    # A slope of 1 m in 1 m to the east, cells of 1 m.
    heights = np.tile(np.arange(40.0) + 0.5, (40, 1)) + 200
    path = tmp_path / "t.tif"
    with rasterio.open(
        path, "w", driver="GTiff", height=40, width=40, count=1, dtype="float64", crs="EPSG:31256",
        transform=rasterio.transform.from_origin(2500, 340540, 1, 1),
    ) as file:  # fmt: skip
        file.write(heights, 1)
    scene = umbra.read(houses("a.geojson", "EPSG:31256", (2510.2, 340510), (2600, 340510)), path)
    soup = scene.triangles()
    z = soup.vertices[soup.faces][..., 2] + scene.origin[2]
    first, second = (z[soup.part == part] for part in (0, 1))
    assert (first.min(), first.max()) == (210.5, 215.5)
    assert second.min() == 239.5  # beside the terrain: its edge
    assert any("set on the terrain" in n and "1 part lies beside it" in n for n in scene.notes)
    # A second raster is no terrain, but trees.
    trees = tmp_path / "trees.tif"
    with rasterio.open(
        trees, "w", driver="GTiff", height=40, width=40, count=1, dtype="float64",
        crs="EPSG:31256", transform=rasterio.transform.from_origin(2500, 340540, 1, 1),
    ) as file:  # fmt: skip
        file.write(heights - 50, 1)
    again = umbra.read(houses("a.geojson", "EPSG:31256", (2510.2, 340510)), path, trees)
    soup = again.triangles([0])
    assert soup.vertices[soup.faces][..., 2].min() + again.origin[2] == 210.5
    # A base in the file is a base.
    based = houses("c.geojson", "EPSG:31256", (2510, 340510))
    based.write_text(based.read_text().replace('"height"', '"base": 7, "height"'))
    scene = umbra.read(based, path, base_column="base")
    assert scene.bounds()[0, 2] == 7


def test_sites_of_two_files(tmp_path):
    pytest.importorskip("ifcopenshell")
    from support.ifc_files import IfcFile  # noqa: PLC0415

    paths = []
    for name, latitude in (("a.ifc", 48), ("b.ifc", 48), ("c.ifc", 52)):
        model = IfcFile(true_north=(0.0, 1.0) if name == "a.ifc" else (0.1, 1.0))
        model.site("site", (latitude, 0, 30), (16, 0, 0))
        model.box("IfcWall", "wall", (1, 1, 1))
        paths.append(model.write(tmp_path / name))
    scene = umbra.read(*paths[:2])
    assert scene.latitude == pytest.approx(48 + 30 / 3600)
    assert scene.true_north == 0
    assert "5.71° in b.ifc" in " ".join(scene.notes)
    scene = umbra.read(paths[0], paths[2])
    assert scene.latitude is None
    assert "the files' sites disagree by up to 445 km (a.ifc at 48.0083°" in " ".join(scene.notes)
    assert any(scene.site_doubt in note for note in scene.notes)


def test_boxes_that_are_nearly_one_are_found_as_by_comparing_all():
    rng = np.random.default_rng(5)
    low = rng.uniform(-50, 50, (400, 3))
    a = np.stack([low, low + rng.choice([0, 0.5, 3, 12, 40], (400, 3))], 1)
    a[0] = [[-100, -100, -1], [100, 100, 0]]  # the ground, as wide as all
    b = a[::-1] + rng.choice([0, 0.01, 1, 6], (400, 1, 1)) * [1, -1, 0.5]
    thick = [np.stack([box[:, 0], np.maximum(box[:, 1], box[:, 0] + 0.01)], 1) for box in (a, b)]
    every = np.stack(np.meshgrid(np.arange(400), np.arange(400)), -1).reshape(-1, 2)
    same = terrain._share_most(thick[0][every[:, 0]], thick[1][every[:, 1]])
    assert 50 < same.sum() < 1000
    np.testing.assert_array_equal(terrain._find_same(a, b), every[same])
