"""glTF that moves: nodes, skins and morph targets, posed and solved by hand."""

import numpy as np
import pytest
from support.gltf_files import Document

import umbra
from umbra import InputError
from umbra.cpu.frame import FrameCounter
from umbra.scene import pose
from umbra.volume.inspection import inspect_scene

HALF = float(np.sqrt(0.5))
SIDE = 0.25


def make_column(levels=3):
    """A square column of 0.5 x 0.5 m up glTF's y, closed, each face with its own corners."""
    ring = SIDE * np.array([(1, 0, 1), (1, 0, -1), (-1, 0, -1), (-1, 0, 1)], float)
    quads = []
    for level in range(levels - 1):
        low, high = ring + (0, level, 0), ring + (0, level + 1, 0)
        quads += [(low[k - 1], low[k], high[k], high[k - 1]) for k in range(4)]
    quads.append(tuple(ring + (0, levels - 1, 0)))
    quads.append(tuple(ring[::-1]))
    points = np.array(quads).reshape(-1, 3)
    faces = np.array([(4 * k + a, 4 * k + b, 4 * k + c) for k in range(len(quads))
                      for a, b, c in ((0, 1, 2), (0, 2, 3))])  # fmt: skip
    across = np.cross(points[1::4] - points[0::4], points[2::4] - points[0::4])
    normals = np.repeat(across / np.linalg.norm(across, axis=1, keepdims=True), 4, axis=0)
    return points, faces, normals


class Column(Document):
    """A column that bends at its middle: the upper joint turns about glTF's z."""

    def __init__(self, joints=((0, 1, 0, 0),), weights=None, **node):
        super().__init__()
        points, faces, normals = make_column()
        self.points = points
        above = np.clip(points[:, 1] - 0.5, 0, 1)  # 0, a half, 1 at 0, 1 and 2 m
        above = np.select([points[:, 1] < 0.5, points[:, 1] < 1.5], [0.0, 0.5], 1.0)
        if weights is None:
            weights = [np.stack([1 - above, above, 0 * above, 0 * above], axis=1)]
        attributes = {
            "POSITION": self.accessor(points.astype("f4")),
            "NORMAL": self.accessor(normals.astype("f4")),
        }
        for k, (joint, weight) in enumerate(zip(joints, weights, strict=True)):
            attributes[f"JOINTS_{k}"] = self.accessor(
                np.tile(np.array(joint, "u1"), (len(points), 1))
            )
            attributes[f"WEIGHTS_{k}"] = self.accessor(np.asarray(weight, "f4"))
        self.primitive = {
            "attributes": attributes,
            "indices": self.accessor(faces.astype("u2").ravel()),
        }
        # The skin's own node stands elsewhere: that moves nothing.
        self.shown = self.node(
            mesh=self.mesh(self.primitive), skin=0, name="arm", translation=[50, 60, 70], **node
        )
        self.upper = self.node(root=False, translation=[0, 1, 0])
        self.lower = self.node(children=[self.upper])
        bind = np.tile(np.eye(4), (2, 1, 1))
        bind[1, :3, 3] = 0, -1, 0
        self.tree["skins"] = [
            {
                "joints": [self.lower, self.upper],
                "inverseBindMatrices": self.accessor(bind.transpose(0, 2, 1).astype("f4")),
            }
        ]

    def animate(self, node, path, times, values, way="LINEAR", name="wave", more=False):
        animations = self.tree.setdefault("animations", [])
        if not more:
            animations.append({"name": name, "channels": [], "samplers": []})
        sampler = {
            "input": self.accessor(np.array(times, "f4")),
            "output": self.accessor(np.array(values, "f4")),
            "interpolation": way,
        }
        animations[-1]["samplers"].append(sampler)
        channel = {"sampler": len(animations[-1]["samplers"]) - 1,
                   "target": {"node": node, "path": path}}  # fmt: skip
        animations[-1]["channels"].append(channel)

    def bend(self, **more):
        """Turn the upper joint by 90 degrees in 2 s."""
        self.animate(self.upper, "rotation", [1, 3], [[0, 0, 0, 1], [0, 0, HALF, HALF]], **more)


@pytest.fixture
def save(tmp_path):
    def write(document, name="m.glb"):
        path = tmp_path / name
        path.write_bytes(document.glb())
        return path

    return write


def bent_by_hand(points):
    """Where a column's points are with its upper half turned by 90 degrees, z up."""
    x, y, z = points.T
    turned = np.stack([-(y - 1), 1 + x, z], axis=1)  # about (0, 1, 0)
    share = np.select([y < 0.5, y < 1.5], [0.0, 0.5], 1.0)[:, None]
    mixed = (1 - share) * points + share * turned
    return mixed[:, [0, 2, 1]] * (1, -1, 1)


def test_a_two_joint_skin_bent_by_90_degrees(save):
    column = Column()
    column.bend()
    scene = umbra.read(save(column))
    assert [(one.name, one.duration) for one in scene.animations] == [("wave", 3.0)]
    upright = column.points[:, [0, 2, 1]] * (1, -1, 1)
    np.testing.assert_allclose(scene.triangles().vertices, upright, atol=1e-7)
    for time in (-1, 0, 1):  # before the first time as at the first
        np.testing.assert_allclose(pose(scene, time).triangles().vertices, upright, atol=1e-7)
    bent = pose(scene, 3.0)
    expected = bent_by_hand(column.points)
    np.testing.assert_allclose(bent.triangles().vertices, expected, atol=1e-7)
    # By hand: the corner (0.25, 2, 0.25) and the bend's (0.25, 1, 0.25).
    corners = bent.triangles().vertices[np.argsort(column.points[:, 1], kind="stable")]
    assert np.abs(corners - (-1, -0.25, 1.25)).sum(1).min() < 1e-6
    assert np.abs(corners - (0.125, -0.25, 1.125)).sum(1).min() < 1e-6
    assert bent.parts[0].mesh.vertices.dtype == np.float64
    # Half way is 45 degrees, not half the chord.
    top = pose(scene, 2.0).triangles().vertices[column.points[:, 1] == 2].mean(0)
    np.testing.assert_allclose(top, [-HALF, 0, 1 + HALF], atol=1e-6)


def test_posed_meshes_stay_closed_though_their_corners_are_split(save):
    column = Column()
    column.bend()
    scene = umbra.read(save(column))
    assert len(scene.parts[0].mesh.vertices) == 40
    for time in (0, 1.37, 2.9):
        posed = pose(scene, time)
        assert inspect_scene(posed).total.closed
        assert len(np.unique(FrameCounter(posed).caster.faces)) == 12


def test_normals_turn_with_the_skin(save):
    column = Column()
    column.bend()
    bent = pose(umbra.read(save(column)), 3.0).parts[0].mesh
    cap = column.points[:, 1] == 2
    top = cap & (np.arange(40) >= 32)  # the lid, which looked up
    np.testing.assert_allclose(bent.normals[top], np.tile([-1, 0, 0], (4, 1)), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(bent.normals, axis=1), 1, atol=1e-6)


def test_a_skin_is_posed_by_its_joints_without_an_animation(save):
    column = Column()
    column.tree["nodes"][column.upper]["rotation"] = [0, 0, HALF, HALF]
    scene = umbra.read(save(column))
    np.testing.assert_allclose(scene.triangles().vertices, bent_by_hand(column.points), atol=1e-7)
    assert scene.animations == ()
    assert scene.notes == ()
    with pytest.raises(InputError, match="no animation"):
        pose(scene, 1.0)


def test_eight_influences_are_used_and_weights_are_brought_to_sum_1(save):
    above = np.clip(Column().points[:, 1], 0, 1)
    # The second set alone holds the upper joint; all together sum to 2.
    first = np.stack([2 - 2 * above, 0 * above, 0 * above, 0 * above], axis=1)
    second = np.stack([0 * above, 0 * above, 0 * above, 2 * above], axis=1)
    column = Column(((0, 0, 0, 0), (0, 0, 0, 1)), (first, second))
    column.bend()
    found = pose(umbra.read(save(column)), 3.0).triangles().vertices
    top = column.points[:, 1] == 2
    np.testing.assert_allclose(found[top], bent_by_hand(column.points)[top], atol=1e-7)
    np.testing.assert_allclose(found[column.points[:, 1] == 0][:, 2], 0, atol=1e-7)


def test_vertices_without_weights_follow_their_first_joint(save):
    column = Column(weights=[np.zeros((40, 4))])
    column.bend()
    upright = column.points[:, [0, 2, 1]] * (1, -1, 1)
    np.testing.assert_allclose(
        pose(umbra.read(save(column)), 3.0).triangles().vertices, upright, atol=1e-7
    )


def test_rigid_parts_keep_their_mesh_and_get_a_transform(save):
    column = Column()
    del column.tree["nodes"][column.shown]["skin"]
    mesh = column.tree["nodes"][column.shown]["mesh"]
    still = column.node(mesh=mesh, name="still")
    column.animate(column.shown, "translation", [0, 4], [[0, 0, 0], [8, 4, 0]])
    column.animate(column.shown, "scale", [0, 4], [[1, 1, 1], [1, 3, 1]], more=True)
    column.animate(still, "rotation", [0], [[0, 0, 0, 1]], "STEP", name="rest")
    scene = umbra.read(save(column))
    posed = pose(scene, 2.0, "wave")
    for before, after in zip(scene.parts, posed.parts, strict=True):
        assert after.mesh is before.mesh
        assert after.name == before.name
    np.testing.assert_allclose(posed.parts[0].transform[:3, 3], [4, 0, 2])
    low, high = posed.triangles([0]).vertices.min(0), posed.triangles([0]).vertices.max(0)
    np.testing.assert_allclose([low, high], [[3.75, -0.25, 2], [4.25, 0.25, 6]])
    np.testing.assert_array_equal(posed.parts[1].transform, scene.parts[1].transform)
    # Poses do not add up, and the other animation puts the first part back.
    np.testing.assert_array_equal(pose(posed, 1, "rest").bounds(), scene.bounds())
    assert pose(posed, 1, 1).parts[0].transform[0, 3] == 50


def test_all_animations_play_together_each_in_its_own_file(save, tmp_path):
    column = Column()
    column.bend()
    del column.tree["nodes"][column.shown]["translation"]
    post = column.node(mesh=0, name="post")
    column.animate(post, "translation", [0, 2], [[0, 0, 0], [6, 0, 0]], name="slide")
    column.animate(post, "translation", [0, 2], [[0, 0, 0], [8, 0, 0]], name="run")
    path = save(column)
    one = umbra.read(path)
    apart = pose(one, 3.0, "all")
    np.testing.assert_allclose(
        apart.triangles([0]).vertices, bent_by_hand(column.points), atol=1e-7
    )
    assert apart.parts[1].transform[0, 3] == 8  # the later of the two
    assert pose(one, 3.0, "slide").parts[1].transform[0, 3] == 6
    # Two files in one scene: the fifth animation is the second of the second file.
    two = umbra.read(path, save(column, "n.glb"))
    assert [a.name for a in two.animations] == ["wave", "slide", "run"] * 2
    posed = pose(two, 3.0, 4)
    assert [part.transform[0, 3] for part in posed.parts] == [0, 0, 0, 6]


def test_children_move_with_their_parents(save):
    column = Column()
    del column.tree["nodes"][column.shown]["skin"]
    column.tree["scenes"][0]["nodes"].remove(column.shown)
    column.tree["nodes"][column.shown].pop("translation")
    column.tree["nodes"][column.upper]["children"] = [column.shown]
    column.bend()
    low, high = pose(umbra.read(save(column)), 3.0).bounds()
    # The column, 1 m up, lies along -x.
    np.testing.assert_allclose([low, high], [[-2, -0.25, 0.75], [0, 0.25, 1.25]], atol=1e-6)


def make_morph(weights=None, normals=False):
    """A triangle whose second target lifts one corner by 2 m and whose first moves all."""
    document = Column()
    del document.tree["skins"]
    document.tree["nodes"], document.tree["scenes"] = [], [{"nodes": []}]
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 0, -1]], "f4")
    everywhere = np.tile(np.array([4, 0, 0], "f4"), (3, 1))
    corner = np.array([[0, 0, 0], [0, 2, 0], [0, 0, 0]], "f4")
    attributes = {"POSITION": document.accessor(square)}
    targets = [{"POSITION": document.accessor(everywhere)}, {"POSITION": document.accessor(corner)}]
    if normals:
        attributes["NORMAL"] = document.accessor(np.tile(np.array([0, 1, 0], "f4"), (3, 1)))
        targets[1]["NORMAL"] = document.accessor(np.tile(np.array([-2, 0, 0], "f4"), (3, 1)))
    more = {"weights": weights} if weights else {}
    mesh = document.mesh({"attributes": attributes, "targets": targets}, **more)
    document.shown = document.node(mesh=mesh)
    return document


def test_morph_targets_at_half_weight(save):
    document = make_morph(weights=[0.5, 0.25], normals=True)
    document.animate(document.shown, "weights", [0, 2], [0, 0, 0, 1])
    scene = umbra.read(save(document))
    # At rest: half of 4 m to the east, a quarter of 2 m up; y up becomes z up.
    np.testing.assert_allclose(
        scene.triangles().vertices, [[2, 0, 0], [3, 0, 0.5], [2, 1, 0]], atol=1e-7
    )
    half = pose(scene, 1.0)
    np.testing.assert_allclose(
        half.triangles().vertices, [[0, 0, 0], [1, 0, 1], [0, 1, 0]], atol=1e-7
    )
    # The normal (0, 1, 0) and half of (-2, 0, 0), in glTF's axes and of length 1.
    np.testing.assert_allclose(half.parts[0].mesh.normals, [[-HALF, HALF, 0]] * 3, atol=1e-6)
    # The node's own weights come before the mesh's.
    document.tree["nodes"][document.shown]["weights"] = [0, 1]
    np.testing.assert_allclose(
        umbra.read(save(document)).triangles().vertices[1], [1, 0, 2], atol=1e-7
    )


def test_morph_weights_along_a_spline(save):
    document = make_morph()
    # For each time: tangents in, values, tangents out; each for both targets.
    knots = [[0, 0], [0, 0], [0, 4], [0, 0], [0, 1], [0, 0]]
    document.animate(document.shown, "weights", [0, 2], np.ravel(knots), "CUBICSPLINE")
    scene = umbra.read(save(document))
    # Half way: 1 / 2 + 2 s x 4 / 8 = 1.5, times 2 m.
    assert pose(scene, 1.0).triangles().vertices[1, 2] == pytest.approx(3)


def test_a_mesh_that_nothing_bends_is_shared(save):
    document = make_morph()
    document.node(mesh=document.tree["nodes"][document.shown]["mesh"])
    document.animate(document.shown, "weights", [0, 2], [0, 0, 0, 1])
    scene = umbra.read(save(document))
    assert scene.parts[0].mesh is scene.parts[1].mesh
    posed = pose(scene, 1.0)
    assert posed.parts[1].mesh is scene.parts[1].mesh
    assert posed.parts[0].mesh is not scene.parts[0].mesh
    assert posed.parts[0].mesh.faces is scene.parts[0].mesh.faces
    assert pose(scene, 0.0).parts[0].mesh is scene.parts[0].mesh


def test_far_from_zero_poses_stand_about_the_same_origin(save):
    column = Column()
    column.tree["nodes"][column.lower]["translation"] = [2_600_000, 0, -1_200_000]
    column.bend()
    rigid = column.node(mesh=0, name="post", translation=[2_600_005, 0, -1_200_000])
    column.animate(rigid, "translation", [0], [[2_600_007, 0, -1_200_000]], more=True)
    scene = umbra.read(save(column))
    assert scene.origin[:2].all()
    posed = pose(scene, 3.0)
    np.testing.assert_array_equal(posed.origin, scene.origin)
    expected = bent_by_hand(column.points) + (2_600_000, 1_200_000, 0)
    found = posed.triangles([0]).vertices + scene.origin
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)
    place = posed.triangles([1]).vertices.mean(0) + scene.origin
    np.testing.assert_allclose(place, [2_600_007, 1_200_000, 1], rtol=0, atol=0.3)


def test_lights_move_with_their_nodes(save):
    column = Column()
    column.tree["extensions"] = {
        "KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {"outerConeAngle": 0.5}}]}
    }
    column.tree["nodes"][column.upper]["extensions"] = {"KHR_lights_punctual": {"light": 0}}
    column.bend()
    scene = umbra.read(save(column))
    np.testing.assert_allclose(scene.lights[0].position, [0, 0, 1, 1], atol=1e-12)
    np.testing.assert_allclose(scene.lights[0].axis, [0, 1, 0], atol=1e-12)  # glTF's -z
    column.tree["animations"] = []
    column.animate(column.lower, "rotation", [0, 1], [[0, 0, 0, 1], [HALF, 0, 0, HALF]])
    # About glTF's x, y turns to z: the light hangs 1 m in the south and shines up.
    (light,) = pose(umbra.read(save(column)), 1.0).lights
    np.testing.assert_allclose(light.position, [0, -1, 0, 1], atol=1e-6)
    np.testing.assert_allclose(light.axis, [0, 0, 1], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "facts", "said"),
    [
        (
            lambda t: t["skins"][0].update(joints=[99, 2]),
            {"key": "nodes", "index": 99}, "skin 0 names nodes[99]",
        ),
        (
            lambda t: t["skins"][0]["joints"].append(1),
            {"where": "skin 0", "count": 2, "needed": 3}, "3 joints, but 2 inverse bind matrices",
        ),
        (lambda t: t["skins"][0]["joints"].pop(), {"vertex": 2}, "vertex 2 on joint 1 of 1"),
        (lambda t: t["nodes"][0].update(skin=4), {"key": "skins", "index": 4}, ""),
        (
            lambda t: t["meshes"][0]["primitives"][0]["attributes"].update(WEIGHTS_0=1),
            {}, "damaged",
        ),
        (
            lambda t: t["animations"][0]["samplers"][0].update(output=0),
            {"where": "animation 0, channel 0", "times": 2}, "do not fit 2 times of 4",
        ),
        (
            lambda t: t["animations"][0]["channels"][0].update(sampler=3),
            {"key": "samplers", "index": 3}, "",
        ),
        (lambda t: t["accessors"][-2].update(count=0), {"times": 0}, ""),
    ],
)  # fmt: skip
def test_damage_is_named(save, refuse, change, facts, said):
    column = Column()
    column.bend()
    change(column.tree)
    assert said in refuse(umbra.read, save(column), facts=facts)


def test_times_that_do_not_ascend_or_are_not_finite_are_refused(save, refuse):
    for times, time, said in (
        ([3, 1], 0, "times do not ascend"),
        ([1, np.nan], None, "not finite"),
    ):
        column = Column()
        column.animate(column.upper, "rotation", times, [[0, 0, 0, 1], [0, 0, HALF, HALF]])
        facts = {"where": "animation 0, channel 0", "time": time}
        assert said in refuse(umbra.read, save(column), facts=facts)


def test_what_is_not_read_is_noted(save):
    column = Column()
    column.bend()
    column.animate(column.upper, "pointer", [0], [[0, 0, 0]], more=True)
    scene = umbra.read(save(column))
    assert scene.notes == ("m.glb: animated properties that are not read: 1",)


@pytest.mark.parametrize(
    ("time", "animation", "said"),
    [
        (np.nan, 0, "time of a pose must be finite"),
        (0, 1, "there is no animation 1; the scene has 1"),
        (0, -1, "there is no animation -1"),
        (0, "run", "no animation 'run'; the scene has 'wave'"),
        (0, "7", "there is no animation 7"),
    ],
)
def test_poses_that_make_no_sense_are_refused(save, time, animation, said):
    column = Column()
    column.bend()
    with pytest.raises(InputError, match=said):
        pose(umbra.read(save(column)), time, animation)
