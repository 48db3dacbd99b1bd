"""Pictures on OpenGL: as the CPU shades them, and what only they have."""

import numpy as np
import pytest
from support.bench import borrow
from support.shapes import box, city, merge

from umbra.cpu.frame import FrameCounter
from umbra.cpu.shade import shade
from umbra.errors import InputError
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.selection import VolumeOptions
from umbra.scene import (
    Camera,
    Image,
    Material,
    Mesh,
    Part,
    directional_light,
    make_image,
    make_scene,
    point_light,
    spot_light,
)

SIZE = (160, 120)
CAMERA = Camera((-30, -40, 45), (25, 25, 0), size=SIZE)
SLIDE = make_image(
    np.stack([*np.indices((64, 64)) * 4, np.full((64, 64), 90)], -1).astype(np.uint8)
)
LIGHTS = {
    "point": point_light((20, 22, 30), (1, 0.8, 0.6)),
    "sun": directional_light((0.3, -0.6, 0.8), (0.5, 0.6, 0.9)),
    "weakening": point_light((10, 5, 25), range=40.0, attenuation=(1.0, 0.02, 0.001)),
    "spot": spot_light((10, 10, 50), (20, 20, 0), 25, (0.2, 1, 0.3), inner_angle=12),
    "projector": spot_light((0, -10, 50), (20, 20, 0), 30, image=SLIDE),
}


@pytest.fixture(scope="module")
def town():
    return make_scene(*city(4, seed=5))


def render(device, scene, camera=CAMERA, lights=(), ground=0.0, **options):
    with SceneRenderer(scene, ground, device=device, **options) as renderer:
        return renderer.render(camera, list(lights))


def shade_on_cpu(scene, camera, lights, ground=0.0):
    counter = FrameCounter(scene, ground=ground)
    view, frame = counter.see(camera)
    counts = [counter.count(view, camera, light) for light in lights]
    lit = [frame.lit(count, light) for count, light in zip(counts, lights, strict=True)]
    return shade(scene, frame, lights, lit, view, counts)


def count_differences(one, two, tolerance=1):
    return int((np.abs(one.astype(int) - two).max(-1) > tolerance).sum())


@pytest.mark.parametrize("height", [None, 60.0])
@pytest.mark.parametrize("name", [*LIGHTS, "all"])
def test_the_picture_is_the_cpus(device, town, name, height):
    lights = list(LIGHTS.values()) if name == "all" else [LIGHTS[name]]
    camera = Camera(CAMERA.eye, CAMERA.target, size=SIZE, height=height)
    ours = render(device, town, camera, lights)
    # Pixels on an edge may see either side of it; there are 2,000 on edges here. Where a
    # projected picture is small, the device blends its texels and the CPU does not.
    tolerance = 5 if name == "projector" else 2
    assert count_differences(ours, shade_on_cpu(town, camera, lights), tolerance) <= 12


@pytest.mark.parametrize("name", LIGHTS)
def test_one_light_drawn_at_once_is_as_it_is_summed_up(device, town, name):
    pane = Part("pane", "", quad(-50.0, 0.01), material=Material(opacity=0.5))
    with_pane = make_scene([*town.parts, pane])  # below the ground, so only the way differs
    with SceneRenderer(town, 0.0, device=device) as renderer:
        ours = renderer.render(CAMERA, [LIGHTS[name]])
        assert "surface" not in vars(renderer.targets)  # nothing is stored to be lit later
    summed = render(device, with_pane, CAMERA, [LIGHTS[name]])
    # At an edge of what is seen, the copy of a projected picture is chosen otherwise.
    tolerance, most = (5, 3) if name == "projector" else (1, 0)
    assert count_differences(ours, summed, tolerance) <= most
    assert count_differences(ours, render(device, town), 8) > 500


def test_without_light_only_the_sky_and_the_ambient_are_left(device, town):
    assert count_differences(render(device, town), shade_on_cpu(town, CAMERA, [])) <= 2


def test_64_dim_lights_do_not_band(device, town):
    rng = np.random.default_rng(3)
    lights = [
        point_light(place, range=90.0) for place in rng.uniform((0, 0, 20), (48, 48, 40), (64, 3))
    ]
    exact = shade_on_cpu(town, CAMERA, lights)
    fine = render(device, town, CAMERA, lights)
    coarse = render(device, town, CAMERA, lights, accumulate="rgba8")
    # Each sum is rounded 64 times: in float16 by 1/4000, in 8 bits by 1/500 of white.
    assert count_differences(fine, exact, 2) == 0
    assert count_differences(coarse, exact, 2) > 300


def test_what_may_be_left_out_changes_no_pixel(device, town):
    lights = list(LIGHTS.values())
    plain = render(
        device,
        town,
        CAMERA,
        lights,
        choices=VolumeOptions(cull=False, cut=False, ask_triangles=False),
    )
    assert count_differences(render(device, town, CAMERA, lights), plain, 0) <= 2


def test_only_the_cone_of_a_spot_is_counted(device, town):
    random = np.random.default_rng(8)
    drawn = 0
    for number in range(24):
        place, target = random.uniform((-5, -5, 2), (45, 45, 60)), random.uniform(0, 40, 3)
        reach = random.choice([np.inf, 15.0, 60.0])
        spot = spot_light(place, target, random.choice([3, 15, 40, 80, 120]), range=reach)
        height = 40.0 if number % 4 == 0 else None
        eye = target + random.normal(0, 25, 3) + (0, 0, 20)
        camera = Camera(eye, random.uniform(0, 40, 3) * (1, 1, 0), size=(60, 45), height=height)
        with SceneRenderer(town, 0.0, device=device) as renderer:
            narrow = renderer.render(camera, [spot])
            drawn += renderer.statistics[0].shells - renderer.statistics[0].culled
        options = VolumeOptions(narrow=False, cull=False)
        plain = render(device, town, camera, [spot], choices=options)
        assert count_differences(narrow, plain, 0) <= 2
    assert 24 <= drawn < 24 * 16 / 2


def quad(z=0.0, size=40.0, **more):
    """Make a square that faces up, its picture's top toward +y."""
    corners = np.array([(0, 0, z), (size, 0, z), (size, size, z), (0, size, z)], float)
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], float)
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]], uv=uv, **more)


FROM_ABOVE = Camera((20, 20, 50), (20, 20, 0), (0, 1, 0), size=(40, 40), height=40.0)


def to_srgb(linear):
    return 255 * np.maximum(1.055 * np.asarray(linear) ** (1 / 2.4) - 0.055, 0)


def test_a_texture_lies_as_its_uv_say(device):
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[0, 0], pixels[0, 1], pixels[1, 0], pixels[1, 1] = (
        (250, 0, 0),
        (0, 250, 0),
        (0, 0, 250),
        90,
    )
    material = Material((1, 1, 1), make_image(pixels, wrap=("clamp", "clamp")), is_unlit=True)
    scene = make_scene([Part("floor", "", quad(), material=material)])
    rgb = render(device, scene, FROM_ABOVE, ground=None).astype(int)
    for place, expected in (((5, 5), pixels[0, 0]), ((5, 34), pixels[0, 1]),
                            ((34, 5), pixels[1, 0]), ((34, 34), pixels[1, 1])):  # fmt: skip
        assert np.abs(rgb[place] - expected.astype(int)).max() <= 2


def test_glow_needs_no_light_and_tints_multiply(device):
    glowing = Material((0.5, 0.5, 0.5), emission=(0.2, 0.0, 0.4), is_unlit=True)
    tinted = quad(colors=np.tile([1.0, 0.5, 0.0], (4, 1)))
    scene = make_scene([Part("floor", "", tinted, material=glowing)])
    rgb = render(device, scene, FROM_ABOVE, ground=None)[20, 20]
    assert np.abs(rgb - to_srgb([0.5 + 0.2, 0.25, 0.4])).max() <= 2


def test_glass_lets_through_what_lies_behind_and_masks_make_holes(device):
    red = Part("floor", "", quad(), material=Material((0.6, 0.0, 0.0), is_unlit=True))
    glass = Material((0.0, 0.0, 1.0), opacity=0.25, is_unlit=True)
    alpha = np.zeros((2, 2, 4), np.uint8)
    alpha[..., 1], alpha[:, 0, 3] = 255, 255
    mask = Material((1, 1, 1), make_image(alpha, wrap=("clamp", "clamp")), is_unlit=True,
                    alpha_mode="mask")  # fmt: skip
    clear = render(device, make_scene([red, Part("pane", "", quad(5.0), material=glass)]),
                   FROM_ABOVE, ground=None)[20, 20]  # fmt: skip
    assert np.abs(clear - to_srgb([0.45, 0, 0.25])).max() <= 2
    holed = render(device, make_scene([red, Part("leaf", "", quad(5.0), material=mask)]),
                   FROM_ABOVE, ground=None)  # fmt: skip
    assert holed[20, 5].tolist() == [0, 255, 0]
    assert np.abs(holed[20, 34] - to_srgb([0.6, 0, 0])).max() <= 2


def test_normals_make_a_flat_face_round(device):
    steep = np.tile([0.8, 0.0, 0.6], (4, 1))
    sun = directional_light((1, 0, 0))
    flat, round_ = (
        render(device, make_scene([Part("floor", "", quad(normals=normals))]), FROM_ABOVE, [sun],
               ground=None, casters=[])[20, 20].astype(int)
        for normals in (None, steep)
    )  # fmt: skip
    assert (round_ > flat + 60).all()


@pytest.mark.parametrize("turned", ["none", "all", "some"])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_normals_that_lean_inward_are_turned(device, turned, mirror):
    ball = borrow("scenes").make_spheres(1, 16)
    normals = ball.vertices.copy()
    normals[{"none": [], "all": slice(None), "some": slice(40, 90)}[turned]] *= -1
    place = np.diag([8.0 * mirror, 9.0, 10.0, 1.0])
    place[:3, 3] = (20, 20, 12)
    part = Part("ball", "", Mesh(ball.vertices, ball.faces, normals), place)
    scene = make_scene([part])
    lights = [LIGHTS["sun"]]
    with SceneRenderer(scene, 0.0, device=device) as renderer:
        ours = renderer.render(CAMERA, lights)
        sound = sum(batch.count for batch in renderer.surfaces.batches if batch.is_sound)
    total = len(ball.faces)
    assert sound == (total if (turned, mirror) == ("none", 1.0) else 0) or turned == "some"
    assert turned != "some" or mirror < 0 or 0 < sound < total
    if (
        turned != "some"
    ):  # where normals of a face disagree, which way they lean is a matter of bits
        assert count_differences(ours, shade_on_cpu(scene, CAMERA, lights), 2) <= 6


def test_instances_share_a_mesh_and_mirrors_are_lit_like_others(device):
    mesh = Mesh(*box((0, 0, 0), (6, 6, 12)))
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirror[:3, 3] = (30, 10, 0)
    turned = np.eye(4)
    turned[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    turned[:3, 3] = (20, 25, 0)
    scene = make_scene(
        [Part("a", "", mesh), Part("b", "", mesh, mirror), Part("c", "", mesh, turned)]
    )
    lights = [LIGHTS["point"], LIGHTS["sun"]]
    assert (
        count_differences(
            render(device, scene, CAMERA, lights), shade_on_cpu(scene, CAMERA, lights)
        )
        <= 8
    )


@pytest.mark.parametrize("name", ["image", "normal_image", "emission_image"])
def test_a_damaged_texture_is_named(device, name):
    def fail():
        msg = "texture 'wood.png' cannot be decoded; export it again"
        raise InputError(msg)

    material = Material(**{name: Image("wood.png", fail)})
    scene = make_scene([Part("floor", "", quad(), material=material)])
    before = set(device.live)
    with pytest.raises(InputError, match=r"wood\.png"):
        render(device, scene, FROM_ABOVE)
    assert device.live == before


def test_all_is_freed(device, town):
    before = set(device.live)
    render(device, make_scene(*merge(box((0, 0, 0), (2, 2, 2)))), CAMERA, LIGHTS.values())
    assert device.live == before


def moved_to(x, turn=0.0):
    transform = np.eye(4)
    transform[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    transform[:3, 3] = (x, 12, 0)
    return transform


def test_what_moves_is_drawn_and_casts_where_it_is(device):
    mesh, still = (
        Mesh(*box((-3, -3, 0), (3, 3, 14))),
        Part("hall", "", Mesh(*box((0, 0, 0), (9, 4, 6)))),
    )
    lights = [LIGHTS["point"], LIGHTS["sun"]]

    def at(x, turn):
        towers = (Part(str(n), "", mesh, moved_to(x + 12 * n, turn)) for n in range(2))
        return make_scene([still, *towers])

    with SceneRenderer(at(0, 0.0), 0.0, device=device) as renderer:
        before = renderer.render(CAMERA, lights)
        geometry = renderer.geometry
        for x, turn in ((6, 0.5), (15, 2.0)):
            renderer.move(at(x, turn))
            assert renderer.geometry is geometry
            after = renderer.render(CAMERA, lights)
            assert count_differences(after, render(device, at(x, turn), CAMERA, lights), 0) == 0
            assert count_differences(after, before, 20) > 300


def test_what_bends_casts_as_it_is_drawn(device):
    vertices, faces = box((10, 10, 0), (16, 16, 20))
    upright = make_scene([Part("mast", "", Mesh(vertices, faces))])
    bent = make_scene([Part("mast", "", Mesh(vertices + vertices[:, 2:] * (0.6, 0.3, 0), faces))])
    with SceneRenderer(upright, 0.0, device=device) as renderer:
        renderer.render(CAMERA, [LIGHTS["sun"]])
        renderer.move(bent)
        after = renderer.render(CAMERA, [LIGHTS["sun"]])
    assert count_differences(after, shade_on_cpu(bent, CAMERA, [LIGHTS["sun"]])) <= 6


def soup_of(vertices, faces):
    """Give every triangle corners of its own."""
    return vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


CRATE, CRATE_FACES = soup_of(*box((10, 10, 0), (16, 16, 12)))
IN_LID = (CRATE[CRATE_FACES][:, :, 2] == 12).all(1).repeat(3)
AJAR = CRATE + np.where(IN_LID[:, None], (0, 0, 0.5), 0)
POSES = {
    "bends": (CRATE, CRATE + CRATE[:, 2:] * (0.6, 0.3, 0), True),
    "turns inside out": (CRATE, CRATE * (-1, 1, 1) + (26, 0, 0), True),
    "a corner folds onto another": (
        CRATE, np.where((CRATE == (16, 16, 12)).all(1)[:, None], (10, 10, 12), CRATE), True,
    ),
    "the lid shuts": (AJAR, CRATE, True),
    "the lid lifts": (CRATE, AJAR, False),
    "faces lie in one another": (AJAR, AJAR - np.where(IN_LID[:, None], (0, 0, 6.5), 0), True),
}  # fmt: skip


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("name", ["sun", "point"])
def test_adjacency_is_kept_while_corners_stay_together(device, pose, name):
    before, after, is_kept = POSES[pose]
    first, posed = (
        make_scene([Part("crate", "", Mesh(vertices, CRATE_FACES))]) for vertices in (before, after)
    )
    with SceneRenderer(first, 0.0, device=device) as renderer:
        renderer.render(CAMERA, [LIGHTS[name]])
        (old,) = renderer.planner.bodies
        renderer.move(posed)
        ours = renderer.render(CAMERA, [LIGHTS[name]])
        (body,) = renderer.planner.bodies
    assert (body.caster.edges is old.caster.edges) == is_kept
    assert count_differences(ours, render(device, posed, CAMERA, [LIGHTS[name]]), 0) == 0
    assert count_differences(ours, shade_on_cpu(posed, CAMERA, [LIGHTS[name]]), 2) <= 6


def test_glass_weakens_the_light_and_a_mask_without_holes_takes_it(device):
    floor = Part("floor", "", quad(size=60.0))
    sun = directional_light((-1, 0, 1))
    pane = Mesh([(25, 25, 6), (35, 25, 6), (35, 35, 6), (25, 35, 6)], [[0, 1, 2], [0, 2, 3]])
    bare, half, none = (
        render(device, make_scene([floor, Part("pane", "", pane, material=material)]),
               FROM_ABOVE, [sun], ground=None, casters=casters)[10, 38].astype(int)
        for material, casters in ((Material(opacity=0.5), [0]), (Material(opacity=0.5), [0, 1]),
                                  (Material(alpha_mode="mask"), [0, 1]))
    )  # fmt: skip
    assert (bare > half + 20).all()
    assert (half > none + 10).all()


@pytest.mark.parametrize("rise", [14.0, 4.0, 1e-3, -1e-3, -14.0])
@pytest.mark.parametrize("side", [-2.0, 2.0])
@pytest.mark.parametrize("light", [directional_light((0.3, -0.4, 1)), point_light((1, -3, -8))])
def test_the_ground_is_seen_from_where_parallel_rays_come(device, rise, side, light):
    """An orthographic view has no place: its eye may lie above a ground that is seen from below."""
    scene = make_scene(*box((-2, -2, 1), (2, 2, 4)))
    camera = Camera((0, -10, side), (0, 0, side + rise), size=(48, 36), height=20)
    expected = shade_on_cpu(scene, camera, [light]).astype(int)
    differ = np.abs(render(device, scene, camera, [light]).astype(int) - expected).max(-1) > 3
    assert differ.sum() <= 2
