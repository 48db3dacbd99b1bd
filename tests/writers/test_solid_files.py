"""`--write solids`: a closed mesh of each part at each time, in GLB and OBJ."""

import numpy as np
import pytest
import trimesh
from support.shapes import box, moved

import umbra
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene
from umbra.writers import solid_files

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
EAST = np.array([3000.0, 340000.0, 170.0])


@pytest.fixture(scope="module")
def study():
    parts = [
        Part(name, "", Mesh(corners + EAST, faces))
        for name, (corners, faces) in {
            "high house": box((0, 0, 0), (6, 4, 10)),
            "shed": moved(box((0, 0, 0), (3, 3, 4)), (14, -9, 0)),
        }.items()
    ]
    scene = make_scene(parts, crs="EPSG:31256")
    return umbra.shadow_study(
        scene, SITE, date="2026-03-21", start="10:00", end="14:00", every="1h",
        receivers="ground", ground=170.0, cell=2.0,
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_files_hold_each_part_at_each_time(study, tmp_path):
    files = study.write(tmp_path / "out", "solids", pictures=False, at=("10:00", "13:30"))
    names = {path.name for path in files}
    assert {"solids.glb", "solids.obj"} <= names
    wanted = [
        f"2026-03-21 {at} {part}" for at in ("10:00", "13:30") for part in ("high house", "shed")
    ]
    glb = trimesh.load(tmp_path / "out" / "solids.glb")
    assert sorted(glb.geometry) == sorted(wanted)
    back = umbra.read(tmp_path / "out" / "solids.obj", up="z")
    assert [part.name for part in back.parts] == wanted
    low, high = back.bounds()
    assert low[2] == 170.0
    assert high[2] == 180.0
    sun = umbra.find_sun(SITE, np.array(["2026-03-21T12:30"], "datetime64[us]")).direction[0]
    volume = 6 * 4 * 10 + 10**2 / 2 * (6 * abs(sun[1]) + 4 * abs(sun[0])) / sun[2]
    house = glb.geometry["2026-03-21 13:30 high house"]
    assert house.is_watertight
    assert house.volume == pytest.approx(volume, rel=1e-5)
    corners = back.parts[2].mesh.vertices[back.parts[2].mesh.faces] - EAST
    signed = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert signed == pytest.approx(volume, rel=1e-8)


def test_views_have_them_too_and_too_many_are_refused(study, tmp_path, monkeypatch):
    monkeypatch.setattr(solid_files, "_LARGEST", 10)
    with pytest.raises(InputError) as caught:
        study.write(tmp_path / "out", "solids", pictures=False)
    assert caught.value.option == "write"
