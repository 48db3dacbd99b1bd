"""Plans as arrays: laws that hold without any graphics API."""

import numpy as np
import pytest
from support.shapes import SCENES, city

from umbra.errors import InputError
from umbra.realtime import VolumePlanner
from umbra.scene import directional_light, make_scene, point_light
from umbra.soft import ball_light

VIEW = np.array([(1, 0, 0, -2), (0, 0, 1, -3), (0, -1, 0, -30), (0, 0, 0, 1.0)])
PROJECTION = np.array([(1.2, 0, 0, 0), (0, 1.6, 0, 0), (0, 0, -1, -0.5), (0, 0, -1, 0.0)])
SIZE = (64, 48)


@pytest.mark.parametrize("method", ["z-fail", "lengyel"])
def test_sides_begin_in_closed_loops(method):
    # Silhouettes are loops: as many sides leave a point as come to it.
    planner = VolumePlanner(make_scene(*SCENES["torus knot"]()))
    plan = planner.plan(VIEW, PROJECTION, SIZE, point_light((9, -4, 30)), method=method)
    first = next(each for each in plan.passes if each.kind != "light_cap")
    triangles = plan.indices[first.first : first.first + first.count].reshape(-1, 3)
    pairs = np.stack([triangles, np.roll(triangles, -1, 1)], -1).reshape(-1, 2)
    near = pairs[(pairs % 2 == 0).all(1)]
    assert len(near) > 50
    np.testing.assert_array_equal(np.bincount(near[:, 0]), np.bincount(near[:, 1]))


@pytest.mark.parametrize("depth", ["zero-to-one", "minus-one-to-one"])
def test_points_are_where_the_callers_matrices_have_them(depth):
    scene = make_scene(*city(2))
    plan = VolumePlanner(scene).plan(
        VIEW, PROJECTION, SIZE, directional_light((1, 2, 3)), depth=depth
    )
    near = np.unique(plan.indices[plan.indices % 2 == 0])
    points = np.append(
        scene.parts[0].mesh.vertices[near // 2] + scene.origin, np.ones((len(near), 1)), 1
    )
    theirs = points @ (PROJECTION @ VIEW).T
    ours = plan.vertices[near] @ plan.matrix.T
    np.testing.assert_allclose(ours, theirs, atol=2e-5)
    # The sun's far ends are one point, at infinity; all that is drawn lies before no near plane.
    far = plan.vertices[plan.indices[plan.indices % 2 == 1]]
    assert (far[:, 3] == 0).all()
    assert len(np.unique(far, axis=0)) == 1


def test_passes_say_how_to_count():
    plan = VolumePlanner(make_scene(*city(2)), ground=0.0).plan(
        VIEW, PROJECTION, SIZE, directional_light((1, 2, 3)), method="z-fail"
    )
    kinds = {each.kind: each for each in plan.passes}
    assert set(kinds) >= {"z_fail"}
    assert kinds["z_fail"].front == ("down", "keep")
    assert kinds["z_fail"].back == ("up", "keep")
    assert sum(each.count for each in plan.passes) == len(plan.indices)
    with pytest.raises(InputError) as caught:
        VolumePlanner(make_scene(*city(2))).plan(
            VIEW, PROJECTION, SIZE, ball_light(point_light((1, 2, 9)), 1.0)
        )
    assert caught.value.option == "light"
