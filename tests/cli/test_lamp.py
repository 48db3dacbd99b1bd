"""``umbra render --light`` with coordinates copied from the file: a lamp at a corner."""

import numpy as np
import pytest

# A block of 3 x 4 x 2 m, turned by the triangle of 5, 12 and 13.
CORNERS = [(x * 12 / 13 - y * 5 / 13, x * 5 / 13 + y * 12 / 13) for x, y in
           ((0, 0), (3, 0), (3, 4), (0, 4))]  # fmt: skip
FACES = ["4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"]


@pytest.mark.parametrize("method", ["auto", "z-fail"])
@pytest.mark.parametrize("corner", range(8))
def test_a_corner_of_the_file_as_the_lamp(umbra_here, tmp_path, method, corner):
    lines = [f"v {x:.6f} {y:.6f} {z}" for z in (1, 3) for x, y in CORNERS]
    block = tmp_path / "block.obj"
    block.write_text("\n".join([*lines, *(f"f {face}" for face in FACES)]) + "\n")
    place = lines[corner].split()[1:]
    said = umbra_here(
        "render", block, "--eye", "11,-14,9", "--target", "0,0,1", "--size", "60x45",
        "--ground", "0", "--method", method,
        f"--light={','.join(place)}", "--device", "cpu",
        "--out", tmp_path / "a.png", "--arrays", tmp_path / "a.npz",
    )  # fmt: skip
    assert said.status == 0, said
    with np.load(tmp_path / "a.npz") as arrays:
        position, normal = arrays["position"], arrays["normal"]
        count, lit = arrays["count"][0], arrays["lit"][0]
    on_ground = np.isfinite(position[..., 2]) & (normal[..., 2] == 1) & (position[..., 2] == 0)
    assert on_ground.sum() > 500
    lamp = np.array(place, float)
    # From a corner the block is the wedge between its two far walls.
    a, b = np.array(CORNERS)[[(corner + 1) % 4, (corner - 1) % 4]] - lamp[:2]
    way = position[on_ground][:, :2] - lamp[:2]
    within = (way @ a > 1e-3) & (way @ b > 1e-3)
    beside = (way @ a < -1e-3) | (way @ b < -1e-3)
    assert not count[on_ground][beside].any()
    assert lit[on_ground][beside].all()
    if corner >= 4:
        assert (count[on_ground][within] == 1).all()
        assert not lit[on_ground][within].any()
    assert count.min() >= 0
    walls = np.isfinite(position[..., 2]) & ~on_ground
    assert walls.any()
    assert not lit[walls].any()  # it lies in three faces, and the others turn from it
