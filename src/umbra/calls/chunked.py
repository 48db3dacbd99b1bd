"""A study of Dask arrays, of which only what is asked for is counted."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from umbra.calls.study_result import ShadowStudy
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.study.shadow_study import run
from umbra.sun import Site

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ChunkedStudy", "Chunks"]

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
    def dataset(self) -> "xr.Dataset":
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
