"""
An engine of one's own on WebGPU, with penumbrae: shadow volumes planned as arrays, drawn by wgpu.

    python examples/realtime_in_wgpu.py pictures/

The engine owns the device, its textures, pipelines and shaders. A round lamp is many points
(McGuire et al. 2003, section 4): of each, volumes are counted in the stencil, and its share of the
light is added where the count is 0. Needs `pip install 'umbra-shadows[wgpu]'`; Mesa's lavapipe is
enough (Debian: `mesa-vulkan-drivers`).
"""

import sys
from pathlib import Path

import numpy as np
import wgpu
from PIL import Image

import umbra
from umbra.realtime import VolumePlanner
from umbra.soft import ball_light

SIZE = 640, 480
POINTS, RADIUS = 24, 1.2  # of the lamp [m]
SHADER = """
enable clip_distances;
struct View { matrix: mat4x4<f32>, lamp: vec4<f32>, near: vec2<f32>, ambient: f32, lit: f32 }
@group(0) @binding(0) var<uniform> view: View;

struct Drawn {
    @invariant @builtin(position) place: vec4<f32>, @location(0) at: vec3<f32>,
    @location(1) normal: vec3<f32>,
}
@vertex fn place(@location(0) at: vec3<f32>, @location(1) normal: vec3<f32>) -> Drawn {
    return Drawn(view.matrix * vec4(at, 1.0), at, normal);
}
@fragment fn shade(drawn: Drawn) -> @location(0) vec4<f32> {
    let facing = max(dot(normalize(view.lamp.xyz - drawn.at), drawn.normal), 0.0);
    return vec4((view.ambient + view.lit * facing) * vec3(0.9, 0.8, 0.6), 1.0);
}

struct Volume {
    @invariant @builtin(position) place: vec4<f32>, @location(0) depth: vec2<f32>,
    @builtin(clip_distances) before: array<f32, 1>,
}
@vertex fn extrude(@location(0) vertex: vec4<f32>) -> Volume {
    let p = view.matrix * vertex;
    return Volume(vec4(p.xy, 0.5 * p.w, p.w), p.zw, array<f32, 1>(dot(view.near, p.zw)));
}
@fragment fn clamp_depth(@location(0) depth: vec2<f32>) -> @builtin(frag_depth) f32 {
    return clamp(depth.x / depth.y, 0.0, 1.0);
}
"""
OPERATIONS = {"keep": "keep", "up": "increment-wrap", "down": "decrement-wrap"}
DEPTH, COLOR = "depth24plus-stencil8", "rgba16float"


def make_box(x, y, half, low, high):
    """Return a block."""
    corners = [(x + i * half, y + j * half, z)
               for z in (low, high) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
    sides = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return umbra.Mesh(corners, [f for a, b, c, d in sides for f in ((a, b, c), (a, c, d))])


def make_scene():
    """Return six columns with a slab on each, on a floor."""
    parts = []
    for k in range(6):
        x, y = 9 * np.cos(k), 9 * np.sin(k)
        parts.append(umbra.Part(f"column {k}", "", make_box(x, y, 0.5, 0, 3)))
        parts.append(umbra.Part(f"slab {k}", "", make_box(x, y, 1.4, 3, 3.4)))
    plane = [(-40, -40, 0), (40, -40, 0), (40, 40, 0), (-40, 40, 0)]
    floor = umbra.Part("floor", "", umbra.Mesh(plane, [(0, 1, 2), (0, 2, 3)]))
    return umbra.make_scene([*parts, floor])


def look_at(eye, target):
    """Return a view matrix with z upward in the picture."""
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def make_projection(fov, aspect, near):
    """Return a perspective to infinity, with WebGPU's depth from 0 to 1."""
    scale = 1 / np.tan(np.radians(fov) / 2)
    matrix = np.diag([scale / aspect, scale, -1.0, 0.0])
    matrix[2, 3], matrix[3, 2] = -near, -1.0
    return matrix


class Engine:
    """Draws one mesh, (n, 6) points relative to the eye and normals, with a count of shadows."""

    def __init__(self, rows):
        adapter = wgpu.gpu.request_adapter_sync(power_preference="high-performance")
        self.device = adapter.request_device_sync(required_features=["clip-distances"])
        self.mesh, self.n = self.upload(rows.astype("f4"), "VERTEX"), len(rows)
        self.module = self.device.create_shader_module(code=SHADER)
        use = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC
        self.color, self.depth = (
            self.device.create_texture(size=(*SIZE, 1), format=form, usage=use)
            for form in (COLOR, DEPTH)
        )
        entry = {"binding": 0, "visibility": 3, "buffer": {"type": "uniform"}}
        self.group = self.device.create_bind_group_layout(entries=[entry])
        self.layout = self.device.create_pipeline_layout(bind_group_layouts=[self.group])
        self.pipelines = {}

    def upload(self, values, kind):
        """Return a buffer."""
        return self.device.create_buffer_with_data(data=values, usage=wgpu.BufferUsage[kind])

    def make_pipeline(self, test, front, back, added):
        """Return a pipeline: of volumes if they count up or down, else of the mesh."""
        key = test, front, back, added
        if key in self.pipelines:
            return self.pipelines[key]
        counts = front is not None
        sides = [{"compare": "equal" if added else "always"}] * 2
        if counts:
            sides = [{"depth_fail_op": OPERATIONS[fails], "pass_op": OPERATIONS[passes]}
                     for fails, passes in (front, back)]  # fmt: skip
        add = {"src_factor": "one", "dst_factor": "one" if added else "zero", "operation": "add"}
        target = {"format": COLOR, "blend": {"color": add, "alpha": add}}
        formats = ["float32x4"] if counts else ["float32x3", "float32x3"]
        self.pipelines[key] = self.device.create_render_pipeline(
            layout=self.layout,
            vertex={
                "module": self.module, "entry_point": "extrude" if counts else "place",
                "buffers": [{"array_stride": 16 if counts else 24, "attributes": [
                    {"format": form, "offset": 12 * k, "shader_location": k}
                    for k, form in enumerate(formats)
                ]}],
            },
            primitive={"topology": "triangle-list"},
            depth_stencil={
                "format": DEPTH, "depth_compare": test, "stencil_front": sides[0],
                "stencil_back": sides[1], "depth_write_enabled": not counts and not added,
            },
            fragment={
                "module": self.module, "entry_point": "clamp_depth" if counts else "shade",
                "targets": [] if counts else [target],
            },
        )  # fmt: skip
        return self.pipelines[key]

    def draw(self, plan, lamp, ambient, lit, volumes):
        """Draw the mesh, or a light's volumes: of 256 and more, eight bits forget some."""
        rest = [*lamp, 1.0, *plan.near, ambient, lit]
        view = np.concatenate([plan.matrix.T.ravel(), rest]).astype("f4")
        uniform = {"buffer": self.upload(view, "UNIFORM"), "offset": 0, "size": view.nbytes}
        bound = self.device.create_bind_group(
            layout=self.group, entries=[{"binding": 0, "resource": uniform}]
        )
        first = ambient > 0
        begin = "clear" if first else "load"
        colors = {"view": self.color.create_view(), "load_op": begin, "store_op": "store"}
        depth = {
            "view": self.depth.create_view(), "depth_load_op": begin, "depth_store_op": "store",
            "depth_clear_value": 1.0, "stencil_load_op": "clear" if volumes or first else "load",
            "stencil_store_op": "store", "stencil_clear_value": plan.start,
        }  # fmt: skip
        encoder = self.device.create_command_encoder()
        render = encoder.begin_render_pass(
            color_attachments=[] if volumes else [colors], depth_stencil_attachment=depth
        )
        if volumes and plan.passes:
            render.set_vertex_buffer(0, self.upload(plan.vertices, "VERTEX"))
            render.set_index_buffer(self.upload(plan.indices, "INDEX"), "uint32")
        for each in plan.passes if volumes else ():
            render.set_pipeline(self.make_pipeline(each.depth_test, each.front, each.back, False))
            render.set_bind_group(0, bound)
            render.draw_indexed(each.count, 1, each.first)
        if not volumes:
            test = "less" if first else "equal"
            render.set_pipeline(self.make_pipeline(test, None, None, not first))
            render.set_bind_group(0, bound)
            render.set_stencil_reference(0)
            render.set_vertex_buffer(0, self.mesh)
            render.draw(self.n)
        render.end()
        self.device.queue.submit([encoder.finish()])

    def read(self):
        """Return the picture, (rows, cols, 3) linear light."""
        cols, rows = SIZE
        data = self.device.queue.read_texture(
            {"texture": self.color}, {"bytes_per_row": 8 * cols}, (cols, rows, 1)
        )
        return np.frombuffer(data, np.float16).reshape(rows, cols, 4)[..., :3].astype(float)


def main(folder):
    """Draw a frame with soft shadows."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = make_scene()
    eye = np.array((22.0, -26.0, 20.0))
    view, projection = look_at(eye, (0, 0, 1)), make_projection(45, 4 / 3, 0.5)

    # umbra's vertices are relative to the eye, and so is the mesh: one matrix places both.
    soup = scene.triangles()
    corners = soup.vertices[soup.faces] + scene.origin - eye
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.repeat(normals / np.linalg.norm(normals, axis=1, keepdims=True), 3, axis=0)
    engine = Engine(np.hstack([corners.reshape(-1, 3), normals]))

    planner = VolumePlanner(scene)
    lamp = ball_light(umbra.point_light((2, -3, 11)), RADIUS)
    for number, point in enumerate(lamp.points(POINTS)):
        plan = planner.plan(view, projection, SIZE, point)
        place = point.position[:3] - eye
        if number == 0:
            engine.draw(plan, place, ambient=0.15, lit=0.0, volumes=False)
        engine.draw(plan, place, ambient=0.0, lit=0.0, volumes=True)
        engine.draw(plan, place, ambient=0.0, lit=0.8 / POINTS, volumes=False)

    light = engine.read()
    picture = np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    Image.fromarray(picture).save(folder / "own_wgpu_engine.png")
    adapter = engine.device.adapter.info["device"]
    print(f"{POINTS} points of a lamp, at most {plan.deepest} volumes deep, on {adapter}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "pictures"))
