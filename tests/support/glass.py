"""
Scenes of glass and leaves, and an oracle in float64 for what is seen and lit in them.

The oracle tries every triangle with every ray (Moeller and Trumbore 1997) and shares with umbra
only the look-up of a texel, which has tests of its own. It knows neither volumes nor trees nor
layers, and gives edges to nobody: what it says of a pixel counts where it says the same
around it.
"""

from dataclasses import dataclass

import numpy as np

from support.shapes import box
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene, point_light
from umbra.scene.material import make_image, sample

NEAR_EDGE = 1 / 64
"""Pixels: so near an edge a device may be on either side."""
TOUCH = 1e-6  # so near a triangle's plane a point lies on it [m]


def leaf_image(wrap=("repeat", "repeat"), levels=(0, 255)):
    """Draw a lobed leaf."""
    y, x = np.mgrid[0:24, 0:24] / 23 - 0.5
    is_leaf = np.hypot(x, y) < 0.3 + 0.15 * np.cos(5 * np.arctan2(y, x))
    pixels = np.zeros((24, 24, 4), np.uint8)
    pixels[...] = np.where(is_leaf[..., None], (60, 150, 40, levels[1]), (200, 60, 30, levels[0]))
    return make_image(pixels, "leaf", wrap)


def card(corners, uv=((0, 0), (1, 0), (1, 1), (0, 1)), **more):
    """Make a quad with texture coordinates."""
    placed = None if uv is None else np.array(uv, np.float32)
    return Mesh(np.array(corners, float), np.array([(0, 1, 2), (0, 2, 3)]), uv=placed, **more)


def level_card(x, y, z, size=2.0, **more):
    """Make a level card with its lowest corner at a place."""
    x1, y1 = x + size, y + size
    return card([(x, y, z), (x1, y, z), (x1, y1, z), (x, y1, z)], **more)


FLOOR = Part("floor", "", level_card(-12, -12, 0, 24, uv=None))
HOUSE = Part("house", "", Mesh(*box((-6, 2, 0), (-2, 6, 4))))
RED, BLUE = Material((0.9, 0.2, 0.1), opacity=0.3), Material((0.1, 0.3, 0.9), opacity=0.5)
VIEW = Camera((9, -16, 11), (-0.5, -0.5, 1), size=(160, 120))
SUN, LAMP = directional_light((0.4, -0.7, 1.2), (0.9, 0.9, 0.8)), point_light((3.1, -9.2, 7.3))


def pane(low, high, material, name="pane"):
    """Make a box of glass."""
    return Part(name, "", Mesh(*box(low, high)), material=material)


def garden():
    """Leaves that are holed, or faded to nothing, two panes behind one another, a house."""
    holed = Material((1, 1, 1), leaf_image(), alpha_mode="mask")
    faded = Material((1, 1, 1), leaf_image(levels=(0, 220)), alpha_mode="blend")
    tints = np.random.default_rng(2).uniform(0.2, 1, (4, 3))
    return make_scene([
        FLOOR, HOUSE, pane((1, -4, 0.1), (4, -3.9, 3), RED), pane((0, -6, 0.2), (5, -5.9, 4), BLUE),
        Part("hedge", "", card([(-5, -4, 1), (-2, -4, 1), (-2, -3, 4), (-5, -3, 4)],
                               uv=((-0.5, 0), (2.5, 0), (2.5, 2), (-0.5, 2))), material=holed),
        Part("leaf", "", card([(1, 3, 2), (5, 3, 2.5), (5, 6, 3), (1, 6, 3)]), material=holed),
        Part("faded", "", level_card(-8, -8, 3, 4, colors=tints), material=faded),
    ])  # fmt: skip


def textures():
    """Cards of one texel, without coordinates, and with coordinates beyond the texture."""
    grey = np.array([[(120, 200, 90, 140)]], np.uint8)
    steep = np.random.default_rng(3).integers(0, 256, (3, 5, 4), dtype=np.uint8)
    far = ((-1.3, -2.2), (3.4, -1.9), (3.1, 2.7), (-1.8, 2.4))
    kinds = [
        (Material(image=make_image(grey), alpha_mode="mask", alpha_cutoff=140 / 255), far),
        (Material(image=make_image(grey), alpha_mode="mask", alpha_cutoff=0.56), far),
        (Material(image=make_image(grey), alpha_mode="blend"), None),
        (Material((1, 1, 1), leaf_image(), alpha_mode="mask"), None),
        (Material((1, 1, 1), leaf_image(("clamp", "mirror")), alpha_mode="mask"), far),
        (Material((1, 1, 1), leaf_image(("mirror", "repeat")), alpha_mode="mask"), far),
        (Material((1, 1, 1), make_image(steep), alpha_mode="mask", alpha_cutoff=0.37), far),
        (Material((1, 1, 1), make_image(steep, wrap=("mirror", "clamp")), alpha_mode="blend",
                  opacity=0.8), far),
        (Material((1, 1, 1), make_image(steep), alpha_mode="blend"),
         tuple((u + 4096, v - 2048) for u, v in far)),
    ]  # fmt: skip
    kinds += [
        (Material((0.9, 0.8, 0.2), alpha_mode="blend", opacity=0.9), None),
        (Material((0.9, 0.8, 0.2), alpha_mode="mask", alpha_cutoff=0.41), None),
        (Material((1, 1, 1), make_image(steep), alpha_mode="mask", alpha_cutoff=0.2), far),
    ]
    alphas = np.random.default_rng(4).uniform(0, 1, (3, 4, 1))
    cards = [
        Part(f"card {k}", "", level_card(-7 + 4 * (k % 3), -7 + 4 * (k // 3), 2 + 0.1 * k, 3.2,
                                         uv=uv, alpha=alphas[k - 9] if k > 8 else None),
             material=material)
        for k, (material, uv) in enumerate(kinds)
    ]  # fmt: skip
    return make_scene([FLOOR, *cards])


def hedges():
    """Stand cards upright along x, on edge to a light from there, and one across."""
    holed = Material((1, 1, 1), leaf_image(), alpha_mode="mask")
    along = [card([(-5, y, 1), (4, y, 1), (4, y, 3), (-5, y, 3)], ((0, 1), (4, 1), (4, 0), (0, 0)))
             for y in (-5.0, -1.0, 3.0)]  # fmt: skip
    across = card([(-4, -6, 0.5), (-4, 4, 0.5), (-4, 4, 4), (-4, -6, 4)])
    materials = [holed, RED, holed, holed]
    return make_scene([FLOOR] + [
        Part(f"card {k}", "", mesh, material=material)
        for k, (mesh, material) in enumerate(zip([*along, across], materials, strict=True))
    ])  # fmt: skip


def one_mesh():
    """Give a closed box, a leaf on its top edge and a pane on its side, of one name and mesh."""
    vertices, faces = box((-2, -2, 0.5), (2, 2, 4))
    more = np.array([(-2, -2, 7), (2, -2, 7), (5, 2, 4), (5, -2, 4)], float)
    vertices = np.concatenate([vertices, more])
    uv = np.zeros((len(vertices), 2), np.float32)
    uv[[4, 5, 9, 8]] = [(0, 1), (2, 1), (2, 0), (0, 0)]
    holed = Material((1, 1, 1), leaf_image(), alpha_mode="mask")
    parts = [(faces, Material()), ([(4, 5, 9), (4, 9, 8)], holed), ([(6, 5, 11), (6, 11, 10)], RED)]
    return make_scene([FLOOR] + [
        Part("one", "", Mesh(vertices, np.array(some), uv=uv), material=material)
        for some, material in parts
    ])  # fmt: skip


def room():
    """Put panes and a leaf in a closed room."""
    holed = Material((1, 1, 1), leaf_image(), alpha_mode="mask")
    return make_scene([
        Part("room", "", Mesh(*box((-5, -5, -1), (5, 5, 4)))),
        pane((-1, -3, 0.3), (2, -2.9, 2.5), BLUE), pane((-3, 1, 0.2), (3, 1.5, 3), RED),
        Part("leaf", "", level_card(-3, -2.5, 1.2, 2), material=holed),
    ])  # fmt: skip


SCENES = {
    "garden": (garden, VIEW, [SUN, LAMP]),
    "garden from afar, parallel": (
        garden, Camera((7, -9, 14), (0, 0, 1), size=(160, 120), height=14.0), [SUN],
    ),
    "textures": (textures, Camera((-3, -13, 12), (-1, 0, 1), size=(160, 120)), [SUN, LAMP]),
    "two-sided": (textures, Camera((-3, -7, 0.8), (-1, 0, 3), size=(160, 120)), [SUN, LAMP]),
    "one mesh": (one_mesh, Camera((11, -11, 9), (0, 0, 2.5), size=(160, 120)), [SUN, LAMP]),
    "edge-on": (hedges, VIEW, [directional_light((0.6, 0.0, 0.8)),
                               directional_light((0.6, 1e-7, 0.8))]),
    "in a room": (room, Camera((4, -4.5, 3), (0, 0, 1), size=(160, 120), fov=80.0),
                  [point_light((4.2, 4.1, 3.3)), SUN]),
    "in the glass": (room, Camera((1, 1.25, 1.6), (0.2, -3, 1.4), size=(160, 120), fov=70.0,
                                  near=0.01), [point_light((0.1, -1.7, 3.1))]),
    "a lamp on and between panes": (
        room, Camera((4, -4.5, 3), (0, 0, 1), size=(160, 120), fov=80.0),
        [point_light((0.5, -2.9, 1.5)), point_light((0.4, 1.2, 1.5))],
    ),
}  # fmt: skip
"""Scenes, how they are seen, and their lights, by what is hostile about them."""


@dataclass(frozen=True, eq=False)
class Seen:
    """
    What rays see.

    Places (n, 3), triangles (n,) or -1; for each light whether it does not reach the place (m, n),
    and what transmitting triangles leave of it (m, n, 3).
    """

    place: np.ndarray
    triangle: np.ndarray
    hidden: np.ndarray
    left: np.ndarray

    def differs(self, other):
        """Tell where two differ, (n,)."""
        is_seen = (self.triangle >= 0) & (other.triangle >= 0)
        apart = np.abs(np.where(is_seen[:, None], self.place - other.place, 0)).max(1) > 0.3
        return (
            ((self.triangle >= 0) != (other.triangle >= 0))
            | apart
            | (self.hidden != other.hidden).any(0)
            | (np.abs(self.left - other.left).max((0, 2)) > 2e-3)
        )


class GlassOracle:
    """Every triangle of a scene, with its material."""

    def __init__(self, scene):
        self.origin = scene.origin
        soup = scene.triangles()
        self.corners = soup.vertices[soup.faces] + scene.origin
        self.materials = [scene.parts[k].material for k in soup.part]
        self.transmits = np.array([scene.parts[k].transmits for k in soup.part])
        count = len(soup.faces)
        self.uv, self.tints = np.zeros((count, 3, 2)), np.ones((count, 3, 4))
        first = 0
        for part in scene.parts:
            rows = slice(first, first + part.triangles)
            first += part.triangles
            if part.mesh.uv is not None:
                self.uv[rows] = part.mesh.uv[part.mesh.faces]
            if part.mesh.colors is not None:
                self.tints[rows, :, :3] = part.mesh.colors[part.mesh.faces]
            if part.mesh.alpha is not None:
                self.tints[rows, :, 3:] = part.mesh.alpha[part.mesh.faces]

    def look(self, camera, pixels):
        """Find the nearest triangle that is there on the rays of pixels (n, 2), and its lights."""
        right, up, forward = camera.axes()
        cols, rows = camera.size
        x, y = pixels[:, 0] - (cols - 1) / 2, (rows - 1) / 2 - pixels[:, 1]
        across = x[:, None] * right + y[:, None] * up
        if camera.height is None:
            size = 2 * np.tan(np.radians(camera.fov) / 2) / rows
            start, way = np.broadcast_to(camera.eye, across.shape), forward + size * across
        else:
            start = camera.eye + camera.height / rows * across
            way = np.broadcast_to(forward, across.shape)
        along, weights, inside = self._meet(start, way)
        inside &= along > camera.near
        for k in np.flatnonzero(self.transmits):
            some = np.flatnonzero(inside[:, k])
            inside[some, k] = self._cover(k, weights[some, k])[0] > 0
        along = np.where(inside, along, np.inf)
        triangle = along.argmin(1)
        near = along.min(1)
        is_seen = np.isfinite(near)
        place = np.where(
            is_seen[:, None], start + np.where(is_seen, near, 0)[:, None] * way, np.nan
        )
        return place, np.where(is_seen, triangle, -1)

    def see(self, camera, pixels, lights):
        """Find what pixels see, and what is left of the lights there."""
        place, triangle = self.look(camera, pixels)
        place_or_0 = np.nan_to_num(place)
        found = [self.follow(place_or_0, light) for light in lights]
        is_seen = triangle >= 0
        a, b, c = self.corners[triangle].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        back = camera.axes()[2] if camera.height else place_or_0 - camera.eye
        normal *= -np.sign((normal * back).sum(1, keepdims=True))
        ways = (light.position[:3] - light.position[3] * place_or_0 for light in lights)
        is_turned = np.stack([(normal * way).sum(1) <= TOUCH for way in ways])
        hidden = (np.stack([h for h, _ in found]) | is_turned) & is_seen
        left = np.where(is_seen[:, None], np.stack([one for _, one in found]), 1.0)
        return Seen(place, triangle, hidden, left)

    def follow(self, place, light):
        """Tell from which places a light is hidden, (n,), and what glass leaves of it, (n, 3)."""
        way = light.position[:3] - light.position[3] * place
        along, weights, inside = self._meet(place, way)
        normal = np.cross(self.corners[:, 1] - self.corners[:, 0],
                          self.corners[:, 2] - self.corners[:, 0])  # fmt: skip
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        away = np.einsum("nki,ki->nk", place[:, None] - self.corners[None, :, 0], normal)
        inside &= (np.abs(away) > TOUCH) & (along > 0)
        if light.is_point:
            held = np.abs(((light.position[:3] - self.corners[:, 0]) * normal).sum(1)) <= 1e-12
            inside &= (along < 1) & ~held
        hidden = (inside & ~self.transmits).any(1)
        left = np.ones((len(place), 3))
        for k in np.flatnonzero(self.transmits):
            some = np.flatnonzero(inside[:, k])
            opacity, color = self._cover(k, weights[some, k])
            hidden[some] |= opacity >= 1
            left[some] *= (1 - opacity[:, None]) * (1 - opacity[:, None] * (1 - color))
        return hidden, left

    def _meet(self, start, way):
        """Meet rays with the planes of all triangles: how far, where, whether inside."""
        a, b, c = (self.corners[None, :, k] for k in range(3))
        across = np.cross(way[:, None], c - a)
        volume = (across * (b - a)).sum(-1)
        volume = np.where(np.abs(volume) < 1e-12, np.inf, volume)
        apart = start[:, None] - a
        turned = np.cross(apart, b - a)
        u, v = (apart * across).sum(-1) / volume, (way[:, None] * turned).sum(-1) / volume
        along = ((c - a) * turned).sum(-1) / volume
        inside = np.isfinite(volume) & (u >= 0) & (v >= 0) & (u + v <= 1)
        return along, np.stack([1 - u - v, u, v], -1), inside

    def _cover(self, k, weights):
        """Find how opaque a triangle is at weights (n, 3), and its colour there."""
        material = self.materials[k]
        tint = weights @ self.tints[k]
        color, alpha = tint[:, :3] * np.array(material.color), tint[:, 3]
        if material.image is not None:
            texel = sample(material.image, weights @ self.uv[k])
            color, alpha = color * texel[:, :3], alpha * texel[:, 3]
        if material.alpha_mode == "mask":
            is_there = alpha * material.opacity >= material.alpha_cutoff - 1e-9
            return np.where(is_there, material.opacity, 0.0), color
        if material.alpha_mode == "blend":
            return alpha * material.opacity, color
        return np.full(len(weights), material.opacity), color


def judge(scene, camera, lights, picture):
    """
    Compare a picture's arrays with the oracle.

    Returns how many pixels differ, and how many of these are not within ``NEAR_EDGE`` of a
    place where the oracle's own answer changes.
    """
    oracle = GlassOracle(scene)
    cols, rows = camera.size
    y, x = np.mgrid[0:rows, 0:cols]
    pixels = np.stack([x.ravel(), y.ravel()], 1).astype(float)
    true = oracle.see(camera, pixels, lights)
    place = picture.position.reshape(-1, 3)
    triangle = np.where(np.isnan(place[:, 0]), -1, 0)
    none = np.isnan(place[:, 0])
    hidden = ~picture.lit.reshape(len(lights), -1)
    left = picture.transmission.reshape(len(lights), -1, 3)
    ours = Seen(place, triangle, hidden & ~none, left)
    wrong = np.flatnonzero(ours.differs(true))
    far = np.abs(np.nan_to_num(place - true.place)).max(1) > 1e-3
    wrong = np.union1d(wrong, np.flatnonzero(far & ~none & (true.triangle >= 0)))
    near = np.zeros(len(wrong), bool)
    base = Seen(true.place[wrong], true.triangle[wrong], true.hidden[:, wrong], true.left[:, wrong])
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)):
        aside = oracle.see(camera, pixels[wrong] + NEAR_EDGE * np.array([dx, dy]), lights)
        near |= aside.differs(base) | (aside.triangle != base.triangle)
    return len(wrong), int((~near).sum())
