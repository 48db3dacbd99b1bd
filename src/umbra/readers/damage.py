"""What is wrong with a damaged file, in words of the file and not of the program."""

__all__ = ["describe_damage"]


def describe_damage(error: BaseException) -> str:
    """
    Say what an error of the walk through a file's values means for the file.

    Parameters
    ----------
    error : Exception
        As Python raised it.

    Returns
    -------
    reason : str
        One line, at most 120 characters.
    """
    if isinstance(error, KeyError):
        return f"{str(error.args[0] if error.args else '')[:60]!r} is missing or of no known kind"
    if isinstance(error, IndexError):
        return "a number names what is not there, or a list is too short"
    if isinstance(error, (AttributeError, TypeError)):
        return "a value is of another kind than the format says"
    return " ".join(str(error).split())[:120] or "it breaks off"
