"""Soft shadows on a floor seen from just above it, and the errors they have."""

import numpy as np

from umbra.cpu.frame import FrameCounter
from umbra.scene import Camera, Mesh, Part, make_scene


def look(mesh, camera, ground=0.0):
    """Give what a method is called with, but for the light."""
    scene = make_scene([Part("caster", "", Mesh(*mesh))])
    counter = FrameCounter(scene, ground=ground)
    view, frame = counter.see(camera)
    return counter, view, frame, camera


def look_at_floor(mesh, half=2.0, pixels=80, eye=0.9):
    """Look down on the floor z = 0 from a height below all casters; row 0 is north."""
    camera = Camera(
        (0, 0, eye), (0, 0, 0), up=(0, 1, 0), size=(pixels, pixels), height=2 * half, near=1e-3
    )
    return look(mesh, camera)


def at(frame, values, *place):
    """Give the value at the visible point nearest to a place."""
    apart = np.abs(np.nan_to_num(frame.position, nan=1e9) - place).sum(-1)
    return values.ravel()[apart.argmin()]


def differ(found, truth):
    """Give the differences where either is in penumbra."""
    partial = ((found > 0) & (found < 1)) | ((truth > 0) & (truth < 1))
    return (found.astype(np.float64) - truth)[partial]
