"""
The shadow study: hours of shadow on every receiver over a period.

The period is cut into steps, each judged at its midpoint, so that hours add up to exactly
the period less the night. The profile is drawn at the steps' ends.
"""

import difflib
import functools
import inspect
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import select_casters
from umbra.errors import InputError
from umbra.machine import choose_threads
from umbra.options import list_options
from umbra.rays.hidden import find_hidden
from umbra.receivers import find_kind
from umbra.receivers.kind import ReceiverKind, Receivers, Request, Tile
from umbra.scene import Scene
from umbra.study.lights import Lights
from umbra.study.loop import add_up
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.study.setup import Progress, Setup
from umbra.sun import Site

__all__ = ["RayCounter", "check_names", "count_lights", "run", "run_study"]


def run(
    scene: Scene,
    site: Site,
    options: StudyOptions,
    progress: Progress = lambda _done, _all: None,
    kind: ReceiverKind | None = None,
) -> Study:
    """
    Run a study and keep the data for its pictures.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : StudyOptions
    progress : callable
        Called with the number of instants done and the total.
    kind : ReceiverKind, optional
        By default that of the options' receivers.
    """
    kind = kind or find_kind(options.receivers, scene, options.ground)
    setup = Setup.of(scene, site, options)
    laid = kind.lay_out(setup.request)
    done = setup.count(laid, progress)
    nothing = laid.finish()
    if nothing is not None:
        done.blank(nothing)
    facts = setup.describe(kind.name, done.seconds, device=done.device, **laid.facts)
    arrays, more = done.arrays, done.variables(laid)
    study = Study(laid, setup.period, arrays.shadow_hours, arrays.up_hours, done.masks, facts, more)
    more |= laid.sum_up(study)
    return study


def run_study(
    scene: Scene, site: Site, *, progress: Progress = lambda _done, _all: None, **options: Any
) -> Study:
    """Run a study with the options of ``shadow_study`` and keep the data for its pictures."""
    return run(scene, site, StudyOptions(**options), progress)


P = ParamSpec("P")
T = TypeVar("T")


def check_names(call: Callable[P, T]) -> Callable[P, T]:
    """
    Decorate a call that takes a study's options: report unknown options and a missing date.

    Raises
    ------
    InputError
        From the call: if a name is unknown, or there is no date.
    """
    known = [name for name, _, _ in list_options(StudyOptions)]
    own = inspect.signature(call).parameters

    @functools.wraps(call)
    def checked(*args: P.args, **given: P.kwargs) -> T:
        for name in given:
            if name not in known and name not in own:
                near = difflib.get_close_matches(name, known, n=1)
                advice = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"
                msg = f"a study has no option '{name}'; {advice}"
                raise InputError(msg, option=name)
        if "date" not in given:
            msg = "a study needs a date; give date='YYYY-MM-DD'"
            raise InputError(msg, option="date")
        return call(*args, **given)

    return checked


class RayCounter:
    """
    Counter of any homogeneous lights on a tile, by rays.

    Parameters
    ----------
    tile : Tile
    threads : int
    """

    def __init__(self, tile: Tile, threads: int = 1) -> None:
        self.tile, self.threads = tile, threads

    def masks(self, lights: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return for each light (n, 4) the receivers in shadow, cast or attached."""
        tile, where = self.tile, self.tile.places
        found = find_hidden(tile.tree, where.points, where.normals, lights, self.threads)
        return found.reshape(-1, *tile.shape)

    def add_steps(
        self,
        lights: NDArray[np.float64],
        steps: NDArray[np.int32],
        progress: Callable[[int], object] = lambda _: None,
    ) -> None:
        """Add to each receiver the number of lights that leave it in shadow."""
        for light in lights:
            steps += self.masks(light[None])[0]
            progress(1)


def count_lights(
    scene: Scene, lights: Lights, options: StudyOptions
) -> tuple[Receivers, NDArray[np.float32]]:
    """
    Add the weights of the lights that each receiver does not see.

    Directions above the horizon are counted like suns; lamps, and lights that shine upward,
    by rays.

    Parameters
    ----------
    scene : Scene
    lights : Lights
    options : StudyOptions
        Only the options of receivers and casters are read.

    Returns
    -------
    laid : Receivers
    sums : (k, ...) float32
        Sum of each column of weights.

    Raises
    ------
    InputError
        If an option is wrong, or a canopy is chosen.
    """
    if options.canopy:
        msg = "lights of one's own pass no canopies; leave canopy= out, or no_cast= such parts"
        raise InputError(msg, option="canopy")
    kind = find_kind(options.receivers, scene, options.ground)
    threads = choose_threads(options.threads)
    suns, others = lights.split()
    casters = select_casters(scene, options.cast, options.no_cast)
    request = Request(
        scene, options, casters, threads, lights=len(suns), find_reaching=lambda: suns.directions
    )
    laid = kind.lay_out(request)
    sums = np.zeros((lights.weights.shape[1], *laid.shape), np.float32)
    for where, make_tile in laid.make_tiles(request):
        tile = make_tile()
        inside = where if isinstance(where, tuple) else (where,)
        if len(suns):
            sums[:, *inside] += add_up(tile.make_counter(), tile.shape, suns)
        if len(others):
            sums[:, *inside] += add_up(RayCounter(tile, threads), tile.shape, others)
    nothing = laid.finish()
    if nothing is not None:
        sums[:, nothing] = np.nan
    return laid, sums
