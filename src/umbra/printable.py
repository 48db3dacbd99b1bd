"""Text that is safe to print: names in files may contain terminal commands."""

import json
import re
from collections import Counter
from collections.abc import Sequence

__all__ = ["LONGEST", "fit_names", "make_printable", "shorten"]

LONGEST = 500
"""Letters of a message; what a file's names add to it is cut from its middle."""

_TAIL = 180  # letters kept at a message's end, where the remedy stands
# Commands to a terminal, half characters, and what turns the order of letters or hides text:
# all but tab and line feed. Joiners stay, which Persian and Hindi need.
_COMMANDS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff"
    "\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e007f]"
)


def make_printable(text: str, *, is_json: bool = False) -> str:
    r"""
    Write control and bidirectional characters as Python does: ``\x1b``, ``\u202e``.

    Parameters
    ----------
    text : str
    is_json : bool
        Write them as JSON does, ``\\u001b``, which reads back as what it was.

    Returns
    -------
    text : str
        The same where there are none; tabs and line feeds stay.
    """
    if is_json:
        return _COMMANDS.sub(lambda found: json.dumps(found[0])[1:-1], text)
    return _COMMANDS.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


def shorten(text: str, longest: int = LONGEST) -> str:
    """Cut a line's middle out, and say how much is missing; a short one stays."""
    if len(text) <= longest:
        return text
    gap = f" … ({len(text):,} characters in all) … "
    return text[: longest - len(gap) - _TAIL] + gap + text[-_TAIL:]


def fit_names(names: Sequence[str], width: int) -> list[str]:
    """
    Cut names for a column of so many letters so that no two come out alike.

    The middle is left out where one is too long, as programs number things at the end. Where two
    names would still be the same they stay whole.
    """
    tail = width // 2
    cut = {
        name: name if len(name) <= width else f"{name[: width - tail - 1]}…{name[-tail:]}"
        for name in names
    }
    uses = Counter(cut.values())
    return [cut[name] if uses[cut[name]] == 1 else name for name in names]
