"""
OpenGL 3.3 core contexts: EGL without a display, OSMesa, or a hidden window.

Any number may be open. OpenGL's functions act on the context that is *current* in the thread, and
objects of different contexts share numbers. So access to a device's functions makes it current, and
public methods (``on_device``) restore the previous context. ``backends`` imports moderngl.
"""

import os
import re
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from importlib.util import find_spec
from typing import Any, Concatenate, ParamSpec, Protocol, Self, TypeVar

from umbra.errors import InputError, UmbraError
from umbra.gl.backends import BACKENDS, ContextBinding, bind_given, check_fork, note_use
from umbra.gl.caller_state import CallerState
from umbra.gl.functions import Functions
from umbra.packages import write_install
from umbra.scene.exposure import DAY, Sky

__all__ = [
    "BACKENDS", "Device", "DeviceUser", "on_device", "open_device", "release_all", "tell_driver",
]  # fmt: skip

_ERRORS = {
    0x0500: "an invalid enum",
    0x0501: "an invalid value",
    0x0502: "an invalid operation",
    0x0505: "no memory left",
    0x0506: "an incomplete framebuffer",
    0x0507: "a lost context: the driver was reset",
}


class _Current(threading.local):
    device: "Device | None" = None  # whose context is current in this thread


_current = _Current()


def _forget_current() -> None:
    _current.device = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_current)


@dataclass(eq=False)
class Device:
    """
    An OpenGL context and its capabilities. It belongs to the thread that opened it.

    Parameters
    ----------
    handle : moderngl.Context
    backend : str
        One of ``BACKENDS``, or ``given``.
    vendor, renderer, version : str
        As reported by the driver.
    is_software : bool
        Whether rendering runs on the CPU.
    has_depth_bounds, has_timer_queries : bool
    reverses_depth : bool
        Depth is 1 at the near plane and 0 at infinity, in 32-bit float: equally precise far
        and near. Otherwise 0 to 1, in 24 bits.
    functions : Functions
        Entry points that moderngl lacks.
    binding : ContextBinding
    live : set of str
        Objects not released yet, by kind and number.
    sky : Sky
        Of the pictures that are drawn next; programs are linked for each.
    is_lent : bool
        The context belongs to another program, whose OpenGL state each outermost public call
        gives back.
    """

    handle: Any
    backend: str
    vendor: str
    renderer: str
    version: str
    is_software: bool
    has_depth_bounds: bool
    has_timer_queries: bool
    reverses_depth: bool
    functions: Functions
    binding: ContextBinding
    live: set[str] = field(default_factory=set)
    sky: Sky = DAY
    is_lent: bool = False
    _finish: Callable[[], object] = bool
    _thread: threading.Thread = field(default_factory=threading.current_thread)
    _is_open: bool = True
    _depth: int = 0

    @classmethod
    def of(
        cls, context: Any, backend: str = "given", binding: ContextBinding | None = None
    ) -> "Device":
        """
        Wrap the current moderngl context, such as a window's.

        ``binding`` makes it current; moderngl's own by default, of a context that ``is_lent``.
        Raises `UmbraError` if the context is no OpenGL 3.3.
        """
        if context.version_code < 330:
            has = context.version_code / 100
            msg = f"OpenGL 3.3 is needed and this context has {has:.1f}; {_advise()}"
            raise UmbraError(msg)
        note_use()
        info = context.info
        renderer = info["GL_RENDERER"]
        device = cls(
            handle=context,
            backend=backend,
            vendor=info["GL_VENDOR"],
            renderer=renderer,
            version=info["GL_VERSION"],
            is_software=bool(re.search("llvmpipe|softpipe|swrast|SwiftShader|Software", renderer)),
            has_depth_bounds="GL_EXT_depth_bounds_test" in context.extensions,
            has_timer_queries=True,  # of the core since 3.3
            reverses_depth=context.version_code >= 450
            or "GL_ARB_clip_control" in context.extensions,
            functions=Functions(_find_loader(context)),
            binding=binding or bind_given(context.mglo._context),
            is_lent=binding is None,
        )
        _current.device = device
        return device

    @classmethod
    def _open(cls, backend: str) -> "Device":
        """Open the context of a backend."""
        context, binding, finish = BACKENDS[backend]()
        device = cls.of(context, backend, binding)
        device._finish = finish
        return device

    @property
    def context(self) -> Any:
        """The moderngl context, made current."""
        self.use()
        return self.handle

    @property
    def gl(self) -> Functions:
        """The entry points of this context, which is made current."""
        self.use()
        return self.functions

    def use(self) -> None:
        """
        Make the context current in this thread.

        Raises `UmbraError` if it was released, or opened in another thread.
        """
        if _current.device is self:
            return
        check_fork()
        if not self._is_open:
            msg = "this OpenGL device was released; open another"
            raise UmbraError(msg)
        if threading.current_thread() is not self._thread:
            msg = (
                f"this OpenGL device was opened in the thread '{self._thread.name}' and is used in "
                f"'{threading.current_thread().name}'; open one in each thread that draws"
            )
            raise UmbraError(msg)
        _leave()
        self.binding.__enter__()
        _current.device = self

    @contextmanager
    def current(self) -> Iterator[None]:
        """Make the context current, then restore the previous one."""
        before = _find_current()
        self.use()
        saved = self._keep_state() if self.is_lent and not self._depth else None
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
            if saved is not None and self._is_open:
                self.use()
                saved.restore()
            if before is not self:
                _leave()
                if before is not None and before._is_open:
                    before.use()

    def _keep_state(self) -> CallerState:
        """Keep the state of the program that lent the context, and set it aside."""
        state = CallerState(
            self.functions, has_depth_bounds=self.has_depth_bounds,
            has_clip_control=self.reverses_depth,
        )  # fmt: skip
        state.set_aside()
        return state

    def keep(self, kind: str, number: int) -> str:
        """Register an object; return its key for ``forget``."""
        key = f"{kind} {number}"
        self.live.add(key)
        return key

    def forget(self, kind: str, number: int) -> None:
        """Unregister a released object."""
        self.live.discard(f"{kind} {number}")

    def make(self, kind: str) -> int:
        """Make an object by ``Functions.make`` and register it."""
        number = self.gl.make(kind)
        self.keep(kind.lower(), number)
        return number

    def delete(self, kind: str, number: int) -> None:
        """Delete an object of ``make``."""
        self.gl.delete(kind, number)
        self.forget(kind.lower(), number)

    def free(self, kind: str, held: Any) -> None:
        """Release a registered moderngl object."""
        self.use()
        self.forget(kind, held.glo)
        held.release()

    def check(self, work: str) -> None:
        """Raise `UmbraError` if OpenGL reports an error; ``work`` names the operation."""
        error = self.gl.GetError()
        if error:
            what = _ERRORS.get(error, hex(error))
            msg = f"OpenGL reports {what} while {work} ({self.renderer}); use device='cpu'"
            raise UmbraError(msg, option="device", code=error)

    def release(self) -> None:
        """Free the context; its objects become invalid."""
        if not self._is_open:
            return
        if self.is_lent:
            if _current.device is self:
                _current.device = None  # the context stays current: it is not umbra's
            self._is_open = False
            return
        with self.current():
            _leave()
            self._is_open = False
            if self.backend != "given":
                self.handle.release()
            self._finish()

    def __enter__(self) -> "Device":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _find_current() -> Device | None:
    """Return the current device, unless foreign code has changed the context."""
    if _current.device is not None and not _current.device.binding.is_current:
        _current.device = None
    return _current.device


def _leave() -> None:
    """Leave umbra's current context in this thread, if any."""
    last, _current.device = _current.device, None
    if last is not None and last._is_open:
        last.binding.__exit__(None, None, None)


class _Releasable(Protocol):
    def release(self) -> object: ...


def release_all(*held: _Releasable | None) -> None:
    """Release device objects in this order; skip None."""
    for resource in held:
        if resource is not None:
            resource.release()


class _HasDevice(Protocol):
    @property
    def device(self) -> Device: ...


_T = TypeVar("_T", bound=_HasDevice)
_P = ParamSpec("_P")
_R = TypeVar("_R")


def on_device(method: Callable[Concatenate[_T, _P], _R]) -> Callable[Concatenate[_T, _P], _R]:
    """Run a method with its object's device current, then restore the previous one."""

    @wraps(method)
    def run(self: _T, *args: _P.args, **options: _P.kwargs) -> _R:
        with self.device.current():
            return method(self, *args, **options)

    return run


class DeviceUser(ABC):
    """Base of classes that draw on a given device, or on their own, released with them."""

    def __init__(self, device: Device | None) -> None:
        self.device = device or open_device()
        self._owns_device = device is None

    @abstractmethod
    def _list_held(self) -> Iterable[_Releasable | None]:
        """List the objects held on the device, in order of release."""

    @on_device
    def release(self) -> None:
        """Free all objects held on the device."""
        release_all(*self._list_held())
        if self._owns_device:
            self.device.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def tell_driver() -> str:
    """Say how to install a driver."""
    return (
        "install a driver (Debian, Ubuntu: apt install libegl1 libgl1 libgl1-mesa-dri; "
        f"anywhere on Linux: {write_install('osmesa')})"
    )


def _advise() -> str:
    return f"{tell_driver()}, or stay with device='cpu'"


def open_device(backend: str | None = None) -> Device:
    """
    Open a context without a display or, as a last resort, in a hidden window.

    Parameters
    ----------
    backend : {'egl', 'osmesa', 'window'}, optional
        By default the first that works.

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
    check_fork()
    for package in ("moderngl", "glcontext"):
        if find_spec(package) is None:
            msg = f"the gl device needs {package}, which is not installed; {write_install('gl')}"
            raise UmbraError(msg, package=package)
    reasons = []
    before = _find_current()
    _leave()
    try:
        for name in BACKENDS if backend is None else [backend]:
            try:
                return Device._open(name)
            except Exception as error:  # noqa: BLE001  (drivers raise anything)
                reasons.append(f"{name}: {' '.join(str(error).split())[:120]}")
    finally:
        _leave()
        if before is not None:
            before.use()
    msg = f"no OpenGL 3.3 opens here ({'; '.join(reasons)}); {_advise()}"
    raise UmbraError(msg, reasons=reasons)


def _find_loader(context: Any) -> Callable[[str], int]:
    """Return the loader of a moderngl context."""
    return context.mglo._context.load_opengl_function
