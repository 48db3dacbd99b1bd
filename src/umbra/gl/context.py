"""
A context of OpenGL 3.3 core: from EGL without a display, from OSMesa, or a hidden window's.

moderngl is imported here, on the first call, and nowhere else but in this room.
"""

import ctypes
import re
import sys
from collections.abc import Callable
from ctypes.util import find_library
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar

from umbra.errors import InputError, UmbraError
from umbra.gl.functions import Functions

__all__ = ["BACKENDS", "Device", "open_device"]

INSTALL = "pip install 'umbra-shadows[gl]'"
DRIVER = (
    "install a driver (Debian, Ubuntu: apt install libegl1 libgl1 libgl1-mesa-dri; "
    "anywhere on Linux: pip install 'umbra-shadows[osmesa]')"
)
ADVICE = f"{DRIVER}, or stay with --device cpu"
_DEPTH_BITS, _STENCIL_BITS = 24, 8
_ERRORS = {
    0x0500: "an invalid enum",
    0x0501: "an invalid value",
    0x0502: "an invalid operation",
    0x0505: "no memory left",
    0x0506: "an incomplete framebuffer",
    0x0507: "a lost context: the driver was reset",
}


@dataclass(eq=False)
class Device:
    """
    An OpenGL context and what is true of it.

    Parameters
    ----------
    context : moderngl.Context
    backend : str
        One of ``BACKENDS``, or ``given``.
    vendor, renderer, version : str
        As the driver gives them.
    is_software : bool
        Whether the processor draws.
    has_depth_bounds, has_timer_queries : bool
    gl : Functions
        Entry points that moderngl lacks.
    live : set of str
        The objects that were made and not released yet, by kind and number.
    """

    context: Any
    backend: str
    vendor: str
    renderer: str
    version: str
    is_software: bool
    has_depth_bounds: bool
    has_timer_queries: bool
    gl: Functions
    live: set[str] = field(default_factory=set)
    _keeper: Any = None
    _finish: list[Callable[[], object]] = field(default_factory=list)

    @classmethod
    def of(cls, context: Any, backend: str = "given", keeper: Any = None) -> "Device":
        """
        Describe a moderngl context, such as a window's.

        Raises
        ------
        UmbraError
            If it is no OpenGL 3.3.
        """
        if context.version_code < 330:
            has = context.version_code / 100
            msg = f"OpenGL 3.3 is needed and this context has {has:.1f}; {ADVICE}"
            raise UmbraError(msg)
        info = context.info
        renderer = info["GL_RENDERER"]
        return cls(
            context=context,
            backend=backend,
            vendor=info["GL_VENDOR"],
            renderer=renderer,
            version=info["GL_VERSION"],
            is_software=bool(re.search("llvmpipe|softpipe|swrast|SwiftShader|Software", renderer)),
            has_depth_bounds="GL_EXT_depth_bounds_test" in context.extensions,
            has_timer_queries=True,  # of the core since 3.3
            gl=Functions(_find_loader(context)),
            _keeper=keeper,
        )

    def keep(self, kind: str, number: int) -> str:
        """Note an object that was made; give the key to ``forget`` it by."""
        key = f"{kind} {number}"
        self.live.add(key)
        return key

    def forget(self, kind: str, number: int) -> None:
        """Note that an object was released."""
        self.live.discard(f"{kind} {number}")

    def check(self, work: str) -> None:
        """
        Raise what OpenGL has to complain about.

        Parameters
        ----------
        work : str
            What was done, for the message.

        Raises
        ------
        UmbraError
        """
        error = self.gl.GetError()
        if error:
            what = _ERRORS.get(error, hex(error))
            msg = f"OpenGL reports {what} while {work} ({self.renderer}); use --device cpu"
            raise UmbraError(msg, code=error)

    def release(self) -> None:
        """Free the context; nothing made in it can be used any more."""
        if self.backend != "given":
            self.context.release()
        for finish in self._finish:
            finish()
        self._finish.clear()

    def __enter__(self) -> "Device":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def open_device(backend: str | None = None) -> Device:
    """
    Open a context without any display, or as a last resort a hidden window's.

    Parameters
    ----------
    backend : {'egl', 'osmesa', 'window'}, optional
        Only this one; by default the first that works.

    Returns
    -------
    device : Device

    Raises
    ------
    InputError
        If there is no such backend.
    UmbraError
        If moderngl is not installed, or no OpenGL 3.3 is found.
    """
    if backend is not None and backend not in BACKENDS:
        msg = f"there is no OpenGL backend '{backend}'; there are {', '.join(BACKENDS)}"
        raise InputError(msg)
    for package in ("moderngl", "glcontext"):
        if find_spec(package) is None:
            msg = f"the gl device needs {package}, which is not installed; {INSTALL}"
            raise UmbraError(msg, package=package)
    reasons = []
    for name in BACKENDS if backend is None else [backend]:
        try:
            return BACKENDS[name]()
        except Exception as error:  # noqa: BLE001  (drivers fail in every way there is)
            reasons.append(f"{name}: {' '.join(str(error).split())[:120]}")
    msg = f"no OpenGL 3.3 opens here ({'; '.join(reasons)}); {ADVICE}"
    raise UmbraError(msg, reasons=reasons)


def _open_egl() -> Device:
    import moderngl  # noqa: PLC0415

    options: dict[str, Any] = {
        "backend": "egl",
        "libgl": find_library("GL") or find_library("OpenGL") or "libGL.so.1",
        "libegl": find_library("EGL") or "libEGL.so.1",
    }
    return Device.of(moderngl.create_context(require=330, standalone=True, **options), "egl")


def _open_window() -> Device:
    import glfw  # noqa: PLC0415
    import moderngl  # noqa: PLC0415

    if sys.platform.startswith("linux") and not _has_display():
        msg = "there is no display"
        raise UmbraError(msg)
    if not glfw.init():
        msg = "glfw does not start"
        raise UmbraError(msg)
    for hint, value in (
        (glfw.VISIBLE, False),
        (glfw.CONTEXT_VERSION_MAJOR, 3),
        (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
        (glfw.OPENGL_FORWARD_COMPAT, True),
    ):
        glfw.window_hint(hint, value)
    window = glfw.create_window(16, 16, "umbra", None, None)
    if not window:
        msg = "glfw opens no window with OpenGL 3.3"
        raise UmbraError(msg)
    glfw.make_context_current(window)
    device = Device.of(moderngl.create_context(require=330), "window", window)
    device._finish.append(lambda: glfw.destroy_window(window))
    return device


def _has_display() -> bool:
    import os  # noqa: PLC0415

    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _open_osmesa() -> Device:
    import moderngl  # noqa: PLC0415

    mesa: Any = OffscreenMesa()
    context = moderngl.create_context(require=330, standalone=True, context=mesa)
    return Device.of(context, "osmesa", mesa)


class OffscreenMesa:
    """
    A context of OSMesa's, in the shape that moderngl takes from its loader.

    The library is the system's, or the one that the package ``lavavu-osmesa`` brings.
    One that is released gives way to the one that was opened before it and lives.
    """

    _open: ClassVar[list["OffscreenMesa"]] = []

    def __init__(self) -> None:
        library = _load_osmesa()
        library.OSMesaCreateContextAttribs.restype = ctypes.c_void_p
        library.OSMesaCreateContextAttribs.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        library.OSMesaMakeCurrent.argtypes = [
            ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_int,
        ]  # fmt: skip
        library.OSMesaGetProcAddress.restype = ctypes.c_void_p
        library.OSMesaGetProcAddress.argtypes = [ctypes.c_char_p]
        library.OSMesaDestroyContext.argtypes = [ctypes.c_void_p]
        # RGBA; depth and stencil bits; core profile; version 3.3; end.
        pairs = [0x22, 0x1908, 0x30, _DEPTH_BITS, 0x31, _STENCIL_BITS, 0x33, 0x34, 0x36, 3, 0x37, 3]
        attributes = (ctypes.c_int * 13)(*pairs, 0)
        self._library = library
        self._context = library.OSMesaCreateContextAttribs(attributes, None)
        self._pixels = (ctypes.c_ubyte * 64)()
        if not self._context or not self._make_current():
            msg = "OSMesa makes no context of OpenGL 3.3"
            raise UmbraError(msg)
        self._open.append(self)

    def _make_current(self) -> bool:
        return bool(self._library.OSMesaMakeCurrent(self._context, self._pixels, 0x1401, 4, 4))

    def load_opengl_function(self, name: str) -> int:
        """Give the address of an entry point, or 0."""
        return self._library.OSMesaGetProcAddress(name.encode()) or 0

    load = load_opengl_function

    def release(self) -> None:
        """Destroy the context."""
        if self._context:
            self._library.OSMesaMakeCurrent(None, None, 0, 0, 0)
            self._library.OSMesaDestroyContext(self._context)
            self._open.remove(self)
            if self._open:
                self._open[-1]._make_current()
        self._context = None

    def __enter__(self) -> "OffscreenMesa":
        self._make_current()
        return self

    def __exit__(self, *_: object) -> None:
        pass


def _load_osmesa() -> ctypes.CDLL:
    system = find_library("OSMesa")
    if system:
        return ctypes.CDLL(system)
    spec = find_spec("lavavu")
    folder = (
        Path(spec.origin).parent.parent / "lavavu_osmesa.libs" if spec and spec.origin else None
    )
    found = sorted(folder.glob("libOSMesa*.so*")) if folder else []
    if not found:
        msg = "there is no libOSMesa; pip install 'umbra-shadows[osmesa]' brings one"
        raise UmbraError(msg)
    # The wheel's libraries find each other only once all of them are loaded.
    left = [path for path in found[0].parent.glob("*.so*") if path != found[0]]
    for _ in range(len(left)):
        left = [path for path in left if not _loads(path)]
    return ctypes.CDLL(str(found[0]))


def _loads(path: Path) -> bool:
    try:
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    except OSError:
        return False
    return True


def _find_loader(context: Any) -> Callable[[str], int]:
    """Give the loader of the context that moderngl took."""
    return context.mglo._context.load_opengl_function


BACKENDS: dict[str, Callable[[], Device]] = {
    "egl": _open_egl,
    "osmesa": _open_osmesa,
    "window": _open_window,
}
"""Tried in this order."""
