"""The scene of a study: on its ground, and without what its proposal replaces."""

from umbra.ground.choice import Ground, find_ground, keep_ground
from umbra.scene import Scene
from umbra.study.options import StudyOptions
from umbra.study.replaced import leave_replaced

__all__ = ["settle_ground"]


def settle_ground(scene: Scene, options: StudyOptions) -> Ground:
    """
    Find the ground of a study, on which all stands, and leave out what its proposal replaces.

    Canopies hang over the ground, and tell nothing of its height; what is replaced tells of it.
    """
    canopies = scene.whole.select(options.canopy, option="canopy") if options.canopy else ()
    hanging = [part for part in canopies if part < len(scene.parts)]
    model_ground = find_ground(scene, options.ground, hanging)
    left, _ = leave_replaced(
        model_ground.scene, options.proposed, options.replace, options.replace_in
    )
    if left is model_ground.scene:
        return model_ground
    crowns = {id(scene.parts[k]) for k in hanging}
    still = [k for k, part in enumerate(left.parts) if id(part) in crowns]
    return keep_ground(model_ground, left, options.ground, still)
