"""Random edits of a view, and the pictures of a kept renderer beside those of a fresh one."""

from contextlib import ExitStack
from dataclasses import dataclass, field, replace

import numpy as np

from support.shapes import box, torus_knot
from support.spheres import make_sphere
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.methods import Softness
from umbra.scene import (
    Camera,
    Mesh,
    Part,
    directional_light,
    make_scene,
    point_light,
    spot_light,
)
from umbra.scene.exposure import DAY, NIGHT
from umbra.soft import ball_light

SIZES = (64, 48), (96, 72), (128, 96), (48, 64), (32, 24), (95, 71)
DETAILS = 0.0, 3.0, 20.0
METHODS = "auto", "auto", "auto", "mcguire", "lengyel", "z-fail", "alpha", "screen"
SOFT = "samples", "wedges", "complexity", "weng"
FEW = Softness(samples=4, spots=4, length=20, gap=5)


def place_part(random, far):
    """Make a random rigid transform, not flat, with a scale."""
    place = np.eye(4)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn)) * random.uniform(0.6, 1.6)
    place[:3, :3] = turn
    place[:3, 3] = random.uniform((-9, -9, 2), (9, 9, 7)) + far
    return place


def make_parts(random, far):
    """Make a ground plate, still crates, a smooth knot and some balls of one mesh that move."""
    vertices, faces = torus_knot(24, 6)
    normals = (vertices / np.linalg.norm(vertices, axis=1)[:, None]).astype(np.float32)
    knot, ball = Mesh(vertices * 0.2, faces, normals), make_sphere(2, 1.0, (0, 0, 0))
    parts = []
    for k in range(3):
        low = random.uniform((-10, -10, 0), (6, 6, 1))
        vertices, faces = box(low, low + random.uniform(1, 5, 3))
        parts.append(Part(f"crate {k}", "", Mesh(np.asarray(vertices, float) + far, faces)))
    parts += [Part(f"ball {k}", "", ball, place_part(random, far)) for k in range(3)]
    return [*parts, Part("knot", "", knot, place_part(random, far))]


@dataclass
class Edits:
    """
    A view that is edited at random.

    Parameters
    ----------
    seed : int
    far : (3,) float
        Where the scene stands [m].
    """

    seed: int
    far: tuple = (0.0, 0.0, 0.0)
    done: list = field(default_factory=list)

    def __post_init__(self):
        self.random = random = np.random.default_rng(self.seed)
        self.far = np.array(self.far, float)
        self.parts = make_parts(random, self.far)
        self.scene = make_scene(self.parts)
        self.ground = None if random.random() < 0.3 else float(self.far[2])
        self.camera = Camera(self.far + (20, -25, 14), self.far + (0, 0, 2), size=SIZES[0])
        self.lights = [self.make_light()]
        self.detail, self.options = 0.0, {}
        self.shadows, self.sky = True, DAY

    def make_light(self):
        random, far = self.random, self.far
        kind = random.integers(6)
        place = random.uniform((-9, -9, 3), (9, 9, 20)) + far
        if kind < 2:
            return directional_light(random.normal(size=3) * (1, 1, 0.3) + (0, 0, 1))
        if kind == 2:
            return point_light(place)
        if kind == 3:
            return point_light(place, range=float(random.uniform(5, 30)))
        target = far + random.uniform((-4, -4, 0), (4, 4, 1))
        return spot_light(place, target, float(random.uniform(8, 50)), range=40.0)

    def edit(self):
        """Change one or a few things, mostly what a window changes alone; remember which."""
        names = self.random.choice(EDITS, self.random.integers(1, 3), replace=False)
        if self.random.random() < 0.6:
            names = [self.random.choice(OFTEN)]
        for name in names:
            getattr(self, f"edit_{name}")()
            self.done.append(str(name))

    def edit_size(self):
        self.camera = replace(self.camera, size=SIZES[self.random.integers(len(SIZES))])

    def edit_camera(self):
        angle, up = self.random.uniform(0, 2 * np.pi), self.random.uniform(-1, 30)
        eye = self.far + (30 * np.cos(angle), 30 * np.sin(angle), up)
        self.camera = replace(self.camera, eye=eye)

    def edit_near(self):
        self.camera = replace(self.camera, near=float(self.random.choice((0.01, 0.1, 1, 8, 25))))

    def edit_fov(self):
        height = None if self.random.random() < 0.6 else float(self.random.uniform(8, 40))
        self.camera = replace(self.camera, fov=float(self.random.uniform(20, 90)), height=height)

    def edit_light(self):
        if len(self.lights) > 1 and self.random.random() < 0.5:
            self.lights = self.lights[:1]
        number = self.random.integers(2)
        self.lights = [*self.lights[:number], self.make_light()]

    def edit_sun(self):
        """Change the last light alone, as a still eye sees it."""
        self.lights = [*self.lights[:-1], self.make_light()]

    def edit_dark(self):
        """Switch all lights off, or one on."""
        self.lights = [] if self.lights else [self.make_light()]

    def edit_shadows(self):
        self.shadows = not self.shadows

    def edit_sky(self):
        self.sky = NIGHT if self.sky is DAY else DAY

    def edit_rim(self):
        """Change what of a lamp is no place."""
        last = self.lights[-1] if self.lights else self.make_light()
        if self.lights and last.is_point:
            last = replace(last, range=float(self.random.uniform(10, 60)))
            self.lights = [*self.lights[:-1], last]

    def edit_move(self):
        number = 3 + self.random.integers(4)
        place = place_part(self.random, self.far)
        place[:3, 3] -= self.scene.origin
        parts = list(self.scene.parts)
        parts[number] = replace(parts[number], transform=place)
        self.scene = replace(self.scene, parts=tuple(parts))

    def edit_bend(self):
        """Bend the knot, all balls, which share a mesh, or a crate: other vertices and normals."""
        names = BENDS[self.random.integers(len(BENDS))]
        parts = list(self.scene.parts)
        chosen = [k for k, part in enumerate(parts) if part.name.startswith(names)]
        wave, phase = self.random.normal(size=(3, 3)), self.random.uniform(0, 6, 3)
        mesh = self.parts[chosen[0]].mesh
        origin = self.scene.origin if parts[chosen[0]].transform is None else 0.0
        vertices = mesh.vertices - origin
        size = 0.25 * np.ptp(vertices, axis=0).max()
        middle = vertices.mean(0)
        bent = vertices + size * self.random.random() * np.sin((vertices - middle) @ wave + phase)
        normals = mesh.normals
        if normals is not None and self.random.random() < 0.7:
            slope = np.linalg.norm(bent - middle, axis=1)[:, None]
            normals = ((bent - middle) / slope).astype(np.float32)
        mesh = parts[chosen[0]].mesh.moved(bent, normals)
        for k in chosen:
            parts[k] = replace(parts[k], mesh=mesh)
        self.scene = replace(self.scene, parts=tuple(parts))

    def edit_scale(self):
        """Count masks of another resolution."""
        if "mask_scale" in self.options:
            self.options = {**self.options, "mask_scale": 6 - self.options["mask_scale"]}

    def edit_detail(self):
        self.detail = DETAILS[self.random.integers(len(DETAILS))]

    def edit_method(self):
        """Choose among hard shadows, reduced masks, soft shadows and more samples."""
        kind = self.random.integers(6)
        method = str(self.random.choice(METHODS))
        if kind < 2:
            self.options = {"method": method}
        elif kind < 4:
            scale, how = int(self.random.choice((2, 4))), str(self.random.choice(FILTERS))
            self.options = {"method": method, "mask_scale": scale, "mask_filter": how}
        elif kind == 4:
            self.options = {"soft": str(self.random.choice(SOFT))}
        else:
            self.options = {"samples": int(self.random.choice((2, 4))), "method": method}

    def draw(self, renderer):
        """Draw the view as it is now."""
        renderer.choices = VolumeOptions(detail=self.detail, shorten=True)
        lights = self.lights
        if "soft" in self.options:
            lights = [ball_light(each, 0.7 if each.is_point else 2.0) for each in lights]
        renderer.draw(self.camera, lights, shadows=self.shadows, sky=self.sky, **self.options)
        return renderer.read()


BENDS = "knot", "ball", "crate 0", "crate 2"
FILTERS = "joint", "bilinear", "nearest"
OFTEN = (
    "size", "size", "near", "scale", "rim", "detail", "sun", "sun", "dark", "shadows", "sky",
    "bend", "bend",
)  # fmt: skip
EDITS = tuple(name[5:] for name in vars(Edits) if name.startswith("edit_"))


def compare(device, seed, steps, far=(0.0, 0.0, 0.0)):
    """
    Edit two kept renderers of one device in turn, and draw each view by a fresh one, too.

    Yields what was edited and how many pixels differ by more than the 1 of 255 levels of a still
    eye's view.
    """
    both = Edits(seed, far), Edits(seed + 1_000_000, far)
    with ExitStack() as stack:
        kept = [stack.enter_context(_open(device, each)) for each in both]
        for _ in range(steps):
            turn = int(both[0].random.random() < 0.25)
            edits = both[turn]
            edits.done.clear()
            before = edits.scene
            edits.edit()
            if edits.scene is not before:
                kept[turn].move(edits.scene)
            shown = edits.draw(kept[turn])
            with _open(device, edits) as fresh:
                anew = edits.draw(fresh)
            apart = np.abs(shown.astype(int) - anew).max(-1)
            yield tuple(edits.done), dict(edits.options), int((apart > 1).sum())


def _open(device, edits):
    return SceneRenderer(edits.scene, edits.ground, device=device, softness=FEW)
