"""Picture of who casts the shadow: each cell in the hue of its main caster, deeper by hours."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.writers.area_outlines import HALO
from umbra.writers.context_lines import draw_context
from umbra.writers.contours import find_swatches, hatch_covers, outline_covers, trace
from umbra.writers.hours_map import OUTLINE
from umbra.writers.labels import Labels
from umbra.writers.marks import draw_swatches
from umbra.writers.paper import INK, LINE, SMALL, Panel, measure_text, wrap
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
NAME = SMALL + 1.0
"""Size of the names on casters [point]."""
_LONGEST = 1.3  # of a name on its caster; the middle of longer ones is left out [inch]
_AROUND = 0.03  # beside a name, to the edge of its caster [inch]
_OVER = 0.35  # of a name's area, most that juts out over its caster
_DISC = 0.2  # around a number [inch]
_PITCH = 0.02  # of the places at which names are tried [inch]
_TRIED = 400  # places at which a name or a number is tried
_SWATCH = 0.29  # left of a name in the key [inch]


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
    Draw who casts the shadow, with each caster's name on it.

    Casters on which their names have no room get a number that the key explains. A hue is of one
    caster and deepens up to ``max_hours`` [h]. Borders between casters are lines, so that they stay
    in grey print.
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
    numbered = _name_casters(panel, who, main)
    # The hue of a facade is that of the shadow on it: only a roof's own hue is a key to its name.
    keyed = numbered if plan.roofs_cover else list(range(len(who.names)))
    labels = [f"{rank + 1}  " * (rank in numbered) + who.names[rank] for rank in keyed]
    if (main >= len(who.names)).any():
        keyed = [*keyed, len(who.names)]
        labels.append("others")
    title = what or "main caster"
    spacing = min(sheet.key_box[2] / max(math.ceil(len(labels) / 2), 1), KEY_WIDTH)  # two rows
    room = (spacing if sheet.is_wide else KEY_WIDTH) - _SWATCH
    draw_swatches(
        sheet, hues[keyed], [_shorten(label, room) for label in labels],
        [title] if sheet.is_wide else wrap(title, 8.0, KEY_WIDTH),
        f"pale: briefly, deep: {max_hours:.3g} h", find_swatches([plan]), spacing,
    )  # fmt: skip
    return sheet


def _name_casters(panel: Panel, who: WhoMap, main: NDArray[np.integer]) -> list[int]:
    """Write each caster's name where it fits on it, else its number; return those of numbers."""
    room, keyed = Labels(panel.map_box), []
    built = panel.plan.is_building
    style: dict[str, Any] = {"color": INK, "weight": "bold", "ha": "center"}
    style["va"] = "center_baseline"
    for rank, (name, stands) in enumerate(zip(who.names, who.stands, strict=True)):
        cells = stands if stands.any() else main == rank  # of one that is not seen its shadow
        text = _shorten(name, _LONGEST, NAME)
        size = measure_text(text, NAME, "bold") + 2 * _AROUND, NAME * LINE
        place = room.find(_find_room(panel, cells, built & ~cells, *size), *size)
        if place is not None:
            panel.write(float(place[0]), float(place[1]), text, NAME, halo=HALO, **style)
        elif cells.any():
            keyed.append(rank)
    for rank in keyed:
        cells = who.stands[rank] if who.stands[rank].any() else main == rank
        spots = _list_middles(panel, cells, cells.astype(float))
        at = room.find(spots, _DISC, _DISC)
        x, y = spots[0] if at is None else at
        box = {"boxstyle": "circle,pad=0.18", "fc": "white", "ec": INK, "lw": 0.6}
        panel.write(x, y, str(rank + 1), SMALL + 1.5, bbox=box, **style)
    return keyed


def _find_room(
    panel: Panel, cells: NDArray[np.bool_], others: NDArray[np.bool_], width: float, height: float
) -> NDArray[np.float64]:
    """
    Find middles (n, 2) [inch] of a box that lies on some cells, and on no others, the best first.

    It may jut out by ``_OVER`` of its area.
    """
    _, _, w, h = panel.map_box
    size = max(2, round(h / _PITCH)), max(2, round(w / _PITCH))
    box = rows, cols = math.ceil(height / _PITCH), math.ceil(width / _PITCH)
    if rows >= size[0] or cols >= size[1]:
        return np.zeros((0, 2))
    inside, barred = (resample(some, size) > HALF for some in (cells, others))
    held = _sum_boxes(inside, box) / (rows * cols)
    share = np.zeros(size)
    share[rows // 2 :, cols // 2 :][: len(held), : len(held[0])] = np.where(
        _sum_boxes(barred, box) == 0, held, 0.0
    )
    return _list_middles(panel, inside, np.where(share >= 1 - _OVER, share, 0.0))


def _sum_boxes(cells: NDArray[np.bool_], box: tuple[int, int]) -> NDArray[np.integer]:
    """Count the cells in each box of so many rows and columns, by its first row and column."""
    rows, cols = box
    whole = np.pad(np.cumsum(np.cumsum(cells.astype(np.int64), 0), 1), ((1, 0), (1, 0)))
    return whole[rows:, cols:] - whole[:-rows, cols:] - whole[rows:, :-cols] + whole[:-rows, :-cols]


def _list_middles(
    panel: Panel, cells: NDArray[np.bool_], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """List places (n, 2) [inch] by their share, of equal ones those nearest to the middle first."""
    places = np.argwhere(share > 0)
    if not len(places):
        return np.zeros((0, 2))
    away = np.square(places - np.argwhere(cells).mean(0)).sum(1)
    row, col = places[np.lexsort((away, -share[share > 0]))[:_TRIED]].T + HALF
    x, y, w, h = panel.map_box
    return np.stack([x + col / cells.shape[1] * w, y + row / cells.shape[0] * h], 1)


def _find_borders(ranks: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Find the pixels (rows, cols) whose caster is another than that above or to the right."""
    found = np.zeros(ranks.shape, np.bool_)
    found[:-1] |= ranks[:-1] != ranks[1:]
    found[:, :-1] |= ranks[:, :-1] != ranks[:, 1:]
    return found


def _shorten(label: str, room: float, size: float = SMALL) -> str:
    """Leave out the middle of a label that is wider than its room [inch]."""
    shown, kept = label, len(label)
    while measure_text(shown, size) > room and kept > 2:
        kept -= 1
        shown = f"{label[: kept - kept // 2]}…{label[len(label) - kept // 2 :]}"
    return shown
