"""
Captions of a study's pictures: site, dates, method, accuracy, casters.

A picture has one map for each date, or all dates together as a mean or a sum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.lights import Period
from umbra.scene import Scene
from umbra.scene.named_places import Area
from umbra.study import FinerHours, Preview, Study, StudyOptions, split_dates
from umbra.study.measures import Measure
from umbra.sun import find_daylight, name_days
from umbra.sun.day_times import CLOCKS, is_of_the_sun
from umbra.writers.folder import FolderJob
from umbra.writers.folder.foot import describe_foot, list_few
from umbra.writers.picture_content import OutlinedArea, Plan, Show, name_hours

__all__ = [
    "FEW",
    "Scale",
    "choose_panels",
    "describe",
    "describe_moments",
    "describe_smooth",
    "find_maps",
    "find_mean",
    "find_together",
    "join_names",
    "list_files",
    "name_files",
    "name_model",
    "name_picture",
    "name_shown",
    "name_sun",
    "outline_areas",
    "place_elevation",
    "tell_daylight",
    "tell_place",
    "tell_times",
]

MOST_PANELS = 12
"""Most dates with separate maps; of more dates every n-th is shown."""
FEW = 4
"""Most dates that are listed."""


def choose_panels(study: Study) -> range:
    """Return the indices of the dates with a map: all, or every n-th of many."""
    count = len(study.period.days)
    return range(0, count, -(-count // MOST_PANELS))


def find_maps(study: Study, plan: Plan) -> tuple[list[Study], Plan]:
    """Return the dates with a map, or the study of all, and the plan that states their number."""
    dates = split_dates(study)
    if len(dates) == 1:
        return dates, plan
    return [dates[k] for k in choose_panels(study)], name_shown(plan, study)


@dataclass(frozen=True)
class Scale:
    """The common scale of a picture's maps."""

    most: float  # its upper end: the longest time with the sun up on one date, or on all [h]
    what: str  # name of the hours, for the legend
    divisor: int  # of the hours: the number of dates for a mean, else 1
    show: Show

    @classmethod
    def of(cls, job: FolderJob) -> "Scale":
        """Choose the scale of a study's pictures."""
        dates, show = split_dates(job.study), job.show
        divisor, words = find_together(job)
        if len(dates) > 1:
            divisor, words = 1, " on the date"
        most = max(one.up_hours for one in dates) / divisor
        return cls(most, f"{name_hours(show)}{words}", divisor, show)

    def read_hours(self, study: Study | FinerHours) -> NDArray[np.float32]:
        """Return hours in shadow, shifted so that the scale's end minus them is sun, if shown."""
        lack = self.most - study.up_hours / self.divisor if self.show == "sun" else 0.0
        if self.divisor == 1 and lack == 0:
            return study.shadow_hours
        return study.shadow_hours / np.float32(self.divisor) + np.float32(lack)

    def find_dark(self, study: Study | FinerHours) -> float:
        """Return the value of ``read_hours`` from which a place has no sun."""
        return self.most if self.show == "sun" else study.up_hours / self.divisor


def tell_daylight(study: Study) -> str:
    """Describe sunrise and sunset on a study's date."""
    return str(find_daylight(study.site, study.period.days[0]))


def find_together(job: FolderJob) -> tuple[int, str]:
    """
    Return the divisor of sums over dates that are not kept apart, and words for the legend.

    The words follow the name of the hours, ", mean of 365 dates"; a single date has none.
    """
    return find_mean(job.study, job.options)


def find_mean(study: Study, options: StudyOptions) -> tuple[int, str]:
    """Return the same of a study and its options."""
    count = len(study.period.days)
    if count == 1:
        return 1, ""
    if options.by_day is False:
        return 1, f", sum of {count} dates"
    return count, f" a day, mean of {count} dates"


def name_shown(plan: Plan, study: Study) -> Plan:
    """Add to a plan's date how many of many dates have a map."""
    shown, days = choose_panels(study), study.period.days
    return plan if len(shown) == len(days) else replace(plan, date=f"{len(shown)} of {plan.date}")


def describe(
    job: FolderJob, preview: Preview, which: range, measures: Sequence[Measure] | None = None
) -> Plan:
    """
    Describe the picture of some of a study's days: coordinates, titles and captions.

    ``measures`` are those that it shows instead of hours.
    """
    study, options, outputs = job.study, job.options, job.outputs
    canopies = preview.find_canopies() if options.canopy else None
    x, y, axes = _find_axes(study, preview)
    north, upward = study.kind.find_north(study.facts, study.true_north)
    view = study.kind.tell_view(study.facts, options.receivers)
    told = view.removeprefix(", ") if outputs.title else ""
    proposed = None
    nothing = preview.nothing
    if study.kind.lies_under_roofs:  # which cover what receives nothing
        nothing = nothing & ~(preview.heights > 0)
    if not study.kind.is_plan:
        nothing = nothing & (preview.heights > 0)  # the sky has its own colour
        if options.proposed:
            proposed = preview.find_cells(job.scene.select(options.proposed))
    return Plan(
        x,
        y,
        preview.heights,  # type: ignore[arg-type]
        true_north=north,
        upward=upward,
        title=name_picture(job, which),
        subtitle=outputs.subtitle or "",
        place=tell_place(study),
        date=" · ".join(
            filter(
                None, [told, tell_times(study.period, options, which, is_titled=not outputs.title)]
            )
        ),
        note=describe_foot(study, options, measures=measures),
        axes=axes,
        has_scale=study.kind.has_scale,
        roofs_cover=study.kind.lies_under_roofs,
        proposed=proposed,
        looks_through=proposed is not None,
        nothing=nothing if nothing.any() else None,
        nothing_name="not asked" if options.on and not study.kind.is_plan else study.kind.nothing,
        canopies=canopies if canopies is not None and canopies.any() else None,
        canopy_name="" if canopies is None else f"{list_few(options.canopy, 1)}, see-through",
        areas=outline_areas(study.named_areas) if study.kind.is_plan else (),
    )


def outline_areas(areas: Sequence[Area]) -> tuple[OutlinedArea, ...]:
    """Return named areas as a plan outlines them."""
    if not areas:
        return ()
    import shapely  # noqa: PLC0415  (areas need it)

    found = []
    for area in areas:
        edges = shapely.get_parts(shapely.boundary(shapely.get_parts(area.polygon)))
        middle = area.polygon.centroid
        if not area.polygon.contains(middle):
            middle = area.polygon.representative_point()
        rings = tuple(shapely.get_coordinates(edge) for edge in edges)
        found.append(OutlinedArea(area.name, rings, (middle.x, middle.y)))
    return tuple(found)


def tell_place(study: Study) -> str:
    """Describe a study's site: coordinates and time zone; nothing where it is not known."""
    if study.site is None:
        return ""
    return f"{study.site.show()} · {study.site.zone}"


def tell_times(
    period: Period, options: StudyOptions, which: range, *, is_titled: bool = True
) -> str:
    """
    Describe the clock times of some of a study's dates, with their offsets from UTC.

    The dates come first where the title does not list them: they are many, or it is the user's.
    """
    if not which:
        return ""
    days = period.days[which.start : which.stop]
    dates = "" if is_titled and len(days) <= FEW else f"{name_days(days, FEW)}, "
    each = [offset for k in which for offset in period.steps[k].offsets()]
    offsets = "/".join(sorted(set(each)))
    clock = "" if options.clock == "local" else f" {CLOCKS[options.clock]}"
    hours = f"{options.start} to {options.end}{clock}"
    if options.clock == "local" and not any(map(is_of_the_sun, (options.start, options.end))):
        return f"{dates}{hours} ({offsets})"
    if len(which) == 1:  # other clocks: what the local one shows then
        first, last = (period.steps[which.start].local()[k] for k in (0, -1))
        offsets = f"{first:%H:%M:%S} to {last:%H:%M:%S}, {offsets}"
    return f"{dates}{hours} ({offsets})"


def _find_axes(
    study: Study, preview: Preview
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[str, str]]:
    """Return the coordinates and the axis labels; an elevation starts at 0."""
    if study.kind.is_plan:
        return preview.x, preview.y, ("x [m]", "y [m]")
    if not study.kind.is_upright:
        return preview.x, preview.y, ("", "")
    x, y = place_elevation(study, preview.x, preview.y)
    label = f"along the facade [m], from its left end; heights above z = {study.ground:.6g} m"
    return x, y, (label, "height [m]")


def place_elevation(
    study: Study, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Measure an elevation's coordinates (n,) from its left end and from the ground [m].

    Given are those along the view, and z, in the model's own frame.
    """
    from umbra.receivers.orthographic import Elevation  # noqa: PLC0415  (plans need no views)

    model = study.model
    azimuth = float(study.facts["view_azimuth_deg"])  # type: ignore[arg-type]
    view = Elevation.of(azimuth, study.true_north)
    left = view.find_extent(model.scene, getattr(model, "shown", None))[0, 0]
    # Parts outside the extent do not count.
    return x - max(left, float(x[0]) - study.grid.dx / 2), y - study.ground


def name_files(scene: Scene) -> str:
    """Name the first three files of a scene."""
    return join_names(list_files(scene))


def list_files(scene: Scene) -> list[str]:
    """List the names of a scene's own files."""
    return [Path(source.name).name for source in scene.sources if not source.is_companion]


def name_model(named: Sequence[str]) -> str:
    """Name a model for a title by its files: ``city_block.city.json`` is City block."""
    stems = [
        " ".join(name.lstrip(".").partition(".")[0].replace("_", " ").split()) for name in named
    ]
    return join_names([f"{stem[:1].upper()}{stem[1:]}" for stem in dict.fromkeys(stems)])


def name_picture(job: FolderJob, which: range, what: str = "sun") -> str:
    """Return the title of a picture of some dates: the user's, or the model's and what it shows."""
    if job.outputs.title:
        return job.outputs.title
    view = job.study.kind.tell_view(job.study.facts, job.options.receivers)
    return name_model(list_files(job.scene)) + view + name_sun(job.study.period, which, what)


def name_sun(period: Period, which: range, what: str = "sun") -> str:
    """Name what a picture shows and its dates, for its title."""
    days = period.days[which.start : which.stop]
    if not days:
        return f" · {what}"
    if len(days) > FEW:
        return f" · {what} on {len(days)} days"
    return f" · {what} on {name_days(days, FEW)}"


def join_names(names: Sequence[str]) -> str:
    """Join the first three names of files, and the number of the others."""
    return " + ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")


def describe_smooth(plan: Plan, study: Study, view: Preview) -> Plan:
    """Return a plan with the cells of a profile, whose size is told if they are finer."""
    x, y, _ = _find_axes(study, view)
    heights = view.heights.astype(np.float32)
    smooth = replace(plan, x=x, y=y, building_height=heights)
    has_own = "spacing_m" in study.facts  # hours are those of samples
    if len(view.x) <= len(study.x) and not has_own:
        return smooth
    size = f" of {smooth.cell[0]:.3g} m" if study.kind.has_scale else ""
    return replace(smooth, note=f"{plan.note} · shadows in cells{size}")


def describe_moments(plan: Plan, job: FolderJob, which: range) -> Plan:
    """Return a plan whose captions are of shadows at some times of some dates, not of hours."""
    note = describe_foot(job.study, job.options, shows_hours=False)
    return replace(plan, title=name_picture(job, which, "shadows"), note=note)
