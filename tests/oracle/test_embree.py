"""Large meshes: Embree on every cell and pixel, float64 wherever it disagrees."""

from functools import lru_cache

import numpy as np
import pytest

pytest.importorskip("embreex", reason="embreex, of the test dependency group, is not installed")

from support.embree import Embree, judge_in_bulk
from support.judge import (
    Seen,
    Verdicts,
    closed_faces,
    directions,
    look_down,
    on_field,
    on_plane,
)
from support.model_files import DATA, FILES
from support.raycaster import RayCaster
from support.shapes import city, merge, moved, terrain, torus_knot

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.cpu.height_field import HeightFieldSweep
from umbra.cpu.plane import PlaneSweep
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, directional_light, make_scene
from umbra.scene.grid import Grid
from umbra.volume.adjacency import make_caster

SUNS = directions([(0.4, -0.5, 0.6), (-0.8, -0.1, 0.25), (0.15, -0.9, 0.9)])


@lru_cache(maxsize=1)
def read(name):
    if not (DATA / name).is_file():
        pytest.skip(f"{name} is not here: the real models lie outside the repository")
    return umbra.read(DATA / name)


@lru_cache(maxsize=1)
def read_soup(name):
    scene = read(name)
    soup = scene.triangles()
    mesh = soup.vertices, soup.faces
    return mesh, make_caster(*mesh, scene.groups()[soup.part]), RayCaster(*mesh), Embree(*mesh)


def make_grid(mesh, cells=180):
    low, high = mesh[0][mesh[1].ravel()].min(0), mesh[0][mesh[1].ravel()].max(0)
    margin = 0.1 * (high - low)[:2].max()
    size = (high - low)[:2] + 2 * margin
    cell = size.max() / cells
    cols, rows = (int(n) + 1 for n in size / cell)
    # A site's own ground often lies in the lowest plane, give or take rounding: step over it.
    return Grid(low[0] - margin, low[1] - margin, cell, cell * 1.01, cols, rows), low[2] + 1e-3


def judge_plans(mesh, caster, rays, embree, grid, ground, suns, sample=120):
    verdicts, differ, judged = Verdicts(), 0, 0
    plane = PlaneSweep(caster, grid, ground)
    heights, own = look_down(mesh, grid, ground)
    field = HeightFieldSweep(caster, grid, heights)
    for sweep, seen in (plane, on_plane(grid, ground)), (field, on_field(mesh, grid, heights, own)):
        is_closed = closed_faces(sweep.caster, len(mesh[1]))
        for sun, counts in zip(suns, sweep.counts(suns)):
            found, n = judge_in_bulk(rays, embree, seen, sun, is_closed, counts, sample)
            verdicts, differ, judged = verdicts + found, differ + n, judged + counts.size
    return verdicts, differ, judged


@pytest.mark.parametrize("name", FILES)
def test_plans_of_real_files(name):
    mesh, caster, rays, embree = read_soup(name)
    grid, ground = make_grid(mesh)
    verdicts, differ, judged = judge_plans(mesh, caster, rays, embree, grid, ground, SUNS)
    # Real walls stand on each other and on the ground: many samples are contacts.
    verdicts.check(most_on_edges=1.0)
    assert differ < 0.02 * judged


@pytest.mark.parametrize("name", FILES)
def test_frames_of_real_files(name):
    mesh, _, rays, embree = read_soup(name)
    scene = read(name)
    low, high = scene.bounds()
    span = np.linalg.norm(high - low)
    middle = (low + high) / 2
    camera = Camera(middle + span * np.array([0.4, -0.6, 0.45]), middle, size=(160, 120), fov=45)
    counter = FrameCounter(scene, ground=low[2])
    view, frame = counter.see(camera)
    is_seen = view.face != NOTHING
    seen = Seen(
        frame.position[is_seen] - scene.origin,
        frame.normal[is_seen],
        view.face[is_seen],
        camera.apex(scene.origin),
    )
    is_closed = closed_faces(counter.caster, len(mesh[1]))
    for sun in SUNS[:2]:
        counts = counter.count(view, camera, directional_light(sun))
        again = counter.count(view, camera, directional_light(sun), "z-fail")
        # On surfaces that lie in each other no order exists: let rays judge both.
        for found in counts, again:
            verdicts, differ = judge_in_bulk(
                rays, embree, seen, sun, is_closed, found[is_seen], sample=60
            )
            verdicts.check(most_on_edges=1.0)
            assert differ < 0.02 * is_seen.sum()
        assert (counts != again).mean() < 1e-3


def test_terrain_of_200_000_triangles():
    mesh = terrain()
    assert len(mesh[1]) > 199_000
    caster, rays, embree = make_caster(*mesh), RayCaster(*mesh), Embree(*mesh)
    grid = Grid(-159.7123, -158.9371, 1.6113, 1.5707, 199, 203)
    verdicts, differ, judged = judge_plans(mesh, caster, rays, embree, grid, 0.0, SUNS[1:], 40)
    verdicts.check(most_on_edges=0.1)
    assert differ < 0.01 * judged


def test_a_town_far_from_zero():
    # 2.6e6 m east: whatever is not subtracted in float64 would be lost.
    far = np.array([2.6e6, 1.2e6, 400.0])
    mesh = moved(city(8, seed=5), far)
    scene = make_scene(*mesh)
    assert np.abs(scene.origin - far)[:2].max() < 100
    soup = scene.triangles()
    local = soup.vertices, soup.faces
    caster, rays, embree = make_caster(*local), RayCaster(*local), Embree(*local)
    grid, _ = make_grid(local, 150)
    verdicts, differ, judged = judge_plans(
        local, caster, rays, embree, grid, far[2] - scene.origin[2], SUNS
    )
    verdicts.check(most_on_edges=0.01)
    assert differ < 0.01 * judged


def test_casters_far_outside_the_picture():
    # Towers a kilometre away whose shadows come and go across a small plan.
    towers = [moved(city(2, seed=k), (900 * np.cos(k), 900 * np.sin(k), 300)) for k in range(6)]
    mesh = merge(torus_knot(60, 8), *towers)
    caster, rays, embree = make_caster(*mesh), RayCaster(*mesh), Embree(*mesh)
    grid = Grid(-15.1, -14.9, 0.31, 0.29, 97, 101)
    suns = [(np.cos(k), np.sin(k), 0.34) for k in range(6)]
    verdicts, _, _ = judge_plans(mesh, caster, rays, embree, grid, 0.0, directions(suns))
    verdicts.check(most_on_edges=0.01)
