"""Roles of a city's parts: which cast, are canopies, receive, and which a proposal replaces."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Season
from umbra.errors import InputError
from umbra.scene.mesh import ADDED_GROUND
from umbra.study.options import StudyOptions
from umbra.tiles.catalogue import Catalogue, CityFile
from umbra.tiles.replaced import find_matching, find_replaced_parts

__all__ = ["Roles"]


class Roles:
    """
    Roles of the parts of each file, by the patterns of a study's options.

    Parameters
    ----------
    catalogue : Catalogue
    options : StudyOptions
    merged : sequence of (int, int)
        Objects left out: number of the file, and of the object.
    """

    def __init__(
        self, catalogue: Catalogue, options: StudyOptions, merged: Sequence[tuple[int, int]] = ()
    ) -> None:
        self._catalogue, self._options = catalogue, options
        self._casts: dict[int, NDArray[np.bool_]] = {}
        self._former: dict[int, NDArray[np.bool_]] = {}
        self._replaced: dict[int, NDArray[np.bool_]] = {}
        self._merged: dict[int, list[int]] = {}
        for file, thing in merged:
            self._merged.setdefault(file, []).append(thing)

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
            self._casts[number] = casts & ~self.find_replaced(number)
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
        found = self._find_kept(file) & ~self.find_replaced(number)
        if not options.kind.is_raster and not options.on and set(file.kinds) <= ADDED_GROUND:
            found &= False  # a ground that was added is sampled where it is asked for
        if options.on:
            found &= find_matching(file, options.on)
        return found & ~self.find_canopies(number) if options.canopy else found

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
            msg = "no part is left to cast a shadow; take a no_cast= pattern away"
            raise InputError(msg, option="no_cast")

    def _find_kept(self, file: CityFile) -> NDArray[np.bool_]:
        """Return the parts that no earlier file brings."""
        kept = np.ones(file.counts["parts"], np.bool_)
        if file.number in self._merged:
            kept &= ~np.isin(file.geometry.object_of, self._merged[file.number])
        return kept
