"""Films: a camera that turns or follows a path, and a sun that moves."""

from __future__ import annotations

import datetime as dt
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.calls.light_options import LightOptions
from umbra.calls.picture_options import RenderOptions
from umbra.errors import InputError, check_type, show_count, show_value
from umbra.option_fields import Given, Options, again, check_types, option, read_path, record
from umbra.scene import Camera, Light, Scene
from umbra.scene.lights import SomeLights, make_lights
from umbra.signatures import takes
from umbra.sun import Site, find_site, name_date

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["FILMS", "FilmOptions", "Shot", "film", "find_held", "plan_shots", "write_film"]

FILMS = ("mp4", "gif")
"""Formats of films, by the endings of their files."""
_film = partial(option, heading="Film")
_MOST_FRAMES = 6000
_FASTEST, _FASTEST_GIF = 120, 50  # [1/s]; browsers slow GIFs down whose frames are shorter
_MOST_HELD = 100_000  # points that each picture of a turntable is tried with
_ROSE = 0.055  # radius of the compass, of the frame's shorter side
_LEVEL = 1e-3  # length in plan of a view's direction that has a heading
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
            cameras = follow_cameras(stops, options.count_frames(len(stops) - 1))
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


def find_held(scene: Scene) -> NDArray[np.float64]:
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


def write_film(
    out: str | os.PathLike[str],
    scene: Scene,
    shots: Sequence[Shot],
    options: RenderOptions,
    rate: int,
    *,
    kind: str,
    warn: Callable[[str], object],
    tell: Callable[[str], object] = lambda _line: None,
    advance: Callable[[int, int], object] = lambda _done, _of: None,
) -> None:
    """
    Draw all frames and write them.

    Parameters
    ----------
    out : path
    scene : Scene
    shots : sequence of Shot
    options : RenderOptions
        Of each frame; a caption of its own replaces those of the shots.
    rate : int
        Frames in a second.
    kind : {'mp4', 'gif'}
    warn, tell : callable
        Called with a line on each problem, and on each assumption, of the first frame that has it.
    advance : callable
        Called with the number of frames that are drawn, and of all.
    """
    from PIL import Image  # noqa: PLC0415

    from umbra.calls.picture import draw_picture  # noqa: PLC0415
    from umbra.writers import day_film  # noqa: PLC0415

    warn, tell = _Once(warn), _Once(tell)
    if options.soft is None:  # a penumbra would make each frame dearer by a third
        options = replace(options, soft="none")
    if options.transparent:
        msg = "a film has no transparent frames; leave transparent= out"
        raise InputError(msg, option="transparent")

    def draw(shot: Shot) -> Image.Image:
        own = options if options.caption else replace(options, caption=shot.caption)
        picture = draw_picture(
            scene, shot.camera, shot.lights, own, warn, is_bare=False, is_filed=True, tell=tell
        )
        frame = Image.fromarray(picture.image)
        if shot.sun is not None:
            _put_compass(frame, shot, shot.sun)
        return frame

    def frames() -> Iterator[Image.Image]:
        for done, shot in enumerate(shots, start=1):
            yield draw(shot)
            advance(done, len(shots))

    if kind == "mp4":
        day_film.write_mp4(out, frames(), len(shots), 1 / rate)
    else:
        day_film.write_smooth_gif(out, frames(), len(shots), rate)


def _put_compass(frame: Image.Image, shot: Shot, sun: tuple[float, float]) -> None:
    """Draw north and the sun's way in a corner, the view's heading up."""
    from umbra.writers.sun_rose import paste_rose  # noqa: PLC0415

    _, up, forward = shot.camera.axes()
    ahead = forward if np.hypot(*forward[:2]) > _LEVEL else up
    heading = float(np.degrees(np.arctan2(ahead[0], ahead[1])))
    radius = max(_ROSE * min(frame.size), 12.0)
    middle = frame.width - 1.8 * radius, frame.height - 1.8 * radius
    paste_rose(frame, middle, radius, shot.north - heading, sun, shot.path)


class _Once:
    """Filter that passes each line once."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say, self._said = say, set[str]()

    def __call__(self, line: str) -> None:
        if line not in self._said:
            self._said.add(line)
            self._say(line)


def check_film(out: Path, size: Sequence[int], rate: int) -> str:
    """Return the kind of a film by its file's ending, which must fit."""
    kind = out.suffix.lower().removeprefix(".")
    if kind not in FILMS:
        msg = f"'{out}' would be a film; name it {out.with_suffix('.mp4')} or .gif"
        raise InputError(msg)
    if kind == "mp4" and any(side % 2 for side in size):
        even = tuple(side + side % 2 for side in size)
        msg = f"an MP4 has sides of even length; give size={even} instead of {tuple(size)}"
        raise InputError(msg, option="size")
    if kind == "gif" and rate > _FASTEST_GIF:
        msg = f"a GIF has at most {_FASTEST_GIF} frames in a second; give rate={_FASTEST_GIF}"
        raise InputError(msg, option="rate")
    return kind


@record
class FilmCallOptions(RenderOptions, FilmOptions):
    """Options of ``umbra.film``."""

    date: Given[str | dt.date | None, str | None] = option(
        "text", "Local date of the sun, in the first frame at the time at=, else in the afternoon."
    )
    at: str | None = again(LightOptions, "at", flag=None)
    time_of_day: str | None = again(LightOptions, "time_of_day", flag=None)

    def __post_init__(self) -> None:
        if isinstance(self.date, dt.date):
            object.__setattr__(self, "date", str(self.date))
        RenderOptions.__post_init__(self)
        FilmOptions.__post_init__(self)
        if not self.is_asked:
            msg = "say what moves: turntable='8s', path='views.json' or until='18:00'"
            raise InputError(msg, option="turntable")
        self.sun  # noqa: B018  (checks it)

    @property
    def sun(self) -> LightOptions:
        """The sun, checked."""
        return LightOptions(date=self.date, at=self.at, time_of_day=self.time_of_day)


@takes(FilmCallOptions, "a film")
def film(
    scene: Scene,
    out: str | os.PathLike[str],
    camera: Camera | None = None,
    lights: SomeLights = (),
    site: Site | None = None,
    *,
    options: FilmCallOptions,
) -> Path:
    """
    Draw a film: the camera turns or follows a path, or the sun moves.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    out : path
        The film, ``.mp4`` (H.264; needs the extra ``video``) or ``.gif``; replaced when the new one
        is complete.
    camera : Camera, optional
        Of the first frame; the whole model from above by default; see ``umbra.make_camera``.
    lights : Light, (n, 4) float, or a sequence of either
        Those that stand still, as in ``umbra.render``.
    site : Site, optional
        Place of the sun; the file's by default.
    options : FilmCallOptions
        Each by its name.

    Returns
    -------
    out : Path

    Raises
    ------
    InputError
        If nothing moves, a path is no list of views, the sun is below the horizon in a frame, or
        the file's name has another ending.
    UmbraError
        If the encoder is missing.

    Warns
    -----
    UserWarning
        If the sun's time is assumed, or a picture has a problem, as in ``umbra.render``.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> umbra.film(scene, "day.mp4", date="2026-03-21", at="07:00", until="17:30")
    """
    import warnings  # noqa: PLC0415

    from umbra.calls.arguments import make_camera  # noqa: PLC0415
    from umbra.folders.atomic import replace_file  # noqa: PLC0415

    check_type("scene", scene, Scene)
    first = make_camera(scene) if camera is None else camera
    check_type("camera", first, Camera)
    target = Path(out)
    kind = check_film(target, first.size, options.rate)
    said, sun = list[str](), None
    if options.sun.has_sun:
        place = find_site(scene) if site is None else site
        settled = options.sun.settle(lambda: place)
        if options.sun.assumes_time:
            said.append(settled.tell_assumed())
        sun = place, str(settled.date), str(settled.at)
    held = find_held(scene) if camera is None else None
    shots = plan_shots(options, first, make_lights(lights), sun, held)
    with replace_file(target) as beside:
        write_film(beside, scene, shots, options, options.rate, kind=kind, warn=said.append)
    for text in said:
        warnings.warn(text, stacklevel=3)
    return target
