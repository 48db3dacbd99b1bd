"""What a study asks of a kind of receivers, whatever it is."""

from typing import ClassVar

__all__ = ["ReceiverKind"]


class ReceiverKind:
    """
    A kind of receivers: what its results are called, and how they are told, drawn and written.

    One object of each stands in ``umbra.receivers.KINDS``; nobody else compares names.

    Attributes
    ----------
    name : str
        As results say it.
    is_plan : bool
        Whether cells lie in x and y, seen from the zenith.
    is_raster : bool
        Whether receivers are the cells or pixels of a raster; else they are single samples.
    has_scale : bool
        Whether a length in the picture is one length in the model.
    """

    name: ClassVar[str]
    is_plan: ClassVar[bool] = False
    is_raster: ClassVar[bool] = True
    has_scale: ClassVar[bool] = True

    def is_asked(self, receivers: str) -> bool:
        """Tell whether a study's option names this kind."""
        return receivers == self.name
