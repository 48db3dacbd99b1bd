"""Masks without a stencil: right inside their domains, wrong just outside them."""

import numpy as np
import pytest
from support.gl_judge import Judge
from support.judge import Verdicts
from support.model_files import save_obj
from support.shapes import HOUSE, SCENES, aligned_boxes, box, city, staircase
from support.sweeps import sample_pairs

from umbra.cli import main
from umbra.gl.bodies import make_bodies
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.geometry import Geometry
from umbra.gl.masks import MASKS, PRINTED
from umbra.gl.masks.counter import MaskCounter, find_limit
from umbra.gl.scene_renderer import SceneRenderer
from umbra.scene import Camera, directional_light, make_scene, point_light

SIZE = (48, 40)
CAMERAS = {
    "outside": Camera((20, -25, 14), (0, 0, 3), size=SIZE),
    "inside": Camera((0.3, 0.2, 3), (10, 3, 0), size=SIZE),
    "straight down": Camera((0.2, 0.1, 30), (0.2, 0.1, 0), up=(0, 1, 0), size=SIZE, height=24.0),
}
LIGHTS = {
    "lamp": point_light((8, -3.3, 20)),
    "lamp inside": point_light((0.13, 0.31, 3.3)),
    "sun": directional_light((0.4, 0.3, 0.7)),
    "lamp below": point_light((30, 3.2, -4)),
}


class BesideStencil:
    """
    Counts of the stencil, but where a mask says otherwise its answer, 0 or not 0.

    So a judge of counts judges a mask of two values, and passes nothing more than that.
    """

    def __init__(self, counter):
        self.counter = counter

    def __getattr__(self, name):
        return getattr(self.counter, name)

    def count(self, view, camera, light, method):
        right = self.counter.count(view, camera, light)
        mask = self.counter.count(view, camera, light, method)
        same = (right > 0) == (mask > 0)
        return np.where(same, right, np.where(mask > 0, np.maximum(mask, 1), 0))


@pytest.mark.parametrize("name", SCENES)
def test_every_pixel_is_right(device, name):
    lines, verdicts = [], Verdicts()
    with Judge(device, SCENES[name](), warn=lines.append) as scene:
        scene.counter = BesideStencil(scene.counter)
        for camera, light in sample_pairs(CAMERAS.values(), LIGHTS.values(), 2, len(name)):
            for method in MASKS:
                lines.clear()
                found, _ = scene.judge(camera, light, method)
                assert not lines
                verdicts += found
    verdicts.check(most_on_edges=0.003)


def comb(teeth, z=60.0):
    """
    Make a flat comb: behind its first n teeth, under a sun in the zenith, n shadows begin and end.

    It is one caster; teeth and gaps are 1 m wide.
    """
    cells = [(0, y) for y in range(2 * teeth - 1)]
    cells += [(x, 2 * n) for x in (1, 2, 3) for n in range(teeth)]
    corners = sorted({(x + i, y + j) for x, y in cells for i in (0, 1) for j in (0, 1)})
    number = {corner: index for index, corner in enumerate(corners)}
    faces = []
    for x, y in cells:
        a, b, c, d = (number[x + i, y + j] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
        faces += [(a, b, c), (a, c, d)]
    return np.array([(x, y, z) for x, y in corners], float), np.array(faces, np.int32)


def read_comb(device, method, teeth, *, split):
    """Tell for each tooth and each gap behind it whether the ground there is in shadow."""
    # So near the ground that z-pass is right, and volumes are counted before it.
    camera = Camera((2.5, -12, 6), (2.5, teeth, 0), size=(9, 2000), fov=75.0)
    lines = []
    zenith = directional_light((0, 0, 1))
    with GlFrameCounter(make_scene(*comb(teeth)), ground=0.0, device=device) as ours:
        counter = MaskCounter(device, ours.geometry, method, split=split, warn=lines.append)
        ours.masks._made["alpha"] = counter
        view, frame = ours.see(camera)
        right = ours.count(view, camera, zenith)
        mask = ours.count(view, camera, zenith, "alpha")
    assert (ours.plan.case == 1).all()
    found = []
    for middle in np.arange(2 * teeth) + 0.5:
        apart = np.linalg.norm(frame.position[..., :2] - (2.5, middle), axis=-1)
        place = np.unravel_index(np.nanargmin(apart), apart.shape)
        assert apart[place] < 0.4
        assert right[place] == (middle % 2 < 1)
        found.append(int(mask[place] > 0))
    return found, lines


RIGHT = [1, 0]


@pytest.mark.parametrize(
    ("method", "teeth", "wrong"),
    [
        # (3, 2) clamps at 1 and falls back to 1/4: the third tooth's shadow reads lit.
        (PRINTED, 3, 4),
        # (7, 7) has no room below: the light behind the seventh tooth reads shadow.
        (MASKS["alpha"], 7, 13),
        (MASKS["screen"], 7, 13),
        # (9, 8) comes back to 1: the ninth tooth's shadow reads lit.
        (MASKS["max"], 9, 16),
        # (24, 24) runs over, from which nothing comes back.
        (MASKS["half"], 24, 47),
    ],
    ids=["alpha as printed", "alpha", "screen", "max", "half"],
)
def test_a_comb_drawn_whole_shows_the_smallest_failure(device, method, teeth, wrong):
    if not device.is_software:
        pytest.skip("other devices may round otherwise; their limits are asked of them")
    fewer, _ = read_comb(device, method, teeth - 1, split=False)
    assert fewer == RIGHT * (teeth - 1)
    whole, lines = read_comb(device, method, teeth, split=False)
    assert [place for place, (a, b) in enumerate(zip(whole, RIGHT * teeth)) if a != b] == [wrong]
    assert len(lines) == 1
    assert "may be wrong: 1 casters are not convex" in lines[0]
    split, lines = read_comb(device, method, teeth, split=True)
    assert split == RIGHT * teeth
    assert not lines


def test_limits_are_asked_of_the_device(device):
    with SceneRenderer(make_scene(*HOUSE), device=device) as renderer:
        for name, most in {"alpha": 6, "screen": 6, "max": 7, "half": 23}.items():
            counter, plan_by = renderer.masks.choose(name, renderer.counter)
            assert plan_by == "mcguire"
            assert 1 <= counter.limit <= most == MASKS[name].at_once
            if device.is_software:
                assert counter.limit == most
        painter = counter.painter
        assert find_limit(device, PRINTED, painter) == 1


def test_half_counts(device):
    with Judge(device, SCENES["nested boxes"]()) as scene:
        for camera in CAMERAS.values():
            for light in LIGHTS.values():
                verdicts, counts = scene.judge(camera, light, "half")
                verdicts.check()
        assert counts.max() == 4


def test_half_says_where_there_are_more_than_it_can_count(device):
    camera = Camera((-0.3, 1, 30), (-0.3, 1, 0), up=(0, 1, 0), size=(21, 13), height=0.71)
    sun = directional_light((0.5, 0, 0.25))
    with GlFrameCounter(make_scene(*staircase(100)), ground=0.0, device=device) as ours:
        view, _ = ours.see(camera)
        right = ours.count(view, camera, sun)
        found = ours.count(view, camera, sun, "half")
    assert right.max() == 100
    told = found < 24
    np.testing.assert_array_equal(found[told], right[told])
    assert told.any()
    assert right[~told].min() > 15


def test_casters_are_split_no_more_than_they_must(device):
    camera, light = CAMERAS["outside"], LIGHTS["sun"]
    for mesh, volumes, batches in ((HOUSE, 1, 1), (city(4), 15, 3), (city(2), 4, 1)):
        with GlFrameCounter(make_scene(*mesh), ground=0.0, device=device) as ours:
            view, _ = ours.see(camera)
            ours.count(view, camera, light, "alpha")
            counter, _ = ours.masks.choose("alpha", ours.counter)
            assert (counter.pieces.n_volumes, len(counter.pieces.batches)) == (volumes, batches)
            assert counter.pieces.n_split == 0
            assert counter.painter.tally.batches == batches
            assert counter.painter.tally.draws >= 2 * batches


def test_boxes_that_touch_along_an_edge_are_not_taken_for_one_that_is_convex(device):
    scene = make_scene(*aligned_boxes())
    geometry = Geometry(device, scene)
    (body,) = make_bodies(scene, geometry)
    faces = np.bincount(body.caster.component)
    assert body.is_convex[faces == 12].all()
    assert not body.is_convex[faces > 12].any()
    assert (faces > 12).any()
    geometry.release()


@pytest.mark.parametrize("method", MASKS)
def test_pictures_are_those_of_the_stencil(device, method):
    camera = Camera((-30, -40, 45), (5, 5, 0), size=(96, 72))
    lights = [LIGHTS["lamp"], LIGHTS["sun"]]
    with SceneRenderer(make_scene(*city(3)), 0.0, device=device) as renderer:
        right = renderer.render(camera, lights).astype(int)
        found = renderer.render(camera, lights, method).astype(int)
        dark = renderer.render(camera, [])
    assert (np.abs(found - right).max(-1) > 1).sum() <= 2
    assert (found != dark).any()


def test_the_command_line_offers_them_on_gl_alone(device, tmp_path, capsys):
    path = save_obj(tmp_path / "box.obj", {"box": box((-1, -1, 0), (1, 1, 3))})
    view = ["--eye", "-5,-6,7", "--target", "0,0,2", "--size", "80x60", "--ground", "0"]
    found = {}
    for name in "auto", "max":
        out = tmp_path / f"{name}.npz"
        with pytest.raises(SystemExit) as ended:
            main(["render", str(path), *view, "--light", "6,-4,8", "--device", "gl",
                  "--method", name, "--arrays", str(out)])  # fmt: skip
        assert not ended.value.code, capsys.readouterr().err
        with np.load(out) as arrays:
            found[name] = arrays["count"]
    assert ((found["auto"] > 0) == (found["max"] > 0)).all()
    with pytest.raises(SystemExit):
        main(["render", str(path), *view, "--method", "max", "--arrays", str(out)])
    assert "the cpu has no method 'max'" in capsys.readouterr().err
