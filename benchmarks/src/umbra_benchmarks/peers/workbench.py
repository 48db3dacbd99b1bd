"""
Blender's Workbench renderer with its stencil shadows, through bpy.

Workbench knows no lamps: one direction casts the shadows, and fixed studio lights
shade. It gets the direction from the lamp to the middle of the scene.
"""

from math import radians
from typing import Any

import bpy
from mathutils import Vector
from serve import Place, serve


class WorkbenchScene:
    """
    The spheres in a Blender scene.

    Parameters
    ----------
    scene : dict
        As ``Spheres.to_dict`` gives it.
    size : int
        Pixels a side.
    """

    def __init__(self, scene: dict[str, Any], size: int) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self._scene = bpy.context.scene
        sphere = _make_mesh("sphere", scene["vertices"], scene["faces"])
        sphere.shade_smooth()
        for centre in scene["centres"]:
            self._place(sphere).location = centre
        half = scene["half"]
        corners = [[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]
        self._place(_make_mesh("ground", corners, [[0, 1, 2, 3]]))

        lens = bpy.data.cameras.new("eye")
        lens.angle = radians(scene["fov"])
        lens.clip_start, lens.clip_end = 1.0, 1000.0
        camera = self._place(lens)
        camera.location = scene["eye"]
        forward = Vector(scene["target"]) - Vector(scene["eye"])
        camera.rotation_euler = forward.to_track_quat("-Z", "Y").to_euler()
        self._scene.camera = camera

        self._scene.render.engine = "BLENDER_WORKBENCH"
        self._scene.render.resolution_x = self._scene.render.resolution_y = size
        self._scene.render.resolution_percentage = 100
        self._scene.render.use_compositing = self._scene.render.use_sequencer = False
        self._scene.render.dither_intensity = 0.0
        self._scene.view_settings.view_transform = "Raw"
        display = self._scene.display
        display.render_aa = "OFF"
        display.shadow_shift, display.shadow_focus = 0.0, 1.0  # sharp, from where N.L is 0
        shading = display.shading
        shading.show_shadows, shading.shadow_intensity = True, 0.8
        shading.show_cavity = shading.show_object_outline = False
        shading.show_specular_highlight = False
        shading.color_type, shading.single_color = "SINGLE", (0.8, 0.8, 0.8)

        bpy.ops.render.render()
        import gpu  # noqa: PLC0415  (without a display it answers after a first picture)

        self.name = f"Blender Workbench {bpy.app.version_string}"
        self.driver = gpu.platform.renderer_get()

    def _place(self, data: Any) -> Any:
        placed = bpy.data.objects.new(data.name, data)
        self._scene.collection.objects.link(placed)
        return placed

    def render(self, light: Place) -> None:
        """Draw a frame into Blender's render result, which reads it back."""
        # The property has its own axes: y is up, and it points against the world's z.
        x, y, z = Vector(light).normalized()
        self._scene.display.light_direction = (x, z, -y)
        bpy.ops.render.render()

    def save(self, light: Place, path: str) -> None:
        """Draw a frame into a PNG file."""
        self.render(light)
        bpy.data.images["Render Result"].save_render(path)


def _make_mesh(name: str, vertices: Any, faces: Any) -> Any:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.update()
    return mesh


if __name__ == "__main__":
    serve(WorkbenchScene)
