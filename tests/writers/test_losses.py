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


def look(scene, **asked):
    """Return the plan and hours that are drawn of a loss, the end of their scale, and the study."""
    drawn = []
    painter = SimpleNamespace(
        draw_hours=lambda _path, plan, maps, end, **_: drawn.append((plan, maps, end))
    )
    options = StudyOptions(
        **{"receivers": "ground", "ground": 0.0, "cell": 1.0, "date": "2026-03-21",
           "proposed": "tower", **asked},
    )  # fmt: skip
    study = run(scene, SITE, options)
    job = FolderJob(study, Path(), Outputs(), options, painter, lambda _: None)
    sheets = PictureSheets.of(job)
    draw_lost(job, sheets.plan, sheets.preview)
    [(plan, (one,), end)] = drawn
    return plan, one.hours, end, study


def draw(scene, **asked):
    """Return the hours lost that are drawn, and those of the study."""
    _, hours, _, study = look(scene, extent=EXTENT, **asked)
    return hours, study.more["hours_lost"][1]


def test_the_picture_opens_on_the_loss_on_the_same_scale():
    """A low sun's shadows reach far, and last long nowhere far away."""
    parts = [Part("tower", "", Mesh(*box((0, 0, 0), (10, 10, 60))))]
    parts.append(Part("shed", "", Mesh(*box((60, 0, 0), (66, 6, 3)))))
    day = {"date": "2026-12-21", "start": "09:00", "end": "15:00", "every": "15min", "cell": 2.0}
    plan, hours, end, study = look(make_scene(parts), **day)
    lost = study.more["hours_lost"][1]
    assert plan.note.endswith("cropped to 1 h of sun lost and more")
    assert end == pytest.approx(np.nanmax(lost), abs=0.3)
    assert hours.size < 0.5 * lost.size
    inside = (study.x >= plan.x[0]) & (study.x <= plan.x[-1])
    rows = (study.y >= plan.y[0]) & (study.y <= plan.y[-1])
    far = np.nan_to_num(lost).copy()
    far[np.ix_(rows, inside)] = 0
    assert 0 < far.max() < 1


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
