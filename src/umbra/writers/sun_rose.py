"""A compass with the sun's path on frames of films: rim the horizon, middle the zenith."""

import math
from collections.abc import Sequence

from PIL import Image, ImageDraw, ImageFont

__all__ = ["paste_rose", "paste_scale"]

_FINE = 4  # times finer than the frame is it drawn
_INK, _RULE, _GOLD, _NORTH = "#1c1c22", "#8c8c96", "#c98a00", "#a31515"
_SPAN = 90.0  # altitudes from rim to middle [degrees]
Direction = tuple[float, float]
"""Azimuth from true north and altitude [degrees]."""


def paste_rose(
    frame: Image.Image,
    middle: tuple[float, float],
    radius: float,
    north: float,
    sun: Direction,
    path: Sequence[Direction] = (),
) -> None:
    """
    Draw a compass with the sun on a frame.

    Parameters
    ----------
    frame : Image
        RGB, drawn into.
    middle : (float, float)
        Column and row [pixels].
    radius : float
        Of the rim [pixels].
    north : float
        Angle of true north from the top of the frame, clockwise [degrees].
    sun : (float, float)
    path : sequence of (float, float)
        The sun's way over the day.
    """
    half = round(radius * 1.6)
    size, rim = 2 * half * _FINE, radius * _FINE
    picture = Image.new("RGBA", (size, size), (255, 255, 255, 0))
    pen, centre = ImageDraw.Draw(picture), size / 2

    def find(azimuth: float, altitude: float) -> tuple[float, float]:
        turn, away = math.radians(azimuth + north), rim * (1 - max(altitude, 0.0) / _SPAN)
        return centre + away * math.sin(turn), centre - away * math.cos(turn)

    def ring(at: tuple[float, float], r: float) -> tuple[float, float, float, float]:
        return at[0] - r, at[1] - r, at[0] + r, at[1] + r

    disc = ring((centre, centre), rim)
    pen.ellipse(disc, fill=(255, 255, 255, 225), outline=_RULE, width=_FINE)
    if len(path) > 1:
        pen.line([find(*at) for at in path], fill=_GOLD, width=round(1.5 * _FINE), joint="curve")
    x, y = find(0.0, 0.0)
    tip = centre + 1.3 * (x - centre), centre + 1.3 * (y - centre)
    letter = ImageFont.load_default(round(0.55 * rim))
    pen.text(tip, "N", _NORTH, letter, anchor="mm", stroke_width=_FINE, stroke_fill="white")
    pen.line([(x, y), find(0.0, 25.0)], fill=_NORTH, width=round(1.5 * _FINE))
    pen.ellipse(ring(find(*sun), 0.17 * rim), fill="#f2b632", outline=_INK, width=_FINE)
    small = picture.resize((2 * half, 2 * half), Image.Resampling.LANCZOS)
    frame.paste(small, (round(middle[0]) - half, round(middle[1]) - half), small)


def paste_scale(frame: Image.Image, end: tuple[float, float], length: float, label: str) -> float:
    """Draw a bar of a length [pixels], its label above, that ends at a place; return its start."""
    pen = ImageDraw.Draw(frame)
    x, y = end[0] - length, end[1]
    pen.rectangle((x, y, x + length / 2, y + 4), fill=_INK, outline=_INK)
    pen.rectangle((x + length / 2, y, end[0], y + 4), fill="white", outline=_INK)
    pen.text((end[0], y - 3), label, _INK, ImageFont.load_default(13), anchor="rs")
    return x
