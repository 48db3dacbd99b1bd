"""
Soft shadows by sampling: the average of many hard shadows of one light.

Heckbert and Herf (1997); McGuire et al. 2003, section 4. Converges to the exact result for any
caster: the reference for the other methods.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from umbra.methods import Softness
from umbra.rays import VisibleSurface
from umbra.rays.depth import DepthBuffer
from umbra.scene import Camera
from umbra.soft import AreaLight

if TYPE_CHECKING:
    from umbra.soft.frames import VolumeCounts

__all__ = ["SAMPLES", "find_visibility_by_samples"]

SAMPLES = Softness.samples
"""Default number; 1,024 are the reference in tests and benchmarks."""


def find_visibility_by_samples(
    counter: "VolumeCounts",
    view: DepthBuffer,
    frame: VisibleSurface,
    camera: Camera,
    light: AreaLight,
    *,
    samples: int = SAMPLES,
) -> NDArray[np.float32]:
    """
    Find the share of an area light's points that each visible point sees, see `umbra.soft`.

    `InputError` if there is no sample, or too many.
    """
    dark = np.zeros(frame.part.shape, np.int32)
    for point in light.points(samples):
        dark += counter.count(view, camera, point) != 0
    return (1.0 - dark / samples).astype(np.float32)
