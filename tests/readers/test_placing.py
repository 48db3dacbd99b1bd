"""Layers in their place: by the caller, or by the site that a file states."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import umbra
from umbra import InputError
from umbra.cli.main import umbra as command
from umbra.readers.placing import Placing, move_parts_by, place_parts

CRS = "EPSG:31256"
X, Y, GROUND = 2500.0, 340500.0, 12.0
HERE = (48.20290, 16.36577)  # of X, Y [degrees]


def make_box(low, high):
    """Return the corners (8, 3) and the six quads of a box, wound outward."""
    (a, b, c), (d, e, f) = low, high
    corners = [
        (a, b, c),
        (d, b, c),
        (d, e, c),
        (a, e, c),
        (a, b, f),
        (d, b, f),
        (d, e, f),
        (a, e, f),
    ]
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return corners, quads


@pytest.fixture
def city(tmp_path):
    """A CityJSON city with a CRS: a building on 12 m, 20 m wide."""

    def write(crs=CRS, kind="Building", name="city.city.json"):
        corners, quads = make_box((X, Y, GROUND), (X + 20, Y + 20, GROUND + 9))
        solid = {"type": "Solid", "lod": "1", "boundaries": [[[list(quad)] for quad in quads]]}
        document = {
            "type": "CityJSON", "version": "1.1", "vertices": [list(map(int, c)) for c in corners],
            "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]},
            "CityObjects": {"tower": {"type": kind, "geometry": [solid]}},
        }  # fmt: skip
        if crs:
            code = crs.split(":")[1]
            system = f"https://www.opengis.net/def/crs/EPSG/0/{code}"
            document["metadata"] = {"referenceSystem": system}
        path = tmp_path / name
        path.write_text(json.dumps(document))
        return path

    return write


@pytest.fixture
def box(tmp_path):
    """A box from (1, 2, -0.5) to (4, 8, 5) without a CRS: 3 m along x, 6 m along y."""
    corners, quads = make_box((1, 2, -0.5), (4, 8, 5))
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    lines += ["f " + " ".join(str(k + 1) for k in quad) for quad in quads]
    path = tmp_path / "box.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


def bounds_of(scene, layer="new"):
    boxes = [part.bounds + scene.origin for part in scene.parts if part.layer == layer]
    return np.array([np.min([b[0] for b in boxes], 0), np.max([b[1] for b in boxes], 0)])


@pytest.mark.parametrize(
    ("azimuth", "low", "high"),
    [
        (0, (1, 2), (4, 8)),
        (90, (2, -4), (8, -1)),  # y points east, x south
        (180, (-4, -8), (-1, -2)),
        (-90, (-8, 1), (-2, 4)),
    ],
)
def test_a_box_comes_to_its_place(city, box, azimuth, low, high):
    scene = umbra.read(city(), f"new={box}", place=f"new=2600,340600,30,{azimuth}")
    expected = [[2600 + low[0], 340600 + low[1], 29.5], [2600 + high[0], 340600 + high[1], 35]]
    np.testing.assert_allclose(bounds_of(scene), expected, atol=1e-6)
    assert scene.crs == CRS
    told = [note for note in scene.notes if note.startswith("layer 'new'")]
    assert len(told) == 1
    shown = ("2600.00", "340600.00", "30.00", f"{azimuth % 360:.2f}°", "place=")
    assert all(word in told[0] for word in shown)
    # The faces still look outward: the solid encloses its volume.
    (part,) = scene["new/box"].parts
    a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(3 * 6 * 5.5)


def test_without_a_height_it_stands_on_the_ground(city, box):
    scene = umbra.read(city(), f"new={box}", place=["new=2600,340600,,90"])
    np.testing.assert_allclose(bounds_of(scene)[:, 2], [12, 17.5], atol=1e-6)
    lifted = umbra.read(city(), f"new={box}", place=["new=2600,340600"], lift="new=50cm")
    np.testing.assert_allclose(bounds_of(lifted)[:, 2], [12.5, 18], atol=1e-6)
    moved = umbra.read(city(), f"new={box}", place="new=2600,340600,0", move="new=10,-2.5,1")
    np.testing.assert_allclose(bounds_of(moved)[0], [2611, 340599.5, 0.5], atol=1e-6)
    forced = umbra.read(city(), f"new={box}", place="new=2600,340600,90", lift="new=ground")
    np.testing.assert_allclose(bounds_of(forced)[:, 2], [12, 17.5], atol=1e-6)


def test_on_a_terrain_the_lowest_ground_below_it_counts(city, box, tmp_path):
    # A plane that rises eastward by 1 m in 10 m.
    land = json.loads(city(kind="TINRelief", name="land.city.json").read_text())
    west, south, east, north = int(X) - 100, int(Y) - 100, int(X) + 300, int(Y) + 300
    corners = [[west, south, 0], [east, south, 40], [east, north, 40], [west, north, 0]]
    land["vertices"] = corners
    surface = {"type": "CompositeSurface", "lod": "1", "boundaries": [[[0, 1, 2]], [[0, 2, 3]]]}
    land["CityObjects"]["tower"]["geometry"] = [surface]
    file = tmp_path / "land.city.json"
    file.write_text(json.dumps(land))
    scene = umbra.read(city(), file, f"new={box}", place="new=2600,340600")
    # Its west side is at x 2601, 201 m east of where the land is at 0.
    assert bounds_of(scene)[0, 2] == pytest.approx(20.1, abs=1e-6)


def test_latitude_and_longitude_are_those_of_pyproj(city, box):
    from pyproj import Transformer  # noqa: PLC0415

    there = Transformer.from_crs("EPSG:4326", CRS, always_xy=True).transform(HERE[1], HERE[0])
    scene = umbra.read(city(), f"new={box}", place=f"new={HERE[0]},{HERE[1]},12.5")
    np.testing.assert_allclose(bounds_of(scene)[0], [there[0] + 1, there[1] + 2, 12], atol=1e-6)
    # Without a CRS the same numbers are x and y.
    plain = umbra.read(city(crs=None), f"new={box}", place=f"new={X},{Y}")
    np.testing.assert_allclose(bounds_of(plain)[0], [X + 1, Y + 2, 12], atol=1e-6)


def test_a_scene_is_placed_in_python_and_placed_anew(city, box):
    scene = umbra.read(city(), f"new={box}", place="new=2600,340600,30,90")
    again = umbra.place(scene, "new", at=(2550, 340550, 1), azimuth=0)
    np.testing.assert_allclose(
        bounds_of(again), [[2551, 340552, 0.5], [2554, 340558, 6]], atol=1e-6
    )
    np.testing.assert_array_equal(bounds_of(again, "city"), bounds_of(scene, "city"))
    assert len(again.notes) == len(scene.notes) + 1
    turned = umbra.place(again, "new", at=(2550, 340550), azimuth=90)
    expected = [[2552, 340546, 12], [2558, 340549, 17.5]]
    np.testing.assert_allclose(bounds_of(turned), expected, atol=1e-6)
    assert turned.latitude == scene.latitude
    by_degrees = umbra.place(scene, "new", at=HERE)
    np.testing.assert_allclose(bounds_of(by_degrees)[0, :2], [X + 1, Y + 2], atol=20)


@pytest.mark.parametrize(
    ("more", "option"),
    [
        ({"place": "old=1,2"}, "place"),
        ({"place": "new=1"}, "place"),
        ({"place": "new=1,2,3,4,5"}, "place"),
        ({"place": "new=1,nan"}, "place"),
        ({"place": "2600,340600"}, "place"),
        ({"place": ["new=2600,340600", "new=2600,340601"]}, "place"),
        ({"lift": "new=high"}, "lift"),
        ({"lift": "new=1,2"}, "lift"),
        ({"move": "new=1"}, "move"),
        ({"move": "old=1,2"}, "move"),
    ],
)
def test_what_is_no_place_is_said(city, box, more, option):
    with pytest.raises(InputError) as caught:
        umbra.read(city(), f"new={box}", **more)
    assert caught.value.option == option
    assert "\n" not in str(caught.value)


def test_a_layer_alone_has_no_place(city, box):
    for files in ([f"new={box}"], [f"new={box}", f"new={city()}"]):
        with pytest.raises(InputError, match="alone") as caught:
            umbra.read(*files, place="new=1,2,3")
        assert caught.value.option == "place"
    scene = umbra.read(box)
    with pytest.raises(InputError):
        umbra.place(scene, "new", at=(1, 2, 3))
    with pytest.raises(InputError) as caught:
        umbra.place(umbra.read(city(), city(name="b.city.json")), "b", at=(1,))
    assert caught.value.option == "at"


def test_a_place_kilometres_away_names_where_the_others_are(city, box):
    with pytest.raises(InputError) as caught:
        umbra.read(city(), f"new={box}", place="new=2600,345600")
    assert caught.value.distance == pytest.approx(np.hypot(5082, 81))
    assert all(word in str(caught.value) for word in ("place='new=X,Y'", "2500", "340520"))


def test_a_file_in_another_world_names_the_option(city, box, tmp_path):
    with pytest.raises(InputError, match="place='new=X,Y'"):
        umbra.read(city(), f"new={box}")
    odd = json.loads(city(name="odd.city.json").read_text())
    odd["metadata"]["referenceSystem"] = "https://www.opengis.net/def/crs/EPSG/0/999999"
    (tmp_path / "odd.city.json").write_text(json.dumps(odd))
    with pytest.raises(InputError, match="place='LAYER=X,Y'"):
        umbra.read(city(), tmp_path / "odd.city.json")


@pytest.mark.parametrize("name", ["study", "render", "view", "inspect", "sky"])
def test_every_command_places_layers(name, city, box, tmp_path):
    more = {
        "study": ["--date", "2026-03-21", "--out", tmp_path / "out", "--no-pictures", "--cell", 5],
        "render": ["--out", tmp_path / "out.png", "--size", "32x32"],
        "view": ["--out", tmp_path / "out.html"],
        "inspect": [],
        "sky": ["--at", "2590,340590,13", "--out", tmp_path / "out"],
    }[name]
    words = [name, city(), f"new={box}", "--place", "new=2600,340600", *more]
    done = CliRunner().invoke(command, list(map(str, words)), obj=[])
    assert done.exit_code == 0, done.output
    assert "--place new=X,Y,Z,AZIMUTH" in done.output.replace("'", "")


def test_tiles_do_not_place_layers(city, box, tmp_path):
    words = ["study", city(), f"new={box}", "--place", "new=2600,340600", "--tiles", "1km"]
    words += ["--date", "2026-03-21", "--out", tmp_path / "out"]
    done = CliRunner().invoke(command, list(map(str, words)), obj=[])
    assert isinstance(done.exception, InputError)
    assert done.exception.option == "place"


def test_a_kept_scene_knows_its_place(city, box, tmp_path, monkeypatch):
    monkeypatch.setenv("UMBRA_CACHE", str(tmp_path / "kept"))
    monkeypatch.setattr("umbra.readers.kept.LEAST", 0)
    files = city(), f"new={box}"
    first, second = (umbra.read(*files, place="new=2600,340600,3", cache=True) for _ in range(2))
    other = umbra.read(*files, place="new=2610,340600,3", cache=True)
    assert bounds_of(other)[0, 0] == pytest.approx(2611)
    assert [one.frame for one in first.sources] == [one.frame for one in second.sources]
    for scene in (first, second):
        again = umbra.place(scene, "new", at=(2550, 340550, 1))
        np.testing.assert_allclose(bounds_of(again)[0], [2551, 340552, 0.5], atol=1e-6)


@pytest.fixture
def house(tmp_path):
    """An IFC box of 3 x 6 x 2 m at its origin, whose site is in the city."""
    pytest.importorskip("ifcopenshell")
    from support.ifc_files import IfcFile  # noqa: PLC0415 - ifcopenshell

    def write(conversion=False, north=None, latitude=(48, 12, 10), name="house.ifc"):
        model = IfcFile()
        model.site("site", latitude, (16, 21, 57))
        model.box("IfcWall", "wall", (3, 6, 2))
        if north is not None:
            model.context.TrueNorth = model.file.createIfcDirection(list(north))
        if conversion:
            model.map_conversion(CRS, X + 40, Y + 50, 14.0, along=0.0, across=1.0)
        return model.write(tmp_path / name)

    return write


def test_a_house_is_placed_by_its_site(city, house):
    from pyproj import Transformer  # noqa: PLC0415

    place = 16 + 21 / 60 + 57 / 3600, 48 + 12 / 60 + 10 / 3600
    there = np.array(Transformer.from_crs("EPSG:4326", CRS, always_xy=True).transform(*place))
    scene = umbra.read(city(), f"new={house()}")
    box = bounds_of(scene)
    np.testing.assert_allclose(box[0, :2], there, atol=0.01)  # the plan's north is 0.02° off
    np.testing.assert_allclose(box[:, 2], [12, 14], atol=1e-6)
    told = [note for note in scene.notes if "place='new=" in note]
    assert len(told) == 1
    assert "house.ifc" in told[0]
    # True north along its x axis: its y axis points west.
    turned = bounds_of(umbra.read(city(), f"new={house(north=(1.0, 0.0))}"))
    np.testing.assert_allclose(turned, [[*there - (6, 0), 12], [*there + (0, 3), 14]], atol=0.01)
    # What the caller says comes first.
    asked = bounds_of(umbra.read(city(), f"new={house()}", place="new=2600,340600,1"))
    np.testing.assert_allclose(asked[0], [2600, 340600, 1], atol=1e-6)


def test_a_house_is_placed_by_its_map_conversion_unless_asked(city, house):
    scene = umbra.read(city(), f"new={house(conversion=True)}")
    expected = [[X + 34, Y + 50, 14], [X + 40, Y + 53, 16]]
    np.testing.assert_allclose(bounds_of(scene), expected, atol=1e-6)
    asked = umbra.read(city(), f"new={house(conversion=True)}", place="new=2600,340600,1")
    np.testing.assert_allclose(bounds_of(asked)[0], [2600, 340600, 1], atol=1e-6)


def test_a_house_is_placed_beside_what_a_box_keeps(city, house):
    for files in ((city(), f"new={house()}"), (f"new={house()}", city())):
        scene = umbra.read(*files, bbox="16.36,48.2,16.37,48.21")
        np.testing.assert_allclose(bounds_of(scene)[:, 2], [12, 14], atol=1e-6)


def test_a_site_elsewhere_places_nothing(city, house):
    with pytest.raises(InputError) as caught:
        umbra.read(city(), f"new={house(latitude=(52, 30, 0))}")
    assert caught.value.site is None


def test_a_cellar_lies_below_the_ground_that_its_file_states(city, box):
    """A box from -0.5 to 5 m whose file states its ground at 0 m, at 1 m, or not."""
    around, own = umbra.read(city()), umbra.read(box)
    town = move_parts_by(around.parts, shift(around.origin))
    alone = move_parts_by(own.parts, shift(own.origin))
    for ground, low in ((0.0, GROUND - 0.5), (1.0, GROUND - 1.5), (None, GROUND), (9.0, GROUND)):
        placing = Placing("new", (X + 40, Y))
        placed = place_parts(alone, town, CRS, placing, own_ground=ground)
        assert placed.parts[0].bounds[0, 2] == pytest.approx(low)
        is_told = "of it below" in placed.note
        assert is_told == (low < GROUND)
        on_ground = replace(placing, lift="ground")
        lowest = place_parts(alone, town, CRS, on_ground, own_ground=ground)
        assert lowest.parts[0].bounds[0, 2] == pytest.approx(GROUND)


def shift(origin):
    matrix = np.eye(4)
    matrix[:3, 3] = origin
    return matrix


def read_end(note):
    """Return the origin's x, y, z and the azimuth of the y axis that a note ends with."""
    words = note.split("now its origin at ")[1]
    numbers = re.findall(r"-?\d+\.\d+", words)[:4]
    return np.array([float(number) for number in numbers])


@pytest.mark.parametrize(
    ("place", "move", "lift", "bottom"),
    [
        ("2600,340600,30", "0,0", "0", 29.5),
        ("2600,340600,30,20", "10,-2.5,1", "0.5", 31.0),
        ("2600,340600,30", "10,-2.5,1,30", "-2", 28.5),
        ("2600,340600", "10,-2.5,1", "0.5", GROUND + 1.5),
        ("2600,340600,,20", "10,-2.5,1,30", "0.5", GROUND + 1.5),
        ("2600,340600,30,20", "10,-2.5,1,30", "ground", GROUND),  # the lift comes last
        ("2600,340600", "10,-2.5,7", "ground", GROUND),
    ],
)
def test_a_note_tells_where_a_layer_is_after_its_move_and_its_lift(
    city, box, place, move, lift, bottom
):
    words = {"place": f"new={place}", "move": f"new={move}", "lift": f"new={lift}"}
    scene = umbra.read(city(), f"new={box}", **words)
    (told,) = [note for note in scene.notes if note.startswith("layer 'new'")]
    assert bounds_of(scene)[0, 2] == pytest.approx(bottom, abs=1e-6)
    end = read_end(told)
    # The box placed at once where the note says is the same box.
    same = umbra.read(city(), f"new={box}", place="new=" + ",".join(map(repr, end.tolist())))
    np.testing.assert_allclose(bounds_of(same), bounds_of(scene), atol=0.02)
    given = [*map(float, place.split(",")[:2])], [*map(float, move.split(",")[:2])]
    if move.count(",") < 3:
        np.testing.assert_allclose(end[:2], np.sum(given, axis=0), atol=0.006)


def test_a_layer_that_is_moved_alone_tells_its_bounds(city, box):
    high = umbra.read(city(), f"new={box}", place="new=2600,340600,30")
    corner = bounds_of(high)[0]
    file = box.with_name("there.obj")
    lines = ["v {} {} {}".format(*corner + at) for at in ((0, 0, 0), (3, 0, 0), (0, 4, 5))]
    file.write_text("\n".join([*lines, "f 1 2 3"]))
    for lift, low in (("1.25", 31.75), ("ground", GROUND)):
        scene = umbra.read(city(), f"new={file}", move="new=10,-2.5,1", lift=f"new={lift}")
        bounds = bounds_of(scene)
        assert bounds[0] == pytest.approx([*corner[:2] + (10, -2.5), low], abs=1e-6)
        (told,) = [note for note in scene.notes if note.startswith("layer 'new'")]
        ends = (bounds[0, 0], bounds[0, 1], bounds[0, 2], bounds[1, 2])
        assert all(f"{value:.2f}" in told.split("now its west end")[1] for value in ends)


def test_the_ground_is_that_below_where_a_layer_was_moved(city, box):
    """Two buildings at 12 m and at 20 m: a layer placed beside one is moved beside the other."""
    other = json.loads(city(name="high.city.json").read_text())
    other["vertices"] = [[x + 200, y, z + 8] for x, y, z in other["vertices"]]
    (city().parent / "high.city.json").write_text(json.dumps(other))
    files = city(), city().parent / "high.city.json", f"new={box}"
    for lift, low in (("0", 21.0), ("ground", 20.0)):
        scene = umbra.read(*files, place="new=2525,340500", move="new=170,0,1", lift=f"new={lift}")
        assert bounds_of(scene)[0, 2] == pytest.approx(low)
