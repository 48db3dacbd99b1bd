"""
Files of a made-up city: a CityGML 2.0 or CityJSONSeq file for each tile, or one file of many.

    python -m umbra_benchmarks.city_files city/ --area 310
    python -m umbra_benchmarks.city_files city.gml --bytes 1000000000

Tiles are made and written one after the other: memory does not grow with the city.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TextIO

import click
import numpy as np
from numpy.typing import NDArray

from umbra_benchmarks.city_model import KM, City, CitySquare
from umbra_benchmarks.city_shapes import Objects, Shape

__all__ = ["ENDINGS", "Written", "write_city", "write_one"]

ENDINGS = {"citygml": ".gml", "cityjsonseq": ".city.jsonl"}
"""Endings of the formats."""
_SCALE = 0.001  # of CityJSON's whole numbers [m]
_LOWEST, _HIGHEST = 400.0, 1000.0  # bounds of every tile [m]
_FUNCTIONS = {"courtyard": "1000", "tower": "1010", "flat": "2000"}
_ROOFS = {"gabled": "3100", "hipped": "3200"}
_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<core:CityModel xmlns:core="http://www.opengis.net/citygml/2.0" \
xmlns:bldg="http://www.opengis.net/citygml/building/2.0" \
xmlns:dem="http://www.opengis.net/citygml/relief/2.0" \
xmlns:veg="http://www.opengis.net/citygml/vegetation/2.0" \
xmlns:gml="http://www.opengis.net/gml" xmlns:xlink="http://www.w3.org/1999/xlink">
<gml:name>{name}</gml:name>
<gml:boundedBy><gml:Envelope srsName="urn:ogc:def:crs,crs:EPSG::25832,crs:EPSG::7837" \
srsDimension="3"><gml:lowerCorner>{low}</gml:lowerCorner>\
<gml:upperCorner>{high}</gml:upperCorner></gml:Envelope></gml:boundedBy>
"""
_TAIL = "</core:CityModel>\n"


@dataclass(frozen=True)
class Written:
    """
    What was written.

    Parameters
    ----------
    files, buildings, trees, triangles, bytes : int
        Triangles as polygons are cut into them.
    """

    files: int = 0
    buildings: int = 0
    trees: int = 0
    triangles: int = 0
    bytes: int = 0

    def add(self, tile: CitySquare) -> "Written":
        """Return the same with a tile more."""
        triangles = 2 * (tile.terrain.shape[0] - 1) * (tile.terrain.shape[1] - 1)
        for some in (*tile.buildings, tile.trees):
            polygons = [rings for part in some.shape.parts for _, rings in part]
            cut = sum(sum(map(len, rings)) + 2 * len(rings) - 4 for rings in polygons)
            triangles += cut * len(some.names)
        return replace(
            self,
            buildings=self.buildings + tile.building_count,
            trees=self.trees + len(tile.trees.names),
            triangles=self.triangles + triangles,
        )

    def add_file(self, path: Path) -> "Written":
        """Return the same with a file more."""
        return replace(self, files=self.files + 1, bytes=self.bytes + path.stat().st_size)


def write_city(
    city: City,
    folder: Path,
    file_format: str = "citygml",
    say: Callable[[int, int], object] = lambda _done, _all: None,
) -> Written:
    """
    Write a file for each tile.

    Parameters
    ----------
    city : City
    folder : path
        Made if missing.
    file_format : {'citygml', 'cityjsonseq'}
    say : callable
        Called with the number of files written and of all.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = Written()
    for n, tile in enumerate(city.tiles()):
        name = f"LoD2_32_{tile.corner[0]}_{tile.corner[1]}"
        path = folder / (name + ENDINGS[file_format])
        with path.open("w", encoding="ascii", newline="\n") as file:
            _write_tiles(file, iter([tile]), [tile.corner], file_format)
        written = written.add(tile).add_file(path)
        say(n + 1, city.area)
    return written


def write_one(city: City, path: Path, size: int = 10**9) -> Written:
    """
    Write one CityGML file of as many of a city's tiles as reach a size.

    Parameters
    ----------
    city : City
    path : path
    size : int
        Least number of bytes, if the city is large enough.
    """
    written = Written()

    def take() -> Iterator[CitySquare]:
        nonlocal written
        for tile in city.tiles():
            if file.tell() >= size:
                return
            yield tile
            written = written.add(tile)

    with path.open("w", encoding="ascii", newline="\n") as file:
        _write_tiles(file, take(), city.corners, "citygml")
    return written.add_file(path)


def _write_tiles(
    file: TextIO, tiles: Iterator[CitySquare], corners: list[tuple[int, int]], file_format: str
) -> None:
    """Write tiles that lie among some corners [km] into one file."""
    low, high = np.min(corners, 0) * KM, (np.max(corners, 0) + 1) * KM
    if file_format == "citygml":
        name = f"made-up city, {len(corners)} km2"
        ends = [f"{x:.3f} {y:.3f} {z:.3f}" for (x, y), z in ((low, _LOWEST), (high, _HIGHEST))]
        file.write(_HEAD.format(name=name, low=ends[0], high=ends[1]))
        for tile in tiles:
            file.writelines(_to_gml(tile))
        file.write(_TAIL)
        return
    translate = [*low.tolist(), _LOWEST]
    head = {
        "type": "CityJSON", "version": "2.0", "CityObjects": {}, "vertices": [],
        "transform": {"scale": [_SCALE] * 3, "translate": translate},
        "metadata": {
            "referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25832",
            "geographicalExtent": [*low.tolist(), _LOWEST, *high.tolist(), _HIGHEST],
        },
    }  # fmt: skip
    file.write(json.dumps(head, separators=(",", ":")) + "\n")
    for tile in tiles:
        file.writelines(_to_sequence(tile, np.array(translate)))


def _to_gml(tile: CitySquare) -> Iterator[str]:
    """Write a tile's objects as members of a city model."""
    for some in (*tile.buildings, tile.trees):
        pattern, order = _make_gml_pattern(some.shape)
        corners = some.vertices[:, order].reshape(len(some.names), -1).tolist()
        for name, numbers in zip(some.names, corners, strict=True):
            yield (pattern % tuple(numbers)).replace("@", name)
    name = f"dtm{tile.corner[0]}_{tile.corner[1]}"
    yield (
        f'<core:cityObjectMember><dem:ReliefFeature gml:id="{name}"><dem:lod>2</dem:lod>'
        f'<dem:reliefComponent><dem:TINRelief gml:id="{name}_tin"><dem:lod>2</dem:lod><dem:tin>'
        "<gml:TriangulatedSurface><gml:trianglePatches>\n"
    )
    place = "%.3f %.3f %.3f"
    pattern = (
        "<gml:Triangle><gml:exterior><gml:LinearRing><gml:posList>"
        f"{place} {place} {place} {place}"
        "</gml:posList></gml:LinearRing></gml:exterior></gml:Triangle>\n"
    )
    corners = _cut(tile.terrain)[:, [0, 1, 2, 0]].reshape(-1, 12).tolist()
    yield from (pattern % tuple(numbers) for numbers in corners)
    yield (
        "</gml:trianglePatches></gml:TriangulatedSurface></dem:tin></dem:TINRelief>"
        "</dem:reliefComponent></dem:ReliefFeature></core:cityObjectMember>\n"
    )


def _make_gml_pattern(shape: Shape) -> tuple[str, list[int]]:
    """Return an object's text with a % for each number and @ for its name, and the corners."""
    order: list[int] = []

    def write_polygon(name: str, rings: tuple[tuple[int, ...], ...]) -> str:
        named = f' gml:id="{name}"' if name else ""
        text = f"<gml:surfaceMember><gml:Polygon{named}>"
        for end, ring in zip(("exterior", *["interior"] * len(rings[1:])), rings, strict=True):
            order.extend((*ring, ring[0]))
            numbers = " ".join(["%.3f"] * 3 * (len(ring) + 1))
            text += (
                f'<gml:{end}><gml:LinearRing><gml:posList srsDimension="3">{numbers}'
                f"</gml:posList></gml:LinearRing></gml:{end}>"
            )
        return text + "</gml:Polygon></gml:surfaceMember>"

    if shape.name == "crown":
        faces = "".join(write_polygon("", rings) for _, rings in shape.parts[0])
        text = (
            '<core:cityObjectMember><veg:SolitaryVegetationObject gml:id="@"><veg:class>1070'
            f"</veg:class><veg:lod2Geometry><gml:MultiSurface>{faces}</gml:MultiSurface>"
            "</veg:lod2Geometry></veg:SolitaryVegetationObject></core:cityObjectMember>\n"
        )
        return text, order

    def write_part(letter: str, part: tuple) -> str:
        """Write the solid by links, as German states do, and the surfaces it links to."""
        names = [f"@{letter}{k}" for k in range(len(part))]
        surfaces = "".join(
            f"<bldg:boundedBy><bldg:{kind}><bldg:lod2MultiSurface><gml:MultiSurface>"
            f"{write_polygon(name, rings)}</gml:MultiSurface></bldg:lod2MultiSurface>"
            f"</bldg:{kind}></bldg:boundedBy>\n"
            for name, (kind, rings) in zip(names, part, strict=True)
        )
        links = "".join(f'<gml:surfaceMember xlink:href="#{name}"/>' for name in names)
        return (
            f"<bldg:roofType>{_ROOFS.get(shape.name, '1000')}</bldg:roofType>\n"
            "<bldg:lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface>"
            f"{links}</gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod2Solid>\n{surfaces}"
        )

    function = f"<bldg:function>{_FUNCTIONS.get(shape.name, '1100')}</bldg:function>"
    if len(shape.parts) == 1:
        inner = function + write_part("_", shape.parts[0])
    else:
        inner = function + "".join(
            f'<bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id="@_{k}">'
            f"{write_part(f'_{k}_', part)}</bldg:BuildingPart></bldg:consistsOfBuildingPart>"
            for k, part in enumerate(shape.parts)
        )
    text = (
        f'<core:cityObjectMember><bldg:Building gml:id="@">{inner}</bldg:Building>'
        "</core:cityObjectMember>\n"
    )
    return text, order


def _to_sequence(tile: CitySquare, translate: NDArray[np.float64]) -> Iterator[str]:
    """Write a tile's objects as lines of a CityJSON sequence."""
    for some in (*tile.buildings, tile.trees):
        pattern = _make_json_pattern(some.shape)
        for name, vertices in zip(some.names, _to_whole(some, translate), strict=True):
            text = json.dumps(vertices, separators=(",", ":"))
            yield f"{pattern.replace('@', name)}{text}}}\n"
    name = f"dtm{tile.corner[0]}_{tile.corner[1]}"
    rows, cols = tile.terrain.shape[:2]
    number = np.arange(rows * cols).reshape(rows, cols)
    faces = _cut(number[..., None])[..., 0]
    geometry = {
        "type": "CompositeSurface", "lod": "2", "boundaries": faces[:, None].tolist(),
    }  # fmt: skip
    whole = np.rint((tile.terrain.reshape(-1, 3) - translate) / _SCALE).astype(np.int64)
    feature = {
        "type": "CityJSONFeature", "id": name,
        "CityObjects": {name: {"type": "TINRelief", "geometry": [geometry]}},
        "vertices": whole.tolist(),
    }  # fmt: skip
    yield json.dumps(feature, separators=(",", ":")) + "\n"


def _to_whole(some: Objects, translate: NDArray[np.float64]) -> list[list[list[int]]]:
    """Return the corners of objects as whole numbers."""
    found: list[list[list[int]]] = (
        np.rint((some.vertices - translate) / _SCALE).astype(np.int64).tolist()
    )
    return found


def _make_json_pattern(shape: Shape) -> str:
    """Return an object's line up to its vertices, with @ for its name."""

    def write_geometry(part: tuple) -> dict:
        boundaries = [[list(ring) for ring in rings] for _, rings in part]
        if not part[0][0]:
            return {"type": "MultiSurface", "lod": "2", "boundaries": boundaries}
        kinds = list(dict.fromkeys(kind for kind, _ in part))
        values = [kinds.index(kind) for kind, _ in part]
        semantics = {"surfaces": [{"type": kind} for kind in kinds], "values": [values]}
        return {"type": "Solid", "lod": "2.2", "boundaries": [boundaries], "semantics": semantics}

    kind = "SolitaryVegetationObject" if shape.name == "crown" else "Building"
    if len(shape.parts) == 1:
        objects = {"@": {"type": kind, "geometry": [write_geometry(shape.parts[0])]}}
    else:
        children = [f"@_{k}" for k in range(len(shape.parts))]
        objects = {"@": {"type": kind, "children": children, "geometry": []}}
        for name, part in zip(children, shape.parts, strict=True):
            geometry = [write_geometry(part)]
            objects[name] = {"type": "BuildingPart", "parents": ["@"], "geometry": geometry}
    feature = {"type": "CityJSONFeature", "id": "@", "CityObjects": objects}
    return json.dumps(feature, separators=(",", ":"))[:-1] + ',"vertices":'


def _cut(lattice: NDArray) -> NDArray:
    """Cut the squares of a lattice (n, m, k) into triangles, (2 * squares, 3, k)."""
    a, b, c, d = lattice[:-1, :-1], lattice[:-1, 1:], lattice[1:, 1:], lattice[1:, :-1]
    pairs = np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2)
    return pairs.reshape(-1, 3, lattice.shape[-1])


@click.command()
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--area", type=click.IntRange(1), default=310, show_default=True, help="km².")
@click.option("--seed", type=int, default=1, show_default=True)
@click.option("--buildings", type=float, default=580.0, show_default=True, help="On a km².")
@click.option("--trees", type=float, default=0.5, show_default=True, help="Share of places.")
@click.option("--format", "file_format", type=click.Choice([*ENDINGS]), default="citygml")
@click.option("--bytes", "size", type=click.IntRange(1), help="One CityGML file of this size.")
def main(
    out: Path, area: int, seed: int, buildings: float, trees: float, file_format: str,
    size: int | None,
) -> None:  # fmt: skip
    """Write the files of a made-up city into the folder OUT, or one file OUT."""
    city = City(area, seed, buildings, trees)
    written = write_city(city, out, file_format) if size is None else write_one(city, out, size)
    click.echo(
        f"{written.files:,} files, {written.bytes / 1e6:,.0f} MB: {written.buildings:,} buildings, "
        f"{written.trees:,} trees, {written.triangles:,} triangles"
    )


if __name__ == "__main__":
    main()
