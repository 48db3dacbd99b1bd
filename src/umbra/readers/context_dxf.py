"""
ezdxf on one DXF file: its lines, polylines, arcs and hatches, by layer.

This runs in a child process (`umbra.readers.context_file`), as a file can ask for any amount of
work.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.checks import find_reason
from umbra.readers.context_table import ContextTable, make_context_table, name_context_kind

__all__ = ["ContextTable", "read_drawing"]

_SAGITTA = 0.05  # greatest distance of a chord from its arc [drawing unit]
_QUERY = "LINE LWPOLYLINE POLYLINE HATCH CIRCLE ELLIPSE ARC SPLINE"


def read_drawing(path: str) -> Iterator[ContextTable]:
    """Read the lines of a drawing's model space: yield one table."""
    ezdxf = need("ezdxf", "dxf", "DXF")
    from ezdxf import path as outlines  # noqa: PLC0415
    from ezdxf import units  # noqa: PLC0415

    try:
        drawing = ezdxf.readfile(path)
        lines: list[tuple[Any, bool, int]] = []
        kinds: list[str] = []
        for entity in drawing.modelspace().query(_QUERY):
            is_hatch = entity.dxftype() == "HATCH"
            loops = outlines.from_hatch(entity) if is_hatch else [outlines.make_path(entity)]
            for loop in loops:
                if len(loop):
                    points = [(p.x, p.y) for p in loop.flattening(_SAGITTA)]
                    lines.append((points, bool(is_hatch or loop.is_closed), len(kinds)))
            kinds.append(name_context_kind({}, str(entity.dxf.layer), Path(path).stem))
        unit = units.InsertUnits(int(drawing.units))
        scale = units.conversion_factor(unit, units.InsertUnits.Meters) if unit else 1.0
    except (OSError, MemoryError):
        raise
    except Exception as error:
        msg = f"cannot be read as DXF ({find_reason(error, 160)}); save it again as DXF"
        raise InputError(msg) from error
    table = make_context_table(lines, kinds)
    metres = table.points * np.float64(scale)
    yield ContextTable(metres, table.lengths, table.is_ring, table.feature, table.kinds)
