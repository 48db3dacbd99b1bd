"""
Draw a still life with hard shadows, and with soft ones by four methods, side by side.

    python examples/soft_shadows.py out/
    python examples/soft_shadows.py out/ --samples 1024 --size 480x360

Writes a picture for each method, all of them on one sheet, and the errors of the last three
against the samples: blue is too dark, red too bright.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import shade
from umbra.methods import SOFT
from umbra.scene import Camera, Material, Mesh, Part, Scene, make_scene, point_light
from umbra.soft import ball_light, find_method

BOX = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4)]
BOX += [(1, 2, 6), (1, 6, 5), (2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7)]
LIGHT = ball_light(point_light((5.0, -1.5, 7.0)), 0.7)
EYE, TARGET = (-4.6, -7.4, 5.6), (-0.5, -0.1, 0.6)


def make_box(low: tuple, high: tuple) -> tuple[list, list]:
    """Return the corners and triangles of a box."""
    (x, y, z), (u, v, w) = low, high
    corners = [(x, y), (u, y), (u, v), (x, v)]
    return [(*corner, z) for corner in corners] + [(*corner, w) for corner in corners], BOX


def make_ball(middle: tuple, radius: float, around: int = 36, bands: int = 18) -> Mesh:
    """Return a ball, closed: rings of quads between two fans."""
    tilt, turn = np.pi * np.arange(1, bands) / bands, 2 * np.pi * np.arange(around) / around
    across = np.sin(tilt)[:, None]
    rings = np.stack(
        [across * np.cos(turn), across * np.sin(turn), np.cos(tilt)[:, None] + 0 * turn], -1
    )
    points = np.concatenate([rings.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])
    top, bottom = len(points) - 2, len(points) - 1
    faces = []
    for i in range(around):
        j = (i + 1) % around
        faces += [(top, i, j), (bottom, bottom - 1 - around + j, bottom - 1 - around + i)]
        for k in range(0, (bands - 2) * around, around):
            faces += [(k + i, k + around + i, k + around + j), (k + i, k + around + j, k + j)]
    return Mesh(np.array(middle) + radius * points, np.array(faces, np.int32))


def make_still_life() -> Scene:
    """Set a table, a ball on it, another on the floor, and a slab."""
    table = [make_box((-1.5, -1, 1.5), (1.5, 1, 1.65))]
    table += [
        make_box((x - 0.07, y - 0.07, 0), (x + 0.07, y + 0.07, 1.5))
        for x in (-1.3, 1.3)
        for y in (-0.8, 0.8)
    ]
    parts = [
        Part(f"table {i}", "", Mesh(np.array(v, float), np.array(f, np.int32)), None,
             Material((0.55, 0.38, 0.24)))
        for i, (v, f) in enumerate(table)
    ]  # fmt: skip
    slab = make_box((-3.3, -0.5, 0), (-2.3, -0.3, 2.4))
    ball = Material((0.5, 0.12, 0.1))
    return make_scene(
        [
            *parts,
            Part("apple", "", make_ball((0.6, 0.1, 2.05), 0.4), None, ball),
            Part("ball", "", make_ball((2.3, -2.2, 0.6), 0.6), None, Material((0.2, 0.35, 0.5))),
            Part("slab", "", Mesh(np.array(slab[0], float), np.array(slab[1], np.int32))),
        ]
    )


def draw_error(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Colour a difference of visibilities, full at one half."""
    error = np.clip(2 * (found - truth), -1, 1)[..., None]
    white = np.full(3, 255.0)
    tint = np.where(error > 0, (178.0, 24.0, 43.0), (33.0, 102.0, 172.0))
    return np.round(white + np.abs(error) * (tint - white)).astype(np.uint8)


def lay_out(pictures: dict[str, np.ndarray], across: int = 3, line: int = 22) -> Image.Image:
    """Put named pictures on one sheet."""
    height, width = next(iter(pictures.values())).shape[:2]
    down = -(-len(pictures) // across)
    sheet = Image.new("RGB", (across * width, down * (height + line)), "white")
    pen = ImageDraw.Draw(sheet)
    for i, (name, picture) in enumerate(pictures.items()):
        x, y = i % across * width, i // across * (height + line)
        sheet.paste(Image.fromarray(picture), (x, y + line))
        pen.text((x + 6, y + 5), name, fill="black")
    return sheet


def main() -> None:
    """Draw them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--size", default="560x400", metavar="COLSxROWS")
    options = parser.parse_args()
    cols, rows = map(int, options.size.split("x"))
    options.folder.mkdir(parents=True, exist_ok=True)

    scene = make_still_life()
    counter = FrameCounter(scene, ground=0.0)
    camera = Camera(EYE, TARGET, size=(cols, rows), fov=40.0)
    view, frame = counter.see(camera)
    counts = counter.count(view, camera, LIGHT.light)
    faces_light = frame.lit(np.zeros_like(counts), LIGHT.light)

    visibility = {"hard": (counts == 0).astype(np.float32)}
    for name in SOFT:
        more = {"samples": options.samples} if name == "samples" else {}
        visibility[name] = find_method(name)(counter, view, frame, camera, LIGHT, **more)
    pictures = {
        name: shade(scene, frame, [LIGHT.light], [share * faces_light], view)
        for name, share in visibility.items()
    }
    truth = visibility["samples"] * faces_light
    errors = {
        f"{name}, less samples": draw_error(visibility[name] * faces_light, truth)
        for name in SOFT
        if name != "samples"
    }
    for name, picture in pictures.items():
        Image.fromarray(picture).save(options.folder / f"soft_{name}.png")
    lay_out(pictures).save(options.folder / "soft_shadows.png")
    lay_out(errors).save(options.folder / "soft_errors.png")
    partial = (truth > 0) & (truth < 1)
    for name in ("hard", *SOFT[1:]):
        error = np.abs(visibility[name] * faces_light - truth)[partial].mean()
        print(f"{name:10} off by {error:.3f} in the penumbra")
    print(options.folder / "soft_shadows.png", options.folder / "soft_errors.png", sep="\n")


if __name__ == "__main__":
    main()
