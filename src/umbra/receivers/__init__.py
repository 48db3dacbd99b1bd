"""
Receivers: the points and cells on which a study counts shadows.

Names of kinds are compared here and nowhere else: other code calls a method of the kind.
"""

from umbra.errors import InputError
from umbra.ground.level import has_terrain
from umbra.receivers.areas import AreaKind
from umbra.receivers.camera_pixels import CameraPicture
from umbra.receivers.gridded import Raster
from umbra.receivers.kind import Counter, ReceiverKind, Receivers, Tile
from umbra.receivers.orthographic import ElevationView, ViewFromAbove, find_direction
from umbra.receivers.plan import GroundPlane, GroundSurface, TopmostSurface
from umbra.receivers.points import GivenPoints, SampledSurfaces, check_points, read_points
from umbra.receivers.seen import ViewTile
from umbra.receivers.single import SingleReceivers
from umbra.receivers.surface_samples import Samples
from umbra.receivers.windows import WindowKind
from umbra.registry import Registry
from umbra.scene import Scene
from umbra.scene.mesh import ADDED_GROUND

__all__ = [
    "KINDS", "REGISTRY", "Counter", "Raster", "ReceiverKind", "Receivers", "Samples",
    "SingleReceivers",
    "Tile", "ViewTile", "check_points", "find_kind", "name_kind", "read_points",
]  # fmt: skip

KINDS: dict[str, ReceiverKind] = {
    kind.name: kind
    for kind in (
        GroundPlane(), TopmostSurface(), ElevationView(), ViewFromAbove(), CameraPicture(),
        SampledSurfaces(), GivenPoints(), WindowKind(), AreaKind(),
    )
}  # fmt: skip
"""umbra's own kinds by the name that results state."""


REGISTRY: Registry[ReceiverKind] = Registry(
    "receivers", "receivers", {}, ReceiverKind, "PlacedKind"
)
"""Kinds that packages beside umbra bring."""


_SURFACE = GroundSurface()


def name_kind(name: str, *, is_added: bool) -> ReceiverKind:
    """Return a kind by the name that results state, with or without a ground that was added."""
    if name == "ground" and is_added:
        return _SURFACE
    return KINDS[name] if name in KINDS else REGISTRY.find(name)


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
        A name of ``KINDS``; the direction of an elevation or a view; or ``"auto"``: the topmost
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
            return KINDS["ground"]
        return KINDS["top" if has_terrain(scene) else "ground"]
    kind = KINDS.get(receivers)
    if kind is not None and kind.is_chosen_by_name:
        return kind
    names = [name for name, one in KINDS.items() if one.is_chosen_by_name]
    try:
        _, tilt = find_direction(receivers, names)
    except InputError:
        if receivers in REGISTRY:
            return REGISTRY.find(receivers)
        if not REGISTRY.added:
            raise
        _, tilt = find_direction(receivers, [*names, *REGISTRY.added])
    return KINDS["view" if tilt else "elevation"]
