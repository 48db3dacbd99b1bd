"""Pictures of ``umbra render``, for the command and for Python."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from io import BytesIO
from typing import Any, Literal, ParamSpec, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from umbra.calls.arguments import check_picture_memory, make_camera, tell_moved_parts
from umbra.calls.ground import choose_ground
from umbra.calls.picture_options import RenderOptions
from umbra.devices import find_device
from umbra.errors import check_type
from umbra.machine import choose_threads
from umbra.option_fields import needed, option, record
from umbra.rays.depth import GROUND, NOTHING
from umbra.registry import take_notes
from umbra.scene import Camera, Light, Scene, directional_light
from umbra.scene.lights import SomeLights, make_lights
from umbra.signatures import takes

__all__ = ["Picture", "choose_ground", "draw_picture", "find_own_lights", "render", "tell_near_cut"]

P = ParamSpec("P")
Q = ParamSpec("Q")
Warn = Callable[[str], object]


@dataclass(frozen=True, eq=False)
class Picture:
    """
    Surfaces that a camera sees, and their shadows. Row 0 is the top.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    lights : list of Light
    position : (rows, cols, 3) float64
        Visible point, in the model's own coordinates [m]; NaN where nothing is seen.
    normal : (rows, cols, 3) float64
        Unit normal of the visible side.
    count : (n_lights, rows, cols) int32
        Shadow count: shadow volumes that hold the point, plus triangles with textured holes
        that hide the light.
    lit : (n_lights, rows, cols) bool
        Whether any of the light reaches the point.
    visibility : (n_lights, rows, cols) float32, optional
        For soft shadows: share of the light that opaque casters leave.
    transmission : (n_lights, rows, cols, 3) float32, optional
        With transparent parts or holes in textures: share of each colour of the light that
        these transmit.
    """

    scene: Scene
    camera: Camera
    lights: list[Light]
    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    count: NDArray[np.int32]
    lit: NDArray[np.bool_]
    visibility: NDArray[np.float32] | None
    transmission: NDArray[np.float32] | None
    _shade: Callable[[], NDArray[np.uint8]] = field(repr=False)

    @cached_property
    def image(self) -> NDArray[np.uint8]:
        """The picture in sRGB, (rows, cols, 3) uint8; shaded on first use."""
        return self._shade()

    @property
    def is_seen(self) -> NDArray[np.bool_]:
        """Pixels with a visible surface, (rows, cols)."""
        return ~np.isnan(self.position[..., 0])

    def arrays(self) -> dict[str, NDArray]:
        """Return the arrays by name, as ``umbra render`` writes them."""
        names = ("position", "normal", "count", "lit", "visibility", "transmission")
        arrays = {name: getattr(self, name) for name in names}
        return {name: array for name, array in arrays.items() if array is not None}

    def sum_up(self) -> dict[str, Any]:
        """Return its numbers, for ``--json``."""
        seen = int(self.is_seen.sum())
        return {
            "pixels": seen,
            "deepest_count": [int(n.max()) for n in self.count],
            "lit_share": [float(m.sum() / max(seen, 1)) for m in self.lit],
        }

    def _repr_png_(self) -> bytes:
        from umbra.writers.pixels import write_png  # noqa: PLC0415

        file = BytesIO()
        write_png(file, self.image)
        return file.getvalue()


@record
class PictureOptions(RenderOptions):
    """Options of ``umbra.render``."""

    arrays: bool = option(
        "flag", "Return the whole `Picture`, whose arrays hold the pixels' centres.",
        default=False, flag=None,
    )  # fmt: skip


@record
class _ArrayOptions(RenderOptions):
    arrays: Literal[True] = needed("flag", flag=None)


@record
class _ImageOptions(RenderOptions):
    arrays: Literal[False] = option("flag", flag=None)


class RenderCall(Protocol[P, Q]):
    """The signature of ``umbra.render``."""

    @overload
    def __call__(
        self, scene: Scene, camera: Camera | None = None, lights: SomeLights = (), *_: P.args,
        **options: P.kwargs,
    ) -> Picture: ...  # fmt: skip
    @overload
    def __call__(
        self, scene: Scene, camera: Camera | None = None, lights: SomeLights = (), *_: Q.args,
        **options: Q.kwargs,
    ) -> NDArray[np.uint8]: ...  # fmt: skip


def _take(_arrays: Callable[P, Any], _image: Callable[Q, Any]) -> Callable[[Any], RenderCall[P, Q]]:
    return takes(PictureOptions, "a picture")


@_take(_ArrayOptions, _ImageOptions)
def render(
    scene: Scene,
    camera: Camera | None = None,
    lights: SomeLights = (),
    *,
    options: PictureOptions,
) -> NDArray[np.uint8] | Picture:
    """
    Draw a picture with exact hard shadows of any number of lights, or with soft ones.

    Parameters
    ----------
    scene : Scene
        From ``umbra.read``.
    camera : Camera, optional
        The whole model from above by default; see ``umbra.make_camera``.
    lights : Light, (n, 4) float, or a sequence of either
        In ``(x, y, z, w)`` w = 1 is a point [m], w = 0 a direction toward the light. By
        default the file's lights, or one from the upper left; ``umbra.sun_light`` is the sun.
    options : PictureOptions
        Each by its name.

    Returns
    -------
    image : (rows, cols, 3) uint8
        sRGB, 4 channels if transparent; row 0 is the top. With ``arrays`` a `Picture`, whose
        ``position``, ``normal``, ``count``, ``lit`` and ``image`` are arrays.

    Raises
    ------
    InputError
        If an argument is wrong, or the picture does not fit in memory.
    UmbraError
        If the device does not run here.

    Warns
    -----
    UserWarning
        If nothing is seen, the near plane cuts the model, or the method gives wrong shadows
        in this view.

    Examples
    --------
    >>> scene = umbra.read("quarter.city.json")
    >>> sun = umbra.sun_light(umbra.find_site(scene), "2026-03-21", "15:00")
    >>> image = umbra.render(scene, lights=sun)
    """
    check_type("scene", scene, Scene)
    if camera is not None:
        check_type("camera", camera, Camera)
    camera = make_camera(scene) if camera is None else camera
    said: list[str] = []
    shining, is_bare = make_lights(lights), options.arrays
    picture = draw_picture(scene, camera, shining, options, said.append, is_bare=is_bare)
    for text in said:
        warnings.warn(text, stacklevel=3)
    return picture if is_bare else picture.image


def draw_picture(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    options: RenderOptions,
    warn: Warn,
    casters: list[int] | None = None,
    *,
    is_bare: bool = True,
    is_filed: bool = False,
    tell: Warn = lambda _line: None,
    advance: Callable[[int, int], object] = lambda _done, _of: None,
) -> Picture:
    """
    Draw a picture; by default with the scene's own lights, or one from the upper left.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    lights : sequence of Light
    options : RenderOptions
    warn : callable
        Called with a line on each problem of the view or the method.
    casters : list of int, optional
        Indices of the parts that cast; from the options by default.
    is_bare : bool
        Whether the picture is of the surfaces that the arrays hold, and no others.
    is_filed : bool
        Whether it is written to a file, where plain pictures have a ground, too.
    tell : callable
        Called with a line on each assumption.
    advance : callable
        Called with the number of samples of each pixel that are drawn, and of all.
    """
    from umbra.calls.antialiasing import PictureLights, average_colors  # noqa: PLC0415
    from umbra.calls.finish import finish  # noqa: PLC0415
    from umbra.calls.lines import LineFinder  # noqa: PLC0415
    from umbra.calls.styles import Backdrop, choose_style, expose_by_style, find_sky  # noqa: PLC0415
    from umbra.scene.pale import make_pale  # noqa: PLC0415
    from umbra.soft import size_lights  # noqa: PLC0415
    from umbra.writers.typeface import note_missing  # noqa: PLC0415

    if options.caption and (lacking := note_missing(options.caption)):
        warn(lacking)
    for note in take_notes():
        warn(note)
    shining = list(lights) or find_own_lights(scene, camera, is_bare=is_bare)
    check_picture_memory(camera.size, len(shining))
    threads = choose_threads(options.threads)
    device, said = find_device(options.device), WarnOnce(warn)
    if casters is None and (options.cast or options.no_cast):
        casters = scene.select(options.cast, options.no_cast)
    style = choose_style(options.style, scene, is_bare=is_bare, is_filed=is_filed)
    if not (style.is_plain or is_bare):
        options = options.soften(shining)
    sized = size_lights(shining, options.light_size) if options.is_soft else []  # type: ignore[arg-type]
    is_all = casters is None or len(casters) == len(scene.parts)
    scene, ground = choose_ground(scene, options, style, tell)
    casters = None if is_all else casters
    shown = make_pale(scene, style.paleness)
    sky = find_sky(shining, style, tell)
    backdrop = Backdrop(scene, options.transparent, sky)
    how = {"casters": casters, "threads": threads, "warn": said, "detail": options.detail}
    with device.open_frames(scene, ground, **how) as counter:  # type: ignore[arg-type]
        view, frame = counter.see(camera)
        _warn_of_view(scene, camera, frame, threads, warn, is_assumed=options.ground is None)
        shadows = PictureLights(
            counter, expose_by_style(shining, style), sized, options, style,
            backdrop if style.has_backdrop or options.transparent else None,
            LineFinder(scene) if style.has_lines else None, sky,
        )  # fmt: skip
        layers = shadows.find_layers(view, frame, camera)
        averages = None
        if options.samples > 1:
            averages = average_colors(shown, camera, shadows, layers, advance)
        tell_moved_parts(tell, counter.moved, options.detail)

    def draw() -> NDArray[np.uint8]:
        image = averages or average_colors(shown, camera, shadows, layers)
        return finish(image, style, options)

    seen = layers[0].seen
    hidden = np.zeros((), np.int32) if seen.hidden is None else np.stack(seen.hidden)
    return Picture(
        scene,
        camera,
        shining,
        frame.position,
        frame.normal,
        np.stack(seen.counts).astype(np.int32) + hidden,
        np.stack(seen.lit) & (hidden == 0),
        None if seen.visibility is None else np.stack(seen.visibility),
        None if seen.transmission is None else np.stack(seen.transmission),
        draw,
    )


class WarnOnce:
    """Filter that passes each text once, for any number of samples."""

    def __init__(self, warn: Warn) -> None:
        self._warn, self._said = warn, set[str]()

    def __call__(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self._warn(text)


def find_own_lights(scene: Scene, camera: Camera, *, is_bare: bool) -> list[Light]:
    """Return the scene's own lights, or one from the upper left, behind the camera."""
    from umbra.scene.exposure import expose_lights  # noqa: PLC0415

    if own := list(expose_lights(scene)):
        return own
    right, up, forward = camera.axes()
    if is_bare:
        return [directional_light(-0.6 * right + 0.9 * up - 0.5 * forward)]
    ahead = np.cross(camera.up, right)
    ahead, rise = (v / np.linalg.norm(v) for v in (ahead, camera.up))
    return [directional_light(-0.8 * right - 0.4 * ahead + 0.75 * rise)]


def _warn_of_view(
    scene: Scene, camera: Camera, frame: Any, threads: int, warn: Warn, *, is_assumed: bool
) -> None:
    """Warn if the picture shows nothing but an assumed ground, or the near plane cuts the model."""
    if ((frame.part == NOTHING) | (is_assumed & (frame.part == GROUND))).all():
        middle = ", ".join(f"{v:g}" for v in scene.model_bounds().mean(0))
        warn(
            "nothing is seen; leave out eye= and target= to see all of it, or look at its middle: "
            f"target=({middle})"
        )
    for text in tell_near_cut(scene, camera, threads):
        warn(text)


def tell_near_cut(scene: Scene, camera: Camera, threads: int) -> list[str]:
    """Return a line if the near plane cuts the model."""
    from umbra.rays import count_cut  # noqa: PLC0415

    cut = count_cut(scene, camera, threads)
    text = (
        f"the near plane, {camera.near:g} m before the eye, cuts the model open in {cut} "
        "pixels; give a smaller near= or move eye= away"
    )
    return [text] if cut else []
