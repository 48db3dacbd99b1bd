"""Whole files for the mutators to begin with, as the tests make them."""

import io
import json
import re
import struct
import zipfile
from datetime import date
from importlib.util import find_spec
from itertools import count
from pathlib import Path

import numpy as np
from support.dae_files import document as dae_document
from support.gltf_files import Document
from support.gml_files import building as gml_building
from support.gml_files import city as gml_city
from support.gml_files import prism
from support.model_files import save_city, save_city_sequence, save_glb, save_obj
from support.packed_files import draco_packed, meshopt_packed, plain
from support.shapes import box, city, terrain
from support.small_files import BYTES

__all__ = ["make_seeds"]

BALL = {"sphere": [4e6, 1e6, 4.8e6, 100]}
LIBRARY = "newmtl brick\nKd 0.5 0.2 0.1\nd 0.5\nmap_Kd -s 1 1 bricks.png\nnewmtl plain\nKe 1 1 1\n"


def make_seeds(folder: Path) -> dict[str, bytes]:
    """
    Make a file of each kind.

    Parameters
    ----------
    folder : Path
        For files that are made by name; left with what they need beside them.

    Returns
    -------
    seeds : dict of str to bytes
        By file name, in an order that does not change.
    """
    meshes = {f"house {n}": box((3 * n, 0, 0), (3 * n + 2, 2, 4 + n)) for n in range(4)}
    made = [
        save_obj(folder / "town.obj", meshes),
        save_glb(folder / "town.glb", meshes),
        save_city(folder / "town.city.json", meshes, crs="EPSG:28992"),
        save_city_sequence(folder / "town.city.jsonl", meshes, crs="EPSG:7415"),
        save_city(folder / "block.city.json", {"block": city()}),
        save_obj(folder / "land.obj", {"land": terrain(12)}),
    ]
    (folder / "colours.mtl").write_text(LIBRARY)
    textured = b"mtllib colours.mtl\nusemtl brick\nvt 0 0\nvt 1 0\nvt 0 1\n"
    seeds = {f"small-{name}": data for name, data in BYTES.items()}
    seeds |= {path.name: path.read_bytes() for path in made}
    seeds["colours.obj"] = textured + seeds["town.obj"] + b"f 1/1 2/2 3/3\n"
    seeds["dancer.glb"] = _make_dancer()
    seeds["holes.geojson"] = _make_holes()
    if find_spec("DracoPy") and find_spec("meshopt"):
        seeds["draco.glb"] = draco_packed().glb()
        modes = {0: (12, "ATTRIBUTES"), 1: (8, "ATTRIBUTES"), 3: (4, "TRIANGLES")}
        seeds["meshopt.glb"] = meshopt_packed(plain(), modes).glb()
    seeds |= _make_strangers(folder)
    seeds |= _make_places(seeds["town.glb"])
    if find_spec("ifcopenshell"):
        seeds["house.ifc"] = _make_house(folder / "house.ifc")
    return seeds


def _make_places(town: bytes) -> dict[str, bytes]:
    """Make a KML that places a model beside it twice, and a KMZ that holds both, not packed."""
    models = "".join(
        f"<Placemark><Model><altitudeMode>{mode}</altitudeMode><Location><longitude>{16.4 + k}"
        "</longitude><latitude>48.2</latitude><altitude>3</altitude></Location><Orientation>"
        "<heading>30</heading></Orientation><Scale><x>2</x></Scale>"
        "<Link><href>town.glb</href></Link></Model></Placemark>"
        for k, mode in ((0.0, "absolute"), (1e-4, "relativeToGround"))
    )
    kml = f"<kml><Document>{models}</Document></kml>".encode()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, data in (("doc.kml", kml), ("town.glb", town)):
            archive.writestr(zipfile.ZipInfo(name), data)
    return {"places.kml": kml, "places.kmz": packed.getvalue()}


def _make_dancer() -> bytes:
    """Make a GLB with a skin, morph targets, an animation, lights, a texture and instances."""
    document = Document()
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 1]], "<f4")
    attributes = {
        "POSITION": document.accessor(points),
        "NORMAL": document.accessor(np.tile(np.array([0, 0, 1], "<f4"), (4, 1))),
        "TEXCOORD_0": document.accessor(points[:, :2].astype("<f4")),
        "COLOR_0": document.accessor(np.full((4, 4), 200, "<u1"), normalized=True),
        "JOINTS_0": document.accessor(np.array([[0, 1, 0, 0]] * 4, "<u1")),
        "WEIGHTS_0": document.accessor(np.array([[0.5, 0.5, 0, 0]] * 4, "<f4")),
    }
    corners = document.accessor(np.array([0, 1, 2, 0, 2, 3], "<u2"))
    targets = [{"POSITION": document.accessor(points * 0.5)}]
    bent = {"attributes": attributes, "indices": corners, "targets": targets, "material": 0}
    strip = {"attributes": {"POSITION": attributes["POSITION"]}, "mode": 5, "material": 1}
    bones = [document.node(root=False, translation=[n, 0, 0]) for n in range(2)]
    hip = document.node(children=bones)
    dancer = document.node(mesh=document.mesh(bent, weights=[0.3]), skin=0)
    document.node(mesh=document.mesh(strip), matrix=np.eye(4).ravel().tolist())
    lamp = {"KHR_lights_punctual": {"light": 0}}
    document.node(extensions=lamp, translation=[0, 3, 0])
    kind = {"type": "spot", "color": [1, 0.5, 0], "intensity": 40, "spot": {"outerConeAngle": 0.5}}
    columns = {"TRANSLATION": document.accessor(points), "SCALE": document.accessor(points + 1)}
    instances = {"EXT_mesh_gpu_instancing": {"attributes": columns}}
    document.node(mesh=1, extensions=instances)
    matrices = document.accessor(np.tile(np.eye(4, dtype="<f4"), (2, 1, 1)))
    times = document.accessor(np.array([0, 1, 2], "<f4"))
    turns = document.accessor(np.array([[0, 0, 0, 1], [0, 1, 0, 0], [0, 0, 0, 1]], "<f4"))
    weights = document.accessor(np.array([0, 1, 0], "<f4"))
    document.tree |= {
        "skins": [{"joints": bones, "inverseBindMatrices": matrices}],
        "extensions": {"KHR_lights_punctual": {"lights": [kind]}},
        "animations": [
            {
                "channels": [
                    {"sampler": 0, "target": {"node": hip, "path": "rotation"}},
                    {"sampler": 1, "target": {"node": dancer, "path": "weights"}},
                ],
                "samplers": [
                    {"input": times, "output": turns, "interpolation": "LINEAR"},
                    {"input": times, "output": weights, "interpolation": "STEP"},
                ],
            }
        ],
        "textures": [{"source": 0, "sampler": 0}],
        "samplers": [{"wrapS": 33071}],
        "images": [{"uri": "bricks.png"}],
    }
    material = document.tree["materials"][0]
    material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    material["emissiveFactor"] = [0.1, 0, 0]
    return document.glb()


def _make_house(path: Path) -> bytes:
    """Make an IFC with an opening, colours, a material, properties and a place on earth."""
    from support.ifc_files import IfcFile  # noqa: PLC0415 - it needs ifcopenshell

    house = IfcFile()
    house.site(latitude=(48, 12, 0), longitude=(16, 22, 0), elevation=170000.0)
    wall = house.box("IfcWall", "wall", (4, 0.3, 3), color=(0.5, 0.2, 0.1), style="brick")
    house.opening(wall, (1, 0.3, 1), (1, 0, 1))
    house.material(wall, "brick")
    house.property_set(wall, "Pset_WallCommon", Reference="W1", ThermalTransmittance=0.2)
    house.box("IfcSlab", "roof", (4, 4, 0.2), (0, 0, 3), storey=1)
    house.map_conversion("EPSG:31256", 2000, 340000, 170, along=0.9, across=0.1)
    text = house.write(path).read_text()
    # What ifcopenshell draws by lot and reads from the clock is made the same each time.
    numbers = count(1)
    text = re.sub(r"'[\w$]{22}'", lambda _: f"'{next(numbers):022d}'", text)
    return re.sub(r"FILE_NAME\(.*?\);", "FILE_NAME('','',(''),(''),'','','');", text).encode()


def _make_strangers(folder: Path) -> dict[str, bytes]:
    """Make files of cities and of architects, most of whose readers need packages."""
    faces = [corners for _, corners in prism(85_000, 447_000)]
    room = {"identifier": "room", "faces": [_face(corners) for _, corners in prism()]}
    model = {"type": "Model", "properties": {}, "units": "Feet", "rooms": [room]}
    root = {"geometricError": 2, "content": {"uri": "tile.b3dm"}, "boundingVolume": BALL}
    root["children"] = [{"geometricError": 0, "content": {"uri": "town.glb"}, "refine": "ADD"}]
    tree = {"asset": {"version": "1.1"}, "geometricError": 9, "root": root}
    head = struct.pack("<4s6I", b"b3dm", 1, 28, 0, 0, 0, 0)
    seeds = {"house.hbjson": json.dumps(model).encode(), "tileset.json": json.dumps(tree).encode()}
    seeds["tile.b3dm"] = head + (folder / "town.glb").read_bytes()
    (folder / "tile.b3dm").write_bytes(seeds["tile.b3dm"])
    table = b'{"INSTANCES_LENGTH":2,"POSITION":{"byteOffset":0},"SCALE":{"byteOffset":24}}   '
    body = np.arange(8, dtype="<f4").tobytes()
    head = struct.pack("<4s7I", b"i3dm", 1, 32, len(table), len(body), 0, 0, 1)
    seeds["trees.i3dm"] = head + table + body + (folder / "town.glb").read_bytes()
    if find_spec("lxml"):
        seeds["town.gml"] = gml_city(
            *(gml_building(f"h{n}", prism(9 * n)) for n in range(3))
        ).encode()
    if find_spec("collada"):
        seeds["plate.dae"] = dae_document().encode()
    if find_spec("flatcitybuf"):
        from support.fcb_files import make_fcb  # noqa: PLC0415 - it needs flatcitybuf

        seeds["town.fcb"] = make_fcb({"a": faces, "b": faces})
    if find_spec("laspy") and find_spec("lazrs"):
        seeds["town.laz"] = _make_cloud(folder / "town.laz")
    if find_spec("pyarrow") and find_spec("shapely"):
        seeds["town.parquet"] = _make_parquet(folder / "town.parquet")
    return seeds


def _face(corners: list) -> dict:
    shape = {"type": "Face3D", "boundary": [list(corner) for corner in corners]}
    return {"type": "Face", "identifier": "f", "face_type": "Wall", "geometry": shape}


def _make_cloud(path: Path) -> bytes:
    """Make a point cloud of ground, a roof and a tree."""
    import laspy  # noqa: PLC0415 - an extra

    header = laspy.LasHeader(point_format=6, version="1.4")
    header.creation_date = date(2026, 1, 1)
    cloud = laspy.LasData(header)
    cloud.x, cloud.y = (one.ravel() for one in np.meshgrid(np.arange(12.0), np.arange(12.0)))
    cloud.z = np.arange(144.0) % 5
    cloud.classification = np.array([2, 6, 5], np.uint8)[np.arange(144) % 3]
    cloud.return_number = np.ones(144, np.uint8)
    cloud.write(path)
    return path.read_bytes()


def _make_parquet(path: Path) -> bytes:
    """Make footprints with Overture's columns and a box of each."""
    import pyarrow as pa  # noqa: PLC0415 - extras
    import shapely  # noqa: PLC0415
    from pyarrow import parquet  # noqa: PLC0415

    shapes = [shapely.box(x, 48.0, x + 0.001, 48.001) for x in (11.0, 11.1, 11.2)]
    box = [dict(zip(("xmin", "ymin", "xmax", "ymax"), one.bounds, strict=True)) for one in shapes]
    table = {"id": ["a", "b", "c"], "geometry": shapely.to_wkb(shapes), "bbox": box,
             "height": [5.0, None, 7.5], "num_floors": [1, 2, None],
             "is_underground": [False, False, True]}  # fmt: skip
    parquet.write_table(pa.table(table), path, compression="none")
    return path.read_bytes()


def _make_holes() -> bytes:
    """Make footprints with yards, columns of text and heights in several ways."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    features = []
    for n in range(6):
        outer = (square * 40 + [60 * n, 0]).tolist()
        yards = [(square[::-1] * 5 + [60 * n + 10 * k + 3, 12]).tolist() for k in range(3)]
        features.append(
            {
                "type": "Feature",
                "properties": {"height": [12, "9,5", "7 m", None, 30.25, "3"][n], "use": "school"},
                "geometry": {"type": "Polygon", "coordinates": [outer, *yards]},
            }
        )
    named = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::31256"}}
    return json.dumps({"type": "FeatureCollection", "crs": named, "features": features}).encode()
