"""
Make an example city quarter as a CityJSON 2.0 file: the model that `make study` runs on.

    python examples/city_block.py block.city.json
    python examples/city_block.py block.city.json --no-trees

Three perimeter blocks of gabled houses with courtyards, a church with a spire on a square,
a high-rise on a podium, and trees. Every house is a closed solid of WallSurface, RoofSurface
and GroundSurface; trees are instances of two templates. The place is in Vienna (EPSG:31256),
so `umbra study` knows the latitude, the longitude, true north and the time zone. The script
needs only the standard library.
"""

import argparse
import json
import math
import random
from itertools import pairwise
from pathlib import Path

CRS = "https://www.opengis.net/def/crs/EPSG/0/31256"  # MGI / Austria GK East, metres
CENTRE = (2680.0, 340120.0)  # of the quarter, in that CRS [m]
GROUND = 171.0  # above the Adriatic [m]
TURN = math.radians(-14)  # the streets do not run due north
SCALE = 0.001  # the file's unit: a millimetre
UPRIGHT = 0.01  # z of a wall's unit normal at most

Point = tuple[float, float, float]
Plan = list[tuple[float, float]]


class City:
    """The file as it grows: shared vertices in whole millimetres, and objects."""

    def __init__(self) -> None:
        self.vertices: dict[tuple[int, int, int], int] = {}
        self.objects: dict[str, dict] = {}

    def vertex(self, point: Point) -> int:
        """Return the index of a point of the quarter's own frame, turned into the CRS."""
        x, y, z = point
        east = x * math.cos(TURN) - y * math.sin(TURN)
        north = x * math.sin(TURN) + y * math.cos(TURN)
        key = (round(east / SCALE), round(north / SCALE), round(z / SCALE))
        return self.vertices.setdefault(key, len(self.vertices))

    def add(self, name: str, faces: list[list[list[Point]]], kind: str = "Building") -> dict:
        """Add a closed solid; each face is a list of rings, the outer one first."""
        shell = [[[self.vertex(point) for point in ring] for ring in face] for face in faces]
        solid = {
            "type": "Solid",
            "lod": "2.2",
            "boundaries": [shell],
            "semantics": {
                "surfaces": [{"type": kind} for kind in SURFACES],
                "values": [[find_surface(face[0]) for face in faces]],
            },
        }
        self.objects[name] = {"type": kind, "geometry": [solid]}
        return self.objects[name]

    def plant(self, name: str, template: int, x: float, y: float, size: float) -> None:
        """Place a tree: a template scaled by its height [m]."""
        matrix = [size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, 0, 0, 0, 1]
        self.objects[name] = {
            "type": "SolitaryVegetationObject",
            "geometry": [
                {
                    "type": "GeometryInstance",
                    "template": template,
                    "boundaries": [self.vertex((x, y, 0.0))],
                    "transformationMatrix": matrix,
                }
            ],
        }

    def to_json(self) -> dict:
        """Return the whole file."""
        shapes, points = make_trees()
        return {
            "type": "CityJSON",
            "version": "2.0",
            "metadata": {"referenceSystem": CRS, "title": "An invented quarter"},
            "transform": {"scale": [SCALE] * 3, "translate": [*CENTRE, GROUND]},
            "geometry-templates": {"templates": shapes, "vertices-templates": points},
            "CityObjects": self.objects,
            "vertices": [list(key) for key in self.vertices],
        }


SURFACES = ["WallSurface", "RoofSurface", "GroundSurface"]


def find_surface(ring: list[Point]) -> int:
    """Tell wall, roof and ground apart by the upward part of a ring's normal."""
    pairs = list(zip(ring, ring[1:] + ring[:1]))
    nx = sum((a[1] - b[1]) * (a[2] + b[2]) for a, b in pairs)
    ny = sum((a[2] - b[2]) * (a[0] + b[0]) for a, b in pairs)
    nz = sum((a[0] - b[0]) * (a[1] + b[1]) for a, b in pairs)
    upward = nz / math.hypot(nx, ny, nz)
    return 0 if abs(upward) < UPRIGHT else (1 if upward > 0 else 2)


def sweep_house(path: Plan, depth: float, eaves: float, ridge: float) -> list[list[list[Point]]]:
    """
    Sweep a gabled cross-section along a path, mitred where it bends.

    The ridge runs over the path; eaves and ridge are heights [m].
    """
    stations = []
    for i, (x, y) in enumerate(path):
        before = direction(path[max(i - 1, 0)], path[max(i, 1)])
        after = direction(path[min(i, len(path) - 2)], path[min(i + 1, len(path) - 1)])
        bx, by = before[0] + after[0], before[1] + after[1]
        length = math.hypot(bx, by)
        # To the left of the path, longer at a mitre.
        reach = depth / 2 / ((before[0] * bx + before[1] * by) / length)
        nx, ny = -by / length * reach, bx / length * reach
        stations.append(
            [
                (x - nx, y - ny, 0.0),
                (x - nx, y - ny, eaves),
                (x, y, ridge),
                (x + nx, y + ny, eaves),
                (x + nx, y + ny, 0.0),
            ]
        )
    faces = [[stations[0]], [stations[-1][::-1]]]
    for one, two in pairwise(stations):
        for k in range(5):
            m = (k + 1) % 5
            faces.append([[one[k], two[k], two[m], one[m]]])
    return faces


def direction(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    """Return the unit vector from a to b."""
    length = math.dist(a, b)
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def raise_prism(plan: Plan, height: float, apex: Point | None = None) -> list[list[list[Point]]]:
    """Raise a plan, counter-clockwise, to a flat roof, or to a pointed one."""
    low = [(x, y, 0.0) for x, y in plan]
    high = [(x, y, height) for x, y in plan]
    faces = [[low[::-1]]]
    for i in range(len(plan)):
        j = (i + 1) % len(plan)
        faces.append([[low[i], low[j], high[j], high[i]]])
        if apex is not None:
            faces.append([[high[i], high[j], apex]])
    if apex is None:
        faces.append([high])
    return faces


def stack_boxes(storeys: list[tuple[Plan, float]]) -> list[list[list[Point]]]:
    """Stack ever smaller plans into one solid: each roof has a hole where the next stands."""
    faces = [[[(x, y, 0.0) for x, y in storeys[0][0]][::-1]]]
    floor = 0.0
    for level, (plan, top) in enumerate(storeys):
        for a, b in zip(plan, plan[1:] + plan[:1]):
            faces.append([[(*a, floor), (*b, floor), (*b, top), (*a, top)]])
        roof = [[(x, y, top) for x, y in plan]]
        if level + 1 < len(storeys):
            roof.append([(x, y, top) for x, y in storeys[level + 1][0]][::-1])
        faces.append(roof)
        floor = top
    return faces


def rectangle(x: float, y: float, width: float, depth: float) -> Plan:
    """Return a rectangle about a centre, counter-clockwise."""
    w, d = width / 2, depth / 2
    return [(x - w, y - d), (x + w, y - d), (x + w, y + d), (x - w, y + d)]


def build_perimeter(
    city: City, name: str, centre: tuple[float, float], size: tuple[float, float],
    rng: random.Random, *, gaps: tuple[int, ...] = (), depth: float = 12.5,
) -> None:  # fmt: skip
    """
    Line a rectangular block with gabled houses around a courtyard.

    Four houses turn the corners; the sides between them are cut into houses of 14 to 20 m.
    ``gaps`` names houses left out, counted along the block's sides.
    """
    corners = rectangle(*centre, size[0] - depth, size[1] - depth)
    turn = 15.0  # how far a corner house reaches along each side [m]
    number = plot = 0
    for i, corner in enumerate(corners):
        here, ahead = corners[i - 1], corners[(i + 1) % 4]
        back, on = direction(corner, here), direction(corner, ahead)
        start = (corner[0] + turn * back[0], corner[1] + turn * back[1])
        end = (corner[0] + turn * on[0], corner[1] + turn * on[1])
        runs = [[start, corner, end]]
        free = math.dist(corner, ahead) - 2 * turn
        count = max(1, round(free / 17))
        walls = [free * (k + rng.uniform(-0.12, 0.12)) / count for k in range(1, count)]
        cuts = [0.0, *walls, free]
        for one, two in pairwise(cuts):
            runs.append([(end[0] + t * on[0], end[1] + t * on[1]) for t in (one, two)])
        for k, run in enumerate(runs):
            number += 1
            storeys = rng.choice((4, 5, 5, 6) if k else (5, 6, 6))
            if k:
                plot += 1
            if k and plot in gaps:
                continue
            eaves = 1.0 + 3.4 * storeys
            house = sweep_house(run, depth, eaves, eaves + rng.uniform(4.0, 5.2))
            city.add(f"{name}-{number}", house)


def build_church(city: City, x: float, y: float) -> None:
    """Build a nave with an apse to the east and a tower with a spire to the west."""
    half = 7.5
    nave = sweep_house([(x - 14, y), (x + 16, y)], 2 * half, 12.5, 21.0)
    bend = [(x + 16 + half * math.sin(a), y - half * math.cos(a)) for a in turns(0, math.pi, 5)]
    apse = raise_prism(bend, 10.5, (x + 16, y, 17.0))
    tower = raise_prism(rectangle(x - 18.5, y, 9, 9), 34.0, (x - 18.5, y, 61.0))
    church = {"type": "Building", "children": []}
    city.objects["Church"] = church
    for name, faces in (("nave", nave), ("apse", apse), ("tower", tower)):
        part = city.add(f"Church-{name}", faces, "BuildingPart")
        part["parents"] = ["Church"]
        church["children"].append(f"Church-{name}")


def turns(start: float, end: float, count: int) -> list[float]:
    """Return evenly spaced angles, both ends included."""
    return [start + (end - start) * k / (count - 1) for k in range(count)]


def make_trees() -> tuple[list[dict], list[list[float]]]:
    """Make two templates of trees, 1 m high: a round crown and a slender one."""
    shapes, points = [], []
    for width, bottom in ((0.34, 0.22), (0.17, 0.12)):
        trunk = [(0.025 * math.cos(a), 0.025 * math.sin(a)) for a in turns(0, math.tau, 7)[:-1]]
        solids = [raise_prism(trunk, bottom + 0.1), make_crown(width, bottom)]
        boundaries = []
        for faces in solids:
            shell = []
            for face in faces:
                shell.append([[len(points) + k for k in range(len(face[0]))]])
                points += [list(point) for point in face[0]]
            boundaries.append([shell])
        shapes.append({"type": "MultiSolid", "lod": "2", "boundaries": boundaries})
    return shapes, points


def make_crown(width: float, bottom: float, around: int = 10) -> list[list[list[Point]]]:
    """Make an egg between a height and 1, its widest place a little below the middle."""
    rings = []
    for tilt in turns(0, math.pi, 7)[1:-1]:
        z = bottom + (1 - bottom) * (0.5 - 0.5 * math.cos(tilt)) ** 1.15
        r = width * math.sin(tilt)
        corners = turns(0, math.tau, around + 1)[:-1]
        rings.append([(r * math.cos(a), r * math.sin(a), z) for a in corners])
    south, north = (0.0, 0.0, bottom), (0.0, 0.0, 1.0)
    faces = []
    for i in range(around):
        j = (i + 1) % around
        faces.append([[rings[0][j], rings[0][i], south]])
        faces.append([[rings[-1][i], rings[-1][j], north]])
        for low, high in pairwise(rings):
            faces.append([[low[i], low[j], high[j], high[i]]])
    return faces


def make_quarter(*, trees: bool = True, seed: int = 3) -> dict:
    """
    Make the quarter.

    Returns
    -------
    file : dict
        A CityJSON 2.0 object.
    """
    rng = random.Random(seed)
    city = City()
    build_perimeter(city, "North", (-46, 42), (88, 62), rng)
    build_perimeter(city, "East", (52, 42), (72, 62), rng, gaps=(3,))
    build_perimeter(city, "South", (-54, -40), (72, 66), rng, gaps=(1,))
    city.add("North-court", raise_prism(rectangle(-58, 42, 16, 12), 4.5))
    city.add("South-court", raise_prism(rectangle(-62, -36, 11, 18), 5.0))
    build_church(city, 34, -22)
    podium = (rectangle(52, -66, 40, 22), 8.5)
    city.add("Tower", stack_boxes([podium, (rectangle(58, -66, 18, 18), 62.0),
                                   (rectangle(58, -66, 12, 12), 67.5)]))  # fmt: skip
    if trees:
        rows = [(x, -44) for x in range(0, 72, 9)] + [(x, -2) for x in range(4, 76, 9)]
        courts = [(-34, 48), (-26, 38), (-40, 36), (46, 46), (58, 38), (-48, -46), (-46, -30)]
        for number, (x, y) in enumerate(rows + courts):
            slender = number < len(rows) and number % 4 == 3
            place = (x + rng.uniform(-0.6, 0.6), y + rng.uniform(-0.6, 0.6))
            city.plant(f"Tree-{number + 1}", int(slender), *place, rng.uniform(8.5, 13.5))
    return city.to_json()


def main() -> None:
    """Write the file and print its name."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("file", type=Path, help="CityJSON file to write")
    parser.add_argument("--no-trees", action="store_true")
    parser.add_argument("--seed", type=int, default=3, help="other houses")
    given = parser.parse_args()
    given.file.parent.mkdir(parents=True, exist_ok=True)
    quarter = make_quarter(trees=not given.no_trees, seed=given.seed)
    given.file.write_text(json.dumps(quarter), encoding="utf-8")
    print(given.file)


if __name__ == "__main__":
    main()
