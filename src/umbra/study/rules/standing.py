"""What stands at a place that a rule names: a place inside a building has no sun."""

import numpy as np

from umbra.study import Study

__all__ = ["find_standing"]

_SLACK = 1e-6  # what lies in the ground itself stands on no one [m]


def find_standing(study: Study, x: float, y: float) -> str:
    """
    Say in what building, under what or on what a place of a plan lies.

    A vertical line through the place counts how often it leaves each part above the
    ground, and how often it enters one: who is left more often was being inside.

    Parameters
    ----------
    study : Study
        Of the ground or of whatever is topmost.
    x, y : float
        In the scene's local frame [m].

    Returns
    -------
    words : str
        ``inside Church``, ``under Bridge``, ``on top of Tower``; nothing in the open.
    """
    scene, soup = study.model.scene, study.model.soup
    flat = soup.vertices[:, :2] - (x, y)
    corners = flat[soup.faces]
    near = np.flatnonzero((corners.min(1) <= 0).all(1) & (corners.max(1) >= 0).all(1))
    a, b, c = (corners[near, k] for k in range(3))
    # Twice the areas of the triangles from the place to each edge; their sum is the face's.
    shares = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], 1)
    whole = shares.sum(1)
    held = (whole != 0) & ((shares >= 0).all(1) | (shares <= 0).all(1))
    near, shares, whole = near[held], shares[held], whole[held]
    z = (shares * soup.vertices[soup.faces[near], 2]).sum(1) / whole
    names = np.array([scene.parts[part].name for part in soup.part[near]], object)
    ground = study.model.ground
    is_above = z > (-np.inf if ground is None else ground + _SLACK)
    if not is_above.any():
        return ""
    if study.receivers == "top":
        return f"on top of {names[z.argmax()]}"
    above = names[is_above]
    turns = {name: int(np.sign(whole[is_above & (names == name)]).sum()) for name in above}
    inside = [name for name, left in turns.items() if left != 0]
    lowest = above[z[is_above].argmin()]
    return f"inside {inside[0]}" if inside else f"under {lowest}"


def _cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
