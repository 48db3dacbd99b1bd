"""Numbers that stay with their units at the end of a line."""

import re

__all__ = ["keep_units"]

_GAP = re.compile(r"(?<=\d) (?=(?:h|min|s|m|m²|m³|km|km²|ha|%|°|kWh|kWh/m²)(?![\w²³/]))")


def keep_units(text: str) -> str:
    """Return a text for reading with no-break spaces between numbers and their units."""
    return _GAP.sub("\N{NO-BREAK SPACE}", text)
