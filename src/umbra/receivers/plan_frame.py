"""The default frame of a plan: the model, its shadows, the ground near buildings, named areas."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.receivers.bands import read_bands
from umbra.receivers.counted import choose_near
from umbra.receivers.layout import Skyline
from umbra.receivers.plan_tiles import PlanModel
from umbra.scene import Scene, Triangles
from umbra.scene.derived import derive

__all__ = ["find_built_bounds", "find_held", "find_skyline", "join_boxes"]


def find_held(
    built: NDArray[np.float64] | None,
    areas: NDArray[np.float64] | None,
    band: Sequence[str],
    *,
    dense: NDArray[np.float64] | None = None,
    ground: NDArray[np.float64] | None = None,
) -> NDArray[np.float64] | None:
    """
    Find the rectangle of all ground that figures are of: near buildings, and named areas.

    Parameters
    ----------
    built : (2, 3) float64, optional
        Bounds of all that receives and is no ground, of a whole model or city [m].
    areas : (2, 2) float64, optional
        Bounds of the named areas [m].
    band : sequence of str
        Bands around the areas, see `read_bands`.
    dense : (2, 2) float64, optional
        Rectangle of the buildings that the plan shows, of a scattered model [m].
    ground : (2, 2) or (2, 3) float64, optional
        Bounds of the ground, if it ends [m].

    Returns
    -------
    held : (2, 2) float64 or None
        Lower left and upper right corner [m].
    """
    boxes = []
    if built is not None:
        near = choose_near(built)
        shown = built[:, :2] if dense is None else np.clip(built[:, :2], *dense)
        box = shown + np.array([[-near], [near]])
        boxes.append(box if ground is None else np.clip(box, *ground[:, :2]))
    if areas is not None:
        reach = max((far for _, far in read_bands(band)), default=0.0)
        boxes.append(areas + np.array([[-reach], [reach]]))
    return join_boxes(boxes)


def join_boxes(boxes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64] | None:
    """Return the bounds (2, n) of several; None of none."""
    if not boxes:
        return None
    both = np.stack(boxes)
    return np.stack([both[:, 0].min(0), both[:, 1].max(0)])


def find_built_bounds(model: PlanModel) -> NDArray[np.float64] | None:
    """Return the bounds of all that receives and is no ground, (2, 3) in own coordinates [m]."""
    scene, soup = model.scene, model.soup

    def find() -> NDArray[np.float64] | None:
        stands = np.array([part.kind not in TERRAIN for part in scene.parts])[soup.part]
        if not stands.any():
            return None
        corners = replace(soup, faces=soup.faces[stands], part=soup.part[stands]).find_corners()
        return np.stack([corners.min(0), corners.max(0)]) + scene.origin

    return derive(soup, "built bounds", None, find)


def find_skyline(
    model: PlanModel, level: float, dense: NDArray[np.float64] | None = None
) -> Skyline:
    """Return the skyline of the visible parts and canopies, or of those in a box (2, 2)."""
    origin = model.scene.origin

    def find() -> Skyline:
        corners = _drop_added(model.scene, model.soup).find_corners() + origin
        if model.canopy is not None:
            crowns = model.scene.triangles(model.canopy.casting)
            corners = np.concatenate([corners, crowns.find_corners() + origin])
        if model.scene.replaced:  # whose shadows are gone after, which the plan shows, too
            whole = model.scene.whole
            old = whole.triangles(range(len(model.scene.parts), len(whole.parts)))
            corners = np.concatenate([corners, old.find_corners() + origin])
        if dense is not None:
            inside = ((corners[:, :2] >= dense[0]) & (corners[:, :2] <= dense[1])).all(1)
            corners = corners[inside] if inside.any() else corners
        return Skyline.of(corners, level)

    return derive(model.soup, "skyline", (model.canopy, level), find)


def _drop_added(scene: Scene, soup: Triangles) -> Triangles:
    """Return the triangles of the model, without a ground that was added to it."""
    own = scene.list_own()
    if own is None:
        return soup
    is_own = np.isin(soup.part, own)
    return replace(soup, faces=soup.faces[is_own], part=soup.part[is_own])
