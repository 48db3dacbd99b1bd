"""
Faces to draw of each shadow volume, and how to count them, for all lights of a frame.

McGuire's cases, culling and cuts; ``auto`` also counts by z-pass what holds the near rectangle.
One kernel classifies every shell under every light by its bounds; only undecided shells are then
classified by their triangles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.gl.flags import COARSE, CUT, DARK_CAP, FAN, LIGHT_CAPS, SIDES, Z_FAILS, VolumeSelection
from umbra.gl.levels import LevelTable, choose_levels
from umbra.gl.lists import is_level
from umbra.gl.near_counts import NearCounts, ask_shell
from umbra.gl.projection import CameraProjection, Rectangle, find_pixel
from umbra.gl.volumes import BodyVolumes
from umbra.kernels import kernel
from umbra.volume.bounds import can_box_end, find_box_parts, find_far_plane, is_beyond_any
from umbra.volume.box_tree import BoxTree
from umbra.volume.placement import place_box
from umbra.volume.regions import (
    Regions,
    find_many_regions,
    find_view_planes,
)
from umbra.volume.scissor import find_cone_planes

if TYPE_CHECKING:
    from umbra.gl.request import LightShape

__all__ = ["FoundLights", "VolumeOptions", "select_lights"]

MARGIN = 1e-5
"""By how much the occlusion pyramid is widened, since the device computes in float32."""

_FACES_ASKED = 50_000  # per light; for the rest, the bounds' answer is right but not minimal

_NOT_FAILS = ~(Z_FAILS | DARK_CAP | LIGHT_CAPS)
_AUTO, _PASS, _FAIL = range(3)


@dataclass(frozen=True, kw_only=True)
class VolumeOptions:
    """
    Permitted simplifications; none but ``detail`` changes a count where the light shines.

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
    detail : float
        By how many pixels shadows may be off, cast from coarser meshes (``umbra.gl.levels``);
        0: none are. This alone changes counts where the light shines.
    shorten : bool
        Begin the volumes of isolated convex casters just above what they fall on
        (``umbra.gl.casting_scene``): their faces turned from the light then count 0.
    """

    cull: bool = True
    cut: bool = True
    fans: bool = True
    ask_triangles: bool = True
    narrow: bool = True
    detail: float = 0.0
    shorten: bool = False

    def keep_exact(self) -> "VolumeOptions":
        """Leave out what changes counts."""
        return replace(self, detail=0.0, shorten=False)


@dataclass(frozen=True, eq=False)
class FoundLights:
    """
    Where the lights of a frame stand, and what they can reach.

    Parameters
    ----------
    sources : (n, 4) float64
        Relative to the scene's origin; a direction has length 1.
    reaches : (n,) float64
        Ranges [m].
    cones : sequence of (k, 4) float64 or None
        Inward planes around each cone.
    scissors : sequence of Rectangle or None
        Pixels that each light can change; None: all.
    """

    sources: NDArray[np.float64]
    reaches: NDArray[np.float64]
    cones: Sequence[NDArray[np.float64] | None]
    scissors: Sequence[Rectangle | None]

    @classmethod
    def of_one(
        cls, source: NDArray[np.float64], reach: float, scissor: Rectangle | None
    ) -> "FoundLights":
        """Return a single light without a cone."""
        return cls(source[None], np.array([reach]), (None,), (scissor,))

    @classmethod
    def of(
        cls,
        lights: "Sequence[LightShape]",
        sources: NDArray[np.float64],
        ranges: Sequence[tuple[Rectangle | None, tuple[float, float] | None]],
        choices: VolumeOptions,
    ) -> "FoundLights":
        """Find what lights can reach, by their ranges and cones if that is permitted."""
        reaches = np.full(len(lights), np.inf)
        cones: list[NDArray[np.float64] | None] = [None] * len(lights)
        if choices.narrow:
            reaches[:] = [light.range for light in lights]
            cones = [
                None
                if light.axis is None
                else find_cone_planes(source[:3], light.axis, light.half_angle)
                for light, source in zip(lights, sources, strict=True)
            ]
        return cls(sources, reaches, cones, [corners for corners, _ in ranges])


def select_lights(
    volumes: Sequence[Sequence[BodyVolumes]],
    tree: BoxTree,
    projection: CameraProjection,
    origin: NDArray[np.float64],
    lights: FoundLights,
    *,
    method: str,
    choices: VolumeOptions,
    floor: float,
    levels: LevelTable | None = None,
    ground: float | None = None,
) -> list[VolumeSelection]:
    """
    Select the faces to draw for each light.

    Parameters
    ----------
    volumes : sequence of sequences of BodyVolumes
        Of each light and body; only undecided ones are looked at.
    tree : BoxTree
        Bounds of all bodies' shells, relative to the scene's origin [m].
    projection : Projection
    origin : (3,) float64
        Origin of the scene.
    lights : FoundLights
    method : str
        ``auto``, ``mcguire``, ``lengyel``, ``z-pass`` or ``z-fail``.
    choices : VolumeOptions
    floor : float
        z below every receiver, relative to the origin [m].
    levels : LevelTable, optional
        Of the shells; ``choices.detail`` says which are chosen.
    ground : float, optional
        z of a receiving plane, relative to the origin [m].
    """
    n, sources = len(lights.sources), lights.sources
    camera = projection.camera
    whole = np.array([0, 0, *camera.size])
    scissors = np.array([whole if scissor is None else scissor for scissor in lights.scissors])
    scissors = scissors.reshape(-1, 4)
    # z-pass looks from the near rectangle: it must not look through a cut volume's bottom.
    end = floor if choices.cut and projection.lowest > floor else None
    _, views, _ = find_many_regions(camera, origin, sources, scissors)
    is_shown = np.any(views != 0.0, axis=(1, 2))
    far = np.zeros((n, 1, 4))
    far[is_shown] = find_far_plane(camera, find_view_planes(camera, origin))
    if choices.cull:
        is_seen = tree.find_seen(
            sources, np.concatenate([views, far], 1), floor=end, reaches=lights.reaches,
            cones=lights.cones,
        )  # fmt: skip
    else:
        is_seen = np.repeat(is_shown[:, None], len(tree.bounds), 1)
    pyramids, clipped, rectangles = find_many_regions(
        projection.clipping, origin, sources, scissors, MARGIN
    )
    shape = (n, len(tree.bounds))
    flags, case = np.zeros(shape, np.uint8), np.zeros(shape, np.int8)
    is_coarse = np.zeros(shape[1], np.bool_) if levels is None else levels.is_coarse
    undecided = np.zeros(shape, np.bool_)
    _select(
        tree.bounds, is_seen, sources, (pyramids, clipped, views, far), lights.reaches,
        is_coarse, np.nan if end is None else end,
        {"z-pass": _PASS, "z-fail": _FAIL}.get(method, _AUTO),
        (method in ("auto", "mcguire"), choices.cull, choices.fans, camera.is_perspective),
        flags, case, undecided,
    )  # fmt: skip
    moved = 0.0
    if levels is not None:
        # A light in the ground's plane has sides there: they are told from the ground as they are.
        detail = np.where(
            [is_level(source, ground) for source in sources], -1.0, choices.detail or -1
        )
        moved = choose_levels(
            tree.bounds, sources, lights.reaches, np.nan if end is None else end,
            camera.eye - origin, find_pixel(camera), detail, levels.chain, levels.moves,
            flags, case, undecided,
        )  # fmt: skip
    starts, slacks = [0] * n, MARGIN * np.abs(rectangles).max((1, 2))
    if choices.ask_triangles and method != "z-fail":
        for k in np.flatnonzero(undecided.any(1)).tolist():
            regions = Regions(pyramids[k], clipped[k], sources[k])
            near = NearCounts(rectangles[k]) if method == "auto" else None
            starts[k] = _ask_triangles(
                volumes[k], np.flatnonzero(undecided[k]), regions, near, slacks[k],
                method == "lengyel", flags[k], case[k],
            )  # fmt: skip
    return [VolumeSelection(*arrays, moved) for arrays in zip(flags, case, starts, strict=True)]


@kernel
def _select(
    bounds,
    is_seen,
    lights,
    regions,
    reaches,
    is_coarse,
    floor,
    method,
    rules,
    flags,
    case,
    undecided,
):
    """Write flags, cases, and where bounds leave the case undecided, of the found shells."""
    pyramids, clipped, views, far = regions
    drops_caps, culls, fans, is_perspective = rules
    scratch = np.zeros((40, 4))
    for k in range(lights.shape[0]):
        light = lights[k]
        for i in range(bounds.shape[0]):
            if not is_seen[k, i]:
                continue
            box = bounds[i]
            bits = SIDES | COARSE | LIGHT_CAPS if is_coarse[i] else SIDES
            if not np.isnan(floor) and can_box_end(box, light):
                bits |= CUT
            if method != _FAIL and is_beyond_any(pyramids[k], box):
                case[k, i], flags[k, i] = 1, bits  # as nearly all are
                continue
            case[k, i], undecided[k, i], needs_cap, _, is_fan = place_box(
                box, pyramids[k], clipped[k], light, True
            )
            is_fan &= fans
            bits |= FAN if is_fan else np.uint8(0)
            if method == _FAIL or (method == _AUTO and case[k, i] > 1):
                light_cap = dark_cap = True
                if culls:
                    _, light_cap, dark_cap = find_box_parts(
                        box, light, views[k], far[k], floor, reaches[k], scratch
                    )
                # At infinity a directional light's volumes end in one point, and so do
                # parallel rays.
                can_close = bool(bits & CUT) or (light[3] != 0.0 and is_perspective)
                bits |= Z_FAILS
                if can_close and (dark_cap or not is_fan):
                    bits |= DARK_CAP
                if light_cap and (needs_cap or not drops_caps):
                    bits |= LIGHT_CAPS
            flags[k, i] = bits


def _ask_triangles(
    volumes: Sequence[BodyVolumes],
    shells: NDArray[np.intp],
    regions: Regions,
    near: NearCounts | None,
    slack: float,
    keeps_cap: bool,
    flags: NDArray[np.uint8],
    case: NDArray[np.int8],
) -> int:
    """
    Classify the shells that bounds left undecided by their triangles, up to a limit.

    Returns the count at the near rectangle of those that hold all of it, and are counted by z-pass
    from there; with ``near`` None there are none.
    """
    left, index, first, start = _FACES_ASKED, 0, 0, 0
    for number in shells.tolist():
        body_volumes = volumes[index]
        while number >= first + len(body_volumes.shells):
            first, index = first + len(body_volumes.shells), index + 1
            body_volumes = volumes[index]
        body = body_volumes.body
        instance, shell = divmod(number - first, body.n_shells)
        is_coarse = bool(flags[number] & COARSE)
        left -= int(body.face_starts[shell + 1] - body.face_starts[shell])
        if left < 0:
            break
        local = regions if body.is_still else regions.within(body.transforms[instance])
        faces = body.faces[body.face_starts[shell] : body.face_starts[shell + 1]]
        edges = body.edge_starts[shell], body.edge_starts[shell + 1]
        blocks, is_seen, is_apart = ask_shell(
            body_volumes.list_arrays(instance), faces, edges, body_volumes.is_closed[instance],
            body_volumes.lights[instance], local.pyramid, local.view, slack,
        )  # fmt: skip
        needs_cap = case[number] == 3 and is_seen
        case[number] = 1 if not blocks else 3 if needs_cap else 2
        count = 0 if not blocks else None
        if is_apart and near is not None and not is_coarse and flags[number] & Z_FAILS:
            count = near.find(body_volumes, instance, shell)
        if count is not None:
            flags[number] &= _NOT_FAILS | (LIGHT_CAPS if is_coarse else 0)
            start += count
        elif not needs_cap and not keeps_cap and not is_coarse:
            flags[number] &= ~LIGHT_CAPS
    return start
