"""Films: frames of a camera that turns or follows a path, and of a sun that moves."""

from __future__ import annotations

import datetime as dt
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from umbra.calls.film_shots import FilmOptions, Shot, find_turned_points, plan_shots
from umbra.calls.light_options import LightOptions
from umbra.calls.picture_options import RenderOptions
from umbra.errors import InputError, check_type
from umbra.option_fields import Given, again, option, record
from umbra.scene import Camera, Scene
from umbra.scene.lights import SomeLights, make_lights
from umbra.signatures import takes
from umbra.sun import Site, find_site

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["FILMS", "check_film", "film", "write_film"]

FILMS = ("mp4", "gif")
"""Formats of films, by the endings of their files."""
_FASTEST = 50  # GIF [1/s]; browsers slow down those whose frames are shorter
_ROSE = 0.055  # radius of the compass, of the frame's shorter side
_LEVEL = 1e-3  # length in plan of a view's direction that has a heading


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

    from umbra.calls.picture import WarnOnce, draw_picture  # noqa: PLC0415
    from umbra.writers import day_film  # noqa: PLC0415

    warn, tell = WarnOnce(warn), WarnOnce(tell)
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
    if kind == "gif" and rate > _FASTEST:
        msg = f"a GIF has at most {_FASTEST} frames in a second; give rate={_FASTEST}"
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
    held = find_turned_points(scene) if camera is None else None
    shots = plan_shots(options, first, make_lights(lights), sun, held)
    with replace_file(target) as beside:
        write_film(beside, scene, shots, options, options.rate, kind=kind, warn=said.append)
    for text in said:
        warnings.warn(text, stacklevel=3)
    return target
