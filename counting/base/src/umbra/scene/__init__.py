"""Records of models: meshes, parts, lights, cameras. No format, no calendar, no GPU."""

from umbra.scene.camera import Camera
from umbra.scene.large_lights import area_light, sphere_light, volume_light
from umbra.scene.lights import Light, directional_light, point_light, spot_light
from umbra.scene.making import make_scene, pose
from umbra.scene.material import Image, Material, make_image
from umbra.scene.mesh import Mesh, Part
from umbra.scene.rig import Animation
from umbra.scene.scene import Scene, Source, Triangles

__all__ = [
    "Animation",
    "Camera",
    "Image",
    "Light",
    "Material",
    "Mesh",
    "Part",
    "Scene",
    "Source",
    "Triangles",
    "area_light",
    "directional_light",
    "make_image",
    "make_scene",
    "point_light",
    "pose",
    "sphere_light",
    "spot_light",
    "volume_light",
]
