"""Pictures as PDF and SVG: type stays type, the same picture is the same file, nothing moves."""

import re

import numpy as np
import pytest
from matplotlib.text import Text

from umbra.writers.hours_map import make_hours_sheet
from umbra.writers.painter import Painter
from umbra.writers.picture_content import DOTS_PER_INCH, DayMap, DayShadows, Plan
from umbra.writers.profile import make_profile_sheet

PLAN = Plan(
    np.arange(0.25, 40, 0.5), np.arange(0.25, 30, 0.5), None, 10.0, title="Tower & $5", date="2026"
)
HOURS = np.broadcast_to(np.linspace(0, 8, 80, dtype=np.float32), PLAN.shape)


def test_svg_has_its_type_as_type(tmp_path):
    make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0).save(tmp_path / "hours.svg")
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", (tmp_path / "hours.svg").read_text())
    sheet = make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0)
    expected = [text.get_text() for text in sheet.leaf.findobj(Text) if text.get_text()]
    assert sorted(t.replace("&amp;", "&") for t in texts) == sorted(expected)
    assert "4 h" in texts  # on its halo


def test_pdf_holds_its_typeface(tmp_path):
    make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0).save(tmp_path / "hours.pdf")
    data = (tmp_path / "hours.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert b"/FontFile2" in data
    assert b"/Type3" not in data


@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_a_picture_drawn_twice_is_one_file(tmp_path, ending, monkeypatch):
    for name in ("a", "b"):
        make_profile_sheet(PLAN, [DayShadows([HOURS > 4, HOURS > 6], ["09:00", "10:00"])]).save(
            tmp_path / f"{name}.{ending}"
        )
        monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    assert (tmp_path / f"a.{ending}").read_bytes() == (tmp_path / f"b.{ending}").read_bytes()


def test_the_map_lies_in_an_svg_where_it_does_in_a_png(tmp_path):
    make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0).save(tmp_path / "hours.svg")
    sheet = make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0)
    text = (tmp_path / "hours.svg").read_text()
    image = next(tag for tag in re.findall(r"<image[^>]*>", text))
    wide, high = (
        float(re.search(rf' {side}="([\d.]+)"', image)[1]) for side in ("width", "height")
    )
    x, _, w, h = sheet.map_box
    np.testing.assert_allclose([wide, high], [72 * w, 72 * h], rtol=1e-5)
    left = float(re.search(r' x="([\d.]+)"', image)[1])
    assert left == pytest.approx(72 * round(x * DOTS_PER_INCH) / DOTS_PER_INCH)


def test_the_painter_draws_every_ending(tmp_path):
    with Painter(("png", "pdf", "svg")) as painter:
        painter.draw_profile(tmp_path / "profile.png", PLAN, [DayShadows([HOURS > 4], ["09:00"])])
    starts = {path.name: path.read_bytes()[:4] for path in tmp_path.iterdir()}
    assert starts["profile.png"] == b"\x89PNG"
    assert starts["profile.pdf"] == b"%PDF"
    assert starts["profile.svg"] == b"<?xm"


def test_hours_of_sun_keep_a_place_its_colour():
    shadow, sun = (
        make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0, show=show) for show in ("shadow", "sun")
    )
    x, y, w, _ = (round(v * DOTS_PER_INCH) for v in shadow.map_box)
    pixels = []
    for sheet in (shadow, sun):
        pixels.append(sheet.leaf.render()[::-1][y + 5, x : x + w])
    # The lines lie at the same whole hours here; all sun has a border of its own.
    assert (pixels[0] != pixels[1]).any(1).mean() < 0.01
    texts = {text.get_text(): text for text in sun.leaf.findobj(Text)}
    assert "hours of sun" in texts
    assert "hours in shadow" not in texts
    across = {}
    for text in sun.leaf.findobj(Text):
        if text.get_path_effects():
            across[text.get_text()] = text.get_position()[0]
    assert across["1 h"] > across["7 h"]  # shadow grows to the right


def test_other_hours_than_these_are_refused():
    with pytest.raises(ValueError, match="choose shadow or sun"):
        make_hours_sheet(PLAN, [DayMap(HOURS)], 8.0, show="moon")
