"""``umbra.envelope``: how high one may build on a plot, by rules of sunlight."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Sequence
from dataclasses import replace as change
from pathlib import Path
from typing import Any, ParamSpec, Protocol

import numpy as np
from numpy.typing import ArrayLike

from umbra.calls.massing_options import EnvelopeOptions
from umbra.casters.casting import prepare_casting, select_casters
from umbra.errors import InputError, check_type
from umbra.ground.choice import Ground, find_ground
from umbra.land.named_land import NamedLand
from umbra.lights import Horizon
from umbra.machine import choose_threads
from umbra.massing.asks import Ask
from umbra.massing.gathered_points import GatheredPoints
from umbra.massing.plot import Plot, lay_cells
from umbra.massing.rule_asks import ask_rules
from umbra.massing.search import KIND, HeightEnvelope, search_heights
from umbra.massing.solid import make_solid
from umbra.packages import need
from umbra.receivers.points import check_points, read_points
from umbra.rules import Rule, read_rule
from umbra.scene import Part, Scene
from umbra.scene.mesh import ADDED_GROUND as _ADDED
from umbra.signatures import takes
from umbra.study.options import StudyOptions
from umbra.study.replaced import find_on_plot, find_replaced, read_outline, read_polygons
from umbra.sun import Site
from umbra.verdicts.subjects import Subjects, of_points
from umbra.verdicts.sunlight import Model, check_year

__all__ = ["Envelope", "envelope", "read_chosen", "read_given"]

P = ParamSpec("P")
_NAMED = 3


class Envelope(HeightEnvelope):
    """The greatest heights over a plot, which can be drawn and written."""

    def plot_sheet(self) -> Any:
        """Draw the sheet: heights in plan, and in axonometry; it has ``save(path)``."""
        from umbra.writers.massing.envelope_sheet import draw_envelope  # noqa: PLC0415

        return draw_envelope(self)

    def _repr_png_(self) -> bytes:
        """Show it in a notebook."""
        picture: bytes = self.plot_sheet()._repr_png_()
        return picture

    def write(self, out: str | Path, *formats: str) -> list[Path]:
        """
        Write the envelope into a folder, whose results are replaced once all are complete.

        Parameters
        ----------
        out : path
        *formats : str
            Besides ``envelope.tif``, ``.obj``, ``.glb`` and ``.png``: ``"cityjson"``, ``"pdf"``,
            ``"svg"``, ``"json"``.

        Returns
        -------
        paths : list of Path

        Raises
        ------
        InputError
            If a format is not known.
        """
        from umbra.writers.massing.folder import write_envelope  # noqa: PLC0415

        return write_envelope(Path(out), self, formats)


class EnvelopeCall(Protocol[P]):
    """The signature of ``umbra.envelope``."""

    def __call__(self, scene: Scene, site: Site, *_: P.args, **options: P.kwargs) -> Envelope: ...


def _take(record: Callable[P, EnvelopeOptions]) -> Callable[[Any], EnvelopeCall[P]]:
    return takes(record, "an envelope")


@_take(EnvelopeOptions)
def envelope(scene: Scene, site: Site, *, options: EnvelopeOptions) -> Envelope:
    """
    Find the greatest heights over a plot that keep rules of sunlight at all receivers.

    Each cell of the plot is a box from the ground up. Where a rule fixes the time, its height is
    exactly the least of the sun's planes over it; where so many hours are enough, which of them
    are kept is searched, and ``bound_m3`` is what no choice can exceed. The result is verified by
    an exact study with the envelope in the scene.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : EnvelopeOptions
        Each by its name.

    Returns
    -------
    envelope : Envelope
        ``heights`` (rows, cols), ``volume_m3``, ``max_height_m``, ``bound_m3``, ``violations``,
        ``notes``, ``write(out)``.

    Raises
    ------
    InputError
        If the plot is no polygon, lies off the model or holds receivers, if a rule is not known,
        has no receivers, or is of a measure that no planes of the sun are found for.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> site = umbra.find_site(scene)
    >>> found = umbra.envelope(scene, site, plot="plot.geojson", rules="mine.yaml")
    >>> found.volume_m3, found.bound_m3
    >>> found.write("out/")
    """
    check_type("scene", scene, Scene)
    check_type("site", site, Site)
    threads, progress, highest = choose_threads(options.threads), options.progress, options.highest
    chosen = read_chosen(options.rules)
    progress("reading the plot")
    outlines, notes = read_polygons(options.plot, scene, "plot")
    far = NamedLand.of(options.horizon, options.horizon_from)
    land = far.settle(scene.model_bounds(), site)
    notes += () if land is None else land.told
    cleared, replaced, remarks = _clear_plot(scene, outlines, options)
    notes += remarks
    stated = find_ground(scene, options.ground)
    ground_now = stated if not replaced else _stand(cleared, stated)
    cells = lay_cells(outlines, ground_now, options.cell, threads)
    notes += _tell_ground(ground_now)
    casters = select_casters(ground_now.scene, options.cast, options.no_cast)
    around = prepare_casting(ground_now.scene, casters, threads)
    gathered = _gather(ground_now, site, cells, options, outlines, land)
    progress("laying out receivers")
    needs = ask_rules(gathered, chosen, around)
    _check_covered(cells, needs.asks, ground_now.scene)
    heights = search_heights(
        ground_now.scene, casters, needs.asks, needs.groups, cells, highest, threads, progress,
        candidates=needs.candidates, choices=needs.choices,
    )  # fmt: skip
    notes += [*needs.notes, *gathered.notes]
    result = Envelope(
        ground_now.scene, site, heights, tuple(_title(rule) for rule in chosen), tuple(needs.times),
        highest, tuple(replaced), tuple(dict.fromkeys(notes)),
    )  # fmt: skip
    return change(result, notes=(*result.notes, *_tell_result(result)))


def read_chosen(rules: str | Path | Rule | Sequence[str | Path | Rule]) -> list[Rule]:
    """
    Read the rules that are named; one with several variants needs a choice.

    Raises
    ------
    InputError
        If there is none, or a rule has variants of which none is chosen.
    """
    named = [rules] if isinstance(rules, (str, Path, Rule)) else list(rules)
    if not named:
        msg = "no rule is given; name one, or a file, with rules="
        raise InputError(msg, option="rules")
    variants_found = []
    for name in named:
        variants = [name] if isinstance(name, Rule) else read_rule(name)
        if len(variants) > 1:
            listed = ", ".join(f"{rule.name}:{rule.variant}" for rule in variants[:_NAMED])
            msg = f"rule '{variants[0].name}' has {len(variants)} variants; choose one: {listed}"
            raise InputError(msg, option="rules", rule=variants[0].name)
        variants_found += variants
    return variants_found


def _title(rule: Rule) -> str:
    variant = f", {rule.variant}" if rule.variant else ""
    return f"{rule.title}{variant}"


def _clear_plot(
    scene: Scene, outlines: list[Any], options: EnvelopeOptions
) -> tuple[Scene, list[str], list[str]]:
    """Leave out what makes way; return its names, and what is to be told."""
    shapely = need("shapely", "gis", "plot")
    on_plot, cut = find_on_plot(scene, shapely.union_all(outlines))
    there, keep = options.replace_in, options.keep
    beside, notes = (None, []) if there is None else read_outline(there, scene)
    elsewhere, _ = find_replaced(scene, (), options.replace, beside)
    staying = set(scene.select(keep, option="keep")) if keep else set()
    labels = scene.labels()
    gone = sorted({*on_plot, *elsewhere} - staying)
    names = list(dict.fromkeys(labels[k] for k in gone))
    others = [item.name for item in cut if not item.goes and item.name not in names]
    if names:
        where = "stand on the plot" if gone == [k for k in on_plot if k in gone] else "are replaced"
        more = f" and {len(names) - _NAMED:,} more" if len(names) > _NAMED else ""
        notes.append(
            f"{', '.join(names[:_NAMED])}{more} {where} and are removed for the envelope "
            "(keep= keeps them)"
        )
    if others:
        more = f" and {len(others) - _NAMED:,} more" if len(others) > _NAMED else ""
        notes.append(
            f"{', '.join(others[:_NAMED])}{more} reach over the plot's boundary and stay "
            "(replace= removes them, too)"
        )
    if len(gone) == len(scene.parts):
        msg = "all of the model stands on the plot; name what stays with keep="
        raise InputError(msg, option="keep")
    parts = [part for k, part in enumerate(scene.parts) if k not in set(gone)]
    return (change(scene, parts=tuple(parts)) if gone else scene), names, notes


def _stand(cleared: Scene, stated: Ground) -> Ground:
    """Return the ground of the whole model for a scene without what makes way."""
    if stated.is_plane:
        return change(stated, scene=cleared)
    added = tuple(part for part in stated.scene.parts if stated.is_added and part.kind in _ADDED)
    return change(stated, scene=change(cleared, parts=(*cleared.parts, *added)))


def _tell_ground(ground: Ground) -> list[str]:
    if ground.assumed is None:
        return []
    return [f"heights are above the {ground.name} (ground= sets another)"]


def _gather(
    ground: Ground,
    site: Site,
    plot: Plot,
    options: EnvelopeOptions,
    outlines: list[Any],
    land: Horizon | None,
) -> GatheredPoints:
    """Prepare the receivers of rules; a box of the cap's height stands for the proposal."""
    from umbra.scene.named_places import Area  # noqa: PLC0415

    scene = ground.scene
    mesh = make_solid(plot, plot.ground + options.highest)
    assert mesh is not None
    whole = change(scene, parts=(*scene.parts, Part("envelope", KIND, mesh)))
    level = ground.level if ground.is_plane else None
    study = StudyOptions(
        date="2026-03-21", ground=level, cast=options.cast, no_cast=options.no_cast,
        threads=options.threads, horizon=land,
    )  # fmt: skip
    year = check_year(options.year or dt.date.today().year)
    model = Model(scene=whole, site=site, year=year, options=study, proposed=("envelope",))
    named = [Area(f"plot {k + 1}", outline) for k, outline in enumerate(outlines)]
    return GatheredPoints(
        model, areas=options.areas, windows=options.windows, plot=named, roads=options.roads,
        points=read_given(options.points, options.names),
    )  # fmt: skip


def read_given(points: ArrayLike | str | Path | None, names: Sequence[str]) -> Subjects | None:
    """Return given points, or those of a table, as what rules judge."""
    if points is None:
        return None
    if isinstance(points, (str, Path)):
        given, own = read_points(points)
        names = names or own
    else:
        given = check_points(points)
    labels = [str(name) for name in names] or [f"point {k + 1}" for k in range(len(given))]
    if len(labels) != len(given):
        msg = f"{len(labels)} names for {len(given)} points; give one each"
        raise InputError(msg, option="names")
    normals = given[:, 3:] if given.shape[1] > 3 else np.tile([0.0, 0.0, 1.0], (len(given), 1))
    return of_points("windows", labels, given[:, :3], normals)


def _check_covered(plot: Plot, asks: Sequence[Ask], scene: Scene) -> None:
    """Refuse a plot that holds receivers."""
    for ask in asks:
        covered = plot.find_covered(ask.places.points)
        if len(covered):
            names = list(dict.fromkeys(ask.labels[k] for k in ask.receivers[covered]))
            x, y = (ask.places.points[covered[0]] + scene.origin)[:2]
            msg = (
                f"the plot holds {len(names):,} receivers (first: {names[0]} at {x:,.6g}, "
                f"{y:,.6g}), which the envelope would cover; cut them out of the plot, or leave "
                "them out"
            )
            raise InputError(msg, option="plot", receivers=names)


def _tell_result(result: Envelope) -> list[str]:
    """Tell what binds a result besides the rules."""
    notes = list(result.found.told)
    if result.capped:
        notes.append(
            f"{result.capped:,} of {len(result.found.heights):,} cells end at the cap of "
            f"{result.highest:g} m (highest= sets another)"
        )
    if result.broken:
        more = len(result.broken) - _NAMED
        listed = ", ".join(result.broken[:_NAMED]) + (f" and {more:,} more" if more > 0 else "")
        notes.append(
            f"{len(result.broken):,} have less than a rule asks before anything is built: "
            f"{listed}; nothing is taken from them"
        )
    return notes
