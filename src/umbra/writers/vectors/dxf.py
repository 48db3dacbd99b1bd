"""DXF for CAD: shadows and footprints as closed polylines, and lines of equal hours."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.ground.level import TERRAIN
from umbra.study import Study
from umbra.writers.pixels import make_stamp_tints, shade_ramp
from umbra.writers.vectors import HourLine
from umbra.writers.vectors.outlines import LATTICE, Polygon, ShadowOutline, gather

if TYPE_CHECKING:
    from umbra.writers.picture_content import Show

__all__ = ["find_footprints", "write_dxf"]

_FLAT = 1e-9  # a triangle of less area seen from above is a wall [m2]


def find_footprints(study: Study) -> dict[str, list[Polygon]]:
    """
    Find the footprint of each object on the ground, in the model's own coordinates [m].

    Parts of one name in one layer, such as the roof and the walls of a house, are one object. Under
    ``BUILDINGS`` and, where there are canopies, ``CANOPIES``: of each polygon its rings.
    """
    scene, grid = study.model.scene, study.grid
    soup = scene.triangles()  # canopies too, which receive nothing
    level = study.ground - float(scene.origin[2])
    corners = soup.vertices[soup.faces]
    lies = np.array([part.kind in TERRAIN for part in scene.parts])
    stands = ~lies[soup.part] & (corners[..., 2].max(1) > level + LATTICE)
    flat = corners[stands][..., :2]
    first, second = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    flat = np.where((area < 0)[:, None, None], flat[:, ::-1], flat)  # all counter-clockwise
    is_wall = np.abs(area) < _FLAT
    canopy = set(study.model.canopy.parts) if study.model.canopy is not None else set()
    is_canopy = np.isin(soup.part[stands], list(canopy))
    group = scene.groups()[soup.part[stands]]
    shift = np.array([study.x[0] - grid.x0, study.y[0] - grid.y0])
    footprints: dict[str, list[Polygon]] = {}
    for layer, chosen in (("BUILDINGS", ~is_canopy), ("CANOPIES", is_canopy)):
        which = np.flatnonzero(chosen & ~is_wall)
        order = which[np.argsort(group[which], kind="stable")]
        pieces = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
        polygons = [
            polygon for piece in pieces if len(piece) for polygon in _unite(flat[piece], shift)
        ]
        if polygons:
            footprints[layer] = polygons
    return footprints


def _unite(triangles: NDArray[np.float64], shift: NDArray[np.float64]) -> list[Polygon]:
    """Unite triangles (n, 3, 2), all wound alike."""
    import pyclipr  # noqa: PLC0415  (an extra)

    corner = triangles.min((0, 1))
    clipper = pyclipr.Clipper()
    clipper.scaleFactor = round(1 / LATTICE)
    clipper.addPaths(list(triangles - corner), pyclipr.Subject, False)
    polygons: list[Polygon] = []
    gather(clipper.execute2(pyclipr.Union, pyclipr.FillRule.NonZero), polygons)
    return [[ring + corner + shift for ring in polygon] for polygon in polygons]


_INKS = {"CANOPIES": (0.18, 0.43, 0.2)}  # of layers that are not black


def write_dxf(
    path: str | os.PathLike[str],
    outlines: Sequence[ShadowOutline],
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
    Write outlines and lines as lightweight polylines in metres, all at z = ``height`` [m].

    Layers are ``SHADOW_2026-03-21_0900`` (local time), ``HOURS_03`` (hours in shadow) or
    ``SUN_03`` (hours of sun, chosen by ``show``), and footprints: ``BUILDINGS`` and
    ``CANOPIES``, the polygons of ``footprints``; ``SEEN`` has the closed borders (k, 2) of what a
    view sees. Rings, holes among them, are closed polylines of one layer: hatching a layer's rings
    as islands gives its shadow. ``up_hours`` is the end of the colour scale [h]; the note is kept
    in the drawing's properties, with its CRS.
    """
    import ezdxf  # noqa: PLC0415  (an extra)
    from ezdxf import units  # noqa: PLC0415

    drawing = ezdxf.new("R2010", units=units.M)
    drawing.header.custom_vars.append("umbra", note)
    space = drawing.modelspace()

    def draw(lines: Iterable[np.ndarray], layer: str, rgb: np.ndarray) -> None:
        """Draw polylines (k, 2), closed where they end as they begin."""
        if layer not in drawing.layers:
            red, green, blue = (int(v) for v in np.round(rgb * 255))
            drawing.layers.add(layer).rgb = (red, green, blue)
        for line in lines:
            is_closed = bool((line[0] == line[-1]).all())
            space.add_lwpolyline(
                line[:-1] if is_closed else line, close=is_closed,
                dxfattribs={"layer": layer, "elevation": height},
            )  # fmt: skip

    def close(polygons: Iterable[Polygon]) -> Iterator[np.ndarray]:
        return (np.concatenate([ring, ring[:1]]) for polygon in polygons for ring in polygon)

    for layer, polygons in footprints.items():
        draw(close(polygons), layer, np.array(_INKS.get(layer, (0.0, 0.0, 0.0))))
    tints = make_stamp_tints(len(outlines)) * 0.8  # dark enough for white paper
    for outline, tint in zip(outlines, tints, strict=True):
        clock = outline.local
        layer = f"SHADOW_{clock:%Y-%m-%d_%H%M}{f'{clock:%S}'.replace('00', '')}"
        draw(close(outline.polygons), layer, tint)
    if seen:
        draw(seen, "SEEN", np.zeros(3))
    ramp = shade_ramp()
    lines = list(hour_lines)
    has_dates = len({hour_line.date for hour_line in lines}) > 1
    for hour_line in lines:
        share = hour_line.shadow_hours / max(up_hours, 1e-9)
        rgb = ramp[int(np.clip(0.3 + 0.7 * share, 0, 1) * (len(ramp) - 1))]
        of = "SUM_" if hour_line.date.startswith("sum") else f"{hour_line.date}_" * has_dates
        is_sun = show == "sun"
        hours = hour_line.sun_hours if is_sun else hour_line.shadow_hours
        draw(hour_line.lines, f"{'SUN' if is_sun else 'HOURS'}_{of}{hours:02.0f}", rgb)
    drawing.saveas(os.fspath(path))
