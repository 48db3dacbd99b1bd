"""An X server without a screen, and a hand for mouse and keys of the windows on it."""

import contextlib
import ctypes
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from support.command import SCRIPT
from umbra.window.view_file import load_view

PATIENCE = 60  # [s]; a machine under load starts slowly
PAUSE = 0.15  # [s] between events, as of a hand


class Display:
    """Xvfb of its own; use it as a context."""

    def __enter__(self):
        reading, writing = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x800x24", "-nolisten", "tcp",
             "-noreset"],
            pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(writing)
        with os.fdopen(reading) as told:
            self.name = f":{told.readline().strip()}"
        self.environment = {**os.environ, "DISPLAY": self.name}
        self.environment.pop("WAYLAND_DISPLAY", None)
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(10)

    def do(self, *words):
        done = subprocess.run(
            ["xdotool", *map(str, words)],
            env=self.environment, capture_output=True, text=True, timeout=PATIENCE, check=False,
        )  # fmt: skip
        return done.stdout.strip()


class Desk:
    """A window of `umbra view` in a folder of its own; use it as a context."""

    def __init__(self, display, folder, *arguments):
        self.display, self.folder = display, Path(folder)
        self.process = subprocess.Popen(
            [sys.executable, str(SCRIPT), "view", *map(str, arguments)],
            cwd=folder, env=display.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip

    def __enter__(self):
        until = time.monotonic() + PATIENCE
        self.window = ""
        while not self.window:
            if self.process.poll() is not None or time.monotonic() > until:
                self.process.kill()
                msg = f"no window: {self.process.communicate()}"
                raise RuntimeError(msg)
            time.sleep(0.1)
            # Before it is shown, keys and mouse would go past it.
            self.window = self.display.do("search", "--onlyvisible", "--name", "umbra$")
        self.display.do("windowfocus", "--sync", self.window)
        self.display.do("mousemove", 800, 700)
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def press(self, *keys):
        for key in keys:
            self.display.do("key", key)
            time.sleep(PAUSE)

    def hold(self, key):
        """Hold a key for a while in which frames are drawn."""
        self.display.do("keydown", key)
        self.view()
        self.view()
        self.display.do("keyup", key)

    def drag(self, *places, button=1, slowly=False):
        """Drag from the first place over the others; slowly: a frame is drawn after each step."""
        wait = self.view if slowly else lambda: time.sleep(PAUSE)
        for number, place in enumerate(places):
            self.display.do("mousemove", *place)
            wait()
            if number == 0:
                self.display.do("mousedown", button)
                wait()
        self.display.do("mouseup", button)
        wait()

    def wait_for(self, name):
        """Wait until a file is there."""
        path, until = self.folder / name, time.monotonic() + PATIENCE
        while not path.exists():
            if self.process.poll() is not None or time.monotonic() > until:
                self.process.kill()
                msg = f"no {name}: {self.process.communicate()}"
                raise RuntimeError(msg)
            time.sleep(0.05)
        return path

    def view(self):
        """Save the view by its key and read it: all earlier events are done then."""
        path = next(iter(self.folder.glob("*.view.json")), None)
        if path is not None:
            path.unlink()
        self.press("ctrl+s")
        return load_view(self.wait_for(path.name if path is not None else "model.view.json"))

    def look(self):
        """Return what the screen shows, (rows, cols, 3) uint8."""
        return grab(self.display.name, 1280, 800)

    def close(self):
        """Ask the window to close, as a window manager does; give status and streams."""
        ask_to_close(self.display.name, int(self.window))
        return self.finish()

    def finish(self):
        out, err = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, out, err


class _Image(ctypes.Structure):
    _fields_ = (
        ("width", ctypes.c_int), ("height", ctypes.c_int), ("xoffset", ctypes.c_int),
        ("format", ctypes.c_int), ("data", ctypes.c_void_p),
    )  # fmt: skip


def grab(display, cols, rows):
    """Read the screen, of 24 bits in 4 bytes."""
    x11 = ctypes.CDLL("libX11.so.6")
    for name in ("XOpenDisplay", "XGetImage"):
        getattr(x11, name).restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = ctypes.c_ulong
    opened = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
    root = ctypes.c_ulong(x11.XDefaultRootWindow(opened))
    every, by_pixel = ctypes.c_ulong(0xFFFFFF), 2
    found = x11.XGetImage(opened, root, 0, 0, cols, rows, every, by_pixel)
    data = _Image.from_address(found).data
    pixels = np.frombuffer(ctypes.string_at(data, 4 * rows * cols), np.uint8)
    x11.XCloseDisplay(opened)
    return pixels.reshape(rows, cols, 4)[..., 2::-1].copy()


class _ClientMessage(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p), ("window", ctypes.c_ulong), ("message", ctypes.c_ulong),
        ("format", ctypes.c_int), ("data", ctypes.c_long * 5), ("rest", ctypes.c_long * 16),
    )  # fmt: skip


def ask_to_close(display, window):
    """Send WM_DELETE_WINDOW."""
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XInternAtom.restype = ctypes.c_ulong
    x11.XInternAtom.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
    x11.XSendEvent.argtypes = [
        ctypes.c_void_p, ctypes.c_ulong, ctypes.c_int, ctypes.c_long, ctypes.c_void_p
    ]  # fmt: skip
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    opened = x11.XOpenDisplay(display.encode())
    with contextlib.ExitStack() as stack:
        stack.callback(x11.XCloseDisplay, opened)
        names = [
            x11.XInternAtom(opened, name, 0) for name in (b"WM_PROTOCOLS", b"WM_DELETE_WINDOW")
        ]
        event = _ClientMessage(type=33, window=window, message=names[0], format=32)
        event.data[0] = names[1]
        x11.XSendEvent(opened, window, 0, 0, ctypes.byref(event))
