"""
The typeface of all pictures, which comes with matplotlib: its letters, and their length.

Letters that it lacks are taken from the system's typefaces.
"""

from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.packages import make_folder_error

if TYPE_CHECKING:
    from PIL import ImageFont

__all__ = ["FACE", "find_families", "fit_caption", "load_font", "note_missing"]

FACE = "DejaVu Sans"
_FILE = Path("mpl-data", "fonts", "ttf", "DejaVuSans.ttf")
_FEW = 8  # characters that a note lists
_REGULAR = {"normal", "regular", "book", "medium", 400, 500}


@cache
def _find_file() -> str:
    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.submodule_search_locations
    return str(Path(spec.submodule_search_locations[0]) / _FILE)


@cache
def _read_letters(path: str) -> frozenset[int]:
    """Return the codes of a typeface's characters; none of a file that is not one."""
    try:
        from matplotlib.ft2font import FT2Font  # noqa: PLC0415  (slower to load than Pillow)
    except OSError as error:
        raise make_folder_error() from error
    with suppress(OSError, RuntimeError):
        return frozenset(FT2Font(path).get_charmap())
    return frozenset()


def _find_lacking(text: str) -> frozenset[int]:
    if text.isascii():
        return frozenset()
    return frozenset(map(ord, text)) - _read_letters(_find_file())


def _list_others(lacking: frozenset[int]) -> Iterator[tuple[Any, frozenset[int]]]:
    """List typefaces of the system, those with most of some characters first, until all are had."""
    if not lacking:
        return
    from matplotlib.font_manager import findSystemFonts, fontManager  # noqa: PLC0415

    for path in {*findSystemFonts()} - {font.fname for font in fontManager.ttflist}:
        with suppress(OSError, RuntimeError):  # installed since matplotlib made its list
            fontManager.addfont(path)
    own = str(Path(_find_file()).parent)  # matplotlib's others are for formulas
    upright = [
        font for font in fontManager.ttflist
        if font.style == "normal" and font.weight in _REGULAR and not font.fname.startswith(own)
    ]  # fmt: skip
    upright.sort(key=lambda font: ("Sans" not in font.name, font.name))
    while upright and lacking:
        best = max(upright, key=lambda font: len(lacking & _read_letters(font.fname)))
        letters = lacking & _read_letters(best.fname)
        if not letters:
            return
        yield best, letters
        lacking -= letters


@cache
def _find_others(lacking: frozenset[int]) -> tuple[tuple[Any, frozenset[int]], ...]:
    return tuple(_list_others(lacking))


def find_families(text: str) -> tuple[str, ...]:
    """Return the typefaces that a text needs, this one first; the system may lack some letters."""
    others = _find_others(_find_lacking(text))
    return (FACE, *dict.fromkeys(font.name for font, _ in others))


def load_font(size: float, text: str = "") -> "ImageFont.FreeTypeFont":
    """Load it in a size [pixels], or the one with most of a text's letters, if it lacks some."""
    from PIL import ImageFont  # noqa: PLC0415  (the painter's child draws)

    path = _find_file()
    if lacking := _find_lacking(text):
        path = next((font.fname for font, _ in _find_others(lacking | set(map(ord, text)))), path)
    return ImageFont.truetype(path, size)


def fit_caption(text: str, size: float, width: float) -> float:
    """Return the size of type, at most ``size``, in which a line is no longer than ``width``."""
    length = load_font(size, text).getlength(text)
    return size if length <= width else size * width / length


def note_missing(text: str, of: str = "caption") -> str:
    """Describe the characters of a text that no typeface has; nothing if all are had."""
    lost = _find_lacking(text)
    lost -= frozenset().union(*(letters for _, letters in _find_others(lost)))
    lacking = [c for c in dict.fromkeys(text) if ord(c) in lost]
    if not lacking:
        return ""
    more = f" and {len(lacking) - _FEW} more" if len(lacking) > _FEW else ""
    return (
        f"no typeface of this machine has {' '.join(lacking[:_FEW])}{more} of the {of}, which are "
        "boxes in PNG and PDF; install one that has them, use other letters, or write an SVG"
    )
