"""
The shadow study: hours of shadow on every receiver over a period.

The period is cut into steps, each judged at its midpoint, so that hours add up to exactly
the period less the night. The profile is drawn at the steps' ends.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.casters import Canopy
from umbra.casters.casting import select_casters
from umbra.devices import DEFAULT, StudyCounters
from umbra.ground.choice import Ground
from umbra.lights import Lights
from umbra.machine import choose_threads
from umbra.receivers import find_kind
from umbra.receivers.kind import ReceiverKind, Receivers, Request
from umbra.scene import Scene
from umbra.study.area_table import tabulate
from umbra.study.engine import HiddenSums, Progress, count_each_tile, run_on_device
from umbra.study.land import settle_land
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.study.settled import settle_ground
from umbra.study.setup import Setup
from umbra.sun import Site

__all__ = ["count_lights", "run", "run_study"]


def run(
    scene: Scene,
    site: Site | None,
    options: StudyOptions,
    progress: Progress = lambda _done, _all: None,
    kind: ReceiverKind | None = None,
) -> Study:
    """
    Run a study and keep the data for its pictures.

    Parameters
    ----------
    scene : Scene
    site : Site, optional
        Needed where a measure is of the sun.
    options : StudyOptions
    progress : callable
        Called with the number of instants done and the total.
    kind : ReceiverKind, optional
        By default that of the options' receivers.
    """
    options = settle_land(options, scene.model_bounds(), site)
    ground = settle_ground(scene, options)
    scene = ground.scene
    kind = kind or find_kind(options.receivers, scene, options.ground)
    setup = Setup.of(scene, site, options)
    study = _count(setup, kind, ground, progress)
    if options.areas is None:
        return study
    own = options.ask_hours("areas", measures=True, exact=options.exact)
    alone = Setup.of(scene, site, own)
    of_areas = study
    if kind.name != "areas":
        of_areas = _count(alone, find_kind("areas"), ground, progress)
    before = None
    if (proposal := setup.proposal) is not None:
        rest = proposal.find_before(None)
        before = _count(_leave_only(alone, rest), find_kind("areas"), ground, progress)
    return replace(study, areas=tabulate(of_areas, before))


def _leave_only(setup: Setup, casters: Sequence[int]) -> Setup:
    """Return a setup with these casters alone."""
    options = setup.options
    canopy = Canopy.of(
        setup.scene, casters, options.canopy, options.transmissivity, options.leaf_on
    )
    return replace(setup, casters=list(casters), canopy=canopy)


def _count(setup: Setup, kind: ReceiverKind, ground: Ground, progress: Progress) -> Study:
    """Count one kind of receivers."""
    laid = kind.lay_out(setup.request)
    done = setup.count(laid, progress)
    study = setup.finish(done, laid)
    facts = setup.describe(
        kind.name,
        done.seconds,
        device=done.device,
        device_note=done.note or None,
        ground=ground.name,
        **laid.facts,
    )
    study = replace(study, facts=facts)
    study.more.update(laid.sum_up(study))
    return study


def run_study(
    scene: Scene, site: Site, *, progress: Progress = lambda _done, _all: None, **options: Any
) -> Study:
    """Run a study with the options of ``shadow_study`` and keep the data for its pictures."""
    return run(scene, site, StudyOptions(**options), progress)


def count_lights(
    scene: Scene, lights: Lights, options: StudyOptions
) -> tuple[Receivers, NDArray[np.float32]]:
    """
    Add the weights of the lights that each receiver does not see.

    Directions above the horizon are counted like suns, on the options' device; lamps, and lights
    that shine upward, by rays. Canopies hide the share of a light that they do not transmit, with
    leaves.

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
        If an option is wrong.
    """
    scene = settle_ground(scene, options).scene
    kind = find_kind(options.receivers, scene, options.ground)
    threads = choose_threads(options.threads)
    suns, others = lights.split()
    casters = select_casters(scene, options.cast, options.no_cast)
    canopy = Canopy.of(scene, casters, options.canopy, options.transmissivity, options.leaf_on)
    request = Request(
        scene, options, casters, threads, canopy, lights=len(suns),
        find_reaching=lambda: suns.directions,
    )  # fmt: skip
    laid = kind.lay_out(request)
    hidden = HiddenSums(suns, others, laid.shape, canopy)
    device, above = DEFAULT if canopy else options.device, suns.directions[:, :3]
    with StudyCounters(device, casters, above, math.prod(laid.shape)) as counters:
        make_run = run_on_device(counters, canopy, above)
        count_each_tile(laid.make_tiles(request), suns, [hidden], make_run)
    laid.facts["device"] = counters.device
    if counters.note:
        warnings.warn(counters.note, stacklevel=2)
    nothing = laid.finish()
    if nothing is not None:
        hidden.blank(nothing)
    return laid, hidden.sums
