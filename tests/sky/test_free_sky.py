"""The sky above a place: outlines, horizon, sun, pictures, and what walls let pass unseen."""

import numpy as np
import pytest
from support.model_files import DATA
from support.shapes import box, merge

import umbra
from umbra.errors import InputError
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.sky.casters import find_sky_casters, make_sky_casters
from umbra.sky.tensors import find_open
from umbra.sky.view_factors import find_seen, measure_sky
from umbra.volume.adjacency import make_caster

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")


def town(seed, n=40):
    rng = np.random.default_rng(seed)
    low = rng.integers(-20, 20, (n, 2))
    size, top = rng.integers(1, 5, (n, 2)), rng.integers(1, 12, n)
    return merge(*(box((*a, 0), (*(a + s), t)) for a, s, t in zip(low, size, top)))


def soup(seed, n=80):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(n, 3, 3)) + rng.normal(size=(n, 1, 3)) * 4
    return corners.reshape(-1, 3), np.arange(3 * n, dtype=np.int32).reshape(-1, 3)


def integrate(outlines, normal):
    """The formulas of the docs, from nothing but corners."""
    solid, first, second = 0.0, np.zeros(3), np.zeros(3)
    for outline in outlines:
        p = outline.directions
        q = np.roll(p, -1, 0)
        n = np.cross(p, q)
        sine, cosine = np.linalg.norm(n, axis=1), (p * q).sum(1)
        t = np.arctan2(sine, cosine)[:, None]
        n /= sine[:, None]
        first += (t * n).sum(0) / 2
        second += ((p * np.sin(t) + np.cross(n, p) * (1 - np.cos(t))) * n[:, 2:]).sum(0)
        up = n[:, 2] * sine
        solid += 2 * np.arctan2(up, 1 + cosine + p[:, 2] + q[:, 2]).sum()
    second = (second + [0, 0, solid]) / 3
    return first @ normal / np.pi, 100 * (first + 2 * second) @ normal / 3 / (7 * np.pi / 9)


def judge(mesh, point, normal, n=400):
    """By stratified rays; their standard error is about 1e-4."""
    rng = np.random.default_rng(1)
    i, j = np.divmod(np.arange(n * n), n)
    up, turn = (i + rng.random(n * n)) / n, 2 * np.pi * (j + rng.random(n * n)) / n
    level = np.sqrt(1 - up**2)
    rays = np.stack([level * np.cos(turn), level * np.sin(turn), up], 1)
    tree = make_face_tree(make_caster(*mesh))
    masks = find_hidden(tree, np.array([point]), np.array([normal]), rays)[:, 0]
    light = np.clip(rays @ normal, 0, None) * (masks == 0)
    return 2 * light.mean(), 100 * 2 * np.pi * (light * (1 + 2 * up) / 3).mean() / (7 * np.pi / 9)


@pytest.mark.parametrize("make", [town, soup])
@pytest.mark.parametrize("seed", range(4))
def test_rays_and_outlines_agree(make, seed):
    mesh = make(seed)
    rng = np.random.default_rng(seed)
    scene = umbra.make_scene(*mesh)
    for normal in (np.array([0, 0, 1.0]), np.array([0.6, -0.8, 0]), rng.normal(size=3)):
        unit = normal / np.linalg.norm(normal)
        point = np.append(rng.integers(-12, 12, 2) + (0.25, 0.125), 0.0)
        view = umbra.sky_view(scene, point, unit)
        by_rays = judge(mesh, point, unit)
        assert view.sky_view_factor == pytest.approx(by_rays[0], abs=1.5e-3)
        assert view.sky_component == pytest.approx(by_rays[1], abs=0.15)
        found = integrate(view.outlines, unit)
        assert found[0] == pytest.approx(view.sky_view_factor, abs=1e-11)
        assert found[1] == pytest.approx(view.sky_component, abs=1e-9)


@pytest.mark.parametrize("name", ["vienna_lod2.city.jsonl", "delft.city.json"])
def test_skyline_of_walls_hides_nothing_that_counts(name):
    if not (DATA / name).exists():
        pytest.skip(f"the real model {name} is not in ../shared/data")
    casters, _ = find_sky_casters(umbra.read(DATA / name))
    rng = np.random.default_rng(2)
    upright = np.flatnonzero(np.abs(casters.planes[:, 2]) < 0.01)
    faces = rng.choice(upright, 12)
    points = casters.vertices[casters.faces[faces]].mean(1)
    normals = casters.planes[faces, :3].copy()
    normals[::3] = (0, 0, 1)
    none = {
        name: getattr(casters, name)[:0] for name in ("strips", "strip_boxes", "strip_box_boxes")
    }
    plain = casters._replace(**none)
    quick, slow = (measure_sky(one, points, normals, 1) for one in (casters, plain))
    assert len(casters.strips) > 1000
    assert quick.sky_view_factor == pytest.approx(slow.sky_view_factor, abs=1e-12)
    assert quick.sky_component == pytest.approx(slow.sky_component, abs=1e-10)
    assert slow.sky_view_factor.max() > 0.1


def test_strips_of_a_wall_with_a_gap():
    wall = merge(box((0, 0, 0), (10, 1, 3)), box((4, 0, 5), (6, 1, 9)))
    strips = make_sky_casters(*wall).strips
    levels = {(round(top), round(low)) for top, low in strips[:, [2, 6]]}
    assert levels == {(3, 0), (9, 5)}


@pytest.fixture
def gate():
    tower = box((-4, 10, 0), (4, 12, 20))
    beam = box((-30, 8, 6), (30, 9, 7))
    return umbra.make_scene(
        [umbra.Part("tower", "", umbra.Mesh(*tower)), umbra.Part("beam", "", umbra.Mesh(*beam))]
    )


def test_names_behind_edges_and_holes(gate):
    view = umbra.sky_view(gate, (0, 0, 0))
    shares = list(view.blocked_by.values())
    assert set(view.blocked_by) == {"beam", "tower"}
    assert shares == sorted(shares, reverse=True)
    assert sum(view.blocked_by.values()) + view.sky_component / 100 == pytest.approx(1, abs=1e-12)
    names = [set(outline.part) for outline in view.outlines]
    assert {None, "beam", "tower"} in names
    # Below the beam the sky is free on both sides of the tower: loops of their own or joined.
    for outline in view.outlines:
        middle = outline.directions + np.roll(outline.directions, -1, 0)
        normal = np.cross(outline.directions, np.roll(outline.directions, -1, 0))
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        right = view.name_hits(middle - 1e-5 * normal)
        left = view.name_hits(middle + 1e-5 * normal)
        assert left == [None] * len(left)
        assert tuple(right) == outline.part


def test_floating_plate_is_a_hole():
    scene = umbra.make_scene(*box((-1, 2, 5), (1, 4, 5.5)), name="plate")
    view = umbra.sky_view(scene, (0, 0, 0))
    assert sorted({*outline.part} for outline in view.outlines if "plate" in outline.part) == [
        {"plate"}
    ]
    assert len(view.outlines) == 2


def test_horizon(gate):
    azimuth, elevation = umbra.sky_view(gate, (0, 0, 0)).horizon(5)
    assert azimuth.tolist() == list(range(0, 360, 5))
    assert elevation[0] == pytest.approx(np.degrees(np.arctan2(20, 10)))
    assert elevation[36] == 0
    # Beside the tower the sky is free below the beam.
    assert elevation[azimuth == 35] == 0
    with pytest.raises(InputError) as raised:
        umbra.sky_view(gate, (0, 0, 0)).horizon(7)
    assert raised.value.step == 7


def test_sun_and_what_it_goes_behind():
    tower = box((-4, -12, 0), (4, -10, 20))
    view = umbra.sky_view(umbra.make_scene(*tower, name="tower"), (0, 0, 0), site=SITE)
    first, second = view.sun("2026-03-20")
    assert (first.out_of, first.behind) == ("horizon", "tower")
    assert (second.out_of, second.behind) == ("tower", "horizon")
    for when in (first.end, second.start):
        for seconds in (-2, 2):
            instant = np.datetime64(when.astimezone(umbra.sun.clock.dt.UTC).replace(tzinfo=None))
            toward = umbra.find_sun(SITE, instant + np.timedelta64(seconds, "s")).direction
            is_free = view.name_hits(toward) == [None]
            assert is_free == ((seconds < 0) == (when is first.end))
    wall = umbra.sky_view(umbra.make_scene(*tower, name="tower"), (0, 0, 0), (0, 1, 0), SITE)
    spells = wall.sun("2026-06-21")
    assert [(one.out_of, one.behind) for one in spells] == [
        ("horizon", "own plane"), ("own plane", "horizon")
    ]  # fmt: skip
    with pytest.raises(InputError):
        umbra.sky_view(umbra.make_scene(*tower, name="tower"), (0, 0, 0)).sun("2026-03-20")


@pytest.mark.parametrize("projection", ["stereographic", "equidistant", "orthographic", "waldram"])
@pytest.mark.parametrize("normal", [None, (0, 1, 0), (0.3, 0.4, 0.5)])
def test_pictures_are_drawn(gate, tmp_path, projection, normal):
    view = umbra.sky_view(gate, (0, 0, 0), normal, SITE)
    for ending in ("png", "svg", "pdf"):
        path = tmp_path / f"sky.{ending}"
        view.plot(projection, ["2026-06-21"]).save(path)
        assert path.stat().st_size > 5000
        if ending == "svg":
            assert "tower" in path.read_text()


def test_unknown_projection(gate):
    with pytest.raises(InputError) as raised:
        umbra.sky_view(gate, (0, 0, 0)).plot("sterographic")
    assert raised.value.projection == "sterographic"


def test_needles_in_the_receivers_plane_stay_within_their_rows():
    # To within rounding in the plane: of four corners above the horizon every second is before it.
    most = 0
    for seed in (20, 81, 92):
        rng = np.random.default_rng(seed)
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        across = np.cross(normal, [0, 0, 1.0])
        across /= np.linalg.norm(across)
        plane = np.array([across, np.cross(normal, across)])
        start = rng.uniform(-9, 9, (64, 2))
        end = start + rng.uniform(-5, 5, (64, 2))
        a, b = start @ plane, end @ plane
        off = 10.0 ** rng.uniform(-16, -9, (64, 1))
        c = a + (b - a) * rng.uniform(-0.2, 1.2, (64, 1)) + off * rng.normal(size=(64, 3))
        faces = np.arange(192, dtype=np.int32).reshape(-1, 3)
        casters = make_sky_casters(np.stack([a, b, c], 1).reshape(-1, 3), faces)
        seen = find_seen(casters, np.zeros(3), normal)
        assert seen.size.max() <= seen.corners.shape[1]
        most = max(most, seen.size.max())
        free = measure_sky(casters, [np.zeros(3)], [normal], 1, objects=1)
        assert free.sky_component == pytest.approx(
            measure_sky(casters, [np.zeros(3)], [normal], 1).sky_component
        )
    assert most == 6  # or this test tries nothing


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, -1, 0)])
def test_before_upright_planes_what_is_free_and_what_is_taken_are_the_whole(normal):
    # Faces cut by the plane end in it, where it holds the meridian.
    vertices, faces = soup(0)
    casters = make_sky_casters(vertices, faces, np.arange(len(faces), dtype=np.int32) % 2)
    points = np.random.default_rng(0).uniform(-1, 1, (200, 3))
    found = measure_sky(casters, points, np.tile(normal, (200, 1)), objects=2)
    whole = 100 * find_open(np.array([normal], float))[1][0]
    taken = whole * found.blocked_by.sum(1)
    assert found.sky_component + taken == pytest.approx(np.full(200, whole), abs=1e-6)
