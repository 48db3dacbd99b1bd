"""
What umbra raises, so that a caller can tell bad input from failed work.

Messages name options as they are typed in Python, ``no_cast=`` or ``receivers='top'``. The
command line writes them as its own, ``--no-cast`` and ``--receivers top``. Names in files may
contain terminal commands, so text is made safe to print here.
"""

import json
import re
from collections import Counter
from collections.abc import Sequence

__all__ = [
    "LONGEST",
    "InputError",
    "UmbraError",
    "fit_names",
    "make_printable",
    "shorten",
    "write_for_shell",
]

LONGEST = 500
"""Letters of a message; names from files that make it longer are cut from its middle."""

_TAIL = 180  # letters kept at a message's end, where the remedy stands
# Commands to a terminal, half characters, and what turns the order of letters or hides text:
# all but tab and line feed. Joiners stay, which Persian and Hindi need.
_COMMANDS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff"
    "\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e007f]"
)
_SPELLED = {
    "by_day=False": "sum",
    "end": "to",
    "latitude": "lat",
    "lights": "light",
    "longitude": "lon",
    "spots": "spot",
    "start": "from",
    "true_north": "north",
    "zone": "tz",
}
"""Options that have another name on the command line."""

_OPTIONS = """
allow_outside at base_column by by_day canopy canopy_heights cast cell date device every
every_days exact extent eye fov ground height height_column layer_gap layer_length leaf_on
light_samples light_size mask_scale masks method min_spell name_column near no_cast on
points proposed receivers refraction report rules sheet size soft spacing spells target threads
transmissivity trunk under up who write end latitude lights longitude spots start true_north zone
"""
OPTIONS = frozenset(_OPTIONS.split())
"""What messages may name."""

_OPTION = re.compile(
    r"(?<![\w'\"=./-])([a-z][a-z_]*)="
    r"(\([^()]*\)|\[[^\]]*\]|'[^']*'(?: or '[^']*')*|True\b|False\b|[-+]?\d+(?:\.\d+)?)?"
    r"(?![\w='\"(\[])"
)


def make_printable(text: str, *, is_json: bool = False) -> str:
    r"""
    Write control and bidirectional characters as Python does: ``\x1b``, ``\u202e``.

    Parameters
    ----------
    text : str
    is_json : bool
        Write them as JSON does, ``\\u001b``, which reads back unchanged.

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
    Cut names for a column of a width in letters so that no two come out alike.

    The middle is left out where one is too long, as programs number objects at the end. Where two
    names would still be the same they stay whole.
    """
    tail = width // 2
    cut = {
        name: name if len(name) <= width else f"{name[: width - tail - 1]}…{name[-tail:]}"
        for name in names
    }
    uses = Counter(cut.values())
    return [cut[name] if uses[cut[name]] == 1 else name for name in names]


def write_for_shell(text: str) -> str:
    """
    Write the options in a message as they are typed in a shell.

    Parameters
    ----------
    text : str
        With options as in Python: ``no_cast=``, ``receivers='top'``, ``size=(512, 384)``.

    Returns
    -------
    text : str
        ``--no-cast``, ``--receivers top``, ``--size 512x384``.
    """
    return _OPTION.sub(_spell, text)


def _spell(found: re.Match[str]) -> str:
    name, value = found.groups()
    if name not in OPTIONS:
        return found[0]
    word = _SPELLED.get(found[0]) or _SPELLED.get(name, name).replace("_", "-")
    if value in {None, "True", "False"}:
        return f"--{word}"
    values = re.sub(r"[\[\]()']", "", value).replace(", ", "x" if name == "size" else ",")
    return f"--{word} {values}"


class UmbraError(Exception):
    """
    The work failed; the command line ends with exit status 1.

    Parameters
    ----------
    message : str
        One line: what, how many, which first, and the remedy. Names in it come from files:
        control and bidirectional characters are written out, and of more than 500
        characters the middle is left out.
    **data
        The facts behind the message, kept as attributes for programs. ``option`` is the
        option that is wrong, by default the first that the message names.
    """

    def __init__(self, message: str, **data: object) -> None:
        super().__init__(shorten(make_printable(message)))
        named = (found[1] for found in _OPTION.finditer(message) if found[1] in OPTIONS)
        self.data = {"option": next(named, None)} | data

    def __getattr__(self, name: str) -> object:
        """Return the facts as attributes: ``error.indices``, ``error.path``."""
        data = self.__dict__.get("data", {})
        if name in data:
            return data[name]
        raise AttributeError(name)

    def for_shell(self) -> str:
        """Return the message with options as they are typed in a shell."""
        return write_for_shell(str(self))


class InputError(UmbraError, ValueError):
    """The input or the call is wrong; the command line ends with exit status 2."""
