"""Formats of further files, by name: their writer, and the extra that they need."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from PIL.Image import Image

    from umbra.study import Study
    from umbra.study.preview import Moment
    from umbra.study.timeline import Timeline
    from umbra.writers.picture_content import Show
    from umbra.writers.vectors import HourLine, Layer
    from umbra.writers.vectors.outlines import ShadowOutline

__all__ = [
    "CITY_FORMATS", "FORMATS", "PLAN_FORMATS", "SURFACE_FORMATS", "Format", "Job",
    "is_usual_name",
]  # fmt: skip

PLAN_FORMATS = ("geotiff", "map", "stac")
"""Names of the files of a plan in tiles."""
SURFACE_FORMATS = ("geoparquet", "3dtiles", "cityjson")
"""Names of the files of surfaces in tiles."""
CITY_FORMATS = PLAN_FORMATS + SURFACE_FORMATS
"""Names of the files of a study in tiles."""
FLAT = 1e-6  # above the ground something stands [m]
FEW_TIMES = 12  # most clock times that are listed

_OF_A_STUDY = re.compile(
    r"study\.(nc|toml|gpkg|dxf)|report\.html|hours\.tif|day\.(gif|mp4)"
    r"|(cells|instants|areas|areas_by_hours|months|windows(_by_\w+)?|samples|surfaces|parts|points|verdicts)\.csv(\.gz)?"
    r"|(shadow_outlines|hour_lines|seen|points)\.geojson|hours(_.+)?\.(glb|city\.jsonl?)"
    r"|(hours|hours_lost|profile|months|sheet|points|who)(_\d{4}-\d\d-\d\d)?\.(png|pdf|svg)"
)


def is_usual_name(name: str) -> bool:
    """Return whether umbra writes a file of this name into the folder of some study."""
    return _OF_A_STUDY.fullmatch(name) is not None


@dataclass(frozen=True, eq=False)
class Job:
    """A study to be written; data shared by formats are made once, on first use."""

    study: "Study"
    folder: Path
    title: str = ""
    say: Callable[[str], object] = lambda _line: None  # told in one line, for the user
    show: "Show" = "shadow"  # whose whole hours lines of equal hours are of
    at: Sequence[str] = ()  # clock times that are outlined and filmed; round ones by default
    failures: list[InputError] = field(default_factory=list)  # of outputs of packages
    cast: Sequence[str] = ()  # patterns of the parts that cast shadows; all by default
    no_cast: Sequence[str] = ()

    @property
    def is_on_map(self) -> bool:
        """Whether coordinates are the model's, not a view's."""
        return self.study.kind.is_plan or not self.study.kind.is_raster

    @property
    def crs(self) -> object:
        """Coordinate reference system stated by the study."""
        return self.study.facts.get("crs") if self.is_on_map else None

    @property
    def frame(self) -> str:
        """Description of coordinates that are not a map's."""
        if self.is_on_map:
            return ""
        azimuth = self.study.facts["view_azimuth_deg"]
        axes = " and ".join(self.study.dims[::-1])
        return f"{axes} in metres, seen from azimuth {azimuth:g}\N{DEGREE SIGN}"

    @cached_property
    def timeline(self) -> "Timeline":
        """Every instant at a page's resolution."""
        from umbra.study.timeline import make_timeline  # noqa: PLC0415

        return make_timeline(self.study)

    @cached_property
    def outlines(self) -> "list[ShadowOutline]":
        """Shadows on level ground; none of other receivers."""
        from umbra.study.preview import find_moments  # noqa: PLC0415
        from umbra.writers.vectors.outlines import EVERY, MOST, find_outlines  # noqa: PLC0415

        kind = self.study.kind
        if not kind.is_level:
            self.say(
                "note: shadow outlines are exact on level ground only; for receivers "
                f"{kind.name!r} lines of equal hours are written instead"
            )
            return []
        moments = find_moments(self.study, self.at, every=EVERY, most=MOST)
        if not self.at:
            self.say(f"note: shadows are outlined at {_name_times(moments)}; at= chooses others")
        return list(find_outlines(self.study, moments))

    @cached_property
    def hour_lines(self) -> "list[HourLine]":
        """Lines of equal hours."""
        from umbra.writers.vectors import find_hour_lines  # noqa: PLC0415

        return list(find_hour_lines(self.study, self.show))

    @property
    def most_hours(self) -> float:
        """Most hours with the sun up on one of the dates; on all, if only sums are kept."""
        from umbra.study import split_dates  # noqa: PLC0415

        return max(study.up_hours for study in split_dates(self.study))

    @cached_property
    def seen(self) -> "list[NDArray[np.float64]]":
        """The model's border in a view; empty for a plan."""
        from umbra.writers.vectors import trace_seen  # noqa: PLC0415

        return [] if self.is_on_map else trace_seen(self.study)

    @cached_property
    def layers(self) -> "list[Layer]":
        """All of them, as simple features."""
        from umbra.writers import vectors as layers  # noqa: PLC0415

        if not self.study.kind.is_raster:
            return [layers.make_point_layer(self.study)]
        features = [layers.make_line_layer(self.hour_lines)]
        if self.seen:
            features.insert(0, layers.make_seen_layer(self.seen, self.frame))
        outlines = self.outlines  # says why where there are none
        if self.study.kind.is_level:
            features.insert(0, layers.make_outline_layer(outlines))
        return features


@dataclass(frozen=True)
class Format:
    """A format of further files."""

    write: Callable[[Job], list[str]]  # returns the names of the files
    packages: tuple[str, ...] = ()  # imported beyond umbra's own
    extra: str = ""  # that installs them
    needs_hours: bool = True  # is made of hours of sun, not of any measure


def _write_geotiff(job: Job) -> list[str]:
    from umbra.study.attributes import find_attributes  # noqa: PLC0415
    from umbra.writers.csv_tables import find_columns  # noqa: PLC0415
    from umbra.writers.vectors.gis_files import write_geotiff  # noqa: PLC0415

    study = job.study
    columns = find_columns(study, ("y", "x"))
    del columns["receiver_z"]
    known = {name: find_attributes(name, 1, study.quantities) for name in columns}
    bands = [
        (name, known[name].get("units") or ("h" if "hours" in name else "1"), array)
        for name, array in columns.items()
        if array.dtype.kind in "fiu"
    ]
    name = "hours.tif" if study.has_hours else "measures.tif"
    write_geotiff(
        job.folder / name, study.x, study.y, bands,
        cell=(study.grid.dx, study.grid.dy), crs=job.crs, facts=study.facts,
    )  # fmt: skip
    return [name]


def _write_geojson(job: Job) -> list[str]:
    from umbra.writers.vectors.gis_files import write_geojson  # noqa: PLC0415

    for layer in job.layers:
        write_geojson(job.folder / f"{layer.name}.geojson", layer, job.crs, job.frame)
    return [f"{layer.name}.geojson" for layer in job.layers]


def _write_geopackage(job: Job) -> list[str]:
    from umbra.writers.vectors.gis_files import write_geopackage  # noqa: PLC0415

    write_geopackage(job.folder / "study.gpkg", job.layers, job.crs)
    return ["study.gpkg"]


def _write_dxf(job: Job) -> list[str]:
    from umbra.writers.vectors.dxf import find_footprints, write_dxf  # noqa: PLC0415
    from umbra.writers.vectors.gis_files import find_crs, name_gis_crs  # noqa: PLC0415

    height = job.study.ground if job.is_on_map else 0.0
    coordinates = job.frame or name_gis_crs(find_crs(job.crs))
    write_dxf(
        job.folder / "study.dxf", job.outlines, job.hour_lines, height=height, seen=job.seen,
        up_hours=job.most_hours, note=f"{job.title}; {coordinates}", show=job.show,
        footprints=find_footprints(job.study) if job.is_on_map else {},
    )  # fmt: skip
    return ["study.dxf"]


def _write_csv(job: Job) -> list[str]:
    import numpy as np  # noqa: PLC0415

    from umbra.writers.csv_tables import (  # noqa: PLC0415
        name_cells,
        write_cells,
        write_instants,
        write_samples,
        write_table,
    )
    from umbra.writers.report.tables import find_sun_areas  # noqa: PLC0415

    if not job.study.kind.is_raster:
        return write_samples(job.folder, job.study)
    study = job.study
    names = [name_cells(study), "instants.csv"]
    size = write_cells(job.folder / names[0], study)
    if names[0].endswith(".gz"):
        packed = (job.folder / names[0]).stat().st_size
        job.say(
            f"note: {names[0]} is packed: {study.shadow_hours.size:,} lines, {size / 1e6:.0f} MB, "
            f"in {packed / 1e6:.0f} MB; gzip -d unpacks it, pandas.read_csv reads it as it is"
        )
    if not study.has_hours:
        return names[:1]
    areas, timeline = None, job.timeline
    if study.kind.is_plan and timeline.strides == (1, 1):
        is_counted = np.ones(timeline.shape, bool)
        if study.kind.lies_under_roofs:
            is_counted = timeline.surface <= FLAT
        rows, cols = timeline.shape
        area = study.grid.dx * study.grid.cols * study.grid.dy * study.grid.rows / (rows * cols)
        areas = [
            float(np.count_nonzero(timeline.masks(k, k + 1)[0] & is_counted) * area)
            for k in range(len(timeline.which))
        ]
    write_instants(job.folder / names[1], study, areas)
    table = find_sun_areas(study)
    if table is not None:
        write_table(job.folder / "areas_by_hours.csv", table.columns, table.rows)
        names.append("areas_by_hours.csv")
    return names


def _write_glb(job: Job) -> list[str]:
    from umbra.study import split_dates, tell_dates  # noqa: PLC0415
    from umbra.writers.glb import write_model_glb  # noqa: PLC0415
    from umbra.writers.surfaces_glb import write_surfaces_glb  # noqa: PLC0415

    write = write_model_glb if job.study.kind.is_plan else write_surfaces_glb
    dates = split_dates(job.study)
    names = (
        [f"hours_{tell_dates(dated)}.glb" for dated in dates] if len(dates) > 1 else ["hours.glb"]
    )
    for name, dated in zip(names, dates, strict=True):
        write(job.folder / name, dated, job.most_hours)
    return names


def _write_tileset(job: Job) -> list[str]:
    from umbra.writers.coloured_tileset import find_tileset_placement, read_place, write_tileset  # noqa: PLC0415

    files = _write_glb(job)
    origin, bounds = read_place(job.folder / files[0])
    placement = find_tileset_placement(origin, job.crs, job.study.site)
    write_tileset(job.folder / "tileset.json", files, bounds, placement, job.study.facts)
    return ["tileset.json", *files]


def _write_geoparquet(job: Job) -> list[str]:
    from umbra.writers.vectors.surface_table import (  # noqa: PLC0415
        find_surface_columns,
        write_surface_table,
    )

    path = job.folder / "surfaces.parquet"
    write_surface_table(path, find_surface_columns(job.study), job.crs, job.study.facts)
    return [path.name]


def _write_cityjson(job: Job) -> list[str]:
    import numpy as np  # noqa: PLC0415

    from umbra.readers.model import UniqueNames  # noqa: PLC0415
    from umbra.writers.cityjson_hours import (  # noqa: PLC0415
        add_hours,
        check_source,
        find_cityjson,
        group_objects,
        name_targets,
    )
    from umbra.writers.vectors.surface_table import find_surface_figures  # noqa: PLC0415

    study = job.study
    samples, scene = study.samples, study.model.scene
    columns = find_surface_figures(study)
    owners = [scene.parts[part] for part in samples.part.tolist()]
    layers = np.array([part.layer for part in owners])
    names = np.array([part.name for part in owners])
    sources = find_cityjson(scene.sources)
    before = {source.layer: UniqueNames() for source in sources}
    written = name_targets(sources)
    for source, name in zip(sources, written, strict=True):
        own = np.flatnonzero(layers == source.layer)
        cut = np.isin(samples.owner, own)
        objects = group_objects(
            names[own], samples.corners[cut] + scene.origin,
            np.searchsorted(own, samples.owner[cut]),
            {name: values[own] for name, values in columns.items()},
        )  # fmt: skip
        notes = add_hours(check_source(source), job.folder / name, objects, before[source.layer])
        for note in notes:
            job.say(f"note: {name}: {note}")
    return written


def _write_solids(job: Job) -> list[str]:
    from umbra.study.preview import find_moments  # noqa: PLC0415
    from umbra.writers.solid_files import EVERY, MOST, write_solids  # noqa: PLC0415

    moments = find_moments(job.study, job.at, every=EVERY, most=MOST)
    if not moments:
        job.say("note: the sun stays below the horizon; there are no solids")
        return []
    if not job.at:
        job.say(f"note: shadow volumes are of {_name_times(moments)}; at= chooses others")
    ground = write_solids(job.folder, job.study, moments, job.cast, job.no_cast)
    job.say(f"note: shadow volumes end on level ground at z = {ground:.6g} m")
    return ["solids.glb", "solids.obj"]


def _write_film(kind: str) -> Callable[[Job], list[str]]:
    def write(job: Job) -> list[str]:
        from umbra.writers import day_film  # noqa: PLC0415

        moments = day_film.find_frames(job.study, job.at)
        n = len(moments)
        if not n:
            job.say(f"note: the sun stays below the horizon; there is no day.{kind}")
            return []

        def draw(moments: "Sequence[Moment]") -> "Iterator[Image]":
            return day_film.draw_frames(job.study, moments, job.title)

        path = job.folder / f"day.{kind}"
        if kind == "gif":
            day_film.write_gif(path, draw(moments), next(draw(moments[n // 2 :][:1])), n)
        else:
            day_film.write_mp4(path, draw(moments), n)
        return [path.name]

    return write


def _name_times(moments: "Sequence[Moment]") -> str:
    """Name the clock times that are shown, in few words."""
    clock = list(dict.fromkeys(f"{moment.local:%H:%M}" for moment in moments))
    if len(clock) <= FEW_TIMES:
        return ", ".join(clock) or "no time, as the sun stays below the horizon"
    return f"{len(clock)} times from {min(clock)} to {max(clock)}"


_POLYGONS: tuple[Any, ...] = ("pyclipr", "shapely")
FORMATS = {
    "geotiff": Format(_write_geotiff, ("rasterio",), "gis", needs_hours=False),
    "geojson": Format(_write_geojson, _POLYGONS, "gis"),
    "gpkg": Format(_write_geopackage, (*_POLYGONS, "pyogrio"), "gis"),
    "dxf": Format(_write_dxf, ("pyclipr", "ezdxf"), "dxf"),
    "csv": Format(_write_csv, needs_hours=False),
    "solids": Format(_write_solids),
    "glb": Format(_write_glb),
    "3dtiles": Format(_write_tileset),
    "geoparquet": Format(_write_geoparquet, ("pyarrow",), "city", needs_hours=False),
    "cityjson": Format(_write_cityjson),
    "gif": Format(_write_film("gif")),
    "mp4": Format(_write_film("mp4"), ("av",), "video"),
}
"""By the names that ``write`` takes."""
