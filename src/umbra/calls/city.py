"""``umbra.city_study``: hours of shadow of a city in tiles, in one store on disk."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol

from umbra.errors import InputError, UmbraError, show_count, show_value
from umbra.folders.atomic import replace_file
from umbra.option_fields import Given, again, needed, option, read_names, read_path, record
from umbra.readers import read
from umbra.signatures import takes
from umbra.study.area_table import frame_areas
from umbra.study.options import StudyOptions
from umbra.sun.site import Site, find_site
from umbra.tiles.city_options import CityOptions

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from umbra.rules.record import Rule
    from umbra.tiles.job import CityJob
    from umbra.tiles.run import CityRun, Engine
    from umbra.verdicts import Finding, RuleVerdict

__all__ = ["CityStudy", "city_study", "run_city"]

P = ParamSpec("P")
Files = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]
_SITE, _READING = (
    [
        name
        for name, parameter in inspect.signature(call).parameters.items()
        if parameter.default is not parameter.empty
    ]
    for call in (find_site, read)
)
"""Names of what a site and the reading of files are given."""


@dataclass(frozen=True)
class CityStudy:
    """
    A study in tiles, in its folder.

    Parameters
    ----------
    run : CityRun
    notes : tuple of str
        Losses and assumptions, one line each.
    """

    run: CityRun
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"CityStudy('{self.folder}', {show_count(len(self.job.tiles()), 'tile')})"

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return self.run.folder

    @property
    def job(self) -> CityJob:
        """What was counted."""
        return self.run.job

    @property
    def facts(self) -> Mapping[str, Any]:
        """Attributes of the result."""
        return self.run.facts

    @property
    def dataset(self) -> xr.Dataset:
        """The result as a dataset of the store, whose arrays are read where they are used."""
        return self.run.dataset

    @property
    def areas(self) -> pd.DataFrame:
        """
        Named areas as a pandas frame, as those of ``umbra.shadow_study``.

        Raises InputError without ``areas``.
        """
        return frame_areas(self.run.areas)

    def judge(self, rules: str | os.PathLike[str]) -> list[Finding]:
        """
        Judge the named areas by a rule, on its own dates and hours.

        Parameters
        ----------
        rules : str or path
            A rule of ``umbra.list_rules``, ``NAME:VARIANT``, or a file.

        Returns
        -------
        findings : list of Finding
            Each with ``where``, ``verdict`` and ``outcome``, as those of one study of all files.

        Raises
        ------
        InputError
            If the rule is malformed, or does not judge areas or places.
        """
        from umbra.rules.read import read_any  # noqa: PLC0415
        from umbra.writers.city import check_city_rules  # noqa: PLC0415

        read = check_city_rules(read_any(rules), self.job.options)
        (verdict,) = self.judge_rules([read])
        return list(verdict.findings)

    def judge_rules(self, rules: Sequence[Sequence[Rule]]) -> list[RuleVerdict]:
        """Judge the named areas by rules, given as their variants."""
        from umbra.tiles.city_verdicts import judge_city  # noqa: PLC0415

        return judge_city(self.job, rules)

    def tell_hours(self) -> list[str]:
        """Tell what a proposal takes, the sun of each date, of what area, and each measure."""
        from umbra.writers.city.city_figures import (  # noqa: PLC0415
            find_figures,
            name_taker,
            tell_city_hours,
        )
        from umbra.writers.city.city_measures import tell_city_measures  # noqa: PLC0415

        figures, context = find_figures(self.folder), self.job.open()
        taker = name_taker(context)
        measures = tell_city_measures(figures, self.job.options.quantities, taker)
        return [*tell_city_hours(figures, context), *measures]

    def write_told(
        self,
        verdicts: Sequence[RuleVerdict] = (),
        *,
        report: bool = False,
        spell: Callable[[str], str] = str,
    ) -> list[Path]:
        """
        Write verdicts that were judged, and the report, whose pictures are drawn before.

        ``spell`` writes the names of options in the report as a user types them.
        """
        from umbra.verdicts.judge import spell_out  # noqa: PLC0415
        from umbra.writers.city.city_report import CityTold, write_city_report  # noqa: PLC0415
        from umbra.writers.proof.verdict_files import (  # noqa: PLC0415
            list_verdict_tables,
            write_verdicts,
        )

        written, path = list[Path](), self.folder / "verdicts.csv"
        if verdicts:
            with replace_file(path) as beside:
                write_verdicts(beside, verdicts, str(self.facts.get("time_zone", "UTC")))
            written.append(path)
        if report:
            tables = list_verdict_tables(
                spell_out(verdicts, spell), str(self.facts.get("time_zone", "UTC"))
            )
            told = CityTold(
                self.job, self.facts, self.run.areas, tuple(verdicts), tuple(tables),
                tuple(map(spell, self.notes)),
            )  # fmt: skip
            written.append(write_city_report(self.folder, told))
        return written

    def write(self, *formats: str) -> list[Path]:
        """
        Write further files beside the store, with one tile in memory at a time.

        Named areas are in ``areas.csv``, hours of sun by month of many dates in ``months.csv``.

        Parameters
        ----------
        *formats : str
            Of plans ``'geotiff'``: a GeoTIFF for each tile and ``hours.vrt`` over them; ``'map'``:
            ``map.png``, of several months ``months.png``; ``'stac'``: ``item.json``. Of surfaces
            ``'geoparquet'``: ``surfaces.parquet``, ``'3dtiles'``: ``3dtiles/tileset.json``,
            ``'cityjson'``: the city's CityJSON files with hours. All but the last by default.

        Returns
        -------
        paths : list of Path

        Raises
        ------
        InputError
            If a format is unknown, or needs a package that is not installed, or a run uses the
            folder.
        """
        from umbra.tiles.run import lock_run  # noqa: PLC0415
        from umbra.writers.city import write_city_files, write_city_months  # noqa: PLC0415
        from umbra.writers.folder.named_tables import write_area_table  # noqa: PLC0415

        with lock_run(self.folder):
            tables = write_area_table(self.folder, self.run.areas)
            months = write_city_months(self.folder)
            written = write_city_files(self.folder, formats)
            return [*(self.folder / name for name in tables), *months, *written]


@record
class RunOptions(CityOptions):
    """Options of ``umbra.city_study``, besides those of any study."""

    out: str | os.PathLike[str] = needed(
        "path", "Folder of the results: ``study.zarr``, and what a later run needs.", flag=None
    )
    tiles: Given[str | float, Any] = again(CityOptions, "tiles", default="1km")
    reading: Mapping[str, Any] | None = option("any", "Options of ``umbra.read``.", flag=None)
    engine: Engine | None = option(
        "any", "Counts the tiles elsewhere, such as ``umbra.tiles.cluster.ClusterEngine(client)``; "
        "one after the other in this process by default.", flag=None,
    )  # fmt: skip
    progress: Callable[[int, int], object] = option(
        "any", "Called with the number of tiles done and of all.", flag=None,
        default=lambda _done, _all: None,
    )  # fmt: skip


@record
class _Asked(RunOptions, StudyOptions):
    """For type checkers: all that the call takes."""


class CityCall(Protocol[P]):
    """The signature of ``umbra.city_study``."""

    def __call__(
        self, files: Files, site: Site | Mapping[str, Any] | None = None, *_: P.args,
        **options: P.kwargs,
    ) -> CityStudy: ...  # fmt: skip


def _take(_record: Callable[P, _Asked]) -> Callable[[Any], CityCall[P]]:
    return takes(RunOptions, "a study", study=StudyOptions)


@_take(_Asked)
def city_study(
    files: Files,
    site: Site | Mapping[str, Any] | None = None,
    *,
    options: RunOptions,
    study: StudyOptions,
) -> CityStudy:
    """
    Count the hours of shadow of a city of any size, in tiles, into a Zarr store.

    Results do not depend on the tiles, and are those of ``umbra.shadow_study`` of all files. A run
    that was ended goes on where it stopped when it is called again.

    Parameters
    ----------
    files : str or path, or a sequence of them
        Files that ``umbra.read`` reads, folders of them, and patterns such as ``"lod2/*.gml"``; all
        in one coordinate reference system. ``"proposed=tower.glb"`` names a layer.
    site : Site, or dict, optional
        Or some of ``latitude``, ``longitude``, ``zone`` and ``true_north``, which override the
        files'; by default the middle of the files.
    options : RunOptions
        Each by its name.
    **options
        ``date`` and further options of ``umbra.shadow_study``; ``cell`` is 1 m by default.

    Returns
    -------
    study : CityStudy
        ``study.dataset`` opens the store with xarray.

    Raises
    ------
    InputError
        If an option is wrong, a file cannot be read, files are in different coordinate reference
        systems, or the folder holds another study or is in use.
    UmbraError
        If tiles failed; all others are done then.

    Examples
    --------
    >>> city = umbra.city_study("lod2/*.gml", out="city/", date="2026-12-21", receivers="top")
    >>> city.dataset.sun_hours.sel(x=691000, y=5335000, method="nearest").compute()
    """
    if options.tiles is None:
        msg = "tiles= is the side of a tile, such as '1km'; a study in tiles needs it"
        raise InputError(msg, option="tiles")
    if not isinstance(site, Site):
        site = read_names("site", {} if site is None else site, _SITE)
    reading = read_names("reading", {} if options.reading is None else options.reading, _READING)
    for name in ("progress", "engine"):
        call = getattr(options, name)
        if call is not None and not callable(call):
            msg = f"{name} is a function; got {show_value(call)}"
            raise InputError(msg, option=name)
    folder = read_path("out", options.out)
    return run_city(
        _read_files(files), site, study, options, folder, reading, options.engine,
        options.progress,
    )  # fmt: skip


def _read_files(files: Any) -> list[str | os.PathLike[str]]:
    """Return one path or several as a list; what is among them tells where it is not there."""
    try:
        given = [files] if isinstance(files, (str, os.PathLike)) else list(files)
    except TypeError:
        given = [files]
    for path in given:
        read_path("files", path)
    return given


def run_city(
    files: Sequence[str | os.PathLike[str]],
    site: Site | Mapping[str, Any] | None,
    options: StudyOptions,
    city: CityOptions,
    folder: Path,
    reading: Mapping[str, Any] | None = None,
    engine: Engine | None = None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
    reads: Callable[[int, int], object] = lambda _done, _all: None,
    write: Callable[[CityStudy], object] = lambda _study: None,
) -> CityStudy:
    """
    Run a study in tiles from its records.

    ``reads`` is called with the number of files read, ``write`` with the complete study, while no
    other run may use its folder.
    """
    from umbra.folders.atomic import is_full  # noqa: PLC0415
    from umbra.tiles.cluster import open_engine  # noqa: PLC0415
    from umbra.tiles.prepare import prepare_city  # noqa: PLC0415
    from umbra.tiles.run import lock_run, run_job  # noqa: PLC0415
    from umbra.tiles.store import check_folder, check_zarr  # noqa: PLC0415

    check_zarr()
    check_folder(folder)
    said: list[str] = []
    try:
        with lock_run(folder, said.append), open_engine(city.workers, city.scheduler) as own:
            prepared = prepare_city(files, site, options, city, folder, reading, reads)
            run = run_job(prepared.job, prepared.describe, engine or own, progress)
            assumed = [str(run.facts["assumption"])] if "assumption" in run.facts else []
            cut = _tell_cut(run)
            areas = () if run.areas is None else run.areas.notes
            study = CityStudy(run, (*said, *prepared.notes, *assumed, *cut, *run.notes, *areas))
            write(study)
            return study
    except OSError as error:
        if not is_full(error):
            raise
        msg = (
            f"could not write the tiles to '{folder}' (no space left on device); free some space "
            "and run the same study again: tiles that are done are kept"
        )
        raise UmbraError(msg, path=folder) from error


def _tell_cut(run: CityRun) -> list[str]:
    """Report shadows that run on beyond a plan whose extent was not stated."""
    from umbra.study.remarks import tell_long_shadows  # noqa: PLC0415
    from umbra.writers.city.store_window import CityResult  # noqa: PLC0415

    options = run.job.options
    is_open = options.kind.is_plan and options.extent is None and not run.job.frame.has_end
    if not is_open or not options.asks_hours:
        return []
    return tell_long_shadows(CityResult(run.folder).find_sides())
