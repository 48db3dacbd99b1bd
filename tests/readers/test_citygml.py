"""CityGML: what it names, links to and leaves out, against the same in CityJSON or by hand."""

import gzip
import io
import json
import sys
import zipfile

import numpy as np
import pytest

import umbra
from umbra import InputError
from umbra.readers.cityjson import SurfaceList

pytest.importorskip("lxml", reason="lxml is not installed")

from support.gml_files import (
    building,
    city,
    polygon,
    prism,
    ring,
    solid,
    surfaces,
)  # fmt: skip

WHOLE = {"GroundSurface": 2, "RoofSurface": 2, "WallSurface": 8}


@pytest.fixture
def read(tmp_path):
    def from_text(text, name="city.gml", **options):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return umbra.read(path, **options)

    return from_text


def notes(scene):
    """What was left out of the file; where its small coordinates lie is no matter."""
    return [note.partition(": ")[2] for note in scene.notes if note.startswith("city.gml: ")]


def count_kinds(scene):
    kinds = {}
    for part in scene.parts:
        kinds[part.kind] = kinds.get(part.kind, 0) + part.triangles
    return kinds


def find_volume(scene):
    soup = scene.triangles()
    a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize("version", ["1.0", "2.0", "3.0"])
def test_a_building_is_read_once_with_its_surfaces(read, version):
    scene = read(city(building(), version=version))
    assert scene.sources[0].format == f"CityGML {version}"
    assert count_kinds(scene) == WHOLE
    assert {part.name for part in scene.parts} == {"house"}
    assert scene.crs == "EPSG:25832+5783"
    assert find_volume(scene) == pytest.approx(4 * 6 * 3)
    assert not notes(scene)


def test_it_is_what_the_same_city_is_in_cityjson(read):
    faces = [corners for _, corners in prism(500_000, 5_400_000)]
    kinds = [kind for kind, _ in prism()]
    numbers = iter(range(100))
    boundaries = [[[next(numbers) for _ in corners]] for corners in faces]
    values = {"surfaces": [{"type": kind} for kind in kinds], "values": [list(range(len(kinds)))]}
    solid_of = {"type": "Solid", "lod": "2", "boundaries": [boundaries], "semantics": values}
    document = {
        "type": "CityJSON", "version": "2.0",
        "metadata": {"referenceSystem": "urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::5783"},
        "CityObjects": {"house": {"type": "Building", "geometry": [solid_of]}},
        "vertices": [corner for corners in faces for corner in corners],
    }  # fmt: skip
    ours = read(city(building(faces=prism(500_000, 5_400_000))))
    theirs = read(json.dumps(document), "city.json")
    assert (ours.crs, ours.latitude) == (theirs.crs, theirs.latitude)
    for one, other in zip(
        sorted(ours.parts, key=lambda p: p.kind), sorted(theirs.parts, key=lambda p: p.kind),
        strict=True,
    ):  # fmt: skip
        assert (one.name, one.kind, one.tags) == (other.name, other.kind, other.tags)
        np.testing.assert_array_equal(
            one.mesh.vertices[one.mesh.faces], other.mesh.vertices[other.mesh.faces]
        )


def test_the_finest_level_counts_and_a_solid_before_surfaces(read):
    coarse = f"<c:lod1Solid>{solid(*(polygon(c) for _, c in prism(height=9)))}</c:lod1Solid>"
    scene = read(city(building(more=coarse)))
    assert count_kinds(scene) == WHOLE
    assert scene.bounds()[1][2] == 3
    alone = read(city(f'<c:Building gml:id="a">{coarse}</c:Building>'))
    assert count_kinds(alone) == {"Building": 12}


def test_holes_openings_and_turned_surfaces(read):
    hole = [(1, 1, 0), (1, 2, 0), (2, 2, 0), (2, 1, 0)]
    plate = polygon([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)], "plate", [hole])
    window = surfaces(polygon(hole[::-1], "pane"))
    wall = (
        f"<c:boundedBy><c:WallSurface><c:lod3MultiSurface>{surfaces(plate)}</c:lod3MultiSurface>"
        f"<c:opening><c:Window><c:lod3MultiSurface>{window}</c:lod3MultiSurface></c:Window>"
        "</c:opening></c:WallSurface></c:boundedBy>"
    )
    scene = read(city(f'<c:Building gml:id="a">{wall}</c:Building>'))
    area = {part.kind: part.mesh for part in scene.parts}
    assert set(area) == {"WallSurface", "Window"}
    soup = scene.triangles()
    a, b, c = (soup.vertices[soup.faces[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(16)  # 15 and the pane
    turned = '<gml:OrientableSurface orientation="-"><gml:baseSurface xlink:href="#plate"/>'
    upright = polygon([(0, 0, 0), (4, 0, 0), (4, 0, 3)])  # not of its parent: not a repetition
    back = surfaces(f"{turned}</gml:OrientableSurface>", upright)
    both = city(
        f'<c:Building gml:id="a">{wall}<c:consistsOfBuildingPart><c:BuildingPart gml:id="b">'
        f"<c:lod3MultiSurface>{back}</c:lod3MultiSurface></c:BuildingPart>"
        "</c:consistsOfBuildingPart></c:Building>"
    )
    part = next(p for p in read(both).parts if p.name == "b")
    a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(-15)


def test_parts_and_installations_are_objects_of_their_own(read):
    part = building("part", prism(10)).replace("c:Building ", "c:BuildingPart ")
    part = part.replace("</c:Building>", "</c:BuildingPart>")
    box = surfaces(*(polygon(c) for _, c in prism(20)))
    more = (
        f"<c:consistsOfBuildingPart>{part}</c:consistsOfBuildingPart>"
        '<c:outerBuildingInstallation><c:BuildingInstallation gml:id="dormer"><c:lod2Geometry>'
        f"{box}</c:lod2Geometry></c:BuildingInstallation></c:outerBuildingInstallation>"
        "<c:interiorRoom><c:Room><c:lod4Solid>"
        f"{solid(*(polygon(c) for _, c in prism(0.5)))}</c:lod4Solid></c:Room></c:interiorRoom>"
    )
    scene = read(city(building(more=more)))
    assert {part.name for part in scene.parts} == {"house", "part", "dormer"}
    assert notes(scene) == ["rooms and furniture left out (indoors): 1 (first: 'house')"]


def test_a_relief_of_triangles(read):
    patches = "".join(
        f"<gml:Triangle><gml:exterior>{ring(c)}</gml:exterior></gml:Triangle>"
        for c in ([(0, 0, 1), (9, 0, 1), (9, 9, 2)], [(0, 0, 1), (9, 9, 2), (0, 9, 2)])
    )
    tin = (
        '<c:ReliefFeature gml:id="r"><c:lod>2</c:lod><c:reliefComponent><c:TINRelief gml:id="t">'
        "<c:lod>2</c:lod><c:tin><gml:TriangulatedSurface><gml:trianglePatches>"
        f"{patches}</gml:trianglePatches></gml:TriangulatedSurface></c:tin></c:TINRelief>"
        "</c:reliefComponent></c:ReliefFeature>"
    )
    assert count_kinds(read(city(tin))) == {"TINRelief": 2}


def tree(name, place, shape):
    return (
        f'<c:SolitaryVegetationObject gml:id="{name}"><c:lod2ImplicitRepresentation>'
        "<c:ImplicitGeometry><c:transformationMatrix>2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"
        f"</c:transformationMatrix>{shape}<c:referencePoint><gml:Point><gml:pos>{place}</gml:pos>"
        "</gml:Point></c:referencePoint></c:ImplicitGeometry></c:lod2ImplicitRepresentation>"
        "</c:SolitaryVegetationObject>"
    )


def test_trees_share_a_shape_wherever_it_stands_in_the_file(read):
    crown = surfaces(*(polygon(c) for _, c in prism()), name="crown")
    inline = f"<c:relativeGMLGeometry>{crown}</c:relativeGMLGeometry>"
    link = '<c:relativeGMLGeometry xlink:href="#crown"/>'
    scene = read(
        city(tree("a", "100 0 5", link), tree("b", "200 0 5", inline), tree("c", "300 0 5", link))
    )
    assert {part.name for part in scene.parts} == {"a", "b", "c"}
    assert len({id(part.mesh) for part in scene.parts}) == 1
    low = {part.name: (part.transform @ [0, 0, 0, 1])[0] + scene.origin[0] for part in scene.parts}
    assert low == {"a": 100, "b": 200, "c": 300}
    assert scene.bounds()[1][2] == 5 + 2 * 3
    lost = read(city(building(), tree("a", "0 0 0", "<c:libraryObject>t.obj</c:libraryObject>")))
    assert "implicit geometries left out whose shape the file does not hold: 1" in lost.notes[0]


def test_shared_shapes_in_metres_are_left_out_of_a_city_in_degrees(read):
    crown = surfaces(*(polygon(c) for _, c in prism()), name="crown")
    inline = f"<c:relativeGMLGeometry>{crown}</c:relativeGMLGeometry>"
    faces = [(k, [(48 + y * 1e-5, 16 + x * 1e-5, z) for x, y, z in c]) for k, c in prism()]
    scene = read(city(building(faces=faces), tree("t", "48 16 0", inline), crs="EPSG:4979"))
    assert {part.name for part in scene.parts} == {"house"}
    assert "implicit geometries left out, as the CRS is in degrees: 1 (first: 't')" in notes(scene)


@pytest.mark.parametrize("first", [True, False])
def test_a_wall_that_two_buildings_share(read, first):
    west, east = prism(0), prism(4)
    # East's western wall is West's eastern one, from its other side.
    turned = '<gml:OrientableSurface orientation="-"><gml:baseSurface xlink:href="#west-3"/>'
    shared = f"{turned}</gml:OrientableSurface>"
    own = [polygon(corners) for k, (_, corners) in enumerate(east) if k != 5]
    other = (
        f'<c:Building gml:id="east"><c:lod2Solid>{solid(*own, shared)}</c:lod2Solid></c:Building>'
    )
    members = (building("west", west), other)
    scene = read(city(*(members if first else members[::-1])))
    assert find_volume(scene) == pytest.approx(2 * 4 * 6 * 3)
    assert not notes(scene)


def test_links_that_lead_nowhere_are_counted(read):
    gone = f"<c:lod2MultiSurface>{surfaces('gone')}</c:lod2MultiSurface>"
    far = f'<c:Building gml:id="a">{gone}</c:Building>'
    scene = read(city(building(), far, '<!-- --><c:Building gml:id="b"/>'))
    assert count_kinds(scene) == WHOLE
    assert notes(scene) == ["links to surfaces that the file does not hold: 1 (first: 'a')"]
    outside = city(building()).replace(
        "</c:CityModel>", '<c:cityObjectMember xlink:href="other.gml#x"/></c:CityModel>'
    )
    assert "members left out that lie in other files: 1" in read(outside).notes[0]


@pytest.mark.parametrize(
    ("crs", "swapped"),
    [
        ("http://www.opengis.net/def/crs/EPSG/0/6697", True),  # latitude first, as PLATEAU
        ("urn:ogc:def:crs:EPSG::4326", True),
        ("urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::5783", False),
        ("urn:ogc:def:crs:EPSG::31467", False),  # northing first, and most files are not
        ("urn:adv:crs:DE_DHDN_3GK3*DE_DHHN92_NH", False),
    ],
)
def test_coordinates_lie_where_the_crs_is_used(read, crs, swapped):
    places = {"6697": (35.68, 139.75), "4326": (48.2, 16.37), "25832": (500_000, 5_400_000)}
    x, y = next((p for code, p in places.items() if code in crs), (3_500_000, 5_400_000))
    step = 1e-5 if x < 90 else 1.0
    faces = [
        (kind, [(x + (b if swapped else a) * step, y + (a if swapped else b) * step, z)
                for a, b, z in corners])
        for kind, corners in prism()
    ]  # fmt: skip
    text = city(building(faces=faces), crs=crs)
    scene = read(text.replace(":.9g", ":.15g"))
    where = {"6697": (35.68, 139.75), "4326": (48.2, 16.37)}
    lat, lon = next((p for code, p in where.items() if code in crs), (48.75, 9.0))
    assert scene.latitude == pytest.approx(lat, abs=0.02)
    assert scene.longitude == pytest.approx(lon, abs=0.02)
    assert find_volume(scene) > 0


@pytest.mark.parametrize("east_first", [True, False])
def test_where_either_order_fits_bodies_are_not_inside_out(read, east_first):
    # Berlin's Soldner grid says north first; near its middle both orders are within its area.
    faces = [
        (kind, [(20_000 + a, 21_000 + b, z) if east_first else (20_000 + b, 21_000 + a, z)
                for a, b, z in corners])
        for kind, corners in prism()
    ]  # fmt: skip
    scene = read(city(building(faces=faces), crs="urn:ogc:def:crs:EPSG::3068"))
    assert find_volume(scene) > 0
    low = scene.bounds()[0]
    assert low[:2].tolist() == ([20_000, 21_000] if east_first else [21_000, 20_000])


def test_compressed_files(read):
    text = city(building()).encode()
    assert count_kinds(read(gzip.compress(text), "city.gml.gz")) == WHOLE
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("udx/a.gml", text)
        archive.writestr("udx/b.gml", city(building("other", prism(30))))
        archive.writestr("readme.txt", "hello")
    scene = read(packed.getvalue(), "city.zip")
    assert {part.name for part in scene.parts} == {"house", "other"}


def test_traps_are_refused(read):
    entity = '<!DOCTYPE c [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>\n'
    with pytest.raises(InputError, match="document type"):
        read(city(building(), head=entity))
    with pytest.raises(InputError, match="damaged XML at line 2"):
        read(city(building())[:-400])
    with pytest.raises(InputError, match="unpacked data"):
        read(gzip.compress(city(building()).encode() + b" " * 70_000_000), "bomb.gml.gz")
    with pytest.raises(InputError, match="damaged where it was compressed"):
        read(
            gzip.compress(city(*(building(f"b{k}") for k in range(99))).encode())[:-200], "a.gml.gz"
        )
    numbers = ring([(0, 0, 0), (1, 0, 0), (1, 1, 0)]).replace("1 1 0 0 0 0", "0")
    shape = surfaces(f"<gml:Polygon><gml:exterior>{numbers}</gml:exterior></gml:Polygon>")
    wrong = f'<c:Building gml:id="a"><c:lod2MultiSurface>{shape}</c:lod2MultiSurface></c:Building>'
    with pytest.raises(InputError, match="has 7 coordinates, not three") as caught:
        read(city(wrong))
    assert caught.value.data["ring"]


def test_links_that_multiply_or_lead_back_end_soon(read):
    back = surfaces("one", name="one")
    text = city(
        building(),
        f'<c:Building gml:id="a"><c:lod2MultiSurface>{back}</c:lod2MultiSurface></c:Building>',
    )
    assert count_kinds(read(text)) == WHOLE
    levels = [surfaces(polygon([(0, 0, 0), (1, 0, 0), (0, 1, 0)]), name="s0")]
    levels += [surfaces(*[f"s{k}"] * 30, name=f"s{k + 1}") for k in range(9)]
    many = "".join(f"<c:lod2MultiSurface>{one}</c:lod2MultiSurface>" for one in levels)
    with pytest.raises(InputError, match="of memory in all are more than files of"):
        read(city(f'<c:Building gml:id="a">{many}</c:Building>'))


def test_without_lxml_the_extra_is_named(read, monkeypatch):
    monkeypatch.setitem(sys.modules, "lxml", None)
    with pytest.raises(InputError, match=r"pip install .*\[citygml\]"):
        read(city(building()))


def test_two_coordinate_systems_are_refused(read):
    other = building("other").replace("<gml:Solid>", '<gml:Solid srsName="EPSG:25833">', 1)
    with pytest.raises(InputError, match="names two coordinate reference systems") as caught:
        read(city(building(), other))
    assert caught.value.data["crs"] == ("EPSG:25832+5783", "EPSG:25833")
    same = building().replace("<gml:Solid>", '<gml:Solid srsName="EPSG:25832">', 1)
    assert count_kinds(read(city(same))) == WHOLE


def test_an_order_that_the_crs_does_not_say_is_noted(read):
    faces = [(k, [(x + 3_500_000, y + 5_400_000, z) for x, y, z in c]) for k, c in prism()]
    told = notes(read(city(building(faces=faces), crs="urn:ogc:def:crs:EPSG::31467")))
    assert len(told) == 1
    assert "read east first, although EPSG:31467 says north first" in told[0]
    # In degrees the CRS is followed, however a body is wound.
    inward = [(k, [(48 + y * 1e-5, 16 + x * 1e-5, z) for x, y, z in c][::-1]) for k, c in prism()]
    scene = read(city(building(faces=inward), crs="EPSG:4979"))
    assert scene.latitude == pytest.approx(48, abs=0.1)


def test_files_of_archives_are_named_and_those_of_a_mac_passed_over(read):
    def pack(**files):
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as archive:
            for name, text in files.items():
                archive.writestr(name, text)
        return packed.getvalue()

    whole = city(building())
    mac = pack(**{"a.gml": whole, "__MACOSX/._a.gml": b"\0\5\x16\7"})
    assert count_kinds(read(mac, "mac.zip")) == WHOLE
    with pytest.raises(InputError, match=r"bad\.gml is damaged XML at line 2"):
        read(pack(**{"a.gml": whole, "bad.gml": whole[:-300]}), "bad.zip")
    with pytest.raises(InputError, match=r"ZIP archive without CityGML"):
        read(pack(**{"readme.txt": "hello"}), "none.zip")


def test_members_of_a_feature_service_and_old_names(read):
    text = city(building(), crs="http://www.opengis.net/gml/srs/epsg.xml#25832")
    served = text.replace("c:cityObjectMember", "w:member").replace(
        "<c:CityModel", '<c:CityModel xmlns:w="http://www.opengis.net/wfs/2.0"'
    )
    scene = read(served)
    assert count_kinds(scene) == WHOLE
    assert scene.crs == "EPSG:25832"


def test_a_surface_that_links_to_itself_is_read_once(read):
    body = surfaces(polygon([(0, 0, 0), (4, 0, 0), (0, 4, 0)]), "one", name="one")
    level = f"<c:lod2MultiSurface>{body}</c:lod2MultiSurface>"
    assert len(read(city(f'<c:Building gml:id="a">{level}</c:Building>')).triangles().faces) == 1


def test_a_coordinate_that_is_no_number_is_named(read):
    text = city(building()).replace("<gml:posList>0 6", "<gml:posList>abc 6", 1)
    with pytest.raises(InputError, match="has a coordinate that is not a number") as caught:
        read(text)
    assert caught.value.data["object"] == "house-0"
    assert caught.value.data["line"] == 2


def test_links_lead_on_through_other_members_in_any_order(read):
    """The first house's wall is in the second's, which takes it from the third."""
    wall = polygon([(0, 0, 0), (4, 0, 0), (4, 0, 3)], "wall")
    plain = "<c:lod2MultiSurface>{}</c:lod2MultiSurface>"
    link = '<gml:surfaceMember xlink:href="#{}"/>'
    one = plain.format(f"<gml:MultiSurface>{link.format('middle')}</gml:MultiSurface>")
    two = plain.format(
        f'<gml:MultiSurface gml:id="middle">{link.format("wall")}</gml:MultiSurface>'
    )
    three = plain.format(surfaces(wall))
    houses = [
        f'<c:Building gml:id="{n}">{g}</c:Building>' for n, g in zip("abc", (one, two, three))
    ]
    for order in (houses, houses[::-1]):
        scene = read(city(*order))
        assert {part.name: part.triangles for part in scene.parts} == {"a": 1, "b": 1, "c": 1}
        assert not notes(scene)


def test_textures_leave_no_trace(read):
    image = "<c:surfaceDataMember><c:ParameterizedTexture/></c:surfaceDataMember>"
    front = f"<c:appearance><c:Appearance>{image}</c:Appearance></c:appearance>"
    scene = read(city(building(more=front)))
    assert count_kinds(scene) == WHOLE
    assert not notes(scene)


def test_surfaces_that_are_cut_in_pieces_of_the_city_are_the_same(read, monkeypatch):
    houses = [building(f"house {n}", prism(10 * n)) for n in range(5)]
    whole = read(city(*houses))
    monkeypatch.setattr("umbra.readers.cityjson.MOST_CORNERS", 60)
    pieces = read(city(*houses))
    assert len({id(part.mesh.vertices) for part in whole.parts}) == 1
    assert len({id(part.mesh.vertices) for part in pieces.parts}) == 2  # three houses, two
    for one, other in zip(whole.parts, pieces.parts, strict=True):
        assert (one.name, one.kind, one.tags) == (other.name, other.kind, other.tags)
        np.testing.assert_array_equal(
            one.mesh.vertices[one.mesh.faces], other.mesh.vertices[other.mesh.faces]
        )


def test_a_box_leaves_members_out_before_their_surfaces_are_cut(read, monkeypatch):
    houses = [building(f"house {n}", prism(500_000 + 10 * n, 5_400_000)) for n in range(6)]
    cut = []
    monkeypatch.setattr(
        "umbra.readers.cityjson.SurfaceList.add",
        lambda self, name, *rest, add=SurfaceList.add: cut.append(name) or add(self, name, *rest),
    )
    scene = read(city(*houses), bbox=(500_012, 5_400_000, 500_021, 5_400_001))
    assert {part.name for part in scene.parts} == set(cut) == {"house 1", "house 2"}
    assert "left out: 4" in notes(scene)[-1]


def test_latitudes_near_a_pole_are_told(read):
    faces = [
        (kind, [(-77.0 + a * 1e-5, 38.9 + b * 1e-5, z) for a, b, z in corners])
        for kind, corners in prism()
    ]
    text = city(building(faces=faces), crs="http://www.opengis.net/def/crs/EPSG/0/4979")
    assert notes(read(text))[0].startswith("latitudes are -77.0000° as EPSG:4979 orders")
