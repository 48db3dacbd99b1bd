"""The typeface of all pictures, which comes with matplotlib: its letters, and their length."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

from PIL import ImageFont

__all__ = ["fit_caption", "load_font", "note_missing"]

_FILE = Path("mpl-data", "fonts", "ttf", "DejaVuSans.ttf")
_FEW = 8  # characters that a note lists


@cache
def _find_file() -> str:
    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.submodule_search_locations
    return str(Path(spec.submodule_search_locations[0]) / _FILE)


def load_font(size: float) -> ImageFont.FreeTypeFont:
    """Load it in a size [pixels]."""
    return ImageFont.truetype(_find_file(), size)


def fit_caption(text: str, size: float, width: float) -> float:
    """Return the size of type, at most ``size``, in which a line is no longer than ``width``."""
    length = load_font(size).getlength(text)
    return size if length <= width else size * width / length


def note_missing(text: str) -> str:
    """Describe the characters of a caption that it lacks; nothing if it has all."""
    from matplotlib.ft2font import FT2Font  # noqa: PLC0415  (slower to load than Pillow)

    font = FT2Font(_find_file())
    lacking = [c for c in dict.fromkeys(text) if not font.get_char_index(ord(c))]
    if not lacking:
        return ""
    more = f" and {len(lacking) - _FEW} more" if len(lacking) > _FEW else ""
    return (
        f"the typeface of pictures, DejaVu Sans, lacks {' '.join(lacking[:_FEW])}{more} of the "
        "caption, which are boxes in PNG and PDF; write them in other letters, or write an SVG"
    )
