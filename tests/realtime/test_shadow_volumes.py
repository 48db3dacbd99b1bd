"""Counts in a caller's own framebuffer, against float64 rays through the caller's matrices."""

import numpy as np
import pytest
from support.own_engine import cast_sure, frustum, look_at, ortho, to_depth
from support.shapes import box, city, stack_of_triangles

from umbra.errors import InputError, UmbraError
from umbra.realtime import ShadowVolumes, VolumePlanner
from umbra.scene import Mesh, Part, directional_light, make_scene, point_light, spot_light
from umbra.soft import ball_light

SIZE = 40, 30
FLOOR = np.array([(-40, -40, 0), (40, -40, 0), (40, 40, 0), (-40, 40, 0)], float)[
    [[0, 1, 2], [0, 2, 3]]
]
SUN, LAMP = directional_light((4, -3, 8)), point_light((3, -5, 12))
VIEW = look_at((24, -30, 18), (0, 0, 3))
BEHIND = look_at((-6, 6, 2.0), (20, -12, 4))  # in the shadow of a house
VIEWS = {
    "symmetric": (VIEW, frustum(-0.4, 0.4, -0.3, 0.3, 0.5, 200.0)),
    "endless": (VIEW, frustum(-0.4, 0.4, -0.3, 0.3, 0.5, np.inf)),
    "off-axis": (VIEW, frustum(-0.1, 0.7, -0.5, 0.1, 0.5, 200.0)),
    "stretched": (VIEW, frustum(-0.2, 0.2, -0.4, 0.4, 0.5, 200.0)),
    "left-handed": (
        look_at((24, -30, 18), (0, 0, 3), hand=-1),
        frustum(-0.4, 0.4, -0.3, 0.3, 0.5, 200.0, -1.0),
    ),
    "flipped": (VIEW, np.diag([1, -1, 1, 1.0]) @ frustum(-0.1, 0.7, -0.5, 0.1, 0.5, 200.0)),
    "mirrored": (VIEW @ np.diag([-1, 1, 1, 1.0]), frustum(-0.4, 0.4, -0.3, 0.3, 0.5, 200.0)),
    "parallel": (VIEW, ortho(-18, 14, -10, 14, -20.0, 120.0)),
    "in shadow": (BEHIND, frustum(-0.5, 0.5, -0.4, 0.4, 0.3, 300.0)),
}  # fmt: skip
DEPTHS = "minus-one-to-one", "zero-to-one", "reversed"


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(3, seed=5))


def find_light(light):
    return np.array(light.position, float)


def check(engine, volumes, frame, view, projection, light, depth=DEPTHS[0], viewport=None):
    """Count in the stencil, and compare with rays; return the record."""
    box = viewport or (0, 0, *frame.size)
    matrix = projection @ view
    engine.draw(frame, matrix, depth, viewport)
    record = volumes.count(frame, view, projection, light, viewport, depth=depth)
    found = engine.read_stencil(frame, box)
    face, _, count, sure = cast_sure(engine.triangles, matrix, box[2:], find_light(light), depth)
    judged = sure & (face >= 0)
    assert judged.mean() > 0.3
    assert count[judged].any()
    wrong = np.argwhere(judged & (found != count))
    assert len(wrong) == 0, (len(wrong), wrong[:3], found[tuple(wrong[0])], count[tuple(wrong[0])])
    return record


@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "lamp"])
@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("name", VIEWS)
def test_the_stencil_holds_the_counts_of_rays(make_engine, context, town, name, depth, light):
    view, projection = VIEWS[name]
    engine = make_engine(town, FLOOR)
    with ShadowVolumes(town, context) as volumes:
        frame = engine.make_framebuffer(SIZE)
        check(engine, volumes, frame, view, to_depth(projection, depth), light, depth)


@pytest.mark.parametrize("depth", DEPTHS)
def test_volumes_are_clipped_at_the_near_plane(make_engine, context, town, depth):
    engine = make_engine(town, FLOOR)
    projection = to_depth(frustum(-1.2, 1.2, -0.9, 0.9, 1.5, 300.0), depth)
    with ShadowVolumes(town, context) as volumes:
        frame = engine.make_framebuffer(SIZE)
        for eye in ((4.7, 7.0, 2.0), (2.9, -15.2, 4.2)):
            check(engine, volumes, frame, look_at(eye, (6, -6, 0)), projection, SUN, depth)


@pytest.mark.parametrize("samples", [0, 4])
def test_only_the_viewport_is_counted(make_engine, context, town, samples):
    engine = make_engine(town, FLOOR)
    with ShadowVolumes(town, context, ground=0.0) as volumes:
        if samples:
            frame = engine.make_framebuffer(SIZE, samples=samples)
            view, projection = VIEWS["off-axis"]
            engine.draw(frame, projection @ view)
            whole = engine.make_framebuffer(SIZE)
            record = volumes.count(frame, view, projection, LAMP)
            assert record.deepest > 0
            engine.draw(whole, projection @ view)
            assert volumes.count(whole, view, projection, LAMP) == record
            return
        frame = engine.make_framebuffer((90, 70))
        record = check(engine, volumes, frame, *VIEWS["off-axis"], LAMP, viewport=(33, 21, 40, 30))
        outside = engine.read_stencil(frame)
        outside[70 - 21 - 30 : 70 - 21, 33 : 33 + 40] = 9
        assert (outside == 9).all()
        assert record.scissor == (33, 21, 40, 30)
        assert record.depth_bounds == (0.0, 1.0)


def test_without_a_stencil_counts_go_into_a_texture(make_engine, context, town):
    engine = make_engine(town, FLOOR)
    view, projection = VIEWS["symmetric"]
    with ShadowVolumes(town, context) as volumes:
        bare = engine.make_framebuffer(SIZE, stencil=False)
        engine.draw(bare, projection @ view)
        with pytest.raises(UmbraError, match="stencil"):
            volumes.count(bare, view, projection, LAMP)
        texture = volumes.count(bare, view, projection, LAMP, into="texture")
        found = np.frombuffer(texture.read(), np.float32).reshape(SIZE[::-1])[::-1]
        frame = engine.make_framebuffer(SIZE)
        check(engine, volumes, frame, view, projection, LAMP)
        np.testing.assert_array_equal(found, engine.read_stencil(frame))
        same = volumes.count(frame, view, projection, SUN, into=texture)
        assert same is texture
        check(engine, volumes, frame, view, projection, SUN)
        again = np.frombuffer(texture.read(), np.float32).reshape(SIZE[::-1])[::-1]
        np.testing.assert_array_equal(again, engine.read_stencil(frame))
        with pytest.raises(InputError) as found:
            volumes.count(frame, view, projection, SUN, into=context.texture((3, 3), 1, dtype="f4"))
        assert found.value.option == "into"


def test_counts_above_255_wrap_and_the_record_says_so(make_engine, context):
    stack = make_scene(*stack_of_triangles(600))
    low = float(stack.bounds()[0, 2]) - 2.0
    engine = make_engine(stack, FLOOR + (0, 0, low))
    view, projection = look_at((0, -30, 40), (0, 0, low)), VIEWS["endless"][1]
    up = directional_light((0, 0.01, 1))
    with ShadowVolumes(stack, context) as volumes:
        frame = engine.make_framebuffer(SIZE)
        engine.draw(frame, projection @ view)
        assert volumes.count(frame, view, projection, up).deepest >= 600
        counts = volumes.count(frame, view, projection, up, into="texture")
        deep = np.frombuffer(counts.read(), np.float32).reshape(SIZE[::-1])[::-1]
        assert deep.max() >= 600
        np.testing.assert_array_equal(engine.read_stencil(frame), deep.astype(int) % 256)


@pytest.mark.parametrize("name", ["symmetric", "off-axis", "mirrored"])
@pytest.mark.parametrize("depth", DEPTHS)
def test_what_a_light_reaches_is_within_its_scissor_and_depths(
    make_engine, context, town, name, depth
):
    lamp = spot_light((6, -9, 22), (3, -6, 0), 30.0, range=25.0)
    engine = make_engine(town, FLOOR)
    view, projection = VIEWS[name][0], to_depth(VIEWS[name][1], depth)
    with ShadowVolumes(town, context) as volumes:
        frame = engine.make_framebuffer(SIZE)
        record = check(engine, volumes, frame, view, projection, lamp, depth)
        face, place, _, _ = cast_sure(
            engine.triangles, projection @ view, SIZE, find_light(lamp), depth
        )
        is_lit = (face >= 0) & lamp.is_within(place.reshape(-1, 3)).reshape(face.shape)
        rows, cols = np.nonzero(is_lit)
        left, bottom, width, height = record.scissor
        assert len(rows) > 0
        assert width * height < SIZE[0] * SIZE[1]
        assert (cols >= left).all()
        assert (cols < left + width).all()
        assert (SIZE[1] - 1 - rows >= bottom).all()
        assert (SIZE[1] - 1 - rows < bottom + height).all()
        clip = np.append(place[is_lit], np.ones((len(rows), 1)), 1) @ (projection @ view).T
        window = clip[:, 2] / clip[:, 3]
        window = (window + 1) / 2 if depth == DEPTHS[0] else window
        low, high = record.depth_bounds
        assert low <= window.min() <= window.max() <= high
        assert (low, high) != (0.0, 1.0)
        given = (view, projection, lamp)
        assert volumes.find_reach(frame, *given, depth=depth) == (record.scissor, (low, high))
        plan = VolumePlanner(town).plan(view, projection, SIZE, lamp, depth=depth)
        assert (plan.scissor, plan.depth_bounds) == (record.scissor, (low, high))


def test_far_from_zero_counts_are_those_of_the_scene(make_engine, context):
    far = np.array([85_000.0, 447_000.0, 12.0])
    town = make_scene(city(3, seed=5)[0] + far, city(3, seed=5)[1])
    assert town.origin.any()
    view, projection = VIEWS["off-axis"]
    away = np.eye(4)
    away[:3, 3] = -far
    near = make_scene(*city(3, seed=5))
    engine = make_engine(near, FLOOR)  # float32 holds no large coordinates
    with ShadowVolumes(town, context) as volumes, ShadowVolumes(near, context) as others:
        frame = engine.make_framebuffer(SIZE)
        engine.draw(frame, projection @ view)
        others.count(frame, view, projection, LAMP)
        expected = engine.read_stencil(frame)
        lamp = point_light(np.array((3, -5, 12)) + far)
        volumes.count(frame, view @ away, projection, lamp)
        assert (engine.read_stencil(frame) != expected).mean() < 0.005


def make_yard():
    return make_scene(
        [
            Part("house", "", Mesh(*box((-5, -4, -1), (5, 4, 8)))),
            Part("crate", "", Mesh(*box((-1, -1, -1), (1, 1, 3))), np.eye(4)),
        ]
    )


def test_edits_by_name_count_as_a_fresh_scene_does(make_engine, context):
    scene = make_yard()
    turn = np.array([[0, -1, 0, 9], [1, 0, 0, -6], [0, 0, 1, 1], [0, 0, 0, 1]], float)
    volumes = ShadowVolumes(scene, context)
    view, projection = VIEWS["symmetric"]
    edits = [
        ("move", "crate", turn),
        ("move", "house", np.diag([1.0, 1.0, 1.7, 1.0])),
        ("move", "house", turn),
        ("add", Part("tower", "", Mesh(*box((8, 6, -1), (10, 9, 14))))),
        ("replace", "crate", Part("post", "", Mesh(*box((-9, -7, -1), (-8, -6, 9))))),
        ("move", "post", turn @ turn),
        ("remove", "house"),
    ]
    for edit, *given in edits:
        getattr(volumes, edit)(*given)
        engine = make_engine(volumes.scene, FLOOR)
        frame = engine.make_framebuffer(SIZE)
        check(engine, volumes, frame, view, projection, LAMP)
    assert [part.name for part in volumes.scene] == ["post", "tower"]
    volumes.release()


WRONG = {
    "framebuffer": {"framebuffer": 3},
    "viewport": {"viewport": (0, 0, 0, 5)},
    "view": {"view": np.eye(3)},
    "projection": {"projection": np.zeros((4, 4))},
    "depth": {"depth": "backwards"},
    "into": {"into": "file"},
    "light": {"light": ball_light(LAMP, 0.5)},
}


@pytest.mark.parametrize("option", WRONG)
def test_wrong_arguments_are_named(make_engine, context, option):
    scene = make_yard()
    engine = make_engine(scene, FLOOR)
    given = {
        "framebuffer": engine.make_framebuffer(SIZE), "view": VIEW,
        "projection": VIEWS["symmetric"][1], "light": LAMP,
    }  # fmt: skip
    with ShadowVolumes(scene, context) as volumes, pytest.raises(InputError) as found:
        volumes.count(**given | WRONG[option])
    assert found.value.option == option


def test_sheared_views_and_the_wrong_depth_are_refused(make_engine, context):
    scene = make_yard()
    frame = make_engine(scene, FLOOR).make_framebuffer(SIZE)
    projection = VIEWS["symmetric"][1]
    oblique = projection.copy()
    oblique[2] += (0.1, 0.2, 0.0, 0.0)
    with ShadowVolumes(scene, context) as volumes:
        for wrong, option in ((oblique, "projection"), (to_depth(projection, "reversed"), "depth")):
            with pytest.raises(InputError) as found:
                volumes.count(frame, VIEW, wrong, LAMP)
            assert found.value.option == option


def test_unknown_names_change_nothing(context):
    with ShadowVolumes(make_yard(), context) as volumes:
        before = volumes.scene
        part = before.parts[0]
        for edit, *given in (
            ("move", "hous", np.eye(4)), ("remove", "hous"), ("replace", "hous", part),
            ("move", "house", np.eye(3)), ("add", "house"),
        ):  # fmt: skip
            with pytest.raises(InputError):
                getattr(volumes, edit)(*given)
            assert volumes.scene is before
        volumes.remove("house")
        with pytest.raises(InputError):
            volumes.remove("crate")
