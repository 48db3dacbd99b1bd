"""
Backends: open a context by EGL, OSMesa or a hidden window, and make it current.

Forks of a process that has used OpenGL: they lack the driver's threads, and would hang.
"""

import ctypes
import os
import sys
from collections.abc import Callable
from ctypes.util import find_library
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from umbra.errors import UmbraError
from umbra.packages import write_install

__all__ = [
    "BACKENDS",
    "ContextBinding",
    "EglBinding",
    "GivenBinding",
    "OffscreenMesa",
    "WindowBinding",
    "bind_given",
    "check_fork",
    "has_display",
    "hint_window",
    "note_use",
]

_users: set[int] = set()
"""The process that has used OpenGL; in its forks theirs is missing."""


def note_use() -> None:
    """Note that this process uses OpenGL."""
    _users.add(os.getpid())


def check_fork() -> None:
    """Raise `UmbraError` in the fork of a process that has used OpenGL."""
    if _users and os.getpid() not in _users:
        msg = (
            "this process is a fork of one that has used OpenGL, whose driver does not survive a "
            "fork; start it by multiprocessing's 'spawn', or use device='cpu'"
        )
        raise UmbraError(msg, option="device")


_DEPTH_BITS, _STENCIL_BITS = 24, 8


class ContextBinding(Protocol):
    """Makes a context current in this thread, then restores the previous one, if any."""

    @property
    def is_current(self) -> bool:
        """Whether the context is current in this thread."""
        ...

    @property
    def is_alone(self) -> bool:
        """Whether no other context was current when this one was made current last."""
        ...

    def __enter__(self) -> object: ...

    def __exit__(self, *_: object) -> object: ...


class GivenBinding:
    """Makes the caller's context current through moderngl's loader."""

    is_current = True
    """As far as can be told."""

    def __init__(self, loaded: Any) -> None:
        self._loaded = loaded

    @property
    def is_alone(self) -> bool:
        """Whether no other context was current when this one was made current last."""
        return False

    def __enter__(self) -> None:
        self._loaded.__enter__()

    def __exit__(self, *_: object) -> None:
        self._loaded.__exit__(None, None, None)


class EglBinding:
    """Makes an EGL context current, then restores the previous context and its surfaces."""

    def __init__(self, path: str) -> None:
        self._library = library = ctypes.CDLL(path)
        library.eglGetCurrentDisplay.restype = ctypes.c_void_p
        library.eglGetCurrentContext.restype = ctypes.c_void_p
        library.eglGetCurrentSurface.restype = ctypes.c_void_p
        library.eglGetCurrentSurface.argtypes = [ctypes.c_int]
        library.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
        self._before = self._find()
        self._own = self._before

    def take(self) -> bool:
        """Bind the context that is current now, if any; return whether there is one."""
        self._own = self._find()
        return bool(self._own[3])

    @property
    def is_current(self) -> bool:
        """Whether the context is current in this thread."""
        return bool(self._library.eglGetCurrentContext() == self._own[3])

    @property
    def is_alone(self) -> bool:
        """Whether no other context was current when this one was made current last."""
        return not self._before[3]

    def __enter__(self) -> None:
        self._before = self._find()
        self._library.eglMakeCurrent(*self._own)

    def __exit__(self, *_: object) -> None:
        display, *rest = self._before
        self._library.eglMakeCurrent(display or self._own[0], *rest)

    def _find(self) -> tuple[int | None, int | None, int | None, int | None]:
        """Find the current display, draw and read surfaces, and context."""
        ask = self._library
        draw, read = ask.eglGetCurrentSurface(0x3059), ask.eglGetCurrentSurface(0x305A)
        return ask.eglGetCurrentDisplay(), draw, read, ask.eglGetCurrentContext()


def bind_given(loaded: Any) -> "ContextBinding":
    """
    Return what makes the caller's context current, which is current now.

    ``loaded`` is moderngl's loader of it, which leaves no context current where EGL is used.
    """
    path = find_library("EGL")
    if path is not None:
        binding = EglBinding(path)
        if binding.take():
            return binding
    return GivenBinding(loaded)


class WindowBinding:
    """Makes the context of a glfw window current, then restores the previous one."""

    def __init__(self, window: Any) -> None:
        self._window = window
        self._before: Any = None

    @property
    def is_current(self) -> bool:
        """Whether the context is current in this thread."""
        import glfw  # noqa: PLC0415

        return _address(glfw.get_current_context()) == _address(self._window)

    @property
    def is_alone(self) -> bool:
        """Whether no other context was current when this one was made current last."""
        return not self._before

    def __enter__(self) -> None:
        import glfw  # noqa: PLC0415

        self._before = glfw.get_current_context()
        glfw.make_context_current(self._window)

    def __exit__(self, *_: object) -> None:
        import glfw  # noqa: PLC0415

        glfw.make_context_current(self._before)
        self._before = None


def _address(window: Any) -> int | None:
    return ctypes.cast(window, ctypes.c_void_p).value if window else None


def hint_window(glfw: Any) -> None:
    """Request OpenGL 3.3 core for new windows."""
    for hint, value in (
        (glfw.CONTEXT_VERSION_MAJOR, 3),
        (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
        (glfw.OPENGL_FORWARD_COMPAT, True),
    ):
        glfw.window_hint(hint, value)


class OffscreenMesa:
    """
    OSMesa context with the interface of a moderngl loader.

    The library is the system's, or that of the package ``lavavu-osmesa``.
    """

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
        library.OSMesaGetCurrentContext.restype = ctypes.c_void_p
        # RGBA; depth and stencil bits; core profile; version 3.3; end.
        pairs = [0x22, 0x1908, 0x30, _DEPTH_BITS, 0x31, _STENCIL_BITS, 0x33, 0x34, 0x36, 3, 0x37, 3]
        attributes = (ctypes.c_int * 13)(*pairs, 0)
        self._library = library
        self._context = library.OSMesaCreateContextAttribs(attributes, None)
        self._pixels = (ctypes.c_ubyte * 64)()
        if not self._context or not self._make_current():
            msg = "OSMesa makes no context of OpenGL 3.3"
            raise UmbraError(msg)

    def _make_current(self) -> bool:
        return bool(self._library.OSMesaMakeCurrent(self._context, self._pixels, 0x1401, 4, 4))

    @property
    def is_current(self) -> bool:
        """Whether the context is current in this thread."""
        return bool(self._library.OSMesaGetCurrentContext() == self._context)

    def load_opengl_function(self, name: str) -> int:
        """Return the address of an entry point, or 0."""
        return self._library.OSMesaGetProcAddress(name.encode()) or 0

    load = load_opengl_function

    def release(self) -> None:
        """Destroy the context."""
        if self._context:
            self._library.OSMesaMakeCurrent(None, None, 0, 0, 0)
            self._library.OSMesaDestroyContext(self._context)
        self._context = None

    @property
    def is_alone(self) -> bool:
        """Whether no other context was current when this one was made current last."""
        return True

    def __enter__(self) -> "OffscreenMesa":
        self._make_current()
        return self

    def __exit__(self, *_: object) -> None:
        self._library.OSMesaMakeCurrent(None, None, 0, 0, 0)


def _load_osmesa() -> ctypes.CDLL:
    system = find_library("OSMesa")
    if system:
        return ctypes.CDLL(system)
    spec = find_spec("lavavu")
    folder = (
        Path(spec.origin).parent.parent / "lavavu_osmesa.libs" if spec and spec.origin else None
    )
    libraries = sorted(folder.glob("libOSMesa*.so*")) if folder else []
    if not libraries:
        msg = f"there is no libOSMesa; {write_install('osmesa')} brings one"
        raise UmbraError(msg)
    # The wheel's libraries resolve each other only once all are loaded.
    left = [path for path in libraries[0].parent.glob("*.so*") if path != libraries[0]]
    for _ in range(len(left)):
        left = [path for path in left if not _loads(path)]
    return ctypes.CDLL(str(libraries[0]))


def _loads(path: Path) -> bool:
    try:
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    except OSError:
        return False
    return True


def has_display() -> bool:
    """Return whether a display seems to exist, on Linux and similar systems."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


Opened = tuple[Any, ContextBinding, Callable[[], object]]
"""A moderngl context, what makes it current, and what to do when it is released."""


def _open_egl() -> Opened:
    import moderngl  # noqa: PLC0415

    options: dict[str, Any] = {
        "backend": "egl",
        "libgl": find_library("GL") or find_library("OpenGL") or "libGL.so.1",
        "libegl": find_library("EGL") or "libEGL.so.1",
    }
    binding = EglBinding(options["libegl"])
    context = moderngl.create_context(require=330, standalone=True, **options)
    binding.take()
    return context, binding, bool


def _open_window() -> Opened:
    import glfw  # noqa: PLC0415
    import moderngl  # noqa: PLC0415

    if sys.platform.startswith("linux") and not has_display():
        msg = "there is no display"
        raise UmbraError(msg)
    if not glfw.init():
        msg = "glfw does not start"
        raise UmbraError(msg)
    hint_window(glfw)
    glfw.window_hint(glfw.VISIBLE, False)
    window = glfw.create_window(16, 16, "umbra", None, None)
    if not window:
        msg = "glfw opens no window with OpenGL 3.3"
        raise UmbraError(msg)
    glfw.make_context_current(window)
    context = moderngl.create_context(require=330)
    return context, WindowBinding(window), lambda: glfw.destroy_window(window)


def _open_osmesa() -> Opened:
    import moderngl  # noqa: PLC0415

    mesa: Any = OffscreenMesa()
    context = moderngl.create_context(require=330, standalone=True, context=mesa)
    return context, mesa, bool


BACKENDS: dict[str, Callable[[], Opened]] = {
    "egl": _open_egl,
    "osmesa": _open_osmesa,
    "window": _open_window,
}
"""Tried in this order."""
