"""Letters that the pictures' typeface lacks come from another one, or are named once."""

import warnings

import numpy as np
import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from matplotlib import font_manager

from umbra.writers import paper, typeface
from umbra.writers.folder import Outputs
from umbra.writers.folder.captions import name_model
from umbra.writers.paper import SMALL, Leaf, Paper, find_font, measure_text, wrap
from umbra.writers.typeface import FACE, find_families, load_font, note_missing

LETTER, NOBODYS = "\U000f0001", "\U000f0002"  # for private use


@pytest.fixture
def bar_sans(tmp_path, monkeypatch):
    """A typeface of the system with one letter, a bar twice as wide as high."""
    pen = TTGlyphPen(None)
    for k, place in enumerate([(0, 0), (0, 1000), (2000, 1000), (2000, 0)]):
        (pen.lineTo if k else pen.moveTo)(place)
    pen.closePath()
    glyphs = {".notdef": TTGlyphPen(None).glyph(), "bar": pen.glyph()}
    made = FontBuilder(1000, isTTF=True)
    made.setupGlyphOrder(list(glyphs))
    made.setupCharacterMap({ord(LETTER): "bar"})
    made.setupGlyf(glyphs)
    made.setupHorizontalMetrics(dict.fromkeys(glyphs, (2000, 0)))
    made.setupHorizontalHeader(ascent=1000, descent=-200)
    made.setupNameTable({"familyName": "Bar Sans", "styleName": "Regular"})
    made.setupOS2(usWeightClass=400)
    made.setupPost()
    made.save(tmp_path / "bar.ttf")
    monkeypatch.setattr(font_manager, "findSystemFonts", lambda: [str(tmp_path / "bar.ttf")])
    kept = list(font_manager.fontManager.ttflist)
    caches = (typeface._find_others, find_font, measure_text)
    for cached in caches:
        cached.cache_clear()
    yield
    font_manager.fontManager.ttflist[:] = kept
    font_manager.fontManager._findfont_cached.cache_clear()
    for cached in caches:
        cached.cache_clear()


def draw(text):
    leaf = Leaf(2.0, 0.5)
    Paper(leaf).write(0.1, 0.1, text, 20.0, weight="bold")
    return leaf.render().min(-1) < 128


@pytest.mark.usefixtures("bar_sans")
def test_a_letter_comes_from_another_typeface():
    assert find_families("Größe · 20 m²") == (FACE,)
    assert find_families(f"a{LETTER}") == (FACE, "Bar Sans")
    assert note_missing(f"a{LETTER}", "title") == ""
    assert measure_text(LETTER, 20.0) == pytest.approx(2 * 20 / 72, rel=0.02)
    drawn = draw(f"a{LETTER}")
    rows, cols = np.nonzero(drawn)
    bar = drawn[rows.min() : rows.max() + 1]
    assert (bar.mean(0) == 1).sum() == pytest.approx(2 * 20 / 72 * 150, abs=2)
    assert cols.max() > 2 * 20 / 72 * 150 + 15
    assert load_font(20, f"a{LETTER}").getname()[0] == "Bar Sans"
    assert load_font(20, "a").getname()[0] == FACE


@pytest.mark.usefixtures("bar_sans")
def test_letters_that_no_typeface_has_are_named_once_and_not_warned_of(capfd):
    assert f"has {NOBODYS} of the title, which are boxes" in note_missing(
        f"{NOBODYS}{LETTER}{NOBODYS}", "title"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert draw(NOBODYS).any()
        assert measure_text(NOBODYS, 9.0) > 0
    assert capfd.readouterr().err == ""
    assert paper.logging.getLogger("matplotlib.font_manager").level == 0


def test_no_line_ends_between_a_number_and_its_unit():
    text = "sun for 12 min, then 3 m² and 5 % of 6 h; 8 houses of 9 metres"
    ends = set()
    for width in np.linspace(measure_text("12 min,", SMALL), 4.0, 60):
        lines = wrap(text, SMALL, width)
        assert " ".join(lines) == text
        ends |= {line.split(" ")[0] for line in lines[1:]}
    assert not ends & {"min,", "m²", "%", "h;"}
    assert {"houses", "metres"} <= ends


def test_titles_stand_on_one_line():
    assert name_model(["city_block.city.json", "new\nline.obj"]) == "City block + New line"
    assert Outputs(title="two\nlines", subtitle=" three\tmore ").title == "two lines"
