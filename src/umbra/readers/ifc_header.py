"""The first and last lines of a STEP file: whether it is IFC, of which schema, and whole."""

import re
from collections import Counter

from umbra.errors import InputError

__all__ = ["check_whole", "find_schema", "is_draft"]

# By which schema the file of each is read: an edition's own, and what came before it.
SCHEMAS = {
    "IFC2X3": re.compile(r"IFC2X3(_TC\d|_FINAL)?"),
    "IFC4": re.compile(r"IFC4(_ADD\d(_TC\d)?)?"),
    "IFC4X3_ADD2": re.compile(r"IFC4X3(_ADD\d|_TC\d)?"),
}
DRAFT = re.compile(r"IFC4X(1|2|3_\w+)")
LAST = "IFC4X3_ADD2"

SCHEMA = re.compile(rb"FILE_SCHEMA\s*\(\s*\(\s*'\s*([^']*?)\s*'")
ENTITY = re.compile(rb"\n#(\d+) *=")
HEAD = 1 << 16


def find_schema(data: bytes) -> tuple[str, str, slice]:
    """
    Find the schema of a STEP file, by its header.

    Parameters
    ----------
    data : bytes

    Returns
    -------
    name : str
        As the file says it.
    schema : str
        The one by which it is read.
    place : slice
        Where the name stands in ``data``.

    Raises
    ------
    InputError
        If the header names none, or one that is not IFC or not read.
    """
    found = SCHEMA.search(data[:HEAD])
    if found is None:
        check_whole(data)  # it may break off before
        msg = "is a STEP file whose header names no schema (FILE_SCHEMA); export it again as IFC"
        raise InputError(msg)
    # A registration may follow: 'AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'.
    name = found[1].decode("latin-1").partition("{")[0].strip().upper()[:80]
    place = slice(found.start(1), found.end(1))
    for schema, names in SCHEMAS.items():
        if names.fullmatch(name):
            return name, schema, place
    if DRAFT.fullmatch(name):
        return name, LAST, place
    what = "IFC" if name.startswith("IFC") else "a STEP file, but not IFC,"
    msg = (
        f"is {what} of the schema '{name}', which is not read; export it as IFC4 (IFC2X3, IFC4 "
        "and IFC4X3 are read), glTF or OBJ"
    )
    raise InputError(msg, schema=name)


def is_draft(name: str) -> bool:
    """Tell whether a schema was never published as it is."""
    return not any(names.fullmatch(name) for names in SCHEMAS.values())


def check_whole(data: bytes) -> None:
    """
    Refuse a file that ends too early, or in which two entities have one number.

    Parameters
    ----------
    data : bytes

    Raises
    ------
    InputError
    """
    if b"END-ISO-10303-21" not in data[-4096:]:
        msg = (
            f"is IFC that ends too early (no END-ISO-10303-21 in its {len(data)} bytes); "
            "export it again"
        )
        raise InputError(msg, byte=len(data))
    numbers = ENTITY.findall(data)
    if len(set(numbers)) == len(numbers):
        return
    twice = [int(number) for number, count in Counter(numbers).items() if count > 1]
    msg = (
        f"is damaged IFC (entity numbers that come more than once: {len(twice)}, "
        f"first: #{twice[0]}); export it again"
    )
    raise InputError(msg, entity=twice[0])
