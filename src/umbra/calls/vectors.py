"""Drawings of ``umbra render --out FILE.svg`` and ``umbra.draw_vectors``, as vectors."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol

import numpy as np

from umbra.calls.arguments import make_camera
from umbra.calls.ground import choose_ground
from umbra.calls.picture import find_own_lights, tell_near_cut
from umbra.calls.picture_options import VECTORS, DrawingOptions, ShadowOptions
from umbra.drawing import SeenModel, see_model
from umbra.drawing.drawn_page import Page, list_losses
from umbra.errors import InputError, check_type
from umbra.option_fields import record
from umbra.packages import require
from umbra.scene import Camera, Light, Scene
from umbra.scene.exposure import DAY
from umbra.scene.lights import SomeLights, make_lights
from umbra.signatures import takes

if TYPE_CHECKING:
    import os

__all__ = ["VectorDrawing", "draw_seen", "draw_vectors"]

MOST = 300_000
"""Most triangles of a drawing: Delft's 48,000 take 10 s of the processor."""
_UNTOLD = {"method": "auto", "soft": None, "mask_scale": 1}
"""Options of pictures that drawings do not have, and their values."""

P = ParamSpec("P")
Advance = Callable[[int, int, str, str], object]


@dataclass(frozen=True, eq=False)
class VectorDrawing:
    """
    What a camera sees, as exact polygons and lines.

    Parameters
    ----------
    seen : SeenModel
        ``seen.surfaces`` holds each visible planar surface with its shadows, ``seen.lines`` the
        visible outlines and creases; in pixels, (0, 0) the centre of the upper left one.
    page : Page
        The same with colours, by part, (0, 0) being the upper left corner.
    notes : list of str
        What is left out.
    """

    seen: SeenModel
    page: Page
    notes: list[str]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write it as SVG or PDF, by the file's ending; an existing file is replaced."""
        from umbra.folders.atomic import replace_file  # noqa: PLC0415

        file = Path(path)
        with replace_file(file) as beside:
            self.write_beside(beside, find_vector_format(file))

    def write_beside(self, path: Path, kind: str) -> None:
        """Write it in a format, whatever the file is called."""
        from umbra.writers.drawing_pdf import write_drawing_pdf  # noqa: PLC0415
        from umbra.writers.drawing_svg import write_drawing_svg  # noqa: PLC0415

        {"svg": write_drawing_svg, "pdf": write_drawing_pdf}[kind](path, self.page)

    def sum_up(self) -> dict[str, int]:
        """Return its numbers, for ``--json``."""
        surfaces = self.seen.surfaces
        shadows = sum(len(surface.shadows) for surface in surfaces)
        return {"faces": len(surfaces), "shadows": shadows, "lines": len(self.seen.lines.segments)}

    def _repr_svg_(self) -> str:
        from umbra.writers.drawing_svg import tell_svg  # noqa: PLC0415

        return "\n".join(tell_svg(self.page))


def find_vector_format(path: Path) -> str:
    """Return svg or pdf, by a file's ending; `InputError` if it is neither."""
    kind = path.suffix.lower().removeprefix(".")
    if kind not in VECTORS:
        msg = f"a drawing is SVG or PDF; name '{path}' {path.with_suffix('.svg').name}"
        raise InputError(msg)
    return kind


@record
class VectorOptions(ShadowOptions, DrawingOptions):
    """Options of ``umbra.draw_vectors``."""


class VectorCall(Protocol[P]):
    """The signature of ``umbra.draw_vectors``."""

    def __call__(
        self, scene: Scene, camera: Camera | None = None, lights: SomeLights = (), *_: P.args,
        **options: P.kwargs,
    ) -> VectorDrawing: ...  # fmt: skip


def _take(record: Callable[P, VectorOptions]) -> Callable[[Any], VectorCall[P]]:
    return takes(record, "a drawing")


@_take(VectorOptions)
def draw_vectors(
    scene: Scene,
    camera: Camera | None = None,
    lights: SomeLights = (),
    *,
    options: VectorOptions,
) -> VectorDrawing:
    """
    Draw a picture as vectors: visible faces, exact shadows on them, outlines and creases.

    Parameters
    ----------
    scene, camera, lights
        As for `umbra.render`; no spots, and no lamps of a limited range.
    options : VectorOptions
        Each by its name.

    Returns
    -------
    drawing : VectorDrawing
        ``drawing.write("quarter.svg")`` writes SVG or PDF.

    Raises
    ------
    InputError
        If an argument is wrong, the model is too large, or pyclipr is not installed.

    Warns
    -----
    UserWarning
        If nothing is seen, the near plane cuts the model, or a drawing leaves something out of
        the picture.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> sun = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    >>> umbra.draw_vectors(scene, lights=sun, shadows="hatched").write("quarter.pdf")
    """
    check_type("scene", scene, Scene)
    if camera is not None:
        check_type("camera", camera, Camera)
    view = make_camera(scene) if camera is None else camera
    drawing = draw_seen(scene, view, make_lights(lights), options, options.shadows)
    for note in drawing.notes:
        warnings.warn(note, stacklevel=3)
    return drawing


def draw_seen(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    options: DrawingOptions,
    shadows: str = "solid",
    *,
    is_filed: bool = False,
    tell: Callable[[str], object] = lambda _line: None,
    advance: Advance = lambda *_told: None,
) -> VectorDrawing:
    """Draw a view as vectors; by default with the scene's lights, or one from the upper left."""
    from umbra.calls.colors import color_page  # noqa: PLC0415
    from umbra.calls.styles import choose_style, find_sky  # noqa: PLC0415

    require(["pyclipr"], "vectors", "a drawing as vectors")
    _check(scene, options)
    shining = list(lights) or find_own_lights(scene, camera, is_bare=False)
    _check_cones(shining)
    style = choose_style(options.style, scene, is_bare=False, is_filed=is_filed)
    scene, ground = choose_ground(scene, options, style, tell)
    casters = scene.select(options.cast, options.no_cast)
    seen = see_model(scene, camera, shining, casters, ground, advance)
    advance(0, 1, "finding colours", "views")
    sky = DAY if shadows == "hatched" else find_sky(shining, style, tell)
    page = color_page(scene, camera, shining, seen, style, options, shadows, ground, sky)
    notes = tell_near_cut(scene, camera, options.threads or 1) + list_losses(scene, shining)
    if not any(surface.region < len(seen.regions) for surface in seen.surfaces):
        notes.insert(0, "nothing of the model is seen; leave out eye= and target= to see all of it")
    return VectorDrawing(seen, page, notes)


def _check(scene: Scene, options: DrawingOptions) -> None:
    """Refuse what no drawing can show."""
    for name, usual in _UNTOLD.items():
        if getattr(options, name, usual) != usual:
            msg = f"{name}= is for pictures (PNG); drawings as vectors have exact hard shadows"
            raise InputError(msg, option=name)
    triangles = sum(part.triangles for part in scene.parts)
    if triangles > MOST:
        msg = (
            f"a drawing as vectors has at most {MOST:,} triangles, and this model {triangles:,}; "
            "read a part of it (bbox=), or write a PNG"
        )
        raise InputError(msg, option="bbox", triangles=triangles)


def _check_cones(lights: Sequence[Light]) -> None:
    """Refuse lights whose reach ends in curves."""
    wrong = [
        k for k, light in enumerate(lights, 1) if light.axis is not None or light.range < np.inf
    ]
    if wrong:
        msg = (
            f"{len(wrong)} of {len(lights)} lights are spots or end at a range (first: light "
            f"{wrong[0]}), and vectors have no curves; write a PNG, or give directions and points"
        )
        raise InputError(msg)
