"""
Receivers: the points and cells on which a study counts shadows.

Names of kinds are compared here and nowhere else: other code calls a method of the kind.
"""

from umbra.errors import InputError
from umbra.ground.level import has_terrain
from umbra.receivers.kind import ReceiverKind
from umbra.registry import Registry
from umbra.scene import Scene
from umbra.scene.mesh import ADDED_GROUND

__all__ = ["REGISTRY", "find_kind", "name_kind"]

_VIEWS = {
    "elevation": "umbra.receivers.orthographic:ElevationView",
    "view": "umbra.receivers.orthographic:ViewFromAbove",
}
"""Those that a direction names."""
_NAMED = {
    "ground": "umbra.receivers.plan:GroundPlane",
    "top": "umbra.receivers.plan:TopmostSurface",
    "camera": "umbra.receivers.camera_pixels:CameraPicture",
    "surfaces": "umbra.receivers.points:SampledSurfaces",
    "points": "umbra.receivers.points:GivenPoints",
    "windows": "umbra.receivers.windows:WindowKind",
    "areas": "umbra.receivers.areas:AreaKind",
}
REGISTRY: Registry[ReceiverKind] = Registry(
    "receivers", "receivers", _NAMED | _VIEWS, ReceiverKind, "PlacedKind"
)
"""Kinds by the name that results state."""


def name_kind(name: str, *, is_added: bool) -> ReceiverKind:
    """Return a kind by the name that results state, with or without a ground that was added."""
    if name == "ground" and is_added:
        from umbra.receivers.plan import GroundSurface  # noqa: PLC0415  (one kind is loaded)

        return GroundSurface()
    return REGISTRY.find(name)


def has_added(scene: Scene) -> bool:
    """Return whether a scene holds a ground beside its model."""
    return any(part.kind in ADDED_GROUND for part in scene.parts)


def find_kind(
    receivers: str, scene: Scene | None = None, ground: float | str | None = None
) -> ReceiverKind:
    """
    Find a kind of receivers by name.

    Parameters
    ----------
    receivers : str
        A name of ``REGISTRY``; the direction of an elevation or a view; or ``"auto"``: the topmost
        surfaces of a model with its own ground, else the ground plane.
    scene : Scene, optional
        Scene of the study; without it ``"auto"`` is the ground plane.
    ground : float, optional
        Height of the ground, if given.

    Raises
    ------
    InputError
        If the name is unknown.
    """
    if receivers in {"auto", "ground"} and scene is not None and has_added(scene):
        return name_kind("ground", is_added=True)
    if receivers == "auto":
        if scene is None or ground is not None or scene.ground is not None:
            return REGISTRY.find("ground")
        return REGISTRY.find("top" if has_terrain(scene) else "ground")
    if receivers in _NAMED:
        return REGISTRY.find(receivers)
    from umbra.receivers.orthographic import find_direction  # noqa: PLC0415  (one kind is loaded)

    try:
        _, tilt = find_direction(receivers, [*_NAMED])
    except InputError:
        if receivers in REGISTRY.added:
            return REGISTRY.find(receivers)
        if not REGISTRY.added:
            raise
        _, tilt = find_direction(receivers, [*_NAMED, *REGISTRY.added])
    return REGISTRY.find("view" if tilt else "elevation")
