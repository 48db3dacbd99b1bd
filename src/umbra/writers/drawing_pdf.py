"""A drawing as PDF of one page, with layers that can be switched on and off."""

import math
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from umbra.drawing.drawn_page import INK, DrawnPart, Fill, Hatching, Page
from umbra.writers.drawing_svg import (
    CREASE,
    HATCH,
    OUTLINE,
    SPACING,
    TYPE,
    find_angle,
    tell_number,
)
from umbra.writers.typeface import find_families, fit_caption

__all__ = ["write_drawing_pdf"]

_POINT = 0.75  # of a pixel: 96 of them are an inch, as in SVG
_LEAST = 10.0  # type of a caption [pixels]
_LAYERS = ("Sky", "Faces", "Shadows", "Transparent", "Lines", "Caption")


def write_drawing_pdf(path: Path, page: Page) -> None:
    """Write a drawing as PDF; the same drawing gives the same bytes."""
    path.write_bytes(_Objects().write(page))


class _Objects:
    """The numbered objects of a file."""

    def __init__(self) -> None:
        self._objects: list[bytes] = []

    def add(self, text: str, stream: bytes | None = None) -> int:
        """Add a dictionary, or a stream; return its number."""
        body = f"<<{text}>>".encode("latin-1")
        if stream is not None:
            packed = zlib.compress(stream, 9)
            head = f"<<{text}/Filter/FlateDecode/Length {len(packed)}>>".encode("latin-1")
            body = head + b"\nstream\n" + packed + b"\nendstream"
        self._objects.append(body)
        return len(self._objects)

    def write(self, page: Page) -> bytes:
        """Return a whole file."""
        cols, rows = page.size
        groups = [self.add(f"/Type/OCG/Name({name})") for name in _LAYERS]
        layers = "".join(f"/L{k} {number} 0 R" for k, number in enumerate(groups))
        opacities = sorted(
            {fill.opacity for p in page.parts for fill in p.faces if fill.opacity < 1}
        )
        states = "".join(f"/O{k}<</ca {value:g}>>" for k, value in enumerate(opacities))
        font = self.add("/Type/Font/Subtype/Type1/BaseFont/Helvetica/Encoding/WinAnsiEncoding")
        hatches = "".join(f"/H{k} {self._hatch(k, sum(page.size))} 0 R" for k in range(page.lights))
        sky = f"/Shading<</S {self._sky(page)} 0 R>>" if page.sky else ""
        content = "\n".join(_draw(page, opacities)).encode("cp1252")
        stream = self.add("", content)
        pages = len(self._objects) + 2
        leaf = self.add(
            f"/Type/Page/Parent {pages} 0 R/MediaBox[0 0 {cols * _POINT:g} {rows * _POINT:g}]"
            f"/Contents {stream} 0 R/Resources<</Properties<<{layers}>>/ExtGState<<{states}>>"
            f"/Font<</F {font} 0 R>>/Pattern<<{hatches}>>{sky}>>"
        )
        self.add(f"/Type/Pages/Kids[{leaf} 0 R]/Count 1")
        listed = " ".join(f"{number} 0 R" for number in groups)
        root = self.add(
            f"/Type/Catalog/Pages {pages} 0 R/OCProperties<</OCGs[{listed}]/D<</Order[{listed}]"
            f"/ON[{listed}]>>>>"
        )
        about = page.about.encode("utf-16-be").hex().upper()
        info = self.add(f"/Producer(umbra)/Subject<FEFF{about}>")
        return self._join(root, info)

    def _hatch(self, light: int, length: int) -> int:
        """
        Add the pattern of a light's hatching, in the page's own frame.

        Its lines are as long as the page: viewers show the joints of shorter ones as gaps.
        """
        turn = math.radians(find_angle(light))
        c, s = _POINT * math.cos(turn), _POINT * math.sin(turn)
        red, green, blue = (value / 255 for value in INK)
        line = f"{red:.3f} {green:.3f} {blue:.3f} RG {HATCH:g} w {SPACING / 2:g} 0 m "
        line += f"{SPACING / 2:g} {length} l S"
        return self.add(
            "/Type/Pattern/PatternType 1/PaintType 1/TilingType 1"
            f"/BBox[0 0 {SPACING:g} {length}]/XStep {SPACING:g}/YStep {length}/Resources<<>>"
            f"/Matrix[{c:.6f} {-s:.6f} {s:.6f} {c:.6f} 0 0]",
            line.encode(),
        )

    def _sky(self, page: Page) -> int:
        """Add the sky's gradient, whose stops are evenly spaced."""
        samples = bytes(value for _, rgb in page.sky for value in rgb)
        function = self.add(
            f"/FunctionType 0/Domain[0 1]/Range[0 1 0 1 0 1]/Size[{len(page.sky)}]/BitsPerSample 8",
            samples,
        )
        return self.add(
            f"/ShadingType 2/ColorSpace/DeviceRGB/Coords[0 0 0 {page.size[1]}]"
            f"/Function {function} 0 R/Extend[true true]"
        )

    def _join(self, root: int, info: int) -> bytes:
        """Join the objects with their table."""
        out = bytearray(b"%PDF-1.5\n%\xe2\xe3\xcf\xd3\n")
        places = []
        for number, body in enumerate(self._objects, 1):
            places.append(len(out))
            out += f"{number} 0 obj\n".encode() + body + b"\nendobj\n"
        table = len(out)
        out += f"xref\n0 {len(places) + 1}\n0000000000 65535 f \n".encode()
        out += "".join(f"{offset:010} 00000 n \n" for offset in places).encode()
        tail = f"trailer\n<</Size {len(places) + 1}/Root {root} 0 R/Info {info} 0 R>>\n"
        return bytes(out) + f"{tail}startxref\n{table}\n%%EOF\n".encode()


def _draw(page: Page, opacities: Sequence[float]) -> Iterable[str]:
    """Yield the operators of a page, with y running down and pixels as units."""
    yield f"{_POINT} 0 0 {-_POINT} 0 {page.size[1] * _POINT:g} cm 1 j 1 J"
    solid = [part for part in page.parts if not part.is_clear]
    clear = [part for part in page.parts if part.is_clear]
    if page.sky:
        yield from _layer(0, ["/S sh"])
    yield from _layer(1, (_fill(fill, opacities) for part in solid for fill in part.faces))
    yield from _layer(2, (_fill(fill, opacities) for part in solid for fill in part.shadows))
    over = ([*part.faces, *part.shadows] for part in clear)
    yield from _layer(3, (_fill(fill, opacities) for fills in over for fill in fills))
    yield from _layer(4, _draw_lines(page.parts))
    if page.caption:
        yield from _layer(5, _write_caption(page))


def _layer(number: int, operators: Iterable[str]) -> Iterable[str]:
    yield f"/OC /L{number} BDC q"
    yield from operators
    yield "Q EMC"


def _fill(fill: Fill | Hatching, opacities: Sequence[float]) -> str:
    """Return the operators that fill rings."""
    rings = "\n".join(_trace(ring) for ring in fill.rings)
    if isinstance(fill, Hatching):
        return f"/Pattern cs /H{fill.light} scn\n{rings}\nf"
    color = _color(fill.color)
    if fill.opacity < 1:
        return f"q /O{opacities.index(fill.opacity)} gs {color} rg\n{rings}\nf Q"
    # The thinnest line that a screen or a printer draws closes the seam to the next face.
    return f"{color} rg {color} RG 0 w\n{rings}\nB"


def _draw_lines(parts: Sequence[DrawnPart]) -> Iterable[str]:
    yield f"{_color(INK)} RG"
    for part in parts:
        for lines, width in ((part.creases, CREASE), (part.outlines, OUTLINE)):
            if lines:
                spots = np.array(lines).reshape(-1, 4).tolist()
                ways = (
                    f"{tell_number(a)} {tell_number(b)} m {tell_number(c)} {tell_number(d)} l"
                    for a, b, c, d in spots
                )
                yield f"{width} w " + "\n".join(ways) + " S"


def _write_caption(page: Page) -> Iterable[str]:
    """Write the caption as text; as outlines if the typeface of every PDF lacks a letter."""
    cols, rows = page.size
    margin = max(_LEAST, rows * TYPE)
    where = f"1 0 0 -1 {margin:g} {rows - margin:g} cm"
    size = fit_caption(page.caption, margin, cols - 2 * margin)
    try:
        page.caption.encode("cp1252")
    except UnicodeEncodeError:
        from matplotlib.textpath import TextPath  # noqa: PLC0415

        from umbra.writers.paper import find_font  # noqa: PLC0415

        font = find_font(size, families=find_families(page.caption))
        text_path = TextPath((0, 0), page.caption, size=size, prop=font)
        rings = [np.asarray(ring) for ring in text_path.to_polygons()]
        yield f"{where} {_color(INK)} rg"
        yield "\n".join(_trace(ring[:-1]) for ring in rings) + " f"
        return
    text = page.caption.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
    shown = f"BT /F {size:g} Tf 0 0 Td ({text}) Tj ET"
    yield f"{where} 1 1 1 RG {size / 5:g} w 1 Tr {shown} {_color(INK)} rg 0 Tr {shown}"


def _trace(ring: np.ndarray) -> str:
    """Return the operators of a closed ring."""
    spots = [f"{tell_number(x)} {tell_number(y)}" for x, y in ring.tolist()]
    return f"{spots[0]} m " + " l ".join(spots[1:]) + " l h"


def _color(rgb: Sequence[int]) -> str:
    return " ".join(f"{value / 255:.3f}" for value in rgb)
