"""
Compile the kernels that most tests use, while the packages of the tests are still on their way.

Otherwise each worker of the tests compiles them at the same time as the others, into one empty
cache. What is not compiled here is compiled by the first test that needs it.
"""

import runpy
import sys
import tempfile
from pathlib import Path

import numpy as np

import umbra
from umbra.realtime import VolumePlanner

ROOT = Path(__file__).parents[1]
EXTENT = (2620, 340000, 2780, 340180)
PLACE = (2713.0, 340080.0, 172.0)
POINTS = [(*PLACE, 0.0, 0.0, 1.0), (*PLACE, 0.0, -1.0, 0.0)]
DAY = {"date": "2026-03-21", "every": "2h"}
SKY = {"measure": "sky_view_factor,sky_component,sky_blocked_by", "who": "T*"}
STUDIES = [
    {"receivers": "ground", **DAY},
    {"receivers": "surfaces", **DAY, "by": "part"},
    {"receivers": "ground", **DAY, "ground": "feet"},
    {"receivers": "points", **DAY, "spells": True},
    {"receivers": "points", **SKY, "exact": True},
    {"receivers": "top", **DAY, "proposed": "Tower", "by": "part", "exact": True},
    {"receivers": "points", **SKY},
    {"receivers": "surfaces", **DAY, "exact": True},
    {"receivers": "top", **DAY, "canopy": "T*", "transmissivity": 0.3},
    {"receivers": "top", **DAY, "disc": True},
]
FINENESS = {"ground": {"cell": 4}, "top": {"cell": 4}, "surfaces": {"spacing": 12}}


def main() -> None:
    """Count an example by every kind of receivers and of light."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "block.city.json")
        sys.argv = ["city_block.py", str(file)]
        runpy.run_path(str(ROOT / "examples" / "city_block.py"), run_name="__main__")
        scene = umbra.read(file)
    site = umbra.find_site(scene)
    lamp = umbra.point_light((2700, 340100, 260))
    sun = umbra.directional_light((1, 2, 3))
    camera = umbra.make_camera(scene, size=(64, 48))
    for options in STUDIES:
        kind = options["receivers"]
        where = {"points": POINTS} if kind == "points" else FINENESS[kind]
        if kind in {"ground", "top"}:
            where = {**where, "extent": EXTENT}
        umbra.shadow_study(scene, site, **options, **where)
        if options is STUDIES[0]:
            umbra.render(scene, camera, [sun, lamp], device="cpu")
            umbra.count_shadows(scene, camera, lamp, method="z-fail")
    umbra.sky_view(scene, PLACE, site=site)
    # Volumes for a graphics card, without one: seen from 400 m straight down.
    view = np.eye(4)
    view[:3, 3] = -2700, -340100, -400
    projection = np.array([[1.5, 0, 0, 0], [0, 2, 0, 0], [0, 0, -1, -0.5], [0, 0, -1, 0]])
    for ground in (None, 171.0):
        planner = VolumePlanner(scene, ground)
        for light in (sun, lamp):
            planner.plan(view, projection, camera.size, light)
            planner.plan(view, projection, camera.size, light, method="z-fail")
    for soft in ("wedges", "complexity"):
        umbra.render(scene, camera, lamp, soft=soft, light_size=2.0, device="cpu")


if __name__ == "__main__":
    main()
