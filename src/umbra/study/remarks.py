"""What a study's request may not have meant, one line each with the remedy."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from umbra.casters.casting import select_casters
from umbra.devices import DEFAULT
from umbra.lights import make_no_period
from umbra.receivers import find_kind
from umbra.receivers.layout import LONGEST_SHADOW
from umbra.receivers.standing import find_crossings
from umbra.registry import take_notes
from umbra.scene import Scene, Triangles
from umbra.study.options import StudyOptions
from umbra.study.replaced import leave_replaced
from umbra.sun import Site, parse_dates
from umbra.sun.clock import say_hours
from umbra.sun.date_words import tell_skipped

__all__ = [
    "tell_long_shadows",
    "tell_outside",
    "tell_overlap",
    "tell_panes",
    "tell_proposal",
    "tell_request",
    "tell_sources",
]

_AWAY = 50.0  # distance of a weather file's place that is worth a word [km]
_NIGHT = 0.02  # share of its energy without a sun that is
_LEAP_DAY = (2, 29)
_SIDE = 24  # points along each side of a proposal's bounds
_DEEP = 0.3  # height that two bodies share at a point, beyond what a model's tolerance is [m]
_SHARE = 0.05  # of a proposal's plan that is worth a word
_LEVEL = 1e-9  # of the side: points keep off edges that lie on a round fraction of the bounds
_CUT = 0.25  # least time in shadow at a plan's edge that is reported as cut [h]
_OPENINGS = ("window", "door", "curtainwall", "plate")


def tell_request(scene: Scene, options: StudyOptions, site: Site | None = None) -> list[str]:
    """
    Report what a request leaves out, moves or repeats.

    Parameters
    ----------
    scene : Scene
    options : StudyOptions
    site : Site, optional

    Returns
    -------
    notes : list of str
        Dates that do not exist, canopies that the device does not count, a proposal outside the
        plan or within what stands there.

    Raises
    ------
    InputError
        If a pattern matches no part.
    """
    notes = [*take_notes(), *(tell_skipped(options.date) if options.date is not None else ())]
    notes += tell_sources(options, site)
    notes += options.horizon.told if options.horizon is not None else ()
    is_other = options.device not in {"auto", DEFAULT}
    if options.canopy and is_other:
        notes.append(
            f"device='{options.device}' counts no canopies in studies, so the {DEFAULT} device "
            "counts; leave device= or canopy= out"
        )
    return notes + (tell_proposal(scene, options) if options.proposed else [])


def tell_proposal(scene: Scene, options: StudyOptions) -> list[str]:
    """Report what a proposal replaces, where it lies outside the plan, and what it overlaps."""
    scene, notes = leave_replaced(scene, options.proposed, options.replace, options.replace_in)
    proposed = scene.select(options.proposed, option="proposed")
    if options.extent is not None and find_kind(options.receivers, scene).is_plan:
        notes += tell_outside(_find_box(scene, proposed), options.extent)
    casting = select_casters(scene, options.cast, options.no_cast)
    old = scene.triangles(sorted(set(casting) - set(proposed)))
    groups, labels = scene.groups(), scene.labels()
    return notes + tell_overlap(
        scene.triangles(proposed), old, groups,
        lambda group: labels[int(np.flatnonzero(groups == group)[0])],
    )  # fmt: skip


def tell_sources(options: StudyOptions, site: Site | None) -> list[str]:
    """Report what measures take by default, and weather that may be of another place or time."""
    taken = {name for measure in options.measures for name in measure.takes}
    notes = []
    if "sunshine" in taken and options.sunshine is None:
        notes.append(
            "the sun is taken to shine whenever it is up; sunshine= takes its probability by month"
        )
    if "weather" not in taken or site is None:
        return notes
    weather = options.weather_year
    away = weather.measure_distance(site)
    if away > _AWAY:
        notes.append(
            f"the weather of {weather.name} is of a place {away:,.0f} km away "
            f"({weather.latitude:.2f}°, {weather.longitude:.2f}°); give that of a nearer one"
        )
    suns = weather.find_suns(site, make_no_period(site), options.refraction)
    night = float(suns.beam[~suns.sun.is_up].sum() / max(suns.beam.sum(), 1.0))
    if night > _NIGHT:
        notes.append(
            f"{100 * night:.2g} % of the sun's energy in {weather.name} falls into hours when it "
            "is down at the site, and is left out; check the file's time zone and the site"
        )
    if options.date is not None and not weather.has_leap_day:
        days = parse_dates(options.date, options.every_days)
        if any((day.month, day.day) == _LEAP_DAY for day in days):
            notes.append(f"{weather.name} has no 29 February: 28 February stands for it")
    return notes


def tell_outside(box: NDArray[np.float64], extent: Sequence[float]) -> list[str]:
    """Report a proposal whose bounds (2, 3) lie wholly outside the extent of a plan [m]."""
    low, high = np.array(extent[:2]), np.array(extent[2:])
    gap = float(np.hypot(*np.maximum(np.maximum(low - box[1, :2], box[0, :2] - high), 0)))
    if gap <= 0:
        return []
    bounds = ",".join(f"{v:.0f}" for v in (*box[0, :2], *box[1, :2]))
    note = f"the proposal lies {gap:,.0f} m outside extent=, so the plan holds its shadow alone"
    return [f"{note}; its own bounds are {bounds}"]


def tell_long_shadows(sides: Iterable[NDArray[np.float32]]) -> list[str]:
    """Report shadows that run on beyond the sides of a plan, by their hours in shadow."""
    most = max((float(np.nanmax(side, initial=0.0)) for side in sides), default=0.0)
    if most < _CUT:
        return []
    note = (
        f"the plan holds shadows up to {LONGEST_SHADOW:g} times as long as the model is high; "
        f"longer ones are cut at its edge, where they last up to {say_hours(most)}; "
        "extent= shows more"
    )
    return [note]


def tell_panes(scene: Scene, options: StudyOptions) -> list[str]:
    """Report rules on samples of windows: they lie on all faces, not on the panes alone."""
    if options.kind.name != "surfaces":
        return []
    kinds = dict.fromkeys(scene.parts[k].kind for k in scene.select(options.on, option="on"))
    bodies = [kind for kind in kinds if kind.lower().removeprefix("ifc").startswith(_OPENINGS)]
    if not bodies:
        return []
    note = (
        f"rules judge every sampled face of {', '.join(bodies)}: reveals, frames and inner faces, "
        "too; for panes alone give the middle and the outward normal of each: "
        "receivers='points' points='FILE.csv' with columns x,y,z,nx,ny,nz"
    )
    return [note]


def _find_box(scene: Scene, parts: Sequence[int]) -> NDArray[np.float64]:
    """Return the bounds of parts in the model's own coordinates, (2, 3) [m]."""
    corners = scene.triangles(parts).find_corners() + scene.origin
    return np.stack([corners.min(0), corners.max(0)])


def tell_overlap(
    new: Triangles, old: Triangles, groups: NDArray[np.int32], find_name: Callable[[int], str]
) -> list[str]:
    """
    Report existing bodies that fill the place of proposed ones.

    Parameters
    ----------
    new : Triangles
        Of the proposal.
    old : Triangles
        Of all else that casts.
    groups : (n_parts,) int
        Object of each part of ``old``.
    find_name : callable
        Returns an object's name.
    """
    if not len(new.faces) or not len(old.faces):
        return []
    low, high = (f(new.vertices[new.faces], (0, 1)) for f in (np.min, np.max))
    old = _keep_near(old, low, high)
    steps = (np.arange(_SIDE) + 0.5) / _SIDE + _LEVEL
    places = [low[:2] + (high - low)[:2] * (a, b) for a in steps for b in steps]
    single = np.zeros(int(new.part.max()) + 1, np.int32)
    covered = shared = 0
    met: dict[int, int] = {}
    for x, y in places:
        new_spans = [span for spans in _find_spans(new, single, x, y).values() for span in spans]
        covered += bool(new_spans)
        there = {
            group
            for group, spans in (_find_spans(old, groups, x, y) if new_spans else {}).items()
            if any(min(a[1], b[1]) - max(a[0], b[0]) > _DEEP for a in spans for b in new_spans)
        }
        shared += bool(there)
        for group in there:
            met[group] = met.get(group, 0) + 1
    if not covered or shared < _SHARE * covered:
        return []
    first, *others = sorted(met, key=lambda group: -met[group])
    name = find_name(first)
    more = f" and {len(others)} more" if others else ""
    note = (
        f"{100 * shared / covered:.0f} % of the proposal's plan overlaps what stands there: "
        f"'{name}'{more}; move the proposal, or say what it replaces: "
        f"replace='{name}' or replace_in='FILE'"
    )
    return [note]


def _keep_near(soup: Triangles, low: NDArray[np.float64], high: NDArray[np.float64]) -> Triangles:
    """Return the triangles whose bounds meet a rectangle."""
    corners = soup.vertices[soup.faces][..., :2]
    near = ((corners.min(1) <= high[:2]) & (corners.max(1) >= low[:2])).all(1)
    return Triangles(soup.vertices, soup.faces[near], soup.part[near])


def _find_spans(
    soup: Triangles, groups: NDArray[np.int32], x: float, y: float
) -> dict[int, list[tuple[float, float]]]:
    """Return the heights between which a vertical line lies in each closed object [m]."""
    faces, z, turns = find_crossings(soup, x, y)
    owners = groups[soup.part[faces]]
    spans = {}
    for owner in np.unique(owners).tolist():
        own = np.flatnonzero(owners == owner)
        own = own[np.argsort(z[own], kind="stable")]
        inside = -np.cumsum(turns[own])
        if inside[-1] == 0:
            heights = z[own]
            spans[owner] = [
                (float(heights[k]), float(heights[k + 1]))
                for k in np.flatnonzero(inside > 0).tolist()
            ]
    return spans
