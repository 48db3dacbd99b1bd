"""Tables for spreadsheets: names of parts, surfaces and points never run there."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest
from support.shapes import box, moved

from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.sun import Site
from umbra.writers.csv_tables import write_samples, write_table
from umbra.writers.folder.write import note_cut

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
FORMULAS = [
    "=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\n1", " =1", '=HYPERLINK("http://x","y")',
    "\uff1d1+1",
]  # fmt: skip
HARMLESS = ["tower", "a=b", "3-5", "", "\u2212 2", "'quoted'", "-2.5", "+4", "1e-9", "-1E+3"]


def read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


@pytest.mark.parametrize("cell", FORMULAS)
def test_a_cell_of_text_that_would_run_begins_with_an_apostrophe(tmp_path, cell):
    path = tmp_path / "table.csv"
    write_table(path, ["name", cell], [[cell, -1.5]])
    assert read(path) == [["name", f"'{cell}"], [f"'{cell}", "-1.5"]]


@pytest.mark.parametrize(
    ("cell", "guarded"),
    [
        ("\t=1", "'\t'=1"),
        ("\r=1", "'\n'=1"),
        ("x\r=1", "x\n'=1"),
        ("x;=1", "x;'=1"),
        ("x; @y;-z", "x;' @y;'-z"),
    ],
)
def test_what_a_spreadsheet_may_split_off_is_guarded_too(tmp_path, cell, guarded):
    path = tmp_path / "table.csv"
    write_table(path, ["name"], [[cell]])
    assert read(path) == [["name"], [guarded]]


@pytest.mark.parametrize("cell", HARMLESS)
def test_other_text_and_numbers_stay(tmp_path, cell):
    path = tmp_path / "table.csv"
    write_table(path, ["name"], [[cell], [-3]])
    assert read(path) == [["name"], [cell], ["-3"]]


def test_names_of_parts_surfaces_and_points_are_guarded(tmp_path):
    meshes = [box((0, 0, 0), (4, 4, 6)), moved(box((0, 0, 0), (3, 3, 3)), (9, 0, 0))]
    scene = make_scene([Part(name, "@kind", Mesh(*mesh)) for name, mesh in
                        zip(FORMULAS, meshes)])  # fmt: skip
    options = {"date": "2026-09-18", "every": "4h"}
    write_samples(tmp_path, run_study(scene, VIENNA, receivers="surfaces", spacing=2.0, **options))
    points = np.array([(-3.0, -3, 1), (6, -3, 1)])
    study = run_study(scene, VIENNA, receivers="points", points=points,
                            names=FORMULAS[2:4], **options)  # fmt: skip
    write_samples(tmp_path, study)
    guarded = {"parts.csv": FORMULAS[:2], "surfaces.csv": ["@kind"], "points.csv": FORMULAS[2:4]}
    for name, cells in guarded.items():
        found = [cell for row in read(tmp_path / name) for cell in row]
        for cell in cells:
            assert f"'{cell}" in found, name
            assert cell not in found, name
    rows = read(tmp_path / "points.csv")
    assert [row[rows[0].index("x")] for row in rows[1:]] == ["-3", "6"]


@pytest.mark.parametrize(("cell", "told"), [((0, 2), True), ((3, 4), True), ((2, 2), False)])
def test_shadows_that_the_edge_of_a_default_plan_cuts_are_told(cell, told):
    hours = np.zeros((4, 5), np.float32)
    hours[cell] = 0.5
    said = []
    study = SimpleNamespace(shadow_hours=hours, period=SimpleNamespace(land_hours=0.0))
    note_cut(SimpleNamespace(study=study, say=said.append))
    assert len(said) == told
    assert all("30 min" in line and "extent=" in line for line in said)
    # While the sun is behind the land all is dark, and no frame cuts it.
    study.period.land_hours = 0.5
    said.clear()
    note_cut(SimpleNamespace(study=study, say=said.append))
    assert said == []
