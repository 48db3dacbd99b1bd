"""
Small files that ask for much memory or time: each is refused in bounded memory and time.

Files are made here, as binaries in a repository can hide anything. `read_alone` reads one by the
command and measures it; ``make fuzz`` does so with each of `BOMBS`.
"""

import json
import sqlite3
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from support.gml_files import building as gml_building
from support.gml_files import city as gml_city
from support.gml_files import polygon, surfaces
from support.model_files import save_obj
from support.shapes import box

__all__ = ["BOMBS", "MOST_MEMORY", "Reading", "are_there", "read_alone"]

RECURSIVE = (
    "CREATE VIEW towers AS WITH RECURSIVE endless(fid, geom, height) AS (SELECT 1, (SELECT geom "
    "FROM houses), 9.0 UNION ALL SELECT fid + 1, geom, height FROM endless) SELECT * FROM endless"
)


def save_footprints(path: Path, **columns) -> Path:
    """Save a square for each value of the columns, by pyogrio."""
    import shapely  # noqa: PLC0415 - an extra
    from pyogrio.raw import write  # noqa: PLC0415

    count = len(next(iter(columns.values())))
    squares = shapely.to_wkb([shapely.box(9 * n, 0, 9 * n + 6, 6) for n in range(count)])
    write(
        path, squares, [np.array(one) for one in columns.values()], list(columns),
        geometry_type="Polygon", crs="EPSG:25832", layer="houses",
    )  # fmt: skip
    return path


def save_view(path: Path, view: str = RECURSIVE) -> Path:
    """Save a GeoPackage whose second table is a view."""
    save_footprints(path, height=[9.0])
    with sqlite3.connect(path) as store:
        store.execute(view)
        for table in ("gpkg_contents", "gpkg_geometry_columns"):
            rows = store.execute(f"SELECT * FROM {table}").fetchall()
            for row in rows:
                words = ["towers" if word == "houses" else word for word in row]
                store.execute(f"INSERT INTO {table} VALUES ({','.join('?' * len(row))})", words)
            store.execute(f"DELETE FROM {table} WHERE table_name = 'houses'")
    store.close()
    return path


def make_view(folder: Path) -> Path:
    """Make a GeoPackage whose table is a view without an end."""
    return save_view(folder / "view.gpkg")


def _save_parquet(path: Path, shape: bytes, rows: int, label: str) -> Path:
    """Save rows that all have one shape and one label, each once in a dictionary."""
    import pyarrow as pa  # noqa: PLC0415 - an extra
    from pyarrow import parquet  # noqa: PLC0415

    each = pa.array(np.zeros(rows, np.int32))
    table = pa.table({
        "geometry": pa.DictionaryArray.from_arrays(each, pa.array([shape])),
        "height": np.full(rows, 9.0),
        "label": pa.DictionaryArray.from_arrays(each, pa.array([label])),
    })  # fmt: skip
    facts = {"encoding": "WKB", "geometry_types": ["Polygon"]}
    told = {"version": "1.0.0", "primary_column": "geometry", "columns": {"geometry": facts}}
    parquet.write_table(
        table.replace_schema_metadata({"geo": json.dumps(told)}), path, compression="zstd",
        dictionary_pagesize_limit=1 << 30, store_schema=False,
    )  # fmt: skip
    return path


def make_words(folder: Path) -> Path:
    """Make GeoParquet whose rows repeat one long text of a dictionary: 6 GB."""
    import shapely  # noqa: PLC0415

    square = shapely.to_wkb(shapely.box(0, 0, 6, 6))
    return _save_parquet(folder / "words.parquet", square, 6000, "a" * 1_000_000)


def make_shapes(folder: Path) -> Path:
    """Make GeoParquet whose rows repeat one large polygon of a dictionary: 5 GB."""
    import shapely  # noqa: PLC0415

    turn = np.linspace(0, 2 * np.pi, 12_000, endpoint=False)
    disc = shapely.to_wkb(shapely.polygons(np.column_stack([9 * np.cos(turn), 9 * np.sin(turn)])))
    return _save_parquet(folder / "shapes.parquet", disc, 26_000, "disc")


def _pack(path: Path, text: bytes, names: list[str], copies: int) -> Path:
    """Write an archive by hand: ``copies`` entries of the directory for each packed member."""
    squeezed = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = squeezed.compress(text) + squeezed.flush()
    facts = (zlib.crc32(text), len(packed), len(text))
    body, entries = b"", []
    for name in names:
        word = name.encode()
        here = len(body)
        body += struct.pack("<4s5H3I2H", b"PK\3\4", 20, 0, 8, 0, 33, *facts, len(word), 0)
        body += word + packed
        entry = struct.pack("<4s6H3I5H2I", b"PK\1\2", 20, 20, 0, 8, 0, 33, *facts, len(word),
                            0, 0, 0, 0, 0, here)  # fmt: skip
        entries += [entry + word] * copies
    listed = b"".join(entries)
    end = struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, len(entries), len(entries), len(listed),
                      len(body), 0)  # fmt: skip
    path.write_bytes(body + listed + end)
    return path


def _make_town(count: int) -> bytes:
    """Make a CityGML file that repeats one house."""
    return gml_city(*[gml_building()] * count).encode()


def make_members(folder: Path) -> Path:
    """Make an archive of 30 members that each unpack to 10 MB, half of it comments."""
    town = _make_town(2000) + b"<!--" + b"-->\n<!--".join([b"a" * 1000] * 5000) + b"-->"
    return _pack(folder / "members.zip", town, [f"{n}.gml" for n in range(30)], 1)


def make_overlap(folder: Path) -> Path:
    """Make an archive whose 125 members are one and the same bytes."""
    return _pack(folder / "overlap.zip", _make_town(20_000), ["town.gml"], 125)


def make_implicit(folder: Path) -> Path:
    """Make a set whose implicit tiles are all there: 4^32."""
    told = {"constant": 1}
    text = json.dumps({"tileAvailability": told, "contentAvailability": {"constant": 0},
                       "childSubtreeAvailability": told}).encode()  # fmt: skip
    (folder / "all.subtree").write_bytes(struct.pack("<4sIQQ", b"subt", 1, len(text), 0) + text)
    tiling = {"subdivisionScheme": "QUADTREE", "subtreeLevels": 12, "availableLevels": 32,
              "subtrees": {"uri": "all.subtree"}}  # fmt: skip
    root = {"boundingVolume": {"box": [0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9]}, "geometricError": 9,
            "refine": "REPLACE", "implicitTiling": tiling}  # fmt: skip
    path = folder / "implicit.json"
    path.write_text(json.dumps({"asset": {"version": "1.1"}, "geometricError": 9, "root": root}))
    return path


def make_chain(folder: Path) -> Path:
    """Make ten sets of tiles that each name the next ten times: 10^10 tiles."""
    volume = {"box": [0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9]}
    for number in range(10):
        tile = {"boundingVolume": volume, "geometricError": 1,
                "content": {"uri": f"chain{number + 1}.json"}}  # fmt: skip
        root = {"boundingVolume": volume, "geometricError": 9, "refine": "ADD",
                "children": [tile] * 10}  # fmt: skip
        tree = {"asset": {"version": "1.0"}, "geometricError": 9, "root": root}
        (folder / f"chain{number}.json").write_text(json.dumps(tree))
    (folder / "chain10.json").write_text(json.dumps({**tree, "root": {**root, "children": []}}))
    return folder / "chain0.json"


def make_library(folder: Path) -> Path:
    """Make an OBJ file that names a library by a line of 3 MB."""
    path = save_obj(folder / "library.obj", {"house": box((0, 0, 0), (3, 3, 3))})
    path.write_bytes(b"mtllib " + b"a/" * 1_500_000 + b"\n" + path.read_bytes())
    return path


def make_libraries(folder: Path) -> Path:
    """Make an OBJ file that names 300,000 libraries."""
    path = save_obj(folder / "libraries.obj", {"house": box((0, 0, 0), (3, 3, 3))})
    lines = b"".join(b"mtllib %d\n" % number for number in range(300_000))
    path.write_bytes(lines + path.read_bytes())
    return path


def make_cloud(folder: Path) -> Path:
    """Make a point cloud that says to have four billion points."""
    import laspy  # noqa: PLC0415 - an extra

    path = folder / "cloud.laz"
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = [0.01, 0.01, 0.01]
    points = laspy.LasData(header)
    dice = np.random.default_rng(0)
    points.x, points.y, points.z = dice.uniform(0, 100, (3, 200_000))
    points.write(path)
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, 247, 4_000_000_000)
    struct.pack_into("<Q", data, 255, 4_000_000_000)
    path.write_bytes(data)
    return path


def make_links(folder: Path) -> Path:
    """Make CityGML of 150,000 links to one surface."""
    links = surfaces(*["s"] * 150_000)
    one = polygon([(0, 0, 0), (4, 0, 0), (4, 6, 0), (0, 6, 0)], "s")
    members = [
        f'<c:Building gml:id="{name}"><c:lod2MultiSurface>{held}</c:lod2MultiSurface></c:Building>'
        for name, held in (("b", links), ("o", surfaces(one)))
    ]
    path = folder / "links.gml"
    path.write_text(gml_city(*members))
    return path


def make_doubling(folder: Path) -> Path:
    """Make a Rhino file of 40 blocks that each hold the one before twice."""
    import rhino3dm as rhino  # noqa: PLC0415 - an extra

    file = rhino.File3dm()
    mesh = rhino.Mesh()
    for corner in ((0, 0, 0), (3, 0, 0), (0, 3, 0)):
        mesh.Vertices.Add(*corner)
    mesh.Faces.AddFace(0, 1, 2)
    origin = rhino.Point3d(0, 0, 0)
    attributes = rhino.ObjectAttributes()
    held = [mesh]
    for number in range(40):
        index = file.InstanceDefinitions.Add(
            f"block {number}", "", "", "", origin, tuple(held), (attributes,) * len(held)
        )
        block = file.InstanceDefinitions.FindIndex(index).Id
        still = rhino.Transform.Identity()
        held = [rhino.InstanceReference(block, still) for _ in range(2)]
    for one in held:
        file.Objects.AddInstanceObject(one)
    path = folder / "doubling.3dm"
    file.Write(str(path), 7)
    return path


def make_endless(folder: Path) -> Path:
    """Make an IFC file with bodies that reach to infinity, at which the engine hangs."""
    from support.ifc_files import IfcFile  # noqa: PLC0415 - an extra

    made = IfcFile()
    places = []
    for number in range(12):
        wall = made.box("IfcWall", f"wall {number}", (4, 0.5, 3), at=(5 * number, 0, 0))
        made.opening(wall, (1, 0.5, 1), at=(5 * number + 1, 0, 1))
        places.append(wall.ObjectPlacement.RelativePlacement.Location.id())
    path = folder / "inf.ifc"
    made.file.write(str(path))
    text = path.read_text()
    for place in places:
        text = text.replace(
            f"#{place}=IFCCARTESIANPOINT((0.,", f"#{place}=IFCCARTESIANPOINT((-inf,"
        )
    path.write_text(text)
    return path


def make_stars(folder: Path) -> Path:
    """Make GeoJSON of a star of 120,000 edges that all pass each other."""
    turn = np.linspace(0, 2 * np.pi, 120_000)
    reach = np.where(np.arange(len(turn)) % 2, 1.0, 1000.0)
    ring = np.column_stack([reach * np.cos(turn), reach * np.sin(turn)]).round(4).tolist()
    ring[-1] = ring[0]
    shape = {"type": "Polygon", "coordinates": [ring]}
    path = folder / "star.geojson"
    path.write_text(json.dumps({"type": "Feature", "properties": {"height": 9}, "geometry": shape}))
    return path


def make_properties(folder: Path) -> Path:
    """Make GeoJSON of 3,000 features that each have 100 properties of their own."""
    shape = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}
    features = [
        {
            "type": "Feature",
            "properties": {"height": 3, **{f"k{n}_{m}": 1 for m in range(100)}},
            "geometry": shape,
        }
        for n in range(3000)
    ]
    path = folder / "properties.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def make_large_member(folder: Path) -> Path:
    """Make an archive whose one member unpacks to 150 MB of houses."""
    return _pack(folder / "member.zip", _make_town(60_000), ["town.gml"], 1)


def make_kinds(folder: Path) -> Path:
    """Make CityJSON whose template has 5,000 surface types and stands in 3,000 places."""
    count = 5000
    template = {
        "type": "MultiSurface", "lod": "2", "boundaries": [[[0, 1, 2]]] * count,
        "semantics": {"surfaces": [{"type": f"+{n}"} for n in range(count)],
                      "values": list(range(count))},
    }  # fmt: skip
    place = {"type": "GeometryInstance", "template": 0, "boundaries": [0]}
    head = {
        "type": "CityJSON", "version": "2.0", "vertices": [[0, 0, 0]],
        "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]},
        "CityObjects": {f"{n}": {"type": "PlantCover", "geometry": [place]} for n in range(3000)},
        "geometry-templates": {"templates": [template],
                               "vertices-templates": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]},
    }  # fmt: skip
    path = folder / "kinds.city.json"
    path.write_text(json.dumps(head))
    return path


def make_elements(folder: Path) -> Path:
    """Make an archive of 47 kB whose one building has twelve million elements."""
    text = gml_city("<c:a>" + "<a/>" * 12_000_000 + "</c:a>").encode()
    return _pack(folder / "elements.zip", text, ["town.gml"], 1)


def make_records(folder: Path) -> Path:
    """Make a point cloud that says to have four billion records before its points."""
    path = make_cloud(folder)
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, 100, 2**32 - 1)
    path.write_bytes(data)
    return path


def _save_faces(path: Path, counts: range) -> Path:
    """Save an OBJ file of faces that go around one square, of so many corners each."""
    faces = "".join(f"f {'1 2 3 4 ' * (n // 4)}\n" for n in counts)
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + faces)
    return path


def make_corners(folder: Path) -> Path:
    """Make an OBJ file of 9 MB: faces of up to 3,000 corners."""
    return _save_faces(folder / "corners.obj", range(8, 3000))


def make_face(folder: Path) -> Path:
    """Make an OBJ file of 2 MB: a face of a million corners."""
    return _save_faces(folder / "face.obj", range(1_000_000, 1_000_001))


MOST_SECONDS, MOST_MEMORY = 10.0, 1e9
"""Processor time [s] and memory [byte] that reading any of these files may take."""

BOMBS: dict[str, tuple[Callable[[Path], Path], tuple[str, ...], str]] = {
    "a view without an end": (make_view, ("pyogrio", "shapely"), "views"),
    "a dictionary of one text": (make_words, ("pyarrow", "shapely"), "max-memory"),
    "a dictionary of one polygon": (make_shapes, ("pyarrow", "shapely"), "max-memory"),
    "an archive of 30 members": (make_members, ("lxml",), "max-memory"),
    "an archive of overlapping members": (make_overlap, ("lxml",), "overlap"),
    "implicit tiles": (make_implicit, (), "max-memory"),
    "a chain of sets of tiles": (make_chain, (), "max-memory"),
    "a library named by 3 MB": (make_library, (), ""),
    "300,000 libraries": (make_libraries, (), "max-memory"),
    "a point cloud of four billion points": (make_cloud, ("laspy", "lazrs"), "damaged"),
    "a point cloud of four billion records": (make_records, ("laspy", "lazrs"), "records"),
    "150,000 links to a surface": (make_links, ("lxml",), ""),
    "blocks of blocks": (make_doubling, ("rhino3dm",), "max-memory"),
    "a star of 120,000 edges": (make_stars, ("shapely",), ""),
    "300,000 properties": (make_properties, ("shapely",), "max-memory"),
    "an archive of one large member": (make_large_member, ("lxml",), "max-memory"),
    "surface types of a template": (make_kinds, (), "max-memory"),
    "a building of twelve million elements": (make_elements, ("lxml",), "max-memory"),
    "faces of many corners over four points": (make_corners, (), "max-memory"),
    "a face of a million corners": (make_face, (), "max-memory"),
    "bodies that reach to infinity": (make_endless, ("ifcopenshell",), "took too long"),
}
"""What makes each file, the packages that it needs, and a word of its error; none if it is read."""


def are_there(packages: tuple[str, ...]) -> bool:
    """Return whether packages are installed."""
    return all(find_spec(package) for package in packages)


@dataclass(frozen=True)
class Reading:
    """How a command ended that read a file."""

    status: int
    said: str
    seconds: float  # of processor time, with its reading children [s]
    memory: float  # the most of any of its processes [byte]

    def find_fault(self, word: str) -> str:
        """Return what is wrong, in a line; empty if the file was read or refused as it should."""
        lines = self.said.splitlines()
        if self.seconds > MOST_SECONDS or self.memory > MOST_MEMORY:
            return f"took {self.seconds:.1f} s and {self.memory / 1e6:.0f} MB"
        if not word:
            return "" if self.status == 0 else f"was not read ({self.status}): {self.said[-300:]}"
        lines = [line for line in lines if not line.startswith("umbra: reading ")]
        if self.status != 2 or len(lines) != 1 or word not in lines[0]:
            return f"ended with {self.status}: {self.said[-300:]}"
        return ""


# A process's peak is at first that of the process that started it, here a small one.
MEASURE = """
import json, os, resource, subprocess, sys
resource.setrlimit(resource.RLIMIT_AS, (6_000_000_000, 6_000_000_000))
run = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
said = run.stderr.read().decode(errors="replace")
_, status, used = os.wait4(run.pid, 0)
run.returncode = os.waitstatus_to_exitcode(status)
print(json.dumps([run.returncode, said, used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss]))
"""


def read_alone(path: Path) -> Reading:
    """Read a file by the command, in a process whose memory is limited."""
    command = [Path(sys.executable).with_name("umbra"), "inspect", path, "--no-cache"]
    run = [sys.executable, "-c", MEASURE, *map(str, command)]
    return Reading(*json.loads(subprocess.run(run, stdout=subprocess.PIPE, check=True).stdout))
