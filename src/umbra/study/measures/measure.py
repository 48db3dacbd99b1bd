"""
A measure: what a receiver gets of some lights.

A measure gives lights with weights; the engine adds up, at each receiver, the weights of the lights
that reach it, and the measure turns the sums into the variables of the result. Attached shadow
counts: a light behind a receiver's surface does not reach it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from numpy.typing import NDArray

from umbra.errors import InputError, UmbraError, show_value
from umbra.machine import find_memory, name_memory

if TYPE_CHECKING:
    from umbra.lights import Lights, Period
    from umbra.sun import Site

__all__ = ["Asked", "Measure", "Quantity", "count_at_once", "guard"]

COLUMN_BYTES = 28
"""Memory of a column of weights at a receiver: its sum, and copies while it is derived; measured 27
on planes, 19 on walls [byte]."""
LEAST_TILE = 65_536
"""Fewest receivers that are counted at a time: fewer take longer than what they share."""
_SHARE = 0.25  # of the memory, for the sums of a tile


@dataclass(frozen=True)
class Quantity:
    """
    A variable that a measure gives, and how it is drawn.

    Parameters
    ----------
    name : str
        Of the variable in ``study.nc``, and of its map, ``NAME.png``.
    unit : str
        As CF has it: ``"1"``, ``"h"``, ``"%"``, ``"kWh/m2"``.
    long_name : str
        What it is, in words: of legends, captions and tables.
    most : float, optional
        Upper end of the map's scale; the largest value by default.
    ramp : str
        Colours of the map: ``"light"`` is dark at 0 and bright at the upper end, ``"loss"`` the
        reverse.
    is_drawn : bool
        Whether it has a map of its own.
    per : str
        Dimension ahead of the receivers', such as ``"caster"``; none by default.
    """

    name: str
    unit: str
    long_name: str
    most: float | None = None
    ramp: Literal["light", "loss"] = "light"
    is_drawn: bool = True
    per: str = ""

    @property
    def suffix(self) -> str:
        """The unit after a number; none of a bare number."""
        shown = {"1": "", "%": " %", "kWh/m2": " kWh/m²"}
        return shown.get(self.unit, f" {self.unit}")

    def show(self, value: float) -> str:
        """Write a value with its unit, to three digits or whole."""
        return f"{value:,.0f}{self.suffix}" if abs(value) >= 1000 else f"{value:.3g}{self.suffix}"

    def of_loss(self, to: str = "the proposal") -> "Quantity":
        """Return the same quantity, lost to a proposal."""
        what = f"{self.long_name} lost to {to}"
        return replace(self, name=f"{self.name}_lost", long_name=what, most=None, ramp="loss")

    @property
    def attributes(self) -> dict[str, str]:
        """CF attributes of the variable."""
        return {"long_name": self.long_name, "units": self.unit}


@dataclass(frozen=True)
class Asked:
    """
    What a measure is asked for.

    Parameters
    ----------
    options : StudyOptions
        All options of the study, such as ``sky_directions``.
    period : Period
        The suns of the study's dates; of no days where no date is given.
    site : Site, optional
        None where neither the caller nor the model says it.
    """

    options: Any
    period: "Period"
    site: "Site | None" = None

    def make_lights(self, measure: "Measure") -> "Lights":
        """Return a measure's lights, made once for each study."""
        return _make_lights(measure, self)


@lru_cache(maxsize=4)
def _make_lights(measure: "Measure", asked: Asked) -> "Lights":
    """Make a measure's lights, and check them: its code may be anyone's."""
    from umbra.lights import Lights  # noqa: PLC0415  (the help needs none)

    try:
        lights: object = measure.make_lights(asked)
        if not isinstance(lights, Lights):
            msg = f"make_lights returns {show_value(lights)}; return Lights.of(vectors, weights)"
            raise InputError(msg)  # noqa: TRY301 - named below, as all others
        lights.check()
    except InputError as error:
        if error.option:  # of the study, which names itself
            raise
        msg = f"measure '{measure.name}' cannot be counted: {error}"
        raise InputError(msg, option="measure", measure=measure.name) from error
    most = count_at_once(measure, lights)
    if most < LEAST_TILE:
        count, columns = lights.weights.shape
        needed, held = COLUMN_BYTES * LEAST_TILE * _count_sums(measure, lights), find_memory()
        msg = (
            f"measure '{measure.name}' has {columns:,} columns of weights for {count:,} lights, "
            f"each a sum at every receiver: {LEAST_TILE:,} receivers, the fewest that are counted "
            f"at a time, need {needed / 1e9:.1f} GB; {name_memory(held)}, of which sums may take "
            f"a quarter: at most {columns * most // LEAST_TILE:,} columns. Take fewer dates or "
            "longer steps with every=, or add up lights of one kind in one column"
        )
        raise InputError(msg, option="measure", measure=measure.name, columns=columns)
    return lights


def count_at_once(measure: "Measure", lights: "Lights", *, copies: int = 1) -> int:
    """
    Return how many receivers a measure's sums fit in memory for.

    ``copies`` is the number of times that they are made: before a proposal, and through canopies.
    """
    sums = _count_sums(measure, lights) * copies
    return int(_SHARE * find_memory() / (COLUMN_BYTES * max(sums, 1)))


def _count_sums(measure: "Measure", lights: "Lights") -> int:
    """Return the sums at a receiver: of each column, along each axis if it follows the normal."""
    return lights.weights.shape[1] * (3 if measure.follows_normal else 1)


class Measure(ABC):
    """
    Base of measures.

    Attributes
    ----------
    name, unit, long_name : str
        Of its variable, as of a ``Quantity``.
    most : float, optional
        Upper end of the map's scale; the largest value by default.
    needs_sun : bool
        Whether it is of the suns of dates: then a study needs a date and a site.
    needs_site : bool
        Whether it is of suns of its own, for which a study needs a site, but no date.
    takes : tuple of str
        Options that mean nothing but to measures, which refuse them without one that takes them.
    includes : tuple of str
        Names of measures whose variables it gives, too.
    follows_normal : bool
        Whether a light weighs by the cosine at the receiver's normal, as light on a surface does.
        Receivers without a normal are level.
    has_exact : bool
        Whether ``solve`` finds it exactly.
    by_caster : bool
        Whether it is the share that each group of casters takes of its lights (``by``, ``who``).
    """

    name: ClassVar[str]
    unit: ClassVar[str] = "1"
    long_name: ClassVar[str]
    most: ClassVar[float | None] = None
    needs_sun: ClassVar[bool] = False
    needs_site: ClassVar[bool] = False
    takes: ClassVar[tuple[str, ...]] = ()
    includes: ClassVar[tuple[str, ...]] = ()
    follows_normal: ClassVar[bool] = False
    has_exact: ClassVar[bool] = False
    by_caster: ClassVar[bool] = False

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The variables that it gives: by default one, of its own name."""
        return (Quantity(self.name, self.unit, self.long_name, self.most),)

    def describe(self, asked: Asked) -> dict[str, object]:
        """Return attributes of the result: what decides the numbers."""
        return {}

    def tell(self, options: Any) -> str:
        """Say in a few words how it is found, for the foot of pictures; nothing by default."""
        return ""

    def check(self, options: Any) -> None:
        """
        Check the options of a study before any model is read.

        Raises
        ------
        InputError
            If one is wrong, or lacks.
        """
        return

    @abstractmethod
    def make_lights(self, asked: Asked) -> "Lights":
        """
        Make the lights, with a column of weights (n, k) for each sum.

        Parameters
        ----------
        asked : Asked

        Returns
        -------
        lights : Lights
            Of directions above the horizon, which are counted fastest, or of any others. From
            below the horizon the ground shines: it hides none of these directions.

        Raises
        ------
        InputError
            If what they are made of is wrong.
        """

    def solve(
        self, scene: Any, parts: Sequence[int], places: Any, threads: int
    ) -> Sequence[NDArray] | None:
        """
        Find the variables exactly, where ``exact`` asks for it and there is a way.

        Parameters
        ----------
        scene : Scene
        parts : sequence of int
            The casting parts.
        places : Places
            Points (n, 3) and unit normals (n, 3) in the scene's local frame.
        threads : int

        Returns
        -------
        values : sequence of (n,) float64, or None
            One for each of ``quantities``; None if sums of lights are all there is.
        """
        return None

    def derive(self, sums: NDArray, asked: Asked) -> Sequence[NDArray]:
        """
        Turn the sums of what reaches each receiver into the variables.

        Parameters
        ----------
        sums : (k, ...) float64
            Of each column of weights: of the lights that reach the receiver; if the measure
            ``follows_normal``, each times the cosine.
        asked : Asked

        Returns
        -------
        values : sequence of (...) float
            One for each of ``quantities``, in their order; by default the sums.
        """
        return list(sums)


def guard(measure: Measure, call: Callable[..., Any], *args: Any) -> Any:
    """Call a measure's own code; name the measure where it fails."""
    try:
        return call(*args)
    except UmbraError:
        raise
    except Exception as error:
        msg = (
            f"measure '{measure.name}' failed ({type(error).__name__}: {error}); update the "
            "package that brings it, or leave it out"
        )
        raise InputError(msg, option="measure", measure=measure.name) from error
