"""
Masks of fewer pixels: the error of shadows at a quarter of the resolution, by two filters.

    python examples/shadow_masks.py pictures/

A knot and some blocks under a lamp. Their shadows are counted by doubling and halving alpha,
without a stencil (Roettger et al. 2002). `masks.png` shows a part of the picture with the mask
at full size, with a quarter mask enlarged bilinearly, and with a quarter mask enlarged between
pixels of the same surface only. Errors are against the full mask, over the whole picture.
Needs `pip install 'umbra-shadows[gl]'`; a software driver is enough.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from umbra.gl.context import open_device
from umbra.gl.masks.mask_frames import MaskPicture
from umbra.scene import Camera, Material, Mesh, Part, make_scene, point_light

CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (-1, 1) for x in (-1, 1)], float)
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
FACES = [face for a, b, c, d in SIDES for face in ((a, b, c), (a, c, d))]
CROP = (slice(150, 390), slice(90, 410))
HALF = 0.5  # a pixel whose mask is off by more is wrong


def make_block(x, y, half, height):
    """Return a block that stands on the floor."""
    return Mesh(CORNERS * (half, half, height) + (x, y, 0), FACES)


def make_knot(n=240, m=12):
    """Return a tube along a trefoil that floats over the floor."""
    t = np.arange(n) * 2 * np.pi / n

    def path(t):
        r = np.cos(3 * t) + 2
        return 3 * np.stack([r * np.cos(2 * t), r * np.sin(2 * t), -np.sin(3 * t)], -1)

    middle, along = path(t), path(t + 1e-4) - path(t)
    side = np.cross(along, middle)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    up = np.cross(along, side)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    s = np.arange(m)[None, :, None] * 2 * np.pi / m
    ring = np.cos(s) * side[:, None] + np.sin(s) * up[:, None]
    i, j = np.indices((n, m))
    a, b = i * m + j, i * m + (j + 1) % m
    c, d = (i + 1) % n * m + (j + 1) % m, (i + 1) % n * m + j
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([a, d, c], -1)]).reshape(-1, 3)
    return Mesh((middle[:, None] + 0.9 * ring).reshape(-1, 3) + (0, 0, 7), faces)


def make_model():
    """Return knot and blocks, and the floor, which casts nothing."""
    casters = [make_knot()]
    casters += [
        make_block(13 * np.cos(a), 13 * np.sin(a), 0.8, 3 + a) for a in np.arange(0, 6, 0.9)
    ]
    floor = Mesh([(-60, -60, 0), (60, -60, 0), (60, 60, 0), (-60, 60, 0)], [(0, 1, 2), (0, 2, 3)])
    red, grey = Material((0.8, 0.45, 0.35)), Material((0.6, 0.62, 0.66))
    parts = [Part(f"caster {k}", "", mesh, material=red) for k, mesh in enumerate(casters)]
    return make_scene([*parts, Part("floor", "", floor, material=grey)]), range(len(casters))


def main(folder):
    """Draw the three pictures side by side, and print errors."""
    folder.mkdir(parents=True, exist_ok=True)
    scene, casters = make_model()
    camera, lamp = Camera((20, -25, 24), (0, 0, 2), size=(512, 512)), point_light((8, -3.3, 30))
    device, pictures, masks = open_device(), [], {}
    for scale, kind in ((1, "nearest"), *((s, k) for s in (2, 4) for k in ("bilinear", "joint"))):
        drawn = MaskPicture(
            scene, "alpha", casters=casters, scale=scale, filter=kind, device=device
        )
        drawn.draw(camera, lamp, "ambient")
        if scale != 2:
            pictures.append(drawn.read()[CROP])
        drawn.draw(camera, lamp, "black", white=True)
        white = drawn.read()[..., 0].astype(float)
        masks[scale, kind] = white / white.max()  # halving leaves 254 of 255
        drawn.release()
    device.release()
    full = masks.pop((1, "nearest"))
    for (scale, kind), mask in masks.items():
        apart = np.abs(mask - full)
        print(f"1/{scale} {kind}: mean error {100 * apart.mean():.2f} %, "
              f"wrong by more than half {100 * (apart > HALF).mean():.2f} %")  # fmt: skip
    linear = np.concatenate(pictures, axis=1) / 255
    Image.fromarray((255 * linear**0.45).astype(np.uint8)).save(folder / "masks.png")
    print(folder / "masks.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "pictures"))
