"""The map of who casts the shadow: main casters by hours, in hues that anyone tells apart."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.scene import Mesh, Part, make_scene
from umbra.study.finer import count_finer
from umbra.writers.caster_map import HUES, NAME, OTHERS, WhoMap, _find_borders, make_who_sheet
from umbra.writers.folder.who import _find_main, _rank
from umbra.writers.painter import Painter
from umbra.writers.paper import SMALL, measure_text
from umbra.writers.picture_content import Plan
from umbra.writers.sheet import KEY_WIDTH

VIENNA = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
# Machado, Oliveira and Fernandes (2009), deuteranopia, severity 1, on linear sRGB.
DEUTERANOPIA = np.array(
    [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]]
)  # fmt: skip


@pytest.fixture(scope="module")
def found():
    scene = make_scene([
        Part("tall", "", Mesh(*box((0, 0, 0), (10, 10, 30)))),
        Part("low", "", Mesh(*box((40, 0, 0), (50, 10, 8)))),
    ])  # fmt: skip
    return umbra.shadow_study(
        scene, VIENNA, date="2026-03-21", every="1h", cell=2.0, by="part",
        extent=(-40, -20, 90, 60),
    )  # fmt: skip


def test_the_main_caster_has_the_most_hours_and_none_where_none_falls(found):
    cast = found.cast_hours.values
    main, hours = _find_main(cast)
    assert (hours == cast.max(0)).all()
    assert ((main < 0) == (cast.max(0) <= 0)).all()
    shaded = main >= 0
    assert {0, 1} <= set(main[shaded].tolist())
    assert (np.take_along_axis(cast, np.maximum(main, 0)[None], 0)[0] == hours).all()
    names = found.caster.values.tolist()
    assert [names[k] for k in _rank(main, hours, 2)] == ["tall", "low"]


def test_surfaces_have_the_hours_of_casters_but_no_map(tmp_path):
    scene = make_scene([Part("tall", "", Mesh(*box((0, 0, 0), (10, 10, 30))))])
    study = umbra.shadow_study(
        scene, VIENNA, date="2026-03-21", every="2h", receivers="surfaces", spacing=4.0, by="part"
    )
    assert study.cast_hours.sizes["caster"] == 1
    written = {path.name for path in study.write(tmp_path / "out")}
    assert "hours.png" in written
    assert "who.png" not in written


def test_the_folder_has_the_map(found, tmp_path):
    written = found.write(tmp_path / "out")
    assert "who.png" in {path.name for path in written}


def test_hues_differ_for_those_who_see_no_green_and_names_stand_on_the_casters(found):
    linear = np.where(
        np.vstack([HUES, OTHERS]) > 0.04045, ((np.vstack([HUES, OTHERS]) + 0.055) / 1.055) ** 2.4, 0
    )
    seen = np.clip(linear @ DEUTERANOPIA.T, 0, 1)
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    xyz = seen @ to_xyz.T / (0.9505, 1.0, 1.089)
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    lab = np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], -1)
    assert min(np.linalg.norm(a - b) for a, b in combinations(lab, 2)) > 10
    plan = Plan(found.x.values, found.y.values)
    main, hours = _find_main(found.cast_hours.values)
    stands = [main == 0, main == 1]
    sheet = make_who_sheet(plan, WhoMap(main, hours, ["tall", "low"], stands), 8.0)
    texts = [text.get_text() for text in sheet.leaf.get_children() if hasattr(text, "get_text")]
    assert {"tall", "low"} <= set(texts)
    assert not {"others", "1", "2", "1  tall", "2  low"} & set(texts)  # no key for names on the map


def test_names_stand_on_their_casters_without_overlap_and_the_key_has_the_others():
    plan = Plan(np.arange(400.0), np.arange(300.0))
    stands = np.zeros((4, *plan.shape), np.bool_)
    stands[0, 20:140, 20:220] = True
    stands[1, 150:280, 20:220] = True
    stands[2, 100:160, 300:305] = True  # too narrow for any name
    stands[3, 20:60, 300:390] = True
    main = np.select(list(stands), [0, 1, 2, 3], -1)
    names = ["south", "north", "wall", "east"]
    sheet = make_who_sheet(plan, WhoMap(main, np.full(main.shape, 8.0), names, list(stands)), 8.0)
    texts = {text.get_text(): text for text in sheet.leaf.get_children()
             if hasattr(text, "get_text")}  # fmt: skip
    assert {"south", "north", "east", "3", "3  wall"} <= texts.keys()
    assert not {"wall", "1", "2", "4", "1  south"} & texts.keys()
    boxes = []
    for name, cells in zip(names, stands, strict=True):
        x, y = texts[name if name != "wall" else "3"].get_position()
        half = measure_text(name, NAME, "bold") / 2 if name != "wall" else 0.0
        low, high = sheet.place([(0, 0), (1, 1)])
        for side in (x - half, x + half):
            col, row = ((side, y) - low) / (high - low)
            assert cells[int(row), int(col)]
        boxes.append((x - half, x + half, y))
    for a, b in combinations(boxes, 2):
        assert a[1] < b[0] or b[1] < a[0] or abs(a[2] - b[2]) > NAME / 72


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_casters_are_drawn_in_the_plan_s_finer_steps_which_the_foot_tells(
    receivers, tmp_path, monkeypatch
):
    scene = make_scene([
        Part("tall", "", Mesh(*box((0, 0, 0), (10, 10, 30)))),
        Part("low", "", Mesh(*box((30, 5, 0), (50, 15, 8)))),
    ])  # fmt: skip
    study = umbra.shadow_study(
        scene, VIENNA, date="2026-03-21", every="30min", cell=1.0, by="part", ground=0.0,
        extent=(-40, -20, 90, 60), receivers=receivers,
    )  # fmt: skip
    fine = count_finer(study.result)
    assert fine.seconds == 60
    own = replace(fine, lights=study.result.period.make_lights())
    for parts, cast in enumerate(study.cast_hours.values):  # by sums, and caster by caster
        np.testing.assert_allclose(own.find_cast([parts]), cast, atol=1e-5)
    drawn = []
    monkeypatch.setattr(
        Painter, "draw_who", lambda _self, _path, plan, who, *_, **__: drawn.append((plan, who))
    )
    study.write(tmp_path / "out")
    ((plan, who),) = drawn
    assert "every 1 min" in plan.note
    assert "± 0.5 min" in plan.note
    _, hours = _find_main([fine.find_cast([k]) for k in range(2)])
    np.testing.assert_array_equal(who.hours, hours)
    steps = np.unique(np.round(study.cast_hours.values * 2, 4) % 1)
    assert len(steps) == 1  # half hours
    assert len(np.unique(np.round(who.hours * 2, 4) % 1)) > 10


def test_names_fit_the_key_and_others_part_from_one_another(found):
    """Names alike at their beginnings stay apart; a pale line lies between two of the others."""
    plan = Plan(found.x.values, found.y.values)
    rows, cols = plan.shape
    main = np.repeat(np.arange(cols) * 4 // cols, rows).reshape(cols, rows).T.copy()
    names = ["UUID_LOD2_011491-3cd51f89-4727-44e6-b12e_6", "UUID_LOD2_011491-3cd51f89-4727-44e6-b"]
    stands = np.zeros((2, rows, cols), np.bool_)  # of a cell, where no name has room
    stands[0, 1, 1] = stands[1, 1, cols // 3] = True
    who = WhoMap(main, np.full(main.shape, 8.0), names, list(stands))
    sheet = make_who_sheet(plan, who, 8.0)
    shown = [text for text in sheet.leaf.get_children() if hasattr(text, "get_text")]
    labels = [text.get_text() for text in shown if "UUID" in text.get_text()]
    assert len({label[1:] for label in labels}) == 2
    assert all(label.endswith(name[-4:]) for label, name in zip(labels, names, strict=True))
    assert max(measure_text(label, SMALL) for label in labels) <= KEY_WIDTH - 0.29
    borders = _find_borders(main)
    assert borders.sum() == 3 * rows  # a column before each of the three others
    assert (main[borders] < 3).all()
