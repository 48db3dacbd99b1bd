"""Shadows on planar patches: by hand, against rays, and against the float64 ray caster."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.days import parts
from support.patches import FLOOR, check, make_counter, make_suns, prepare
from support.shapes import SCENES, box, city, jumble, merge, moved, sheet, soup, turned
from support.sweeps import reduce_count

import umbra.cpu.patch_count
import umbra.cpu.patches
from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patches import make_patches
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.receivers.samples import sample_surfaces
from umbra.scene import make_scene
from umbra.volume.adjacency import make_caster

NOON = np.array([[0.0, -0.6, 0.8]])


def count_on_floor(mesh, suns, spacing=0.5):
    """Give the area of the floor z = 0 in shadow, and its mask with the samples' places [m]."""
    samples, patches, counter, _, scene = prepare(merge(FLOOR, mesh), spacing)
    assert not np.isinf(patches.graze[np.diff(patches.first) > 100]).any()
    points = samples.points + scene.origin
    mine = (np.abs(points[:, 2]) < 1e-9) & (samples.normals[:, 2] > 0.5)
    return counter.masks(suns)[:, mine], points[mine]


def test_a_box_casts_its_parallelogram():
    # 2 x 2 x 3 m under a sun 0.8 up and 0.6 to the south: the shadow is 2 wide, and reaches
    # 3 * 0.6 / 0.8 = 2.25 m beyond its northern wall.
    (mask,), points = count_on_floor(box((-1.1, -1.1, 0), (0.9, 0.9, 3)), NOON)
    inside = (points[:, 0] > -1.1) & (points[:, 0] < 0.9)
    inside &= (points[:, 1] > -1.1) & (points[:, 1] < 0.9 + 2.25)
    np.testing.assert_array_equal(mask, inside)
    assert mask.sum() == 4 * 8  # squares of 0.5 m: 4 across; from -1.1 to 3.15 8 up


def test_a_box_that_hangs_over_the_floor_leaves_the_ground_beneath_it_lit():
    (mask,), points = count_on_floor(moved(box((-1.1, -1.1, 0), (0.9, 0.9, 1)), (0, 0, 4)), NOON)
    y = points[:, 1] - 4 * 0.75  # the shadow of its bottom lies 3 m to the north
    inside = (np.abs(points[:, 0] + 0.1) < 1) & (y > -1.1) & (y < 0.9 + 0.75)
    np.testing.assert_array_equal(mask, inside)


def test_a_wall_that_passes_through_the_floor_casts_only_what_is_above():
    wall = sheet([(-3.1, 0.1, -5), (2.9, 0.1, -5), (2.9, 0.1, 2), (-3.1, 0.1, 2)])
    (mask,), points = count_on_floor(wall, NOON)
    inside = (np.abs(points[:, 0] + 0.1) < 3) & (points[:, 1] > 0.1) & (points[:, 1] < 0.1 + 1.5)
    np.testing.assert_array_equal(mask, inside)
    # From the other side it falls to the south.
    (mask,), points = count_on_floor(wall, NOON * [1, -1, 1])
    inside = (np.abs(points[:, 0] + 0.1) < 3) & (points[:, 1] < 0.1) & (points[:, 1] > 0.1 - 1.5)
    np.testing.assert_array_equal(mask, inside)


def test_two_sheets_of_one_place_and_a_roof_in_the_floors_plane_are_told_apart():
    # Two sheets in one place, either way round, hide like one; what lies in the floor's plane
    # hides nothing.
    high = sheet([(-1.1, -1.1, 2), (0.9, -1.1, 2), (0.9, 0.9, 2), (-1.1, 0.9, 2)])
    level = sheet([(4, 4, 0), (8, 4, 0), (8, 8, 0), (4, 8, 0)])
    for other in (high, (high[0], high[1][:, ::-1])):
        (mask,), points = count_on_floor(merge(high, other, level), NOON)
        y = points[:, 1] - 1.5
        inside = (np.abs(points[:, 0] + 0.1) < 1) & (y > -1.1) & (y < 0.9)
        np.testing.assert_array_equal(mask, inside)


def test_a_film_over_the_sample_that_is_asked_first_hides_only_what_it_covers():
    # Too close to the floor to have rims there: what hides that sample need not hide the others,
    # so the rims of the tower must be found.
    film, tower = box((-1, -11, 0), (2, -9, 1e-7)), box((5, -5, 0), (7, -3, 3.2))
    (mask,), points = count_on_floor(merge(film, tower), NOON)
    x, y = points[:, 0], points[:, 1]
    inside = (x > -1) & (x < 2) & (y < -9)
    assert inside[np.lexsort(points.round(6).T[1::-1])[len(points) // 2]]
    inside |= (x > 5) & (x < 7) & (y > -5) & (y < -3 + 3.2 * 0.75)
    np.testing.assert_array_equal(mask, inside)


def test_a_floor_wholly_in_shadow_and_wholly_lit():
    cover = sheet([(-40, -40, 5), (40, -40, 5), (40, 40, 5), (-40, 40, 5)])
    (mask,), _ = count_on_floor(cover, NOON)
    assert mask.all()
    (mask,), _ = count_on_floor(moved(cover, (0, 0, -9)), NOON)
    assert not mask.any()


@pytest.mark.parametrize("spacing", [0.5, 0.1])
def test_a_patch_crossed_by_many_rims_agrees_with_rays(spacing):
    # A fence of 90 rails: each column of the floor is crossed 180 times. With 40 rows there is
    # no room for so many, and rays are asked; with 200 they are added up row by row.
    rails = [box((-9, y, 1), (9, y + 0.02, 1.02)) for y in np.linspace(-8, 8, 90)]
    samples, _, counter, tree, _ = prepare(merge(FLOOR, *rails), spacing)
    suns = make_suns(np.random.default_rng(5), 4, 0.3)
    masks = counter.masks(suns)
    truth = find_hidden(tree, samples.points, samples.normals, suns)
    np.testing.assert_array_equal(masks, truth)


@pytest.mark.parametrize("name", list(SCENES))
def test_every_scene_agrees_with_rays(name):
    mesh = SCENES[name]()
    most = np.ptp(mesh[0], axis=0).max()
    check(mesh, make_suns(np.random.default_rng(2), 5), most / 60)


@settings(max_examples=reduce_count(25, 2), deadline=None)
@given(seed=st.integers(0, 2**32 - 1), sharp=st.booleans(), floor=st.booleans())
def test_soups_agree_with_rays(seed, sharp, floor):
    rng = np.random.default_rng(seed)
    mesh = (jumble if sharp else soup)(rng)
    mesh = merge(FLOOR, mesh) if floor else mesh
    check(mesh, make_suns(rng, 4), 0.21)


def test_a_town_is_counted_by_rims_and_not_by_rays(monkeypatch):
    mesh = turned(merge(FLOOR, city(4, seed=3)), 17)
    suns = make_suns(np.random.default_rng(8), 6, 0.2)
    dark, lit = check(mesh, suns, 0.4)
    assert dark > 1000
    assert lit > 1000
    _, patches, _, _, _ = prepare(mesh, 0.4)
    counted = np.diff(patches.first)[np.isfinite(patches.graze)].sum()
    assert counted > 0.95 * len(patches.where)
    monkeypatch.setattr(umbra.cpu.patches, "FEW", 10**9)
    _, patches, _, _, _ = prepare(mesh, 0.4)
    assert np.isinf(patches.graze).all()


@pytest.mark.parametrize("order", ["ab", "ba"])
def test_sheets_of_two_objects_with_an_edge_in_common(order):
    # Folded there, one above the other: the edge is a rim of both, whichever hides a sample.
    sheets = {
        name: sheet([(2, -50, 3), (2, 50, 3), (-50, 50, z), (-50, -50, z)])
        for name, z in zip(order, (3.0, 2.0), strict=True)
    }
    samples, counter, tree = make_counter(parts(**dict(sorted(sheets.items())), floor=FLOOR), 1.0)
    truth = find_hidden(tree, samples.points, samples.normals, NOON)
    np.testing.assert_array_equal(counter.masks(NOON), truth)
    floor = samples.points[:, 2] == 0.0
    assert (truth[0, floor] == (samples.points[floor, 0] < 2)).all()


def test_a_sheet_that_passes_through_the_floor_hides_what_lies_below_it():
    # No edge of it is above the floor: only the cut at x = 2 bounds its shadow.
    slope = sheet([(-48, -50, 10), (52, -50, -10), (52, 50, -10), (-48, 50, 10)])
    samples, _, counter, _, _ = prepare(merge(FLOOR, slope), 1.0)
    floor = samples.points[:, 2] == 0.0
    dark = counter.masks(NOON)[0, floor] > 0
    np.testing.assert_array_equal(dark, samples.points[floor, 0] < 2)


def test_counters_of_two_pieces_share_the_silhouettes_of_the_same_suns(monkeypatch):
    scene = make_scene(*merge(FLOOR, box((-1, -1, 0), (1, 1, 3))))
    samples, seen = sample_surfaces(scene, 0.5), scene.triangles()
    caster = make_caster(seen.vertices, seen.faces)
    tree = make_face_tree(caster)
    suns = make_suns(np.random.default_rng(3), 3)
    found = []
    find = EdgeBinner._find
    monkeypatch.setattr(EdgeBinner, "_find", lambda *args: found.append(1) or find(*args))
    pieces = [slice(0, 500), slice(500, len(samples.points))]
    expected = find_hidden(tree, samples.points, samples.normals, suns)

    def count(room):
        binner = EdgeBinner(caster, room)
        found.clear()
        for piece in pieces:
            counter = PatchCounter(make_patches(samples.piece(piece), tree), binner, tree)
            np.testing.assert_array_equal(counter.masks(suns), expected[:, piece])
        times = len(found)
        binner.forget()
        counter.masks(suns)
        return times, len(found)

    assert count(1_000_000) == (1, 2)
    assert count(0) == (2, 3)
