"""The default frame of a plan: the model, its shadows, the ground near buildings, named areas."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.receivers.bands import read_bands
from umbra.receivers.counted import choose_near
from umbra.receivers.layout import Skyline
from umbra.receivers.plan_tiles import PlanModel
from umbra.scene import Scene, Triangles
from umbra.scene.derived import derive

__all__ = ["find_built_bounds", "find_held", "find_skyline", "join_boxes", "spread_near"]


def find_held(
    model: PlanModel, options: Any, dense: NDArray[np.float64] | None, *, is_bounded: bool
) -> NDArray[np.float64] | None:
    """
    Find the rectangle of all ground that figures are of: near buildings, and named areas.

    Parameters
    ----------
    model : PlanModel
    options : StudyOptions
    dense : (2, 2) float64, optional
        Rectangle of the buildings that the plan shows, of a scattered model [m].
    is_bounded : bool
        Whether nothing receives beyond the model.

    Returns
    -------
    held : (2, 2) float64 or None
        Lower left and upper right corner, in the model's own coordinates [m].
    """
    bounds, scene = find_built_bounds(model), model.scene
    boxes = []
    if bounds is not None:
        shown = bounds[:, :2] if dense is None else np.clip(bounds[:, :2], *dense)
        ground = scene.model_bounds()[:, :2] if is_bounded else None
        boxes.append(spread_near(shown, choose_near(*bounds), ground))
    if options.areas is not None:
        boxes.append(find_area_box(scene, options))
    return join_boxes(boxes)


def spread_near(
    built: NDArray[np.float64], near: float, ground: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """
    Return the bounds (2, 2) of the ground near buildings [m].

    Parameters
    ----------
    built : (2, 2) float64
        Bounds of the buildings' plans.
    near : float
        See `choose_near`.
    ground : (2, 2) float64, optional
        Bounds of the ground, if it ends.
    """
    box = built + np.array([[-near], [near]])
    return box if ground is None else np.clip(box, *ground)


def find_area_box(scene: Scene, options: Any) -> NDArray[np.float64]:
    """Return the bounds (2, 2) of named areas, or of their bands, in own coordinates [m]."""
    from umbra.receivers.area_search import bound_areas  # noqa: PLC0415  (readers of areas)

    reach = max((far for _, far in read_bands(options.band)), default=0.0)
    return bound_areas(scene, options.areas) + np.array([[-reach], [reach]])


def join_boxes(boxes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64] | None:
    """Return the bounds (2, n) of several; None of none."""
    if not boxes:
        return None
    both = np.stack(boxes)
    return np.stack([both[:, 0].min(0), both[:, 1].max(0)])


def find_built_bounds(model: PlanModel) -> NDArray[np.float64] | None:
    """Return the bounds (2, 3) of all that is no ground, in own coordinates [m]; None if none."""
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
