"""Samples of surfaces counted by patches, compared with rays and the float64 ray caster."""

import numpy as np

from support.raycaster import RayCaster
from support.shapes import sheet
from support.weights import check_weights
from umbra.cpu.patch_bins import EdgeBinner
from umbra.cpu.patch_count import PatchCounter
from umbra.cpu.patches import make_patches
from umbra.rays.face_tree import make_face_tree
from umbra.rays.hidden import find_hidden
from umbra.receivers.samples import sample_surfaces
from umbra.scene import make_scene
from umbra.volume.adjacency import make_caster

EDGE = 1e-6
GRAZING = 1e-12
"""Sine of the sun over a surface below which rounding decides whether it is turned away."""
FLOOR = sheet([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)])


def prepare(mesh, spacing):
    scene = make_scene(*mesh)
    samples = sample_surfaces(scene, spacing)
    seen = scene.triangles()
    caster = make_caster(seen.vertices, seen.faces)
    tree = make_face_tree(caster)
    patches = make_patches(samples, tree)
    return samples, patches, PatchCounter(patches, EdgeBinner(caster), tree), tree, scene


def make_suns(rng, n, lowest=0.01):
    azimuth, up = rng.uniform(0, 2 * np.pi, n), rng.uniform(lowest, 1.0, n)
    flat = np.sqrt(1 - up**2)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), up], 1)


def check(mesh, suns, spacing):
    """Compare with rays and the ray caster; give how many are in cast shadow, and lit."""
    samples, _, counter, tree, scene = prepare(mesh, spacing)
    masks = counter.masks(suns)
    check_weights(counter, suns, masks)
    soup = scene.triangles()
    rays, open_rule = RayCaster(soup.vertices, soup.faces), np.zeros(len(soup.faces), bool)
    compare_with_rays(samples, masks, tree, rays, suns)
    for sun, mask in zip(suns, masks, strict=True):
        light, facing = np.append(sun, 0.0), np.flatnonzero(samples.normals @ sun > GRAZING)
        none = np.full(len(facing), -1)
        pierced = rays.count(samples.points[facing], none, light, light, open_rule, 1e-9)
        assert_on_edges(samples, facing[pierced.any != (mask[facing] > 0)], sun, rays)
    facing = samples.normals @ suns.T > 0
    return (masks.T[facing] > 0).sum(), (masks.T[facing] == 0).sum()


def compare_with_rays(samples, masks, tree, rays, suns):
    """Check that masks differ from rays within rounding of an edge alone; give how many differ."""
    truth = find_hidden(tree, samples.points, samples.normals, suns)
    for sun, mask, asked in zip(suns, masks, truth, strict=True):
        differ = np.flatnonzero(mask != asked)
        assert (samples.normals[differ] @ sun > 0).all()  # attached shadow never differs
        assert_on_edges(samples, differ, sun, rays)
    return int((masks != truth).sum())


def assert_on_edges(samples, which, sun, rays):
    """Check that some samples are within rounding of the edge of a shadow."""
    if len(which):
        far = rays.distance_to_shadow_edges(
            samples.points[which], samples.normals[which], np.full(len(which), -1),
            np.append(sun, 0.0), np.zeros(len(rays.faces), bool),
        )  # fmt: skip
        assert (far <= EDGE).all(), (sun, which[far > EDGE][:5], far[far > EDGE][:5])


def make_counter(scene, spacing):
    """Make the counter of all surfaces of a scene, with their samples and a tree of the faces."""
    samples, soup = sample_surfaces(scene, spacing), scene.triangles()
    caster = make_caster(soup.vertices, soup.faces, scene.groups()[soup.part])
    tree = make_face_tree(caster, float(np.abs(scene.bounds()).max()))
    return samples, PatchCounter(make_patches(samples, tree), EdgeBinner(caster), tree), tree
