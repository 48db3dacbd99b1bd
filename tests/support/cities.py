"""Cities of boxes, written as CityJSON."""

import json

import numpy as np

FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
DAY = {"date": "2026-12-21", "start": "08:00", "end": "17:00", "every": "30min"}
SITE = {"latitude": 52.0, "longitude": 4.4, "zone": "Europe/Amsterdam"}


def write_city(path, houses, crs=7415):
    """Write boxes (name, x, y, z, width, depth, height, turn) as CityJSON."""
    vertices, things = [], {}
    for name, x, y, z, wide, deep, high, turn in houses:
        first = len(vertices)
        c, s = np.cos(turn), np.sin(turn)
        for up in (0, high):
            for u, v in ((0, 0), (wide, 0), (wide, deep), (0, deep)):
                place = (x + u * c - v * s, y + u * s + v * c, z + up)
                vertices.append([round(1000 * (k - o)) for k, o in zip(place, (85000, 447000, 0))])
        shell = [[[first + k for k in face]] for face in FACES]
        things[name] = {
            "type": "Building",
            "geometry": [{"type": "Solid", "lod": "1", "boundaries": [shell]}],
        }
    facts = {"referenceSystem": f"https://www.opengis.net/def/crs/EPSG/0/{crs}"} if crs else {}
    city = {
        "type": "CityJSON", "version": "1.1", "CityObjects": things, "vertices": vertices,
        "metadata": facts,
        "transform": {"scale": [0.001] * 3, "translate": [85000, 447000, 0]},
    }  # fmt: skip
    path.write_text(json.dumps(city))
    return path


def read_store(folder):
    """Return the bytes of all files of a run's store."""
    files = [path for path in (folder / "study.zarr").rglob("*") if path.is_file()]
    return {path.relative_to(folder): path.read_bytes() for path in files}


def make_houses(seed, count, low, high, name="house"):
    """Return turned boxes in a rectangle, some of them towers."""
    rng = np.random.default_rng(seed)
    return [
        (
            f"{name} {n}", *rng.uniform(low, high), rng.uniform(-1, 1), *rng.uniform(5, 20, 2),
            float(rng.choice([6, 9, 12, 60])), rng.uniform(0, 6.28),
        )
        for n in range(count)
    ]  # fmt: skip
