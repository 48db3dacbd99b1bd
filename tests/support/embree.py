"""Embree in bulk; where it and umbra differ, and on a sample, float64 rays decide."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from support.judge import Verdicts, judge

OFFSET = 1e-3
"""How far Embree's rays start off their surface [m]: enough for its float32."""


class Embree:
    """All triangles of a soup near its origin, as Embree sees them."""

    def __init__(self, vertices, faces):
        self.scene = EmbreeScene()
        TriangleMesh(self.scene, vertices.astype(np.float32), faces.astype(np.int32))

    def is_dark(self, seen, light):
        """Whether each place is turned from the light or has something before it."""
        way = light[:3] - light[3] * seen.points
        turned = np.einsum("ij,ij->i", seen.normals, way)
        start = seen.points + OFFSET * np.sign(turned)[:, None] * seen.normals
        hit = self.scene.run(
            start.astype(np.float32),
            np.ascontiguousarray(way, np.float32),
            query="OCCLUDED",
        )
        return (turned <= 0) | (hit == 0)


def judge_in_bulk(rays, embree, seen, sun, is_closed, counts, sample=120, seed=0):
    """
    Judge counts under a sun: all by Embree, those that differ and a sample by rays.

    Returns
    -------
    verdicts : Verdicts
        Of what was tried in float64.
    differ : int
        Places where Embree disagrees.
    """
    counts = np.asarray(counts).ravel()
    light = np.append(sun, 0.0)
    is_turned = seen.normals @ sun <= 0
    ours = is_turned | (counts > 0)
    differ = np.flatnonzero(ours != embree.is_dark(seen, light))
    agree = np.setdiff1d(np.arange(len(counts)), differ)
    some = np.random.default_rng(seed).choice(agree, min(sample, len(agree)), replace=False)
    verdicts = Verdicts()
    for which in np.array_split(differ, max(1, len(differ) // 1000)) + [some]:
        if len(which):
            verdicts += judge(rays, seen[which], light, is_closed, counts[which])
    return verdicts, len(differ)
