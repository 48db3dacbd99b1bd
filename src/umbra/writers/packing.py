"""Numbers packed into text for a page's script, which ``umbra/web/packed.js`` unpacks."""

import base64
import zlib

import numpy as np
from numpy.typing import NDArray

from umbra.receivers.surface_samples import Samples
from umbra.writers.surfaces_glb import lay_out_facades

__all__ = ["MOST_SQUARES", "pack", "pack_differences", "pack_grids", "pack_hours"]

MOST_SQUARES = 1_500_000
"""Of all surfaces together; finer samples are not all shown."""


def pack(data: bytes) -> str:
    """Compress bytes and write them as text."""
    # Level 6, the default, takes four times as long on a day's masks, and saves a percent.
    packer = zlib.compressobj(4, strategy=zlib.Z_FILTERED)
    return base64.b64encode(packer.compress(data) + packer.flush()).decode()


def pack_differences(values: NDArray[np.integer]) -> str:
    """Pack whole numbers, each as its difference to the one before; they must fit in int32."""
    flat = np.asarray(values, np.int64).ravel()
    return pack(np.diff(flat, prepend=0).astype("<i4").tobytes())


def pack_hours(hours: NDArray[np.floating]) -> str:
    """Pack hours in float32, 0 where nothing receives."""
    return pack(np.nan_to_num(hours).astype("<f4").tobytes())


def pack_grids(
    samples: Samples, middle: NDArray[np.float64]
) -> tuple[dict[str, object], NDArray[np.int64]]:
    """
    Pack each surface's squares, as ``Packed`` of ``umbra/web/patches.js``.

    Parameters
    ----------
    samples : Samples
    middle : (3,) float64
        Origin of their coordinates, in the samples' frame [m].

    Returns
    -------
    packed : dict
    kept : (n,) int
        The samples that any square shows.
    """
    layout = lay_out_facades(samples, MOST_SQUARES)
    shown, table = np.unique(layout.sample, return_inverse=True)
    floats = np.zeros((len(samples.part), 9), "<f4")
    floats[:, :6] = samples.axes.reshape(-1, 6)
    # Coordinates in the plane from the first square's corner, of places about the middle.
    floats[:, 6:8] = samples.axes @ middle - samples.start + samples.spacing / 2
    floats[:, 8] = layout.side
    return {
        "grids": pack(floats.tobytes()),
        "grid_shape": pack_differences(layout.shape),
        "grid_samples": pack_differences(table),
    }, shown
