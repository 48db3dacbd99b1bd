"""Drawing plan of one light: ranges of an index list, and how they are counted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.flags import CUT, VolumeSelection
from umbra.gl.projection import CameraProjection
from umbra.gl.volumes import BodyVolumes

__all__ = [
    "LIGHT_CAP", "STENCIL_MOST", "Z_FAIL", "Z_PASS", "Draw", "Statistics", "VolumePlan",
]  # fmt: skip

STENCIL_MOST = 255
"""Counts that 8 bits tell apart from 0."""

Z_PASS, Z_FAIL, LIGHT_CAP = "z_pass", "z_fail", "light_cap"
_KINDS = {
    "sides_z_pass": Z_PASS, "sides_z_fail": Z_FAIL, "dark_cap": Z_FAIL, "light_cap": LIGHT_CAP,
    "coarse_z_pass": Z_PASS, "coarse_z_fail": Z_FAIL, "low": Z_PASS,
}  # fmt: skip


@dataclass(frozen=True)
class Draw:
    """
    Range of the index list to count as ``z_pass``, ``z_fail`` or ``light_cap``.

    Volumes of levels of detail, ``is_coarse``, begin a little behind their casters; those that are
    ``is_low`` begin at the plan's top.
    """

    kind: str
    is_cut: bool
    first: int
    count: int
    is_coarse: bool = False
    is_low: bool = False

    @classmethod
    def of(cls, name: str, is_cut: bool, first: int, count: int) -> "Draw":
        """Return the draw of one of `DRAWS`."""
        return cls(_KINDS[name], is_cut, first, count, name.startswith("coarse"), name == "low")


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """
    Statistics of one light's plan.

    Parameters
    ----------
    shells, culled, cut : int
        Shells that cast; those outside the view; those in view whose volumes end at the floor.
    cases : (int, int, int)
        Shells in view of case 1, 2 and 3.
    sides, sides_z_pass, dark_caps, light_caps : int
        Triangles: all sides, those counted before the visible surface, and caps.
    low : int
        Triangles of volumes that begin low, of all kinds.
    index_bytes : int
        Bytes uploaded to the device.
    deepest : int
        Upper bound of the counts.
    coarse : int
        Triangles of levels of detail, of all kinds.
    moved : float
        How far any corner of these moves at most [m].
    """

    shells: int = 0
    culled: int = 0
    cut: int = 0
    cases: tuple[int, int, int] = (0, 0, 0)
    sides: int
    sides_z_pass: int
    dark_caps: int = 0
    light_caps: int = 0
    low: int = 0
    index_bytes: int
    deepest: int
    coarse: int = 0
    moved: float = 0.0

    @classmethod
    def of(
        cls,
        selection: VolumeSelection,
        shells: int,
        drawn: Mapping[str, int],
        itemsize: int,
        deepest: int,
    ) -> "Statistics":
        """Sum up a selection of ``shells``, and the triangles ``drawn`` of each name of `DRAWS`."""
        seen = len(selection.shells)
        cases = np.bincount(selection.case, minlength=4).tolist() if seen else [0] * 4
        return cls(
            shells=shells,
            culled=shells - seen,
            cut=int(np.count_nonzero(selection.flags & CUT)) if seen else 0,
            cases=(cases[1], cases[2], cases[3]),
            sides=drawn.get("sides_z_pass", 0) + drawn.get("sides_z_fail", 0),
            sides_z_pass=drawn.get("sides_z_pass", 0),
            low=drawn.get("low", 0),
            dark_caps=drawn.get("dark_cap", 0),
            light_caps=drawn.get("light_cap", 0),
            coarse=drawn.get("coarse_z_pass", 0) + drawn.get("coarse_z_fail", 0),
            moved=selection.moved,
            index_bytes=3 * itemsize * sum(drawn.values()),
            deepest=deepest,
        )

    @property
    def counts_in(self) -> str:
        """Where counts are kept: ``stencil``, or ``float`` where more than 255 may overlap."""
        return "stencil" if self.deepest <= STENCIL_MOST else "float"


@dataclass(frozen=True, eq=False)
class VolumePlan:
    """
    One light's volumes, ready to draw.

    Parameters
    ----------
    projection : Projection
    light : (4,) float64
        Relative to the eye.
    bottom : float
        z, relative to the eye, where cut volumes end [m].
    draws : tuple of Draw
    start : int
        Initial count: that of the far ends of rays, in orthographic views, and of the near
        rectangle, where volumes hold all of it.
    case : (n_shells,) int8
        McGuire's; 0 where culled.
    statistics : Statistics
    scissor : (int, int, int, int), optional
        Left, bottom, columns, rows [pixels] of the counted region.
    depth_bounds : (float, float), optional
        Window depths of the counted region.
    selection : VolumeSelection, optional
    top : float
        z, relative to the eye, where low volumes begin [m].
    slack : (float, float)
        By how much the volumes of levels of detail begin behind their casters: [m], and more for
        each metre from the eye.
    volumes : sequence of BodyVolumes
        Those of the casters themselves, not of their levels of detail; made when looked up.
    end : float, optional
        As ``bottom``, of what is counted before the visible surface; ``bottom`` by default.
    """

    projection: CameraProjection
    light: NDArray[np.float64]
    bottom: float
    draws: tuple[Draw, ...]
    start: int
    case: NDArray[np.int8]
    statistics: Statistics
    scissor: tuple[int, int, int, int] | None = None
    depth_bounds: tuple[float, float] | None = None
    selection: VolumeSelection | None = None
    top: float = 0.0
    slack: tuple[float, float] = (0.0, 0.0)
    volumes: Sequence[BodyVolumes] = ()
    end: float | None = None

    def find_bottom(self, draw: Draw) -> float:
        """Return the z, relative to the eye, where a draw's volumes end if they are cut [m]."""
        # A dark cap has to lie behind what is seen, by its depth; levels of detail begin lower.
        if self.end is None or draw.kind != Z_PASS or draw.is_coarse:
            return self.bottom
        return self.end

    def uniforms(self) -> dict[str, object]:
        """Return the uniforms of ``volume.vert.glsl`` shared by all draws."""
        light = self.light.astype(np.float32)
        given = {"light": light, "bottom": self.bottom, "top": self.top}
        return {**self.projection.uniforms, **given}
