"""The sheet of a proof: labels clear of one another, marks of the worst, heads on each page."""

import numpy as np
import pytest
from matplotlib.text import Text
from support.days import parts
from support.shapes import box

import umbra
from umbra.study import StudyOptions
from umbra.study.replaced import leave_replaced
from umbra.verdicts.judged_receivers import Gathered
from umbra.verdicts.outcome import FAIL, PASS
from umbra.verdicts.sunlight import Model
from umbra.writers.labels import Labels, list_around
from umbra.writers.paper import SMALL, Leaf, Paper, measure_text
from umbra.writers.proof.book import Book, Titles
from umbra.writers.proof.column import Brief
from umbra.writers.proof.drawing import Drawing, Line, group_windows
from umbra.writers.proof.drawing import make_drawing as collect_drawing
from umbra.writers.proof.flow import Flow, TableOf
from umbra.writers.proof.key import list_key
from umbra.writers.proof.paper_sheets import draw_sheets
from umbra.writers.proof.pen import draw_plan

LONG = "Playground of the kindergarten at the corner of the second courtyard, northern part"
PAPER = ("a3", "a4")


def square(x, y, size):
    return np.array([(x, y), (x + size, y), (x + size, y + size), (x, y + size), (x, y)], float)


def list_texts(leaf):
    return [one.get_text() for one in leaf.artists if isinstance(one, Text)]


def find_boxes(leaf, texts):
    """Return the boxes of texts that are set about their middle [inch]."""
    for one in leaf.artists:
        if isinstance(one, Text) and one.get_text() in texts:
            size = one.get_fontsize()
            weight = "bold" if one.get_fontweight() == "bold" else "normal"
            half = np.array([measure_text(one.get_text(), size, weight), size / 72]) / 2
            middle = np.array(one.get_position())
            yield middle - half, middle + half


def test_labels_keep_clear_of_what_is_taken_and_of_lines():
    labels = Labels((0, 0, 4, 3))
    labels.take((1.9, 1.4), (2.1, 1.6))
    labels.avoid([np.array([(0, 1.8), (4.0, 1.8)])])
    places = list_around(np.array([1.9, 1.4]), np.array([2.1, 1.6]), 1.0, 0.2, (0.02,))
    found = [labels.find(places, 1.0, 0.2) for _ in range(9)]
    spots = [spot for spot in found if spot is not None]
    assert len(spots) == 4  # left, right, above and below; the corners overlap these
    assert len(found) > len(spots)
    for k, spot in enumerate(spots):
        assert all(abs(spot - other)[0] >= 1.0 or abs(spot - other)[1] >= 0.2
                   for other in spots[:k])  # fmt: skip
    crosses = [abs(spot[1] - 1.8) < 0.1 for spot in spots]
    assert crosses == [False, False, False, True]  # the line's only when no other is left
    assert labels.find(np.array([(3.9, 0.5)]), 1.0, 0.2) is None  # beyond the edge


def test_windows_above_one_another_are_one_mark_of_the_worst():
    column = [(0.0, 1.0, 180.0, PASS if k else FAIL, f"house window {k}") for k in range(3)]
    spots = group_windows([*column, (9.0, 1.0, 90.0, PASS, "house window 7")])
    assert [(one.verdict, one.label) for one in spots] == [
        (PASS, "7"), (FAIL, "0 to 2: 1 of 3 fail"),
    ]  # fmt: skip


def make_drawing(name):
    shapes = [([square(20 * k, 0, 12)], PASS, name.format(k=k)) for k in range(4)]
    line = Line([np.array([(0.0, 6.0), (12.0, 6.0)])], "2 h of sun, 2026-03-21", "2 h")
    return Drawing((-10, -10, 82, 22), shapes=shapes, lines=[line])


def test_names_of_areas_lie_within_them_off_the_lines():
    leaf = Leaf(16.0, 8.0)
    drawing = make_drawing("G{k}")
    assert draw_plan(Paper(leaf), (0, 0, 16, 8), drawing, 0.0) == []
    factor = 39.3701 / 250
    boxes = list(find_boxes(leaf, {f"G{k}" for k in range(4)}))
    assert len(boxes) == 4
    line = 4.0 + (6.0 - 6.0) * factor  # the frame's middle is y = 6
    (low, high), *others = boxes
    assert low[1] > line or high[1] < line
    for low, high in others:
        assert low[1] < 4 < high[1]
        assert high[0] - low[0] < 12 * factor


def test_a_name_without_room_is_a_number_in_the_key():
    titles = Titles(title="T")
    sheets = draw_sheets("a4", titles, [Brief("r", PASS, "", [])], make_drawing(LONG + " {k}"),
                         [], [], [], 0.0)  # fmt: skip
    texts = list_texts(sheets.leaves[0])
    for k in range(4):
        assert f"{k + 1}" in texts
        assert any(text.startswith("Playground") for text in texts)
    assert texts.count("1") == 2  # in the plan and the key


@pytest.mark.parametrize("paper", PAPER)
@pytest.mark.parametrize("count", [1, 5, 15])
def test_each_rule_has_its_verdict_on_the_first_sheet(paper, count):
    rows = [(f"window {k}", "1 h ± 5 min", "≥ 2 h", FAIL) for k in range(80)]
    briefs = [Brief(f"Rule {k}", FAIL, f"{LONG}. " * 3, rows) for k in range(count)]
    titles = Titles(title=LONG, project=LONG, author=LONG, number="1", date="2026-03-21")
    basis = [("place", LONG), ("files", LONG)]
    sheets = draw_sheets(paper, titles, briefs, make_drawing("G{k}"), [], basis, [], 0.0)
    texts = list_texts(sheets.leaves[0])
    assert [text for text in texts if text.startswith("Rule ")] == [one.title for one in briefs]
    assert texts.count("FAIL") == count
    low = sheets.leaves[0].height
    for one in sheets.leaves[0].artists:
        if isinstance(one, Text) and one.get_position()[0] < 0.34 * sheets.leaves[0].width:
            low = min(low, one.get_position()[1])
    assert low > 0.45  # nothing hangs over the frame


@pytest.mark.parametrize("paper", PAPER)
def test_a_tables_head_stands_on_each_of_its_pages(paper):
    book = Book(paper, Titles(title="T"))
    book.turn()
    flow = Flow(book)
    rows = [(f"row {k}", "x" * 90) for k in range(200)]
    flow.add_table(TableOf("Heading", "remark", ("first", "second"), rows))
    flow.add_facts("Facts", [("name", "\n".join(f"line {k}" for k in range(200)))])
    book.finish(500)
    pages = [list_texts(leaf) for leaf in book.leaves[1:]]
    tables = [page for page in pages if any(text.startswith("row ") for text in page)]
    assert len(tables) >= 2
    for k, page in enumerate(tables):
        assert ("Heading" if not k else "Heading (continued)") in page
        assert {"first", "second"} <= {*page}
    shown = [text for page in pages for text in page]
    assert [text for text in shown if text.startswith("row ")] == [row[0] for row in rows]
    facts = [page for page in pages if any(text.startswith("line ") for text in page)]
    assert all(any(text.startswith("Facts") for text in page) for page in facts)
    assert len(facts) > 1
    assert shown.count(f"sheet 2 of {len(book.leaves)}") == 1
    assert measure_text("x" * 90, SMALL) < flow.room


def test_what_a_proposal_replaces_is_drawn_apart():
    scene = parts(house=box((0, 0, 0), (9, 9, 9)), old=box((2, 2, 0), (8, 7, 4)),
                  near=box((20, 0, 0), (30, 9, 9)))  # fmt: skip
    asked = {"proposed": ["house"], "replace": ["old"]}
    left, _ = leave_replaced(scene, asked["proposed"], asked["replace"], None)
    model = Model(
        scene=left, site=umbra.Site(48.2, 16.37, "Europe/Vienna"), year=2026,
        options=StudyOptions(date="2026-03-21", **asked), proposed=("house",),
    )  # fmt: skip
    drawing = collect_drawing(Gathered(model), [])
    outlines = (drawing.replaced, drawing.proposal, drawing.buildings)
    assert [[ring.max(0).tolist() for ring in own] for own in outlines] == [
        [[8, 7]], [[9, 9]], [[30, 9]]
    ]  # fmt: skip
    assert [key.kind for key in list_key(drawing, [])] == ["box", "dashed", "box"]
