"""
Shaders from files, linked to programs; compile errors name file and line.

A line ``#include "name.glsl"`` is replaced by that file. Every vertex shader declares
``invariant gl_Position``, so that programs that share the code of a position agree to
the last bit.

Uniforms of fragment shaders, which software devices get as flat outputs of the vertex shader.

llvmpipe (Mesa 22) fetches each number of a uniform for each pixel by a gather, 0.35 ns a time: a
matrix and three vectors cost a picture of 1024² more than its lighting. A flat input costs nothing.
"""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import resources
from typing import Any

import numpy as np

from umbra.errors import UmbraError
from umbra.gl.context import Device, release_all
from umbra.scene.exposure import Sky

__all__ = ["PREFIX", "Lines", "Program", "Programs", "carry_uniforms", "load_source"]

PREFIX = "given_"
"""What the name of a carried uniform begins with in the vertex shader."""

_UNIFORM = re.compile(r"\s*uniform (float|int|bool|vec[234]) ([\w, ]+);")
_MAIN = re.compile(r"void main\(\) \{")
Lines = Sequence[tuple[str, str]]


def carry_uniforms(vertex: Lines, fragment: Lines) -> tuple[Lines, Lines]:
    """
    Carry a fragment shader's uniforms, numbers and vectors, through the vertex shader.

    Lines are of `load_source`. A uniform ``x`` of the fragment shader becomes ``given_x`` of the
    vertex shader, whether or not that one has an ``x``; arrays and samplers stay.
    """
    kinds: dict[str, str] = {}
    rewritten: list[tuple[str, str]] = []
    for line, location in fragment:
        match = _UNIFORM.match(line)
        if match is None:
            rewritten.append((line, location))
            continue
        for name in match[2].split(", "):
            kinds[name] = match[1]
            value = f"(flat_{name} != 0)" if match[1] == "bool" else f"flat_{name}"
            rewritten.append((f"flat in {_find_flat(match[1])} flat_{name};", location))
            rewritten.append((f"#define {name} {value}", location))
    sent = [
        (f"uniform {kind} {PREFIX}{name}; flat out {_find_flat(kind)} flat_{name};", "carried")
        for name, kind in kinds.items()
    ]
    copies = " ".join(
        f"flat_{name} = {_find_flat(kind)}({PREFIX}{name});" for name, kind in kinds.items()
    )
    begun = [(_MAIN.sub(f"void main() {{ {copies}", line), location) for line, location in vertex]
    return [*sent, *begun], rewritten


def _find_flat(kind: str) -> str:
    """Return the type that carries a uniform: there are no flat booleans."""
    return "int" if kind == "bool" else kind


TRIANGLES = 4
_NUMBERLESS = "softpipe"  # draws nothing by gl_PrimitiveID: docs/gl.md, pitfall 10
_VERSION = "#version 330 core\n"
# Mesa "0:12(3): error: ...", NVIDIA "0(12) : error ...", AMD and Apple "ERROR: 0:12: ...".
_PLACE = re.compile(r"^(?:ERROR:\s*)?\d+[:(](\d+)\)?(?:\(\d+\))?\s*:\s*(?:error)?:?\s*(.*)", re.I)


@lru_cache
def load_source(name: str) -> tuple[tuple[str, str], ...]:
    """Read a file of ``shaders/`` and its includes: lines, and ``file:line`` of each."""
    try:
        text = (resources.files("umbra.gl") / "shaders" / name).read_text("utf-8")
    except FileNotFoundError:
        msg = f"the shader '{name}' is missing; install umbra again"
        raise UmbraError(msg, path=name) from None
    lines: list[tuple[str, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        included = re.match(r'\s*#include\s+"(.+)"', line)
        lines += load_source(included[1]) if included else [(line, f"{name}:{number}")]
    return tuple(lines)


@lru_cache
def _define_colors(sky: Sky) -> dict[str, str]:
    """Return the definitions of a sky's colours."""
    colors: dict[str, Any] = {
        "SKY": sky.zenith, "HORIZON": sky.horizon, "BOUNCE": sky.bounce,
        "FROM_SKY": sky.from_above, "FROM_GROUND": sky.from_below,
    }  # fmt: skip
    return {
        name: f"vec3({float(red)}, {float(green)}, {float(blue)})"
        for name, (red, green, blue) in colors.items()
    }


class Program:
    """
    A linked program.

    Parameters
    ----------
    device : Device
    vertex, fragment : str
        Files in ``shaders/``.
    defines : mapping, optional
        Preprocessor definitions, for both shaders.

    Raises
    ------
    UmbraError
        If a shader does not compile or the two do not link, or the driver cannot number faces.
    """

    def __init__(
        self,
        device: Device,
        vertex: str,
        fragment: str,
        defines: Mapping[str, object] | None = None,
    ) -> None:
        reversed_depth = {"REVERSED": 1} if device.reverses_depth else {}
        names = {**_define_colors(device.sky), **(defines or {}), **reversed_depth}
        head = [(f"#define {name} {value}", "defines") for name, value in names.items()]
        sources: tuple[Lines, Lines] = load_source(vertex), load_source(fragment)
        if device.is_software:
            sources = carry_uniforms(*sources)
        self._sources = {
            "vertex_shader": [*head, *sources[0]],
            "fragment_shader": [*head, *sources[1]],
        }
        self._device = device
        if device.renderer == _NUMBERLESS and any("gl_PrimitiveID" in s for s, _ in sources[1]):
            msg = (
                f"{device.renderer} draws nothing where a shader reads a face's number "
                f"({fragment}); use another driver (GALLIUM_DRIVER=llvmpipe), or device='cpu'"
            )
            raise UmbraError(msg, option="device")
        texts = {
            stage: _VERSION + "".join(f"{line}\n" for line, _ in lines)
            for stage, lines in self._sources.items()
        }
        try:
            self.handle: Any = device.context.program(**texts)
        except Exception as error:  # noqa: BLE001  (moderngl is not imported here)
            msg = f"a shader does not compile: {self._explain(str(error), vertex, fragment)}"
            raise UmbraError(msg, report=str(error)) from None
        self._members: dict[str, list[Any]] = {}
        for name in self.handle:
            member = self.handle[name]
            if hasattr(member, "write") and hasattr(member, "location"):
                self._members.setdefault(name.removeprefix(PREFIX), []).append(member)
        self._given: dict[str, Any] = {}
        self._array: Any = None
        device.keep("program", self.handle.glo)

    def _explain(self, report: str, vertex: str, fragment: str) -> str:
        stage = next((name for name in self._sources if name in report), None)
        if stage is None:
            tail = " ".join(report.rsplit("=", 1)[-1].split())
            return f"{vertex} and {fragment} do not link: {tail}"
        for line in report.splitlines():
            match = _PLACE.match(line.strip())
            if match:
                index = min(max(int(match[1]) - 2, 0), len(self._sources[stage]) - 1)
                return f"{self._sources[stage][index][1]}: {match[2]}"
        return f"{vertex if stage == 'vertex_shader' else fragment}: {' '.join(report.split())}"

    def set(self, **uniforms: Any) -> None:
        """
        Set uniforms; ignore names that the program does not use.

        Arrays are written as float32 (matrices row by row, as in numpy); Python's int and
        bool go to int, bool and sampler uniforms, its float to float. Numbers and read-only
        arrays are not uploaded twice in a row.
        """
        gl = self._device.gl
        gl.UseProgram(self.handle.glo)
        for name, value in uniforms.items():
            members = self._members.get(name)
            if members is None or value is self._given.get(name):
                continue
            is_array = isinstance(value, np.ndarray)
            self._given[name] = None if is_array and value.flags.writeable else value
            for member in members:
                if is_array:
                    is_matrix = value.ndim == 2 and value.shape[0] == value.shape[1]
                    matrix = value.T if is_matrix else value
                    member.write(np.ascontiguousarray(matrix, np.float32).tobytes())
                elif isinstance(value, int):
                    gl.Uniform1i(member.location, value)  # moderngl lacks buffer samplers
                else:
                    gl.Uniform1f(member.location, value)

    def draw(self, count: int) -> None:
        """Draw triangles of ``count`` vertices, computed by the shader from their numbers."""
        if self._array is None:
            self._array = self._device.context.vertex_array(self.handle, [])
            self._device.keep("vertex array", self._array.glo)
        self._array.render(TRIANGLES, vertices=count)

    def release(self) -> None:
        """Free the program."""
        if self._array is not None:
            self._device.free("vertex array", self._array)
            self._array = None
        self._device.gl.UseProgram(0)  # a program in use would not be deleted
        self._device.free("program", self.handle)


class Programs:
    """Variants of two shaders by their definitions, each linked on first use."""

    def __init__(self, device: Device, vertex: str, fragment: str) -> None:
        self._device, self._shaders = device, (vertex, fragment)
        self._made: dict[tuple, Program] = {}

    def find(self, *needs: str, **values: object) -> Program:
        """Find the program with names defined as 1 (``needs``) or as given ``values``."""
        key = (self._device.sky, *needs, *values.items())
        if key not in self._made:
            defines = {**dict.fromkeys(needs, 1), **values}
            self._made[key] = Program(self._device, *self._shaders, defines)
        return self._made[key]

    def release(self) -> None:
        """Free the programs."""
        release_all(*self._made.values())
        self._made = {}
