"""What stands on a plot, and would make way for what is built there."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.scene import Scene

__all__ = ["find_on_plot"]

_MOST = 0.5  # share of an object's plan from which it stands on the plot
_LEAST = 0.01  # share from which it reaches over the plot


def find_on_plot(scene: Scene, outline: Any) -> tuple[list[int], list[str]]:
    """
    Find the parts of objects that stand on a plot.

    Parameters
    ----------
    scene : Scene
    outline : shapely geometry
        The plot, in the model's own coordinates [m].

    Returns
    -------
    parts : list of int
        Indices of parts of objects that lie on it with half of their plan at least.
    others : list of str
        Names of objects that reach over its boundary with less.
    """
    import shapely  # noqa: PLC0415  (an extra, which the plot needed)

    standing = [k for k, part in enumerate(scene.parts) if part.kind not in TERRAIN]
    low, high = np.array(shapely.bounds(outline)).reshape(2, 2) - scene.origin[:2]
    near = [k for k in standing if _overlaps(scene.parts[k].bounds, low, high)]
    if not near:
        return [], []
    groups = scene.groups()
    near = [k for k in standing if groups[k] in {groups[n] for n in near}]
    soup = scene.triangles(near)
    corners = soup.vertices[soup.faces][..., :2]
    (x1, y1), (x2, y2) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    area = np.abs(x1 * y2 - x2 * y1)
    triangles = shapely.polygons(corners + scene.origin[:2])
    shapely.prepare(outline)
    inside = np.zeros(len(triangles))
    whole = shapely.covers(outline, triangles)
    some = ~whole & shapely.intersects(outline, triangles) & (area > 0)
    inside[whole] = area[whole]
    inside[some] = 2 * shapely.area(shapely.intersection(triangles[some], outline))
    owner = groups[soup.part]
    count = int(groups.max()) + 1
    total = np.bincount(owner, area, count)
    share = np.bincount(owner, inside, count) / np.where(total > 0, total, 1.0)
    labels = scene.labels()
    on_plot = [k for k in near if share[groups[k]] >= _MOST]
    others = [labels[k] for k in near if _LEAST <= share[groups[k]] < _MOST]
    return on_plot, list(dict.fromkeys(others))


def _overlaps(
    box: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> bool:
    return bool((box[0, :2] <= high).all() and (box[1, :2] >= low).all())
