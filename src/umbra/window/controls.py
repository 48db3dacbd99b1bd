"""Mouse and key actions on a view; events are named, so that no window is needed."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from umbra.scene import point_light
from umbra.window.handles import GRIP, Pixel, drag, find_handles, pick, place_lamp
from umbra.window.motion import Motion
from umbra.window.view_state import OVERLAYS, ViewState, frame_bounds

__all__ = ["KEYS", "Controls"]

KEYS = {
    "F": "frame the model",
    "C": "orbit or walk",
    "W A S D": "walk; E and Q up and down",
    "Space": "play through the day",
    "Left, Right": "a quarter of an hour; Shift: a minute",
    "T": "play the animation",
    "1 2 3 4": "volumes, cases, edges, counts",
    "5 6 7": "components, profile, relief",
    "X": "the part under the mouse casts, or not",
    "M": "the next method",
    "G": "the other device",
    "H": "hard shadows, or soft ones",
    "R": "whole, half or quarter masks",
    "L": "add a light",
    "Delete": "remove the chosen light",
    "P": "screenshot",
    "Ctrl+S, Ctrl+O": "save the view, load it",
    "Tab": "the panel",
    "Ctrl+Q": "quit",
}
"""For the help, in its order."""

_TURN = 0.3  # degrees per pixel
_LOOK = 0.15
_WALK = 0.25  # of the model's diagonal per second
_COMMANDS = {"p": "screenshot", "x": "cast", "tab": "panel", "f1": "help"}
_WITH_CONTROL = {"s": "save", "o": "load", "q": "quit"}
_WALKING = frozenset("wasdeq")


@dataclass(frozen=True)
class _Drag:
    """A drag in progress: its button, its target and where it began."""

    kind: str
    button: str
    last: Pixel
    number: int = 0
    offset: Pixel = (0.0, 0.0)


@dataclass
class Controls:
    """
    Mouse and keyboard control of a view.

    Parameters
    ----------
    bounds : (2, 3) float64
        Bounds of the model [m].
    size : (int, int)
        Columns and rows of the picture, the frame of mouse positions [pixels].
    grip : float
        Radius in which a handle is picked [pixels].

    Attributes
    ----------
    plays : bool
        Whether the day plays.
    speed : float
        Clock minutes per second.
    animates : bool
        Whether the scene's animation plays.
    motion : Motion, optional
        The scene's animations.
    commands : list of str
        Pending commands: ``screenshot``, ``save``, ``load``, ``cast``, ``panel``, ``help``,
        ``quit``. The executor removes them.
    """

    bounds: NDArray[np.float64]
    size: tuple[int, int]
    grip: float = GRIP
    plays: bool = False
    speed: float = 60.0
    animates: bool = False
    motion: Motion | None = None
    commands: list[str] = field(default_factory=list)
    _drag: _Drag | None = None
    _held: set[str] = field(default_factory=set)

    @property
    def is_moving(self) -> bool:
        """Whether a drag, a walk or playback is in progress."""
        return self._drag is not None or self.needs_time

    @property
    def needs_time(self) -> bool:
        """Whether the view changes without events."""
        return self.plays or self.animates or bool(self._held)

    def press(self, view: ViewState, button: str, at: Pixel, *, shift: bool = False) -> ViewState:
        """
        Press a mouse button at a pixel, to drag the light's handle there, or else the camera.

        With shift the left button pans, too.
        """
        handle = pick(find_handles(view, self.size), at, self.grip) if button == "left" else None
        if handle is not None:
            offset = handle.at[0] - at[0], handle.at[1] - at[1]
            self._drag = _Drag("light", button, at, handle.number, offset)
            return replace(view, chosen=handle.number)
        kind = "turn" if button == "left" and not shift else "pan"
        self._drag = _Drag(kind, button, at)
        return view

    def move(self, view: ViewState, at: Pixel, *, shift: bool = False) -> ViewState:
        """Move the mouse; parameters as for ``press``. With shift a lamp keeps its height."""
        held = self._drag
        if held is None:
            return view
        cols, rows = at[0] - held.last[0], at[1] - held.last[1]
        self._drag = replace(held, last=at)
        if held.kind == "light":
            pixel = at[0] + held.offset[0], at[1] + held.offset[1]
            return drag(view, held.number, pixel, self.size, level=shift)
        if held.kind == "pan":
            return replace(view, viewpoint=view.viewpoint.pan(cols, rows, self.size[1]))
        if view.viewpoint.walks:
            turned = view.viewpoint.turn(_LOOK * cols, -_LOOK * rows)
        else:
            turned = view.viewpoint.turn(_TURN * cols, -_TURN * rows)
        return replace(view, viewpoint=turned)

    def release(self, button: str) -> None:
        """Release a mouse button."""
        if self._drag is not None and self._drag.button == button:
            self._drag = None

    def scroll(self, view: ViewState, steps: float) -> ViewState:
        """Zoom by the mouse wheel."""
        return replace(view, viewpoint=view.viewpoint.dolly(steps))

    def press_key(
        self, view: ViewState, key: str, *, control: bool = False, shift: bool = False
    ) -> ViewState:
        """Press a letter or digit, ``space``, ``tab``, ``left``, ``right``, ``delete``, ``f1``."""
        if control:
            if key in _WITH_CONTROL:
                self.commands.append(_WITH_CONTROL[key])
            return view
        if view.viewpoint.walks and key in _WALKING:
            self._held.add(key)
            return view
        if key in _COMMANDS:
            self.commands.append(_COMMANDS[key])
            return view
        act = self._list_actions(view, 1.0 if shift else 15.0).get(key)
        return view if act is None else act()

    def _list_actions(self, view: ViewState, minutes: float) -> dict[str, Callable[[], ViewState]]:
        """List the keys' actions on a view; arrows move the sun by ``minutes``."""
        return {
            **{str(n): partial(view.toggle, name) for n, name in enumerate(OVERLAYS, 1)},
            "f": lambda: replace(
                view, viewpoint=frame_bounds(self.bounds, self.size, view.viewpoint)
            ),
            "c": lambda: self._change_walk(view),
            "space": lambda: self._play_or_pause(view),
            "left": lambda: replace(view, sun=view.sun.pass_time(-minutes)),
            "right": lambda: replace(view, sun=view.sun.pass_time(minutes)),
            "t": lambda: self._animate_or_pause(view),
            "m": view.next_method,
            "g": view.next_device,
            "h": view.next_soft,
            "r": view.next_scale,
            "l": lambda: view.add_light(point_light(place_lamp(view, self.bounds, self.size))),
            "delete": lambda: view.remove_light(view.chosen),
        }

    def _change_walk(self, view: ViewState) -> ViewState:
        self._held.clear()
        walks = not view.viewpoint.walks
        return replace(view, viewpoint=replace(view.viewpoint, walks=walks))

    def _play_or_pause(self, view: ViewState) -> ViewState:
        self.plays = not self.plays
        return view

    def _animate_or_pause(self, view: ViewState) -> ViewState:
        self.animates = not self.animates and self.motion is not None and self.motion.has_any
        return view

    def release_key(self, key: str) -> None:
        """Release a key."""
        self._held.discard(key)

    def let_go(self) -> None:
        """Release all buttons and keys, as when the window loses focus."""
        self._held.clear()
        self._drag = None

    def advance(self, view: ViewState, seconds: float) -> ViewState:
        """Advance time: walk, play the day and the animation."""
        if self._held and view.viewpoint.walks:
            held = self._held
            stride = _WALK * float(np.linalg.norm(np.ptp(self.bounds, axis=0))) * seconds
            ahead, right, up = (
                stride * ((plus in held) - (minus in held)) for plus, minus in ("ws", "da", "eq")
            )
            view = replace(view, viewpoint=view.viewpoint.walk(ahead, right, up))
        if self.plays:
            view = replace(view, sun=view.sun.play(self.speed * seconds))
        if self.animates and self.motion is not None:
            view = self.motion.advance(view, seconds)
        return view
