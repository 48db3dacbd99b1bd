"""Sky and irradiation in a canyon and a courtyard, beside Radiance (``pip install pyradiance``)."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.shapes import box, merge
from support.weather_files import HOURS, make_values, save_epw

import umbra
from umbra.sky.casters import make_sky_casters
from umbra.sky.view_factors import measure_sky

SKY = """
void brightfunc sky_cie 2 overcast sky.cal 0 0
sky_cie glow sky_glow 0 0 4 1 1 1 0
sky_glow source sky 0 0 4 0 0 1 180
"""
GLOW = """
skyfunc glow sky_glow 0 0 4 1 1 1 0
sky_glow source sky 0 0 4 0 0 1 180
"""
BLACK = "void plastic black 0 0 5 0 0 0 0 0\n"
OVERCAST = "overcast = (1 + 2 * Dz) / 3;\n"
SCENES = {
    "canyon": [((-12, -900, 0), (-6, 900, 10)), ((6, -900, 0), (12, 900, 14))],
    "courtyard": [
        ((-12, -9, 0), (-10, 9, 15)), ((10, -9, 0), (12, 9, 12)), ((-10, -9, 0), (10, -7, 15)),
        ((-10, 7, 0), (10, 9, 9)),
    ],
}  # fmt: skip


TRACE = [
    "rtrace",
    "-h",
    "-I",
    "-ab",
    "1",
    "-ad",
    "65536",
    "-as",
    "0",
    "-aa",
    "0",
    "-lw",
    "1e-8",
    "-dt",
    "0",
    "-ds",
    "0",
    "scene.oct",
]
SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
SHINING = {  # hours of a year that is dark else: direct normal and diffuse irradiance [W/m2]
    "2001-01-20T12": (500, 60), "2001-03-21T15": (0, 150), "2001-06-21T06": (200, 70),
    "2001-06-21T12": (850, 120), "2001-08-02T14": (100, 330), "2001-10-15T13": (20, 160),
}  # fmt: skip


def run(folder, command, given=None):
    home = Path(pytest.importorskip("pyradiance").__file__).parent
    environment = {**os.environ, "RAYPATH": f".:{home / 'lib'}"}
    return subprocess.run(
        [home / "bin" / command[0], *command[1:]], cwd=folder, env=environment, check=True,
        input=given and given.encode(), capture_output=True,
    ).stdout  # fmt: skip


def trace(folder, mesh, rows, sky):
    """Irradiance by Radiance's ambient rays, whose error is some 0.05 %."""
    vertices, faces = mesh
    lines = [
        f"black polygon f{k} 0 0 9 " + " ".join(f"{x:.9g}" for x in vertices[face].ravel())
        for k, face in enumerate(faces)
    ]
    (folder / "scene.rad").write_text(sky + BLACK + "\n".join(lines))
    (folder / "scene.oct").write_bytes(run(folder, ["oconv", "scene.rad"]))
    given = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows)
    said = run(folder, TRACE, given + "\n").decode()
    return np.array([float(line.split()[0]) for line in said.splitlines() if line.strip()])


def make_rows(name):
    """Return places on a wall, the ground and a slope, with their normals."""
    wall = 6 if name == "canyon" else 10
    rows = [(wall - 1e-3, 0.3, z, -1, 0, 0) for z in (0.5, 3.0, 6.0, 8.5)]
    rows += [(x, 1.1, 0.0, 0, 0, 1) for x in (-4.0, 0.0, 5.0)]
    return np.array([*rows, (0.4, -2.0, 2.0, 0.6, 0.0, 0.8)], float)


@pytest.mark.parametrize("name", SCENES)
def test_sky_component_is_radiances_to_a_tenth_of_a_point(name, tmp_path):
    mesh, rows = merge(*(box(*corners) for corners in SCENES[name])), make_rows(name)
    ours = measure_sky(make_sky_casters(*mesh), rows[:, :3], rows[:, 3:], 1).sky_component
    (tmp_path / "sky.cal").write_text(OVERCAST)
    theirs = 100 * trace(tmp_path, mesh, rows, SKY) / (7 * np.pi / 9)
    assert np.abs(ours - theirs).max() < 0.1
    assert np.ptp(ours) > 20


@pytest.mark.parametrize("name", SCENES)
def test_irradiation_is_radiances_within_two_percent(name, tmp_path):
    """Six hours of sun and of skies by Perez, each with gendaylit's and the sun where ours is."""
    pytest.importorskip("pyradiance")
    mesh, rows = merge(*(box(*corners) for corners in SCENES[name])), make_rows(name)
    values = make_values()
    theirs = np.zeros(len(rows))
    for hour, (beam, diffuse) in SHINING.items():
        middle = np.datetime64(hour) + np.timedelta64(30 - 60, "m")  # UTC
        sun = umbra.find_sun(SITE, middle.astype("datetime64[us]")[None])
        angles = f"{sun.altitude[0]:.6f} {sun.azimuth[0] - 180:.6f}"  # from south, to the west
        asked = f"gendaylit -ang {angles} -W {beam} {diffuse} -O 1"
        sky = run(tmp_path, asked.split()).decode()
        theirs += trace(tmp_path, mesh, rows, sky + GLOW) / 1000
        level = beam * sun.direction[0, 2] + diffuse
        values[np.flatnonzero(np.datetime64(hour) == HOURS)] = level, beam, diffuse
    ours = umbra.shadow_study(
        umbra.scene.make_scene(*mesh), SITE, measure="irradiation", albedo=0.0,
        weather=save_epw(tmp_path / "year.epw", values), receivers="points", points=rows,
    ).irradiation  # fmt: skip
    assert np.abs(ours.values / theirs - 1).max() < 0.02
    assert np.ptp(theirs) > 0.3
