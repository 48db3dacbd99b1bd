"""
Make an office's case: gardens and windows around the place of a proposed house in a quarter.

    python examples/office_case.py QUARTER FOLDER X Y [--windows 200]

QUARTER is a model of buildings; X, Y is where the house will stand, in its coordinates [m]. Writes
``gardens.geojson`` (four, without what is built on them) and ``windows.csv`` (of the walls
nearest to the house, storey by storey, with the flats behind) into FOLDER.
"""

import argparse
import csv
import itertools
import json
from pathlib import Path

import numpy as np
import shapely

import umbra

NEAR, FAR, HALF = 14.0, 30.0, 12.0  # of gardens: distances from the house, half a width [m]
STEP, STOREY = 4.0, 3.2  # between windows along a wall, and upward [m]
LEAST = 1e-6  # twice the area of a triangle in plan that is not upright [m2]
SILL, WIDTH, HEIGHT = 1.0, 1.2, 1.5  # of a window [m]
WAYS = {"north": (0, 1), "east": (1, 0), "south": (0, -1), "west": (-1, 0)}


def find_buildings(scene):
    """Return the outlines of all buildings in plan, as one polygon."""
    soup = scene.triangles(range(len(scene.parts)))
    plan = soup.vertices[soup.faces][..., :2] + scene.origin[:2]
    u, v = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
    lies = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > LEAST
    return shapely.union_all(shapely.polygons(plan[lies]), grid_size=1e-3)


def make_gardens(buildings, place):
    """Return the gardens by name: one on each side of the house."""
    gardens = {}
    for way, toward in WAYS.items():
        out = np.array(toward)
        side = HALF * np.abs(out[::-1])
        corners = np.array([place + NEAR * out - side, place + FAR * out + side])
        box = shapely.box(*corners.min(0), *corners.max(0))
        free = box.difference(buildings.buffer(1.0))
        gardens[f"Garden {way}"] = max(shapely.get_parts(free), key=shapely.area)
    return gardens


def list_windows(scene, buildings, place, count):
    """Return rows of a table of windows, the nearest to the house first."""
    bounds = np.array([part.bounds for part in scene.parts]) + scene.origin
    walls = []
    for ring in shapely.get_rings(shapely.get_parts(buildings)):
        corners = shapely.get_coordinates(ring)
        for start, end in itertools.pairwise(corners):
            length = np.hypot(*(end - start))
            along = (end - start) / length
            out = np.array([along[1], -along[0]])
            for far in np.arange(STEP / 2, length - STEP / 4, STEP):
                walls.append((start + far * along, out))
    rows = []
    for number, (spot, outward) in enumerate(
        sorted(walls, key=lambda w: np.hypot(*(w[0] - place)))
    ):
        is_inward = buildings.contains(shapely.Point(spot + 0.2 * outward))
        out = -outward if is_inward else outward
        behind = spot - 0.5 * out
        here = ((bounds[:, 0, :2] <= behind) & (bounds[:, 1, :2] >= behind)).all(1)
        if not here.any():
            continue
        low, high = bounds[here, 0, 2].min(), bounds[here, 1, 2].max()
        x, y = spot + 0.02 * out  # before the wall
        for storey, foot in enumerate(np.arange(low, high - 2 * STOREY, STOREY)):
            rows.append({
                "name": f"{storey}-{number + 1:03d}", "x": f"{x:.3f}", "y": f"{y:.3f}",
                "z": f"{foot + SILL + HEIGHT / 2:.3f}",
                "azimuth": f"{np.degrees(np.arctan2(*out)) % 360:.1f}", "width": WIDTH,
                "height": HEIGHT, "flat": f"{storey}-{number // 3 + 1:02d}", "room": "living",
            })  # fmt: skip
    return rows[:count]


def main():
    """Read the quarter and write the two files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("quarter", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("x", type=float)
    parser.add_argument("y", type=float)
    parser.add_argument("--windows", type=int, default=200)
    given = parser.parse_args()
    scene = umbra.read(given.quarter)
    buildings, place = find_buildings(scene), np.array([given.x, given.y])
    gardens = make_gardens(buildings, place)
    rows = list_windows(scene, buildings, place, given.windows)
    given.folder.mkdir(parents=True, exist_ok=True)
    features = [
        {"type": "Feature", "properties": {"name": name}, "geometry": shapely.geometry.mapping(one)}
        for name, one in gardens.items()
    ]
    collection = {"type": "FeatureCollection", "features": features}
    (given.folder / "gardens.geojson").write_text(json.dumps(collection), encoding="utf-8")
    with (given.folder / "windows.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    print(f"{len(gardens)} gardens and {len(rows)} windows in {given.folder}")


if __name__ == "__main__":
    main()
