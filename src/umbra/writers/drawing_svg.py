"""A drawing as SVG, with layers and parts as groups that Inkscape and Illustrator show by name."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from umbra.drawing.drawn_page import INK, DrawnPart, Fill, Hatching, Page
from umbra.writers.typeface import fit_caption

__all__ = ["find_angle", "tell_number", "tell_svg", "write_drawing_svg"]

_SEAM = "path.seam{stroke-width:1px;stroke-linejoin:round;vector-effect:non-scaling-stroke}"
"""
A stroke in a face's own colour, so that no paper shines between faces: a pixel of the screen at any
scale. Each of two faces covers a part of the pixels along their edge, and both together not all.
"""
OUTLINE, CREASE = 0.7, 0.35
"""Widths of lines [pixels]."""
SPACING, HATCH = 4.0, 0.7
"""Distance of hatching lines, and their width [pixels]."""
TYPE = 1 / 48
"""Of the caption: share of the picture's height."""
_LEAST = 10.0  # [pixels]


def write_drawing_svg(path: Path, page: Page) -> None:
    """Write a drawing as SVG; the same drawing gives the same bytes."""
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for piece in tell_svg(page):
            file.write(piece + "\n")


def tell_svg(page: Page) -> Iterable[str]:
    """Yield the lines of a drawing."""
    cols, rows = page.size
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        '<svg xmlns="http://www.w3.org/2000/svg" '
        'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'width="{cols}" height="{rows}" viewBox="0 0 {cols} {rows}">'
    )
    yield f"<desc>{escape(page.about)}</desc>"
    yield f"<style>{_SEAM}</style>"
    yield "<defs>"
    yield from _define(page)
    yield "</defs>"
    if page.sky:
        yield f'{_open("sky", "Sky")}<rect width="{cols}" height="{rows}" fill="url(#air)"/></g>'
    solid = [part for part in page.parts if not part.is_clear]
    clear = [part for part in page.parts if part.is_clear]
    yield from _layer("faces", "Faces", solid, lambda part: map(_fill, part.faces))
    yield from _layer("shadows", "Shadows", solid, lambda part: map(_fill, part.shadows))
    yield from _layer(
        "glass", "Transparent", clear, lambda part: map(_fill, [*part.faces, *part.shadows])
    )
    ink = f'fill="none" stroke="{_color(INK)}" stroke-linecap="round"'
    yield from _layer("lines", "Lines", page.parts, _draw_lines, ink)
    if page.caption:
        size = max(_LEAST, rows * TYPE)
        room = cols - 2 * size
        fitting = fit_caption(page.caption, size, room)
        # Another typeface may be wider: a line that fills the picture states its length.
        held = "" if fitting == size else f'textLength="{room:g}" lengthAdjust="spacingAndGlyphs" '
        yield (
            f'{_open("caption", "Caption")}<text x="{size:g}" y="{rows - size:g}" '
            f'font-family="DejaVu Sans, Verdana, Arial, sans-serif" font-size="{fitting:g}" {held}'
            f'fill="{_color(INK)}" stroke="#fff" stroke-opacity="0.8" stroke-width="{size / 5:g}" '
            f'stroke-linejoin="round" paint-order="stroke">{escape(page.caption)}</text></g>'
        )
    yield "</svg>"


def _define(page: Page) -> Iterable[str]:
    """Define the sky's gradient and the hatching of each light."""
    if page.sky:
        stops = "".join(
            f'<stop offset="{share:g}" stop-color="{_color(rgb)}"/>' for share, rgb in page.sky
        )
        yield f'<linearGradient id="air" x1="0" y1="0" x2="0" y2="1">{stops}</linearGradient>'
    hatched = any(isinstance(fill, Hatching) for part in page.parts for fill in part.shadows)
    for light in range(page.lights if hatched else 0):
        yield (
            f'<pattern id="hatch{light}" width="{SPACING:g}" height="{SPACING:g}" '
            f'patternUnits="userSpaceOnUse" patternTransform="rotate({find_angle(light):g})">'
            f'<path d="M0 0V{SPACING:g}" stroke="{_color(INK)}" stroke-width="{2 * HATCH:g}"/>'
            "</pattern>"
        )


def find_angle(light: int) -> float:
    """Return the angle of a light's hatching from the vertical, clockwise [degrees]."""
    return (45.0 + 60.0 * light) % 180.0


def _layer(
    name: str, label: str, parts: Sequence[DrawnPart], tell: object, more: str = ""
) -> Iterable[str]:
    """Write a layer: a group for each part that has something in it."""
    groups = []
    for number, part in enumerate(parts):
        inside = "".join(tell(part))  # type: ignore[operator]
        if inside:
            title = f"{part.name} ({part.kind})" if part.kind else part.name
            head = _open(f"{name}-{number}", part.name or "model", is_layer=False)
            groups.append(f"{head}<title>{escape(title)}</title>{inside}</g>")
    if groups:
        yield _open(name, label, more)
        yield from groups
        yield "</g>"


def _open(name: str, label: str, more: str = "", *, is_layer: bool = True) -> str:
    """Begin a group."""
    mode = ' inkscape:groupmode="layer"' if is_layer else ""
    return f'<g id="{name}"{mode} inkscape:label={quoteattr(label)}{more and " " + more}>'


def _fill(fill: Fill | Hatching) -> str:
    """Return a path of filled rings."""
    if isinstance(fill, Hatching):
        return f'<path fill="url(#hatch{fill.light})" d="{_trace(fill.rings)}"/>'
    color = _color(fill.color)
    seam = f' class="seam" stroke="{color}"'
    if fill.opacity < 1:
        seam = f' fill-opacity="{fill.opacity:g}"'
    return f'<path fill="{color}"{seam} d="{_trace(fill.rings)}"/>'


def _draw_lines(part: DrawnPart) -> Iterable[str]:
    """Return a path of the outlines of a part, and one of its creases."""
    for lines, width in ((part.creases, CREASE), (part.outlines, OUTLINE)):
        if lines:
            spots = np.array(lines).reshape(-1, 4).tolist()
            way = "".join(f"M{tell_number(a)} {tell_number(b)}L{tell_number(c)} {tell_number(d)}"
                          for a, b, c, d in spots)  # fmt: skip
            yield f'<path stroke-width="{width}" d="{way}"/>'


def _trace(rings: Sequence[np.ndarray]) -> str:
    """Return the data of a path of closed rings."""
    return "".join(
        "M" + "L".join(f"{tell_number(x)} {tell_number(y)}" for x, y in ring.tolist()) + "Z"
        for ring in rings
    )


def tell_number(value: float) -> str:
    """Write a coordinate to a thousandth of a pixel, without zeros at its end."""
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _color(rgb: Sequence[int]) -> str:
    return f"#{rgb[0]:02x}{rgb[1]:02x}{rgb[2]:02x}"
