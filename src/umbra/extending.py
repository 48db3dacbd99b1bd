"""
What packages beside umbra build on: a base class for each thing that can be added.

    group of entry points   base           what it adds
    umbra.measures          Measure        a measure: lights with weights, and what their sums are
    umbra.receivers         PlacedKind     a kind of samples: points with normals and areas
    umbra.devices           PointDevice    a device that counts: which points see which lights
    umbra.readers           Reader         files of a format, by their ending
    umbra.outputs           Output         further files of a study

``docs/extending.md`` has a package of each.
"""

from umbra.devices.by_points import PointDevice
from umbra.errors import InputError
from umbra.lights import Lights, find_directions
from umbra.readers.added import Reader
from umbra.receivers.placed import PlacedKind, PlacedSamples, find_ground_heights
from umbra.scene import Mesh, Part, Scene
from umbra.study.measures import Asked, Measure, Quantity
from umbra.study.result import Study
from umbra.writers.outputs import Output

__all__ = [
    "Asked",
    "InputError",
    "Lights",
    "Measure",
    "Mesh",
    "Output",
    "Part",
    "PlacedKind",
    "PlacedSamples",
    "PointDevice",
    "Quantity",
    "Reader",
    "Scene",
    "Study",
    "find_directions",
    "find_ground_heights",
]
