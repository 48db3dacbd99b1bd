"""
Exceptions, which separate invalid input from failed work, and text made safe to print.

Messages write options as in Python, ``no_cast=`` or ``receivers='top'``. The command line prints
them as ``--no-cast`` and ``--receivers top``. Names in files may contain terminal control
characters, which are escaped here.
"""

import difflib
import json
import re
from collections import Counter
from collections.abc import Iterable, Sequence

__all__ = [
    "LONGEST",
    "InputError",
    "UmbraError",
    "check_type",
    "find_similar",
    "fit_names",
    "make_printable",
    "shorten",
    "show_count",
    "show_value",
    "write_for_docs",
    "write_for_shell",
]

LONGEST = 500
"""Greatest length of a message in characters; the middle of a longer one is cut."""

_MAKERS = {
    "Camera": "make_camera(scene)",
    "Light": "point_light(place)",
    "Material": "Material((red, green, blue))",
    "Image": "make_image(pixels)",
    "Mesh": "Mesh(vertices, faces)",
    "Scene": "read(FILE)",
    "Site": "Site(latitude=, longitude=)",
}
_TAIL = 180  # characters kept at a message's end, which holds the remedy
_ALIKE = 0.7  # share of letters in order from which words are similar,
_SLIP = 0.8  # and from which they are more so than words of which one begins the other
_BEGUN = 3  # letters with which another word begins that may be meant
# Control characters except tab and line feed, lone surrogates, and characters that reorder or hide
# text. Joiners stay: Persian and Hindi need them.
_COMMANDS = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff"
    "\ufff9-\ufffb\ud800-\udfff\U000e0000-\U000e007f]"
)
_BREAK = re.compile(r"[ \t\r]*\n[ \t\r\n]*")
FLAGS: dict[str, str] = {}
"""Options of commands by their names in Python, filled where records of options are defined."""

_OPTION = re.compile(
    r"(?<![\w'\"=./-])([a-z][a-z_]*)="
    r"(\([^()]*\)|\[[^\]]*\]|'[^']*'(?: or '[^']*')*|True\b|False\b|[-+]?\d+(?:\.\d+)?)?"
    r"(?![\w='\"(\[])"
)


def make_printable(text: str, *, is_json: bool = False) -> str:
    r"""
    Escape control and bidirectional characters as in Python: ``\x1b``, ``\u202e``.

    Parameters
    ----------
    text : str
    is_json : bool
        Escape them as in JSON, ``\\u001b``, which reads back unchanged.

    Returns
    -------
    text : str
        Unchanged without such characters; tabs and line feeds stay.
    """
    if is_json:
        return _COMMANDS.sub(lambda match: json.dumps(match[0])[1:-1], text)
    return _COMMANDS.sub(lambda match: match[0].encode("unicode_escape").decode(), text)


def shorten(text: str, longest: int = LONGEST) -> str:
    """Replace the middle of a long line by a note of its full length."""
    if len(text) <= longest:
        return text
    gap = f" … ({len(text):,} characters in all) … "
    return text[: longest - len(gap) - _TAIL] + gap + text[-_TAIL:]


def show_count(count: int, one: str, many: str = "") -> str:
    """Write how many there are: ``1 part``, ``2,000 parts``; ``many`` is ``one`` with an s."""
    return f"{count:,} {one if count == 1 else many or f'{one}s'}"


def show_value(value: object, longest: int = 60) -> str:
    """Write a caller's value in an error: numbers and text as in Python, all else by its type."""
    kind = type(value).__name__
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple) and shape:
        return f"{'an' if kind[:1] in 'aeiou' else 'a'} {kind} of shape {shape}"
    text = " ".join(repr(value).split())
    if "object at 0x" in text or (len(text) > longest and not isinstance(value, str)):
        return f"{'an' if kind[:1] in 'aeiou' else 'a'} {kind}"
    return text if len(text) <= longest else f"{text[:longest]}…"


def fit_names(names: Sequence[str], width: int) -> list[str]:
    """
    Shorten names to a column of ``width`` characters, without making two names equal.

    The middle of long names is cut, as programs number objects at the end. Names that would become
    equal stay whole.
    """
    tail = width // 2
    cut = {
        name: name if len(name) <= width else f"{name[: width - tail - 1]}…{name[-tail:]}"
        for name in names
    }
    uses = Counter(cut.values())
    return [cut[name] if uses[cut[name]] == 1 else name for name in names]


def find_similar(word: str, known: Iterable[str], count: int = 1) -> list[str]:
    """
    Return the known words that may be meant, the most similar first; none if none is similar.

    Case and the dashes ahead of options do not count. Similar are words of which one begins the
    other (``--longitude``, ``--lon``), or that share most of their letters in order.
    """

    def fold(text: str) -> str:
        return text.lstrip("-").replace("_", "-").casefold()

    folded: dict[str, str] = {}
    for known_word in known:
        folded.setdefault(fold(known_word), known_word)
    wanted = fold(word)
    slips, near = (
        difflib.get_close_matches(wanted, folded, n=count, cutoff=share)
        for share in (_SLIP, _ALIKE)
    )
    begun = [
        word
        for word in folded
        if min(len(word), len(wanted)) >= _BEGUN
        and (word.startswith(wanted) or wanted.startswith(word))
    ]
    begun.sort(key=lambda word: abs(len(word) - len(wanted)))
    return [folded[word] for word in dict.fromkeys((*slips, *begun, *near))][:count]


def write_for_shell(text: str) -> str:
    """
    Write the options in a message as in a shell.

    Parameters
    ----------
    text : str
        Message with options as in Python: ``no_cast=``, ``receivers='top'``, ``size=(512, 384)``.

    Returns
    -------
    text : str
        ``--no-cast``, ``--receivers top``, ``--size 512x384``.
    """
    return _OPTION.sub(_spell, text)


def write_for_docs(text: str) -> str:
    """Write the options in a text as docstrings do: `` ``no_cast`` ``."""
    return _OPTION.sub(lambda match: f"``{match[0].removesuffix('=')}``", text)


def _spell(match: re.Match[str]) -> str:
    name, value = match.groups()
    if name not in FLAGS:
        return match[0]
    flag = FLAGS.get(match[0], FLAGS[name])
    if value in {None, "True", "False"}:
        return flag
    values = re.sub(r"[\[\]()']", "", value).replace(", ", "x" if name == "size" else ",")
    return f"{flag} {values}"


class UmbraError(Exception):
    """
    Failed work; the command line exits with status 1.

    Parameters
    ----------
    message : str
        What, how many, which first, and the remedy. Names in it come from files: line breaks become
        spaces, so that it is one line, control and bidirectional characters are escaped, and the
        middle of more than 500 characters is cut.
    **data
        Data of the error, as attributes for programs. ``option`` is the invalid option, or None.
    """

    def __init__(self, message: str, **data: object) -> None:
        super().__init__(shorten(make_printable(_BREAK.sub(" ", message))))
        self.data = {"option": None} | data

    def __getattr__(self, name: str) -> object:
        """Return the data as attributes: ``error.indices``, ``error.path``."""
        data = self.__dict__.get("data", {})
        if name in data:
            return data[name]
        raise AttributeError(name)

    def for_shell(self) -> str:
        """Return the message with options as in a shell."""
        return write_for_shell(str(self))


class InputError(UmbraError, ValueError):
    """Invalid input or call; the command line exits with status 2."""


def check_type(name: str, value: object, kind: type) -> None:
    """Raise an InputError if an argument is of another type; it names a call that returns one."""
    if not isinstance(value, kind):
        msg = (
            f"{name} is a {type(value).__name__}, not a {kind.__name__}; "
            f"give umbra.{_MAKERS[kind.__name__]}"
        )
        raise InputError(msg)
