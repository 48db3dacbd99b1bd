"""
The shadow profile: superposed shadows of several instants.

Hue and lightness show the time of shadows: the later, the darker. Of many stamps those nearest to
a named one share its tint, so that neighbours differ by 5 of CIELAB's lightness, also in grey print
and for the colour-blind. Colours are mixed in OKLab: of each pixel the mean of the tints of the
shadows that hold it, which darkens and fades as their share grows, since what lies in shadow all
day belongs to no hour. So the deepest overlap of a long day is a grey that can still be read, and
one shadow alone has its legend's tint.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from umbra.writers.context_lines import draw_context, tint_context
from umbra.writers.contours import (
    Tracer,
    find_swatches,
    hatch_covers,
    outline_covers,
    trace,
)
from umbra.writers.marks import draw_swatches
from umbra.writers.paper import NIGHT, Panel
from umbra.writers.picture_content import (
    MISSING,
    DayShadows,
    Plan,
    cover_with_roofs,
    draw_appearance,
    shade_roofs,
)
from umbra.writers.pixels import HALF, make_stamp_path, resample, to_srgb
from umbra.writers.sheet import Sheet, lay_out_sheet
from umbra.writers.tips import Lines, name_tips, rule_shadows

__all__ = ["compose_profile", "find_tints", "make_profile_sheet"]

PAPER = 0.99  # lightness where no shadow falls
DEEPEST = 0.475  # lightness where all shadows fall
CHROMA = 0.75  # of the tints that one shadow alone keeps


def compose_profile(
    shadows: Iterable[NDArray[np.bool_]], n: int, size: tuple[int, int]
) -> NDArray[np.float32]:
    """
    Mix the tints of n stamps where their shadows, each (rows, cols), fall: sRGB, white elsewhere.

    Shadows are read in sequence and may be an iterator; ValueError if they are not n.
    """
    path = make_stamp_path(n).astype(np.float32)
    stamps = iter(shadows)
    total: NDArray[np.float32] | None = None
    given = 0
    while batch := list(islice(stamps, 8)):
        # Eight stamps are the bits of one byte, and a table adds up their count and tints.
        sums = np.zeros((256, 4), np.float32)
        bits = np.zeros(batch[0].shape, np.uint8)
        for bit, mask in enumerate(batch):
            bits |= np.asarray(mask, bool).view(np.uint8) << np.uint8(bit)
            if given + bit < n:
                sums[np.arange(256) >> bit & 1 == 1] += (1, *path[given + bit])
        given += len(batch)
        if total is None:
            total = np.zeros((4, *bits.shape), np.float32)
        for channel in range(4):
            total[channel] += sums[:, channel].take(bits)
    if given != n:
        msg = f"{given} shadows for {n} labels"
        raise ValueError(msg)
    if total is None:
        return np.ones((*size, 3), np.float32)
    count, *lab = (resample(channel, size) for channel in total)
    return _mix(count, lab, n)


def find_tints(n: int) -> NDArray[np.float32]:
    """Return the colour of a single shadow of each of n stamps, (n, 3) sRGB."""
    path = make_stamp_path(n).astype(np.float32)
    return _mix(np.ones(n, np.float32), [*path.T], n)


def _mix(count: NDArray, lab: Sequence[NDArray], n: int) -> NDArray[np.float32]:
    """Turn counts and sums of tints in OKLab into sRGB; white where there is no shadow."""
    image = np.ones((*count.shape, 3), np.float32)
    is_dark = count > 0
    count, light, a, b = (channel[is_dark] for channel in (count, *lab))
    light /= count
    light -= (light - DEEPEST) * np.sqrt(np.clip((count - 1) / max(n - 1, 1), 0, 1))
    light = PAPER + (light - PAPER) * np.minimum(count, 1)  # of a pixel covered in part
    # A pixel that is covered in part keeps the hue and loses chroma with the count.
    chroma = CHROMA / np.maximum(count, 1) * np.sqrt(np.maximum((n - count) / max(n - 1, 1), 0))
    if n == 1:
        chroma = np.full_like(count, CHROMA)
    image[is_dark] = to_srgb(np.stack([light, a * chroma, b * chroma], -1).astype(np.float32))
    return image


MOST_SWATCHES = 9  # of stamps that are told apart by their tints
OVERLAPS = "darker where they overlap"
OUTLINE = "#55555e"
SHADE = 0.1  # of surfaces that slope, at most


def make_profile_sheet(plan: Plan, days: Sequence[DayShadows], zone: str = "") -> Sheet:
    """
    Draw shadow profiles, a map for each day: each shadow in a tint, its clock time at its tip.

    Of more than 9 stamps whole hours are outlined, and the shadows nearest to each share its tint.
    The zone, "CEST", is that
    of the clock times. A ValueError says that the counts of shadows and labels differ.
    """
    sheet = lay_out_sheet(plan, 0.62, days)
    for panel, day in zip(sheet.maps, days, strict=True):
        _fill_map(panel, day)
    if not all(day.is_night for day in days):
        labels = max((day.labels for day in days), key=len)
        is_each = len(labels) == 1 < len({tuple(day.labels) for day in days})
        _draw_key(sheet, ["in shadow"] if is_each else labels, zone)
    return sheet


def _fill_map(panel: Panel, day: DayShadows) -> None:
    """Draw the shadows of all stamps, their outlines and times, and the buildings."""
    plan, labels = panel.plan, day.labels
    # Where a roof lies over shadows, or surfaces meet, an outline is not that of a shadow.
    roofs = hidden = None
    if plan.roofs_cover and plan.building_height is not None:
        roofs = hidden = plan.is_building
    if plan.appearance is not None:
        breaks = plan.appearance.find_breaks(plan.shape)
        hidden = breaks if roofs is None else breaks | roofs
    outlines: dict[int, Lines] = {}
    tracer = Tracer(panel, hidden)
    named = _find_named(labels)
    passing = _trace_named(tracer, day.shadows, named, outlines)
    image = compose_profile(_join_nearest(passing, named, len(labels)), len(named), panel.map_size)
    tint_context(image, panel)
    if plan.nothing is not None:
        image[resample(plan.nothing, panel.map_size) > HALF] = MISSING
    if plan.appearance is not None:
        image *= 1 - SHADE * plan.appearance.find_shade(panel.map_size)[..., None]
    if plan.roofs_cover:
        cover_with_roofs(image, plan, panel.map_size)
    if plan.appearance is not None:
        draw_appearance(image, plan.appearance, panel.map_size)
    elif not plan.roofs_cover:
        grey, coverage = shade_roofs(plan, panel.map_size)
        image *= (1 - coverage * (1 - grey))[..., None]
    hatch_covers(image, plan, panel.map_size)
    panel.paste(image, *panel.map_box[:2])
    draw_context(panel)
    rule_shadows(panel, outlines)
    outline_covers(panel)
    if plan.building_height is not None and plan.appearance is None:
        panel.rule_map(trace(panel, plan.is_building), OUTLINE, 0.6)
    if day.is_night:
        panel.write_over(NIGHT)
    elif day.away is not None:
        name_tips(panel, outlines, labels, day.away, roofs)


def _trace_named(
    tracer: Tracer,
    shadows: Iterable[NDArray[np.bool_]],
    named: Sequence[int],
    outlines: dict[int, Lines],
) -> Iterator[NDArray[np.bool_]]:
    """Iterate over shadows, tracing the outlines of the named ones."""
    for stamp, mask in enumerate(shadows):
        if stamp in named:
            outlines[stamp] = tracer.trace(mask)
        yield mask


def _join_nearest(
    shadows: Iterable[NDArray[np.bool_]], named: Sequence[int], n: int
) -> Iterator[NDArray[np.bool_]]:
    """Iterate over the shadows of named stamps, each with those of the stamps nearest to it."""
    nearest = np.abs(np.arange(n)[:, None] - named).argmin(1).tolist()
    joined: NDArray[np.bool_] | None = None
    given = -1
    for given, mask in enumerate(shadows):
        if given >= n:
            break
        if given and nearest[given] == nearest[given - 1] and joined is not None:
            joined = joined | mask
            continue
        if joined is not None:
            yield joined
        joined = np.asarray(mask, bool)
    if given != n - 1:
        msg = f"{given + 1} shadows for {n} labels"
        raise ValueError(msg)
    if joined is not None:
        yield joined


def _draw_key(sheet: Sheet, labels: Sequence[str], zone: str) -> None:
    named = _find_named(labels)
    tints, swatches = find_tints(len(named)), find_swatches([sheet.plan])
    around = "shadows at" if len(named) == len(labels) else "shadows around"
    title = [around, f"local time ({zone})" if zone else "local time"]
    overlaps = OVERLAPS if len(named) > 1 else ""
    draw_swatches(sheet, tints, [labels[stamp] for stamp in named], title, overlaps, swatches)


def _find_named(labels: Sequence[str]) -> list[int]:
    """Choose the stamps that have a tint: all of few, else whole hours if there are enough."""
    stamps = list(range(len(labels)))
    if len(stamps) <= MOST_SWATCHES:
        return stamps
    whole = [stamp for stamp in stamps if labels[stamp].endswith(":00")]
    named = whole if len(whole) >= 3 else stamps
    return named[:: -(-len(named) // MOST_SWATCHES)]
