"""
What umbra and packages installed beside it offer by name: readers, receivers, measures, devices.

Both are entry points, ``name = "module:object"``: umbra's own are listed where they are defined,
those of other packages in their ``pyproject.toml``::

    [project.entry-points."umbra.outputs"]
    drawing = "my_package:Drawing"

An object is loaded when its name is asked for, and never before: a package that is broken, too old
or named twice costs nothing but a line where it is used.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from umbra.errors import InputError, find_similar, show_value
from umbra.packages import NAME

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["Offer", "Registry", "add_note", "list_added", "take_notes"]

T = TypeVar("T")
_notes: list[str] = []


def add_note(text: str) -> None:
    """Keep a line that is to be told of a package."""
    if text not in _notes:
        _notes.append(text)


def take_notes() -> list[str]:
    """Return what is to be told of packages since the last call, one line each."""
    notes = list(_notes)
    _notes.clear()
    return notes


def name_group(what: str) -> str:
    """Return the group of entry points of a kind of thing."""
    return f"umbra.{what.removesuffix('s')}s"


def list_added(what: str) -> list[str]:
    """List the names that other packages offer of a kind of thing, without loading any."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - 20 ms that few need

    return sorted({entry_point.name for entry_point in entry_points(group=name_group(what))})


@dataclass(frozen=True)
class Offer:
    """
    What a package offers by one entry point.

    Parameters
    ----------
    what, name : str
        Such as ``"measure"`` and its name.
    package, version : str
        Of the distribution.
    reason : str
        Why it cannot be used; empty if it can.
    """

    what: str
    name: str
    package: str
    version: str
    reason: str = ""


class Registry(Generic[T]):
    """
    Objects of one group of entry points, loaded when they are asked for.

    Parameters
    ----------
    what, option : str
        What one of them is called, and the option that names it.
    own : mapping of str to str
        umbra's own: ``module:object`` by name.
    base : type
        Of all of them; an entry point names an object, or a class to be made one.
    advice : str
        The base class in ``umbra.extending`` that packages take.
    needs : sequence of str
        Attributes that each has.
    spell : callable
        Returns the name that is asked for, of an entry point's: endings may have their dot.
    """

    def __init__(
        self, what: str, option: str, own: Mapping[str, str], base: type[Any], advice: str,
        needs: Sequence[str] = ("name",), spell: Callable[[str], str] = str,
    ) -> None:  # fmt: skip
        self.what, self.option, self._own = what, option, own
        self._base, self._advice, self._needs, self._spell = base, advice, needs, spell
        self.group = name_group(what)
        self._loaded: dict[str, T] = {}

    @property
    def own(self) -> tuple[str, ...]:
        """Names of umbra's own."""
        return tuple(self._own)

    @cached_property
    def added(self) -> "dict[str, tuple[EntryPoint, ...]]":
        """Entry points of other packages by name, each ordered by the name of its package."""
        from importlib.metadata import entry_points  # noqa: PLC0415 - 20 ms that few need

        by_name: dict[str, list[EntryPoint]] = {}
        for entry_point in entry_points(group=self.group):
            by_name.setdefault(self._spell(entry_point.name), []).append(entry_point)
        return {
            name: tuple(sorted(several, key=_name_package)) for name, several in by_name.items()
        }

    @property
    def names(self) -> tuple[str, ...]:
        """All names: umbra's own, then those of other packages."""
        return (*self._own, *sorted(self.added.keys() - self._own.keys()))

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self.added

    def find(self, name: str) -> T:
        """
        Return what has a name.

        Raises
        ------
        InputError
            If nothing has it, or the package that offers it cannot be used.
        """
        if name not in self._loaded:
            self._loaded[name] = self._load(name)
        return self._loaded[name]

    def name_package(self, name: str) -> str:
        """Return the name of the package that offers what has a name; nothing of umbra's own."""
        return "" if name in self._own else _name_package(self.added[name][0])

    def list_offers(self, taken: Collection[str] = ()) -> list[Offer]:
        """
        List what packages offer, in use or not; each is loaded, to say whether it can be.

        ``taken`` are umbra's own names that are not of this registry.
        """
        return [
            Offer(
                self.what, name, _name_package(point), point.dist.version if point.dist else "",
                self._find_fault(name, point, points[0], taken),
            )
            for name, points in sorted(self.added.items()) for point in points
        ]  # fmt: skip

    def _find_fault(
        self, name: str, point: "EntryPoint", first: "EntryPoint", taken: Collection[str]
    ) -> str:
        """Return why an entry point is not what its name finds; nothing if it is."""
        if name in self._own or name in taken:
            return "umbra's own has this name"
        if point is not first:
            return f"'{_name_package(first)}' offers one of this name, which is used"
        try:
            self.find(name)
        except InputError as error:
            return str(error.data.get("reason", error))
        return ""

    def _load(self, name: str) -> T:
        if not isinstance(name, str) or name not in self:
            near = find_similar(name, self.names) if isinstance(name, str) else ()
            advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(self.names)}"
            msg = f"there is no {self.what} {show_value(name)}; {advice}"
            raise InputError(msg, option=self.option)
        several = self.added.get(name, ()) if name not in self._own or self._is_added() else ()
        spare = several if name in self._own else several[1:]
        if spare:
            packages = ", ".join(f"'{_name_package(entry_point)}'" for entry_point in spare)
            used = "umbra's own" if name in self._own else f"that of '{_name_package(several[0])}'"
            add_note(
                f"{self.what} '{name}' of {packages} is not used, as {used} has the same name; "
                "uninstall one of them to choose"
            )
        if name in self._own:
            return self._accept(resolve_name(self._own[name]))
        return self._open(several[0])

    def _accept(self, given: Any) -> T:
        """Return the object that an entry point names."""
        offered = given() if isinstance(given, type) else given
        if not isinstance(offered, self._base):
            msg = f"it is not derived from umbra.extending.{self._advice}"
            raise TypeError(msg)
        lacking = [name for name in self._needs if not hasattr(offered, name)]
        if lacking:
            msg = f"it has no {', '.join(lacking)}"
            raise TypeError(msg)
        for name in self._needs:
            if not isinstance(value := getattr(offered, name), str):
                msg = f"its {name} is {show_value(value)}, not a str"
                raise TypeError(msg)
        return offered

    def _is_added(self) -> bool:
        """Return whether other packages were looked for already; umbra's own need no search."""
        return "added" in vars(self)

    def _open(self, point: "EntryPoint") -> T:
        """Load what another package offers."""
        package = _name_package(point)
        lead = f"{self.what} '{point.name}' of the package '{package}' cannot be used"
        needed = _find_needed(point)
        if needed:
            msg = f"{lead}: it needs {needed}; install that version, or another of '{package}'"
            raise InputError(msg, option=self.option, package=package, reason=f"needs {needed}")
        try:
            return self._accept(point.load())
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
            msg = f"{lead} ({reason}); update '{package}', or uninstall it"
            raise InputError(msg, option=self.option, package=package, reason=reason) from error


def _name_package(point: "EntryPoint") -> str:
    """Return the name of the package that offers an entry point."""
    return point.dist.name if point.dist is not None else ""


def _find_needed(point: "EntryPoint") -> str:
    """Return the version of umbra that a package needs, where this one is not it."""
    from packaging.requirements import Requirement  # noqa: PLC0415
    from packaging.utils import canonicalize_name  # noqa: PLC0415

    from umbra.version import __version__  # noqa: PLC0415

    for text in (point.dist.requires or ()) if point.dist is not None else ():
        wanted = Requirement(text)
        if canonicalize_name(wanted.name) != NAME or (
            wanted.marker and not wanted.marker.evaluate()
        ):
            continue
        if not wanted.specifier.contains(__version__, prereleases=True):
            return f"umbra {wanted.specifier} (this is {__version__})"
    return ""
