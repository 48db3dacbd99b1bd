"""Light through panes and leaves, by hand and by laws."""

import numpy as np
import pytest
from support.glass import BLUE, RED, GlassOracle, card, garden, leaf_image, level_card, pane

from umbra.rays.transmission import find_opaque, make_transmitters
from umbra.scene import Material, Mesh, Part, directional_light, make_scene, point_light
from umbra.scene.material import make_image

UP = directional_light((0, 0, 1))


def trace(parts, points, light=UP, casters=None):
    scene = make_scene(parts)
    left, hidden = make_transmitters(scene, casters).trace(
        np.array(points, float), light, scene.origin
    )
    return left, hidden


def sheet(material, z=1.0, **more):
    return Part("sheet", "", level_card(-1, -1, z, **more), material=material)


def test_each_surface_leaves_its_clear_share_times_its_tint():
    once = 0.7 * (1 - 0.3 * (1 - np.array(RED.color)))
    twice = once * 0.5 * (1 - 0.5 * (1 - np.array(BLUE.color)))
    left, hidden = trace(
        [sheet(RED), sheet(BLUE, 2.0)], [(0.3, 0.2, 0), (0.3, 0.2, 1.5), (3, 0, 0)]
    )
    blue = 0.5 * (1 - 0.5 * (1 - np.array(BLUE.color)))
    np.testing.assert_allclose(left, [twice, blue, (1, 1, 1)], rtol=1e-6)
    assert hidden.tolist() == [0, 0, 0]


def test_a_box_is_two_surfaces_however_it_is_wound():
    box = pane((-1, -1, 1), (1, 1, 2), BLUE)
    back = Part("back", "", Mesh(box.mesh.vertices, box.mesh.faces[:, ::-1]), material=BLUE)
    blue = 0.5 * (1 - 0.5 * (1 - np.array(BLUE.color)))
    points = [(0.3, 0.2, 0), (0.3, 0.2, 1.4), (0.3, 0.2, 2.5)]
    for part in (box, back):
        np.testing.assert_allclose(trace([part], points)[0], [blue**2, blue, [1] * 3], rtol=1e-6)


def test_what_is_opaque_hides_and_a_hole_does_not():
    pixels = np.full((1, 2, 4), 255, np.uint8)
    pixels[0, 0, 3] = 0
    image = make_image(pixels, wrap=("clamp", "clamp"))
    for mode in ("mask", "blend"):
        left, hidden = trace([sheet(Material(image=image, alpha_mode=mode))],
                             [(-0.8, 0.1, 0), (0.8, 0.1, 0)])  # fmt: skip
        np.testing.assert_array_equal(left, [[1] * 3, [0] * 3])
        assert hidden.tolist() == [0, 1]


def test_the_rim_of_a_hole_is_where_the_alpha_between_texels_meets_the_cutoff():
    pixels = np.full((1, 2, 4), 200, np.uint8)
    pixels[0, 0, 3] = 100
    material = Material(image=make_image(pixels, wrap=("clamp", "clamp")), alpha_mode="mask",
                        alpha_cutoff=125 / 255)  # fmt: skip
    # Texels lie at u = 1/4 and 3/4, so 125 lies at 3/8, which is x = -1/4 on a card of 2 m.
    _, hidden = trace([sheet(material)], [(-0.25 + d, 0.1, 0) for d in (-1e-9, 1e-9)])
    assert hidden.tolist() == [0, 1]


@pytest.mark.parametrize(
    "light", [UP, directional_light((0.125, -0.25, 1)), point_light((0.25, 0.125, 9))]
)
def test_triangles_that_share_edges_and_corners_are_crossed_once(light):
    # In eighths all is exact, so some rays meet edges and corners to the bit.
    i, j = (grid.ravel() for grid in np.mgrid[-4:5, -4:5])
    corners = np.stack([i / 4, j / 4, 1 + i * j % 3 / 4], 1)
    first = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    quads = np.stack([first, first + 1, first + 10, first + 9], 1)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    loose = Mesh(corners[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3))
    middles = (corners[faces] + np.roll(corners[faces], 1, 1)).reshape(-1, 3) / 2
    targets = np.concatenate([corners, middles])
    targets = targets[np.abs(targets[:, :2]).max(1) < 0.9]
    way = light.position[:3] - light.position[3] * targets
    for mesh in (Mesh(corners, faces), loose):
        part = Part("roof", "", mesh, material=Material((1, 1, 1), opacity=0.5))
        left, _ = trace([part], targets - way, light)
        np.testing.assert_array_equal(left, 0.5)


def test_a_triangle_is_not_crossed_from_its_own_plane_nor_by_a_lamp_in_it():
    parts = [sheet(RED)]
    for light in (UP, point_light((0.1, 0.2, 5)), point_light((0.1, 0.2, -5))):
        left, _ = trace(parts, [(0.3, 0.4, 1.0)], light)
        assert (left == 1).all()
    left, _ = trace(parts, [(0.3, 0.4, 0), (0.3, 0.4, 3)], point_light((0.1, 0.2, 1.0)))
    assert (left == 1).all()
    left, _ = trace(parts, [(0.3, 0.4, 0)], point_light((0.1, 0.2, 0.5)))
    assert (left == 1).all()  # a lamp below the sheet


def test_a_card_on_edge_to_the_light_leaves_it_all():
    upright = Part("card", "", card([(-1, 0, 0), (1, 0, 0), (1, 0, 2), (-1, 0, 2)]), material=RED)
    points = [(0.2, y, -1) for y in (-1e-3, 0.0, 1e-3)]
    assert (trace([upright], points)[0] == 1).all()


def test_trees_find_what_every_triangle_alone_gives():
    rng = np.random.default_rng(4)
    corners = rng.uniform(-3, 3, (120, 1, 3)) + rng.normal(0, 0.5, (120, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3), np.arange(360).reshape(-1, 3),
                uv=rng.uniform(-2, 2, (360, 2)))  # fmt: skip
    holed = Material((1, 1, 1), leaf_image(), alpha_mode="mask")
    parts = [Part("leaves", "", mesh, material=holed), sheet(RED, 4.0)]
    scene, points = make_scene(parts), rng.uniform(-4, 4, (3000, 3))
    oracle = GlassOracle(scene)
    for light in (directional_light((0.2, -0.3, 1)), point_light((1, 2, 6))):
        left, hidden = trace(parts, points, light)
        truth, shares = oracle.follow(points, light)
        np.testing.assert_allclose(left, shares, atol=1e-6)
        np.testing.assert_array_equal(hidden > 0, truth)
        assert hidden.max() >= 2


def test_only_casters_hide_and_faces_keep_their_numbers():
    scene = garden()
    found = make_transmitters(scene)
    assert sorted(found.faces.tolist()) == list(range(14, 14 + 24 + 6))
    names = [part.name for part in scene.parts]
    assert [names[k] for k in find_opaque(scene)] == ["floor", "house"]
    some = [k for k, name in enumerate(names) if name != "faded"]
    fewer = make_transmitters(scene, some)
    assert sorted(fewer.faces.tolist()) == sorted(found.faces.tolist())
    under = np.array([[-6.0, -6.0, 1.0]])
    for transmitters, is_hidden in ((found, True), (fewer, False)):
        left, _ = transmitters.trace(under, UP, scene.origin)
        assert (left < 1).all() == is_hidden
    assert make_transmitters(scene, find_opaque(scene)).trace(under, UP, scene.origin)[0].all()
    opaque = make_scene(scene.parts[:2])
    assert make_transmitters(opaque) is find_opaque(opaque) is None
    assert find_opaque(opaque, [1]) == [1]
