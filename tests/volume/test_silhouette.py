"""Silhouettes: solved by hand, held against a dictionary of edges, and closed at every vertex."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.model_files import DATA, FILES
from support.shapes import SCENES, TOP, box, duplicated, jumble, rewound, sheet, soup, terrain
from support.sweeps import reduce_count

import umbra
from umbra.volume import facing
from umbra.volume.adjacency import make_caster
from umbra.volume.silhouette import find_silhouette_edges, find_silhouettes

CUBE = box((-1, -1, 0), (1, 1, 2))
SQUARE = [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]


def find(mesh, light):
    """Give {(from, to): multiplicity} with places for vertices, multiplicities above 0."""
    caster = make_caster(*mesh)
    edges, multiplicity = find_silhouette_edges(caster, np.array(light, float))
    assert (multiplicity > 0).all()
    places = [tuple(tuple(v) for v in caster.vertices[edge].tolist()) for edge in edges]
    found = dict(zip(places, multiplicity.tolist()))
    assert len(found) == len(edges), "an edge was given twice"
    return found


def add_up(mesh, light, is_closed):
    """Add up what each face adds to its edges, one by one."""
    sums = Counter()
    light = np.array(light, float)
    for face, closed in zip(mesh[1], is_closed):
        corners = mesh[0][face] + 0.0
        a, b, c = corners
        normal = np.cross(b - a, c - a)
        side = normal @ light[:3] - light[3] * (normal @ a)
        adds = 1 if side > 0 else (0 if closed or side == 0 else -1)
        places = [tuple(v) for v in corners.tolist()]
        if len(set(places)) < 3:
            continue
        for tail, head in zip(places, places[1:] + places[:1]):
            sums[(tail, head)] += adds
            sums[(head, tail)] -= adds
    return {edge: n for edge, n in sums.items() if n > 0}


def check_vertex_sums(edges, multiplicity):
    net = np.zeros(edges.max(initial=0) + 1, np.int64)
    np.add.at(net, edges[:, 0], multiplicity)
    np.subtract.at(net, edges[:, 1], multiplicity)
    assert not net.any()


def area_seen_from_above(edges):
    """Give the area that directed edges enclose in plan, counter-clockwise positive."""
    return sum(m * (a[0] * b[1] - b[0] * a[1]) for (a, b), m in edges.items()) / 2


def test_a_cube_from_a_corner_has_six_edges():
    edges = find(CUBE, (3, 2, 5, 0))
    assert len(edges) == 6
    assert set(edges.values()) == {1}
    assert not any((1.0, 1.0, 2.0) in edge for edge in edges)  # the near corner is inside


def test_a_cube_from_above_has_its_four_top_edges():
    edges = find(CUBE, (0, 0, 1, 0))
    top = [(-1.0, -1.0, 2.0), (1.0, -1.0, 2.0), (1.0, 1.0, 2.0), (-1.0, 1.0, 2.0)]
    assert edges == dict.fromkeys(zip(top, top[1:] + top[:1]), 1)


def test_a_two_metre_box_encloses_plus_four_square_metres():
    assert area_seen_from_above(find(CUBE, (0, 0, 1, 0))) == 4
    assert area_seen_from_above(find(CUBE, (0.1, 0.2, 50, 1))) == 4


def test_from_below_the_bottom_winds_the_other_way():
    assert area_seen_from_above(find(CUBE, (0, 0, -1, 0))) == -4


@pytest.mark.parametrize("light", [(0.3, 0.1, 1, 0), (0.5, 0.4, 9, 1)])
def test_a_sheet_has_its_four_borders_and_no_diagonal(light):
    edges = find(sheet(SQUARE), light)
    assert len(edges) == 4
    assert set(edges.values()) == {1}
    assert area_seen_from_above(edges) == 4
    # From behind it casts all the same, wound to face the light.
    below = find(sheet(SQUARE), -np.array(light) * [1, 1, 1, -1])
    assert len(below) == 4
    assert area_seen_from_above(below) == -4


def test_a_quad_whose_halves_disagree_has_no_diagonal_either():
    # Each half is turned to face the light, and then they agree.
    edges = find(rewound(sheet(SQUARE), [1]), (0.3, 0.1, 1, 0))
    assert len(edges) == 4
    assert set(edges.values()) == {1}


def test_a_ridge_counts_twice_where_one_half_is_seen_from_behind():
    # A tent without ends: from high both halves face the light, from low only one does.
    vertices = np.array([(-1.0, 0, 0), (-1, 4, 0), (0, 0, 1), (0, 4, 1), (1, 0, 0), (1, 4, 0)])
    faces = np.array([[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]], np.int32)
    ridge = frozenset({(0.0, 0.0, 1.0), (0.0, 4.0, 1.0)})
    for flipped in ([], [0, 1], [2, 3], [1, 2]):
        mesh = rewound((vertices, faces), flipped) if flipped else (vertices, faces)
        high = {frozenset(e): m for e, m in find(mesh, (0.2, 0, 1, 0)).items()}
        assert ridge not in high
        assert len(high) == 6  # two eaves, and two verges at each end
        low = {frozenset(e): m for e, m in find(mesh, (1, 0, 0.2, 0)).items()}
        assert low[ridge] == 2


def test_duplicated_faces_count_twice():
    edges = find(duplicated(sheet(SQUARE), [0, 1]), (0.3, 0.1, 1, 0))
    assert len(edges) == 4
    assert set(edges.values()) == {2}


def test_a_cube_with_its_top_flipped_casts_top_and_bottom():
    # Two faces meet at each edge, yet it is not closed: no face would be lit from above.
    edges = find(rewound(CUBE, TOP), (0, 0, 1, 0))
    assert area_seen_from_above(edges) == 8
    assert len(edges) == 8


def test_faces_seen_edge_on_add_nothing():
    wall = sheet([(0, 0, 0), (2, 0, 0), (2, 0, 2), (0, 0, 2)])
    for light in (1, 0, 1, 0), (-3, 0, 2, 0), (0, 0, 1, 0), (5, 0, 1, 1):
        assert find(wall, light) == {}


lights = st.tuples(*[st.floats(-12, 12, width=32)] * 3, st.sampled_from([0.0, 1.0])).filter(
    lambda v: any(v[:3])
)


@settings(max_examples=reduce_count(150, 2), deadline=None, derandomize=True)
@given(st.integers(0, 2**32), st.integers(1, 50), st.integers(3, 12), st.booleans(), lights)
def test_any_soup_agrees_with_adding_up_face_by_face(seed, n, places, whole, light):
    mesh = jumble(np.random.default_rng(seed), n, places)
    if whole:  # many faces edge-on, many degenerate
        mesh = np.round(mesh[0] / 4), mesh[1]
        light = (*np.round(light[:3]), light[3])
        if not any(light[:3]):
            return
    caster = make_caster(*mesh)
    is_closed = np.zeros(n, bool)
    is_closed[caster.source] = caster.face_is_closed
    assert find(mesh, light) == add_up(mesh, light, is_closed)
    check_vertex_sums(*find_silhouette_edges(caster, np.array(light, float)))


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_agrees_with_adding_up_face_by_face(name):
    mesh = SCENES[name]()
    caster = make_caster(*mesh)
    is_closed = np.zeros(len(mesh[1]), bool)
    is_closed[caster.source] = caster.face_is_closed
    for light in (0.3, 0.2, 0.8, 0), (1, 0, 1, 0), (0.5, 0.25, 3.0, 1), (40, -30, 10, 1):
        assert find(mesh, light) == add_up(mesh, light, is_closed)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 150])
def test_many_lights_in_one_pass_are_as_one_by_one(n):
    rng = np.random.default_rng(n)
    caster = make_caster(*terrain(n=25))
    suns = np.column_stack([rng.normal(size=(n, 3)), rng.integers(0, 2, n)])
    done = 0
    for which, found in find_silhouettes(caster, suns):
        assert which.start == done
        done = which.stop
        for k, sun in enumerate(suns[which]):
            codes = found.codes[found.starts[k] : found.starts[k + 1]]
            edges, multiplicity = find_silhouette_edges(caster, sun)
            sums = Counter()
            for code in codes:
                e = code >> 2
                m = (int(caster.weight[e]) >> (code >> 1 & 1)) * (1 if code & 1 else -1)
                a, b = caster.edges[e].tolist()
                sums[(a, b)] += m
                sums[(b, a)] -= m
            expected = {tuple(e): m for e, m in zip(edges.tolist(), multiplicity.tolist())}
            assert {e: m for e, m in sums.items() if m > 0} == expected
    assert done == n


@pytest.mark.parametrize("opened", [False, True])
def test_opened_components_let_their_unlit_faces_add(opened):
    mesh = box((0, 0, 0), (2, 2, 2))
    caster = make_caster(*mesh)
    if opened:
        caster = caster.opened(np.array([True]))
        assert caster.opened(np.array([True])) is caster
    light = np.array([3.0, 2, 5, 0])
    edges, multiplicity = find_silhouette_edges(caster, light)
    assert len(edges) == 6
    assert set(multiplicity) == {2 if opened else 1}
    assert (caster.face_is_closed == (not opened)).all()


@pytest.mark.parametrize("name", FILES)
def test_sums_vanish_at_every_vertex_of_real_files(name):
    if not (DATA / name).is_file():
        pytest.skip(f"{name} is not here: the real models lie outside the repository")
    scene = umbra.read(DATA / name)
    triangles = scene.triangles()
    caster = make_caster(triangles.vertices, triangles.faces, scene.groups()[triangles.part])
    middle = triangles.vertices[triangles.faces.ravel()].mean(0)
    for light in (*(0.3, -0.5, 0.6), 0), (*(0, 0, 1), 0), (*middle, 1), (*(middle + 60), 1):
        edges, multiplicity = find_silhouette_edges(caster, np.array(light, float))
        assert len(edges) > 10
        check_vertex_sums(edges, multiplicity)


def test_soups_without_shared_edges_keep_every_border():
    mesh = soup(np.random.default_rng(2), n=30)
    edges = find(mesh, (0.1, 0.2, 0.9, 0))
    assert len(edges) == 90
    assert set(edges.values()) == {1}


def test_groups_face_a_light_as_one_but_for_faces_without_direction(monkeypatch):
    monkeypatch.setattr(facing, "_MANY_FACES", 0)
    n = 256
    planes = np.full((4, n + 1), np.nan)
    planes[:, :n] = np.random.default_rng(3).normal(0, 0.1, (4, n))
    planes[2, :n] = 1.0
    planes[:, 70] = 0.0  # never lit, edge-on to every light
    caster = replace(make_caster(*CUBE), planes=planes, faces=np.zeros((n, 3), np.int32))
    suns = np.array([(0.1, 0.2, 1, 0), (0.3, 0, 1, 0), (0, 0.1, -1, 0)])
    for lights in suns, suns - (0, 0, 1, -1):
        lit, edge_on = np.zeros((2, n + 1), np.uint8), np.zeros((2, 1), np.uint64)
        facing.find_lit(planes, lights, lit[0], edge_on[0])
        facing._find_lit_of(caster, lights, lit[1], edge_on[1])
        np.testing.assert_array_equal(lit[0, :n], lit[1, :n])
        np.testing.assert_array_equal(edge_on[0], edge_on[1])


@pytest.mark.parametrize("name", SCENES)
def test_faces_tested_in_groups_are_lit_as_alone(name, monkeypatch):
    caster = make_caster(*SCENES[name]())
    monkeypatch.setattr(facing, "_MANY_FACES", 0)
    rng = np.random.default_rng(5)
    suns = np.column_stack([rng.normal(size=(60, 2)), rng.uniform(1e-3, 1, 60), np.zeros(60)])
    n = caster.planes.shape[1]
    # Along a face, opposite to its normal, and with no common length.
    edge = caster.vertices[caster.edges[0, 0]] - caster.vertices[caster.edges[0, 1]]
    suns[:3, :3] = [edge, -caster.planes[:3, 0], (0, 0, 1e-7)]
    for some in suns, suns[:7]:
        kind = np.uint64 if len(some) > 8 else np.uint8
        lit, edge_on = np.zeros((2, n), kind), np.zeros((2, (n + 511) // 512), np.uint64)
        facing.find_lit(caster.planes, some, lit[0], edge_on[0])
        facing._find_lit_of(caster, some, lit[1], edge_on[1])
        np.testing.assert_array_equal(lit[0], lit[1])
        np.testing.assert_array_equal(edge_on[0], edge_on[1])
        assert lit.any()
