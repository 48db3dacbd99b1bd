"""The shadow profile: the shadows of several instants over one another."""

import os
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from umbra.writers.color import make_stamp_tints
from umbra.writers.contours import trace
from umbra.writers.keys import draw_color_bar, draw_swatches
from umbra.writers.plan import Plan, shade_roofs
from umbra.writers.raster import resample
from umbra.writers.sheet import Sheet, make_sheet

__all__ = ["compose_profile", "draw_profile", "make_profile_sheet"]

MOST_SWATCHES = 12
OVERLAPS = "darker where they overlap"
OUTLINE = "#55555e"
# Optical density adds up where shadows overlap; past this it is bent, so that the
# deepest overlap of a long day stays dark blue or brown and never turns solid black.
DEEPEST = 1.6


def compose_profile(
    shadows: Iterable[NDArray[np.bool_]], n: int, size: tuple[int, int]
) -> NDArray[np.float32]:
    """
    Multiply the tints of n stamps where their shadows fall.

    Parameters
    ----------
    shadows : iterable of (rows, cols) bool
        One a stamp; taken one by one, so an iterator does.
    n : int
        How many there are.
    size : (rows, cols)
        Of the result.

    Returns
    -------
    transmission : (rows, cols, 3) float32
        What the stamps leave of white, in sRGB: 1 where no shadow falls.

    Raises
    ------
    ValueError
        If ``shadows`` does not hold n masks.
    """
    densities = -np.log(_find_tints(n)).astype(np.float32)
    stamps = iter(shadows)
    total: NDArray[np.float32] | None = None
    given = 0
    while batch := list(islice(stamps, 8)):
        # Eight stamps are the bits of one byte, and a table adds up what they absorb.
        absorbed = np.zeros((256, 3), np.float32)
        bits = np.zeros(batch[0].shape, np.uint8)
        for bit, mask in enumerate(batch):
            bits |= np.asarray(mask, bool).view(np.uint8) << np.uint8(bit)
            if given + bit < n:
                absorbed[np.arange(256) >> bit & 1 == 1] += densities[given + bit]
        given += len(batch)
        if total is None:
            total = np.zeros((3, *bits.shape), np.float32)
        for channel in range(3):
            total[channel] += absorbed[:, channel][bits]
    if given != n:
        msg = f"{given} shadows for {n} labels"
        raise ValueError(msg)
    if total is None:
        return np.ones((*size, 3), np.float32)
    return np.exp(_bend(np.dstack([resample(channel, size) for channel in total])))


def _find_tints(n: int) -> NDArray[np.float64]:
    """Give each stamp's tint, paler where many may overlap."""
    strength = float(np.clip(5.0 / max(n, 1), 0.26, 0.85))
    tints = 1 - strength * (1 - make_stamp_tints(n))
    # Where all overlap, no channel wins by much: shadow is a dark grey, not a brown.
    densities = -np.log(tints)
    balance = densities.sum() / 3 / densities.sum(axis=0)
    return np.exp(-densities * balance**0.6) if n > 3 else tints


def _bend(density: NDArray[np.float32]) -> NDArray[np.float32]:
    """Bend density down toward ``DEEPEST``, hardly at all where it is small; negate it."""
    return -DEEPEST * np.tanh(density / DEEPEST)


def draw_profile(
    path: str | os.PathLike[str],
    plan: Plan,
    shadows: Iterable[NDArray[np.bool_]],
    labels: Sequence[str],
    zone: str = "",
    receivers: Literal["ground", "top"] = "ground",
) -> None:
    """
    Draw a shadow profile as a PNG.

    Parameters
    ----------
    path : path
    plan : Plan
    shadows : iterable of (rows, cols) bool
        Where shadow falls at each stamp; rows ascend in y.
    labels : sequence of str
        The stamps' clock times, "09:00".
    zone : str
        What clock that is: "CEST".
    receivers : {'ground', 'top'}
        ``ground``: roofs are drawn over the shadows. ``top``: shadows fall on roofs.

    Raises
    ------
    ValueError
        If the counts of shadows and labels differ.
    OSError
        If the file cannot be written.
    """
    make_profile_sheet(plan, shadows, labels, zone, receivers).save(path)


def make_profile_sheet(
    plan: Plan,
    shadows: Iterable[NDArray[np.bool_]],
    labels: Sequence[str],
    zone: str = "",
    receivers: Literal["ground", "top"] = "ground",
) -> Sheet:
    """Lay out what ``draw_profile`` writes; same parameters, less the path."""
    n = len(labels)
    sheet = make_sheet(plan, key_height=0.62)
    image = compose_profile(shadows, n, sheet.map_size)
    grey, coverage = shade_roofs(plan, sheet.map_size)
    if receivers == "ground":
        image += coverage[..., None] * (grey[..., None] - image)
    else:
        image *= (1 - coverage * (1 - grey))[..., None]
    sheet.paste(image, *sheet.map_box[:2])
    if plan.building_height is not None:
        is_building = np.nan_to_num(plan.building_height) > 0
        sheet.rule(trace(sheet, is_building), OUTLINE, 0.6, on_map=True)

    tints = _find_tints(n)
    title = ["shadows at", f"local time ({zone})" if zone else "local time"]
    if n <= MOST_SWATCHES:
        draw_swatches(sheet, tints, list(labels), title, OVERLAPS if n > 1 else "")
    else:
        draw_color_bar(sheet, tints, _find_bar_ticks(labels), title, OVERLAPS)
    return sheet


def _find_bar_ticks(labels: Sequence[str], most: int = 9) -> list[tuple[float, str]]:
    """Name some of many stamps, whole hours if there are enough, at the middles of their bands."""
    n = len(labels)
    whole = [i for i, label in enumerate(labels) if label.endswith(":00")]
    named = whole if len(whole) >= 3 else list(range(n))
    named = named[:: -(-len(named) // most)]
    return [((i + 0.5) / n, labels[i]) for i in named]
