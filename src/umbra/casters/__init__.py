"""
Casters: parts of a scene that cast shadows (``casting.py``), and canopies that transmit light.

Canopies weaken the sun instead of blocking it. Receivers behind canopies alone get a share of
the light, once, however many crowns the ray to the sun passes, as in SOLWEIG (Lindberg, Grimmond
2011). Measured of single trees in streets, the share of direct sun is 0.01 to 0.05 with leaves and
0.40 to 0.52 without (Konarska, Lindberg, Larsson, Thorsson, Holmer 2014, Theor. Appl. Climatol.
117, 363-376).
"""

import datetime as dt
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count
from umbra.scene import Scene

__all__ = ["WITH_LEAVES", "Canopy", "Season", "check_transmissivity", "describe_opaque"]

WITH_LEAVES = 0.03
"""Share of the light through leaves by default."""
_DAY = re.compile(r"([0-9]{1,2})-([0-9]{1,2})")
_LEAP = 2024  # a leap year has every day


@dataclass(frozen=True)
class Season:
    """Light that canopies transmit, with leaves and without."""

    with_leaves: float  # share of the light, 0 to 1
    without: float
    first: tuple[int, int] | None = None  # month and day on which the leaves come; None: always
    # the last with leaves; the season may run over the new year
    last: tuple[int, int] | None = None

    @classmethod
    def of(
        cls, transmissivity: str | float | Sequence[float] | None, leaf_on: str | None
    ) -> "Season":
        """
        Read the options, see ``umbra.shadow_study``.

        Raises InputError if one is malformed, or if two shares have no dates, or one has dates.
        """
        shares = _read_shares(WITH_LEAVES if transmissivity is None else transmissivity)
        if leaf_on is None:
            if len(shares) == 1:
                return cls(shares[0], shares[0])
            msg = (
                f"a transmissivity with leaves ({shares[0]:g}) and without ({shares[1]:g}) needs "
                "their dates; give leaf_on=, such as leaf_on='04-15..10-31'"
            )
            raise InputError(msg, option="leaf_on", transmissivity=transmissivity)
        first, last = _read_dates(leaf_on)
        if len(shares) == 1:
            msg = (
                f"leaf_on= needs a transmissivity without leaves, too; give both, such as "
                f"transmissivity='{shares[0]:g}:0.5'"
            )
            raise InputError(msg, option="leaf_on", leaf_on=leaf_on)
        return cls(shares[0], shares[1], first, last)

    def find_share(self, day: dt.date) -> float:
        """Return the share of light transmitted on a local date."""
        if self.first is None or self.last is None:
            return self.with_leaves
        at = day.month, day.day
        inside = (self.first <= at, at <= self.last)
        has_leaves = all(inside) if self.first <= self.last else any(inside)
        return self.with_leaves if has_leaves else self.without

    @property
    def facts(self) -> dict[str, object]:
        """Attributes of the result."""
        if self.first is None or self.last is None:
            return {"canopy_transmissivity": self.with_leaves}
        return {
            "canopy_transmissivity": [self.with_leaves, self.without],
            "leaf_on": "{:02}-{:02}..{:02}-{:02}".format(*self.first, *self.last),
        }


@dataclass(frozen=True, eq=False)
class Canopy:
    """Casters that transmit a share of the light and do not receive."""

    parts: tuple[int, ...]  # indices of all canopies that stand, casting or not
    casting: tuple[int, ...]  # indices of canopies that cast
    solid: tuple[int, ...]  # indices of opaque casters
    season: Season
    replaced: tuple[int, ...] = ()  # indices, of ``scene.whole``, of those that a proposal replaces

    @classmethod
    def of(
        cls,
        scene: Scene,
        casters: Sequence[int],
        patterns: Sequence[str],
        transmissivity: str | float | Sequence[float] | None,
        leaf_on: str | None,
    ) -> "Canopy | None":
        """
        Read the options, see ``umbra.shadow_study``; None where there is no canopy.

        Raises InputError if a pattern matches no casting part, no receiver is left, or the
        shares are wrong.
        """
        check_transmissivity(patterns, transmissivity, leaf_on)
        if not patterns:
            return None
        season, whole, count = Season.of(transmissivity, leaf_on), scene.whole, len(scene.parts)
        known = {*casters, *range(count, len(whole.parts))}
        for pattern in patterns:
            if not known.intersection(whole.select([pattern], option="canopy")):
                msg = (
                    f"canopy='{pattern}' matches only parts that do not cast; "
                    "remove a no_cast= pattern"
                )
                raise InputError(msg, option="canopy", pattern=pattern)
        chosen = set(whole.select(patterns))
        return cls(
            tuple(sorted(part for part in chosen if part < count)),
            tuple(part for part in casters if part in chosen),
            tuple(part for part in casters if part not in chosen),
            season,
            tuple(sorted(part for part in chosen if part >= count)),
        )

    @property
    def weak(self) -> frozenset[int]:
        """Indices, of ``scene.whole``, of the canopies that cast or did before a proposal."""
        return frozenset((*self.casting, *self.replaced))

    def find_receivers(self, scene: Scene, on: Sequence[str] = ()) -> list[int]:
        """Return the parts, of all or of some patterns, that are no canopies."""
        left = sorted(set(scene.select(on, option="on")) - set(self.parts))
        if not left:
            msg = (
                "nothing is left to receive but canopies, which are no receivers; choose "
                "others with on=, or receivers='ground'"
            )
            raise InputError(msg, option="on")
        return left

    def find_shares(self, days: Sequence[dt.date]) -> NDArray[np.float64]:
        """Return the share of light transmitted on each day, (n_days,)."""
        return np.array([self.season.find_share(day) for day in days])

    @property
    def facts(self) -> dict[str, object]:
        """Attributes of the result."""
        return {
            **self.season.facts,
            "canopy_rule": "behind canopies alone an hour counts canopy_transmissivity hours of "
            "sun, however many of them; the rest of it is shadow",
        }


def describe_opaque(
    scene: Scene, casters: Sequence[int], canopy: Canopy | None = None
) -> str | None:
    """
    Name transparent casters that a study takes as opaque; None if there are none.

    By their materials alone: textures are not decoded for it.
    """
    solid = casters if canopy is None else canopy.solid
    parts = [scene.whole.parts[index] for index in solid]
    names = [
        part.name
        for part in parts
        if part.material.opacity < 1
        or (
            part.material.alpha_mode != "opaque"
            and (part.material.image is not None or part.mesh.alpha is not None)
        )
    ]
    if not names:
        return None
    what = show_count(len(names), "part is", "parts are")
    return (
        f"{what} transparent or may have holes in the texture (first: '{names[0]}'), and cast "
        "shadows as opaque ones do; canopy= lets a share of the light through"
    )


def check_transmissivity(
    patterns: Sequence[str],
    transmissivity: str | float | Sequence[float] | None,
    leaf_on: str | None,
) -> None:
    """Refuse shares that are badly written, or given without a canopy."""
    if patterns:
        Season.of(transmissivity, leaf_on)
    elif transmissivity is not None or leaf_on is not None:
        what = "transmissivity=" if transmissivity is not None else "leaf_on="
        msg = f"{what} is for canopies; say which parts they are with canopy="
        raise InputError(msg, option="canopy")


def _read_shares(given: str | float | Sequence[float]) -> list[float]:
    words: list[str] | list[float]
    if isinstance(given, str):
        words = given.split(":")
    else:
        words = [given] if isinstance(given, (int, float)) else list(given)
    if not 1 <= len(words) <= 2:
        msg = (
            f"a transmissivity is one share, or two as ON:OFF, with leaves and without; got {given}"
        )
        raise InputError(msg, transmissivity=given)
    return [_read_share(word) for word in words]


def _read_share(word: str | float) -> float:
    text = str(word).strip()
    try:
        share = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        share = math.nan
    if not 0 <= share <= 1:
        percent = math.isfinite(share) and 1 < share <= 100 and not text.endswith("%")
        advice = f"; for {share:g} % write {share / 100:g} or {share:g}%" if percent else ""
        msg = f"a transmissivity is a share from 0 to 1, such as 0.03; got '{text}'{advice}"
        raise InputError(msg, transmissivity=word)
    return share


def _read_dates(text: str) -> list[tuple[int, int]]:
    """Read two days of the year."""
    matches = [_DAY.fullmatch(word.strip()) for word in text.split("..")]
    if len(matches) != 2 or None in matches:
        msg = f"'{text}' does not say when leaves are on; write MM-DD..MM-DD, as 04-15..10-31"
        raise InputError(msg, leaf_on=text)
    days = [(int(match[1]), int(match[2])) for match in matches if match]
    for month, day in days:
        try:
            dt.date(_LEAP, month, day)
        except ValueError as error:
            msg = f"leaf_on='{text}': there is no day {month:02}-{day:02}; write MM-DD..MM-DD"
            raise InputError(msg, option="leaf_on", leaf_on=text) from error
    return days
