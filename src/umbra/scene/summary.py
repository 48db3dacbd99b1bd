"""What a scene shows of itself at a prompt and in a notebook: its size, and its first parts."""

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from umbra.printable import fit_names, make_printable

if TYPE_CHECKING:
    from umbra.scene.scene import Scene

__all__ = ["show_scene", "show_scene_as_html"]

_MOST = 6  # parts that are listed
_WIDTH = 40  # letters of a name


def show_scene(scene: "Scene") -> str:
    """Give a scene's size and its first parts as a table, ten lines at most."""
    listed = scene.parts[:_MOST]
    names = fit_names([make_printable(part.name) for part in listed], _WIDTH)
    kinds = fit_names([make_printable(part.kind) for part in listed], _WIDTH // 2)
    wide, wider = (max(map(len, [*column, "name"])) for column in (names, kinds))
    rows = [f"{'name':{wide}}  {'kind':{wider}}  triangles"]
    rows += [
        f"{name:{wide}}  {kind:{wider}}  {part.triangles:9,}"
        for name, kind, part in zip(names, kinds, listed, strict=True)
    ]
    return "\n".join([*_sum_up(scene), *rows, *_tell_more(scene)])


def show_scene_as_html(scene: "Scene") -> str:
    """Give the same as HTML."""
    rows = "".join(
        f"<tr><td>{escape(make_printable(part.name))}</td>"
        f"<td>{escape(make_printable(part.kind))}</td>"
        f"<td style='text-align:right'>{part.triangles:,}</td></tr>"
        for part in scene.parts[:_MOST]
    )
    return (
        f"<p>{'<br>'.join(map(escape, _sum_up(scene)))}</p>"
        "<table><thead><tr><th>name</th><th>kind</th><th>triangles</th></tr></thead>"
        f"<tbody>{rows}</tbody></table><p>{'<br>'.join(map(escape, _tell_more(scene)))}</p>"
    )


def _sum_up(scene: "Scene") -> list[str]:
    triangles = sum(part.triangles for part in scene.parts)
    head = f"Scene: {len(scene.parts):,} parts, {triangles:,} triangles"
    if not scene.parts:
        return [head]
    low, high = scene.bounds()
    size = " x ".join(f"{length:.2f}" for length in np.subtract(high, low))
    place = ", ".join(f"{value:.2f}" for value in low)
    crs = f" ({make_printable(scene.crs)[:60]})" if scene.crs else ""
    return [head, f"{size} m, from {place}{crs}"]


def _tell_more(scene: "Scene") -> list[str]:
    more = len(scene.parts) - _MOST
    return [f"and {more:,} more in scene.parts"] if more > 0 else []
