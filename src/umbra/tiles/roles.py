"""
Roles of a city's parts: which cast, are canopies, receive, and which a proposal replaces.

Groups of a city's casters, whose hours are told apart: by name, kind or layer, and a proposal.

The groups are those of the whole city; a tile looks for its own casters among them.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy, Season
from umbra.errors import InputError
from umbra.ground.level import TERRAIN
from umbra.receivers.plan_frame import join_boxes
from umbra.scene.mesh import ADDED_GROUND
from umbra.study.accumulators.attribution import AttributionOptions
from umbra.study.accumulators.before_and_after import Proposal
from umbra.study.accumulators.groups import Groups, check_count
from umbra.study.options import StudyOptions
from umbra.tiles.city_catalogue import Catalogue, CityFile
from umbra.tiles.matched_parts import find_matching, find_replaced_parts

if TYPE_CHECKING:
    from umbra.tiles.neighbourhood import PartScene, Selection

__all__ = ["CityGroups", "Roles"]


class Roles:
    """
    Roles of the parts of each file, by the patterns of a study's options.

    Parameters
    ----------
    catalogue : Catalogue
    options : StudyOptions
    merged : sequence of (int, int)
        Objects left out: number of the file, and of the object.
    is_before : bool
        Whether what casts is what did before the proposal.
    """

    def __init__(
        self, catalogue: Catalogue, options: StudyOptions, merged: Sequence[tuple[int, int]] = (),
        *, is_before: bool = False,
    ) -> None:  # fmt: skip
        self._catalogue, self._options, self._is_before = catalogue, options, is_before
        self._casts: dict[int, NDArray[np.bool_]] = {}
        self._former: dict[int, NDArray[np.bool_]] = {}
        self._replaced: dict[int, NDArray[np.bool_]] = {}
        self._merged: dict[int, list[int]] = {}
        for file, index in merged:
            self._merged.setdefault(file, []).append(index)

    @cached_property
    def season(self) -> Season | None:
        """Light that canopies transmit; None without canopies."""
        options = self._options
        if not options.canopy:
            return None
        return Season.of(options.transmissivity, options.leaf_on)

    def find_casting(self, number: int) -> NDArray[np.bool_]:
        """Return which parts of a file cast, canopies too, (n_parts,) bool."""
        if number not in self._casts:
            options, file = self._options, self._catalogue.files[number]
            casts = np.ones(file.counts["parts"], np.bool_)
            if options.cast or options.no_cast:
                chosen, dropped = (
                    find_matching(file, options.cast),
                    find_matching(file, options.no_cast),
                )
                casts = (chosen if options.cast else casts) & ~dropped
            casts &= self._find_kept(file)
            gone = find_matching(file, options.proposed) if self._is_before else (
                self.find_replaced(number)
            )  # fmt: skip
            self._casts[number] = casts & ~gone
            self._former[number] = casts & self.find_replaced(number)
        return self._casts[number]

    def find_former(self, number: int) -> NDArray[np.bool_]:
        """Return which parts of a file cast before the proposal that replaces them, (n_parts,)."""
        self.find_casting(number)
        return self._former[number]

    def find_replaced(self, number: int) -> NDArray[np.bool_]:
        """Return which parts of a file the proposal replaces, (n_parts,) bool."""
        if number not in self._replaced:
            file = self._catalogue.files[number]
            self._replaced[number] = find_replaced_parts(file, self._options)
        return self._replaced[number]

    def find_canopies(self, number: int) -> NDArray[np.bool_]:
        """Return which parts of a file are canopies, (n_parts,) bool."""
        return find_matching(self._catalogue.files[number], self._options.canopy)

    def find_receiving(self, number: int) -> NDArray[np.bool_]:
        """Return which parts of a file are seen or sampled, (n_parts,) bool."""
        file, options = self._catalogue.files[number], self._options
        receives = self._find_kept(file) & ~self.find_replaced(number)
        is_sampled = options.kind.belongs_to_parts and not options.kind.is_raster
        if is_sampled and not options.on and set(file.kinds) <= ADDED_GROUND:
            receives &= False  # a ground that was added is sampled where it is asked for
        if options.on:
            receives &= find_matching(file, options.on)
        return receives & ~self.find_canopies(number) if options.canopy else receives

    def find_built_bounds(self) -> NDArray[np.float64] | None:
        """
        Return the bounds of all that receives and is no ground, (2, 3) in own coordinates [m].

        As of one model; None if there is nothing.
        """
        boxes = []
        for file in self._catalogue.files:
            kinds, geometry = file.kinds_of_parts, file.geometry
            stands = np.array([kind not in TERRAIN for kind in kinds]) & self.find_receiving(
                file.number
            )
            is_used = np.zeros(len(geometry.vertices), np.bool_)
            is_used[geometry.faces[stands[geometry.part]]] = True
            corners = geometry.vertices[is_used]
            if len(corners):
                boxes.append(np.stack([corners.min(0), corners.max(0)]) + file.origin)
        return join_boxes(boxes)

    def check(self) -> None:
        """
        Refuse patterns that match no part of any file, and a study without casters.

        Raises
        ------
        InputError
        """
        options, files = self._options, self._catalogue.files
        for name in ("cast", "no_cast", "canopy", "on", "who", "proposed", "replace"):
            for pattern in getattr(options, name):
                if not any(find_matching(file, [pattern]).any() for file in files):
                    kinds = sorted({kind for file in files for kind in file.kinds if kind})
                    msg = (
                        f"{name}='{pattern}' matches no part of {len(files)} files; "
                        f"their kinds are {', '.join(kinds[:12]) or 'not named'} "
                        "(umbra inspect lists the parts of a file)"
                    )
                    raise InputError(msg, option=name, pattern=pattern)
        if (options.cast or options.no_cast or options.replace) and not any(
            self.find_casting(file.number).any() for file in files
        ):
            msg = "no part is left to cast a shadow; remove a no_cast= pattern"
            raise InputError(msg, option="no_cast")

    def _find_kept(self, file: CityFile) -> NDArray[np.bool_]:
        """Return the parts that no earlier file brings."""
        is_kept = np.ones(file.counts["parts"], np.bool_)
        if file.number in self._merged:
            is_kept &= ~np.isin(file.geometry.object_of, self._merged[file.number])
        return is_kept


class CityGroups:
    """
    Groups of the parts of all files.

    Parameters
    ----------
    catalogue : Catalogue
    roles : Roles
    options : StudyOptions
        With ``who``, ``by`` or ``proposed``.

    Attributes
    ----------
    names : tuple of str
        The last is the whole proposal, if any.

    Raises
    ------
    InputError
        If a pattern matches no casting part, or there are too many groups.
    """

    def __init__(self, catalogue: Catalogue, roles: Roles, options: StudyOptions) -> None:
        self._catalogue, self._roles, self._options = catalogue, roles, options
        for name in ("who", "proposed"):
            for pattern in getattr(options, name):
                self._check(name, pattern)
        files = catalogue.files
        if options.by is not None:
            known, columns = self._number_words()
        else:
            known = {pattern: k for k, pattern in enumerate(dict.fromkeys(options.who))}
            columns = [
                np.stack([_mark(file, [pattern], k) for pattern, k in known.items()], axis=1)
                if known
                else np.zeros((file.counts["parts"], 0), np.int32)
                for file in files
            ]
        check_count(len(known), options.by)
        self.names, self._shown = tuple(known), len(known)
        if options.proposed:
            new = len(known)
            self.names = (*self.names, "proposed")
            columns = [
                np.column_stack([rows, _mark(file, options.proposed, new)])
                for file, rows in zip(files, columns, strict=True)
            ]
        # Groups of each part of each file, (n_parts, k); -1 for none.
        self._columns = columns

    def _check(self, option: str, pattern: str) -> None:
        files = self._catalogue.files
        if not any(
            (find_matching(file, [pattern]) & self._roles.find_casting(file.number)).any()
            for file in files
        ):
            msg = (
                f"{option}='{pattern}' matches only parts that do not cast; "
                "remove a no_cast= pattern"
            )
            raise InputError(msg, option=option, pattern=pattern)

    def _number_words(self) -> tuple[dict[str, int], list[NDArray[np.int32]]]:
        """Return the names, kinds or layers of casting parts as they come, and those of parts."""
        options, known, columns = self._options, dict[str, int](), []
        find = self._make_find()
        for file in self._catalogue.files:
            chosen = self._roles.find_casting(file.number)
            if options.who:
                chosen = chosen & find_matching(file, options.who)
            words = find(file)
            rows = np.full((len(chosen), 1), -1, np.int32)
            for part in np.flatnonzero(chosen).tolist():
                word = words[part] or f"no {options.by}"
                rows[part] = known.setdefault(word, len(known))
            columns.append(rows)
        return known, columns

    def _make_find(self) -> Callable[[CityFile], list[str]]:
        """Return what names the group of each part of a file."""
        if self._options.by == "layer":
            return lambda file: [file.layer] * file.counts["parts"]
        if self._options.by == "kind":
            return lambda file: file.kinds_of_parts
        return self._catalogue.label_parts

    @property
    def placeholder(self) -> AttributionOptions:
        """Options with as many groups and pieces as the city has, for the memory of a receiver."""
        rows = set()
        for file, columns in zip(self._catalogue.files, self._columns, strict=True):
            casts = self._roles.find_casting(file.number)
            weak = self._roles.find_canopies(file.number)
            rows |= {tuple(row) for row in np.column_stack([columns, weak])[casts].tolist()}
        return self._describe(Groups(self.names, ((),) * len(rows), *self._join_nothing()), ())

    def _describe(self, groups: Groups, proposed: tuple[int, ...]) -> AttributionOptions:
        options = self._options
        new = proposed if options.proposed else None
        return AttributionOptions(groups, self._shown, new, AttributionOptions.read_limit(options))

    def _join_nothing(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        return np.zeros((len(self.names), 0), np.bool_), np.zeros(0, np.bool_)

    def are_among(self, units: "Selection") -> bool:
        """Return whether any of some units belongs to a group."""
        for number, chosen in units.units:
            geometry = self._catalogue.files[number].geometry
            is_due = (self._columns[number] >= 0).any(1) | self._roles.find_former(number)
            grouped = geometry.object_of[is_due]
            if np.isin(geometry.objects[chosen], grouped).any():
                return True
        return False

    @property
    def proposal(self) -> Proposal:
        """The proposal in tiles' scenes."""
        roles = self._roles

        def spread(tile: Any, find: Callable[[int], NDArray[np.bool_]]) -> list[int]:
            return np.flatnonzero(tile.casting.scene.spread(find)).tolist()

        def is_before(number: int) -> NDArray[np.bool_]:
            rest = roles.find_casting(number) & ~self._is_proposed(number)
            return rest | roles.find_former(number)

        return Proposal(
            lambda tile: spread(tile, self._is_proposed),
            lambda tile: spread(tile, is_before),
            lambda tile: spread(tile, roles.find_replaced),
        )

    def _is_proposed(self, number: int) -> NDArray[np.bool_]:
        """Return which parts of a file are of the proposal, (n_parts,) bool."""
        return find_matching(self._catalogue.files[number], self._options.proposed)

    def find(
        self, scene: "PartScene", canopy: Canopy | None, *, is_due: bool
    ) -> AttributionOptions:
        """
        Return the options of attribution for some of the city's parts.

        Parameters
        ----------
        scene : PartScene
        canopy : Canopy, optional
        is_due : bool
            Whether any of them belongs to a group.
        """
        if not is_due:
            return self._describe(Groups(self.names, (), *self._join_nothing()), ())
        member = np.zeros((len(scene.number), len(self.names) + 1), np.bool_)
        for file in np.unique(scene.number[:, 0]).tolist():
            own = np.flatnonzero(scene.number[:, 0] == file)
            part = scene.number[own, 1]
            for column in self._columns[file][part].T:
                member[own, column] = True  # the last column, of -1, is cut off
        member, casts = member[:, :-1], scene.spread(self._roles.find_casting)
        weak = () if canopy is None else sorted(canopy.weak)
        groups = Groups.of(self.names, member, np.flatnonzero(casts).tolist(), weak)
        attribution = self._describe(groups, tuple(np.flatnonzero(member[:, -1]).tolist()))
        if not self._options.proposed:
            return attribution
        former = np.flatnonzero(scene.spread(self._roles.find_former)).tolist()
        rest = np.flatnonzero(casts & ~scene.spread(self._is_proposed)).tolist()
        before = AttributionOptions.group_before(rest, former, len(casts), weak)
        return replace(attribution, before=before)


def _mark(file: CityFile, patterns: Sequence[str], number: int) -> NDArray[np.int32]:
    """Return a number for each part of a file that a pattern matches, else -1."""
    return np.where(find_matching(file, patterns), number, -1).astype(np.int32)
