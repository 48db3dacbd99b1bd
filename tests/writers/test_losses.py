"""The picture of the sun lost, in finer steps than the study's, shows what fine studies count."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.shapes import box

from umbra.scene import Mesh, Part, make_scene
from umbra.study import StudyOptions, run
from umbra.study.replaced import leave_replaced
from umbra.sun import Site
from umbra.writers.folder import FolderJob, Outputs
from umbra.writers.folder.loss_maps import draw_lost
from umbra.writers.folder.pictures import PictureSheets

SITE = Site(48.2, 16.37, "Europe/Vienna")
EXTENT = (-30, -15, 45, 45)


def draw(scene, **asked):
    """Return the hours lost that are drawn, and those of the study."""
    drawn = {}
    painter = SimpleNamespace(
        draw_hours=lambda path, _plan, maps, *_, **__: drawn.setdefault(path.name, maps)
    )
    options = StudyOptions(
        receivers="ground", ground=0.0, extent=EXTENT, cell=1.0, date="2026-03-21",
        proposed="tower", **asked,
    )  # fmt: skip
    study = run(scene, SITE, options)
    job = FolderJob(study, Path(), Outputs(), options, painter, lambda _: None)
    sheets = PictureSheets.of(job)
    draw_lost(job, sheets.plan, sheets.preview)
    (one,) = drawn["hours_lost.png"]
    return one.hours, study.more["hours_lost"][1]


@pytest.mark.parametrize("what", ["land", "replaced", "neither"])
def test_what_is_drawn_is_what_a_fine_study_counts(what, tmp_path):
    shapes = {
        "old": ((0, 0, 0), (20, 12, 9)), "tower": ((2, 2, 0), (10, 10, 30)),
        "neighbour": ((24, 4, 0), (34, 12, 12)),
    }  # fmt: skip
    parts = [Part(name, "house", Mesh(*box(*ends))) for name, ends in shapes.items()]
    scene, more = make_scene(parts if what == "replaced" else parts[1:]), {}
    if what == "replaced":
        scene, _ = leave_replaced(scene, ["tower"], ["old"])
    if what == "land":
        path = tmp_path / "land.csv"
        path.write_text("azimuth,elevation\n" + "".join(f"{45 * k},25\n" for k in range(8)))
        more = {"horizon": path}
    shown, coarse = draw(scene, every="30min", **more)
    _, fine = draw(scene, every="1min", **more)
    assert np.abs(np.nan_to_num(coarse - fine)).max() > 0.2
    if shown.shape == fine.shape:
        np.testing.assert_allclose(shown, fine, atol=0.1)
    else:  # the picture is cropped to what matters
        assert np.nanmax(shown) == pytest.approx(np.nanmax(fine), abs=0.1)
        assert np.nanmin(shown) == pytest.approx(np.nanmin(fine), abs=0.1)
