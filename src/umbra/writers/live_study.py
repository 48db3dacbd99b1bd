"""A study in the live page: its hours as colours on the model and at points, and its sun."""

import base64
import datetime as dt
import io
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from umbra.errors import InputError, show_count
from umbra.readers.georeference import show_crs
from umbra.scene import Scene
from umbra.study import Study, name_dates
from umbra.writers.packing import pack, pack_grids
from umbra.writers.pixels import NO_SUN, resample, shade_ramp

__all__ = [
    "clear_ground",
    "describe_layers",
    "describe_sky",
    "find_face_surfaces",
    "make_hours",
    "make_palette",
    "make_study_config",
]

_LARGEST = 2048  # cells along a side; every device has textures of as many
_CLEAR = 255  # level of receivers without a value
_DARK = 254  # of those without any sun
_ROUNDING = 1e-3  # of hours [h]
_STEPS = 64  # colours of the key, between which the page blends
_HAIR = 2e-4  # of the model's diagonal: as far apart a browser's depths tell two surfaces


def make_hours(study: Study) -> dict[str, object]:
    """
    Describe a study's hours, as ``Hours`` of ``umbra/web/app.js``.

    Raises
    ------
    InputError
        If the study's receivers are pixels of a view.
    """
    if study.kind.is_raster and not study.is_plan:
        msg = (
            f"hours on receivers '{study.receivers}' cannot be laid on a model in a browser; count "
            "receivers='ground', 'top', 'surfaces' or 'points', or look at the study's report"
        )
        raise InputError(msg, option="study")
    is_sun = len(study.period.days) > 1  # of several dates, as on the sheets
    what = f"cells of {study.grid.dx:.3g} m" if study.is_plan else _count(study)
    return {
        "title": f"Hours {'of sun' if is_sun else 'in shadow'}, {name_dates(study)}",
        "isSun": is_sun,
        "most": float(study.up_hours),
        "note": f"Of {study.up_hours:.1f} h of the study with the sun up; {what}.",
        "plan": _make_plan(study) if study.is_plan else None,
        "samples": None if study.is_plan else _make_samples(study),
    }


def make_palette() -> dict[str, object]:
    """Return the colours of hours in shadow, and of no sun at all, in sRGB from 0 to 255."""
    return {
        "noSun": np.rint(np.array(NO_SUN) * 255).astype(int).tolist(),
        "ramp": np.rint(shade_ramp(_STEPS) * 255).astype(int).tolist(),
    }


def _count(study: Study) -> str:
    """Count the samples of a study, and say how far they are apart."""
    count = len(study.shadow_hours)
    if study.samples is None:
        return show_count(count, "point")
    return f"{count:,} samples, {study.samples.spacing:.3g} m apart"


def _find_levels(study: Study, hours: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return hours in shadow in levels to ``_DARK``, ``_CLEAR`` where there are none."""
    share = np.clip(np.nan_to_num(hours) / max(study.up_hours, 1e-9), 0, 1)
    levels = np.where(
        (hours >= study.up_hours - _ROUNDING) & (study.up_hours > 0), _DARK,
        np.rint(share * (_DARK - 1)),
    )  # fmt: skip
    return np.where(np.isnan(hours), _CLEAR, levels).astype(np.uint8)


def _make_plan(study: Study) -> dict[str, object]:
    """Draw the hours of a plan, as ``plan`` of ``Hours``."""
    hours = np.asarray(study.shadow_hours, np.float32)
    if max(hours.shape) > _LARGEST:
        times = _LARGEST / max(hours.shape)
        rows, cols = (max(1, round(side * times)) for side in hours.shape)
        hours = resample(hours, (rows, cols))
    picture = Image.fromarray(_find_levels(study, hours)[::-1].copy(), "P")
    colors = np.concatenate([shade_ramp(_DARK), [NO_SUN]])
    picture.putpalette(np.rint(colors * 255).astype(np.uint8).tobytes())
    stream = io.BytesIO()
    picture.save(stream, "PNG", compress_level=4, transparency=_CLEAR)
    half = np.array([study.grid.dx, study.grid.dy]) / 2
    low = np.array([study.x[0], study.y[0]]) - half
    high = np.array([study.x[-1], study.y[-1]]) + half
    return {
        "image": f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}",
        "extent": [*low.tolist(), *high.tolist()],
        "onModel": not study.kind.lies_under_roofs,
    }


def _make_samples(study: Study) -> dict[str, object]:
    """Pack the hours of samples of surfaces, or of points, as ``samples`` of ``Hours``."""
    levels = _find_levels(study, np.asarray(study.shadow_hours, np.float32))
    origin = study.model.scene.origin
    middle = np.round(study.model.scene.bounds().mean(0)) - origin
    packed: dict[str, object]
    if study.samples is None:
        points = study.places.points - origin - middle
        packed = {"points": pack(points.astype("<f4").tobytes())}
    else:
        packed, shown = pack_grids(study.samples, middle)
        levels = levels[shown]
    return {"origin": (origin + middle).tolist(), "levels": pack(levels.tobytes()), **packed}


def find_face_surfaces(study: Study | None, scene: Scene) -> NDArray[np.int64] | None:
    """
    Find the sampled surface of each face of ``scene.triangles()``, -1 where there is none.

    None is returned for a study without samples of surfaces.

    Raises
    ------
    InputError
        If the study's samples are not of this scene.
    """
    if study is None or study.kind.is_raster or study.samples is None:
        return None
    soup, own = scene.triangles(), study.model.scene.triangles()
    same = len(soup.faces) == len(own.faces) and np.allclose(
        scene.bounds(), study.model.scene.bounds(), rtol=0, atol=1e-3
    )
    if not same:
        msg = (
            f"the study's samples lie on another model, of {len(own.faces):,} triangles, and this "
            f"scene has {len(soup.faces):,}; show the scene that was studied"
        )
        raise InputError(msg, option="study")
    surface = np.full(len(soup.faces), -1)
    surface[study.samples.source] = study.samples.owner
    return surface


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
    low, high = scene.model_bounds()
    is_raster = study.kind.is_raster and not study.is_plan
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
        **describe_layers(scene),
        "proposed": [],
        "removed": [],
        "notes": [],
        "palette": make_palette(),
        "hours": None if is_raster else make_hours(study),
        "hasLink": False,
        "takesWheel": False,
        "poster": "",
    }  # fmt: skip


def describe_layers(scene: Scene) -> dict[str, object]:
    """Return the CRS of a page's model, and by how much the caller had moved its layers."""
    return {
        "crs": None if scene.crs is None else show_crs(scene.crs),
        "moves": {source.layer: source.moved for source in scene.sources if any(source.moved)},
    }


def _find_ground(study: Study) -> float | None:
    """Return the height of the ground that a study's page draws [m]; None: it is in the scene."""
    scene = study.model.scene
    if scene.list_own() is not None:
        return None
    if not study.is_plan:
        return float(scene.bounds()[0, 2])
    return clear_ground(scene, float(study.ground), is_above=study.kind.lies_under_roofs)


def describe_sky(study: Study, obstructing: Sequence[int] | None) -> dict[str, object] | None:
    """
    Describe what a report's page needs to draw the sky above a place that is read.

    That is where the receivers of a plan lie, and the parts that obstruct (indices; None: all).
    None is returned for receivers whose place the page does not know: those of other rasters.
    """
    scene = study.model.scene
    if study.kind.is_raster and not study.is_plan:
        return None
    own = scene.list_own()
    added = [] if own is None else [k for k in range(len(scene.parts)) if k not in set(own)]
    has_level = study.is_plan and not added
    return {
        "ground": float(study.ground) if has_level else None,
        "added": added,
        "cast": None
        if obstructing is None or len(obstructing) == len(scene.parts)
        else list(obstructing),
    }
