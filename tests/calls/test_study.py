"""What ``umbra.shadow_study`` gives: a dataset when asked, pictures, files, verdicts."""

import subprocess
import sys
from io import BytesIO

import numpy as np
import pytest
import xarray as xr
from PIL import Image
from support.model_files import RULES
from support.shapes import box

import umbra
from umbra.study import run_study
from umbra.writers.painter import Painter

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
SMALL = {"date": "2026-03-21", "every": "1h", "extent": (-5, -5, 5, 5), "cell": 0.5}


@pytest.fixture(scope="module")
def scene():
    return umbra.make_scene(*box((-1, -1, 0), (1, 1, 3)), name="tower")


@pytest.fixture(scope="module")
def study(scene):
    return umbra.shadow_study(scene, SITE, **SMALL, receivers="top")


def test_variables_are_attributes_and_items(scene, study):
    plain = run_study(scene, SITE, **SMALL, receivers="top")
    assert isinstance(study.dataset, xr.Dataset)
    assert study.to_xarray() is study.dataset
    for name in plain.variables():
        assert isinstance(study[name], xr.DataArray)
        assert name in dir(study)
    np.testing.assert_array_equal(study.shadow_hours, plain.shadow_hours)
    assert study.shadow_hours.attrs["units"] == "h"
    assert study.attrs["receivers"] == "top"


def test_scripts_that_expect_a_dataset_go_on(study):
    data = study.dataset
    assert "sun_hours" in study
    assert list(study) == list(data)
    assert len(study) == len(data)
    assert study.sizes == data.sizes
    near = study.sel(x=3, y=0, method="nearest")
    assert float(near.sun_hours) == float(data.sun_hours.sel(x=3, y=0, method="nearest"))
    xr.testing.assert_identical(study.isel(x=2), data.isel(x=2))
    xr.testing.assert_identical(study - study, data - data)
    xr.testing.assert_identical(study.shadow_hours > 1, data.shadow_hours > 1)
    assert {study: 1}[study] == 1
    with pytest.raises(AttributeError, match="no variable or method 'sunshine'; see study"):
        study.sunshine  # noqa: B018


def test_the_dataset_is_made_when_it_is_asked_for():
    text = (
        "import sys, umbra; from support.shapes import box;"
        "scene = umbra.make_scene(*box((-1, -1, 0), (1, 1, 3)));"
        "site = umbra.Site(48.2, 16.37, 'Europe/Vienna');"
        "study = umbra.shadow_study(scene, site, date='2026-03-21', every='4h', cell=1);"
        "assert 'shadow_hours' in repr(study); assert 'xarray' not in sys.modules;"
        "study.shadow_hours; assert 'xarray' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", text], check=True, cwd="tests", timeout=120)


def test_it_shows_itself(study):
    assert repr(study).splitlines()[:2] == [
        "ShadowStudy of 2026-03-21, 8 instants",
        "receivers 'top', 20 x 20; up to 8.00 of 8.00 h in shadow",
    ]
    assert "xr-wrap" in study._repr_html_()


def test_pictures_are_the_commands(study, tmp_path):
    written = study.write(tmp_path / "out", show="sun", title="A tower")
    assert {path.name for path in written} == {"study.nc", "hours.png", "profile.png"}
    with xr.open_dataset(tmp_path / "out" / "study.nc") as kept:
        np.testing.assert_array_equal(kept.shadow_hours, study.shadow_hours)
    for name, drawn in (
        ("hours", study.plot(show="sun", title="A tower")),
        ("profile", study.profile(show="sun", title="A tower")),
    ):
        there = Image.open(tmp_path / "out" / f"{name}.png")
        here = Image.open(BytesIO(drawn._repr_png_()))
        np.testing.assert_array_equal(np.asarray(here), np.asarray(there))
    drawn.save(tmp_path / "profile.png")
    assert (tmp_path / "profile.png").read_bytes() == drawn.png


def test_one_picture_is_drawn_alone(study, monkeypatch):
    drawn = []
    for name in ("draw_hours", "draw_profile"):
        whole = getattr(Painter, name)

        def draw(*args, whole=whole, name=name, **options):
            drawn.append(name)
            return whole(*args, **options)

        monkeypatch.setattr(Painter, name, draw)
    study.plot()
    assert drawn == ["draw_hours"]
    study.profile()
    assert drawn == ["draw_hours", "draw_profile"]


def test_pictures_can_be_left_out(study, tmp_path):
    (path,) = study.write(tmp_path / "out", pictures=False)
    assert path.name == "study.nc"
    assert [one.name for one in (tmp_path / "out").iterdir()] == ["study.nc"]
    names = {one.name for one in study.write(tmp_path / "sheet", pictures=False, sheet=True)}
    assert names == {"study.nc", "sheet.png"}
    with pytest.raises(umbra.InputError, match="svg' asks for pictures") as error:
        study.write(tmp_path / "none", "svg", pictures=False)
    assert error.value.option == "write"


def test_a_report_is_one_page(study, tmp_path):
    path = study.report(tmp_path / "page.html", title="A tower")
    text = path.read_text()
    assert "A tower" in text
    assert "umbra.shadow_study" in text
    assert [one.name for one in tmp_path.iterdir()] == ["page.html"]


def test_further_formats_and_verdicts(study, tmp_path):
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES.format(measure="sun_hours", place="yard", x=3, y=0))
    names = [path.name for path in study.write(tmp_path / "out", "csv", "svg", rules=rules)]
    assert {"cells.csv", "hours.svg", "profile.svg", "verdicts.csv"} <= set(names)
    (verdict,) = study.judge(rules)
    assert (verdict.check, verdict.where, verdict.passes) == ("sun", "yard", True)


def test_samples_have_pictures_too(scene):
    few = {"date": "2026-03-21", "every": "2h"}
    points = umbra.shadow_study(scene, SITE, **few, receivers="points", points=[(0, 3, 0.0)])
    assert Image.open(BytesIO(points.plot().png)).size[0] > 100
    with pytest.raises(umbra.InputError, match="no picture 'profile'; they have points"):
        points.profile()


def test_slips_are_told(study, tmp_path):
    with pytest.raises(umbra.InputError, match="does not know 'tiff'; did you mean geotiff"):
        study.write(tmp_path / "out", "tiff")
    assert not (tmp_path / "out").exists()
    with pytest.raises(umbra.InputError, match="cannot read the rules"):
        study.judge(tmp_path / "none.yaml")


def test_studies_are_compared(scene, study):
    bare = umbra.make_scene(*box((-9, -9, 0), (-8, -8, 3)))
    without = umbra.shadow_study(bare, SITE, **SMALL, receivers="top", ground=0)
    found = umbra.compare(without, study)
    assert float(found.hours_lost.max()) > 0


def test_hours_become_a_mesh(scene, study):
    pytest.importorskip("pyvista")
    mesh = study.to_pyvista()
    k = mesh.find_closest_point((3.25, 0.25, 0))
    near = study.sel(x=3.25, y=0.25, method="nearest")
    assert mesh.point_data["shadow_hours"][k] == float(near.shadow_hours)
    walls = umbra.shadow_study(scene, SITE, date="2026-03-21", every="2h", receivers="surfaces")
    cloud = walls.to_pyvista()
    np.testing.assert_array_equal(cloud.points, walls.position)
    np.testing.assert_array_equal(cloud.point_data["sun_hours"], walls.sun_hours)
    south = umbra.shadow_study(
        scene, SITE, date="2026-03-21", every="4h", receivers="south", cell=1
    )
    np.testing.assert_array_equal(south.to_pyvista().points[:, 1], -1.0)
