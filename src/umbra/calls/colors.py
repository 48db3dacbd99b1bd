"""Colours of a drawing: each polygon has one, that of the picture at a point of it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.calls.openness import find_openness
from umbra.calls.picture_options import DrawingOptions
from umbra.calls.styles import Backdrop, Style
from umbra.cpu.shade import encode_srgb, find_colors
from umbra.devices import find_device
from umbra.drawing import SeenModel
from umbra.drawing.drawn_page import DrawnPart, Fill, Hatching, Page, list_losses, tell_scale
from umbra.drawing.overlay import Ring
from umbra.drawing.planar_regions import PlanarRegions
from umbra.drawing.shaded_surfaces import VisibleRegion
from umbra.machine import choose_threads
from umbra.rays import VisibleSurface
from umbra.rays.depth import GROUND, NOTHING
from umbra.scene import Camera, Light, Scene
from umbra.scene.exposure import GROUND_COLOR, Sky
from umbra.scene.pale import PAPER, make_pale

__all__ = ["color_page"]

_PIXELS = 400  # of the picture in which the sky's light is found, along its longer side
_STOPS = 17  # colours of the sky, evenly spaced
_PAPER, _SHADE = 0.8, 0.2  # light of a hatched drawing: everywhere, and more the higher one looks


def color_page(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    seen: SeenModel,
    style: Style,
    options: DrawingOptions,
    shadows: str,
    ground: float | None,
    sky: Sky,
) -> Page:
    """Give what is seen its colours, and sort it by part."""
    flat = _flatten(make_pale(scene, style.paleness))
    count, is_hatched = len(lights), shadows == "hatched"
    every = tuple(True for _ in lights)
    wanted = [(surface, every) for surface in seen.surfaces]
    wanted += [
        (surface, mask)
        for surface in seen.surfaces
        for mask, _ in surface.shadows
        if not is_hatched
    ]
    part = np.append(seen.regions.part, GROUND)
    frame = _place(wanted, part, camera, seen.origin)
    openness = _find_openness(scene, camera, seen, style, options, ground, wanted)
    if is_hatched:
        linear = _find_paper(flat, frame)
    else:
        reached = [np.array([[mask[k] for _, mask in wanted]]) for k in range(count)]
        linear = find_colors(flat, frame, lights, reached, openness=openness, sky=sky)[0]
    if style.has_backdrop:
        linear[frame.part[0] == GROUND] *= np.array(PAPER) / GROUND_COLOR
    colors: list[Any] = [tuple(rgb) for rgb in encode_srgb(linear).tolist()]
    return Page(
        camera.size, _sort(scene, seen, colors, is_hatched=is_hatched),
        [] if options.transparent else _find_sky(scene, camera, style, sky),
        options.caption, " ".join([tell_scale(camera), *list_losses(scene, lights)]), count,
    )  # fmt: skip


def _flatten(scene: Scene) -> Scene:
    """Return the scene for shading, with the mean colour of textures and vertices."""
    parts = []
    for part in scene.parts:
        color = np.array(part.material.color)
        if part.mesh.colors is not None:
            color = color * part.mesh.colors[:, :3].mean(0)
        if part.material.texture is not None:
            value = part.material.texture[..., :3].reshape(-1, 3) / 255.0
            low = value <= 0.04045  # noqa: PLR2004  (of sRGB, below which it is linear)
            color = color * np.where(low, value / 12.92, ((value + 0.055) / 1.055) ** 2.4).mean(0)
        red, green, blue = np.clip(color, 0.0, 1.0).tolist()
        parts.append(replace(part, material=replace(part.material, color=(red, green, blue))))
    return replace(scene, parts=tuple(parts))


def _place(
    wanted: Sequence[tuple[VisibleRegion, object]],
    part: NDArray[np.integer],
    camera: Camera,
    origin: NDArray[np.float64],
) -> VisibleSurface:
    """Return a row of points, one on each surface."""
    planes = np.array([surface.plane for surface, _ in wanted]).reshape(-1, 4)
    spots = np.array([_find_middle(surface.rings) for surface, _ in wanted]).reshape(-1, 2)
    right, up, forward = camera.axes()
    x, y = (spots - camera.center).T
    pixel = (camera.height or 2 * np.tan(np.radians(camera.fov) / 2)) / camera.size[1]
    across = pixel * (x[:, None] * right - y[:, None] * up)
    start = camera.eye - origin + (0 if camera.is_perspective else across)
    way = forward + (across if camera.is_perspective else 0 * across)
    slope = np.einsum("ij,ij->i", planes[:, :3], way)
    height = np.einsum("ij,ij->i", planes[:, :3], np.broadcast_to(start, way.shape)) + planes[:, 3]
    position = start + (-height / slope)[:, None] * way + origin
    owner = (
        part[[surface.region for surface, _ in wanted]] if len(wanted) else np.zeros(0, np.int32)
    )
    return VisibleSurface(position[None], planes[None, :, :3], owner[None].astype(np.int32))


def _find_middle(rings: Sequence[Ring]) -> NDArray[np.float64]:
    """Return a point on the plane of rings, near the middle of the longest."""
    return np.asarray(max(rings, key=len).mean(0))


def _find_paper(scene: Scene, frame: VisibleSurface) -> NDArray[np.float64]:
    """Return the colours of faces on which shadows are hatched: pale, by where they look."""
    palette = np.array([part.color for part in scene.parts] + [GROUND_COLOR])
    albedo = palette[np.where(frame.part[0] == GROUND, len(scene.parts), frame.part[0])]
    light = _PAPER + _SHADE * np.maximum(frame.normal[0, :, 2], 0.0)
    return light[:, None] * (0.5 + 0.5 * albedo)


def _find_openness(
    scene: Scene,
    camera: Camera,
    seen: SeenModel,
    style: Style,
    options: DrawingOptions,
    ground: float | None,
    wanted: Sequence[tuple[VisibleRegion, object]],
) -> NDArray[np.float32] | None:
    """Find the share of the sky that each surface sees on average, in a small picture."""
    if not style.directions or not wanted:
        return None
    scale = min(1.0, _PIXELS / max(camera.size))
    cols, rows = (max(1, round(scale * n)) for n in camera.size)
    small = replace(camera, size=(cols, rows))
    regions = seen.regions
    owner = np.full(max(sum(part.triangles for part in scene.parts), 1), -1)
    owner[regions.faces] = regions.owner
    casters = scene.select(options.cast, options.no_cast)
    opened = find_device("cpu").open_frames(
        scene, ground, casters=casters, threads=choose_threads(options.threads),
        warn=lambda _line: None,
    )  # fmt: skip
    with opened as counter:
        view, frame = counter.see(small)
        share = find_openness(counter, view, frame, small, style.directions)
    region = np.where(view.face >= 0, owner[np.maximum(view.face, 0)], len(regions))
    is_seen = (view.face != NOTHING) & (region >= 0)
    group = _group(regions)
    seen_groups = group[region[is_seen]]
    sums = np.bincount(seen_groups, share[is_seen], group[-1] + 1)
    pixels = np.bincount(seen_groups, minlength=group[-1] + 1)
    usual = float(share[is_seen].mean()) if is_seen.any() else 1.0
    mean = np.where(pixels > 0, sums / np.maximum(pixels, 1), usual)
    return mean[group[[surface.region for surface, _ in wanted]]].astype(np.float32)[None]


def _group(regions: PlanarRegions) -> NDArray[np.intp]:
    """Return a number for regions of a part that look the same way, (n_regions + 1,)."""
    looks = np.round(regions.planes[:, :3], 1) + 0.0
    keys = np.column_stack([regions.part, looks])
    _, group = np.unique(keys, axis=0, return_inverse=True)
    return np.append(group.ravel(), group.max(initial=-1) + 1)


def _find_sky(
    scene: Scene, camera: Camera, style: Style, sky: Sky
) -> list[tuple[float, tuple[int, int, int]]]:
    """Return the colours behind the model at evenly spaced heights of the picture."""
    shares = np.linspace(0.0, 1.0, _STOPS)
    if style.has_backdrop:
        rows = camera.size[1]
        nothing = np.full((rows, 1), NOTHING, np.int32)
        places = np.full((rows, 1, 3), np.nan)
        line = replace(camera, size=(1, rows))
        behind = Backdrop(scene, sky=sky).color(
            np.zeros((rows, 1, 3)), VisibleSurface(places, places, nothing), line
        )
        linear = behind[np.round(shares * (rows - 1)).astype(np.intp), 0]
    else:
        linear = shares[:, None] * (np.array(sky.horizon) - sky.zenith) + sky.zenith
    return [
        (share, tuple(rgb))
        for share, rgb in zip(shares.tolist(), encode_srgb(linear).tolist(), strict=True)
    ]


def _sort(
    scene: Scene, seen: SeenModel, colors: Sequence[tuple[int, int, int]], *, is_hatched: bool
) -> list[DrawnPart]:
    """Sort polygons and lines by part; the colours are those of surfaces, then of shadows."""
    drawn = {
        index: DrawnPart(part.full_name, part.kind, part.transmits)
        for index, part in enumerate(scene.parts)
    }
    ground = DrawnPart("ground")
    region_part = seen.regions.part
    shade = len(seen.surfaces)
    order: dict[int, DrawnPart] = {}
    for number, surface in enumerate(seen.surfaces):
        is_ground = surface.region == len(seen.regions)
        index = -1 if is_ground else int(region_part[surface.region])
        part = ground if is_ground else drawn[index]
        order[index] = part
        opacity = 1.0 if is_ground else _find_opacity(scene, index)
        part.faces.append(Fill(_shift(surface.rings), colors[number], opacity))
        for mask, rings in surface.shadows:
            if is_hatched:
                dark = (k for k, is_lit in enumerate(mask) if not is_lit)
                part.shadows.extend(Hatching(_shift(rings), k) for k in dark)
            else:
                part.shadows.append(Fill(_shift(rings), colors[shade], opacity))
                shade += 1
    for part in order.values():
        if not part.is_clear:
            part.faces[:] = _merge(part.faces)
            part.shadows[:] = _merge(part.shadows)
    lines = seen.lines
    for segment, region, is_outline in zip(
        lines.segments + 0.5, lines.region.tolist(), lines.is_outline.tolist(), strict=True
    ):
        index = int(region_part[region])
        part = order.setdefault(index, drawn[index])
        (part.outlines if is_outline else part.creases).append(segment)
    return [order[index] for index in sorted(order)]


def _merge(fills: Sequence[Fill | Hatching]) -> list[Any]:
    """
    Return one fill for all rings of a colour, and one of a hatching.

    Rings do not overlap. Where two of one path share an edge, nothing shines between them, as each
    of two paths covers only a part of the pixels along it.
    """
    merged: dict[Any, Fill | Hatching] = {}
    for fill in fills:
        key = fill.light if isinstance(fill, Hatching) else fill.color
        merged.setdefault(key, replace(fill, rings=[])).rings.extend(fill.rings)
    return list(merged.values())


def _find_opacity(scene: Scene, index: int) -> float:
    """Return how much a part hides, on average over its texture and corners."""
    part = scene.parts[index]
    if not part.transmits:
        return 1.0
    material, texture = part.material, part.material.texture
    alpha = 1.0 if texture is None else float(texture[..., 3].mean()) / 255.0
    alpha *= 1.0 if part.mesh.alpha is None else float(part.mesh.alpha.mean())
    return round(material.opacity * alpha, 3)


def _shift(rings: Sequence[Ring]) -> list[Ring]:
    """Move rings from pixels' centres to the page, whose corner is a pixel's corner."""
    return [ring + 0.5 for ring in rings]
