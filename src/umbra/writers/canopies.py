"""Canopies, which pictures look through, and the sky: how they are drawn and named in the key."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.writers.contours import trace
from umbra.writers.keys import Swatch
from umbra.writers.look import DARK, LUMINANCE, SKY
from umbra.writers.paper import Panel
from umbra.writers.plan import Plan
from umbra.writers.raster import resample

__all__ = ["find_swatches", "hatch_canopies", "outline_canopies"]

LEAF = "#1f6b2c"
_DARK, _LIGHT = np.array([(0x1F, 0x6B, 0x2C), (0xA6, 0xE3, 0xA8)], np.float32) / 255
STRIDE = 9  # pixels from a line of the hatch to the next


def hatch_canopies(image: NDArray[np.float32], plan: Plan, size: tuple[int, int]) -> None:
    """Hatch a plan's canopies on its map (rows, cols, 3), in [0, 1]; the hours show between."""
    if plan.canopies is None:
        return
    rows, cols = np.indices(size)
    lines = ((rows + cols) % STRIDE == 0) & (resample(plan.canopies, size) > 0.5)
    found = image[lines]
    ink = np.where((found @ LUMINANCE)[:, None] < DARK, _LIGHT, _DARK)
    image[lines] += 0.75 * (ink - found)


def outline_canopies(panel: Panel) -> None:
    """Draw the border of the canopies of a map."""
    if panel.plan.canopies is not None:
        lines = trace(panel, panel.plan.canopies)
        panel.rule_map(lines, "#ffffffc0", 2.0)
        panel.rule_map(lines, LEAF, 0.9)


def find_swatches(plans: Sequence[Plan]) -> list[Swatch]:
    """Name what maps show besides hours."""
    swatches = []
    crowned = next((plan for plan in plans if plan.canopies is not None), None)
    if crowned is not None:
        swatches.append(Swatch(crowned.canopy_name, "white", LEAF, "/////"))
    looks = [plan.look for plan in plans if plan.look is not None]
    if any(look.sky is not None and (look.sky > 127).any() for look in looks):
        swatches.append(Swatch("sky: no hours", SKY))
    return swatches
