"""
The shadow study: hours of shadow in every cell of a plan over a part of a day.

The period is cut into steps and each step is judged at its midpoint, so that hours
add up to exactly the period less the night. The profile is drawn at the steps' ends.
"""

from typing import Any

from umbra.receivers import find_kind
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.study.setup import Progress, Setup
from umbra.sun import Site

__all__ = ["run", "run_study"]


def run(
    scene: Scene,
    site: Site,
    options: StudyOptions,
    progress: Progress = lambda _done, _all: None,
) -> Study:
    """
    Run a study and keep what its pictures need.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : StudyOptions
    progress : callable
        Told how many instants are done, and of how many.
    """
    kind = find_kind(options.receivers, scene, options.ground)
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
    """Run a study with the options of ``shadow_study``, and keep what its pictures need."""
    return run(scene, site, StudyOptions(**options), progress)
