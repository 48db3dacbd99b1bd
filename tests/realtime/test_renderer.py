"""Pictures of a scene that lives, against float64 rays and fresh renderers."""

import numpy as np
import pytest
from support.named_edits import compare_by_name
from support.own_engine import cast_sure, frustum, look_at, ortho, to_depth
from support.shapes import box, sheet

from umbra.cpu.shade import compress, encode_srgb
from umbra.errors import InputError
from umbra.realtime import Renderer
from umbra.scene import Camera, Material, Mesh, Part, directional_light, make_scene, point_light

SIZE = 40, 30
SUN, LAMP = directional_light((-8, 1, 6)), point_light((3, -5, 12))
CAMERA = Camera((24, -30, 18), (0, 0, 3), size=SIZE)
VIEW = look_at((24, -30, 18), (0, 0, 3))
VIEWS = {
    "off-axis": (VIEW, frustum(-0.1, 0.7, -0.5, 0.1, 0.5, 200.0)),
    "stretched": (VIEW, frustum(-0.2, 0.2, -0.4, 0.4, 0.5, np.inf)),
    "flipped": (VIEW, np.diag([1, -1, 1, 1.0]) @ frustum(-0.1, 0.7, -0.5, 0.1, 0.5, 200.0)),
    "parallel": (VIEW, ortho(-18, 14, -10, 14, -20.0, 120.0)),
}
DEPTHS = "minus-one-to-one", "zero-to-one", "reversed"


def make_yard(**material):
    floor = Mesh(*sheet([(-40, -40, 0), (40, -40, 0), (40, 40, 0), (-40, 40, 0)]))
    return make_scene(
        [
            Part("house", "", Mesh(*box((-5, -4, 0), (5, 4, 8))), material=Material(**material)),
            Part("crate", "", Mesh(*box((6, -9, 0), (9, -7, 3))), np.eye(4)),
            Part("floor", "", floor),
        ]
    )


def list_triangles(scene):
    soup = scene.triangles()
    return soup.vertices[soup.faces] + scene.origin, soup.part


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("depth", DEPTHS)
def test_a_callers_frame_holds_the_scene_by_depth(make_engine, context, name, depth):
    scene = make_yard()
    view, projection = VIEWS[name][0], to_depth(VIEWS[name][1], depth)
    wall = np.array([[(2, -13, 0), (13, -5, 0), (13, -5, 7)]], float)  # the caller's, before it
    engine = make_engine(make_scene(wall[0], [[0, 1, 2]]))
    frame = engine.make_framebuffer((90, 70))
    box_ = 33, 21, *SIZE
    engine.draw(frame, projection @ view, depth, box_)
    with Renderer(scene, context) as renderer:
        renderer.draw_into(frame, view, projection, [SUN], box_, depth=depth)
        pixels = np.frombuffer(frame.read(components=4), np.uint8).reshape(70, 90, 4)[::-1]
        assert (pixels[:19, :, :3] == 0).all()
        drawn = pixels[70 - 21 - 30 : 70 - 21, 33:73]
        triangles, part = list_triangles(scene)
        both = np.concatenate([triangles, wall])
        light = np.array(SUN.position, float)
        face, _, _, _ = cast_sure(both, projection @ view, SIZE, light, depth)
        own, at, count, sure = cast_sure(triangles, projection @ view, SIZE, light, depth)
        picture = renderer.read()
        for y, x in np.argwhere(sure & (face >= 0)):
            if face[y, x] == len(triangles):
                assert drawn[y, x, :3].tolist() == [51, 102, 153]
            else:
                assert drawn[y, x].tolist() == picture[y, x].tolist()
        assert (face[sure] == len(triangles)).sum() > 5
        floor = sure & (own >= 0) & (part[own] == 2)
        shown = picture[..., :3].astype(int).sum(-1)
        assert shown[floor & (count > 0)].max() < shown[floor & (count == 0)].min()
        assert (floor & (count > 0)).sum() > 10
        for y, x in np.argwhere(sure)[::23]:
            found = renderer.pick(x, y)
            if own[y, x] < 0:
                assert found is None
                continue
            assert found.name == scene.parts[part[own[y, x]]].name
            np.testing.assert_allclose(found.position, at[y, x], atol=1e-6)
            corners = triangles[own[y, x]]
            normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            np.testing.assert_allclose(found.normal, normal / np.linalg.norm(normal), atol=1e-9)


def test_the_texture_and_the_read_back_are_the_same(context):
    with Renderer(make_yard(), context, ground=-1.0) as renderer:
        assert renderer.read().shape == (0, 0, 4)
        for samples in (1, 4):
            texture = renderer.draw(CAMERA, SUN, samples=samples)
            found = np.frombuffer(texture.read(), np.uint8).reshape(*SIZE[::-1], 4)[::-1]
            np.testing.assert_array_equal(found, renderer.read())
            assert (found[..., 3] == 255).all()


def test_released_twice_is_released(context):
    with Renderer(make_yard(), context) as renderer:
        renderer.draw(CAMERA, [SUN])
        renderer.release()
    texture = context.texture((2, 2), 1)  # the context is still the caller's
    texture.release()


def test_a_context_of_its_own_lets_its_textures_be_read():
    with Renderer(make_yard()) as renderer:
        texture = renderer.draw(CAMERA, [SUN])
        found = np.frombuffer(texture.read(), np.uint8).reshape(*SIZE[::-1], 4)[::-1]
        np.testing.assert_array_equal(found, renderer.read())
        assert texture.size == SIZE
        assert len(np.unique(found.reshape(-1, 4), axis=0)) > 5


TURN = np.array([[0, -1, 0, 9], [1, 0, 0, -6], [0, 0, 1, 1], [0, 0, 0, 1]], float)
EDITS = [
    ("move", "crate", TURN),
    ("move", "house", TURN @ TURN),
    ("add", Part("tower", "", Mesh(*box((8, 6, 0), (10, 9, 14))))),
    (
        "replace",
        "crate",
        Part(
            "post",
            "",
            Mesh(*box((-9, -7, 0), (-8, -6, 9))),
            material=Material(metallic=0.9, roughness=0.2),
        ),
    ),
    (
        "replace",
        "tower",
        Part("lamp", "", Mesh(*box((8, 6, 0), (9, 9, 4))), material=Material(emission=(3, 2, 1))),
    ),
    (
        "replace",
        "lamp",
        Part(
            "pane",
            "",
            Mesh(*sheet([(8, 6, 0), (8, 9, 0), (8, 9, 4), (8, 6, 4)])),
            material=Material(opacity=0.4),
        ),
    ),
    ("remove", "post"),
]


@pytest.mark.parametrize("lights", [[SUN], [SUN, LAMP]], ids=["one", "two"])
def test_after_edits_no_pixel_differs_from_a_fresh_renderer(context, lights):
    with Renderer(make_yard(), context, ground=-0.5) as kept:
        kept.draw(CAMERA, lights)
        for edit, *given in EDITS:
            getattr(kept, edit)(*given)
            kept.draw(CAMERA, lights)
            with Renderer(kept.scene, context, ground=-0.5) as fresh:
                fresh.draw(CAMERA, lights)
                np.testing.assert_array_equal(
                    kept.read(), fresh.read(), err_msg=str((edit, given[0]))
                )
                for x, y in ((20, 15), (5, 25), (30, 10)):
                    one, other = kept.pick(x, y), fresh.pick(x, y)
                    assert (one and one.name) == (other and other.name)


@pytest.mark.parametrize("seed", [1001, 2023])
def test_after_random_edits_by_name_no_pixel_differs_either(context, seed):
    for done, how, differ in compare_by_name(context, seed, 12):
        assert differ == 0, (done, how)


def test_a_moved_part_of_a_far_scene_stands_where_the_matrix_says(context):
    far = np.array([85_000.0, 447_000.0, 12.0])
    vertices, faces = box((-5, -4, 0), (5, 4, 8))
    scene = make_scene([Part("house", "", Mesh(vertices + far, faces))])
    assert scene.origin.any()
    by = np.eye(4)
    by[:3, 3] = 0.0, 0.0, 5.0
    with Renderer(scene, context) as renderer:
        for _ in range(2):  # a matrix says where, not by how much
            renderer.move("house", by)
            np.testing.assert_allclose(renderer.scene.bounds(), far + [[-5, -4, 5], [5, 4, 13]])
        renderer.add(Part("crate", "", Mesh(vertices + far + (20, 0, 0), faces)))
        np.testing.assert_allclose(renderer.scene.bounds()[1], far + [25, 4, 13])


def test_pixels_outside_and_wrong_arguments_are_refused(context):
    with Renderer(make_yard(), context) as renderer:
        with pytest.raises(InputError):
            renderer.pick(0, 0)
        renderer.draw(CAMERA, [SUN])
        for x, y in ((-1, 0), (SIZE[0], 0), (0, SIZE[1])):
            with pytest.raises(InputError):
                renderer.pick(x, y)
        for option, given in (
            ("camera", ("here", [SUN])),
            ("lights", (CAMERA, ["sun"])),
            ("samples", (CAMERA, [SUN], 0)),
        ):
            with pytest.raises(InputError) as found:
                renderer.draw(*given)
            assert found.value.option == option
    for option, given in (("context", (make_yard(), "mine")), ("scene", ("yard", context))):
        with pytest.raises(InputError) as found:
            Renderer(*given)
        assert found.value.option == option


def test_light_itself_is_linear_and_what_the_picture_shows():
    """Eight times the lamp is eight times the light; compressed it is the picture."""
    camera = Camera((24, -30, 18), (0, 0, 3), size=SIZE)
    with Renderer(make_yard(), ground=None) as renderer:

        def find_light(*lights):
            texture = renderer.draw(camera, lights, hdr=True)
            read = renderer.read()
            held = np.frombuffer(texture.read(), np.float16).reshape(*SIZE[::-1], 4)[::-1]
            assert texture.dtype == "f2"
            np.testing.assert_array_equal(read, held)
            return read

        dark = find_light()
        once, much = (find_light(directional_light((-8, 1, 6), color=[k] * 3)) for k in (1, 8))
        added = once[..., :3] - dark[..., :3]
        assert added.max() > 0.3
        np.testing.assert_allclose(much[..., :3] - dark[..., :3], 8 * added, atol=0.02, rtol=2e-3)
        assert much.max() > 2
        is_there = once[..., 3] == 1
        assert set(np.unique(once[..., 3])) == {0, 1}
        renderer.draw(camera, [SUN])
        shown = renderer.read()
        assert shown.dtype == np.uint8
        again = encode_srgb(compress(once[..., :3])).astype(int)
        assert np.abs(shown[..., :3].astype(int) - again)[is_there].max() < 1.5
        with pytest.raises(InputError, match="one sample"):
            renderer.draw(camera, [SUN], 4, hdr=True)
