"""Walls and roofs in their own planes, and points from a table."""

import pickle
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.days import around, parts
from support.judge import Seen
from support.model_files import DATA
from support.raycaster import RayCaster
from support.shapes import box, city, merge, moved, rewound, sheet, turned

import umbra
from umbra.cpu.patch_count import PatchCounter
from umbra.receivers import single as points_module
from umbra.receivers.points import read_points
from umbra.receivers.samples import sample_surfaces
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-06-05", "start": "06:15", "end": "19:15", "every": "70min", "masks": True}
EDGE = 1e-6
GABLE = (
    np.array([(0, 0, 0), (6, 0, 0), (6, 9, 0), (0, 9, 0), (3, 0, 6), (3, 9, 6)], float),
    np.array([[0, 4, 5], [0, 5, 3], [1, 2, 5], [1, 5, 4], [0, 1, 4], [2, 3, 5],
              [0, 2, 1], [0, 3, 2]], np.int32),
)  # fmt: skip


def make_block():
    return merge(city(3, seed=5, cell=13.0), moved(turned(GABLE, 20), (-4, -24, 0)))


@pytest.fixture(scope="module")
def block():
    return make_scene(*make_block())


def run(scene, **options):
    return umbra.shadow_study(scene, VIENNA, **{**DAY, "receivers": "surfaces", **options})


def test_a_box_is_laid_out_in_squares():
    # 6 x 4 x 3 m: four walls and a top, no bottom.
    samples = sample_surfaces(make_scene(*box((0, 0, 0), (6, 4, 3))), 0.5)
    assert len(samples.part) == 5
    assert len(samples.points) == (6 * 4 + 2 * 6 * 3 + 2 * 4 * 3) * 4
    np.testing.assert_allclose(samples.area, 0.25)
    np.testing.assert_allclose(np.sort(samples.surface_area), [12, 12, 18, 18, 24])
    for surface, normal in enumerate(samples.surface_normal):
        points = samples.points[samples.surface == surface]
        axis = np.argmax(np.abs(normal))
        side = [0, 0, 0, 6, 4, 3][axis + (3 if normal[axis] > 0 else 0)]
        np.testing.assert_allclose(points[:, axis], side, rtol=0, atol=1e-12)
        # Centres of squares: a quarter of a metre from every edge, and half a metre apart.
        for other in {0, 1, 2} - {axis}:
            steps = np.unique(points[:, other].round(9))
            np.testing.assert_allclose(np.diff(steps), 0.5)
            assert steps[0] == pytest.approx(0.25)


def test_samples_cover_slopes_and_odd_shapes_once():
    scene = make_scene(*turned(GABLE, 33))
    samples = sample_surfaces(scene, 0.07)
    assert len(samples.part) == 4  # two slopes, two gables
    length = np.sqrt(3**2 + 6**2)
    np.testing.assert_allclose(
        np.sort(samples.surface_area), [18, 18, 9 * length, 9 * length], rtol=1e-12
    )
    count = np.bincount(samples.surface)
    np.testing.assert_allclose(count * 0.07**2, samples.surface_area, rtol=0.01)
    assert len(np.unique(samples.points.round(6), axis=0)) == len(samples.points)
    normals = samples.surface_normal[samples.surface]
    np.testing.assert_allclose(np.einsum("ij,ij->i", normals, samples.normals), 1)


def test_pieces_hold_the_samples_of_the_whole(block):
    samples = sample_surfaces(block, 0.9)
    for begin, end in ((0, 1), (3, 50), (50, 51), (17, samples.count)):
        piece = samples.piece(slice(begin, end))
        assert piece.count == end - begin
        for name in ("points", "normals", "area"):
            np.testing.assert_array_equal(
                getattr(piece, name), getattr(samples, name)[begin:end], err_msg=name
            )
        np.testing.assert_array_equal(
            piece.surface + samples.surface[begin], samples.surface[begin:end]
        )
        np.testing.assert_array_equal(
            piece.corners[piece.triangle], samples.corners[samples.triangle[begin:end]]
        )


def test_a_few_suns_of_many_samples_are_counted_by_patches(block, monkeypatch):
    few = {"start": "08:15", "end": "16:15", "every": "2h"}  # four suns
    rays = run(block, **few).in_shadow
    monkeypatch.setattr(points_module, "_MANY_SAMPLES", 1000)
    counted = []
    count = PatchCounter.masks
    monkeypatch.setattr(
        PatchCounter, "masks", lambda self, suns: counted.append(len(suns)) or count(self, suns)
    )
    np.testing.assert_array_equal(run(block, **few).in_shadow, rays)
    assert sum(counted) == 4


def test_positions_take_no_memory_until_they_are_asked_for(monkeypatch):
    monkeypatch.setattr("umbra.study.result._SMALL", 0)
    monkeypatch.setattr(points_module, "_CHUNK_OF_SURFACES", 4096)
    block = make_scene(*make_block())
    study = run(block, every="30min", masks=False)  # by patches
    assert "points" not in vars(study.result.samples)
    positions = study.dataset.position
    assert "points" not in vars(study.result.samples)
    np.testing.assert_array_equal(positions[2:7], study.result.samples.points[2:7] + block.origin)
    assert pickle.loads(pickle.dumps(study.dataset)).identical(study.dataset)
    study.dataset.position.values[0] = 7.0
    assert (study.dataset.position[0] == 7.0).all()
    assert not (study.result.samples.points == 7.0).any()


def test_what_is_smaller_than_a_square_has_one_sample():
    scene = parts(stick=box((0, 0, 0), (0.1, 0.1, 9.0)), plate=box((3, 3, 0), (3.01, 3.01, 0.01)))
    samples = sample_surfaces(scene, 2.0)
    assert (np.bincount(samples.surface) >= 1).all()
    assert len(samples.part) == 10
    np.testing.assert_allclose(np.bincount(samples.surface, samples.area), samples.surface_area)


def test_no_sample_lies_on_the_border_of_its_surface():
    # The middle of a right triangle's box lies on its longest side.
    ramp = (
        np.array([(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 3), (4, 0, 3), (0, 4, 3)], float),
        np.array([[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4],
                  [2, 0, 3], [2, 3, 5]], np.int32),
    )  # fmt: skip
    for spacing in (1.0, 4.0):
        samples = sample_surfaces(make_scene(*ramp), spacing)
        assert len(samples.part) == 4
        top = samples.points[samples.normals[:, 2] > 0.5]
        assert (top[:, :2].sum(1) < 4 - 1e-6).all()
        np.testing.assert_allclose(np.bincount(samples.surface, samples.area),
                                   samples.surface_area)  # fmt: skip
    # Within a surface a sample may lie on the line between two of its triangles.
    square = sample_surfaces(make_scene(*sheet([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)])), 1.0)
    assert len(square.points) == 16


@pytest.mark.parametrize("thin", [1e-13, 1e-11, 1e-9, 1e-6])
def test_samples_lie_on_needles_that_hold_them(thin):
    # A wall of 4 m, cut along its diagonal, where centres of squares lie, by a needle.
    spots = [(-2, -2), (2, -2), (2, 2), (-2, 2), (0.7 + thin, 0.7 - thin)]
    faces = np.array([[0, 2, 3], [0, 4, 2], [0, 1, 4], [1, 2, 4]], np.int32)
    centres = np.arange(8) * 0.5 - 1.75
    for turn in 0, 90, 180, 270:
        wall = np.array([(x, 0, z) for x, z in spots])
        samples = sample_surfaces(make_scene(*turned((wall, faces), turn)), 0.5)
        points, _ = turned((samples.points, faces), -turn)
        at = points[np.lexsort((points[:, 0], points[:, 2].round(3)))].reshape(8, 8, 3)
        np.testing.assert_allclose(at[..., 0], np.tile(centres, (8, 1)), rtol=0, atol=1e-13)
        np.testing.assert_allclose(at[..., 1], 0, rtol=0, atol=1e-13)
        np.testing.assert_allclose(at[..., 2], np.tile(centres, (8, 1)).T, rtol=0, atol=1e-13)


def test_needles_of_their_own_hold_their_sample():
    # Judged in fractions: a needle's plane is more than float64 can tell.
    rng = np.random.default_rng(4)
    found = 0
    for thin in (1e-8, 1e-10, 1e-12, 1e-14):
        for _ in range(20):
            along, aside = rng.normal(size=(2, 3))
            start, middle = rng.uniform(-20, 20, 3), rng.uniform(2, 8)
            needle = start + np.array([0 * along, 9 * along, middle * along + thin * aside])
            samples = sample_surfaces(make_scene(needle, np.array([[0, 1, 2]])), 0.3)
            for point in samples.points:
                assert find_distance_to_segments(point, samples.corners[0]) <= 4 * thin + 1e-13
                found += 1
    assert found >= 60


def find_distance_to_segments(point, corners):
    """Find how far a point is from a triangle's edges, in fractions [m]."""
    p, *places = [[Fraction(float(x)) for x in place] for place in (point, *corners)]
    distances = []
    for a, b in zip(places, places[1:] + places[:1]):
        along, to = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, p)]
        length = sum(x * x for x in along)
        t = min(max(sum(x * y for x, y in zip(to, along)) / length, 0), 1) if length else 0
        distances.append(float(sum((x - t * y) ** 2 for x, y in zip(to, along))) ** 0.5)
    return min(distances)


@pytest.mark.parametrize("spacing", [0.08, 0.4, 2 / 3])
def test_centres_on_a_line_between_triangles_are_sampled_once(spacing):
    # Two halves of a wall that meet under the middle column or row of squares.
    rng = np.random.default_rng(8)
    spots = np.array([(-1, 0), (0, 0), (1, 0), (1, 1), (0, 1), (-1, 1)], float)
    faces = np.array([[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4]], np.int32)
    for upright in True, False:
        for _ in range(10):
            length, turn = rng.uniform(3, 9), rng.uniform(0, 6.3)
            x, z = (spots * (1, length)).T if upright else (spots * (1, length)).T[::-1]
            wall = np.stack([x * np.cos(turn), x * np.sin(turn), z], 1) + rng.uniform(-20, 20, 3)
            winding = faces if upright else faces[:, ::-1]
            samples = sample_surfaces(make_scene(wall, winding), spacing)
            assert len(samples.part) == 1
            rows = np.ceil(length / spacing - 1e-9)
            middles = (np.arange(rows) - (rows - 1) / 2) * spacing
            inside = np.count_nonzero(abs(middles) < length / 2)
            assert len(samples.points) == inside * round(2 / spacing)
            assert len(np.unique(samples.points.round(6), axis=0)) == len(samples.points)


def test_inward_closed_things_are_turned_and_sheets_are_taken_as_wound():
    outward, inward = (
        sample_surfaces(make_scene(*mesh), 0.5)
        for mesh in (box((0, 0, 0), (3, 3, 3)), rewound(box((0, 0, 0), (3, 3, 3))))
    )
    assert (outward.normals * (outward.points - 1.5) >= 0).all()
    assert (inward.normals * (inward.points - 1.5) >= 0).all()
    flat = sheet([(0, 0, 1), (4, 0, 1), (4, 4, 1), (0, 4, 1)])
    assert (sample_surfaces(make_scene(*flat), 0.5).normals == [0, 0, 1]).all()
    with pytest.raises(umbra.InputError, match="face straight down"):
        sample_surfaces(make_scene(*rewound(flat)), 0.5)


def test_every_sample_and_instant_agrees_with_rays(block):
    result = run(block, spacing=0.9)
    mesh = make_block()
    rays = RayCaster(*mesh)
    open_rule = np.zeros(len(mesh[1]), bool)
    points, normals = result.position.values, result.normal.values
    checked = dark = 0
    for surface in range(result.sizes["surface"]):
        mine = np.flatnonzero(result.surface_of_sample.values == surface)
        eye = np.append(normals[mine[0]], 0.0)
        for sun, mask in zip(result.sun_direction.values, result.in_shadow.values):
            if normals[mine[0]] @ sun <= 0:
                assert mask[mine].all()
                continue
            light = np.append(sun, 0.0)
            none = np.full(len(mine), -1)
            pierced = rays.count(points[mine], none, eye, light, open_rule).any
            differ = mine[pierced != (mask[mine] > 0)]
            if len(differ):
                apart = rays.distance_to_shadow_edges(
                    points[differ], normals[differ], np.full(len(differ), -1), light, open_rule
                )
                assert (apart <= EDGE).all()
            checked += len(mine)
            dark += pierced.sum()
    assert checked > 10_000
    assert 0.05 < dark / checked < 0.95


def test_roofs_agree_with_the_plan_and_walls_with_elevations(block):
    surfaces = run(block, spacing=2.5)
    up = np.flatnonzero(surfaces.normal.values[:, 2] > 0.1)
    south = np.flatnonzero(surfaces.normal.values[:, 1] < -0.3)
    met = 0
    for some, receivers in ((up[::4], "top"), (south[::4], "south")):
        for k in some:
            x, y, z = surfaces.position.values[k]
            h = y if receivers == "top" else z
            other = umbra.shadow_study(
                block, VIENNA, **DAY, receivers=receivers, size=(1, 1),
                extent=(x - 0.005, h - 0.005, x + 0.005, h + 0.005),
            )  # fmt: skip
            if receivers == "top":
                is_same = abs(float(other.receiver_z[0, 0]) - z) < 1e-7
            else:
                is_same = np.abs(other.position.values[0, 0] - (x, y, z)).max() < 1e-7
            if is_same:  # nothing stands before it
                met += 1
                np.testing.assert_array_equal(
                    other.in_shadow.values[:, 0, 0], surfaces.in_shadow.values[:, k]
                )
    assert met > 25


def test_summaries_are_those_of_the_samples(block):
    scene = make_scene(
        [
            Part("tower", "WallSurface", Mesh(*box((0, 0, 0), (4, 4, 20)))),
            Part("shed", "RoofSurface", Mesh(*box((0, 8, 0), (6, 12, 3)))),
        ]
    )
    result = run(scene, spacing=0.5, by="part", min_spell="1h")
    assert list(result.part.values) == ["shed", "tower"]
    assert float(result.part_area.sel(part="tower")) == 4 * 4 * 20 + 16
    assert set(result.surface_kind.values) == {"WallSurface", "RoofSurface"}
    for k in range(result.sizes["surface"]):
        mine = result.sun_hours.values[result.surface_of_sample.values == k]
        assert float(result.surface_mean_sun_hours[k]) == pytest.approx(mine.mean(), rel=1e-5)
        assert float(result.surface_least_sun_hours[k]) == mine.min()
        assert float(result.surface_most_sun_hours[k]) == mine.max()
    is_wall = result.surface_tilt.values > 89
    walls = result.surface_azimuth.values[is_wall].round(6) % 360
    np.testing.assert_array_equal(np.sort(walls), [0, 0, 90, 90, 180, 180, 270, 270])
    assert np.isnan(result.surface_azimuth.values[~is_wall]).all()
    # In March the north walls of both have no sun at all.
    winter = run(scene, date="2026-03-05", spacing=0.5, every="30min")
    north = np.isclose(winter.surface_azimuth.values % 360, 0)
    assert (winter.surface_most_sun_hours.values[north] == 0).all()
    roof = scene.parts[1]
    only = run(scene, spacing=0.5, on=["shed"])
    assert list(only.part.values) == [roof.name]
    np.testing.assert_allclose(
        only.part_mean_sun_hours[0], result.part_mean_sun_hours.sel(part="shed"), rtol=1e-6
    )
    # Turned from the sun is no one's doing; all else is.
    cast = result.cast_hours.sum("caster").values
    facing = (result.normal.values @ result.sun_direction.values.T > 0) @ np.full(12, 1.0)
    assert (cast + result.sun_hours.values >= facing * 70 / 60 - 1.2).all()


def test_a_wall_under_a_slab_by_hand(noon, at_45):
    # At 45 degrees a slab that stands out by 1.5 m shades 1.5 m of the wall below it.
    scene = parts(wall=box((-5, 0, 0), (5, 1, 8)), slab=box((-5, -1.5, 6), (5, 0, 6.2)))
    result = umbra.shadow_study(
        scene, at_45, **around(noon), refraction="none", receivers="surfaces", on=["wall"],
        spacing=0.1,
    )  # fmt: skip
    south = result.normal.values[:, 1] < -0.9
    z = result.position.values[south, 2]
    shaded = result.shadow_hours.values[south] > 0
    np.testing.assert_array_equal(shaded, (z > 4.5) & (z < 6.2))
    table = result.surface_mean_sun_hours.values[result.surface_azimuth.values.round() == 180]
    assert float(table[0]) == pytest.approx((1 - 1.7 / 8) * 2 / 3600, rel=0.02)


@pytest.mark.parametrize(
    ("name", "spacing"), [("zurich_lod2.city.json", 2.5), ("delft.city.json", 4.0)]
)
def test_cities_agree_with_embree(name, spacing):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    embree = pytest.importorskip("support.embree", reason="embreex is not installed")
    scene = umbra.read(path)
    result = run(scene, spacing=spacing, every="150min")
    scene = result.result.model.scene  # on its ground
    soup = scene.triangles()
    rays, bulk = RayCaster(soup.vertices, soup.faces), embree.Embree(soup.vertices, soup.faces)
    points = result.position.values - scene.origin
    normals = result.normal.values
    open_rule = np.zeros(len(soup.faces), bool)
    seen = Seen(points, normals, np.full(len(points), -1), None)
    differ = 0
    for sun, mask in zip(result.sun_direction.values, result.in_shadow.values):
        light = np.append(sun, 0.0)
        which = np.flatnonzero(bulk.is_dark(seen, light) != (mask > 0))
        differ += len(which)
        for k in which[:40]:  # float64 has to side with the study
            eye = np.append(normals[k], 0.0)
            pierced = rays.count(points[[k]], [-1], eye, light, open_rule)
            assert pierced.any[0] == (mask[k] > 0) or normals[k] @ sun <= 0
    assert differ < 1e-3 * result.in_shadow.size


def test_points_with_normals_are_the_cells_of_a_plan(block):
    options = {**DAY, "min_spell": "2h", "by": "part"}
    plan = umbra.shadow_study(
        block, VIENNA, **options, ground=0.0, extent=(-30, -30, 30, 30), size=(41, 37)
    )
    x, y = np.meshgrid(plan.x, plan.y)
    flat = np.stack([x, y, 0 * x, 0 * x, 0 * x, 0 * x + 3], -1).reshape(-1, 6)
    points = umbra.shadow_study(block, VIENNA, **options, receivers="points", points=flat)
    assert points.shadow_hours.dims == ("sample",)
    for name in ("shadow_hours", "sun_hours", "first_sun", "last_sun", "sun_spells",
                 "longest_sun_hours", "sun_hours_in_spells", "in_shadow", "cast_hours",
                 "sole_hours", "receiver_z"):  # fmt: skip
        mine = points[name].values.reshape(plan[name].shape)
        np.testing.assert_array_equal(mine, plan[name].values, err_msg=name)
    exact = umbra.shadow_study(
        block, VIENNA, **{**options, "exact": True}, receivers="points", points=flat
    )
    same = umbra.shadow_study(
        block, VIENNA, **{**options, "exact": True}, ground=0.0, extent=(-30, -30, 30, 30),
        size=(41, 37),
    )  # fmt: skip
    np.testing.assert_array_equal(exact.sun_hours.values.reshape(37, 41), same.sun_hours.values)


def test_points_without_normals_turn_to_every_sun():
    wall = make_scene(*box((0, 0, 0), (1, 10, 10)))
    point = [(1.5, 5.0, 5.0)]  # before the east face
    free = umbra.shadow_study(wall, VIENNA, **DAY, receivers="points", points=point)
    assert np.isnan(free.normal.values).all()
    facing = [(*point[0], 0.0, -1.0, 0.0)]  # the June sun comes up in the north-east
    south = umbra.shadow_study(wall, VIENNA, **DAY, receivers="points", points=facing)
    assert 0 < float(south.sun_hours[0]) < float(free.sun_hours[0])


def test_chunks_and_threads_change_nothing(block, monkeypatch):
    options = {"spacing": 0.8, "spells": True, "by": "part"}
    one = run(block, threads=1, **options)
    monkeypatch.setattr(points_module, "CHUNK", 333)
    told = []
    chunked = run_study(
        block, VIENNA, **DAY, receivers="surfaces", threads=2,
        progress=lambda done, of: told.append((done, of)), **options,
    ).to_dataset()  # fmt: skip
    assert told[-1][0] == told[-1][1]
    for name in one.data_vars:
        np.testing.assert_array_equal(chunked[name], one[name], err_msg=name)


@pytest.mark.parametrize(
    ("text", "shape", "names"),
    [
        ("1,2,3\n4,5,6\n", (2, 3), []),
        ("1,2,3,0,0,2\n", (1, 6), []),
        ("x,y,z\n1,2,3\n\n4,5,6\n", (2, 3), []),
        ("\ufeffname, z, y, x, storey\nkitchen, 3, 2, 1, EG\n", (1, 3), ["kitchen"]),
        ("x,y,z,nx,ny,nz\n1,2,3,0,-4,0\n", (1, 6), []),
        ("\ufeffname;x;y;z\r\nk, l;1,0;2;3\r\n", (1, 3), ["k, l"]),
    ],
)
def test_tables_of_points(tmp_path, text, shape, names):
    path = tmp_path / "points.csv"
    path.write_text(text, encoding="utf-8")
    points, found = read_points(path)
    assert points.shape == shape
    assert found == names
    np.testing.assert_array_equal(points[0, :3], (1, 2, 3))
    if shape[1] == 6:
        assert np.linalg.norm(points[0, 3:]) == 1


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no points"),
        ("x,y\n1,2\n", "line 1 has not 3 numbers"),
        ("x,y,z\n1,2,3\n1,two,3\n", "line 3 has not 3 numbers"),
        ("x,y,z,nx\n1,2,3,4\n", "all of nx, ny, nz"),
        ("1,2,3,0,0,0\n", "normal of length 0"),
        ("1,2,inf\n", "not finite"),
        ("name,x,y,z\nM\udcfcller,1,2,3\n", "line 2: has a byte 0xfc .* UTF-8"),
    ],
)
def test_slips_in_tables_are_told(tmp_path, text, says):
    path = tmp_path / "points.csv"
    path.write_text(text, "utf-8", "surrogateescape")
    with pytest.raises(umbra.InputError, match=says):
        read_points(path)
    with pytest.raises(umbra.InputError, match="no such file"):
        read_points(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"spacing": 0.0}, "larger than 0"),
        ({"spacing": 1e-4}, "or more"),
        ({"on": ["tower"]}, "matches no part"),
        ({"receivers": "points"}, "points="),
    ],
)
def test_slips_are_told(block, options, says):
    with pytest.raises(umbra.InputError, match=says):
        run(block, **options)


def test_many_suns_are_counted_by_patches_with_the_answers_of_rays(block, monkeypatch):
    made = []
    make = points_module.make_patches
    monkeypatch.setattr(
        points_module, "make_patches", lambda *given: made.append(1) or make(*given)
    )
    options = {"spacing": 0.7, "every": "20min"}
    scene = replace(block)  # without what other tests left with it
    by_patches = run(scene, **options)
    whole = run(scene, **options, masks=False)
    assert len(made) == 1  # the second study finds the patches of the first
    monkeypatch.setattr(points_module, "MANY_SUNS", 10**9)
    by_rays = run(scene, **options)
    assert len(made) == 1
    np.testing.assert_array_equal(by_patches.in_shadow, by_rays.in_shadow)
    np.testing.assert_array_equal(by_patches.shadow_hours, by_rays.shadow_hours)
    np.testing.assert_allclose(whole.shadow_hours, by_rays.shadow_hours, rtol=0, atol=1e-5)


def test_surfaces_in_several_pieces_have_the_same_hours(block, monkeypatch):
    options = {"spacing": 0.7, "every": "20min"}
    whole = run(block, **options)
    monkeypatch.setattr(points_module, "_CHUNK_OF_SURFACES", 501)
    np.testing.assert_array_equal(run(block, **options).in_shadow, whole.in_shadow)


@pytest.mark.parametrize("options", [{"by": "part"}, {"proposed": ["b"]}, {"canopy": ["b"]}])
def test_hours_by_caster_are_those_that_rays_find(monkeypatch, options):
    scene = parts(
        a=moved(turned(GABLE, 20), (-4, -24, 0)), b=box((0, -9, 0), (5, -4, 12)),
        c=box((5, -9, 0), (9, -4, 5)), floor=sheet([(-30, -30, 0), (30, -30, 0), (30, 30, 0),
                                                    (-30, 30, 0)]),
    )  # fmt: skip
    options = {"by": "part", "spacing": 0.7, "masks": False, **options}
    counted = run(scene, **options)
    monkeypatch.setattr(points_module, "_CHUNK_OF_SURFACES", 700)
    cut = run(scene, **options)
    monkeypatch.setattr(points_module.PointTile, "count_pieces", lambda *_: None)
    asked = run(scene, **options)
    for name in ("cast_hours", "sole_hours"):
        np.testing.assert_array_equal(counted[name], asked[name])
        np.testing.assert_array_equal(cut[name], asked[name])
        assert float(counted[name].sum()) > 0
