"""Animations in a view: choice, duration and posed scene."""

from dataclasses import replace

import numpy as np

from umbra.scene import Scene, pose
from umbra.scene.making import find_animations
from umbra.window.view_state import ViewState

__all__ = ["Motion"]


class Motion:
    """
    The animations of one scene, and its last pose.

    Parameters
    ----------
    scene : Scene
        Scene without an animation.

    Attributes
    ----------
    choices : dict
        Values of a view's ``animation``, by label in the panel.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = self._posed = self._lit = scene
        self._key: tuple[int | str | None, float] = (None, 0.0)
        self.choices: dict[str, int | str | None] = {"none": None}
        for number, animation in enumerate(scene.animations):
            self.choices[f"{number}: {animation.name}" if animation.name else str(number)] = number
        if len(scene.animations) > 1:
            self.choices["all"] = "all"

    @property
    def has_any(self) -> bool:
        """Whether the scene has an animation."""
        return bool(self._scene.animations)

    def find_duration(self, view: ViewState) -> float:
        """Return the duration of a view's animation [s]; 0 without one."""
        if view.animation is None:
            return 0.0
        return max(animation.duration for animation in find_animations(self._scene, view.animation))

    def pose(self, view: ViewState) -> Scene:
        """Return the scene of a view; the same object while nothing moves."""
        key = (view.animation, view.time if view.animation is not None else 0.0)
        if key != self._key:
            self._key, self._posed = key, self._scene
            if view.animation is not None:
                self._posed = pose(self._scene, view.time, view.animation)
        return self._posed

    def advance(self, view: ViewState, seconds: float) -> ViewState:
        """Advance the animation, in a loop; the first one if none is chosen."""
        if not self.has_any:
            return view
        if view.animation is None:
            view = replace(view, animation=0, time=0.0)
        duration = self.find_duration(view)
        return replace(view, time=(view.time + seconds) % duration if duration > 0 else 0.0)

    def follow(self, view: ViewState) -> ViewState:
        """Move the file's lights that the animation moved since the last call."""
        posed = self.pose(view)
        if posed is self._lit:
            return view
        lights = list(view.lights)
        for number, (old, new) in enumerate(zip(self._lit.lights, posed.lights, strict=True)):
            moved = (old.position, old.axis, old.up), (new.position, new.axis, new.up)
            if number < len(lights) and not all(map(_is_same, *moved)):
                lights[number] = replace(
                    lights[number], position=new.position, axis=new.axis, up=new.up
                )
        self._lit = posed
        return replace(view, lights=tuple(lights))


def _is_same(value: object, other: object) -> bool:
    return value is other or (value is not None and np.array_equal(value, other))  # type: ignore[arg-type]
