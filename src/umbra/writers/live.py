"""A study in the live page: its hours as colours on the ground and on roofs, and its sun."""

import base64
import datetime as dt
import io

import numpy as np
from PIL import Image

from umbra.errors import InputError
from umbra.scene import Scene
from umbra.study import Study, tell_dates
from umbra.writers.pixels import resample, shade_ramp

__all__ = ["clear_ground", "make_hours", "make_study_config"]

_LARGEST = 2048  # cells along a side; every device has textures of as many
_CLEAR = 255  # index of cells without a value
_HAIR = 2e-4  # of the model's diagonal: as far apart a browser's depths tell two surfaces


def make_hours(study: Study) -> dict[str, object]:
    """
    Describe the hours of a plan, as ``Hours`` of ``umbra/web/app.js``.

    Raises
    ------
    InputError
        If the study's receivers are not seen from above.
    """
    if not study.is_plan:
        msg = (
            f"hours on receivers '{study.receivers}' cannot be laid on a model in a browser; "
            "count receivers='ground' or 'top', or look at the study's report"
        )
        raise InputError(msg, option="study")
    hours = np.asarray(study.shadow_hours, np.float32)
    if max(hours.shape) > _LARGEST:
        times = _LARGEST / max(hours.shape)
        rows, cols = (max(1, round(side * times)) for side in hours.shape)
        hours = resample(hours, (rows, cols))
    most = max(study.up_hours, 1e-9)
    share = np.clip(np.nan_to_num(hours) / most, 0, 1)
    index = np.where(np.isnan(hours), _CLEAR, np.rint(share * (_CLEAR - 1))).astype(np.uint8)
    ramp = np.rint(shade_ramp(_CLEAR) * 255).astype(np.uint8)
    picture = Image.fromarray(index[::-1].copy(), "P")
    picture.putpalette(ramp.tobytes())
    stream = io.BytesIO()
    picture.save(stream, "PNG", optimize=True, transparency=_CLEAR)
    grid = study.grid
    half = np.array([grid.dx, grid.dy]) / 2
    low = np.array([study.x[0], study.y[0]]) - half
    high = np.array([study.x[-1], study.y[-1]]) + half
    return {
        "title": f"Hours in shadow, {tell_dates(study)}",
        "ramp": np.rint(shade_ramp(16) * 255).astype(int).tolist(),
        "most": float(study.up_hours),
        "note": f"Of {study.up_hours:.1f} h with the sun up; cells of {grid.dx:.3g} m.",
        "plan": {
            "image": f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}",
            "extent": [*low.tolist(), *high.tolist()],
            "onModel": not study.kind.lies_under_roofs,
        },
    }


def clear_ground(scene: Scene, height: float, *, is_above: bool) -> float:
    """
    Return a ground's height [m], a hair off where faces of the model that look up lie in it.

    A browser's depths cannot tell two surfaces in one plane: they would show in patches.

    Parameters
    ----------
    scene : Scene
    height : float
        In the model's own coordinates [m].
    is_above : bool
        Whether the ground hides those faces, as one that shows hours does, or they hide it.
    """
    soup = scene.triangles()
    corners = soup.vertices[soup.faces] + scene.origin
    low, high = scene.bounds()
    hair = _HAIR * float(np.linalg.norm(high - low))
    a, b, c = (corners[:, k, :2] for k in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    is_in_it = (np.abs(corners[:, :, 2] - height) < hair).all(1) & (x1 * y2 > x2 * y1)
    return height + (hair if is_above else -hair) if is_in_it.any() else height


def make_study_config(study: Study, title: str, subtitle: str) -> dict[str, object]:
    """Describe a study's model and sun, as ``Config`` of ``umbra/web/app.js``."""
    scene = study.model.scene
    day: dt.date = study.period.days[0]
    noon = int(np.argmax(study.period.sun.altitude[study.period.day_of_step == 0]))
    when = study.steps.local()[noon]
    low, high = scene.bounds()
    hours = make_hours(study) if study.is_plan else None
    return {
        "name": title,
        "title": title,
        "subtitle": subtitle,
        "view": {
            "umbra_view": 1,
            "viewpoint": {
                "target": ((low + high) / 2).tolist(),
                "heading": 20.0, "tilt": -28.0, "fov": 45.0,
                "distance": float(np.linalg.norm(high - low)),
            },
            "sun": {
                "date": day.isoformat(),
                "minutes": when.hour * 60 + when.minute,
                "azimuth": 180.0, "altitude": 45.0,
            },
        },
        "isFramed": True,
        "ground": _find_ground(study),
        "proposed": [],
        "notes": [],
        "hours": hours,
        "hasLink": False,
        "takesWheel": False,
        "poster": "",
    }  # fmt: skip


def _find_ground(study: Study) -> float:
    """Return the height of the ground that a study's page draws [m]."""
    scene = study.model.scene
    if not study.is_plan:
        return float(scene.bounds()[0, 2])
    return clear_ground(scene, float(study.ground), is_above=study.kind.lies_under_roofs)
