"""
umbra: exact shadows from triangle meshes with shadow volumes.

Data flows one way::

    readers -> scene -> volume -> cpu or gl -> study, frame or window -> writers
    a file     records  silhouette counts      hours, lit, a view        PNG, NetCDF

The names below are the public face; they load what they need on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from umbra.version import __version__ as __version__

if TYPE_CHECKING:
    from umbra.calls.arguments import make_camera
    from umbra.calls.city import city_study
    from umbra.calls.counts import count, shadow_polygons
    from umbra.calls.envelope import envelope
    from umbra.calls.film import film
    from umbra.calls.part_height import part_height
    from umbra.calls.picture import Picture, render
    from umbra.calls.place import place
    from umbra.calls.prove import prove
    from umbra.calls.sky import sky_view
    from umbra.calls.study import shadow_study
    from umbra.calls.study_result import ShadowStudy
    from umbra.calls.sun_access import sun_access
    from umbra.calls.vectors import VectorDrawing, draw_vectors
    from umbra.calls.window import show
    from umbra.cpu.frame import count_shadows
    from umbra.errors import InputError, UmbraError
    from umbra.readers import read
    from umbra.rules.catalogue import list_rules
    from umbra.rules.read import read_rule
    from umbra.scene import (
        Camera,
        Image,
        Light,
        Material,
        Mesh,
        Part,
        Scene,
        area_light,
        directional_light,
        make_image,
        make_scene,
        point_light,
        sphere_light,
        spot_light,
        volume_light,
    )
    from umbra.scene.making import pose
    from umbra.study.compare import compare
    from umbra.sun import Site, find_site, find_sun, sun_light

_HOMES = {
    "Camera": "umbra.scene",
    "Image": "umbra.scene",
    "InputError": "umbra.errors",
    "Light": "umbra.scene",
    "Material": "umbra.scene",
    "Mesh": "umbra.scene",
    "Part": "umbra.scene",
    "Picture": "umbra.calls.picture",
    "Scene": "umbra.readers",  # which reads the files that a scene is made from
    "ShadowStudy": "umbra.calls.study_result",
    "Site": "umbra.sun",
    "UmbraError": "umbra.errors",
    "VectorDrawing": "umbra.calls.vectors",
    "area_light": "umbra.scene",
    "city_study": "umbra.calls.city",
    "compare": "umbra.study.compare",
    "count": "umbra.calls.counts",
    "count_shadows": "umbra.cpu.frame",
    "directional_light": "umbra.scene",
    "draw_vectors": "umbra.calls.vectors",
    "envelope": "umbra.calls.envelope",
    "film": "umbra.calls.film",
    "find_site": "umbra.sun",
    "find_sun": "umbra.sun",
    "list_rules": "umbra.rules.catalogue",
    "make_camera": "umbra.calls.arguments",
    "make_image": "umbra.scene",
    "make_scene": "umbra.scene",
    "part_height": "umbra.calls.part_height",
    "place": "umbra.calls.place",
    "point_light": "umbra.scene",
    "pose": "umbra.scene",
    "prove": "umbra.calls.prove",
    "read": "umbra.readers",
    "read_rule": "umbra.rules.read",
    "render": "umbra.calls.picture",
    "shadow_polygons": "umbra.calls.counts",
    "shadow_study": "umbra.calls.study",
    "show": "umbra.calls.window",
    "sky_view": "umbra.calls.sky",
    "sphere_light": "umbra.scene",
    "spot_light": "umbra.scene",
    "sun_access": "umbra.calls.sun_access",
    "sun_light": "umbra.sun",
    "volume_light": "umbra.scene",
}

__all__ = [
    "Camera",
    "Image",
    "InputError",
    "Light",
    "Material",
    "Mesh",
    "Part",
    "Picture",
    "Scene",
    "ShadowStudy",
    "Site",
    "UmbraError",
    "VectorDrawing",
    "area_light",
    "city_study",
    "compare",
    "count",
    "count_shadows",
    "directional_light",
    "draw_vectors",
    "envelope",
    "film",
    "find_site",
    "find_sun",
    "list_rules",
    "make_camera",
    "make_image",
    "make_scene",
    "part_height",
    "place",
    "point_light",
    "pose",
    "prove",
    "read",
    "read_rule",
    "render",
    "shadow_polygons",
    "shadow_study",
    "show",
    "sky_view",
    "sphere_light",
    "spot_light",
    "sun_access",
    "sun_light",
    "volume_light",
]


def __getattr__(name: str) -> object:
    """Load a public name on first use (PEP 562), so that ``import umbra`` is quick."""
    if name in _HOMES:
        _tell_kernel_cache()
        return getattr(import_module(_HOMES[name]), name)
    msg = f"module 'umbra' has no attribute {name!r}"
    raise AttributeError(msg)


def _tell_kernel_cache() -> None:
    """Warn once where compiled kernels cannot be kept."""
    from umbra.machine import find_kernel_cache  # noqa: PLC0415

    note = find_kernel_cache()
    if note is not None:
        from warnings import warn  # noqa: PLC0415

        warn(note, stacklevel=3)


def __dir__() -> list[str]:
    """List the public names."""
    return [*__all__, "__version__"]
