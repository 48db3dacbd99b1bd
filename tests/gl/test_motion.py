"""What moves and what bends: as if it were made anew, but nothing is compiled or uploaded again."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import box, torus_knot

from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.sides import make_shell_sides
from umbra.scene import (
    Camera,
    Material,
    Mesh,
    Part,
    directional_light,
    make_image,
    make_scene,
    point_light,
)

CAMERA = Camera((-30, -40, 45), (15, 15, 3), size=(96, 72))
SUN = directional_light((0.3, -0.6, 0.8))
LAMP = point_light((20, 4, 30))


def render(device, scene, lights, camera=CAMERA):
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        return renderer.render(camera, lights)


def count_differences(one, two):
    return int((one != two).any(-1).sum())


def place(x, y, z, turn):
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.eye(4)
    matrix[:2, :2] = [[c, -s], [s, c]]
    matrix[:3, 3] = x, y, z
    return matrix


@pytest.fixture(scope="module")
def still():
    """Make two instances of a knot, each with normals, and a crate that shows an image."""
    vertices, faces = torus_knot(40, 8)
    normals = (vertices / np.linalg.norm(vertices, axis=1)[:, None]).astype(np.float32)
    knot = Mesh(vertices, faces, normals)
    pixels = np.random.default_rng(2).integers(0, 255, (8, 8, 3)).astype(np.uint8)
    corners, sides = box((24, 2, 0), (31, 9, 8))
    crate = Mesh(corners, sides, uv=np.zeros((len(corners), 2), np.float32) + corners[:, :2])
    parts = [Part(f"{k}", "", knot, place(10 + 12 * k, 12, 7, k)) for k in range(2)]
    return make_scene(
        [*parts, Part("crate", "", crate, material=Material(image=make_image(pixels)))]
    )


def pose(scene, frame):
    """Bend both instances alike, turn one of them, and lean the crate."""
    knot, crate = scene.parts[0].mesh, scene.parts[2]
    bent = knot.vertices + np.sin(knot.vertices[:, 2:] / 2 + frame) * (0.8, 0.3, 0) * frame
    mesh = replace(knot, vertices=bent, normals=np.roll(knot.normals, 1, 1))
    leant = crate.mesh.vertices + crate.mesh.vertices[:, 2:] * (0.1 * frame, 0, 0)
    return replace(
        scene,
        parts=(
            replace(scene.parts[0], mesh=mesh),
            replace(scene.parts[1], mesh=mesh, transform=place(22, 12, 7, frame)),
            replace(crate, mesh=replace(crate.mesh, vertices=leant)),
        ),
    )


@pytest.mark.parametrize("lights", [[SUN], [LAMP], [SUN, LAMP]], ids=["sun", "lamp", "both"])
def test_what_bends_compiles_and_uploads_nothing_anew(device, still, lights):
    with SceneRenderer(still, 0.0, device=device) as renderer:
        renderer.render(CAMERA, lights)
        renderer.move(pose(still, 0.1))  # now some faces have normals that lean back
        renderer.render(CAMERA, lights)
        held, bodies = set(device.live), list(renderer.planner.bodies)
        for frame in (0.6, 1.2, 0.0):
            posed = pose(still, frame)
            renderer.move(posed)
            ours = renderer.render(CAMERA, lights)
            assert count_differences(ours, render(device, posed, lights)) == 0
        assert set(device.live) == held
        assert all(a is b for a, b in zip(renderer.planner.bodies, bodies, strict=True))


def list_batches(renderer):
    return [(b.first, b.count, b.has, b.is_solid, b.is_sound) for b in renderer.surfaces.batches]


def test_what_bends_is_batched_as_if_made_anew(device, still):
    """A pixel that asks for its side by differences sees another one now and then."""
    with SceneRenderer(still, 0.0, device=device) as kept:
        for frame in (0.6, 1.2, 0.0):
            posed = pose(still, frame)
            kept.move(posed)
            with SceneRenderer(posed, 0.0, device=device) as fresh:
                ours, anew = list_batches(kept), list_batches(fresh)
            assert ours == anew
            assert any(is_sound for *_, is_sound in ours)


def test_parts_that_no_longer_share_a_mesh_are_made_anew(device, still):
    posed = pose(still, 0.7)
    apart = replace(posed, parts=(still.parts[0], *posed.parts[1:]))
    with SceneRenderer(still, 0.0, device=device) as renderer:
        renderer.render(CAMERA, [SUN])
        renderer.move(apart)
        ours = renderer.render(CAMERA, [SUN])
    assert count_differences(ours, render(device, apart, [SUN])) == 0


def test_a_mesh_that_turns_inside_out_shows_its_other_side(device):
    vertices, faces = box((10, 10, 0), (16, 16, 12))
    first = make_scene([Part("crate", "", Mesh(vertices, faces))])
    mirrored = replace(first.parts[0].mesh, vertices=vertices * (-1, 1, 1) + (26, 0, 0))
    turned = replace(first, parts=(replace(first.parts[0], mesh=mirrored),))
    near = Camera((13, -20, 40), (13, 13, 6), size=CAMERA.size)
    with SceneRenderer(first, 0.0, device=device) as renderer:
        renderer.render(near, [SUN])
        renderer.move(turned)
        ours = renderer.render(near, [SUN])
        assert renderer.planner.bodies[0].is_inward.all()
    assert count_differences(ours, render(device, turned, [SUN], near)) == 0


def test_what_is_kept_of_moving_instances_does_not_grow(device, still):
    _, second, _ = still.parts
    kept = []
    with SceneRenderer(still, 0.0, device=device) as renderer:
        for frame in range(6):
            turn = np.eye(4)
            turn[:2, :2] = [[np.cos(frame), -np.sin(frame)], [np.sin(frame), np.cos(frame)]]
            moved = replace(second, transform=second.transform @ turn)
            parts = still.parts[0], moved, still.parts[2]
            renderer.move(replace(still, parts=parts))
            renderer.render(CAMERA, [SUN])
            volumes = renderer.plans[0].volumes
            nothing = [np.zeros(len(each.shells), bool) for each in volumes]
            sides = [each.find(none).sides for each, none in zip(volumes, nothing, strict=True)]
            kept.append(sum(map(len, sides)))
    assert 0 < max(kept[1:]) < 2 * kept[0]


@pytest.mark.parametrize("light", [SUN, LAMP])
def test_instances_that_keep_their_place_under_the_light_keep_their_sides(
    device, still, light, monkeypatch
):
    found = []
    original = make_shell_sides

    def spy(volumes, wanted):
        found.append(int(wanted.sum()))
        return original(volumes, wanted)

    monkeypatch.setattr("umbra.gl.volumes.make_shell_sides", spy)
    shift = np.eye(4)
    shift[0, 3] = 1.5
    first, second, crate = still.parts
    moved = replace(second, transform=shift @ second.transform)
    later = replace(still, parts=(first, moved, crate))
    with SceneRenderer(still, 0.0, device=device) as renderer:
        renderer.render(CAMERA, [light])
        found.clear()
        renderer.move(later)
        ours = renderer.render(CAMERA, [light])
    # A shift changes where a lamp stands in the instance's frame, but not where the sun does.
    assert sum(found) == (0 if light is SUN else 1)
    assert count_differences(ours, render(device, later, [light])) == 0
