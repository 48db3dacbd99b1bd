"""Shots of a film: what moves, and the camera and the sun of each frame."""

from __future__ import annotations

import datetime as dt
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError, show_count, show_value
from umbra.option_fields import Given, Options, check_types, option, read_path, record
from umbra.scene import Camera, Light, Scene
from umbra.sun import Site, name_date

__all__ = ["FilmOptions", "Shot", "find_turned_points", "plan_shots"]

_film = partial(option, heading="Film")
_MOST_FRAMES = 6000
_FASTEST = 120  # [1/s]
_MOST_HELD = 100_000  # points that each picture of a turntable is tried with
_LEG, _DAY = 3.0, 8.0  # from one view of a path to the next, and of a sun that moves [s]


@record
class FilmOptions(Options):
    """
    How the camera and the sun move in a film, checked.

    Raises
    ------
    InputError
        If two ways contradict each other, or the film would have too many frames.
    """

    turntable: str | None = _film(
        "text", "A film in which the camera goes once around its target in this time.",
        metavar="DURATION",
    )  # fmt: skip
    path: Given[str | os.PathLike[str] | None, Path | None] = _film(
        "path", "A film along views: a JSON list of at least two views, each as the window or the "
        "page saves it; of 3 s from one to the next, or film= in all.",
        metavar="FILE.json",
    )  # fmt: skip
    until: str | None = _film(
        "text", "A film in which the sun goes on from at= to this local time.", metavar="HH:MM"
    )
    film: str | None = _film(
        "text", "Length of a film of path= or until=; default: 8s with a sun that moves.",
        metavar="DURATION",
    )  # fmt: skip
    rate: int = _film("whole", "Frames of a film in a second.", default=25, least=1, metavar="N")

    def __post_init__(self) -> None:
        check_types(self)
        if self.path is not None:
            object.__setattr__(self, "path", read_path("path", self.path))
        if self.rate > _FASTEST:
            msg = f"rate={self.rate} is more than {_FASTEST} frames in a second"
            raise InputError(msg, option="rate")
        if self.turntable is not None and (self.path is not None or self.film is not None):
            other = "path" if self.path is not None else "film"
            msg = f"turntable= moves the camera and says for how long; leave it or {other}= out"
            raise InputError(msg, option="turntable")
        if self.film is not None and self.path is None and self.until is None:
            msg = "film= is the length of a film; say what moves: path= or until= (or turntable=)"
            raise InputError(msg, option="film")
        for name in ("turntable", "film"):
            if getattr(self, name) is not None:
                self._count(name)

    @property
    def is_asked(self) -> bool:
        """Whether a film is asked for."""
        return not (self.turntable is None and self.path is None and self.until is None)

    def count_frames(self, legs: int = 0) -> int:
        """Return the number of frames; ``legs`` are those between the views of a path."""
        for name in ("turntable", "film"):
            if getattr(self, name) is not None:
                return self._count(name)
        seconds = _LEG * legs if legs else _DAY
        return self._check("path", f"path= of {legs + 1} views", round(seconds * self.rate))

    def _count(self, name: str) -> int:
        from umbra.sun.clock import parse_duration  # noqa: PLC0415

        given = getattr(self, name)
        length = parse_duration(given, "length", name)
        frames = round(length.total_seconds() * self.rate)
        return self._check(name, f"{name}={show_value(given)}", frames)

    def _check(self, name: str, text: str, frames: int) -> int:
        if not 2 <= frames <= _MOST_FRAMES:
            many = show_count(frames, "frame")
            msg = f"{text} is {many} at rate={self.rate}; from 2 to {_MOST_FRAMES:,} can be drawn"
            raise InputError(msg, option=name)
        return frames


@dataclass(frozen=True, eq=False)
class Shot:
    """
    A frame of a film: its camera, its lights, and a line at its foot.

    ``north`` is the azimuth of the model's y axis, ``sun`` azimuth and altitude, ``path`` those of
    the film's suns [degrees].
    """

    camera: Camera
    lights: list[Light]
    caption: str = ""
    north: float = 0.0
    sun: tuple[float, float] | None = None
    path: tuple[tuple[float, float], ...] = ()


def plan_shots(
    options: FilmOptions,
    camera: Camera,
    lights: Sequence[Light],
    sun: tuple[Site, str, str] | None = None,
    held: NDArray[np.float64] | None = None,
) -> list[Shot]:
    """
    Plan the frames of a film.

    Parameters
    ----------
    options : FilmOptions
    camera : Camera
        Of the first frame, or of all; a path has its own.
    lights : sequence of Light
        Those that stand still.
    sun : (Site, str, str), optional
        Place, date and clock time of the sun.
    held : (n, 3) float64, optional
        Points that all pictures of a turntable hold [m]; None: the camera is as it was given.

    Returns
    -------
    shots : list of Shot

    Raises
    ------
    InputError
        If the path is no list of views, or the sun is below the horizon in a frame.
    """
    from umbra.scene.camera_path import follow_cameras, hold_in_turn, turn_camera  # noqa: PLC0415

    if options.path is not None:
        stops = _read_views(options.path, camera)
        try:
            cameras = follow_cameras(stops, options.count_frames(max(len(stops) - 1, 1)))
        except InputError as error:
            raise InputError(str(error), option=error.option or "path") from error
    elif options.turntable is not None:
        count = options.count_frames()
        cameras = turn_camera(camera if held is None else hold_in_turn(camera, held, count), count)
    else:
        cameras = [camera] * options.count_frames()
    if options.until is not None and sun is None:
        msg = "until= moves the sun; give date= and at=, too"
        raise InputError(msg, option="until")
    if sun is None:
        return [Shot(camera, list(lights)) for camera in cameras]
    suns = list(_move_sun(*sun, options.until, len(cameras)))
    path = tuple(dict.fromkeys(place for _, _, place in suns))
    return [
        Shot(camera, [*lights, light], label, sun[0].true_north, place, path)
        for camera, (light, label, place) in zip(cameras, suns, strict=True)
    ]


def find_turned_points(scene: Scene) -> NDArray[np.float64]:
    """Return points (n, 3) that a turntable's pictures hold: the model's, or its box's [m]."""
    points = scene.triangles().vertices + scene.origin
    if len(points) <= _MOST_HELD:
        return points
    return np.stack(np.meshgrid(*scene.model_bounds().T), -1).reshape(-1, 3)


def _read_views(path: Path, camera: Camera) -> list[Camera]:
    """Read a list of saved views, as cameras of the film's size."""
    from umbra.window.view_file import load_views  # noqa: PLC0415

    try:
        return [view.viewpoint.camera(camera.size) for view in load_views(path)]
    except InputError as error:
        raise InputError(str(error), option="path") from error


def _move_sun(
    site: Site, date: str, at: str, until: str | None, count: int
) -> Iterator[tuple[Light, str, tuple[float, float]]]:
    """Yield the sun of each frame, its date and clock time, its azimuth and altitude."""
    from umbra.scene import directional_light  # noqa: PLC0415
    from umbra.sun import find_sun  # noqa: PLC0415
    from umbra.sun.local_time import find_instant, parse_date  # noqa: PLC0415
    from umbra.sun.zones import find_zone  # noqa: PLC0415

    day, zone = parse_date(date), find_zone(site.zone)

    def find(name: str, clock: str, what: str) -> dt.datetime:
        try:
            return find_instant(day, clock, zone, what)
        except InputError as error:
            msg = f"{name}={show_value(clock)}: {error}"
            raise InputError(msg, option=name) from error

    start = find("at", at, "start")
    end = start if until is None else find("until", until, "end")
    if end < start:
        msg = f"until={show_value(until)} is before at={show_value(at)}; give a later time"
        raise InputError(msg, option="until")
    instants = [start + (end - start) * (k / (count - 1)) for k in range(count)]
    path = find_sun(site, instants)
    for k, (instant, is_up) in enumerate(zip(instants, path.is_up, strict=True)):
        clock = instant.astimezone(zone)
        label = f"{name_date(clock)}, {clock:%H:%M} {clock.tzname()}"
        if not is_up:
            msg = f"the sun is below the horizon at {label}; choose other times"
            raise InputError(msg, option="at" if instant == start else "until")
        place = float(path.azimuth[k]), float(path.altitude[k])
        yield directional_light(path.direction[k]), label, place
