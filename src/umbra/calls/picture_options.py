"""
Options of pictures and windows: each with its type, default, unit, help, flag and heading.

These records are the options of ``umbra render`` and ``umbra view``, and the signatures and
docstrings of ``umbra.render`` and ``umbra.show``.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from umbra.devices import DEFAULT, DEVICES, find_device
from umbra.errors import InputError, make_printable, show_value
from umbra.methods import MASK_FILTERS, MASK_SCALES, SOFT, Softness
from umbra.option_fields import Given, Options, again, check_types, option, record
from umbra.study.options import StudyOptions

if TYPE_CHECKING:
    from umbra.calls.study_result import ShadowStudy
    from umbra.scene import Light

__all__ = [
    "SHADOWS",
    "VECTORS",
    "DrawingOptions",
    "RenderOptions",
    "ShadowOptions",
    "ViewOptions",
]

VECTORS = ("svg", "pdf")
"""Formats of drawings as vectors, by the endings of their files."""
SHADOWS = ("solid", "hatched")
"""How such a drawing shows shadows."""


_lights = partial(option, heading="Lights")
_counting = partial(option, heading="Counting")
_window = partial(option, heading="Window")
_casters = partial(option, heading="Casters")
_MOST_SAMPLES, _MOST_PLACES = 64, 4096


def _tell_methods() -> str:
    """List the methods of the default device, and further methods of others."""
    own = DEVICES[DEFAULT].methods.hard
    texts = [", ".join(own[:-1]) + f" or {own[-1]}"]
    for device in DEVICES.values():
        more = [method for method in device.methods.hard if method not in own]
        if more:
            texts.append(f"on {device.name} also {', '.join(more[:-1])} or {more[-1]}")
    return "; ".join(texts) + "."


_study = partial(again, StudyOptions)
_ground = partial(
    option, "ground",
    "What the ground is: feet, a surface through the feet of the buildings; level, a plane at "
    "their median height; a height [m]; or a terrain file. Default: as umbra study assumes.",
    unit="m", metavar="feet|level|Z|FILE", off="--no-ground",
)  # fmt: skip
_looks = partial(option, heading="Style")
_mask_scale = partial(
    _counting, "choice",
    "With gl: count in a picture with this fraction of the width and height: 1, 1/2 or 1/4.",
    default=1, choices=MASK_SCALES,
)  # fmt: skip
_mask_filter = partial(
    _counting, "choice",
    "How to enlarge that picture: joint interpolates only within a surface.",
    default="joint", choices=MASK_FILTERS,
)  # fmt: skip
_detail = partial(
    _counting, "number",
    "With gl: largest error of hard shadows [pixels], which are cast from coarser meshes where "
    "it allows; 0: all are exact.",
    default=0.0, metavar="PIXELS",
)  # fmt: skip
_length = partial(
    _lights, "number",
    "With layers after Weng: reach of the widest, in tenths of the silhouette's radius.",
    default=Softness.length, metavar="N",
)  # fmt: skip
_gap = partial(
    _lights, "number", "With layers after Weng: distance between neighbours, in the same unit.",
    default=Softness.gap, metavar="N",
)  # fmt: skip


@record
class DrawingOptions(Options):
    """Options of pictures of pixels and of vectors."""

    cast: Sequence[str] = _study("cast")
    no_cast: Sequence[str] = _study("no_cast")
    ground: Given[float | str | Path | bool | None, float | str | bool | None] = _ground(
        more="False: none. Default: one in files; none in arrays and plain images in memory.",
        heading="Style",
        passes=(False,),
    )  # fmt: skip
    style: str = _looks(
        "choice",
        "architectural: pale, with lines, a ground, and ambient occlusion; material: "
        "the model's colours, without lines; plain: surfaces, shadows and, in files, a ground. "
        "auto: material for models with textures or gloss, plain with arrays.",
        default="auto", choices=("auto", "architectural", "material", "plain"),
    )  # fmt: skip
    transparent: bool = _looks("flag", "Leave the background out (PNG with alpha).", default=False)
    caption: str = _looks(
        "text", "A line at the foot of the picture; default: of umbra render with date= the time "
        "and place.", default="", metavar="TEXT",
    )  # fmt: skip
    threads: int | None = _study("threads", heading="Counting", is_kept=True)

    def __post_init__(self) -> None:
        check_types(self)
        if not isinstance(self.caption, str):
            msg = f"caption is text; got {show_value(self.caption)}"
            raise InputError(msg, option="caption")
        object.__setattr__(self, "caption", make_printable(" ".join(self.caption.split("\n"))))


@record
class ShadowOptions(Options):
    """Options of drawings as vectors alone."""

    shadows: str = _looks(
        "choice", "In SVG and PDF: filled, or with parallel lines on pale faces.",
        more="Hatched: in another direction for each light.", default="solid", choices=SHADOWS,
    )  # fmt: skip


@record
class RenderOptions(DrawingOptions):
    """
    Options of a picture's shadows, checked; see ``umbra.render``.

    Raises
    ------
    InputError
        If an option is wrong, or does not go with the others.
    """

    method: str = _counting("text", _tell_methods(), default="auto", metavar="NAME")
    device: str = _counting(
        "text",
        "Device that counts: cpu (auto), gl, which is OpenGL, or wgpu, WebGPU.",
        default="auto", metavar="NAME", registry="device",
    )  # fmt: skip
    soft: str | None = _lights(
        "choice",
        "Soft shadows: by samples of the light (the reference), penumbra wedges (fast), depth "
        "complexity (right for overlaps, too) or scaled layers after Weng (which only look soft). "
        "Default: complexity for the sun in pictures that are not plain, nor films; else none.",
        choices=("none", *SOFT),
    )
    light_size: float | Sequence[float] = _lights(
        "number",
        "With soft shadows, the radius of all lights, or of each: metres, or for a direction "
        "degrees (default: 0.2665, the sun's).",
        default=(), is_repeated=True, metavar="R",
    )  # fmt: skip
    light_samples: int | None = _lights(
        "whole",
        "Points on each light: 256 by default with samples, 64 with complexity.",
        least=1, metavar="N",
    )  # fmt: skip
    layer_length: float = _length()
    layer_gap: float = _gap()
    mask_scale: int = _mask_scale()
    mask_filter: str = _mask_filter()
    detail: float = _detail()
    samples: int = _counting(
        "whole", "Samples of a pixel along edges of objects and shadows; 1 leaves them jagged.",
        default=8, least=1, metavar="N",
    )  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        methods = find_device(self.device).methods
        methods.check(self.method)
        if self.is_soft:
            methods.check_soft(str(self.soft))
        elif self.light_size:
            msg = "light_size= is for soft shadows; add soft='wedges'"
            raise InputError(msg, option="light_size")
        if self.light_samples is not None:
            self._check_places(self.light_samples)
        layers, usual = self.softness, Softness()
        if (layers.length, layers.gap) != (usual.length, usual.gap) and self.soft != "weng":
            name = "layer_length" if layers.length != usual.length else "layer_gap"
            msg = f"{name}= is for scaled layers; add soft='weng'"
            raise InputError(msg, option=name)
        can = find_device(self.device).enlarges_masks
        if self.mask_scale != 1 and (not can or self.is_soft):
            msg = "mask_scale= is for hard shadows on gl; give device='gl' and no soft="
            raise InputError(msg, option="mask_scale")
        self._check_detail()
        if self.samples > _MOST_SAMPLES:
            msg = f"a pixel has at most {_MOST_SAMPLES} samples; got {self.samples}"
            raise InputError(msg, option="samples")

    def _check_detail(self) -> None:
        """Refuse coarser casters where none are."""
        if not 0.0 <= self.detail < math.inf:
            msg = f"detail= is a number of pixels, 0 or more; got {self.detail:g}"
            raise InputError(msg, option="detail")
        device = find_device(self.device)
        hard = not self.is_soft and self.method in device.methods.volumes
        if self.detail and not (device.has_levels and hard and self.mask_scale == 1):
            msg = (
                "detail= is for hard shadows counted by volumes on gl; give device='gl', and no "
                "soft=, mask_scale= or mask method"
            )
            raise InputError(msg, option="detail")

    @property
    def is_soft(self) -> bool:
        """Whether soft shadows are asked for."""
        return self.soft not in {None, "none"}

    def soften(self, lights: Sequence[Light]) -> RenderOptions:
        """Return the same, but with the penumbra of the sun where nobody said how to count."""
        told = (self.soft, self.method, self.mask_scale, self.detail) != (None, "auto", 1, 0.0)
        if told or self.device not in {"auto", DEFAULT} or any(one.is_point for one in lights):
            return self
        return replace(self, soft="complexity")

    @property
    def softness(self) -> Softness:
        """Settings of soft methods."""
        usual, n = Softness(), self.light_samples
        return Softness(
            samples=n or usual.samples, spots=n or usual.spots,
            length=self.layer_length, gap=self.layer_gap,
        )  # fmt: skip

    def _check_places(self, places: int) -> None:
        """Refuse a number of places on lights that the method does not allow."""
        if self.soft not in {"samples", "complexity"}:
            msg = "light_samples= is for soft='samples' or soft='complexity'"
            raise InputError(msg, option="light_samples")
        if places > _MOST_PLACES:
            msg = f"a light has at most {_MOST_PLACES:,} samples; got {places:,}"
            raise InputError(msg, option="light_samples")


@record
class ViewOptions(Options):
    """Initial state of a view, checked; see ``umbra.show``."""

    date: str | None = _window("any", "Local date YYYY-MM-DD; default: 21 March.", metavar="DATE")
    at: str | None = _window("text", "Local time; default: 15:00.", metavar="HH:MM")
    ground: Given[float | str | Path | bool | None, float | str | bool | None] = _ground(
        more="False: none.", heading="Window", passes=(True, False)
    )
    method: str | None = _counting("text", _tell_methods(), metavar="NAME")
    soft: str | None = _lights(
        "choice", "Soft shadows, as in umbra render; the panel sets the sizes of the lights.",
        choices=("none", *SOFT),
    )  # fmt: skip
    layer_length: float | None = _length(default=None)
    layer_gap: float | None = _gap(default=None)
    mask_scale: int | None = _mask_scale(default=None)
    mask_filter: str | None = _mask_filter(default=None)
    detail: float | None = _detail(default=None)
    device: str | None = _counting(
        "choice", "Device that counts; default: gl.", choices=tuple(DEVICES)
    )
    size: tuple[int, int] = _window(
        "size", "Size of the window; default: 1280x800.", default=(1280, 800), count=2
    )
    threads: int | None = _study("threads", heading="Counting", is_kept=True)
    cast: Sequence[str] = _study("cast")
    no_cast: Sequence[str] = _study("no_cast")
    proposed: Sequence[str] = _casters(
        "patterns",
        "Parts of a proposal, which a page compares, before and after.", default=(),
    )  # fmt: skip
    replace: Sequence[str] = _casters(
        "patterns", "Parts that the proposal replaces, which a page shows before.", default=(),
    )  # fmt: skip
    replace_in: str | Path | Sequence[Any] | None = _casters(
        "any", "Polygons of a plot, a file or WKT: the proposal replaces what "
        "stands in them with half of its plan or more.",
        more="Or shapely's polygons in the model's own coordinates.", metavar="FILE|WKT",
    )  # fmt: skip
    horizon: Given[str | Path | Any | None, Any] = _study(
        "horizon", heading="Lights",
        help="Land up to 100 km away, behind which the sun goes: a raster of heights or a table, "
        "as umbra study takes it; it is not drawn.",
    )  # fmt: skip
    horizon_from: Given[float | str | None, float | None] = _study("horizon_from", heading="Lights")
    study: ShadowStudy | None = option(
        "any", "A study of receivers 'ground' or 'top', whose hours a page or a notebook shows as "
        "colours.", flag=None,
    )  # fmt: skip
    animation: int | str | None = option(
        "any", "Animation of the scene: its number, its name, or 'all'. It plays in a window "
        "unless time= is given.", flag=None,
    )  # fmt: skip
    time: float | None = option(
        "number", "Initial time of the animation, of the first one by default [s].", unit="s",
        flag=None,
    )  # fmt: skip
    view: str | os.PathLike[str] | None = _window(
        "file", "A saved view to start with, and the file to save views in.", metavar="FILE.json"
    )
    out: str | os.PathLike[str] | None = _window(
        "file",
        "File of the first screenshot; further ones get a number; default: named after the model. "
        "FILE.html: write a page of the model, without a window.",
        metavar="FILE.png",
    )

    def list_own(self) -> list[str]:
        """List what is given that only umbra's own devices know; a browser draws in its own way."""
        own = ("device", "method", "soft", "layer_length", "layer_gap", "mask_scale",
               "mask_filter", "detail")  # fmt: skip
        return [name for name in own if getattr(self, name) is not None]

    def __post_init__(self) -> None:
        check_types(self)
        Softness(
            length=Softness.length if self.layer_length is None else self.layer_length,
            gap=Softness.gap if self.layer_gap is None else self.layer_gap,
        )
        if self.date is not None:
            from umbra.sun.local_time import parse_date  # noqa: PLC0415

            parse_date(self.date)
        if self.out is not None and not str(self.out).lower().endswith((".html", ".htm", ".png")):
            stem = Path(self.out).stem or "view"
            msg = (
                f"'{self.out}' would be a page or a screenshot; name it {stem}.html, or {stem}.png "
                "with a window"
            )
            raise InputError(msg, option="out")
        self._check_horizon()

    def _check_horizon(self) -> None:
        """Read the land; refuse it beside a study, which knows its own."""
        from umbra.land.named_land import NamedLand  # noqa: PLC0415  (the help needs none)

        if self.horizon is not None and self.study is not None:
            msg = "horizon= is the study's; give it to umbra.shadow_study, and leave it out here"
            raise InputError(msg, option="horizon")
        named = NamedLand.of(self.horizon, self.horizon_from)
        object.__setattr__(self, "horizon", named.horizon)
        object.__setattr__(self, "horizon_from", named.nearest)
