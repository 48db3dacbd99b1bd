"""Meshes for tests, each (vertices, faces): float64 and int32, wound outward where closed."""

import numpy as np

BOX_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
     [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]], np.int32
)  # fmt: skip
"""Bottom, top, south, east, north, west: two triangles each."""

TOP = [2, 3]


def box(low, high):
    """Make an axis-parallel box."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    vertices = [(x, y, z) for z in (z0, z1) for x, y in ring]
    return np.array(vertices, np.float64), BOX_FACES.copy()


def merge(*meshes):
    """Put meshes side by side in one."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in meshes[:-1]])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([faces + n for (_, faces), n in zip(meshes, offsets)]).astype(np.int32),
    )


def moved(mesh, by):
    """Move a mesh."""
    return mesh[0] + np.asarray(by, np.float64), mesh[1]


def turned(mesh, degrees):
    """Turn a mesh about the z axis."""
    angle = np.radians(degrees)
    c, s = np.cos(angle), np.sin(angle)
    return mesh[0] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), mesh[1]


def rewound(mesh, which=slice(None)):
    """Wind some faces the other way."""
    faces = mesh[1].copy()
    faces[which] = faces[which][:, ::-1]
    return mesh[0], faces


def duplicated(mesh, which):
    """Give some faces twice."""
    return mesh[0], np.concatenate([mesh[1], mesh[1][which]])


def sheet(corners):
    """Make a quad of two triangles from four corners in a plane."""
    return np.array(corners, np.float64), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def nested_boxes(n=4, gap=1.0):
    """Make boxes within boxes, all standing on z = 0 but the innermost."""
    return merge(
        *[
            box((-6 + k * gap, -5 + k * gap, 0.3 * k), (6 - k * gap, 5 - k * gap, 12 - k * gap))
            for k in range(n)
        ]
    )


def city(n=4, seed=0, cell=12.0, base=-1.0):
    """Make a town of n x n turned boxes."""
    rng = np.random.default_rng(seed)
    boxes = []
    for i in range(n):
        for j in range(n):
            w, d = rng.uniform(0.3, 0.6, 2) * cell
            house = turned(box((-w / 2, -d / 2, base), (w / 2, d / 2, rng.uniform(3, 18))),
                           rng.uniform(0, 90))  # fmt: skip
            boxes.append(moved(house, ((i - n / 2 + 0.5) * cell, (j - n / 2 + 0.5) * cell, 0)))
    return merge(*boxes)


def torus_knot(n=120, m=10, p=2, q=3, radius=6.0, tube=1.1):
    """Make a closed tube along a torus knot that floats over z = 0."""
    t = np.arange(n) * 2 * np.pi / n

    def path(t):
        r = np.cos(q * t) + 2
        return np.stack([r * np.cos(p * t), r * np.sin(p * t), -np.sin(q * t)], -1) * radius / 2

    centre = path(t)
    tangent = path(t + 1e-4) - path(t - 1e-4)
    side = np.cross(tangent, centre)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(side, tangent)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    s = np.arange(m) * 2 * np.pi / m
    ring = np.cos(s)[None, :, None] * side[:, None] + np.sin(s)[None, :, None] * up[:, None]
    vertices = (centre[:, None] + tube * ring).reshape(-1, 3) + [0, 0, 6.0]
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = i * m + j, i * m + (j + 1) % m
    c, d = (i + 1) % n * m + (j + 1) % m, (i + 1) % n * m + j
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return _outward(vertices, faces.astype(np.int32))


def staircase(steps=300, run=0.5, rise=0.25, width=2.0):
    """Make a solid flight of stairs that climbs toward +x from the origin."""
    profile = [(0.0, 0.0)]
    for k in range(steps):
        profile += [(k * run, (k + 1) * rise), ((k + 1) * run, (k + 1) * rise)]
    profile.append((steps * run, 0.0))
    outline = np.array(profile)
    n = len(outline)
    near = np.column_stack([outline[:, 0], np.zeros(n), outline[:, 1]])
    far = near + [0, width, 0]
    faces = []
    for k in range(n):  # a strip of two triangles for each side of the outline
        j = (k + 1) % n
        faces += [[k, n + k, n + j], [k, n + j, j]]
    for k in range(n - 2):  # the cheeks: from the foot of the back wall every corner is in view
        faces += [[n - 1, k, k + 1], [2 * n - 1, n + k + 1, n + k]]
    return _outward(np.concatenate([near, far]), np.array(faces, np.int32))


def soup(rng, n=40, spread=8.0, size=5.0, low=0.5):
    """Make random triangles that float above z = 0."""
    centre = rng.uniform(-spread, spread, (n, 1, 3)) * [1, 1, 0.5] + [0, 0, spread / 2 + size + low]
    vertices = (centre + rng.uniform(-size, size, (n, 3, 3))).reshape(-1, 3)
    return vertices, np.arange(3 * n, dtype=np.int32).reshape(-1, 3)


def jumble(rng, n=60, places=14, spread=6.0, low=0.5):
    """Make random triangles that share few vertices: edges of any degree and winding."""
    vertices = rng.uniform(-spread, spread, (places, 3)) + [0, 0, spread + low]
    faces = np.array([rng.choice(places, 3, replace=False) for _ in range(n)], np.int32)
    return vertices, faces


def three_walls():
    """Make three sheets that meet in one vertical edge."""
    faces, vertices = [], [(0, 0, 0), (0, 0, 5)]
    for k, angle in enumerate((10, 130, 250)):
        x, y = 4 * np.cos(np.radians(angle)), 4 * np.sin(np.radians(angle))
        n = len(vertices)
        vertices += [(x, y, 0), (x, y, 5)]
        faces += [[0, n, n + 1], [0, n + 1, 1]] if k != 1 else [[n, 0, n + 1], [0, 1, n + 1]]
    return np.array(vertices, np.float64), np.array(faces, np.int32)


def terrain(n=317, cell=1.0, seed=1, height=6.0):
    """Make an open height field of 2 (n - 1)^2 triangles, its lowest point above 0."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    z = np.zeros((n, n))
    for waves in (2, 5, 11, 23):
        for _ in range(4):
            u, v, phase = rng.normal(size=3)
            z += height / waves * np.sin(2 * np.pi * waves * (u * x + v * y) / n + phase)
    z += -z.min() + 0.5
    middle = (n - 1) / 2
    vertices = np.stack([(x - middle) * cell, (y - middle) * cell, z], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    a, b, c, d = i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    return vertices, faces.astype(np.int32)


def cavity():
    """Make a box with a hollow inside: an outer shell and an inner one wound inward."""
    return merge(box((-5, -4, -0.5), (5, 4, 9)), rewound(box((-3, -2.5, 1), (3, 2.5, 6))))


def plate(z=5.0):
    """Make a closed box without thickness: top and bottom in one plane."""
    vertices, faces = box((-3, -2, z), (3, 2.5, z))
    return vertices, faces


def stack_of_triangles(n=40_000):
    """Make one triangle n times in one place, ten up."""
    vertices = np.array([(-3, -2, 10), (4, -1, 10), (0, 4, 10)], np.float64)
    return vertices, np.tile(np.array([[0, 1, 2]], np.int32), (n, 1))


def _outward(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum()
    return (vertices, faces) if volume > 0 else (vertices, np.ascontiguousarray(faces[:, ::-1]))


def aligned_boxes():
    """Make boxes with corners on whole numbers, some touching, some stacked, some overlapping."""
    return merge(
        box((2, 2, 0), (6, 5, 4)),
        box((6, 2, 0), (9, 5, 7)),  # shares a wall with the first
        box((2, 5, 0), (6, 8, 2)),  # and a lower one behind
        box((12, 3, 0), (15, 6, 3)),
        box((13, 3, 3), (15, 5, 6)),  # stands on the one before
        box((4, 10, -1), (9, 12, 5)),
        box((7, 11, 0), (11, 14, 3)),  # overlaps it
    )


def _rng():
    return np.random.default_rng(7)


HOUSE = box((-2, -3, -0.5), (3, 2, 6))

SCENES = {
    "one box": lambda: HOUSE,
    "box touching the ground": lambda: box((-2, -3, 0), (3, 2, 6)),
    "nested boxes": nested_boxes,
    "touching and overlapping boxes": lambda: moved(aligned_boxes(), (-8, -8, 0)),
    "turned boxes": city,
    "torus knot": torus_knot,
    "soup": lambda: soup(_rng()),
    "jumble": lambda: jumble(_rng()),
    "three walls on one edge": three_walls,
    "flipped windings": lambda: rewound(city(2), _rng().random(48) < 0.3),
    "duplicated faces": lambda: duplicated(city(2), _rng().integers(0, 48, 20)),
    "top flipped": lambda: rewound(HOUSE, TOP),
    "wound inward": lambda: rewound(HOUSE),
    "cavity": cavity,
    "plate": plate,
    "sheets": lambda: merge(
        sheet([(-4, -2, 0), (2, 1, 0), (2, 1, 5), (-4, -2, 5)]),
        sheet([(3, -3, 4), (7, -3, 4), (7, 3, 5), (3, 3, 5)]),
        sheet([(3, 5, 2), (3, 9, 2), (7, 9, 2), (7, 5, 2)]),  # seen from above: its back
    ),
    "coplanar walls": lambda: merge(
        box((-6, -3, 0), (-1, 2, 5)), box((-1, -3, 0), (4, 3, 7)), box((1, -3, 0), (6, 1, 4))
    ),
    "far away": lambda: merge(box((400, -900, 0), (460, -840, 700)), box((-2, -2, 0), (2, 2, 3))),
    "house and fence": lambda: merge(
        HOUSE, sheet([(3, 2, -0.5), (9, 5, -0.5), (9, 5, 1.5), (3, 2, 6)])
    ),
}
"""Every kind of caster, each no larger than a few thousand triangles."""
