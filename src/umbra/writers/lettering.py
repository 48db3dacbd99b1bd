"""Type on a picture: its sizes, how wide a line is, and where a long one breaks."""

from collections.abc import Iterator

from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

__all__ = ["LINE", "SMALL", "SUBTITLE", "TITLE", "find_font", "measure", "wrap"]

TITLE, SUBTITLE, SMALL = 13.0, 9.5, 7.5  # sizes of type [point]
LINE = 1.42 / 72  # from one line of type to the next [inch per point]


def find_font(size: float, weight: str = "normal") -> FontProperties:
    """Give the one typeface, which comes with matplotlib."""
    return FontProperties(family="DejaVu Sans", size=size, weight=weight)


def measure(text: str, size: float, weight: str = "normal") -> float:
    """Give the width of a line of type [inch]."""
    width, _, _ = text_to_path.get_text_width_height_descent(text, find_font(size, weight), False)
    return width / 72


def wrap(text: str, size: float, width: float, weight: str = "normal") -> list[str]:
    """Break a text into lines no wider than ``width`` [inch]: between its parts if it can be."""
    lines: list[str] = []
    for line in _join(text.split(" · "), " · ", size, width, weight):
        lines += _join(line.split(" "), " ", size, width, weight)
    return [line for line in lines if line]


def _join(pieces: list[str], joint: str, size: float, width: float, weight: str) -> Iterator[str]:
    """Join pieces into lines as long as they fit; cut a single word that is too long."""
    line = ""
    for piece in pieces:
        longer = line + joint + piece if line else piece
        if measure(longer, size, weight) <= width:
            line = longer
            continue
        if line:
            yield line
        line = piece
        while joint == " " and measure(line, size, weight) > width:
            end = len(line) - 1
            while end > 1 and measure(line[:end], size, weight) > width:
                end -= 1
            yield line[:end]
            line = line[end:]
    yield line
