"""Views as JSON files."""

import datetime as dt
import json
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.folders.atomic import replace_file
from umbra.scene import Light
from umbra.sun import Site
from umbra.window.daylight import ProfilePeriod, Sun
from umbra.window.view_state import Viewpoint, ViewState

__all__ = ["from_json", "load_view", "load_views", "save_view", "to_json"]

_VERSION = 1
_NUMBERS = ("heading", "tilt", "distance", "fov", "near")


def to_json(view: ViewState) -> dict[str, Any]:
    """Convert a view to JSON types; the land and pictures projected by lights are left out."""
    sun = asdict(replace(view.sun, land=None))
    del sun["land"], sun["bend"]  # which is the exposure's
    sun["date"] = view.sun.date.isoformat()
    return {
        "umbra_view": _VERSION,
        "viewpoint": asdict(view.viewpoint),
        "sun": sun,
        "lights": [_describe(light) for light in view.lights],
        "overlays": sorted(view.overlays),
        **{name: getattr(view, name) for name in _CHOICES},
        "no_cast": sorted(view.no_cast),
        "period": asdict(view.period),
    }


def from_json(described: Any, images_of: tuple[Light, ...] = ()) -> ViewState:
    """
    Make a view from its JSON description; `InputError` names a missing or invalid entry.

    Each light projects the picture of the light of the same index in ``images_of``.
    """
    if not isinstance(described, dict) or described.get("umbra_view") != _VERSION:
        msg = f"this is not a view of version {_VERSION}: 'umbra_view' is missing or another number"
        raise InputError(msg)
    entry = "viewpoint"
    try:
        given = described["viewpoint"]
        viewpoint = Viewpoint(
            target=_read_three(given["target"]),
            walks=bool(given.get("walks", False)),
            **{name: _read_number(given[name]) for name in _NUMBERS},
        )
        viewpoint.camera((16, 16))  # raises for an invalid viewpoint
        if not viewpoint.distance > 0 or abs(viewpoint.tilt) >= 90:
            msg = "distance must be above 0, and tilt between -90 and 90"
            raise InputError(msg)
        entry = "sun"
        sun = _read_sun(described["sun"])
        lights = []
        for number, light in enumerate(described.get("lights", [])):
            entry = f"lights[{number}]"
            lights.append(_read_light(light))
            if number < len(images_of) and light.get("has_image"):
                source = images_of[number]
                lights[-1] = replace(lights[-1], image=source.image, up=source.up)
        entry = "overlays"
        overlays = frozenset(map(str, described.get("overlays", [])))
        more: dict[str, Any] = {}
        for name, read in _CHOICES.items():
            entry = name
            if name in described:
                more[name] = read(described[name])
        entry = "no_cast"
        more["no_cast"] = frozenset(map(int, described.get("no_cast", [])))
        entry = "period"
        if "period" in described:
            given = described["period"]
            numbers = (_read_number(given[field.name]) for field in fields(ProfilePeriod))
            more["period"] = ProfilePeriod(*numbers)
        entry = "choices"
        return ViewState(viewpoint, sun, tuple(lights), overlays=overlays, **more)
    except KeyError as error:
        msg = f"the view's {entry} has no {error}"
        raise InputError(msg) from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        msg = f"the view's {entry} is wrong: {error}"
        raise InputError(msg) from error


_LARGEST = 10_000_000  # [byte]; a view of thousands of lights
_TOO_LARGE = f"larger than {_LARGEST / 1e6:g} MB"


def save_view(path: str | os.PathLike[str], view: ViewState) -> None:
    """Write a view to a file atomically; `InputError` if it cannot be written."""
    with replace_file(path) as beside:
        beside.write_text(json.dumps(to_json(view), indent=2) + "\n", "utf-8")


def load_view(path: str | os.PathLike[str], images_of: tuple[Light, ...] = ()) -> ViewState:
    """Read a view from a file; parameters, and errors, as in ``from_json``."""
    described = _load_json(path)
    try:
        return from_json(described, images_of)
    except InputError as error:
        msg = f"'{path}': {error}"
        raise InputError(msg, path=path) from error


def load_views(path: str | os.PathLike[str]) -> list[ViewState]:
    """Read a list of views, ``[VIEW, VIEW, ...]``, from a file; errors as in ``from_json``."""
    described = _load_json(path)
    if not isinstance(described, list):
        msg = f"'{path}' is not a list of views; write the saved views as [VIEW, VIEW, ...]"
        raise InputError(msg, path=path)
    views = []
    for number, description in enumerate(described, start=1):
        try:
            views.append(from_json(description))
        except InputError as error:
            msg = f"'{path}', view {number}: {error}"
            raise InputError(msg, path=path) from error
    return views


def _load_json(path: str | os.PathLike[str]) -> Any:
    try:
        with Path(path).open("rb") as file:
            data = file.read(_LARGEST + 1)
        if len(data) > _LARGEST:
            raise ValueError(_TOO_LARGE)  # noqa: TRY301  (one message for all that is no view)
        return json.loads(data.decode("utf-8"))
    except OSError as error:
        msg = f"cannot read the view '{path}' ({error.strerror or error})"
        raise InputError(msg, path=path) from error
    except (RecursionError, ValueError) as error:
        msg = f"the view '{path}' is not JSON ({error}); save it again with umbra view"
        raise InputError(msg, path=path) from error


def _describe(light: Light) -> dict[str, Any]:
    described: dict[str, Any] = {
        "position": light.position.tolist(),
        "color": list(light.color),
        "attenuation": list(light.attenuation),
        "range": None if np.isinf(light.range) else light.range,
    }
    if light.axis is not None:
        described |= {
            "axis": light.axis.tolist(),
            "half_angle": light.half_angle,
            "inner_angle": light.inner_angle,
            "has_image": light.image is not None,
        }
    return described


def _read_light(given: Mapping[str, Any]) -> Light:
    more: dict[str, Any] = {}
    if given.get("axis") is not None:
        more = {"axis": np.array(_read_three(given["axis"]))}
        more["half_angle"] = _read_number(given["half_angle"])
        if given.get("inner_angle") is not None:
            more["inner_angle"] = _read_number(given["inner_angle"])
    return Light(
        np.array([_read_number(value) for value in given["position"]]),
        color=_read_three(given["color"]),
        attenuation=_read_three(given.get("attenuation", (1, 0, 0))),
        range=np.inf if given.get("range") is None else _read_number(given["range"]),
        **more,
    )


def _read_sun(given: Mapping[str, Any]) -> Sun:
    site = given.get("site")
    minutes, altitude = _read_number(given["minutes"]), _read_number(given["altitude"])
    if not 0 <= minutes < 24 * 60 or not -90 <= altitude <= 90:
        msg = "minutes must lie in 0 to 1440, and altitude in -90 to 90"
        raise InputError(msg)
    return Sun(
        shines=bool(given.get("shines", True)),
        site=None if site is None else Site(**site),
        date=dt.date.fromisoformat(given["date"]),
        minutes=minutes,
        azimuth=_read_number(given["azimuth"]),
        altitude=altitude,
        by_clock=bool(given.get("by_clock", True)),
        color=_read_three(given.get("color", (1, 1, 1))),
    )


def _read_number(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        msg = f"{value} is not a finite number"
        raise InputError(msg)
    return number


def _read_three(values: Any) -> tuple[float, float, float]:
    x, y, z = map(_read_number, values)
    return x, y, z


_CHOICES: dict[str, Callable[[Any], Any]] = {
    "chosen": int, "method": str, "device": str, "soft": str, "sun_radius": _read_number,
    "lamp_radius": _read_number, "layer_length": _read_number, "layer_gap": _read_number,
    "mask_scale": int, "mask_filter": str, "detail": _read_number, "time": _read_number,
    "animation": lambda value: value if value is None or isinstance(value, int) else str(value),
}  # fmt: skip
"""Optional entries of a file, and the reader of each."""
