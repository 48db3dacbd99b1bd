"""Models that say where on the earth they lie: geocentric glTF, KMZ, sites beside sites."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from pyproj import Transformer
from support.dae_files import document
from support.gltf_files import Document

import umbra
from umbra import InputError
from umbra.cli.main import umbra as command
from umbra.readers.budget import Budget
from umbra.readers.kml import read_kml
from umbra.readers.model import ReadChoices, turning

CRS = "EPSG:31256"
CORNER = np.array([2500.0, 340500.0])  # of the city [m]
BASE = 12.0
HERE = (48.20290, 16.36577)  # of CORNER [degrees]
SIZE = np.array([3.0, 6.0, 5.0])  # of a box: east, north, up [m]


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """A building on 12 m, 20 m wide."""
    x, y = CORNER
    ring = [[x, y], [x + 20, y], [x + 20, y + 20], [x, y + 20], [x, y]]
    feature = {
        "type": "Feature", "properties": {"height": 9.0, "base": BASE},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }  # fmt: skip
    system = {"type": "name", "properties": {"name": CRS}}
    path = tmp_path_factory.mktemp("city") / "city.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": system, "features": [feature]}))
    return path


def find_there(latitude=HERE[0], longitude=HERE[1]):
    there = Transformer.from_crs("EPSG:4326", CRS, always_xy=True)
    return np.array(there.transform(longitude, latitude))


def find_matrix(latitude, longitude, height):
    """Return east, north, up at a place as a matrix (4, 4) to geocentric coordinates."""
    a, b = np.radians([longitude, latitude])
    matrix = np.eye(4)
    matrix[:3, 0] = -np.sin(a), np.cos(a), 0
    matrix[:3, 1] = -np.sin(b) * np.cos(a), -np.sin(b) * np.sin(a), np.cos(b)
    matrix[:3, 2] = np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)
    there = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    matrix[:3, 3] = there.transform(longitude, latitude, height)
    return matrix


@pytest.fixture
def glb(tmp_path):
    """A box of SIZE whose origin is a lowest corner, placed on the earth."""

    def write(by="node", at=(*HERE, 215.0), name="new.glb", extras=None):
        file = Document()
        unit = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
        corners = unit * SIZE
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        faces = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
        to_earth, y_up = find_matrix(*at), turning("y").T
        if by == "raw":  # as it is, with z as the earth's axis
            own, matrix = corners, to_earth
        elif by == "node":
            own, matrix = corners @ turning("y")[:3, :3], y_up @ to_earth @ turning("y")
        else:  # about a centre
            own, matrix = corners @ to_earth[:3, :3].T @ turning("y")[:3, :3], np.eye(4)
        mesh = file.mesh({
            "attributes": {"POSITION": file.accessor(own.astype("f4"))},
            "indices": file.accessor(np.array(faces, "u2").ravel()),
        })  # fmt: skip
        file.node(mesh=mesh, matrix=matrix.T.ravel().tolist())
        if by == "centre":
            file.tree["extensions"] = {"CESIUM_RTC": {"center": to_earth[:3, 3].tolist()}}
            file.tree["extensionsRequired"] = ["CESIUM_RTC"]
        if extras:
            file.tree["scenes"][0]["extras"] = extras
        path = tmp_path / name
        path.write_bytes(file.glb())
        return path

    return write


def find_bounds(scene, layer="new"):
    boxes = [part.bounds + scene.origin for part in scene.parts if part.layer == layer]
    return np.array([np.min([b[0] for b in boxes], 0), np.max([b[1] for b in boxes], 0)])


@pytest.mark.parametrize("by", ["node", "centre", "raw"])
def test_geocentric_gltf_stands_in_its_place_on_the_ground(city, glb, by):
    scene = umbra.read(city, glb(by))
    box = find_bounds(scene)
    expected = np.stack([[*find_there(), BASE], [*find_there() + SIZE[:2], BASE + SIZE[2]]])
    np.testing.assert_allclose(box, expected, atol=0.01)  # the plan's north is 0.02° off
    assert scene.crs == CRS
    told = [note for note in scene.notes if note.startswith("layer 'new'")]
    assert len(told) == 1
    assert all(word in told[0] for word in ("new.glb", "place=", "lift=", "move="))
    assert not any("CESIUM_RTC" in note for note in scene.notes)
    # The city may come second, and the caller may move it from there.
    moved = umbra.read(glb(by), city, move="new=10,-2", lift="new=0.5")
    np.testing.assert_allclose(find_bounds(moved), expected + (10, -2, 0.5), atol=0.01)
    asked = umbra.read(city, glb(by), place="new=2600,340600,30,90")
    np.testing.assert_allclose(
        find_bounds(asked), [[2600, 340597, 30], [2606, 340600, 35]], atol=0.01
    )


def test_geocentric_gltf_alone_is_upright_at_its_site(glb):
    scene = umbra.read(glb())
    np.testing.assert_allclose(find_bounds(scene, ""), [[0, 0, 0], SIZE], atol=1e-3)
    assert (scene.latitude, scene.longitude) == pytest.approx(HERE)
    assert scene.true_north == 0
    assert any("215.00 m above the ellipsoid" in note for note in scene.notes)
    assert scene.elevation == pytest.approx(215)
    assert scene.is_ellipsoidal


def test_two_geocentric_files_keep_their_way_and_their_heights(glb):
    other = (HERE[0] + 0.001, HERE[1] - 0.002, 218.5)
    files = glb(), glb("centre", other, "b.glb")
    scene = umbra.read(*files)
    way = find_matrix(*HERE, 215.0)[:3, :3].T @ (
        find_matrix(*other)[:3, 3] - find_matrix(*HERE, 215.0)[:3, 3]
    )
    low = find_bounds(scene, "b")[0]
    np.testing.assert_allclose(low, way, atol=0.05)
    assert abs(low[0]) > 100  # and no two heaps
    # As near as that both files have one project's plan.
    near = umbra.read(files[0], glb("node", (HERE[0] + 1e-4, HERE[1], 215.0), "c.glb"))
    np.testing.assert_allclose(find_bounds(near, "c"), find_bounds(near, "new"), atol=1e-3)
    # 11 km away is no study.
    far = umbra.read(files[0], glb("node", (HERE[0] + 0.1, HERE[1], 215.0), "d.glb"))
    assert "11 km" in far.site_doubt


def test_geocentric_coordinates_above_the_sky_are_refused(glb):
    with pytest.raises(InputError, match="above the ellipsoid"):
        umbra.read(glb(at=(*HERE, 90_000.0)))
    path = glb("centre")
    path.write_bytes(path.read_bytes().replace(b'"center"', b'"centre"'))
    with pytest.raises(InputError, match="is damaged"):
        umbra.read(path)


def test_a_site_far_away_is_refused_with_its_own_distance(city, glb):
    """Not that of its coordinates, which begin at 0."""
    with pytest.raises(InputError) as caught:
        umbra.read(city, glb(at=(52.5, 13.4, 40.0)))
    expected = np.linalg.norm(find_there(52.5, 13.4) - CORNER)
    assert caught.value.distance == pytest.approx(expected, rel=1e-3)
    assert "place='new=X,Y'" in str(caught.value)


def test_a_scene_that_names_its_crs_lies_there(city, tmp_path):
    file = Document()
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 0, -4]], "f4")
    file.node(mesh=file.mesh({"attributes": {"POSITION": file.accessor(corners)}}))
    file.tree["scenes"][0]["extras"] = {"SRID": CRS, "crs x": 2600.0, "crs y": 340600.0}
    path = tmp_path / "new.glb"
    path.write_bytes(file.glb())
    assert umbra.read(path).crs == CRS
    expected = [[2600, 340600, 0], [2604, 340604, 0]]
    np.testing.assert_allclose(find_bounds(umbra.read(city, path)), expected, atol=1e-6)
    asked = umbra.read(city, path, place="new=2610,340600,1")
    np.testing.assert_allclose(find_bounds(asked)[0], [2610, 340600, 1], atol=1e-6)


PLATE = document(nodes='<node id="one" name="one"><instance_node url="#shared"/></node>')
"""A plate of 4 x 3 m on z = 0, with its origin in a corner."""


def place_model(name="files/m.dae", at=HERE, heading=0.0, mode="", altitude=0.0, more=""):
    latitude, longitude = at
    return (
        f"<Placemark><Model>{mode and f'<altitudeMode>{mode}</altitudeMode>'}<Location><longitude>"
        f"{longitude}</longitude><latitude>{latitude}</latitude><altitude>{altitude}</altitude>"
        f"</Location><Orientation><heading>{heading}</heading></Orientation>{more}"
        f"<Link><href>{name}</href></Link></Model></Placemark>"
    )


@pytest.fixture
def kmz(tmp_path):
    pytest.importorskip("collada", reason="pycollada is not installed")

    def write(*models, files=None, name="new.kmz"):
        path = tmp_path / name
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for inside, data in (files or {"files/m.dae": PLATE}).items():
                archive.writestr(inside, data)
            # A view names another place than the model, which comes after it.
            view = "<LookAt><longitude>2</longitude><latitude>41</latitude></LookAt>"
            archive.writestr("doc.kml", f"<kml><Document>{view}{''.join(models)}</Document></kml>")
        return path

    return write


def test_kmz_stands_in_its_place_with_its_origin_on_the_ground(city, kmz):
    x, y = find_there()
    # The origin is set on the ground, its altitude left out, unless it says otherwise.
    for mode, altitude, z in (("", 99.0, BASE), ("relativeToGround", 2.5, BASE + 2.5),
                              ("absolute", 30.0, 30.0)):  # fmt: skip
        scene = umbra.read(city, kmz(place_model(mode=mode, altitude=altitude)))
        np.testing.assert_allclose(find_bounds(scene), [[x, y, z], [x + 4, y + 3, z]], atol=0.01)
        assert len([note for note in scene.notes if note.startswith("layer 'new'")]) == 1
    turned = umbra.read(city, kmz(place_model(heading=90.0)))
    np.testing.assert_allclose(find_bounds(turned)[:, :2], [[x, y - 4], [x + 3, y]], atol=0.01)


@pytest.mark.parametrize(
    ("first", "second", "up", "notes"),
    [
        (("", 9.0), ("relativeToGround", 5.0), 5.0, 0),
        (("relativeToGround", 5.0), ("", 9.0), -5.0, 0),
        (("absolute", 200.0), ("absolute", 203.0), 3.0, 0),
        (("absolute", 205.0), ("relativeToGround", 3.0), 0.0, 1),
    ],
)
def test_kmz_sets_models_at_their_heights_or_says_so(kmz, first, second, up, notes):
    (mode, low), (other, high) = first, second
    scene = umbra.read(kmz(place_model(mode=mode, altitude=low), place_model(
        at=(HERE[0], HERE[1] + 0.001), mode=other, altitude=high)))  # fmt: skip
    heights = [part.bounds[0, 2] for part in scene.parts]
    assert heights[1] - heights[0] == pytest.approx(up, abs=0.01)
    assert sum("above the sea" in note for note in scene.notes) == notes


@pytest.mark.parametrize(
    ("more", "low", "high"),
    [
        ("<Scale><x>2</x><y>3</y><z>1</z></Scale>", (0, 0, 0), (8, 9, 0)),
        ("<Orientation><tilt>90</tilt></Orientation>", (0, 0, -3), (4, 0, 0)),
        ("<Orientation><roll>90</roll></Orientation>", (0, 0, 0), (0, 3, 4)),
        # First the roll stands it up, then the tilt turns it about the x axis.
        ("<Orientation><roll>90</roll><tilt>90</tilt></Orientation>", (0, 0, -3), (0, 4, 0)),
    ],
)
def test_kmz_is_scaled_then_rolled_then_tilted(kmz, more, low, high):
    scene = umbra.read(kmz(place_model(more=more).replace("<heading>0.0</heading>", "")))
    np.testing.assert_allclose(find_bounds(scene, ""), [low, high], atol=1e-9)


def test_kmz_places_several_models_about_the_first(kmz):
    east = (HERE[0], HERE[1] + 0.001)
    scene = umbra.read(kmz(place_model(heading=90.0), place_model(at=east, heading=180.0)))
    assert [part.name for part in scene.parts] == ["shared", "shared (2)"]
    assert scene.parts[0].mesh.vertices is scene.parts[1].mesh.vertices
    assert scene.true_north == 270
    length = np.linalg.norm(find_there(*east) - find_there())
    # The first one's y axis points east, and the second is turned by 90° more.
    low = scene.parts[1].bounds[0] + scene.origin
    np.testing.assert_allclose(low, [0, length - 4, 0], atol=0.05)


def test_kmz_holds_a_glb_and_tells_what_it_lacks(city, kmz):
    file = Document()
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 0, -4]], "f4")
    file.node(mesh=file.mesh({"attributes": {"POSITION": file.accessor(corners)}}))
    models = [place_model(n) for n in ("m.glb", "gone.dae", "http://example.com/m.dae")]
    scene = umbra.read(city, kmz(*models, files={"m.glb": file.glb()}))
    np.testing.assert_allclose(find_bounds(scene)[0, :2], find_there(), atol=0.01)
    for word in ("not in the archive left out: 1 (first: 'gone.dae')", "on the network left out"):
        assert any(word in note for note in scene.notes), word


@pytest.mark.parametrize(
    ("models", "files", "words"),
    [
        ([place_model("../../etc/m.dae")], {"a/x.dae": PLATE}, "none of the models"),
        ([place_model(at=(98.0, 1.0))], None, "without a place"),
        ([place_model(more="<Scale><x>0</x></Scale>")], None, "scale 0"),
        ([place_model(altitude="nan", mode="absolute")], None, "no number"),
        ([place_model(), place_model(at=(1.0, 1.0))], None, "km apart"),
        (["<Placemark><Polygon/></Placemark>"], None, "Polygon left out: 1"),
        ([place_model("a.gltf")], {"a.gltf": "{}"}, "make a GLB"),
    ],
)
def test_kmz_that_is_wrong_is_refused_in_a_line(kmz, models, files, words):
    with pytest.raises(InputError, match=words) as caught:
        umbra.read(kmz(*models, files=files))
    assert "\n" not in str(caught.value)


def test_kml_reads_models_beside_it_and_none_elsewhere(tmp_path):
    pytest.importorskip("collada", reason="pycollada is not installed")
    (tmp_path / "in").mkdir()
    (tmp_path / "out.dae").write_text(PLATE)
    (tmp_path / "in" / "m.dae").write_text(PLATE)
    path = tmp_path / "in" / "a.kml"
    path.write_text(f"<kml>{place_model('m.dae')}</kml>")
    assert umbra.read(path).latitude == HERE[0]
    path.write_text(f"<kml>{place_model('../out.dae')}</kml>")
    with pytest.raises(InputError, match="outside the model's folder"):
        umbra.read(path)
    path.write_text(f'<!DOCTYPE k [<!ENTITY e "x">]><kml>{place_model("m.dae")}</kml>')
    with pytest.raises(InputError, match="document type"):
        umbra.read(path)


def test_kml_cannot_ask_for_more_than_its_bytes(tmp_path):
    """A million models of one byte each are counted before they are kept."""
    text = b"<kml>" + b"<Model/>" * 300_000 + b"</kml>"
    choices = replace(ReadChoices(), budget=Budget(0.01e9))
    choices.budget.grow("a.kml", 1)
    with pytest.raises(InputError, match="models of KML"):
        read_kml(text, tmp_path / "a.kml", choices)


def test_place_again_keeps_the_ground_that_a_file_states(city, kmz):
    scene = umbra.read(city, kmz(place_model()))
    source = next(one for one in scene.sources if one.layer == "new")
    assert source.ground == 0
    # As if its ground were 1 m below its lowest point: it stands on posts.
    told = tuple(replace(one, ground=-1.0 if one is source else None) for one in scene.sources)
    again = umbra.place(replace(scene, sources=told), "new", at=(2600, 340600))
    np.testing.assert_allclose(find_bounds(again)[0], [2600, 340600, BASE + 1], atol=1e-6)


@pytest.mark.parametrize("kind", ["geocentric", "kml"])
def test_inspect_says_what_heights_are_above(glb, kmz, kind):
    if kind == "geocentric":
        path, height = glb(), 215.0
    else:
        path, height = kmz(place_model(altitude=31.5, mode="absolute")), 31.5
    words = [CliRunner().invoke(command, ["inspect", str(path), *more], obj=[]).output
             for more in ((), ("--json",))]  # fmt: skip
    assert json.loads(words[1])["elevation"] == pytest.approx(height)
    assert json.loads(words[1])["is_ellipsoidal"] == (kind == "geocentric")
    (told,) = [line for line in words[0].splitlines() if f", {height:g} m above" in line]
    assert ("ellipsoid" in told) == (kind == "geocentric")
