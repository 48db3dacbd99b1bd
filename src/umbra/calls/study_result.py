"""Result of a study in Python: hours as arrays, pictures, files and verdicts."""

import operator
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from umbra.errors import InputError, find_similar, show_count
from umbra.packages import need
from umbra.registry import take_notes
from umbra.study.area_table import frame_areas
from umbra.study.options import StudyOptions
from umbra.study.result import Study

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from umbra.study.rules import Rules, Verdict
    from umbra.verdicts.judge import Finding

__all__ = ["DrawnSheet", "ShadowStudy"]

_MEANT = {
    **dict.fromkeys(("save", "export", "to_file", "to_folder"), "write(folder)"),
    **dict.fromkeys(("show", "draw", "picture"), "plot()"),
}
"""Methods that other libraries call otherwise."""


class DrawnSheet:
    """
    A picture of a study, as the command writes it; displayed in notebooks.

    Parameters
    ----------
    png : bytes
    """

    def __init__(self, png: bytes) -> None:
        self.png = png

    def _repr_png_(self) -> bytes:
        return self.png

    def save(self, path: str | Path) -> None:
        """Write it as a PNG file; an existing file is replaced."""
        from umbra.folders.atomic import replace_file  # noqa: PLC0415

        with replace_file(path) as beside:
            beside.write_bytes(self.png)


class ShadowStudy:
    """
    A study's result.

    Variables are attributes and items: ``study.shadow_hours`` and ``study["shadow_hours"]``
    are an xarray.DataArray. Methods of xarray.Dataset also work on the result itself,
    ``study.sel(...)``; functions of xarray take ``study.dataset``.

    Parameters
    ----------
    result : Study
        Arrays, and the data of pictures.
    options : StudyOptions
    """

    def __init__(self, result: Study, options: StudyOptions) -> None:
        self.result, self.options = result, options

    @cached_property
    def dataset(self) -> "xr.Dataset":
        """All variables with coordinates, units and attributes, as ``study.nc`` reads back."""
        return self.result.to_dataset()

    @cached_property
    def areas(self) -> "pd.DataFrame":
        """
        Named areas as a pandas frame, a row for each area and date.

        Columns as in ``areas.csv``: ``name``, ``date``, ``area_m2``, ``share_2h`` (a fraction of
        1, of the hours that ``least`` names), hours of sun, ``first_sun`` and ``last_sun`` [UTC].
        Raises InputError without ``areas``.
        """
        return frame_areas(self.result.areas)

    @cached_property
    def windows(self) -> "pd.DataFrame":
        """
        Windows as a pandas frame, a row for each, with the columns of ``windows.csv``.

        Raises InputError if the study is not of windows.
        """
        import pandas as pd  # noqa: PLC0415  (half a second)

        from umbra.receivers.windows import WindowReceivers  # noqa: PLC0415
        from umbra.writers.folder.named_tables import find_window_columns  # noqa: PLC0415

        if not isinstance(self.result.laid, WindowReceivers):
            msg = "the study is not of windows; choose receivers='windows'"
            raise InputError(msg, option="receivers")
        return pd.DataFrame(find_window_columns(self.result))

    def to_xarray(self) -> "xr.Dataset":
        """Return ``dataset``."""
        return self.dataset

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or "options" not in self.__dict__:
            raise AttributeError(name)
        try:
            return getattr(self.dataset, name)
        except AttributeError:
            meant = self._find_meant(name)
            advice = f"did you mean {' or '.join(meant)}?" if meant else "see study.dataset"
            msg = f"a study has no variable or method {name!r}; {advice}"
            raise AttributeError(msg) from None

    def _find_meant(self, name: str) -> list[str]:
        """Return the variables and methods that may be meant by another name."""
        if name in _MEANT:
            return [_MEANT[name]]
        variables = list(self.result.variables())
        ending = [variable for variable in variables if variable.endswith(f"_{name}")]
        return sorted(ending, reverse=True) or find_similar(name, [*variables, *dir(type(self))])

    def __getitem__(self, key: Any) -> Any:
        return self.dataset[key]

    def __contains__(self, key: object) -> bool:
        return key in self.dataset

    def __iter__(self) -> Iterator[Any]:
        return iter(self.dataset)

    def __len__(self) -> int:
        return len(self.dataset)

    def __dir__(self) -> list[str]:
        import xarray as xr  # noqa: PLC0415 - half a second, saved by scripts that only count

        facts = [name for name in self.result.facts if name.isidentifier()]
        dims = [dim for names, _ in self.result.variables().values() for dim in names]
        own = {*super().__dir__(), *self.result.variables(), *facts, *dims}
        own -= {"areas"} if self.result.areas is None else set()
        own -= {"windows"} if self.result.kind.name != "windows" else set()
        return sorted({*own, *(name for name in dir(xr.Dataset) if not name.startswith("_"))})

    def __repr__(self) -> str:
        result = self.result
        days = result.period.days
        dates = f"{days[0]}" if len(days) == 1 else f"{len(days)} dates, {days[0]} to {days[-1]}"
        sizes = " x ".join(f"{size:,}" for size in reversed(result.shadow_hours.shape))
        most = float(np.nanmax(result.shadow_hours, initial=0.0))
        return (
            f"ShadowStudy of {dates}, {show_count(len(result.period.sun.is_up), 'instant')}\n"
            f"receivers {result.receivers!r}, {sizes}; up to {most:.2f} of "
            f"{result.up_hours:.2f} h in shadow\n"
            f"variables: {', '.join(result.variables())}"
        )

    def _repr_html_(self) -> str:
        return str(self.dataset._repr_html_())

    # -- pictures and files ----------------------------------------------------------------

    def plot(self, **picture: Any) -> DrawnSheet:
        """
        Draw the hours, as ``hours.png``; single points on a map.

        Parameters
        ----------
        **picture
            ``show``: 'shadow' (default of one date) or 'sun' (of several); ``title``, ``subtitle``.
        """
        return self._draw("hours", picture)

    def profile(self, **picture: Any) -> DrawnSheet:
        """
        Draw the shadows through the day, as ``profile.png``.

        Parameters
        ----------
        **picture
            As in `plot`, and ``at``: clock times, ``("09:00", "12:00")``.

        Raises
        ------
        InputError
            If the receivers are single points, which have no profile.
        """
        return self._draw("profile", picture)

    def _draw(self, name: str, picture: dict[str, Any]) -> DrawnSheet:
        from umbra.writers.folder import Outputs  # noqa: PLC0415
        from umbra.writers.folder.write import draw_one  # noqa: PLC0415

        return DrawnSheet(draw_one(self.result, name, Outputs(**picture), self.options))

    def report(self, path: str | Path, **picture: Any) -> Path:
        """
        Write the report, a single page with a slider through the day.

        Parameters
        ----------
        path : path
            ``report.html``; an existing file is replaced.
        **picture
            As in `write`, without formats.

        Returns
        -------
        path : Path
        """
        from umbra.folders.atomic import replace_file  # noqa: PLC0415

        with TemporaryDirectory() as folder, replace_file(Path(path)) as beside:
            written = self.write(folder, report=True, **picture)
            page = next(path for path in written if path.name == "report.html")
            beside.write_bytes(page.read_bytes())
        return Path(path)

    def write(
        self,
        folder: str | Path,
        *formats: str,
        report: bool = False,
        sheet: bool = False,
        paper: Literal["a3", "a1"] = "a3",
        logo: Path | None = None,
        pictures: bool = True,
        rules: str | Path | None = None,
        show: Literal["shadow", "sun"] | None = None,
        at: Sequence[str] = (),
        title: str | None = None,
        subtitle: str | None = None,
        context: str | Path | Sequence[str] | None = None,
    ) -> list[Path]:
        """
        Write ``study.nc``, pictures and further files into a folder, as the command does.

        Parameters
        ----------
        folder : path
            Made if missing; earlier results are replaced when the new ones are complete. A
            warning names files of an earlier study that have no successor.
        *formats : str
            ``'geotiff'``, ``'geojson'``, ``'gpkg'``, ``'dxf'``, ``'csv'``, ``'glb'``,
            ``'3dtiles'``, ``'solids'``, ``'geoparquet'``, ``'cityjson'``, ``'gif'``, ``'mp4'``,
            ``'pdf'``, ``'svg'``.
        report : bool
            Also ``report.html``.
        sheet : bool
            Also ``sheet.png``: plan and four elevations.
        paper : {'a3', 'a1'}
        logo : path, optional
            Paper of the sheet, and a PNG for its title block.
        pictures : bool
            ``hours.png``, ``profile.png`` and other maps.
        rules : path, optional
            Also ``verdicts.csv`` by this rule file.
        show : {'shadow', 'sun'}, optional
            Hours that pictures and lines show; by default in shadow of one date, of sun of several.
        at : sequence of str
            Clock times of the profile, films and outlines.
        title, subtitle : str, optional
        context : path or str, optional
            Streets, green and water under plans, drawn and never counted: a file, or patterns of
            the model's parts or kinds.

        Returns
        -------
        paths : list of Path

        Raises
        ------
        InputError
            If a format is unknown, is not for such receivers, or needs a package that is
            not installed; or, when all else is written, if a package's output fails.
        """
        from umbra.writers.folder import Outputs  # noqa: PLC0415
        from umbra.writers.folder.write import note_earlier, raise_failures, write_study  # noqa: PLC0415

        outputs = Outputs(
            formats=formats, report=report, sheet=sheet, paper=paper, logo=logo, pictures=pictures,
            rules=rules, show=show, at=at, title=title, subtitle=subtitle, context=context,
        )  # fmt: skip
        if rules:
            self._tell_panes()
        written, failures = write_study(self.result, folder, outputs, self.options)

        def warn(line: str) -> None:
            warnings.warn(line, stacklevel=4)

        for note in take_notes():
            warnings.warn(note, stacklevel=2)
        note_earlier(written, warn)
        raise_failures(failures, warn)
        return written

    def judge(self, rules: "str | Path | Rules") -> "list[Verdict] | list[Finding]":
        """
        Judge the receivers by rules, each rule on its own dates and hours.

        Parameters
        ----------
        rules : str, path or Rules
            A rule of ``umbra.list_rules``, or a file.

        Returns
        -------
        verdicts : list of Verdict
            Each with ``check``, ``date``, ``where``, ``wanted``, ``measured``, ``passes`` and
            ``evidence``; by a cited rule a list of ``Finding``, with ``where``, ``verdict`` and
            ``outcome``.

        Raises
        ------
        InputError
            If the rules are malformed, or do not apply to such receivers.
        """
        from umbra.rules.read import read_any  # noqa: PLC0415
        from umbra.study.rules import Rules, judge  # noqa: PLC0415

        read = rules if isinstance(rules, Rules) else read_any(rules)
        self._tell_panes()
        if isinstance(read, Rules):
            return judge(self.result, read)
        from umbra.verdicts.study_verdicts import judge_study  # noqa: PLC0415

        (verdict,) = judge_study(self.result, self.options, read)
        return list(verdict.findings)

    def _tell_panes(self) -> None:
        """Warn of rules that judge more of windows than their panes."""
        from umbra.study.remarks import tell_panes  # noqa: PLC0415

        for note in tell_panes(self.result.model.scene, self.options):
            warnings.warn(note, stacklevel=3)

    def to_pyvista(self) -> Any:
        """
        Return the receivers with their hours: a plan as a surface, others as points.

        Returns
        -------
        mesh : pyvista.StructuredGrid or pyvista.PolyData
            In the model's own coordinates [m]; one array per variable.

        Raises
        ------
        InputError
            If PyVista is not installed.
        """
        pyvista = need("pyvista", "", "to_pyvista")
        data = self.dataset
        dims = self.result.dims
        order: Literal["F", "C"] = "F" if self.result.is_plan else "C"
        is_there: Any = slice(None)
        if self.result.is_plan:
            x, y = np.meshgrid(data.x.values, data.y.values)
            mesh = pyvista.StructuredGrid(x, y, data.receiver_z.values)
        else:
            places = data.position.values.reshape(-1, 3)
            is_there = np.isfinite(places).all(1)
            mesh = pyvista.PolyData(places[is_there])
        for name, array in data.data_vars.items():
            if array.dims == dims and name != "receiver_z":
                mesh.point_data[str(name)] = array.values.ravel(order=order)[is_there]
        return mesh


def _forward(name: str) -> Callable[..., Any]:
    """Make a study's operator from a dataset's."""
    own = getattr(operator, name)

    def apply(self: ShadowStudy, *others: Any) -> Any:
        return own(self.dataset, *(getattr(other, "dataset", other) for other in others))

    return apply


for _name in ("add", "sub", "mul", "truediv", "eq", "ne", "lt", "le", "gt", "ge", "neg"):
    setattr(ShadowStudy, f"__{_name}__", _forward(f"__{_name}__"))
ShadowStudy.__hash__ = object.__hash__  # type: ignore[method-assign]
