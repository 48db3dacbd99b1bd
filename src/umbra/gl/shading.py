"""
Lighting of a picture, in full-screen passes of one triangle.

Each of many lights is added outside its shadow, summed in float16, so that 64 dim ones
show no banding (``rgba8`` is for comparison); then come the sky and sRGB. With one light
the surfaces were drawn lit and in shadow at once, and the shadow is only selected.
A `Lamp` is a light for shaders (``lamp.glsl``), with the picture that it projects.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from umbra.gl.context import Device, release_all
from umbra.gl.multisampling import draw_samples
from umbra.gl.programs import Program, Programs
from umbra.gl.projection import CameraProjection
from umbra.gl.resources import Texture
from umbra.gl.state import ALL_BITS, Pass, State, Stencil
from umbra.gl.target import ALBEDO, DARK, FACE, LIGHT, PLACE, Target
from umbra.gl.volume_counter import COUNT_BITS
from umbra.scene import Light

if TYPE_CHECKING:
    from umbra.gl.transmitters import TransmitterTables

__all__ = ["MOST_LAMPS", "Lamp", "Lamps", "Scissor", "Shading"]

_SLIDE = 4  # texture unit; lower units are the surfaces'


@dataclass(frozen=True, eq=False)
class Lamp:
    """A light in one view: required defines, uniforms, and projected picture."""

    needs: tuple[str, ...]
    uniforms: dict[str, Any]
    slide: Texture | None
    tables: "TransmitterTables | None" = None

    def bind(self) -> None:
        """Bind the projected picture and the transmitters to their texture units."""
        if self.slide is not None:
            self.slide.bind(_SLIDE)
        if self.tables is not None:
            self.tables.bind()

    def set(self, program: Program) -> None:
        """Set the uniforms of a program that includes ``lamp.glsl``."""
        self.bind()
        program.set(**self.uniforms)

    def pack(self, row: NDArray[np.float32]) -> None:
        """Write the uniforms into a row (4, 4) of ``lamp.glsl``'s array of many lamps."""
        given = self.uniforms
        row[0] = given["lamp"]
        row[1, :3], row[1, 3] = given["lamp_color"], given["fade"]
        row[2, :3] = given["attenuation"]
        if "axis" in given:
            row[3, :3], (row[2, 3], row[3, 3]) = given["axis"], given["cone"]
        elif "bend" in given:
            row[3, 3] = given["bend"]


class Lamps:
    """Makes lamps, and keeps their projected pictures."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._slides: dict[int, tuple[Light, Texture]] = {}

    def make(
        self,
        light: Light,
        projection: CameraProjection,
        origin: NDArray[np.float64],
        exposure: float,
    ) -> Lamp:
        """Make the lamp of a light; ``exposure`` multiplies its colour."""
        source = light.local(origin)
        source[:3] -= source[3] * projection.eye
        uniforms: dict[str, Any] = {
            "slide": _SLIDE,
            "lamp": source,
            "lamp_color": exposure * np.array(light.color),
            "attenuation": np.array(light.attenuation),
            "fade": 1.0 / light.range**2,
        }
        needs = []
        if light.is_point:
            needs.append("IS_POINT")
            if light.attenuation != (1.0, 0.0, 0.0) or light.range < np.inf:
                needs.append("IS_WEAKENING")
        else:
            source[:3] /= np.linalg.norm(source[:3])
            if light.bend != 1.0:
                needs.append("IS_BENT")
                uniforms["bend"] = light.bend
        if light.axis is not None:
            needs.append("IS_SPOT")
            inner = light.half_angle if light.inner_angle is None else light.inner_angle
            rim, full = np.cos(np.radians([light.half_angle, inner]))
            uniforms |= {"axis": light.axis, "cone": np.array([rim, 1 / max(full - rim, 1e-7)])}
        slide = None
        if light.image is not None:
            needs.append("HAS_SLIDE")
            slide = self._find_slide(light)
            right, up, _ = light.axes() / np.tan(np.radians(light.half_angle))
            uniforms |= {"slide_right": right, "slide_up": up}
        return Lamp(tuple(needs), uniforms, slide)

    def _find_slide(self, light: Light) -> Texture:
        # The light is kept, so that the id of its image is not reused.
        key = id(light.image)
        if key not in self._slides and light.image is not None:
            self._slides[key] = (light, Texture(self._device, light.image, ("clamp", "clamp")))
        return self._slides[key][1]

    def release(self) -> None:
        """Free the pictures."""
        for _, texture in self._slides.values():
            texture.release()
        self._slides = {}


_PLACES, _ALBEDOS, _SHARES, _FACES = range(4)  # texture units
_IN_SHADOW = Stencil(test="notequal", reference=0)
_ADD = Pass(color_write=True, blend="add")
_ADD_LIT, _ADD_ONCE = (
    replace(_ADD, stencil=Stencil(test="equal", reference=count)) for count in (0, 1)
)
_SMOOTH = ALL_BITS ^ COUNT_BITS
_MARK = Pass(
    stencil=Stencil(
        reference=_SMOOTH, front_depth_pass="replace", back_depth_pass="replace", bits=_SMOOTH
    )
)
_BEHIND = Pass(depth_test="lequal", color_write=True)

MOST_LAMPS = 32
"""Lamps of one draw, as in ``many.glsl``: what every device's uniforms hold."""

Scissor = tuple[int, int, int, int]
"""Left, bottom, columns, rows [pixels], row 0 lowest."""


class Shading:
    """
    The programs that light a picture.

    ``is_glossy`` if any surface is, ``is_plain`` if none does anything but scatter light.
    """

    def __init__(self, device: Device, *, is_glossy: bool = False, is_plain: bool = False) -> None:
        self._needs = ("HAS_GLOSSY",) if is_glossy else ("IS_PLAIN",) if is_plain else ()
        self._light, self._finish, self._sky, self._dark, self._smooth = (
            Programs(device, "picture.vert.glsl", f"{what}.frag.glsl")
            for what in ("light", "finish", "sky", "dark", "smooth")
        )
        self._over = Program(device, "picture.vert.glsl", "lay.frag.glsl")

    def add_light(
        self,
        state: State,
        surface: Target,
        projection: CameraProjection,
        lamp: Lamp,
        scissor: Scissor | None = None,
        shares: Target | None = None,
        extent: float | None = None,
    ) -> None:
        """
        Add a light where the stencil is 0, or its visible fraction from ``shares``.

        Before: the light target is in use and, without ``shares``, its stencil counts shadows.
        After: it includes the light's contribution; the stencil is as before. The light
        reaches nothing outside the scissor. The first attachment of ``shares`` holds the visible
        fraction of the light at each pixel, 0 to 1; with the ``extent`` of the light, its radius,
        faces turned away from it are left to ``add_turned``.
        """
        needs, how = lamp.needs, Pass(color_write=True, blend="add", scissor=scissor)
        if shares is None:
            how = replace(how, stencil=Stencil(test="equal", reference=0))
        else:
            shares.bind(_SHARES)
            needs += ("HAS_SHARE",) if extent is None else ("HAS_SHARE", "SPARES_TURNED")
        lamp.bind()
        given = (state, how, surface, projection, needs)
        self._draw_light(*given, extent=extent or 0.0, **lamp.uniforms)

    def add_lights(
        self,
        state: State,
        surface: Target,
        projection: CameraProjection,
        lamps: Sequence[Lamp],
        scissors: Sequence[Scissor | None],
        *,
        is_counted: bool,
        is_turned: bool = False,
    ) -> None:
        """
        Add several lights of equal ``needs``, without pictures, each within its own scissor.

        Before: the light target is in use; if ``is_counted``, its stencil counts the shadows of
        each light within its scissor, else no light is shadowed. With ``is_turned`` they are added
        where ``add_turned`` adds one.
        """
        rows = np.zeros((MOST_LAMPS, 4, 4), np.float32)
        boxes = np.zeros((MOST_LAMPS, 4), np.float32)
        boxes[:, 2:] = surface.size
        for index, (lamp, scissor) in enumerate(zip(lamps, scissors, strict=True)):
            lamp.pack(rows[index])
            if scissor is not None:
                left, bottom, cols, height = scissor
                boxes[index] = left, bottom, left + cols, bottom + height
        boxes *= 2.0 / np.array(surface.size * 2, np.float32)
        boxes -= 1.0
        how = (_ADD_ONCE if is_turned else _ADD_LIT) if is_counted else _ADD
        needs = (*lamps[0].needs, "ARE_MANY", *(("IS_TURNED",) if is_turned else ()))
        self._draw_light(
            state, how, surface, projection, needs, vertices=6 * len(lamps),
            lamps=rows.reshape(-1, 4), rectangles=boxes,
        )  # fmt: skip

    def add_turned(
        self,
        state: State,
        surface: Target,
        projection: CameraProjection,
        lamp: Lamp,
        scissor: Scissor | None = None,
        *,
        least: int,
    ) -> None:
        """
        Add a light to faces turned away from it whose smooth normals are not.

        Before: the light target is in use, its stencil counts shadows. After: such faces are lit
        where the stencil is from ``least``, 0 or 1, to 1: only their own body shades them.
        """
        once = Stencil(test="equal" if least else "gequal", reference=1)
        how = Pass(color_write=True, blend="add", scissor=scissor, stencil=once)
        lamp.bind()
        needs = (*lamp.needs, "IS_TURNED")
        self._draw_light(state, how, surface, projection, needs, extent=0.0, **lamp.uniforms)

    def show_light(
        self,
        state: State,
        surface: Target,
        projection: CameraProjection,
        lamp: Lamp,
        scissor: Scissor | None = None,
        *,
        spares_turned: bool = False,
        is_marked: bool = False,
    ) -> None:
        """
        Draw what the only light reaches, as it is shown.

        Before: the picture is in use, all in shadow; inside the scissor the stencil counts
        shadows, and ``surface`` holds what is before any light. After: where the stencil is 0
        it shows surfaces in that light; with ``spares_turned`` also where ``darken`` spares them.
        If ``is_marked``, the count has `COUNT_BITS`, and the bit beside them is that of
        ``mark_smooth``: a software device takes every branch of every pixel that the stencil lets
        pass.
        """
        surface.bind(_SHARES, LIGHT)
        lamp.bind()
        bits, mark = (COUNT_BITS, _SMOOTH) if is_marked else (ALL_BITS, 0)
        passes: tuple[tuple[int, int, tuple[str, ...]], ...] = ((0, bits, ()),)
        if spares_turned:
            passes += ((1 + mark, ALL_BITS, ("IS_TURNED",)),)
        for count, compared, more in passes:
            lit = Stencil(test="equal", reference=count, bits=compared)
            how = Pass(color_write=True, scissor=scissor, stencil=lit, depth_test="greater")
            needs = (*lamp.needs, "IS_SHOWN", "IS_FAR", *more)  # nothing where nothing is seen
            self._draw_light(state, how, surface, projection, needs, extent=0.0, **lamp.uniforms)

    def mark_smooth(self, state: State, surface: Target) -> None:
        """
        Set the bit beside `COUNT_BITS` where a surface has a smooth normal.

        Before: a target with the depth and stencil of ``surface`` is in use.
        """
        surface.bind(_PLACES, PLACE)
        surface.bind(_FACES, FACE)
        draw_samples(state, _MARK, self._smooth, (), surface.samples, places=_PLACES, faces=_FACES)

    def _draw_light(
        self,
        state: State,
        how: Pass,
        surface: Target,
        projection: CameraProjection,
        needs: tuple[str, ...],
        **uniforms: Any,
    ) -> None:
        for unit, attachment in ((_PLACES, PLACE), (_ALBEDOS, ALBEDO), (_FACES, FACE)):
            surface.bind(unit, attachment)
        draw_samples(
            state, how, self._light, (*needs, *self._needs), surface.samples,
            places=_PLACES, albedos=_ALBEDOS, faces=_FACES, shares=_SHARES, befores=_SHARES,
            **uniforms, **projection.rays,
        )  # fmt: skip

    def lay(self, state: State, surface: Target, shown: Target) -> None:
        """Blend a lit surface over the picture behind it."""
        shown.use()
        state.use(Pass(color_write=True, blend="premultiplied"))
        surface.bind(_PLACES, LIGHT)
        surface.bind(_FACES, FACE)
        self._over.set(light=_PLACES, faces=_FACES)
        self._over.draw(3)

    def finish(self, state: State, surface: Target, *, is_laid: bool = False) -> None:
        """
        Convert a lit surface over the sky to sRGB, in the target in use.

        With ``is_laid``, convert the first attachment, from ``lay``, instead.
        """
        surface.bind(_PLACES, LIGHT)
        if not is_laid:
            surface.bind(_FACES, FACE)
        needs = ("IS_LAID",) if is_laid else ()
        draw_samples(
            state, Pass(color_write=True), self._finish, needs, surface.samples,
            light=_PLACES, faces=_FACES, rows=float(surface.size[1]),
        )  # fmt: skip

    def draw_sky(self, state: State, both: Target) -> None:
        """Fill the background of the target in use with sky."""
        state.use(_BEHIND)
        program = self._sky.find("IS_FAR")
        program.set(rows=float(both.size[1]))
        program.draw(3)

    def darken(
        self,
        state: State,
        both: Target,
        scissor: Scissor | None = None,
        *,
        spares_turned: bool = False,
    ) -> None:
        """
        Darken the pixels in shadow.

        Before: the picture is in use, all lit; inside the scissor the stencil counts shadows.
        After: where the stencil is not 0 it shows the shadowed colours of ``both``; with
        ``spares_turned`` not where it is 1 on faces turned away from the light whose smooth
        normals are not: only their own body shades them.
        """
        both.bind(0, DARK)
        deep = Stencil(test="less", reference=1) if spares_turned else _IN_SHADOW
        how = Pass(color_write=True, scissor=scissor, stencil=deep)
        draw_samples(state, how, self._dark, (), both.samples, dark=0)
        if spares_turned:
            how = replace(how, stencil=Stencil(test="equal", reference=1))
            draw_samples(state, how, self._dark, ("SPARES_TURNED",), both.samples, dark=0)

    def release(self) -> None:
        """Free the programs."""
        release_all(self._light, self._over, self._finish, self._sky, self._dark)
        self._smooth.release()
