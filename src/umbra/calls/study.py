"""``umbra.shadow_study``: hours of shadow on a plan, in a view, on surfaces or at points."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol

from umbra.calls.study_result import ShadowStudy
from umbra.errors import InputError, check_type
from umbra.option_fields import option, record
from umbra.registry import take_notes
from umbra.scene import Scene
from umbra.signatures import takes
from umbra.study.land import settle_land
from umbra.study.options import StudyOptions
from umbra.study.remarks import tell_request
from umbra.study.result import Study
from umbra.study.shadow_study import run
from umbra.sun import Site
from umbra.sun.site import tell_moved

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["shadow_study"]

P = ParamSpec("P")

Chunks = int | str | tuple[Any, ...] | Mapping[str, Any]
"""Sides of chunks [cell]: one number, rows and columns, by name, or 'auto'."""


class ChunkedStudy(ShadowStudy):
    """
    A study whose dataset holds Dask arrays.

    Pictures, files and verdicts are of the whole: the first of them counts it in this process.

    Parameters
    ----------
    scene : Scene
    site : Site
    options : StudyOptions
    chunks : Chunks
    """

    def __init__(self, scene: Scene, site: Site, options: StudyOptions, chunks: Chunks) -> None:
        from umbra.study.chunked import make_lazy_dataset  # noqa: PLC0415  (loads Dask)

        self.options = options
        self._scene, self._site = scene, site
        self._lazy = make_lazy_dataset(scene, site, options, chunks)

    @property
    def dataset(self) -> xr.Dataset:
        """All variables with coordinates, units and attributes; nothing is counted yet."""
        return self._lazy

    @cached_property
    def result(self) -> Study:  # type: ignore[override]
        """The whole study, counted in this process on first use."""
        return run(self._scene, self._site, self.options)

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *map(str, self._lazy.variables)})

    def __repr__(self) -> str:
        return f"ShadowStudy in chunks, not counted yet\n{self._lazy!r}"


@record
class ChunkOptions(StudyOptions):
    """Options of a study, and how much of it is counted at once."""

    chunks: Chunks | None = option(
        "any", "Sides of chunks of a plan [cell]: nothing is counted yet, and ``study.dataset`` "
        "holds Dask arrays. Computing a part of them counts its chunks, with the same values, on "
        "the active ``dask.distributed.Client``, else on this machine; each chunk on one thread "
        "unless threads= says otherwise. A client that is active now receives the scene.",
        flag=None,
    )  # fmt: skip


class StudyCall(Protocol[P]):
    """The signature of ``umbra.shadow_study``."""

    def __call__(
        self, scene: Scene, site: Site | None = None, *_: P.args, **options: P.kwargs
    ) -> ShadowStudy: ...


def _take(record: Callable[P, ChunkOptions]) -> Callable[[Any], StudyCall[P]]:
    return takes(record, "a study")


@_take(ChunkOptions)
def shadow_study(scene: Scene, site: Site | None = None, *, options: ChunkOptions) -> ShadowStudy:
    """
    Measure the sun and the sky of every receiver: by default hours over one or more dates.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    site : Site, optional
        Latitude, longitude, time zone and true north; needed by measures of the sun.
    options : ChunkOptions
        Each by its name.

    Returns
    -------
    study : ShadowStudy
        ``study.shadow_hours`` and ``study.sun_hours`` [h] and all other variables of
        ``study.dataset``, which is made on first use; pictures, a report, files
        and verdicts.

    Raises
    ------
    InputError
        If an option is wrong, a pattern matches no part, or the raster is too large.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> site = umbra.find_site(scene)
    >>> study = umbra.shadow_study(scene, site, date="2026-03-21", receivers="top", cell=0.5)
    >>> study.plot()
    >>> study.write("out/", "geotiff", report=True)
    >>> study.sun_hours.sel(x=2705, y=340092, method="nearest")
    """
    check_type("scene", scene, Scene)
    if site is not None:
        check_type("site", site, Site)
    settled = settle_land(options, scene.model_bounds(), site)
    moved = () if site is None else tell_moved(scene, site)
    for note in (*moved, *tell_request(scene, settled, site)):
        warnings.warn(note, stacklevel=3)
    if options.chunks is not None:
        if site is None or options.measures or options.areas is not None:
            msg = (
                "chunks= count hours of sun alone, with a site; leave measure=, areas= or chunks= "
                "out"
            )
            raise InputError(msg, option="chunks")
        return ChunkedStudy(scene, site, settled, options.chunks)
    study = run(scene, site, settled)
    for note in take_notes():
        warnings.warn(note, stacklevel=3)
    if "device_note" in study.facts:
        warnings.warn(str(study.facts["device_note"]), stacklevel=3)
    return ShadowStudy(study, settled)
