"""
Draw the diagrams of docs/how_it_works.md as SVG.

    python examples/draw_diagrams.py docs/pictures
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from umbra.volume.adjacency import make_caster
from umbra.volume.silhouette import find_silhouettes

INK, QUIET, SHADE, SUN = "#1c1c22", "#5a5a64", "#46528c", "#d98e04"
MINUS = "\u2212"


def make_figure(width, height):
    """Make an empty figure with one frameless axes, in equal units."""
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_aspect("equal")
    axes.axis("off")
    return figure, axes


def draw_shadow_count(path):
    """Draw a section through two casters: the count along three rays from the eye."""
    figure, axes = make_figure(8.0, 3.7)
    fall = 0.75  # along x for each metre down
    block = np.array([(3, 0), (5, 0), (5, 4.6), (3, 4.6)])
    slab = np.array([(3.2, 5.2), (6.2, 5.2), (6.2, 5.6), (3.2, 5.6)])
    block_side, slab_left, slab_right = (5, 4.6), (3.2, 5.2), (6.2, 5.6)

    def land(point):
        return point[0] + fall * point[1]

    for volume in (
        [block_side, (land(block_side), 0), (5, 0)],
        [slab_left, (land(slab_left), 0), (land(slab_right), 0), slab_right, (6.2, 5.2)],
    ):
        axes.fill(*zip(*volume), color=SHADE, alpha=0.22, lw=0)
    for point in (block_side, slab_left, slab_right):
        axes.plot([point[0], land(point)], [point[1], 0], color=SHADE, lw=1.2)
    axes.fill(*block.T, facecolor="#e2e2e4", edgecolor=INK, lw=1, zorder=3)
    axes.fill(*slab.T, facecolor="#e2e2e4", edgecolor=INK, lw=1, zorder=3)
    axes.plot([0.2, 16], [0, 0], color=INK, lw=1.2)
    for x in (0.6, 1.4, 2.2):
        start = (x, 6.9 - 0.35 * x)
        axes.annotate(
            "", (start[0] + 0.72, start[1] - 0.96), start,
            arrowprops={"arrowstyle": "->", "color": SUN, "lw": 1.4},
        )  # fmt: skip
    axes.text(0.4, 7.0, "light", color=SUN, fontsize=10)

    eye = np.array([15.2, 5.1])
    axes.plot(*eye, marker="o", color=INK, ms=6)
    axes.text(eye[0] + 0.1, eye[1] + 0.3, "eye, count 0", fontsize=10, color=INK, ha="center")
    sides = {"block": block_side, "left": slab_left, "right": slab_right}
    # (the point, its words, the sides that the ray meets and what each adds)
    rays = (
        ((9.7, 0), "1", (("right", "+1"),)),
        ((7.7, 0), "2", (("right", "+1"), ("block", "+1"))),
        ((3.3, 4.6), "0", (("right", "+1"), ("left", MINUS + "1"))),
    )
    for point, count, crossings in rays:
        axes.plot(*zip(eye, point), color=QUIET, lw=0.9, ls=(0, (5, 3)), zorder=2)
        axes.plot(*point, marker="o", color=INK, ms=4, zorder=5)
        low = point[1] == 0
        axes.text(
            point[0] - (0 if low else 0.25), point[1] - (0.2 if low else -0.28), count,
            fontsize=11, weight="bold", ha="center", va="top" if low else "center", zorder=6,
        )  # fmt: skip
        for name, sign in crossings:
            x0 = land(sides[name])
            along = np.subtract(eye, point)
            slope = along[0] / along[1]  # of the ray: x for each metre up
            z = (x0 - point[0] + slope * point[1]) / (slope + fall)
            at = np.array([x0 - fall * z, z])
            axes.plot(*at, marker="s", color=SHADE, ms=3.5, zorder=5)
            axes.text(
                at[0] + 0.12, at[1] + 0.2, sign, fontsize=9, color=SHADE, zorder=6,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
            )  # fmt: skip
    axes.set_xlim(0, 16.6)
    axes.set_ylim(-0.9, 7.5)
    save(figure, path)


def draw_multiplicity(path):
    """Draw three meshes and the multiplicities that umbra finds on their edges."""
    figure, axes = make_figure(8.0, 2.9)
    x, y, z = np.meshgrid([0, 1.5], [0, 1.5], [0, 1.5], indexing="ij")
    box = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    fold = np.array([(0, 0), (2.0, 0.1), (1.3, 1.6)])
    star = np.array([(0, 0.25), (1.8, 0), (1.2, 1.7), (-1.6, 0)])
    draw_mesh(axes, 1.0, box, quads, "a closed box:\nits lit faces cast")
    draw_mesh(axes, 5.0, *make_fan(fold), "a fold: both wings\non one side of the edge")
    draw_mesh(axes, 10.0, *make_fan(star), "three walls on an edge:\n1 + 1 " + MINUS + " 1")
    axes.set_xlim(-0.4, 12.6)
    axes.set_ylim(-1.5, 3.4)
    save(figure, path)


def make_fan(ends):
    """Make walls 1.6 m long from one edge to others, all given in section (x, z)."""
    vertices = np.array([(x, y, z) for x, z in ends for y in (0.0, 1.6)])
    return vertices, [(0, 2 * k, 2 * k + 1, 1) for k in range(1, len(ends))]


def draw_mesh(axes, left, vertices, polygons, words):
    """Draw a mesh in a slanted view under a light from above, with its multiplicities."""
    light = np.array([-0.12, -0.35, 1.0, 0.0])
    faces = [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]
    caster = make_caster(vertices, np.array(faces, np.int32))
    ((_, found),) = find_silhouettes(caster, light[None])

    def flat(points):
        x, y, z = np.asarray(points, float).T
        return np.column_stack([left + x - 0.6 * y, 0.42 * y + z + 0.1 * x])

    for polygon in sorted(polygons, key=lambda p: -vertices[list(p), 1].mean()):
        corners = vertices[list(polygon)]
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        lit = normal @ light[:3] > 0
        if caster.is_closed.all() and normal @ (-0.6, -1.0, 0.5) <= 0:
            continue  # the back of a solid
        axes.fill(*flat(corners).T, facecolor="#fff3d6" if lit else "#d9dbe6", alpha=0.8,
                  edgecolor=QUIET, lw=0.6)  # fmt: skip
    # An edge of three walls has two entries: a pair of walls, and the wall left over.
    sums = {}
    for code in found.codes[: found.starts[1]]:
        low, high = sorted(caster.edges[code >> 2])
        size = int(caster.weight[code >> 2]) >> (code >> 1 & 1)
        along = 1 if (caster.edges[code >> 2, 0] == low) == bool(code & 1) else -1
        sums[low, high] = sums.get((low, high), 0) + along * size
    label = {"boxstyle": "circle,pad=0.15", "fc": "white", "ec": SHADE, "lw": 0.6}
    for ends, size in sums.items():
        a, b = flat(caster.vertices[list(ends)])
        thick = 1.2 + 1.1 * (abs(size) - 1)
        axes.plot(*zip(a, b), color=SHADE, lw=thick, solid_capstyle="round", zorder=4)
        axes.text(*(a + b) / 2, str(abs(size)), fontsize=9, weight="bold", color=INK, zorder=6,
                  ha="center", va="center", bbox=label)  # fmt: skip
    axes.text(left + 0.5, -0.5, words, fontsize=9.5, color=QUIET, ha="center", va="top")
    axes.annotate("", (left - 0.76, 2.55), (left - 0.85, 3.25),
                  arrowprops={"arrowstyle": "->", "color": SUN, "lw": 1.4})  # fmt: skip


def save(figure, path):
    """Write an SVG that is the same each time."""
    FigureCanvasSVG(figure)
    with rc_context({"svg.hashsalt": "umbra", "svg.fonttype": "path"}):
        figure.savefig(path, metadata={"Date": None})
    print(path)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    draw_shadow_count(folder / "shadow_count.svg")
    draw_multiplicity(folder / "multiplicity.svg")
