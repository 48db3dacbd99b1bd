"""Random meshes, open, closed and inside out, and cameras among them."""

import numpy as np

from support.shapes import box, city, jumble, merge, rewound, soup
from umbra.scene import Camera


def random_mesh(rng):
    kind = rng.integers(5)
    if kind == 0:
        return soup(rng, int(rng.integers(1, 12)), low=-6.0)
    if kind == 1:
        return jumble(rng, int(rng.integers(1, 20)), int(rng.integers(3, 9)), low=-4.0)
    if kind == 2:
        return city(3, seed=int(rng.integers(1000)))
    boxes = []
    for _ in range(rng.integers(1, 5)):
        low = rng.uniform(-8, 4, 3)
        boxes.append(box(low, low + rng.uniform(0.5, 9, 3)))
        if rng.random() < 0.3:
            boxes[-1] = rewound(boxes[-1])
    return merge(*boxes)


def random_camera(rng, size):
    height = None if rng.random() < 0.7 else rng.uniform(5, 40)
    return Camera(
        rng.uniform(-14, 14, 3) * [1, 1, 0.7] + [0, 0, 5],
        rng.uniform(-6, 6, 3),
        size=size,
        fov=rng.uniform(30, 110),
        height=height,
        near=rng.choice([0.05, 0.3, 1.0, 4.0]),
        far=rng.choice([np.inf, np.inf, 60.0]),
    )
