"""Random edits of a `Renderer` by name, and its pictures beside those of a fresh one."""

from dataclasses import dataclass

import numpy as np

from support.edits import Edits, place_part
from support.own_engine import frustum, look_at
from support.shapes import box
from umbra.realtime import Renderer
from umbra.scene import Mesh, Part
from umbra.soft import ball_light

__all__ = ["NamedEdits", "compare_by_name"]

FRAME = 128, 128
KINDS = (
    "move", "add", "remove", "replace", "bend", "light", "sun", "sun", "camera", "size", "samples",
    "near", "fov", "rim", "dark", "into", "soft", "hdr", "still",
)  # fmt: skip


@dataclass
class NamedEdits(Edits):
    """
    A view that is edited as a program does, through the renderer.

    Parts move, come and go, bend and are replaced by name; lights, cameras, samples and viewports
    change; pictures are the renderer's own, in display colours or as linear light, or added to a
    framebuffer of the caller's.
    """

    def __post_init__(self):
        super().__post_init__()
        self.samples, self.viewport, self.is_soft, self.is_hdr, self.made = 1, None, False, False, 0

    def act(self, renderer):
        """Change one or a few things; remember which."""
        count = 1 if self.random.random() < 0.6 else int(self.random.integers(2, 4))
        for kind in self.random.choice(KINDS, count):
            if hasattr(self, f"do_{kind}"):
                getattr(self, f"do_{kind}")(renderer)
            else:
                getattr(self, f"edit_{kind}")()
            self.done.append(str(kind))

    def choose(self, renderer):
        """Give a part of the scene as it is now."""
        parts = renderer.scene.parts
        return parts[self.random.integers(len(parts))]

    def make_block(self):
        self.made += 1
        low = self.random.uniform((-10, -10, 0), (6, 6, 2))
        vertices, faces = box(low, low + self.random.uniform(1, 5, 3))
        return Part(f"block {self.made}", "", Mesh(np.asarray(vertices) + self.far, faces))

    def do_still(self, renderer):
        """Change nothing."""

    def do_move(self, renderer):
        part = self.choose(renderer)
        place = np.eye(4)
        place[:3, 3] = self.random.uniform(-2, 2, 3)
        is_whole = part.name.startswith(("ball", "knot"))
        renderer.move(part.name, place_part(self.random, self.far) if is_whole else place)

    def do_add(self, renderer):
        if len(renderer.scene.parts) < 12:
            renderer.add(self.make_block())

    def do_remove(self, renderer):
        if len(renderer.scene.parts) > 4:
            renderer.remove(self.choose(renderer).name)

    def do_replace(self, renderer):
        renderer.replace(self.choose(renderer).name, self.make_block())

    def do_bend(self, renderer):
        part, origin = self.choose(renderer), renderer.scene.origin
        middle = part.mesh.vertices.mean(0)
        wave, phase = self.random.normal(size=(3, 3)), self.random.uniform(0, 6, 3)
        size = 0.1 * np.ptp(part.mesh.vertices, axis=0).max()
        bent = part.mesh.vertices + size * np.sin((part.mesh.vertices - middle) @ wave + phase)
        place = part.transform
        if place is None:
            bent = bent + origin
        else:
            place = place.copy()
            place[:3, 3] += origin
        mesh = part.mesh.moved(bent, part.mesh.normals)
        renderer.replace(part.name, Part(part.name, "", mesh, place))

    def do_samples(self, renderer):
        self.samples = int(self.random.choice((1, 2, 4, 8)))

    def do_into(self, renderer):
        corner, size = self.random.integers(0, 20, 2), self.random.integers(20, 80, 2)
        self.viewport = None if self.viewport else [*corner.tolist(), *size.tolist()]

    def do_soft(self, renderer):
        self.is_soft = not self.is_soft and self.random.random() < 0.1  # each takes 256 counts

    def do_hdr(self, renderer):
        self.is_hdr = not self.is_hdr

    def show(self, renderer, frame):
        """Draw the view as it is now; return the picture, levels of 255."""
        lights = self.lights
        if self.is_soft:
            lights = [ball_light(each, 0.7 if each.is_point else 2.0) for each in lights]
        if self.viewport is None:
            samples = 1 if self.is_hdr else self.samples
            renderer.draw(self.camera, lights, samples=samples, hdr=self.is_hdr)
            return renderer.read() * (255.0 if self.is_hdr else 1.0)
        camera, (cols, rows) = self.camera, self.viewport[2:]
        high = np.tan(np.radians(camera.fov) / 2) * 0.1
        across = high * cols / rows
        view = look_at(camera.eye, camera.target)
        projection = frustum(-across, across, -high, high, 0.1, 500.0)
        frame.clear(0.2, 0.3, 0.4, 1.0, depth=1.0)
        renderer.draw_into(frame, view, projection, lights, self.viewport, samples=self.samples)
        return np.frombuffer(frame.read(components=4), np.uint8).reshape(*FRAME, 4) * 1.0


def compare_by_name(context, seed, steps, far=(0.0, 0.0, 0.0)):
    """
    Edit a kept renderer, and draw each view by a fresh one of the same context, too.

    Yields as `support.edits.compare`.
    """
    edits = NamedEdits(seed, far)
    frame = context.framebuffer([context.texture(FRAME, 4)], context.depth_renderbuffer(FRAME))
    with Renderer(edits.scene, context, ground=edits.ground) as kept:
        for _ in range(steps):
            edits.done.clear()
            edits.act(kept)
            shown = edits.show(kept, frame)
            with Renderer(kept.scene, context, ground=edits.ground) as fresh:
                apart = np.abs(shown - edits.show(fresh, frame)).max(-1)
            how = {"samples": edits.samples, "viewport": edits.viewport, "hdr": edits.is_hdr}
            yield tuple(edits.done), how, int((apart > 1).sum())
    frame.release()
