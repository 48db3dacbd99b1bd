"""
Study the example quarter from Python: hours of shadow on the square, with and without trees.

    python examples/study_in_python.py [FOLDER]

Prints a few figures, and writes the study as NetCDF into FOLDER (``out`` by default).
"""

import json
import sys
from pathlib import Path

from city_block import make_quarter

import umbra

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
folder.mkdir(parents=True, exist_ok=True)
model = folder / "quarter.city.json"
model.write_text(json.dumps(make_quarter()), encoding="utf-8")

scene = umbra.read(model)
# The file names its CRS, so the place and true north are known.
site = umbra.Site(
    latitude=scene.latitude,
    longitude=scene.longitude,
    zone="Europe/Vienna",
    true_north=scene.true_north,
)
print(f"{len(scene.parts)} parts at {site.latitude:.3f}° N, {site.longitude:.3f}° E")

day = {"date": "2026-06-21", "start": "08:00", "end": "20:00", "every": "10min"}
square = (2665, 340060, 2745, 340125)  # xmin, ymin, xmax, ymax in the model's own metres
with_trees = umbra.shadow_study(scene, site, **day, extent=square, cell=0.5)
without = umbra.shadow_study(
    scene, site, **day, extent=square, cell=0.5, no_cast=["SolitaryVegetationObject"]
)
for words, study in (("with trees", with_trees), ("without trees", without)):
    hours = study.shadow_hours
    print(f"{words:14}  {float(hours.mean()):.2f} h of shadow on average", end=", ")
    print(f"{float((hours < 2).mean()):.0%} of the square in shadow for less than 2 h")

# The result has an xarray.Dataset: look along a line, at a place, or save it.
corner = with_trees.sel(x=2670, y=340065, method="nearest")
print(f"at the square's corner: {float(corner.sun_hours):.2f} h of sun")
with_trees.to_netcdf(folder / "square.nc", engine="h5netcdf")
print(folder / "square.nc")
