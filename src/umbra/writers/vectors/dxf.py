"""DXF for CAD: closed polylines of shadows, a layer for each instant; lines of equal hours."""

import os
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from umbra.writers.color import make_stamp_tints, shade_ramp
from umbra.writers.vectors.hour_lines import HourLine
from umbra.writers.vectors.outlines import Outline, Polygon

if TYPE_CHECKING:
    from umbra.writers.plan import Show

__all__ = ["write_dxf"]

_INKS = {"CANOPIES": (0.18, 0.43, 0.2)}  # of layers that are not black


def write_dxf(
    path: str | os.PathLike[str],
    outlines: Sequence[Outline],
    hour_lines: Iterable[HourLine],
    *,
    height: float,
    up_hours: float,
    note: str = "",
    seen: Sequence[np.ndarray] = (),
    show: "Show" = "shadow",
    footprints: Mapping[str, Sequence[Polygon]] = MappingProxyType({}),
) -> None:
    """
    Write outlines and lines as lightweight polylines in metres.

    Layers are ``SHADOW_2026-03-21_0900`` (local time), ``HOURS_03`` (hours in shadow) or
    ``SUN_03`` (hours of sun), and what stands there: ``BUILDINGS`` and ``CANOPIES``. Rings, holes
    among them, are closed polylines of one layer: hatching a layer's rings as islands gives its
    shadow.

    Parameters
    ----------
    path : path
    outlines : sequence of Outline
    hour_lines : iterable of HourLine
    height : float
        z of all of them [m].
    up_hours : float
        The end of the colour scale [h].
    note : str
        Kept in the drawing's properties, with its CRS.
    seen : sequence of (k, 2) float64
        Closed borders of what a view sees, for the layer ``SEEN``.
    show : {'shadow', 'sun'}
        Whose whole hours the lines are of.
    footprints : mapping of str to sequence of polygons
        What stands there, by layer, ``BUILDINGS``: of each polygon its rings.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    import ezdxf  # noqa: PLC0415  (an extra)
    from ezdxf import units  # noqa: PLC0415

    drawing = ezdxf.new("R2010", units=units.M)
    drawing.header.custom_vars.append("umbra", note)
    space = drawing.modelspace()

    def add_layer(name: str, rgb: np.ndarray) -> str:
        if name not in drawing.layers:
            layer = drawing.layers.add(name)
            red, green, blue = (int(v) for v in np.round(rgb * 255))
            layer.rgb = (red, green, blue)
        return name

    for layer, polygons in footprints.items():
        name = add_layer(layer, np.array(_INKS.get(layer, (0.0, 0.0, 0.0))))
        for ring in (ring for polygon in polygons for ring in polygon):
            space.add_lwpolyline(ring, close=True, dxfattribs={"layer": name, "elevation": height})
    tints = make_stamp_tints(len(outlines)) * 0.8  # dark enough for white paper
    for outline, tint in zip(outlines, tints, strict=True):
        clock = outline.local
        name = add_layer(f"SHADOW_{clock:%Y-%m-%d_%H%M}{f'{clock:%S}'.replace('00', '')}", tint)
        for polygon in outline.polygons:
            for ring in polygon:
                space.add_lwpolyline(
                    ring, close=True, dxfattribs={"layer": name, "elevation": height}
                )
    for border in seen:
        name = add_layer("SEEN", np.zeros(3))
        space.add_lwpolyline(
            border[:-1], close=True, dxfattribs={"layer": name, "elevation": height}
        )
    ramp = shade_ramp()
    found = list(hour_lines)
    has_dates = len({hour_line.date for hour_line in found}) > 1
    for hour_line in found:
        share = hour_line.shadow_hours / max(up_hours, 1e-9)
        rgb = ramp[int(np.clip(0.3 + 0.7 * share, 0, 1) * (len(ramp) - 1))]
        of = "SUM_" if hour_line.date.startswith("sum") else f"{hour_line.date}_" * has_dates
        name = f"HOURS_{of}{hour_line.shadow_hours:02.0f}"
        if show == "sun":
            name = f"SUN_{of}{hour_line.sun_hours:02.0f}"
        add_layer(name, rgb)
        for line in hour_line.lines:
            closed = bool((line[0] == line[-1]).all())
            space.add_lwpolyline(
                line[:-1] if closed else line,
                close=closed,
                dxfattribs={"layer": name, "elevation": height},
            )
    drawing.saveas(os.fspath(path))
