"""The ground of pictures, windows and pages: that of a study."""

from collections.abc import Callable, Sequence

from umbra.calls.picture_options import DrawingOptions, ViewOptions
from umbra.calls.styles import Style
from umbra.ground.choice import find_ground, tell_feet
from umbra.ground.level import has_terrain
from umbra.scene import Scene

__all__ = ["choose_ground", "stand_scene"]


def choose_ground(
    scene: Scene, options: DrawingOptions, style: Style, tell: Callable[[str], object]
) -> tuple[Scene, float | None]:
    """Return the scene with its ground, and the height of a plane [m]: given, or assumed."""
    if options.ground is False:
        return scene, None
    if options.ground is None and (not style.has_ground or options.transparent):
        return scene, None
    if options.ground is None and has_terrain(scene):
        return scene, None
    ground = find_ground(scene, None if options.ground is True else options.ground)
    if ground.assumed is not None and not ground.file:
        what = f"one is drawn at z = {ground.level:.6g} m, as a study would assume"
        if ground.surface is not None:
            what = f"one is assumed, {tell_feet(ground.surface)}, as a study would"
        tell(
            f"note: the model has no ground of its own; {what}; ground= sets another, "
            "ground=False none"
        )
    for note in ground.notes:
        tell(f"note: {note}")
    return ground.scene, ground.level if ground.is_plane else None


def stand_scene(
    options: ViewOptions, scene: Scene, hanging: Sequence[int] = ()
) -> tuple[Scene, float | None]:
    """
    Return a scene with its ground, as for a study, and the height of a plane [m], if it is.

    ``hanging`` are the parts that tell nothing of its height, such as a study's canopies.
    """
    if options.ground is False:
        return scene, None
    ground = find_ground(scene, None if options.ground is True else options.ground, hanging)
    return ground.scene, ground.level if ground.is_plane else None
