"""The shadow profile: the shadows of several instants over one another."""

import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from umbra.writers.canopies import find_swatches, hatch_canopies, outline_canopies
from umbra.writers.contours import trace
from umbra.writers.keys import draw_color_bar, draw_swatches
from umbra.writers.look import draw_look
from umbra.writers.overlay import compose_profile, find_tints
from umbra.writers.panels import make_panels
from umbra.writers.paper import Panel
from umbra.writers.plan import Plan, shade_roofs
from umbra.writers.sheet import Sheet, make_sheet
from umbra.writers.tips import Lines, name_tips, rule_shadows

__all__ = ["draw_profile", "draw_profiles", "make_profile_panels", "make_profile_sheet"]

MOST_SWATCHES = 12
OVERLAPS = "darker where they overlap"
OUTLINE = "#55555e"
SHADE = 0.1  # of surfaces that slope, at most

Day = tuple[str, Iterable[NDArray[np.bool_]], Sequence[str], NDArray[np.float64] | None]
"""A date, its shadows, their clock times, and where the sun casts them."""


def draw_profile(
    path: str | os.PathLike[str],
    plan: Plan,
    shadows: Iterable[NDArray[np.bool_]],
    labels: Sequence[str],
    zone: str = "",
    receivers: Literal["ground", "top"] = "ground",
    away: NDArray[np.float64] | None = None,
) -> None:
    """
    Draw a shadow profile: each shadow in a tint, outlined, with its clock time at its tip.

    Of more than 12 stamps only those that the key names are outlined.

    Parameters
    ----------
    path : path
        Its ending chooses PNG, PDF or SVG.
    plan : Plan
    shadows : iterable of (rows, cols) bool
        Where shadow falls at each stamp; rows ascend in y.
    labels : sequence of str
        The stamps' clock times, "09:00".
    zone : str
        What clock that is: "CEST".
    receivers : {'ground', 'top'}
        ``ground``: roofs are drawn over the shadows. ``top``: shadows fall on roofs.
    away : (n_stamps, 2) float64, optional
        Where the sun casts shadows, along the map's axes; without it no times are written.

    Raises
    ------
    ValueError
        If the counts of shadows and labels differ.
    OSError
        If the file cannot be written.
    """
    make_profile_sheet(plan, shadows, labels, zone, receivers, away).save(path)


def draw_profiles(
    path: str | os.PathLike[str],
    plan: Plan,
    days: Sequence[Day],
    zone: str = "",
    receivers: Literal["ground", "top"] = "ground",
    remarks: Sequence[str] = (),
) -> None:
    """
    Draw the shadow profiles of several dates, a panel for each.

    Parameters
    ----------
    path : path
    plan : Plan
        Its words are those of all dates.
    days : sequence of (date, shadows, labels, away)
        Of each as ``draw_profile`` takes them.
    zone : str
    receivers : {'ground', 'top'}
    remarks : sequence of str
        Said below each date: sunrise and sunset.
    """
    make_profile_panels(plan, days, zone, receivers, remarks)[0].save(path)


def make_profile_sheet(
    plan: Plan,
    shadows: Iterable[NDArray[np.bool_]],
    labels: Sequence[str],
    zone: str = "",
    receivers: Literal["ground", "top"] = "ground",
    away: NDArray[np.float64] | None = None,
) -> Sheet:
    """Lay out what ``draw_profile`` writes; same parameters, less the path."""
    sheet = make_sheet(plan, key_height=0.62)
    _fill_map(sheet, shadows, labels, receivers, away)
    _draw_key(sheet, labels, zone)
    return sheet


def make_profile_panels(
    plan: Plan,
    days: Sequence[Day],
    zone: str = "",
    receivers: Literal["ground", "top"] = "ground",
    remarks: Sequence[str] = (),
) -> tuple[Sheet, list[Panel]]:
    """Lay out what ``draw_profiles`` writes; same parameters, less the path."""
    sheet, panels = make_panels(plan, [day for day, *_ in days], remarks)
    for panel, (_, shadows, labels, away) in zip(panels, days, strict=True):
        _fill_map(panel, shadows, labels, receivers, away)
    _draw_key(sheet, max((labels for _, _, labels, _ in days), key=len), zone)
    return sheet, panels


def _fill_map(
    panel: Panel,
    shadows: Iterable[NDArray[np.bool_]],
    labels: Sequence[str],
    receivers: Literal["ground", "top"],
    away: NDArray[np.float64] | None,
) -> None:
    """Draw the shadows of all stamps, their outlines and times, and what stands there."""
    plan = panel.plan
    # Where a roof lies over shadows, or surfaces meet, an outline is not that of a shadow.
    roofs = hidden = None
    if plan.look is not None:
        hidden = plan.look.find_breaks(plan.shape)
    elif receivers == "ground" and plan.building_height is not None:
        roofs = hidden = np.nan_to_num(plan.building_height) > 0
    outlines: dict[int, Lines] = {}
    passing = _trace_named(panel, shadows, _find_named(labels), hidden, outlines)
    image = compose_profile(passing, len(labels), panel.map_size)
    if plan.look is not None:
        image *= 1 - SHADE * plan.look.find_shade(panel.map_size)[..., None]
        draw_look(image, plan.look, panel.map_size)
    else:
        grey, coverage = shade_roofs(plan, panel.map_size)
        if receivers == "ground":
            image += coverage[..., None] * (grey[..., None] - image)
        else:
            image *= (1 - coverage * (1 - grey))[..., None]
    hatch_canopies(image, plan, panel.map_size)
    panel.paste(image, *panel.map_box[:2])
    rule_shadows(panel, outlines)
    outline_canopies(panel)
    if plan.building_height is not None and plan.look is None:
        is_building = np.nan_to_num(plan.building_height) > 0
        panel.rule_map(trace(panel, is_building), OUTLINE, 0.6)
    if away is not None:
        name_tips(panel, outlines, labels, away, roofs)


def _trace_named(
    panel: Panel,
    shadows: Iterable[NDArray[np.bool_]],
    named: Sequence[int],
    hidden: NDArray[np.bool_] | None,
    outlines: dict[int, Lines],
) -> Iterator[NDArray[np.bool_]]:
    """Hand shadows on one by one, and trace those that are named as they pass."""
    for stamp, mask in enumerate(shadows):
        if stamp in named:
            outlines[stamp] = trace(panel, mask, hidden)
        yield mask


def _draw_key(sheet: Sheet, labels: Sequence[str], zone: str) -> None:
    n = len(labels)
    tints, swatches = find_tints(n), find_swatches([sheet.plan])
    title = ["shadows at", f"local time ({zone})" if zone else "local time"]
    if n <= MOST_SWATCHES:
        draw_swatches(sheet, tints, list(labels), title, OVERLAPS if n > 1 else "", swatches)
    else:
        draw_color_bar(sheet, tints, _find_bar_ticks(labels), title, OVERLAPS, swatches)


def _find_bar_ticks(labels: Sequence[str]) -> list[tuple[float, str]]:
    """Name stamps at the middles of their bands."""
    return [((stamp + 0.5) / len(labels), labels[stamp]) for stamp in _find_named(labels)]


def _find_named(labels: Sequence[str], most: int = 9) -> list[int]:
    """Choose the stamps that are outlined: all of few, else whole hours if there are enough."""
    stamps = list(range(len(labels)))
    if len(stamps) <= MOST_SWATCHES:
        return stamps
    whole = [stamp for stamp in stamps if labels[stamp].endswith(":00")]
    named = whole if len(whole) >= 3 else stamps
    return named[:: -(-len(named) // most)]
