"""What ifcopenshell logs and raises, in one line each."""

import re

__all__ = ["list_errors", "one_line"]

ERROR = re.compile(r"^\[error\](?: *\[[^\]]*\])* *(.*)$", re.IGNORECASE | re.MULTILINE)


def list_errors(log: str) -> list[str]:
    """Give the errors in ifcopenshell's log, without their time."""
    return [" ".join(found.split())[:200] for found in ERROR.findall(log)]


def one_line(error: BaseException) -> str:
    """Give an error's kind and words in a line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]
