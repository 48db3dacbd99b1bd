"""Records of what is there: meshes, parts, lights, cameras. No format, no calendar, no GPU."""

from umbra.scene.camera import Camera
from umbra.scene.lights import Light, directional_light, point_light, spot_light
from umbra.scene.mesh import Mesh, Part
from umbra.scene.scene import Scene, Source, Triangles, make_scene

__all__ = [
    "Camera",
    "Light",
    "Mesh",
    "Part",
    "Scene",
    "Source",
    "Triangles",
    "directional_light",
    "make_scene",
    "point_light",
    "spot_light",
]
