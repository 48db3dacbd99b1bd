"""Lights that move in small steps: as from scratch, over long walks."""

import numpy as np
import pytest
from support.bench import borrow
from support.shapes import SCENES, city, moved, terrain

from umbra.volume import silhouette as following
from umbra.volume.adjacency import make_caster
from umbra.volume.dual_tree import make_dual_tree
from umbra.volume.silhouette import Follower, find_silhouettes


def search_anew(caster, light):
    ((_, found),) = find_silhouettes(caster, light[None], "brute")
    return np.sort(found.codes[: found.starts[1]])


def walk(rng, start, n, step):
    """Give lights on a random walk whose steps change in length now and then; some rest."""
    lights, at = [], np.array(start, float)
    for k in range(n):
        if k % 25 == 0:
            size = step * 10.0 ** rng.uniform(-3, 1) * (rng.random() < 0.9)
        at[:3] += rng.normal(size=3) * size
        if not at[3]:
            at[:3] /= np.linalg.norm(at[:3])
        lights.append(at.copy())
    return lights


@pytest.mark.parametrize("tree", ["dual tree", "hextree"])
@pytest.mark.parametrize("name", SCENES)
def test_every_scene_over_a_walk(name, tree):
    make = make_dual_tree if tree == "dual tree" else borrow("hextree").make_hextree
    caster = make_caster(*SCENES[name]())
    rng = np.random.default_rng(0)
    for start, step in (([0.3, 0.2, 0.8, 0], 0.01), ([4, 3, 9, 1], 0.05)):
        follower = Follower(make(caster))
        for light in walk(rng, start, 300, step):
            np.testing.assert_array_equal(
                follower.find(caster, light), search_anew(caster, light), err_msg=f"{light}"
            )


def make_meshes():
    model = borrow("scenes").make_boulder(4)
    return {
        "smooth": (model.vertices, model.faces),
        "terrain": terrain(n=40),
        "far away": moved(city(4), (4e5, 5e6, 0)),
    }


@pytest.mark.parametrize("name", make_meshes())
def test_long_walks(name):
    caster = make_caster(*make_meshes()[name])
    middle = caster.vertices.mean(0)
    rng = np.random.default_rng(1)
    held = 0
    for start, step in (([0.1, 0.5, 0.6, 0], 0.003), ([*(middle + [30, -20, 90]), 1], 0.2)):
        follower = Follower(make_dual_tree(caster))
        before = None
        for light in walk(rng, start, 2500, step):
            found = follower.find(caster, light)
            np.testing.assert_array_equal(found, search_anew(caster, light), err_msg=f"{light}")
            held += follower._held is not None and follower._held is before
            before = follower._held
    assert held > 2000  # else it was the tree that was tested


def test_a_light_that_turns_about_the_caster_and_through_it():
    caster = make_caster(*city(4))
    follower = Follower(make_dual_tree(caster))
    for angle in np.linspace(0, 2 * np.pi, 2000):
        light = np.array([30 * np.cos(angle), 0, 30 * np.sin(angle), 1])
        np.testing.assert_array_equal(follower.find(caster, light), search_anew(caster, light))
    for x in np.linspace(-30, 30, 2000):
        light = np.array([x, 0.3, 2.0, 1])
        np.testing.assert_array_equal(follower.find(caster, light), search_anew(caster, light))


def test_components_may_open_between_steps():
    caster = make_caster(*SCENES["turned boxes"]())
    follower = Follower(make_dual_tree(caster))
    rng = np.random.default_rng(2)
    for k, near in enumerate(walk(rng, [0, 0, 1.0, 0], 300, 0.001)):
        light = np.array([0, 0, 1.0, 0]) if k % 7 == 0 else near  # walls edge-on
        some = caster.opened(rng.random(len(caster.is_closed)) < 0.5)
        np.testing.assert_array_equal(follower.find(some, light), search_anew(some, light))


def test_only_what_is_near_is_asked(monkeypatch):
    model = borrow("scenes").make_boulder(5)
    caster = make_caster(model.vertices, model.faces)
    tree = make_dual_tree(caster)
    follower = Follower(tree)
    for angle in np.arange(20) * 1e-4:
        found = follower.find(caster, np.array([np.cos(angle), np.sin(angle), 0.4, 0]))
    assert len(found) < follower._held.numbers.size < 3 * len(found) + 100
    # Far steps hold nothing.
    monkeypatch.setattr(following.Follower, "_hold", None)
    assert follower.find(caster, np.array([0, 1.0, 0.4, 0])) is not None
    assert follower.find(caster, np.array([0, 0, 1e300, 0])) is None
