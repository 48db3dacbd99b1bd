"""The overcast sky in a canyon and a courtyard, beside Radiance (``pip install pyradiance``)."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.shapes import box, merge

from umbra.sky.casters import make_sky_casters
from umbra.sky.points import measure_sky

SKY = """
void brightfunc sky_cie 2 overcast sky.cal 0 0
sky_cie glow sky_glow 0 0 4 1 1 1 0
sky_glow source sky 0 0 4 0 0 1 180
void plastic black 0 0 5 0 0 0 0 0
"""
OVERCAST = "overcast = (1 + 2 * Dz) / 3;\n"
SCENES = {
    "canyon": [((-12, -900, 0), (-6, 900, 10)), ((6, -900, 0), (12, 900, 14))],
    "courtyard": [
        ((-12, -9, 0), (-10, 9, 15)), ((10, -9, 0), (12, 9, 12)), ((-10, -9, 0), (10, -7, 15)),
        ((-10, 7, 0), (10, 9, 9)),
    ],
}  # fmt: skip


def trace(folder, mesh, rows):
    """Irradiance [of the zenith's unit] by Radiance's ambient rays, whose error is some 0.05 %."""
    home = Path(pytest.importorskip("pyradiance").__file__).parent
    vertices, faces = mesh
    lines = [
        f"black polygon f{k} 0 0 9 " + " ".join(f"{x:.9g}" for x in vertices[face].ravel())
        for k, face in enumerate(faces)
    ]
    (folder / "scene.rad").write_text(SKY + "\n".join(lines))
    (folder / "sky.cal").write_text(OVERCAST)
    environment = {**os.environ, "RAYPATH": f".:{home / 'lib'}"}
    with (folder / "scene.oct").open("wb") as out:
        subprocess.run(
            [home / "bin" / "oconv", "scene.rad"], cwd=folder, env=environment, stdout=out,
            check=True,
        )  # fmt: skip
    given = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows)
    options = [
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
    ]
    said = subprocess.run(
        [home / "bin" / "rtrace", *options, "scene.oct"], cwd=folder, env=environment, check=True,
        input=given + "\n", capture_output=True, text=True,
    ).stdout  # fmt: skip
    return np.array([float(line.split()[0]) for line in said.splitlines() if line.strip()])


@pytest.mark.parametrize("name", SCENES)
def test_sky_component_is_radiances_to_a_tenth_of_a_point(name, tmp_path):
    mesh = merge(*(box(*corners) for corners in SCENES[name]))
    heights = (0.5, 3.0, 6.0, 8.5)
    wall = 6 if name == "canyon" else 10
    rows = [(wall - 1e-3, 0.3, z, -1, 0, 0) for z in heights]
    rows += [(x, 1.1, 0.0, 0, 0, 1) for x in (-4.0, 0.0, 5.0)]
    rows += [(0.4, -2.0, 2.0, 0.6, 0.0, 0.8)]
    rows = np.array(rows, float)
    casters = make_sky_casters(*mesh)
    ours = measure_sky(casters, rows[:, :3], rows[:, 3:], 1).sky_component
    theirs = 100 * trace(tmp_path, mesh, rows) / (7 * np.pi / 9)
    assert np.abs(ours - theirs).max() < 0.1
    assert np.ptp(ours) > 20
