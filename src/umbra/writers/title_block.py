"""The title block of a sheet, the sun's path on its date, and a row of shadows through the day."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from umbra.writers.paper import INK, LINE, QUIET, RULE, SMALL, SUBTITLE, Leaf, Panel, wrap
from umbra.writers.picture_content import DOTS_PER_INCH, Plan, cover_with_roofs
from umbra.writers.pixels import HALF, resample

__all__ = [
    "BLOCK",
    "SHADOW",
    "SunRose",
    "draw_block",
    "draw_moments",
    "draw_sun_path",
    "find_moment_height",
    "find_type",
]

BLOCK = 1.9  # width of the column [inch]
LOGO = 0.6  # height of a logo [inch]
TITLE = 11.0  # [point]
SHADOW = (0.62, 0.66, 0.73)  # of one moment, sRGB
_GOLD = "#c98a00"
_A3 = 297 / 25.4  # height [inch]
_LOW, _SHARE, _HIGH = 0.9, 0.11, 1.9  # height of the row of moments: least, of the paper, most
_HORIZON = 90.0
_HEAD, _BETWEEN = 0.28, 0.12  # above a moment, and between two [inch]
_LEAST = 0.999  # height of moments in a row, of the row's
_NAMED = 3  # of the hours along the sun's path every third has its name


@dataclass(frozen=True, eq=False)
class SunRose:
    """The sun's way over a day: azimuth and altitude [degrees], and clock times along it."""

    path: NDArray[np.float64] | None = None  # (n, 2), of the study's hours
    stamps: Sequence[tuple[str, float, float]] = ()  # clock time, azimuth, altitude


def find_type(paper: float) -> float:
    """Return how much larger type is on a paper of this height than on A3, as lettering grows."""
    return max(1.0, math.sqrt(paper / _A3))


def find_moment_height(paper: float) -> float:
    """Return the height of the row of moments on a paper of this height [inch]."""
    return min(_HIGH, max(_LOW, _SHARE * paper))


def draw_block(
    panel: Panel, position: tuple[float, float, float], logo: NDArray[np.uint8] | None, scale: str,
    larger: float = 1.0,
) -> float:  # fmt: skip
    """
    Write logo, title, date, place and scale below a place (x, top, width) [inch].

    Type is ``larger`` than on A3. Returns where it ends.
    """
    x, y, width = position
    plan = panel.plan
    panel.rule([[(x, y), (x + width, y)]], INK, 1.2)
    if logo is not None:
        y -= 0.1 + _paste_logo(panel, logo, (x, y - 0.1, width))
    for text, size, weight, color in (
        (plan.title, TITLE, "bold", INK),
        (plan.subtitle, SUBTITLE, "normal", INK),
        (plan.date, SMALL, "normal", QUIET),
        (plan.place, SMALL, "normal", QUIET),
        (scale, SUBTITLE, "bold", INK),
    ):
        if not text:
            continue
        size *= larger  # noqa: PLW2901
        y -= 0.06 * larger
        for line in wrap(text, size, width, weight):
            y -= size * LINE
            panel.write(x, y + size * 0.3 / 72, line, size, weight=weight, color=color)
    y -= 0.1
    panel.rule([[(x, y), (x + width, y)]], RULE, 0.6)
    return y


def _paste_logo(
    panel: Panel, logo: NDArray[np.uint8], position: tuple[float, float, float]
) -> float:
    """Put a logo on white below a place (x, top, width); return its height [inch]."""
    x, top, width = position
    rows, cols = logo.shape[:2]
    scale = min(LOGO / rows, width / cols) * DOTS_PER_INCH
    size = max(1, round(cols * scale)), max(1, round(rows * scale))
    image = Image.new("RGBA", size, "white")
    image.alpha_composite(Image.fromarray(logo).resize(size, Image.Resampling.LANCZOS))
    high = size[1] / DOTS_PER_INCH
    panel.paste(np.asarray(image.convert("RGB"))[::-1], x, top - high)
    return high


def draw_sun_path(
    panel: Panel, sun: SunRose, position: tuple[float, float, float], larger: float = 1.0
) -> float:
    """
    Draw the sun's path over the plan's compass at a place (x, bottom, width) [inch].

    The rim is the horizon, the middle the zenith. Type is ``larger`` than on A3. Returns its
    height, 0 without a sun.
    """
    if sun.path is None or not len(sun.path):
        return 0.0
    x, y, width = position
    around = 0.2 * larger
    radius = width / 2 - around
    middle = np.array([x + width / 2, y + radius + around])
    north = panel.plan.true_north or 0.0

    def find(azimuth: NDArray | float, altitude: NDArray | float) -> NDArray[np.float64]:
        turn = np.radians(np.asarray(azimuth) + north)
        away = radius * (1 - np.asarray(altitude) / _HORIZON)
        return middle + np.stack([np.sin(turn), np.cos(turn)], -1) * away[..., None]

    rim = np.linspace(0, 360, 91)
    for altitude in (0, 30, 60):
        panel.rule([find(rim, np.full(91, altitude))], RULE, 0.6 if altitude == 0 else 0.3)
    panel.rule([[find(a, 0.0), find(a + 180, 0.0)] for a in (0.0, 90.0)], RULE, 0.3)
    for name, azimuth in (("N", 0.0), ("E", 90.0), ("S", 180.0), ("W", 270.0)):
        at = middle + (find(azimuth, 0.0) - middle) * (1 + 0.11 * larger / radius)
        style = {"color": QUIET, "ha": "center", "va": "center"}
        panel.write(float(at[0]), float(at[1]), name, SMALL * larger, **style)
    panel.rule([find(*sun.path.T)], _GOLD, 1.6)
    dot = np.linspace(0, 2 * math.pi, 13)
    for label, *direction in sun.stamps:
        at = find(*direction)
        panel.fill([at + 0.03 * np.column_stack([np.cos(dot), np.sin(dot)])], _GOLD, "none")
        if int(label) % _NAMED:
            continue
        label_at = at + (middle - at) / max(float(np.hypot(*(middle - at))), 1e-9) * 0.13 * larger
        place_x, place_y = label_at.tolist()
        size = (SMALL - 1) * larger
        panel.write(place_x, place_y, label, size, halo="#ffffffd8", ha="center", va="center")
    top = 2 * radius + 2.1 * around
    panel.write(x, y + top, "the sun's path", SMALL * larger, color=QUIET)
    return top + 0.13 * larger


def draw_moments(
    leaf: Leaf,
    plan: Plan,
    moments: Sequence[tuple[str, NDArray[np.bool_]]],
    position: tuple[float, float, float, float],
    larger: float = 1.0,
) -> None:
    """
    Draw the shadows at some times, small, in rows that fill a place (x, bottom, width, height).

    A row that is too low for all of them shows every n-th. Type is ``larger`` than on A3.
    """
    left, bottom, width, height = position
    x0, x1, y0, y1 = plan.extent
    aspect, head = (x1 - x0) / (y1 - y0), _HEAD * larger

    def fit(count: int, rows: int) -> float:
        across = math.ceil(count / rows)
        return min((width - (across - 1) * _BETWEEN) / across, (height / rows - head) * aspect)

    count = len(moments)
    rows = max(range(1, count + 1), key=lambda rows: fit(count, rows))
    least = _LEAST * (height - head) * aspect if rows == 1 else 0.0
    chosen = next(own for step in range(1, count + 1)
                  if fit(len(own := moments[::step]), rows) >= least or len(own) == 1)  # fmt: skip
    count = len(chosen)
    wide = fit(count, rows)
    high, cols = wide / aspect, math.ceil(count / rows)
    step = min(wide + (width - cols * wide) / max(cols - 1, 1), 1.6 * wide)
    for k, (label, mask) in enumerate(chosen):
        row, col = divmod(k, cols)
        size = round(high * DOTS_PER_INCH), round(wide * DOTS_PER_INCH)
        corner = left + col * step, bottom + height - (row + 1) * (height / rows)
        x, y = (round(side * DOTS_PER_INCH) / DOTS_PER_INCH for side in corner)
        panel = Panel(
            leaf, plan, (x, y, size[1] / DOTS_PER_INCH, size[0] / DOTS_PER_INCH), size
        )  # fmt: skip
        image = np.ones((*size, 3), np.float32)
        share = resample(mask, size)[..., None]
        image += share * (np.array(SHADOW, np.float32) - 1)
        if plan.roofs_cover:
            cover_with_roofs(image, plan, size)
        if plan.nothing is not None:
            image[resample(plan.nothing, size) > HALF] = 1
        panel.paste(image, x, y)
        x, y, w, h = panel.map_box
        panel.rule([[(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)]], RULE, 0.5)
        panel.write(x, y + h + 0.05, label, SMALL * larger, weight="bold")
