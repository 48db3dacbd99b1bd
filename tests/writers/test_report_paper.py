"""Reports on paper and on a phone: no row, column or picture is lost."""

import base64
import io

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import label
from support.pages import READY
from support.shapes import box, moved

from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.sun import Site
from umbra.writers.picture_content import OutlinedArea, Plan
from umbra.writers.pixels import write_png
from umbra.writers.proof.drawing import COLORS
from umbra.writers.report import Table, write_report

SITE = Site(48.2, 16.37, "Europe/Vienna")
PIXELS = (
    "(map => [...map.getContext('2d').getImageData(0, 0, map.width, map.height).data])"
    "(document.getElementById('map'))"
)
COLUMNS = tuple(f"column {k}" for k in range(8))


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A report with a table of 8 columns and 60 rows, and a picture taller than a page."""
    parts = {
        "tower": box((0, 0, 0), (4, 4, 9)),
        "shed": moved(box((0, 0, 0), (3, 3, 2)), (8, 5, 0)),
    }
    scene = make_scene([Part(name, "", Mesh(*mesh)) for name, mesh in parts.items()])
    study = run_study(
        scene, SITE, date="2026-03-21", every="2h", cell=1.0, proposed=["tower"], masks=True
    )
    folder = tmp_path_factory.mktemp("paper")
    write_png(folder / "tall.png", np.full((3000, 600, 3), 80, np.uint8))
    rows = [tuple(f"cell {row}-{k}" for k in range(8)) for row in range(60)]
    plan = Plan(study.x, study.y, (study.heights - study.ground).astype(np.float32), title="Paper")
    path = folder / "report.html"
    write_report(
        path, study, plan, [("Tall", folder / "tall.png")],
        tables=[
            Table("Many", COLUMNS, rows),
            Table("Few", ("name", "hours"), [(f"n{k}", float(k)) for k in range(31)]),
        ],
    )  # fmt: skip
    return path


@pytest.mark.parametrize(("width", "height"), [(8.27, 11.69), (16.54, 11.69)])
def test_paper_has_all_rows_columns_and_pictures(page, report, width, height):
    page.open(report, READY)
    page.send("Emulation.setEmulatedMedia", media="print")
    page.resize(round(width * 96), round(height * 96))
    page.ask("dispatchEvent(new Event('beforeprint'))")
    rows = "document.querySelector('.sortable tbody').rows"
    assert page.ask(f"{rows}.length") == 60
    right = (
        f"Math.max(...[...{rows}].map((row) => row.lastElementChild.getBoundingClientRect().right))"
    )
    assert page.ask(right) <= round(width * 96)
    tall = "document.querySelector('figure img').getBoundingClientRect().height"
    assert 100 < page.ask(tall) <= 0.9 * height * 96
    boxes = "[...document.querySelectorAll('*')].filter((e) => e.clientHeight && "
    boxes += "/auto|scroll/.test(getComputedStyle(e).overflow)).length"
    assert page.ask(boxes) == 0  # nothing that scrolls
    page.ask("dispatchEvent(new Event('afterprint'))")
    assert page.ask(f"{rows}.length") == 25


def test_a_long_table_of_few_columns_stands_beside_itself_with_its_head(page, report):
    page.open(report, READY)
    page.send("Emulation.setEmulatedMedia", media="print")
    page.resize(round(8.27 * 96), round(11.69 * 96))
    print_it = "dispatchEvent(new Event('{}print'))"
    halves = (
        "[...document.querySelectorAll('.narrow table')].map((t) => [t.tHead.innerText, "
        "t.tBodies[0].rows.length, t.getBoundingClientRect().left, t.getBoundingClientRect().top])"
    )
    for _ in range(2):  # a second time as well
        page.ask(print_it.format("before"))
        (head, first, left, top), (again, second, right, beside) = page.ask(halves)
        assert head == again
        assert "name" in head
        assert (first, second) == (16, 15)
        assert right > left + 100
        assert beside == top
        page.ask(print_it.format("after"))
    ((_, shown, *_),) = page.ask(halves)
    assert shown == 25


def test_a_pdf_holds_the_picture_of_the_plan(page, report):
    page.open(report, READY)
    page.send("Emulation.setEmulatedMedia", media="print")
    page.ask("dispatchEvent(new Event('beforeprint'))")
    page.wait("document.getElementById('paper').naturalWidth > 100")
    address = page.ask("document.getElementById('paper').src")
    picture = Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2])))
    assert (
        len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 3
    )  # not an empty canvas
    pdf = base64.b64decode(page.send("Page.printToPDF")["data"])
    assert pdf.startswith(b"%PDF")


def test_on_a_phone_rows_of_many_columns_become_lists(page, report):
    page.resize(390, 844, is_phone=True)
    page.open(report, READY)
    assert page.ask("document.documentElement.scrollWidth") <= 390
    wide = "(t => [t.scrollWidth, t.parentElement.clientWidth])(document.querySelector('.many'))"
    assert np.diff(page.ask(wide)) >= 0
    cells = page.ask("[...document.querySelector('.many tbody tr').cells].map((c) => c.dataset.of)")
    assert cells == list(COLUMNS)
    assert page.ask("getComputedStyle(document.querySelector('.many td')).display") == "flex"


def test_the_first_place_is_one_that_receives_and_a_failing_area_is_named_so(page, tmp_path):
    """Land of a triangle above the level of its lowest corner, without any cell at its height."""
    land = np.array(
        [(0, 0, 1), (30, 0, 1), (0, 30, 1), (30, 30, 0), (30.1, 30, 0), (30, 30.1, 0)], float
    )
    parts = [
        Part("land", "LandUse", Mesh(land, np.array([(0, 1, 2), (3, 4, 5)]))),
        Part("tower", "", Mesh(*box((8, 8, 1), (10, 10, 9)))),
    ]
    study = run_study(make_scene(parts), SITE, date="2026-03-21", every="1h", cell=1.0, masks=True)
    assert np.isnan(study.shadow_hours[0, -1])
    heights = (study.heights - study.ground).astype(np.float32)
    areas = [
        OutlinedArea(name, (np.array([(x, 4), (x + 6, 4), (x + 6, 10), (x, 10), (x, 4)]),), (x, 2))
        for name, x in (("lawn", 2.0), ("yard", 14.0), ("path", 22.0))
    ]
    plan = Plan(study.x, study.y, heights, title="Land", areas=areas)
    rows = [("lawn", "fail"), ("yard", "pass"), ("lawn", "pass")]
    path = tmp_path / "report.html"
    write_report(path, study, plan, [], tables=[Table("Rule", ("name", "verdict"), rows)])
    page.open(path, READY)
    sun, where = (
        page.ask(f"document.getElementById('{k}').textContent") for k in ("in-sun", "where")
    )
    assert "nothing" not in where
    assert sun != "0 h"
    verdicts = page.ask("JSON.parse(document.getElementById('data').textContent).verdicts")
    assert verdicts == {"lawn": "fail", "yard": "pass"}
    key = page.ask("[...document.querySelectorAll('#area-key span')].map((s) => s.textContent)")
    assert key == ["area: fail", "area: pass", "area: not judged"]
    assert page.ask("document.getElementById('void-key').textContent") == study.kind.nothing
    assert page.ask("document.getElementById('void-key').hidden") is False
    # Outlines of one size: the failing one has dashes.
    wide = page.ask("document.getElementById('map').width")
    drawn = np.array(page.ask(PIXELS)).reshape(-1, wide, 4)[..., :3]
    red, green = (
        label(np.abs(drawn - list(bytes.fromhex(COLORS[verdict][1:]))).sum(-1) < 12)[1]
        for verdict in ("fail", "pass")
    )
    assert 1 <= green < 6
    assert red > 3 * green
