"""What umbra raises, so that a caller can tell bad input from failed work."""

from umbra.printable import make_printable, shorten

__all__ = ["InputError", "UmbraError"]


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
        The facts behind the message, kept as attributes for programs.
    """

    def __init__(self, message: str, **data: object) -> None:
        super().__init__(shorten(make_printable(message)))
        self.data = data

    def __getattr__(self, name: str) -> object:
        """Give the facts as attributes: ``error.indices``, ``error.path``."""
        data = self.__dict__.get("data", {})
        if name in data:
            return data[name]
        raise AttributeError(name)


class InputError(UmbraError, ValueError):
    """The input or the call is wrong; the command line ends with exit status 2."""
