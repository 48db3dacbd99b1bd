"""The first view of a window, a page or a notebook: its state, and its picture."""

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from umbra.calls.ground import stand_scene
from umbra.calls.picture import Picture, draw_picture
from umbra.calls.picture_options import RenderOptions, ViewOptions
from umbra.calls.study_result import ShadowStudy
from umbra.devices import DEFAULT
from umbra.errors import InputError
from umbra.land.named_land import NamedLand
from umbra.lights import Horizon
from umbra.methods import Softness
from umbra.scene import Scene, directional_light
from umbra.study import Study
from umbra.sun import Site

if TYPE_CHECKING:
    from umbra.window.view_state import ViewState

__all__ = ["begin_view", "draw_view", "find_shown_land", "find_shown_study", "settle_view"]

_DATE = "2026-03-21"  # default date
_NIGHT = directional_light((0.0, 0.0, 1.0), color=(0.0, 0.0, 0.0))  # a picture of none has its own


def settle_view(
    options: ViewOptions, scene: Scene, site: Site | None,
    progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> ViewOptions:  # fmt: skip
    """Return options with the horizon of the land around a model, of a raster as of a table."""
    named = NamedLand.of(options.horizon, options.horizon_from)
    land = named.settle(scene.model_bounds(), site, progress)
    return replace(options, horizon=land, horizon_from=None)


def find_shown_study(options: ViewOptions) -> Study | None:
    """Return the result of the study that a page shows."""
    given: object = options.study
    if given is None:
        return None
    if isinstance(given, ShadowStudy):
        return given.result
    msg = f"study= is a {type(given).__name__}, not a study; give what umbra.shadow_study returns"
    raise InputError(msg, option="study")


def find_shown_land(options: ViewOptions) -> Horizon | None:
    """Return the land far away of a view: its own, once settled, or its study's."""
    study = find_shown_study(options)
    return options.horizon if study is None else study.period.horizon


def begin_view(
    options: ViewOptions, scene: Scene, site: Site | None, size: tuple[int, int]
) -> "ViewState":
    """Make the initial view, in a picture of columns and rows."""
    from umbra.scene.making import find_animations  # noqa: PLC0415
    from umbra.sun.local_time import parse_date  # noqa: PLC0415
    from umbra.window.view_file import load_view  # noqa: PLC0415
    from umbra.window.view_state import make_view  # noqa: PLC0415

    date = None if options.date is None else parse_date(options.date)
    view = make_view(scene, size, site=site, date=date, minutes=_find_minutes(options, site))
    if options.view is not None:
        view = load_view(Path(options.view), view.lights)
    view = replace(view, sun=replace(view.sun, land=find_shown_land(options)))
    if options.animation is not None or options.time is not None:
        animations = find_animations(scene, 0 if options.animation is None else options.animation)
        chosen = "all" if len(animations) > 1 else scene.animations.index(animations[0])
        view = replace(view, animation=chosen, time=options.time or 0.0)
    if options.cast or options.no_cast:
        view = view.choose_casters(scene.select(options.cast, options.no_cast), len(scene.parts))
    if options.device is not None:
        view = view.choose_device(options.device)
    if options.method is not None:
        view = view.choose_method(options.method)
    names = ("soft", "layer_length", "layer_gap", "mask_scale", "mask_filter", "detail")
    given = {name: getattr(options, name) for name in names}
    return replace(view, **{name: value for name, value in given.items() if value is not None})


def _find_minutes(options: ViewOptions, site: Site | None) -> float | None:
    """Return the minutes since midnight in local time."""
    from zoneinfo import ZoneInfo  # noqa: PLC0415

    from umbra.sun.local_time import find_instant, parse_date  # noqa: PLC0415

    if options.at is None or site is None:
        return None
    zone = ZoneInfo(site.zone)
    local = find_instant(parse_date(options.date or _DATE), options.at, zone, "time").astimezone(
        zone
    )
    return local.hour * 60 + local.minute + local.second / 60


def draw_view(scene: Scene, site: Site | None, options: ViewOptions) -> Picture:
    """Draw the window's initial picture."""
    from umbra.window.motion import Motion  # noqa: PLC0415

    scene, height = stand_scene(options, scene)
    view = begin_view(options, scene, site, options.size)
    sizes = [
        view.lamp_radius if light.is_point else view.sun_radius for light in view.shining().values()
    ]
    soft = None if view.soft == "none" else view.soft
    drawing = RenderOptions(
        ground=False if height is None else height,
        method=options.method or "auto",
        device=options.device or (view.device if view.mask_scale > 1 or view.detail else DEFAULT),
        soft=view.soft,
        light_size=() if soft is None else sizes,
        layer_length=view.layer_length if soft == "weng" else Softness.length,
        layer_gap=view.layer_gap if soft == "weng" else Softness.gap,
        mask_scale=view.mask_scale,
        mask_filter=view.mask_filter,
        detail=view.detail,
        threads=options.threads,
    )
    said: list[str] = []
    camera = view.viewpoint.camera(options.size)
    motion = Motion(scene)
    view, scene = motion.follow(view), motion.pose(view)
    casters = sorted(set(range(len(scene.parts))) - view.no_cast)
    lights = list(view.shining().values()) or [_NIGHT]
    picture = draw_picture(scene, camera, lights, drawing, said.append, casters)
    for text in said:
        warnings.warn(text, stacklevel=4)
    if options.out is not None:
        from umbra.folders.atomic import replace_file  # noqa: PLC0415
        from umbra.writers.pixels import write_png  # noqa: PLC0415

        with replace_file(Path(options.out)) as beside:
            write_png(beside, picture.image)
    return picture
