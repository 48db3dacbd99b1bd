"""A surface through the feet: level under buildings, exact at feet, as any terrain elsewhere."""

import numpy as np
import pytest
from support.model_files import DATA
from support.shapes import box

import umbra
from umbra.calls.ground import choose_ground, stand_scene
from umbra.calls.picture_options import RenderOptions, ViewOptions
from umbra.calls.styles import STYLES
from umbra.errors import InputError
from umbra.ground.choice import find_ground
from umbra.ground.level import measure_bases
from umbra.ground.surface import make_surface
from umbra.rays.hidden import find_hidden
from umbra.receivers.standing import find_crossings
from umbra.scene import Mesh, Part
from umbra.scene.mesh import ADDED_GROUND, ASSUMED, ASSUMED_UNDER

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
VIENNA = DATA / "vienna_lod2.city.jsonl"


def house(name, low, high):
    vertices, faces = box(low, high)
    return Part(name, "Building", Mesh(np.asarray(vertices, float), np.asarray(faces, np.int32)))


def make(*boxes):
    return umbra.make_scene([house(f"house {k}", *one) for k, one in enumerate(boxes)])


def on_slope(n=4, rise=0.2, side=10.0, away=20.0):
    """Make n x n houses whose feet lie on steps of a slope along x."""
    boxes = []
    for i in range(n):
        for j in range(n):
            x, y = i * away, j * away
            z = rise * x
            boxes.append(((x, y, z), (x + side, y + side, z + 9.0)))
    return make(*boxes), np.array(boxes)


def heights_at(scene, x, y):
    """Return the heights at which a vertical line meets the ground that was added."""
    parts = [k for k, part in enumerate(scene.parts) if part.kind in ADDED_GROUND]
    soup = scene.triangles(parts)
    _, z, _ = find_crossings(soup, x - scene.origin[0], y - scene.origin[1])
    return z + scene.origin[2]


def test_the_feet_are_corners_of_it_to_the_last_bit():
    scene, boxes = on_slope()
    ground = find_ground(scene)
    assert ground.surface.buildings == len(boxes)
    corners = {tuple(v) for v in ground.surface.vertices.tolist()}
    for low, high in boxes:
        for x in (low[0], high[0]):
            for y in (low[1], high[1]):
                assert (x, y, low[2]) in corners


def test_it_is_level_under_each_building():
    scene, boxes = on_slope()
    settled = find_ground(scene).scene
    rng = np.random.default_rng(3)
    for low, high in boxes:
        for _ in range(5):
            x, y = rng.uniform(low[:2] + 0.01, high[:2] - 0.01)
            assert heights_at(settled, x, y) == pytest.approx([low[2]], abs=1e-9)


def test_between_two_houses_it_is_the_plane_through_their_edges():
    scene = make(((0, 0, 0), (10, 40, 8)), ((30, 0, 5), (40, 40, 13)))
    settled = find_ground(scene).scene
    for x, y in ((12.0, 20.0), (20.0, 11.0), (28.0, 31.0)):
        assert heights_at(settled, x, y) == pytest.approx([(x - 10) / 20 * 5], abs=1e-9)


def test_every_place_has_one_height():
    settled = find_ground(on_slope()[0]).scene
    for x, y in np.random.default_rng(1).uniform(-40.01, 120.02, (200, 2)):
        assert len(heights_at(settled, x, y)) == 1


@pytest.mark.parametrize(("apart", "is_surface"), [(2.9, False), (3.1, True)])
def test_feet_that_differ_by_more_than_a_storey_decide(apart, is_surface):
    scene = make(((0, 0, 0), (10, 10, 8)), ((30, 0, apart), (40, 10, 13)))
    ground = find_ground(scene)
    assert (ground.surface is not None) is is_surface
    assert ground.is_plane is not is_surface
    assert find_ground(scene, "feet").surface is not None
    assert find_ground(scene, "level").is_plane
    assert find_ground(scene, 1.5).level == 1.5


def test_what_stands_on_a_building_has_no_foot():
    boxes = (((0, 0, 0), (10, 10, 8)), ((30, 0, 4), (40, 10, 13)), ((3, 3, 8), (6, 6, 12)))
    ground = find_ground(make(*boxes))
    assert ground.surface.buildings == 2
    assert ground.surface.vertices[:, 2].max() == pytest.approx(4, abs=1e-9)


def test_terraced_houses_step_at_their_party_wall():
    scene = make(((0, 0, 0), (10, 10, 9)), ((10, 0, 4), (20, 10, 13)))
    settled = find_ground(scene, "feet").scene
    assert heights_at(settled, 5.0, 5.1).tolist() == [0.0]
    assert heights_at(settled, 15.0, 5.1).tolist() == [4.0]


@pytest.mark.parametrize(
    "boxes",
    [
        [((0, 0, 0), (10, 10, 8))],
        [((k * 20.0, 0, k * 2.0), (k * 20.0 + 10, 10, k * 2.0 + 8)) for k in range(6)],
        [((0, 0, 0), (10, 10, 8))] * 3 + [((30, 0, 5), (40, 10, 13))],
        [((0, 0, 0), (10, 10, 8)), ((5, 5, 4), (15, 15, 13)), ((30, 0, 9), (40, 10, 20))],
        [((0, 0, 0), (10, 10, 8)), ((10.0005, 0, 5), (20, 10, 13))],
    ],
    ids=["one", "in line", "duplicate", "overlapping", "a gap of half a millimetre"],
)
def test_odd_feet_make_a_surface(boxes):
    scene = make(*boxes)
    ground = find_ground(scene, "feet")
    assert np.isfinite(ground.surface.vertices).all()
    study = umbra.shadow_study(scene, SITE, date="2026-03-21", ground="feet", size=(30, 30))
    assert np.isfinite(study.shadow_hours.values).any()


def test_a_sloping_base_is_taken_as_it_is():
    vertices, faces = (np.array(v) for v in box((0, 0, 0), (20, 10, 12)))
    vertices = vertices.astype(float)
    bottom = vertices[:, 2] == 0
    vertices[bottom, 2] = 0.3 * vertices[bottom, 0]
    one = Part("tilted", "Building", Mesh(vertices, faces.astype(np.int32)))
    scene = umbra.make_scene([one, house("other", (60, 0, 9), (70, 10, 18))])
    settled = find_ground(scene).scene
    assert heights_at(settled, 7.0, 5.1) == pytest.approx([2.1], abs=1e-9)


def test_walls_without_floors_stand_on_their_hull():
    vertices, faces = (np.array(v) for v in box((0, 0, 0), (10, 10, 8)))
    normal = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    one = Part("open", "Walls", Mesh(vertices.astype(float), faces[normal[:, 2] >= 0].astype("i4")))
    scene = umbra.make_scene([one, house("other", (30, 0, 4), (40, 10, 13))])
    settled = find_ground(scene).scene
    assert heights_at(settled, 5.0, 4.9).tolist() == [0.0]


@pytest.mark.parametrize(("kind", "thick"), [("Bridge", 5), ("", 1)])
def test_a_bridge_has_no_foot(kind, thick):
    deck = house("deck", (12, 0, 40), (28, 4, 40 + thick))
    bridge = Part("deck", kind, deck.mesh)
    houses = [house("a", (0, 0, 0), (10, 10, 8)), house("b", (30, 0, 4), (40, 10, 13))]
    ground = find_ground(umbra.make_scene([*houses, bridge]))
    assert ground.surface.buildings == 2


def test_shadows_on_it_are_those_of_rays():
    scene, _ = on_slope()
    study = umbra.shadow_study(
        scene, SITE, date="2026-03-21", every="1h", receivers="ground", cell=1.0, masks=True
    )
    laid = study.result.laid
    tile = laid.casting.make_tile(laid.grid)
    suns = study.result.period.sun.direction
    places = tile.places
    rays = find_hidden(tile.tree, places.points, places.normals, suns).reshape(-1, *tile.shape)
    masks = study.dataset.in_shadow.values
    there = ~np.isnan(study.shadow_hours.values)
    wrong = (masks != rays) & there
    assert wrong.sum() <= 2e-4 * wrong.size
    assert 0 < there.mean() < 1


def test_cells_under_a_roof_that_juts_out_receive():
    boxes = (((0, 0, 0), (10, 10, 8)), ((-5, -5, 8), (15, 15, 9)), ((40, 0, 5), (50, 10, 13)))
    study = umbra.shadow_study(make(*boxes), SITE, date="2026-06-21", cell=1.0)
    hours = study.shadow_hours.sel(x=-4.5, y=5.0, method="nearest").item()
    assert 0 < hours < 8
    assert np.isnan(study.shadow_hours.sel(x=5.0, y=5.0, method="nearest").item())


def test_a_study_a_picture_and_a_page_stand_on_one_ground():
    scene, _ = on_slope()
    known = find_ground(scene)
    told = []
    drawn, plane = choose_ground(scene, RenderOptions(), STYLES["architectural"], told.append)
    seen, height = stand_scene(ViewOptions(), scene)
    study = umbra.shadow_study(scene, SITE, date="2026-03-21", cell=2.0)
    assert drawn is seen is known.scene is study.result.model.scene
    assert plane is None
    assert height is None
    assert study.dataset.attrs["ground"] == known.name
    assert "through the feet of 16 buildings" in told[0]
    assert study.dataset.attrs["ground_feet"] == 16
    assert [part.kind for part in known.scene.parts[-2:]] == [ASSUMED, ASSUMED_UNDER]


def test_level_ground_is_one_for_all_too():
    scene = make(((0, 0, 0), (10, 10, 8)), ((30, 0, 2), (50, 10, 13)))
    _, height = stand_scene(ViewOptions(), scene)
    for receivers in ("ground", "top", "south"):
        study = umbra.shadow_study(scene, SITE, date="2026-03-21", receivers=receivers, cell=2.0)
        assert study.dataset.attrs["ground_z"] == height == 2.0


def test_its_bounds_do_not_count_as_the_models():
    scene, _ = on_slope()
    settled = find_ground(scene).scene
    np.testing.assert_array_equal(settled.model_bounds(), scene.bounds())
    assert (np.ptp(settled.bounds(), axis=0)[:2] > 2 * np.ptp(scene.bounds(), axis=0)[:2]).all()


@pytest.mark.parametrize("ground", ["", True, [1], float("nan"), "no such file.tif"])
def test_other_grounds_are_refused(ground):
    with pytest.raises(InputError):
        umbra.shadow_study(on_slope()[0], SITE, date="2026-03-21", ground=ground)


def test_a_mesh_of_the_land_is_a_ground(tmp_path):
    land = tmp_path / "land.obj"
    land.write_text(
        "v -100 -100 -20\nv 200 -100 40\nv 200 200 40\nv -100 200 -20\nf 1 2 3 4\n", "utf-8"
    )
    scene, _ = on_slope()
    study = umbra.shadow_study(scene, SITE, date="2026-03-21", ground=land, cell=2.0)
    assert study.dataset.attrs["ground"] == "ground of land.obj"
    assert study.receiver_z.sel(x=15, y=15, method="nearest").item() == pytest.approx(3, abs=0.3)
    far = make(((9e4, 0, 0), (9e4 + 9, 9, 9)))
    with pytest.raises(InputError, match="from the model"):
        umbra.shadow_study(far, SITE, date="2026-03-21", ground=land)


@pytest.mark.skipif(not VIENNA.exists(), reason=f"{VIENNA.name} is not here")
def test_viennas_feet_lie_on_it():
    scene = umbra.read(VIENNA)
    surface = make_surface(measure_bases(scene).feet, scene.bounds())
    corners = {tuple(v) for v in surface.vertices.tolist()}
    feet = {tuple(v) for v in measure_bases(scene).feet.corners.reshape(-1, 3).tolist()}
    # The others are corners of bases that overlap lower ones.
    assert surface.buildings == 490
    assert len(feet - corners) < 0.02 * len(feet)


def find_longest_blade(ground):
    """Return the length of the longest triangle between buildings that stands steeper than 1:1."""
    surface = ground.surface
    corners = surface.vertices[surface.faces[~surface.is_under]]
    sides = np.roll(corners, -1, 1) - corners
    normal = np.cross(sides[:, 0], sides[:, 1])
    is_up = normal[:, 2] > 1e-9
    is_steep = np.hypot(normal[:, 0], normal[:, 1]) > normal[:, 2]
    length = np.linalg.norm(sides[..., :2], axis=2).max(1)
    return length[is_up & is_steep].max(initial=0.0)


def test_no_blade_of_ground_runs_from_near_feet_to_the_next_building():
    near = [((0, 0, 0), (10, 10, 9)), ((10.1, 0, 4), (20, 10, 13))]
    scene = make(*near, ((0, 90, 0), (20, 99, 9)), ((0, -99, 4), (20, -90, 9)))
    ground = find_ground(scene, "feet")
    assert find_longest_blade(ground) < 12
    corners = {tuple(v) for v in ground.surface.vertices.tolist()}
    for low, high in near:
        assert {(x, y, low[2]) for x in (low[0], high[0]) for y in (0, 10)} <= corners
    for x, y in np.random.default_rng(1).uniform(-20.01, 30.02, (99, 2)):
        assert len(heights_at(ground.scene, x, y)) == 1


@pytest.mark.parametrize(
    ("heights", "has_cellar"),
    [((5, 0, 5), True), ((5, 0, 2), False), ((5, 0, -5), False), ((0, -2.9, 0), False)],
)
def test_a_building_far_below_neighbours_on_both_sides_has_a_cellar(heights, has_cellar):
    scene = make(*(((12.0 * k, 0, z), (12.0 * k + 8, 10, 20)) for k, z in enumerate(heights)))
    surface = find_ground(scene, "feet").surface
    assert surface.buildings == 3 - has_cellar
    assert (surface.vertices[:, 2].min() > heights[1] + 3) == has_cellar


def test_a_model_without_feet_has_a_level_ground():
    ground = find_ground(make(((0, 0, 0), (1, 1, 1))))
    assert ground.is_plane
    with pytest.raises(InputError):
        find_ground(make(((0, 0, 0), (1, 1, 1))), "feet")
