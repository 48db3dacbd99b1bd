"""
Drawing plan of one light: the faces drawn of each volume, and how they are counted.

McGuire's cases, culling and cuts. All components of a scene are classified at once by
their bounds; only undecided ones are then classified by their triangles.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from umbra.gl.projection import Projection
from umbra.gl.volumes import BodyVolumes
from umbra.volume.bounds import can_end_at_floor, find_visible_parts
from umbra.volume.box_tree import BoxTree
from umbra.volume.placement import CastingFaces, Placements, any_meets, find_placements
from umbra.volume.regions import Regions, make_regions

__all__ = [
    "LIGHT_CAP",
    "STENCIL_MOST",
    "Z_FAIL",
    "Z_PASS",
    "Draw",
    "Selection",
    "Statistics",
    "VolumeOptions",
    "VolumePlan",
    "select",
]

STENCIL_MOST = 255
"""Counts that 8 bits tell apart from 0."""

MARGIN = 1e-5
"""By how much the occlusion pyramid is widened, since the device computes in float32."""

_FACES_ASKED = 50_000  # per light; for the rest, the bounds' answer is right but not minimal


@dataclass(frozen=True, kw_only=True)
class VolumeOptions:
    """
    Permitted simplifications; none changes a count where the light shines.

    Parameters
    ----------
    cull : bool
        Leave out volumes and caps outside the view.
    cut : bool
        End volumes below all receivers.
    fans : bool
        Close far ends by fans over silhouettes, where valid, rather than by projecting
        all casting faces.
    ask_triangles : bool
        Use triangles to decide the case where bounds cannot.
    narrow : bool
        Count only within the scissor and depth bounds of the light's range and cone.
        Counts elsewhere are undefined, for the light does not shine there.
    """

    cull: bool = True
    cut: bool = True
    fans: bool = True
    ask_triangles: bool = True
    narrow: bool = True


@dataclass(frozen=True, eq=False)
class Selection:
    """
    Faces to draw of each shell's volume.

    Parameters
    ----------
    case : (n_shells,) int8
        McGuire's; 0 where culled.
    sides, dark_cap, light_cap : (n_shells,) bool
    z_fail : (n_shells,) bool
        Count behind the visible surface rather than in front of it.
    is_cut : (n_shells,) bool
        End at the floor rather than at infinity.
    is_fan : (n_shells,) bool
        A fan over the silhouette closes the far end.
    """

    case: NDArray[np.int8]
    sides: NDArray[np.bool_]
    dark_cap: NDArray[np.bool_]
    light_cap: NDArray[np.bool_]
    z_fail: NDArray[np.bool_]
    is_cut: NDArray[np.bool_]
    is_fan: NDArray[np.bool_]


def select(
    volumes: list[BodyVolumes],
    tree: BoxTree,
    projection: Projection,
    origin: NDArray[np.float64],
    source: NDArray[np.float64],
    *,
    method: str,
    choices: VolumeOptions,
    floor: float,
    reach: float = np.inf,
    cone: NDArray[np.float64] | None = None,
    scissor: NDArray[np.int64] | None = None,
) -> Selection:
    """
    Select the faces to draw for a light.

    Parameters
    ----------
    volumes : list of BodyVolumes
    tree : BoxTree
        Tree of the shells' boxes (n_shells, 2, 3), relative to the origin [m].
    projection : Projection
        Cases refer to the near rectangle at which it clips volumes.
    origin : (3,) float64
    source : (4,) float64
        The light, relative to the origin.
    method : str
        One of ``Methods.volumes``.
    choices : VolumeOptions
    floor : float
        z, relative to the origin, where volumes may end; below every receiver [m].
    reach : float
        The light's range [m].
    cone : (n, 4) float64, optional
        Inward planes around the light's cone.
    scissor : (4,) int, optional
        Left, top, right, bottom [pixels] of the region to count in.

    Returns
    -------
    selection : Selection
    """
    n, camera, clipping = len(tree.bounds), projection.camera, projection.clipping
    nothing = np.zeros(n, np.bool_)
    none = Selection(nothing.view(np.int8), *[nothing] * 6)
    if scissor is not None and not (scissor[2:] > scissor[:2]).all():
        return none
    # z-pass looks from the near rectangle: it must not look through a cut volume's bottom.
    may_cut = choices.cut and projection.lowest > floor
    end = floor if may_cut else None
    sides = np.ones(n, np.bool_)
    if choices.cull:
        sides = tree.find_seen(
            source, camera, origin, scissor=scissor, floor=end, reach=reach, cone=cone
        )
    seen = np.flatnonzero(sides)
    if not len(seen):
        return none
    # From here on, visible shells only.
    bounds = tree.bounds[seen]
    is_cut = can_end_at_floor(bounds, source) if may_cut else nothing[seen]
    regions = make_regions(clipping, source, origin, scissor, margin=MARGIN)
    placements = find_placements(bounds, regions)
    case, needs_cap = placements.case, placements.needs_light_cap
    if choices.ask_triangles and method != "z-fail":
        _ask_triangles(volumes, seen, placements, regions)
    fails = {"z-pass": nothing[seen], "z-fail": ~nothing[seen]}.get(method, case > 1)
    is_fan = placements.dark_cap_is_fan & choices.fans
    light_cap, dark_cap = fails.copy(), fails.copy()
    if choices.cull and fails.any():
        parts = find_visible_parts(
            bounds[fails], source, camera, origin, scissor=scissor, floor=end, reach=reach
        )
        light_cap[fails] = parts.light_cap
        dark_cap[fails] = parts.dark_cap
    dark_cap |= fails & ~is_fan
    # At infinity a directional light's volumes end in one point, and so do parallel rays.
    dark_cap &= is_cut | (bool(source[3]) and camera.is_perspective)
    if method in ("auto", "mcguire"):
        light_cap &= needs_cap
    whole = [_spread(sides, part) for part in (dark_cap, light_cap, fails, is_cut, is_fan)]
    return Selection(_spread(sides, case), sides, *whole)


def _spread(chosen: NDArray[np.bool_], values: NDArray) -> NDArray:
    """Scatter the values of chosen elements into an array of 0."""
    whole = np.zeros(len(chosen), values.dtype)
    whole[chosen] = values
    return whole


def _ask_triangles(
    volumes: list[BodyVolumes], seen: NDArray[np.intp], placements: Placements, regions: Regions
) -> None:
    """Classify the shells that bounds left undecided by their triangles, up to a limit."""
    left = _FACES_ASKED
    for place in np.flatnonzero(placements.undecided).tolist():
        each, instance, shell = _find(volumes, int(seen[place]))
        body = each.body
        left -= int(body.face_starts[shell + 1] - body.face_starts[shell])
        if left < 0:
            break
        mine = regions if body.is_still else regions.within(body.transforms[instance])
        faces = body.caster.faces[each.casting(instance, shell)]
        casting = CastingFaces(None, mine.light)
        blocks = any_meets(body.caster.vertices, faces, mine.pyramid, casting)
        is_seen = placements.needs_light_cap[place] and blocks
        is_seen = is_seen and any_meets(body.caster.vertices, faces, mine.view, casting)
        placements.case[place] = 1 if not blocks else 3 if is_seen else 2
        placements.needs_light_cap[place] = is_seen


def _find(volumes: list[BodyVolumes], number: int) -> tuple[BodyVolumes, int, int]:
    """Return the volumes, the instance and the shell of a number among all shells."""
    for each in volumes:
        n = each.body.n_shells * len(each.body.groups)
        if number < n:
            return each, *divmod(number, each.body.n_shells)
        number -= n
    raise IndexError(number)


Z_PASS, Z_FAIL, LIGHT_CAP = "z_pass", "z_fail", "light_cap"


@dataclass(frozen=True)
class Draw:
    """Range of the index list to count as ``z_pass``, ``z_fail`` or ``light_cap``."""

    kind: str
    is_cut: bool
    first: int
    count: int


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
    index_bytes : int
        Bytes uploaded to the device.
    deepest : int
        Upper bound of the counts.
    """

    shells: int = 0
    culled: int = 0
    cut: int = 0
    cases: tuple[int, int, int] = (0, 0, 0)
    sides: int
    sides_z_pass: int
    dark_caps: int = 0
    light_caps: int = 0
    index_bytes: int
    deepest: int

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
        Initial count: that of the far ends of rays, in orthographic views.
    case : (n_shells,) int8
        McGuire's; 0 where culled.
    statistics : Statistics
    scissor : (int, int, int, int), optional
        Left, bottom, columns, rows [pixels] of the counted region.
    depth_bounds : (float, float), optional
        Window depths of the counted region.
    selection : Selection, optional
    volumes : tuple of BodyVolumes
        Volumes from which the draws were selected.
    """

    projection: Projection
    light: NDArray[np.float64]
    bottom: float
    draws: tuple[Draw, ...]
    start: int
    case: NDArray[np.int8]
    statistics: Statistics
    scissor: tuple[int, int, int, int] | None = None
    depth_bounds: tuple[float, float] | None = None
    selection: Selection | None = None
    volumes: tuple[BodyVolumes, ...] = ()

    def uniforms(self) -> dict[str, object]:
        """Return the uniforms of ``volume.vert.glsl`` shared by all draws."""
        light = self.light.astype(np.float32)
        return {**self.projection.uniforms(), "light": light, "bottom": self.bottom}
