"""
ezdxf on one DXF file: its closed polylines and hatches as outlines, named by text inside or layers.

This runs in a child process (`umbra.readers.area_file`), as a file can ask for any amount of work.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import find_reason
from umbra.readers.footprint_table import FootprintTable, Rings
from umbra.readers.model import UniqueNames

__all__ = ["FootprintTable", "Rings", "read_outlines"]

_SAGITTA = 0.01  # greatest distance of a chord from its arc [drawing unit]
_QUERY = "LWPOLYLINE POLYLINE HATCH CIRCLE ELLIPSE"


def read_outlines(path: str) -> Iterator[FootprintTable]:
    """Read the closed outlines of a drawing's model space: yield one table."""
    ezdxf = need("ezdxf", "dxf", "DXF")
    from ezdxf import path as outlines  # noqa: PLC0415
    from ezdxf import units  # noqa: PLC0415

    try:
        drawing = ezdxf.readfile(path)
    except (OSError, MemoryError):
        raise
    except Exception as error:
        msg = f"cannot be read as DXF ({find_reason(error, 160)}); save it again as DXF"
        raise InputError(msg) from error
    space, left = drawing.modelspace(), Counter[str]()
    polygons: list[list[list[Any]]] = []
    layers: list[str] = []
    for entity in space.query(_QUERY):
        if entity.dxftype() == "HATCH":
            paths = [loop for loop in outlines.from_hatch(entity) if len(loop)]
        else:
            loop = outlines.make_path(entity)
            if not loop.is_closed:
                left["polylines that are not closed left out"] += 1
                continue
            paths = [loop]
        loops = [[(p.x, p.y) for p in loop.flattening(_SAGITTA)] for loop in paths]
        loops = [loop[:-1] if loop[0] == loop[-1] else loop for loop in loops if loop]
        # The outside of a hatch is its largest loop; the others are holes.
        loops.sort(key=lambda loop: -abs(_measure(np.array(loop))))
        if loops and abs(_measure(np.array(loops[0]))) > 0:
            polygons.append([loops[0]] if entity.dxftype() != "HATCH" else loops)
            layers.append(str(entity.dxf.layer))
    unit = units.InsertUnits(int(drawing.units))
    scale = units.conversion_factor(unit, units.InsertUnits.Meters) if unit else 1.0
    names = _name(polygons, layers, space)
    notes = [f"{what}: {count}" for what, count in left.items()]
    if unit and scale != 1.0:
        notes.append(f"the drawing is in {units.decode(unit)}, turned into metres")
    points = [corner for loops in polygons for loop in loops for corner in loop]
    rings = Rings(
        scale * np.array(points, np.float64).reshape(-1, 2),
        np.array([len(loop) for loops in polygons for loop in loops], np.int64),
        np.array([k for k, loops in enumerate(polygons) for _ in loops], np.int64),
        np.arange(len(polygons), dtype=np.int64),
    )
    columns: dict[str, list[Any]] = {"layer": list(layers)}
    yield FootprintTable("DXF", rings, list(names), columns, None, tuple(notes))


def _measure(loop: Any) -> float:
    """Return the signed area of a loop (n, 2)."""
    x, y = (loop - loop[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def _name(polygons: list[list[list[Any]]], layers: list[str], space: Any) -> list[str]:
    """Name each outline by the text that lies in it, else by its layer, numbered."""
    from matplotlib.path import Path as Loop  # noqa: PLC0415

    words = []
    for text in space.query("TEXT MTEXT"):
        plain = text.plain_text() if text.dxftype() == "MTEXT" else text.dxf.text
        words.append((tuple(text.dxf.insert)[:2], " ".join(str(plain).split())))
    sizes = [abs(_measure(np.array(loops[0]))) for loops in polygons]
    places = np.array([point for point, _ in words], np.float64).reshape(-1, 2)
    # Of nested outlines the smallest has the text.
    owners = np.full(len(words), -1)
    for k in np.argsort(sizes, kind="stable").tolist():
        left = np.flatnonzero(owners < 0)
        owners[left[Loop(polygons[k][0]).contains_points(places[left])]] = k
    own: dict[int, str] = {}
    for owner, (_, word) in zip(owners.tolist(), words, strict=True):
        if word:
            own.setdefault(owner, word)
    unique = UniqueNames()
    return [unique.add(own.get(k, layer)) for k, layer in enumerate(layers)]
