"""Picture of who casts the shadow: each cell in the hue of its main caster, deeper by hours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.writers.context_lines import draw_context
from umbra.writers.contours import find_swatches, hatch_covers, outline_covers, trace
from umbra.writers.hours_map import OUTLINE
from umbra.writers.marks import draw_swatches
from umbra.writers.paper import INK, SMALL, measure_text, wrap
from umbra.writers.picture_content import MISSING, Plan, cover_with_roofs, draw_appearance
from umbra.writers.pixels import HALF, resample
from umbra.writers.sheet import KEY_WIDTH, Sheet, lay_out_sheet

__all__ = ["HUES", "OTHERS", "WhoMap", "make_who_sheet"]

HUES = np.array([
    (51, 34, 136), (221, 170, 51), (17, 119, 51), (204, 102, 119),
    (136, 204, 238), (136, 34, 85), (68, 170, 153), (170, 68, 153),
]) / 255  # fmt: skip
"""Of the first casters, sRGB: Paul Tol's scheme "muted", for all kinds of colour vision."""
OTHERS = np.array((118, 118, 124)) / 255
PAPER = np.array((0.985, 0.98, 0.965))
_FAINT = 0.22  # share of the hue in the shortest shadow
_TINT = 0.45  # share of the hue on the roofs of a caster
_NEVER = 1e-4  # hours that are none [h]
_BORDER = "#3c3c44"
_SWATCH, _WIDE_ROOM = 0.29, 0.42  # left of a name in the key; for it in a wide one [inch]


@dataclass(frozen=True, eq=False)
class WhoMap:
    """
    Main caster of each cell.

    Parameters
    ----------
    main : (rows, cols) int
        Rank of the caster that shades a cell longest; -1 for none. Ranks from ``len(names)`` are
        of others.
    hours : (rows, cols) float
        In its shadow [h]; NaN is no value.
    names : sequence of str
        Of the first casters, the one with most shadow first; at most as many as ``HUES``.
    stands : sequence of (rows, cols) bool
        Cells in which each named caster is topmost, or in front.
    """

    main: NDArray[np.integer]
    hours: NDArray[np.floating]
    names: Sequence[str]
    stands: Sequence[NDArray[np.bool_]]


def make_who_sheet(plan: Plan, who: WhoMap, max_hours: float, what: str = "") -> Sheet:
    """
    Draw who casts the shadow, with a number on each named caster that the key repeats.

    A hue is of one caster and deepens up to ``max_hours`` [h]. Borders between casters are lines,
    so that they stay in grey print.
    """
    sheet = lay_out_sheet(plan, 0.75)
    (panel,) = sheet.maps
    size = panel.map_size
    rows, cols = (np.minimum((np.arange(n) + HALF) * m / n, m - 1).astype(np.intp)
                  for n, m in zip(size, plan.shape, strict=True))  # fmt: skip
    main = np.where(np.nan_to_num(who.hours) > _NEVER, who.main, -1)
    hours = resample(np.asarray(who.hours, np.float32), size)
    hues = np.vstack([HUES[: len(who.names)], OTHERS])
    ranks = main[np.ix_(rows, cols)]
    drawn = np.minimum(ranks, len(who.names))
    share = np.clip(np.nan_to_num(hours) / max(max_hours, _NEVER), 0, 1)
    share = np.where(drawn >= 0, _FAINT + (1 - _FAINT) * share, 0)[..., None]
    image = (PAPER + share * (hues[drawn] - PAPER)).astype(np.float32)
    image[_find_borders(ranks) & (drawn == len(who.names))] = PAPER  # of others, one from another
    image[np.isnan(hours)] = MISSING
    if plan.appearance is not None:
        image *= 1 - np.float32(0.15) * plan.appearance.find_shade(size)[..., None]
    if plan.roofs_cover:
        cover_with_roofs(image, plan, size)
        for hue, stands in zip(hues, who.stands):
            tint = np.float32(_TINT) * resample(stands, size)[..., None]
            image += tint * (hue.astype(np.float32) - image)
    if plan.appearance is not None:
        draw_appearance(image, plan.appearance, size)
    hatch_covers(image, plan, size)
    panel.paste(image, *panel.map_box[:2])
    draw_context(panel)
    open_main = np.where(plan.is_building, -1, main) if plan.roofs_cover else main
    for rank in range(len(who.names)):
        panel.rule_map(trace(panel, open_main == rank), _BORDER, 0.35)
    if plan.appearance is None:
        panel.rule_map(trace(panel, plan.is_building), OUTLINE, 0.6)
    outline_covers(panel)
    for rank, stands in enumerate(who.stands):
        _write_number(sheet, rank, stands if stands.any() else main == rank)
    labels = [f"{rank + 1}  {name}" for rank, name in enumerate(who.names)]
    if (main >= len(who.names)).any():
        labels.append("others")
    title = what or "main caster"
    room = _WIDE_ROOM if sheet.is_wide else KEY_WIDTH - _SWATCH
    draw_swatches(
        sheet, hues[: len(labels)], [_shorten(label, room) for label in labels],
        [title] if sheet.is_wide else wrap(title, 8.0, KEY_WIDTH),
        f"pale: briefly, deep: {max_hours:.3g} h", find_swatches([plan]),
    )  # fmt: skip
    return sheet


def _write_number(sheet: Sheet, rank: int, cells: NDArray[np.bool_]) -> None:
    """Write a caster's number on the cell nearest to the middle of some."""
    places = np.argwhere(cells)
    if not len(places):
        return
    row, col = places[np.square(places - places.mean(0)).sum(1).argmin()]
    x, y = sheet.place((sheet.plan.x[col], sheet.plan.y[row]))
    sheet.write(
        x, y, str(rank + 1), SMALL + 1.5, weight="bold", color=INK, ha="center",
        va="center_baseline", bbox={"boxstyle": "circle,pad=0.18", "fc": "white", "ec": INK,
                                    "lw": 0.6},
    )  # fmt: skip


def _find_borders(ranks: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Find the pixels (rows, cols) whose caster is another than that above or to the right."""
    found = np.zeros(ranks.shape, np.bool_)
    found[:-1] |= ranks[:-1] != ranks[1:]
    found[:, :-1] |= ranks[:, :-1] != ranks[:, 1:]
    return found


def _shorten(label: str, room: float) -> str:
    """Leave out the middle of a label that is wider than its room [inch]."""
    shown, kept = label, len(label)
    while measure_text(shown, SMALL) > room and kept > 2:
        kept -= 1
        shown = f"{label[: kept - kept // 2]}…{label[len(label) - kept // 2 :]}"
    return shown
