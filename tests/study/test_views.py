"""Elevations and pictures: against float64 rays, against plans where they meet, by hand."""

import numpy as np
import pytest
from support.days import EQUINOX, around, parts
from support.raycaster import RayCaster
from support.shapes import box, city, merge, moved, sheet, turned

import umbra
from umbra.receivers.orthographic import Elevation
from umbra.scene import make_scene
from umbra.study import make_preview, run, run_study
from umbra.study.options import StudyOptions
from umbra.writers.folder.foot import describe_making

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-06-05", "start": "05:15", "end": "20:15", "every": "90min", "masks": True}
EDGE = 1e-6


def make_block():
    """Make boxes, a steep roof that floats, and a sheet that stands by itself."""
    roof = (
        np.array([(0, 0, 3), (6, 0, 3), (6, 9, 3), (0, 9, 3), (3, 0, 8), (3, 9, 7)], float),
        np.array([[0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4], [0, 1, 4], [2, 3, 5],
                  [0, 2, 1], [0, 3, 2]], np.int32),
    )  # fmt: skip
    return merge(
        city(3, seed=5, cell=13.0),
        moved(turned(roof, 20), (-4, -21, 0)),
        sheet([(-21, -21, 0), (-15, -24, 0), (-15, -24, 6), (-21, -21, 6)]),
    )


@pytest.fixture(scope="module")
def block():
    return make_block()


def find_wrong(block, result, dims, eye):
    """Compare every pixel of every instant with rays; count the attached ones."""
    rays = RayCaster(*block)
    open_rule = np.zeros(len(block[1]), bool)
    is_seen = ~np.isnan(result.shadow_hours.values)
    points = result.position.values[is_seen]
    normals = result.normal.values[is_seen]
    a = rays.vertices[rays.faces]
    flat = np.cross(a[:, 1] - a[:, 0], a[:, 2] - a[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    wrong, attached, dark = [], 0, 0
    assert ((eye[:3] - eye[3] * points) * normals).sum(1).min() > -1e-12
    for sun, picture in zip(result.sun_direction.values, result.in_shadow.values):
        assert not picture[~is_seen].any()
        mask = picture[is_seen] > 0
        turned_away = normals @ sun <= 0
        assert mask[turned_away].all()
        attached += turned_away.sum()
        facing = np.flatnonzero(~turned_away)
        light = np.append(sun, 0.0)
        # What touches the point (its own face) is between only if eye and sun are apart.
        pierced = rays.count(points[facing], np.full(len(facing), -1), eye, light, open_rule)
        differ = facing[pierced.any != mask[facing]]
        apart = rays.distance_to_shadow_edges(
            points[differ], normals[differ], np.full(len(differ), -1), light, open_rule
        )
        wrong += list(points[differ[apart > EDGE]])
        dark += mask[facing].sum()
    assert attached > 100
    assert dark > 25
    return wrong


@pytest.mark.parametrize("azimuth", ["south", "north", "east", "west", "217"])
def test_every_instant_of_an_elevation_agrees_with_rays(block, azimuth):
    result = umbra.shadow_study(
        make_scene(*block), VIENNA, **DAY, receivers=azimuth, cell=0.83, ground=0.0
    )
    assert result.shadow_hours.dims == ("z", "along")
    degrees = result.attrs["view_azimuth_deg"]
    turn = np.radians(degrees)
    eye = np.array([np.sin(turn), np.cos(turn), 0.0, 0.0])
    wrong = find_wrong(block, result, ("z", "along"), eye)
    assert not wrong, f"{len(wrong)} are wrong, such as {wrong[:5]}"
    # Heights are heights, and along runs to the viewer's right.
    seen = ~np.isnan(result.shadow_hours.values)
    z = np.broadcast_to(result.z.values[:, None], seen.shape)
    np.testing.assert_allclose(result.position.values[seen][:, 2], z[seen], atol=1e-9)
    right = np.array([-np.cos(turn), np.sin(turn), 0.0])
    along = np.broadcast_to(result.along.values, seen.shape)
    np.testing.assert_allclose(result.position.values[seen] @ right, along[seen], atol=1e-9)
    assert 0.1 < seen.mean() < 0.9
    assert (result.z > 0).all()


def test_every_instant_of_a_picture_agrees_with_rays(block):
    eye = (30.0, -42.0, 12.0)
    result = umbra.shadow_study(
        make_scene(*block), VIENNA, **DAY, receivers="camera", eye=eye, target=(0, 0, 3),
        size=(64, 48), ground=0.0,
    )  # fmt: skip
    assert result.shadow_hours.dims == ("row", "col")
    ground = merge(block, sheet([(-9e3, -9e3, 0), (9e3, -9e3, 0), (9e3, 9e3, 0), (-9e3, 9e3, 0)]))
    near = np.nan_to_num(np.linalg.norm(result.position.values, axis=-1)) < 200
    blanked = result.where(xarray_like(result, near))
    blanked["in_shadow"] = result.in_shadow.where(xarray_like(result, near), 0)
    blanked["sun_direction"] = result.sun_direction
    wrong = find_wrong(ground, blanked, ("row", "col"), np.append(eye, 1.0))
    assert not wrong, f"{len(wrong)} are wrong, such as {wrong[:5]}"


def xarray_like(result, values):
    return result.shadow_hours.copy(data=values)


def test_elevations_agree_with_the_plan_where_they_meet(block):
    # A place on a slope is seen from the side and from above.
    scene = make_scene(*block)
    options = {**DAY, "every": "20min"}
    side = umbra.shadow_study(scene, VIENNA, **options, receivers="south", cell=0.61, ground=0.0)
    slopes = np.argwhere((side.normal.values[..., 2] > 0.1) & (side.normal.values[..., 2] < 0.99))
    assert len(slopes) > 20
    different = 0
    for row, col in slopes[::3]:
        x, y, z = side.position.values[row, col]
        plan = umbra.shadow_study(
            scene, VIENNA, **options, receivers="top", size=(1, 1), ground=0.0,
            extent=(x - 0.01, y - 0.01, x + 0.01, y + 0.01),
        )  # fmt: skip
        assert float(plan.receiver_z[0, 0]) == pytest.approx(z, abs=1e-7)
        mine, theirs = side.in_shadow.values[:, row, col], plan.in_shadow.values[:, 0, 0]
        different += (mine != theirs).sum()
    assert different == 0


@pytest.mark.parametrize("receivers", ["south", "215/35"])
def test_a_model_far_from_its_axes_origin_is_seen_as_one_near_it(receivers):
    options = {**DAY, "receivers": receivers, "cell": 1.0}
    near = run_study(make_scene(*moved(box((0, 0, 0), (6, 4, 9)), (3, 5, 0))), VIENNA, **options)
    there = moved(box((0, 0, 0), (6, 4, 9)), (2703, 340105, 171))
    far = run_study(make_scene(*there), VIENNA, **options)
    hours = [np.nan_to_num(one.shadow_hours) for one in (near, far)]
    assert hours[0].shape == hours[1].shape
    assert abs(hours[0].mean() - hours[1].mean()) < 0.2
    with pytest.raises(umbra.InputError, match="km from the model"):
        run_study(make_scene(*there), VIENNA, **options, extent=(90_000, 171, 90_020, 180))


def test_the_foot_of_a_wall_is_dark_when_the_ground_before_it_is():
    # A wall of 6 m faces south; a block before it shades both the ground and the wall's foot.
    scene = make_scene(*merge(box((-8, 0, 0), (8, 1, 6)), box((-3, -9, 0), (2, -5, 5))))
    options = {"date": "2026-03-21", "start": "08:00", "end": "17:00", "every": "10min"}
    wall = umbra.shadow_study(
        scene, VIENNA, **options, receivers="south", extent=(-7.9, 0, 7.9, 0.001), cell=0.005,
        ground=0.0, masks=True,
    ).isel(z=0)  # fmt: skip
    ground = umbra.shadow_study(
        scene, VIENNA, **options, ground=0.0, extent=(-7.9, -0.002, 7.9, 0), size=(3160, 1),
        masks=True,
    ).isel(y=0)  # fmt: skip
    np.testing.assert_allclose(wall.along, ground.x, atol=1e-9)
    in_front = np.abs(wall.position.values[:, 1]) < 1e-9  # not behind the block
    before = np.isin(wall.part, 0) & in_front
    differ = (wall.in_shadow.values != ground.in_shadow.values)[:, before]
    assert differ.mean() < 0.002
    assert 0.01 < wall.in_shadow.values[:, before].mean() < 0.99


def test_a_slab_shades_the_wall_below_it(noon, at_45):
    # At 45 degrees a slab that stands out by 1.5 m shades 1.5 m of the wall, less its thickness.
    scene = parts(wall=box((-5, 0, 0), (5, 1, 8)), slab=box((-5, -1.5, 6), (5, 0, 6.2)))
    for turn in (0.0, 90.0, 37.0):
        site = umbra.Site(at_45.latitude, 0.0, "UTC", true_north=turn)
        vertices, faces = scene.triangles().vertices, scene.triangles().faces
        mesh = turned((vertices, faces), -turn)
        result = umbra.shadow_study(
            make_scene(*mesh), site, **around(noon), refraction="none", receivers="south",
            size=(200, 160), extent=(-5, 0, 5, 8),
        )  # fmt: skip
        shaded = (result.shadow_hours > 0).mean("along").values
        z = result.z.values
        np.testing.assert_allclose(shaded[(z > 4.6) & (z < 5.95)], 1.0)
        np.testing.assert_allclose(shaded[(z < 4.4) | (z > 6.0)], 0.0)


def test_a_north_wall_has_the_summer_morning():
    # On the equator at the June solstice the sun stands in the north all day.
    scene = make_scene(*box((-5, 0, 0), (5, 4, 8)))
    site = umbra.Site(0.0, 0.0, "UTC")
    hours = {"date": "2026-06-21", "start": "08:00", "end": "16:00", "every": "30min"}
    north, south = (
        umbra.shadow_study(scene, site, **hours, receivers=side, cell=0.5)
        for side in ("north", "south")
    )
    assert float(north.shadow_hours.max()) == 0
    assert float(south.shadow_hours.min()) == 8


def test_axes_of_the_compass_are_exact():
    up = (0.0, 0.0, 1.0)
    assert Elevation.of(180.0, 0.0) == Elevation((1.0, 0.0, 0.0), up, (0.0, 1.0, 0.0))
    assert Elevation.of(0.0, 0.0) == Elevation((-1.0, 0.0, 0.0), up, (0.0, -1.0, 0.0))
    assert Elevation.of(90.0, 0.0) == Elevation((0.0, 1.0, 0.0), up, (-1.0, 0.0, 0.0))
    assert Elevation.of(0.0, 270.0) == Elevation((0.0, -1.0, 0.0), up, (1.0, 0.0, 0.0))
    tilted = Elevation.of(30.0, 0.0)
    np.testing.assert_allclose(tilted.forward, (-0.5, -np.sqrt(0.75), 0))
    np.testing.assert_allclose(tilted.right, (-np.sqrt(0.75), 0.5, 0))
    for azimuth, tilt in ((0.0, 30.0), (215.0, 35.0)):
        frame = Elevation.of(azimuth, 10.0, tilt)
        axes = np.array([frame.right, frame.forward, frame.up])
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(axes) == pytest.approx(1)
        assert frame.forward[2] == pytest.approx(-np.sin(np.radians(tilt)))


def test_every_instant_of_a_view_from_above_agrees_with_rays(block):
    result = umbra.shadow_study(
        make_scene(*block), VIENNA, **DAY, receivers="215/35", cell=0.83, ground=0.0
    )
    assert result.shadow_hours.dims == ("up", "along")
    turn, down = np.radians(215), np.radians(35)
    eye = [np.sin(turn) * np.cos(down), np.cos(turn) * np.cos(down), np.sin(down), 0.0]
    wrong = find_wrong(block, result, ("up", "along"), np.array(eye))
    assert not wrong, f"{len(wrong)} are wrong, such as {wrong[:5]}"


def test_spells_exact_instants_and_casters_on_an_elevation(block):
    scene = make_scene(*block)
    options = {"date": "2026-03-05", "start": "08:00", "end": "16:30", "receivers": "217",
               "cell": 1.3, "ground": 0.0}  # fmt: skip
    exact = umbra.shadow_study(scene, VIENNA, every="5min", exact=True, spells=True, **options)
    steps = umbra.shadow_study(scene, VIENNA, every="10s", who=["*"], spells=True, **options)
    seen = ~np.isnan(exact.shadow_hours.values)
    assert np.isnat(exact.first_sun.values[~seen]).all()
    assert np.isnan(exact.longest_sun_hours.values[~seen]).all()
    same = seen & (exact.sun_spells.values == steps.sun_spells.values)
    assert same.sum() > 0.95 * seen.sum()
    off = np.abs(exact.sun_hours.values - steps.sun_hours.values)[same] * 3600
    assert (off <= 2 * exact.sun_spells.values[same] * 5.6 + 0.2).all()
    # Of the hours in shadow all are cast but those turned away.
    cast = steps.cast_hours[0].values
    assert (cast[seen] <= steps.shadow_hours.values[seen] + 1e-4).all()
    assert cast[seen].sum() > 0
    # Each sees a seventh of the sky at most: hours of sun and cast shadow are those facing it.
    facing = (steps.normal.values[seen] @ steps.sun_direction.values.T > 0).sum(1) / 360
    np.testing.assert_allclose(cast[seen] + steps.sun_hours.values[seen], facing, atol=0.02)


@pytest.mark.parametrize("view", [
    {"receivers": "south", "cell": 0.5},
    {"receivers": "camera", "eye": (-20, -30, 12), "target": (0, 0, 3), "size": (40, 30)},
])  # fmt: skip
def test_where_nothing_is_seen_no_hours_are_due_or_lost(view):
    scene = parts(tower=box((0, -9, 0), (4, -5, 15)), house=box((-4, 0, 0), (6, 5, 6)))
    result = umbra.shadow_study(
        scene, VIENNA, date="2026-03-05", every="2h", who=["tower"], proposed=["tower"], **view
    )
    sky = result.part.values == -1
    assert sky.any()
    for name in ("shadow_hours", "cast_hours", "sole_hours", "hours_lost"):
        assert np.isnan(result[name].values[..., sky]).all(), name
    assert np.isfinite(result.sole_hours.values[..., ~sky]).all()
    # Columns of tables stand in this order: where a pixel lies comes before what is due to whom.
    names = list(result.data_vars)
    assert names.index("part") < names.index("cast_hours") < names.index("hours_lost")


@pytest.mark.parametrize("last", [0, 1])
def test_one_part_alone_is_seen_on_the_ground(last):
    scene = parts(a=box((0, 0, 0), (4, 4, 6)), b=box((9, 0, 0), (12, 4, 3)))
    result = umbra.shadow_study(
        scene, VIENNA, date="2026-03-05", every="2h", receivers="camera", eye=(-20, -30, 12),
        target=(6, 0, 3), size=(40, 30), on=["ab"[last]],
    )  # fmt: skip
    assert set(np.unique(result.part.values)) == {-2, -1, last}


def test_chosen_parts_are_seen_through_the_others():
    # Three walls in a row: the middle one alone is seen, and shaded by the first.
    scene = parts(
        first=box((-5, -10, 0), (0, -9, 12)), middle=box((-4, 0, 0), (4, 1, 6)),
        last=box((-5, 9, 0), (5, 10, 9)),
    )  # fmt: skip
    options = {**DAY, "date": "2026-03-05", "every": "45min", "receivers": "south", "ground": 0.0}
    alone = umbra.shadow_study(scene, VIENNA, **options, on=["middle"], cell=0.3)
    seen = alone.part.values >= 0
    assert set(alone.part.values[seen]) == {1}
    np.testing.assert_allclose(alone.position.values[seen][:, 1], 0, atol=1e-9)
    other = umbra.shadow_study(
        scene, VIENNA, **{**DAY, "date": "2026-03-05", "every": "45min"}, receivers="points",
        points=np.concatenate([alone.position.values[seen], alone.normal.values[seen]], 1),
    )  # fmt: skip
    np.testing.assert_array_equal(alone.in_shadow.values[:, seen], other.in_shadow.values)
    without = umbra.shadow_study(scene, VIENNA, **options, on=["middle"], cell=0.3, cast=["middle"])
    assert float(without.shadow_hours.sum()) < float(alone.shadow_hours.sum())
    # Where nothing stands before it the whole elevation says the same.
    whole = umbra.shadow_study(scene, VIENNA, **options, cell=0.3,
                               extent=(-4.1, 0, 4.1, 9))  # fmt: skip
    same = umbra.shadow_study(scene, VIENNA, **options, on=["last"], cell=0.3,
                              extent=(-4.1, 0, 4.1, 9))  # fmt: skip
    back = whole.part.values == 2
    assert back.any()
    np.testing.assert_array_equal(whole.in_shadow.values[:, back], same.in_shadow.values[:, back])
    with pytest.raises(umbra.InputError, match="on= is not for receivers='top'"):
        umbra.shadow_study(scene, VIENNA, **{**options, "receivers": "top"}, on=["middle"])


def test_preview_of_an_elevation(block):
    study = run_study(
        make_scene(*block), VIENNA, date=EQUINOX, start="10:00", end="12:00", every="1h",
        receivers="south", cell=0.2,
    )  # fmt: skip
    preview = make_preview(study)
    assert preview.shadows.shape == (3, len(study.y), len(study.x))
    small = make_preview(study, longest=50)
    assert max(small.shadows.shape[1:]) == 50
    assert small.shadows.mean() == pytest.approx(preview.shadows.mean(), rel=0.1)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"receivers": "southwards"}, "unknown receivers"),
        ({"receivers": "nan"}, "unknown receivers"),
        ({"receivers": "215/90"}, "unknown receivers"),
        ({"receivers": "south/-5"}, "unknown receivers"),
        ({"receivers": "camera"}, r"needs eye=\(X, Y, Z\) and target=\(X, Y, Z\);"),
        ({"receivers": "camera", "eye": (0, 0, 9), "target": (0, 0, 9)}, "own eye"),
        ({"receivers": "north", "cell": 1.0, "size": (4, 4)}, "not both"),
    ],
)
def test_slips_are_told(block, options, says):
    with pytest.raises(umbra.InputError, match=says):
        umbra.shadow_study(make_scene(*block), VIENNA, **DAY, **options)


@pytest.mark.parametrize("receivers", ["south", "215/35"])
def test_an_assumed_ground_is_told_and_named(receivers):
    house = parts(house=box((0, 0, 5), (4, 4, 9)))
    options = StudyOptions(date="2026-06-05", receivers=receivers, size=(40, 30))
    study = run(house, VIENNA, options)
    assert "assumed level at z = 5 m" in study.facts["assumption"]
    assert study.facts["ground"] in describe_making(study, options)
    stated = run_study(house, VIENNA, date="2026-06-05", receivers=receivers, ground=5.0)
    assert "assumption" not in stated.facts
