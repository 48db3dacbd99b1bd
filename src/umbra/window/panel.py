"""The side panel: all settings of a view, as Dear ImGui widgets."""

import datetime as dt
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from imgui_bundle import imgui

from umbra.devices import DEVICES
from umbra.errors import InputError, show_count
from umbra.methods import MASK_FILTERS, MASK_SCALES
from umbra.scene import Light, Part
from umbra.sun import Site
from umbra.window.controls import Controls
from umbra.window.daylight import DAY, Sun, tell_daylight_hours
from umbra.window.hud import draw_keys, grow
from umbra.window.model_panel import (
    DIM,
    WARNING,
    bold,
    choose,
    draw_animation,
    draw_legend,
    draw_parts,
    put_label,
    say,
    slide,
)
from umbra.window.overlays import CASES, COMPONENTS, EDGES, OPEN, VOLUMES
from umbra.window.view_state import METHODS, OVERLAYS, SOFT, SUN, ViewState

__all__ = ["PanelState", "draw_panel"]

_LABELS = {
    "volumes": "Volumes",
    "cases": "Cases",
    "edges": "Silhouettes",
    "counts": "Counts",
    "components": "Components",
    "profile": "Hours of shadow",
    "relief": "Hours as relief",
}
_SPEEDS = {"15 min/s": 15.0, "1 h/s": 60.0, "3 h/s": 180.0}
_LOG = imgui.SliderFlags_.logarithmic.value
_PICKER = imgui.ColorEditFlags_.no_inputs.value | imgui.ColorEditFlags_.no_alpha.value


@dataclass
class PanelState:
    """
    State of the panel outside the view.

    Parameters
    ----------
    title : str
        Title of the model.
    view_file : str
        File to save and load views.
    statistics : bool
        Whether statistics are shown over the picture.
    message : str
        Last message.
    warnings : tuple of str
        Warnings about the picture.
    pattern : str
        Filter of listed parts by name, kind or layer.
    """

    title: str
    view_file: str
    statistics: bool = False
    message: str = ""
    warnings: tuple[str, ...] = ()
    pattern: str = ""


def draw_panel(
    view: ViewState,
    state: PanelState,
    controls: Controls,
    size: tuple[float, float],
    parts: Sequence[Part] = (),
) -> ViewState:
    """
    Draw the panel at the left of the window; return the edited view.

    The panel's own switches go to ``state``, playback and commands to ``controls``.
    """
    imgui.set_next_window_pos(imgui.ImVec2(0, 0))
    imgui.set_next_window_size(imgui.ImVec2(*size))
    flags = imgui.WindowFlags_
    imgui.push_style_var(imgui.StyleVar_.window_rounding.value, 0.0)
    imgui.begin(
        "panel",
        None,
        flags.no_title_bar.value | flags.no_resize.value | flags.no_move.value
        | flags.no_saved_settings.value | flags.no_bring_to_front_on_focus.value,
    )  # fmt: skip
    _draw_title(state, view, parts)
    if _open("Day and year", is_open=True):
        view = _draw_sun(view, controls)
    casting = len(set(range(len(parts))) - view.no_cast)
    cast = "" if casting == len(parts) else f": {casting} of {len(parts)} cast"
    if _open(f"Objects{cast}###Objects"):
        view, state.pattern = draw_parts(view, state.pattern, parts)
    if controls.motion is not None and controls.motion.has_any and _open("Animation", is_open=True):
        view = draw_animation(view, controls, controls.motion)
    if _open("What is drawn", is_open=True):
        view = _draw_overlays(view)
    if _open("Lights", is_open=bool(view.lights)):
        view = _draw_lights(view, controls)
    if _open("How shadows are counted"):
        view = _draw_counting(view)
        imgui.separator_text("Soft shadows")
        view = _draw_softness(view, controls)
        _, state.statistics = imgui.checkbox("Statistics", state.statistics)
    if _open("Camera"):
        view = _draw_camera(view, controls)
    if _open("Share and save"):
        _draw_file(state, controls)
    if _open("Mouse and keys"):
        draw_keys()
    if state.warnings and _open("Notes on the picture", is_open=True):
        for warning in state.warnings:
            say(warning, WARNING)
    if state.message:
        say(state.message, DIM)
    imgui.end()
    imgui.pop_style_var()
    return view


def _draw_title(state: PanelState, view: ViewState, parts: Sequence[Part]) -> None:
    """Write the model's name, its place and size, as the page does."""
    with bold():
        imgui.text(state.title)
    site, count = view.sun.site, sum(part.triangles for part in parts)
    place = [] if site is None else [site.show(), site.zone]
    say(
        " · ".join([*place, f"{show_count(len(parts), 'part')}, {show_count(count, 'triangle')}"]),
        DIM,
    )


def _open(name: str, *, is_open: bool = False) -> bool:
    """Draw a section's heading; return whether it is open."""
    imgui.separator()
    imgui.push_style_var(imgui.StyleVar_.frame_border_size.value, 0.0)
    with bold():
        flags = imgui.TreeNodeFlags_.default_open.value if is_open else 0
        opened = imgui.collapsing_header(name, flags)
    imgui.pop_style_var()
    return opened


def _draw_sun(view: ViewState, controls: Controls) -> ViewState:
    sun = view.sun
    _, shines = imgui.checkbox("Sun", sun.shines)
    if sun.site is not None:
        for label, by_clock in (("by clock", True), ("by angles", False)):
            imgui.same_line()
            if imgui.radio_button(label, sun.by_clock == by_clock):
                azimuth, altitude = sun.place()
                sun = replace(sun, by_clock=by_clock, azimuth=azimuth, altitude=max(altitude, 1.0))
    sun = replace(sun, shines=shines)
    site = sun.site if sun.by_clock else None
    sun = _draw_angles(sun) if site is None else _draw_clock(sun, site)
    if imgui.button("Pause" if controls.plays else "Play", imgui.ImVec2(grow(70), 0)):
        controls.plays = not controls.plays
    imgui.same_line()
    speeds = list(_SPEEDS.values())
    controls.speed = speeds[choose("speed", speeds.index(controls.speed), list(_SPEEDS))]
    return replace(view, sun=sun) if sun != view.sun else view


def _draw_clock(sun: Sun, site: Site) -> Sun:
    first = dt.date(sun.date.year, 1, 1)
    days = (dt.date(sun.date.year, 12, 31) - first).days
    put_label(f"{sun.date.day} {sun.date:%b %Y}")
    changed, day = imgui.slider_int("##date", (sun.date - first).days, 0, days, " ")
    if changed:
        sun = replace(sun, date=first + dt.timedelta(days=day))
    minutes = slide(sun.clock(), "time", sun.minutes, 0.0, DAY - 1.0)
    if minutes != sun.minutes:
        sun = replace(sun, minutes=float(round(minutes)))
    say(sun.tell_place(), WARNING if sun.is_behind_land else DIM)
    imgui.text_colored(DIM, tell_daylight_hours(site, sun.date))
    return sun


def _draw_angles(sun: Sun) -> Sun:
    azimuth = slide(f"azimuth {sun.azimuth:.0f}°", "azimuth", sun.azimuth, 0.0, 359.9)
    hidden = ", behind the land" if sun.is_behind_land else ""
    label = f"altitude {sun.altitude:.0f}°{hidden}"
    altitude = slide(label, "altitude", sun.altitude, 1.0, 90.0)
    return replace(sun, azimuth=azimuth, altitude=altitude)


def _draw_lights(view: ViewState, controls: Controls) -> ViewState:
    shining = view.shining()
    if SUN in shining:
        if imgui.radio_button("Sun", view.chosen == SUN):
            view = replace(view, chosen=SUN)
        imgui.same_line(imgui.get_content_region_avail().x - grow(52))
        view = replace(view, sun=replace(view.sun, color=_draw_color(view.sun.color)))
    removed = None
    for number, light in enumerate(view.lights):
        imgui.push_id(number)
        kind = "Spot" if light.axis is not None else "Lamp" if light.is_point else "Direction"
        if imgui.radio_button(f"{kind} {number + 1}", view.chosen == number):
            view = replace(view, chosen=number)
        imgui.same_line(imgui.get_content_region_avail().x - grow(52))
        color = _draw_color(light.color)
        if color != light.color:
            view = view.change_light(number, replace(light, color=color))
        imgui.same_line()
        if imgui.small_button("x"):
            removed = number
        imgui.pop_id()
    if removed is not None:
        view = view.remove_light(removed)
    if view.chosen >= 0:
        view = view.change_light(view.chosen, _draw_light(view.lights[view.chosen]))
    if imgui.button("Add a light"):
        view = controls.press_key(view, "l")
    return view


def _draw_light(light: Light) -> Light:
    """Draw the fields of the chosen light."""
    if light.is_point:
        imgui.set_next_item_width(-1)
        changed, position = imgui.drag_float3(
            "##place", light.position[:3].tolist(), 0.1, format="%.1f"
        )
        if changed:
            light = replace(light, position=np.append(position, 1.0))
    strength = max(*light.color, 1e-3)
    wanted = slide(f"strength {strength:.2f}", "strength", strength, 0.02, 4.0)
    if wanted != strength:
        red, green, blue = (value * wanted / strength for value in light.color)
        light = replace(light, color=(red, green, blue))
    return light


def _draw_color(color: tuple[float, float, float]) -> tuple[float, float, float]:
    """Draw a colour picker; linear colours are shown and picked in sRGB."""
    strength = max(*color, 1e-3)
    shown = [(value / strength) ** (1 / 2.2) for value in color]
    changed, picked = imgui.color_edit3("##color", shown, _PICKER)
    if not changed:
        return color
    red, green, blue = (strength * max(value, 0.0) ** 2.2 for value in picked)
    return red, green, blue


def _draw_counting(view: ViewState) -> ViewState:
    for device in (DEVICES[name] for name in METHODS):
        if imgui.radio_button(device.title, view.device == device.name):
            view = view.choose_device(device.name)
        imgui.same_line()
    methods = METHODS[view.device]
    view = view.choose_method(methods[choose("method", methods.index(view.method), methods)])
    if DEVICES[view.device].enlarges_masks and view.soft == "none":
        put_label("mask")
        choice, is_whole = MASK_SCALES.index(view.mask_scale), view.mask_scale == 1
        choice = choose(
            "scale", choice, ("whole", "half", "quarter"), -1.0 if is_whole else grow(72)
        )
        view = replace(view, mask_scale=MASK_SCALES[choice])
        if is_whole:
            return _draw_detail(view)
        imgui.same_line()
        choice = choose("filter", MASK_FILTERS.index(view.mask_filter), MASK_FILTERS)
        view = replace(view, mask_filter=MASK_FILTERS[choice])
    return view


def _draw_detail(view: ViewState) -> ViewState:
    """Draw by how many pixels shadows may be off, if the method can cast from coarser meshes."""
    imgui.begin_disabled(view.method not in DEVICES[view.device].methods.volumes)
    label = f"off by {view.detail:.1f} px" if view.detail else "exact"
    detail = slide(label, "detail", view.detail, 0.0, 8.0)
    imgui.end_disabled()
    return view if detail == view.detail else replace(view, detail=round(detail, 1))


def _draw_softness(view: ViewState, controls: Controls) -> ViewState:
    view = replace(view, soft=SOFT[choose("soft", SOFT.index(view.soft), SOFT)])
    if view.soft == "none":
        return view
    if view.soft == "weng":  # layers need no light size
        return _draw_layers(view)
    lights = view.shining().values()
    if any(not light.is_point for light in lights):
        label = f"sun {view.sun_radius:.2g}°"
        view = replace(view, sun_radius=slide(label, "sun size", view.sun_radius, 0.05, 5.0, _LOG))
    if any(light.is_point for light in lights):
        most = 0.1 * float(np.linalg.norm(np.ptp(controls.bounds, axis=0))) or 1.0
        label, least = f"lamps {view.lamp_radius:.2g} m", 0.01 * most
        radius = slide(label, "lamp size", view.lamp_radius, least, most, _LOG)
        view = replace(view, lamp_radius=radius)
    return view


def _draw_layers(view: ViewState) -> ViewState:
    """Draw Weng's length and gap; values that make no layer are rejected."""
    layers = view.soften(1).layers
    for name, most in (("layer_length", 6.0), ("layer_gap", 2.0)):
        value = getattr(view, name)
        wanted = slide(f"{name.removeprefix('layer_')} {value:.2f}", name, value, 0.05, most)
        if wanted != value:
            with suppress(InputError):
                view = replace(view, **{name: round(wanted, 2)})  # type: ignore[arg-type]
    imgui.text_colored(DIM, f"{layers} layers, in tenths of the radius")
    return view


def _draw_overlays(view: ViewState) -> ViewState:
    for number, overlay in enumerate(OVERLAYS):
        if number % 2:
            imgui.same_line(grow(130))
        changed, _ = imgui.checkbox(_LABELS[overlay], overlay in view.overlays)
        if changed:
            view = view.toggle(overlay)
    if "cases" in view.overlays:
        draw_legend([(f"case {n}" if n else "none", CASES[n]) for n in (1, 2, 3, 0)])
    if "volumes" in view.overlays:
        draw_legend([("z-pass", VOLUMES["z_pass"]), ("z-fail", VOLUMES["z_fail"]),
                   ("light cap", VOLUMES["light_cap"])])  # fmt: skip
    if view.overlays & {"profile", "relief"}:
        view = _draw_period(view)
    if "components" in view.overlays:
        draw_legend([("open", OPEN), ("closed", COMPONENTS[0]), ("", COMPONENTS[1]),
                   ("", COMPONENTS[2])])  # fmt: skip
    if "edges" in view.overlays:
        draw_legend([("silhouette edges", EDGES)])
    return view


def _draw_period(view: ViewState) -> ViewState:
    """Draw the start, end and step of the profile's period."""
    if view.sun.site is None:
        say("a profile needs a site: its latitude and longitude", WARNING)
        return view
    if view.profile_suns() is None:
        say("the sun is not up in this time", WARNING)
    period = view.period
    until = "24:00" if period.end == DAY else Sun(minutes=period.end).clock()
    put_label(f"{Sun(minutes=period.start).clock()} to {until}")
    changed, ends = imgui.slider_int2("##period", [int(period.start), int(period.end)], 0, DAY, " ")
    if changed:
        start, end = (15.0 * round(minutes / 15) for minutes in ends)
        if start < end:
            view = replace(view, period=replace(period, start=start, end=end))
    imgui.align_text_to_frame_padding()
    imgui.text_colored(DIM, "by")
    for minutes in (15.0, 30.0, 60.0):
        imgui.same_line()
        if imgui.radio_button(f"{minutes:.0f} min", period.every == minutes):
            view = replace(view, period=replace(view.period, every=minutes))
    return view


def _draw_camera(view: ViewState, controls: Controls) -> ViewState:
    viewpoint = view.viewpoint
    for label, walks in (("Orbit", False), ("Walk", True)):
        if imgui.radio_button(label, viewpoint.walks == walks) and viewpoint.walks != walks:
            view = controls.press_key(view, "c")
        imgui.same_line()
    if imgui.button("Frame", imgui.ImVec2(-1, 0)):
        view = controls.press_key(view, "f")
    put_label(f"lens {viewpoint.fov:.0f}°")
    changed, fov = imgui.slider_float("##fov", viewpoint.fov, 10.0, 110.0, " ")
    if changed:
        view = replace(view, viewpoint=replace(view.viewpoint, fov=float(np.clip(fov, 5, 150))))
    return view


def _draw_file(state: PanelState, controls: Controls) -> None:
    imgui.set_next_item_width(-1)
    _, state.view_file = imgui.input_text("##file", state.view_file)
    width = imgui.get_content_region_avail().x
    for index, (label, command, share) in enumerate(
        (("Save", "save", 0.24), ("Load", "load", 0.24), ("Screenshot", "screenshot", 0.0))
    ):
        if index:
            imgui.same_line()
        if imgui.button(label, imgui.ImVec2(share * width or -1, 0)):
            controls.commands.append(command)
