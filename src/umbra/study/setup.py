"""A study's options made ready, and the counting that is the same for all receivers."""

import datetime as dt
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import umbra
from umbra.devices import check_device
from umbra.devices.counters import StudyCounters
from umbra.errors import InputError
from umbra.scene import Scene
from umbra.study.asked import Answer, Asked, Tile
from umbra.study.canopy import Canopy
from umbra.study.checks import (
    describe_period,
    find_wanted,
    make_advance,
    select_casters,
)
from umbra.study.counting import count_period
from umbra.study.exact import Caught, count_exactly
from umbra.study.ledger import Ledger, Wanted
from umbra.study.model import Casting
from umbra.study.period import Period, Refraction, make_period
from umbra.sun import Site

__all__ = ["Result", "Setup"]

Progress = Callable[[int, int], object]


@dataclass(frozen=True, eq=False)
class Result:
    """
    What was counted.

    Parameters
    ----------
    ledger : Ledger
    answer : Answer
    seconds : float
        Spent in counting.
    device : {'cpu', 'gl'}
        What counted.
    """

    ledger: Ledger
    answer: Answer
    seconds: float
    device: str


@dataclass(frozen=True, eq=False)
class Setup:
    """
    What every study is told, whatever receives the shadows.

    Parameters
    ----------
    scene : Scene
    site : Site
    period : Period
    wanted : Wanted
    asked : Asked
    casters : list of int
        Indices of the parts that cast.
    threads : int
    device : {'auto', 'cpu', 'gl'}
    canopy : Canopy, optional
    begun : float
        Clock when the work began [s].
    """

    scene: Scene
    site: Site
    period: Period
    wanted: Wanted
    asked: Asked
    casters: list[int]
    threads: int
    device: str = "auto"
    canopy: Canopy | None = None
    begun: float = field(default_factory=time.perf_counter)

    @classmethod
    def of(
        cls,
        scene: Scene,
        site: Site,
        *,
        date: str | dt.date | Sequence[str | dt.date],
        start: str | dt.time = "09:00",
        end: str | dt.time = "17:00",
        every: str | dt.timedelta = "15min",
        every_days: int = 1,
        by_day: bool | None = None,
        spells: bool = False,
        min_spell: str | dt.timedelta | None = None,
        exact: bool | float = False,
        who: Sequence[str] = (),
        by: str | None = None,
        proposed: Sequence[str] = (),
        under: str | float | dt.timedelta | None = None,
        cast: Sequence[str] = (),
        no_cast: Sequence[str] = (),
        canopy: Sequence[str] = (),
        transmissivity: str | float | Sequence[float] | None = None,
        leaf_on: str | None = None,
        masks: bool = False,
        refraction: Refraction = "standard",
        device: str = "auto",
        threads: int | None = None,
    ) -> "Setup":
        """Read and check the options, see ``umbra.shadow_study``."""
        threads = check_device(device, threads)
        if canopy and device == "gl":
            msg = "the gl device does not weaken light; leave device= out, or canopy="
            raise InputError(msg, device=device)
        period = make_period(
            date, start, end, every, site, every_days=every_days, refraction=refraction
        )
        wanted = find_wanted(
            period, by_day=by_day, spells=spells, min_spell=min_spell, masks=masks, exact=exact
        )
        casters = select_casters(scene, cast, no_cast)
        canopies = Canopy.of(scene, casters, canopy, transmissivity, leaf_on)
        asked = Asked.of(scene, casters, who, by, proposed, under, canopies)
        device = "cpu" if canopies else device
        return cls(scene, site, period, wanted, asked, casters, threads, device, canopies)

    @property
    def bytes_of_masks(self) -> int:
        """What masks take of each receiver [byte]."""
        each = (int(self.period.sun.is_up.sum()) + 7) // 8 if self.wanted.masks else 0
        return 2 * each if self.canopy else each

    @property
    def bytes_kept(self) -> int:
        """What else is kept of each receiver besides hours [byte]."""
        days = len(self.period.days)
        behind = (4 + 4 * days * self.wanted.by_day) if self.canopy else 0
        asked = self.asked.bytes_kept(days if self.wanted.by_day else 0)
        return self.wanted.bytes_kept(days) + asked + behind

    def count(
        self,
        casting: Casting,
        shape: tuple[int, ...],
        tiles: Sequence[tuple[Any, Callable[[], Tile]]],
        progress: Progress,
    ) -> Result:
        """
        Count the whole period on all receivers, and answer what was asked.

        Parameters
        ----------
        casting : Casting
        shape : tuple of int
            Of all receivers.
        tiles : sequence of (index, callable)
            Where each tile's receivers lie among all, and what makes the tile.
        progress : callable
            Told how many instants are done, and of how many.
        """
        period, wanted, asked = self.period, self.wanted, self.asked
        reads_days = bool(asked.proposed) or (asked.groups is not None and wanted.tolerance > 0)
        ledger = Ledger(period, shape, wanted, self.canopy, reads_days=reads_days)
        answer = Answer(asked, casting, ledger)
        suns = period.sun.direction[period.sun.is_up]
        works = len(suns) * (2 if asked.groups else 1)
        seconds = 0.0
        with StudyCounters(self.device, self.casters, suns, math.prod(shape)) as counters:
            for n, (where, make_tile) in enumerate(tiles):
                tile = make_tile()
                counter = counters.make(tile)
                solid = tile.with_casters() if self.canopy else None
                if n == 0 and len(suns):  # one sun loads or compiles the kernels and makes buffers
                    counter.add_steps(suns[:1], np.zeros(tile.shape, np.int32))
                advance = make_advance(progress, n * works, len(tiles) * works)
                started = time.perf_counter()
                if wanted.tolerance:
                    caught = [Caught(counter, tile.tree)]
                    if solid is not None:
                        caught.append(Caught(solid.make_counter(), solid.tree))
                    count_exactly(caught, tile.places, tile.shape, ledger, where, advance)
                else:
                    through = None if solid is None else solid.make_counter()
                    count_period(counter, tile.shape, ledger, where, advance, through)
                if wanted.tolerance:
                    answer.add_exactly(tile, where, partial(self._solve, tile), advance)
                else:
                    answer.add(tile, where, advance)
                seconds += time.perf_counter() - started
        return Result(ledger, answer, seconds, counters.device)

    def _solve(self, tile: Tile, parts: Sequence[int]) -> NDArray[np.float32]:
        """Give a tile's exact hours in shadow by date if only some parts cast (days, ...) [h]."""
        chosen, canopy = [parts], self.canopy
        if canopy is not None and set(parts).intersection(canopy.casting):
            chosen.append([part for part in parts if part not in set(canopy.casting)])
        else:
            canopy = None
        tiles = [tile.with_casters(some) for some in chosen]
        caught = [Caught(one.make_counter(), one.tree) for one in tiles]
        wanted = Wanted(tolerance=self.wanted.tolerance)
        ledger = Ledger(self.period, tile.shape, wanted, canopy, reads_days=True)
        count_exactly(caught, tile.places, tile.shape, ledger)
        return np.array([ledger.read_hours(day) for day in range(len(self.period.days))])

    def describe(self, receivers: str, seconds: float, **more: object) -> dict[str, object]:
        """Give the attributes of a result; those that are None are left out."""
        scene, site = self.scene, self.site
        facts: dict[str, object] = {
            "umbra_version": umbra.__version__,
            "command": "umbra.shadow_study",
            "source": "; ".join(f"{s.name} sha256:{s.sha256}" for s in scene.sources),
            "device": "cpu",
            "threads": self.threads,
            "crs": scene.crs,
            "receivers": receivers,
            **more,
            "latitude": site.latitude,
            "longitude": site.longitude,
            "time_zone": site.zone,
            "true_north_deg": site.true_north,
            "refraction": self.period.refraction,
            **describe_period(self.period, self.wanted),
            **self.asked.facts,
            **(self.canopy.facts if self.canopy else {}),
            "prepare_seconds": time.perf_counter() - self.begun - seconds,
            "count_seconds": seconds,
        }
        return {name: fact for name, fact in facts.items() if fact is not None}
