"""Shade never turns the scale of hours round, and contours end where surfaces meet."""

import base64
import io
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from support.vision import to_cielab, to_oklab

from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.timeline import make_timeline
from umbra.sun import Site
from umbra.writers.edges import find_breaks, find_grid_appearance
from umbra.writers.glb import Glb, write_model_glb
from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.picture_content import DOTS_PER_INCH, DayMap, Plan, find_map_size
from umbra.writers.pixels import paint_shares, shade_ramp
from umbra.writers.report.data import make_plan_data

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
TWO_HOURS = {"date": "2026-06-21", "start": "12:00", "end": "14:00", "every": "1h"}
SPACES = {"CIELAB": to_cielab, "OKLab": to_oklab}


def pyramid(sides=12, radius=10.0, high=30.0):
    """A spire of many aspects, each as steep as the next: 71 degrees."""
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    base = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(sides)])
    points = np.concatenate([base, [(0, 0, high)]])
    faces = [(k, (k + 1) % sides, sides) for k in range(sides)]
    faces += [(0, k + 1, k) for k in range(1, sides - 1)]
    return points, np.array(faces)


def house():
    """A gabled house, its ridge along x at y = 5 m; roofs of 45 degrees."""
    points = np.array(
        [(0, 0, 4), (20, 0, 4), (20, 10, 4), (0, 10, 4), (0, 5, 9), (20, 5, 9)]
        + [(0, 0, 0), (20, 0, 0), (20, 10, 0), (0, 10, 0)], float
    )  # fmt: skip
    faces = [(0, 1, 5), (0, 5, 4), (2, 3, 4), (2, 4, 5), (1, 2, 5), (3, 0, 4)]
    faces += [(6, 7, 1), (6, 1, 0), (7, 8, 2), (7, 2, 1), (8, 9, 3), (8, 3, 2), (9, 6, 0)]
    faces += [(9, 0, 3), (6, 8, 7), (6, 9, 8)]
    return points, np.array(faces)


def study_of(mesh, **options):
    scene = make_scene(parts=[Part("it", "house", Mesh(*mesh))])
    return run_study(scene, VIENNA, **{**TWO_HOURS, **options})


def find_nearest(colors, space):
    """Give the place on the scale, of 256, to which each colour is nearest."""
    legend = SPACES[space](shade_ramp())
    flat = SPACES[space](colors).reshape(-1, 1, 3)
    near = [np.linalg.norm(some - legend, axis=-1).argmin(1) for some in np.array_split(flat, 64)]
    return np.concatenate(near).reshape(np.shape(colors)[:-1])


@pytest.mark.parametrize("space", SPACES)
def test_a_shaded_colour_stays_nearest_to_its_own_legend_entry(space):
    shade = np.linspace(0, 1, 65)[:, None]
    place = np.arange(256)
    colors = np.rint(paint_shares(place / 255, shade) * 255) / 255
    off = (find_nearest(colors, space) - place) / 255
    assert np.abs(off).max() < 0.5 / 8  # half of one of eight steps, as the legend has at most
    own = np.rint(np.linspace(0, 255, 9)).astype(int)
    legend = SPACES[space](shade_ramp()[own])
    away = np.linalg.norm(SPACES[space](colors[:, own])[:, :, None] - legend, axis=-1)
    assert (away.argmin(-1) == np.arange(9)).all()
    deepest = np.linalg.norm(SPACES[space](colors[-1]) - SPACES[space](colors[0]), axis=-1)
    assert deepest.min() > (3 if space == "CIELAB" else 0.03)  # and yet it is seen


@pytest.fixture(scope="module")
def spire():
    """Give a shaded plan of a spire."""
    study = study_of(pyramid(), receivers="top", extent=(-12, -12, 12, 12), cell=0.05)
    plan = Plan(study.x, study.y, study.heights.astype(np.float32))
    size = find_map_size(plan)
    appearance = find_grid_appearance(study, size)
    assert appearance.shade[size[0] // 2 - 60 : size[0] // 2 + 60].min() < 60  # it is shaded
    return replace(plan, appearance=appearance, roofs_cover=False)


@pytest.mark.parametrize("hours", [0.0, 1.2, 4.0, 7.0, 8.0])
def test_steep_faces_of_every_aspect_keep_their_hours(spire, hours):
    sheet = make_hours_sheet(spire, [DayMap(np.full(spire.shape, hours))], 8.0)
    pixels = sheet.leaf.render()[::-1] / 255
    left, bottom, w, h = (round(v * DOTS_PER_INCH) for v in sheet.map_box)
    inner = pixels[bottom + 3 : bottom + h - 3, left + 3 : left + w - 3]
    for space in SPACES:
        read = find_nearest(inner[::5, ::5], space) / 255 * 8
        off = np.abs(read - hours) > 0.5
        assert off.mean() < 0.12  # the spire's edges and its rim


def test_contours_end_at_the_creases_of_a_plan():
    study = study_of(house(), receivers="top", extent=(-5, -5, 25, 15), cell=0.05)
    x, y = np.meshgrid(study.x, study.y)
    on_roof = (x > 0) & (x < 20) & (y > 0) & (y < 10)
    plan = Plan(study.x, study.y, study.heights.astype(np.float32))
    appearance = find_grid_appearance(study, find_map_size(plan))
    hours = np.where(on_roof & (y > 5), 4.0, 0.0).astype(np.float32)

    def count(appearance):
        own = Plan(plan.x, plan.y, plan.building_height, appearance=appearance, roofs_cover=False)
        sheet = make_hours_sheet(own, [DayMap(hours)], 8.0)
        return sum(text.get_text() == "4 h" and bool(text.get_path_effects())
                   for text in sheet.leaf.artists
                   if hasattr(text, "get_text"))  # fmt: skip

    assert count(None) > 0  # along the ridge and the eaves
    assert count(appearance) == 0
    row, col = (np.abs(axis - at).argmin() for axis, at in ((study.y, 5.0), (study.x, 10.0)))
    breaks = find_breaks(study)
    assert breaks[row - 2 : row + 3, col].any()  # the ridge
    assert not breaks[row + 20 : row + 60, col].any()  # amid the roof
    assert breaks[np.abs(study.y - 0.0).argmin(), col]  # the eaves
    assert not breaks[:40].any()  # level ground


def test_creases_between_walls_break_contours():
    study = study_of(house(), receivers="180/35", cell=0.05)
    normal, part = study.more["normal"][1], study.more["part"][1]
    breaks = find_breaks(study)
    is_roof = (part >= 0) & (normal[..., 2] > 0.5)
    is_wall = (part >= 0) & (np.abs(normal[..., 2]) < 0.1)
    eaves = is_roof[1:] & is_wall[:-1]
    assert eaves.sum() > 100
    assert (breaks[1:] | breaks[:-1])[eaves].all()
    assert breaks[is_roof].mean() < 0.1


def test_a_steep_roof_is_no_wall_and_a_wall_is():
    # Of 0.05 m cells a spire of 71 degrees rises 0.15 m, of 2 m cells 6 m: more than a storey.
    for cell in (0.05, 2.0):
        study = study_of(pyramid(radius=20 * cell, high=60 * cell), receivers="top", cell=cell,
                         extent=(-30 * cell, -30 * cell, 30 * cell, 30 * cell))  # fmt: skip
        plan = Plan(study.x, study.y, study.heights.astype(np.float32))
        appearance = find_grid_appearance(study, find_map_size(plan))
        rows, cols = appearance.shade.shape
        spire = appearance.lines[rows // 2 : rows // 2 + 9, cols // 3 : cols // 2 - 40]
        assert (spire > 128).mean() < 0.2


def read_png(address):
    return Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2])))


@pytest.mark.parametrize("receivers", ["top", "215/35"])
def test_a_report_s_relief_keeps_the_legend_s_hours(receivers):
    study = study_of(house(), receivers=receivers, cell=0.2)
    plan = Plan(study.x, study.y, None)
    timeline = make_timeline(study)
    data = make_plan_data(study, plan, timeline)
    veil = np.asarray(read_png(data["relief"]))
    assert not veil[..., 0].any()  # black
    share = veil[..., 1] / 255
    faces = share < 0.065
    assert faces.mean() > 0.85  # the rest are lines
    assert share[faces].max() > 0.03
    for space in SPACES:
        colors = shade_ramp() * (1 - share[faces].max())
        off = (find_nearest(colors, space) - np.arange(256)) / 255
        assert np.abs(off).max() < 0.5 / 8


def test_viewers_show_the_hours_of_a_glb_without_light_and_shade(tmp_path):
    study = study_of(house(), receivers="top", cell=0.5)
    write_model_glb(tmp_path / "model.glb", study)
    data = (tmp_path / "model.glb").read_bytes()
    tree = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    assert tree["extensionsUsed"] == ["KHR_materials_unlit"]
    assert tree["materials"][0]["extensions"] == {"KHR_materials_unlit": {}}
    plain = Glb("umbra", {})
    plain.add_material()
    assert "extensionsUsed" not in plain.more
