"""Embree's packets of 16 rays, which embreex does not offer, through the library it ships."""

import ctypes
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.kernels import kernel

__all__ = ["PACKETS", "EmbreePackets", "sort_along_curve"]

PACKETS = "Embree, 16 rays a call"
"""How the tables call this peer."""
_WIDTH = 16
_TRIANGLE, _INDEX, _VERTEX = 0, 0, 1  # RTC_GEOMETRY_TYPE_..., RTC_BUFFER_TYPE_...
_UINT3, _FLOAT3 = 0x5003, 0x9003  # RTC_FORMAT_...
_COHERENT, _ALL_FEATURES = 1 << 16, 0xFFFFFFFF  # RTC_RAY_QUERY_FLAG_..., RTC_FEATURE_FLAG_...
_ORG, _TNEAR, _DIR, _TIME, _TFAR, _MASK = 0, 3, 4, 7, 8, 9  # rows of RTCRay16
_RAY_ROWS = 12
_ALIGNMENT = 64  # of RTCRay16 and of the mask of valid rays [byte]


class _OccludedArguments(ctypes.Structure):
    """``RTCOccludedArguments`` of Embree 4."""

    _fields_ = [
        ("flags", ctypes.c_uint),
        ("feature_mask", ctypes.c_uint),
        ("context", ctypes.c_void_p),
        ("filter", ctypes.c_void_p),
        ("occluded", ctypes.c_void_p),
        ("min_width", ctypes.c_float),
    ]


class EmbreePackets:
    """
    A mesh in a tree of Embree's, asked 16 rays a call through Embree's own interface.

    The library is the one that embreex brings along, so both peers run the same Embree.

    Parameters
    ----------
    vertices : (n, 3) float64
    faces : (m, 3) int32

    Raises
    ------
    InputError
        If embreex is not installed, or its wheel brings no Embree 4.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        self._library = library = _load_library()
        self._device = device = library.rtcNewDevice(b"")
        self._scene = library.rtcNewScene(device)
        geometry = library.rtcNewGeometry(device, _TRIANGLE)
        for kind, layout, values in (
            (_INDEX, _UINT3, np.ascontiguousarray(faces, np.uint32)),
            (_VERTEX, _FLOAT3, np.ascontiguousarray(vertices, np.float32)),
        ):
            buffer = library.rtcSetNewGeometryBuffer(
                geometry, kind, 0, layout, values.strides[0], len(values)
            )
            ctypes.memmove(buffer, values.ctypes.data, values.nbytes)
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(self._scene, geometry)
        library.rtcReleaseGeometry(geometry)
        library.rtcCommitScene(self._scene)
        self._arguments = _OccludedArguments(_COHERENT, _ALL_FEATURES)
        self._run = _make_loop()
        # The loop is compiled at its first call.
        self.find_occluded(np.full((1, 3), -1e4, np.float32), np.array([[0, 0, -1]], np.float32))

    def __del__(self) -> None:
        """Free the tree."""
        for release, handle in (("rtcReleaseScene", "_scene"), ("rtcReleaseDevice", "_device")):
            if hasattr(self, handle):
                getattr(self._library, release)(getattr(self, handle))

    def find_occluded(
        self,
        origins: NDArray[np.float32],
        directions: NDArray[np.float32],
        reach: NDArray[np.float32] | None = None,
    ) -> NDArray[np.bool_]:
        """
        Ask for each ray whether anything lies on it.

        Sixteen neighbours make a packet: sort the origins first (`sort_along_curve`).

        Parameters
        ----------
        origins : (n, 3) float32
        directions : (n, 3) or (1, 3) float32
            One for each ray, or one for all.
        reach : (n,) float32, optional
            How far to look, in lengths of the direction.

        Returns
        -------
        is_occluded : (n,) bool
        """
        is_occluded = np.empty(len(origins), np.bool_)
        far = np.full(1, np.inf, np.float32) if reach is None else reach
        rays, valid = _make_aligned((_RAY_ROWS, _WIDTH)), _make_aligned((1, _WIDTH))
        self._run(
            self._scene, ctypes.addressof(self._arguments), valid.ctypes.data, rays.ctypes.data,
            valid.view(np.int32)[0], rays, rays.view(np.int32),
            origins, directions, far, is_occluded,
        )  # fmt: skip
        return is_occluded


def sort_along_curve(points: NDArray[np.floating[Any]]) -> NDArray[np.intp]:
    """
    Return the order of points along a Z-order (Morton) curve, in which neighbours stay together.

    Parameters
    ----------
    points : (n, 3) float

    Returns
    -------
    order : (n,) intp
    """
    low = points.min(0)
    # 21 bits an axis; cells of equal size along all axes, so that packets are not long and thin.
    size = max(float((points.max(0) - low).max()), np.finfo(np.float32).tiny)
    cells = ((points - low) / size * (2**21 - 1)).astype(np.uint64)
    keys = np.zeros(len(points), np.uint64)
    for bit in range(21):
        for axis in range(3):
            place = cells[:, axis] >> np.uint64(bit) & np.uint64(1)
            keys |= place << np.uint64(3 * bit + axis)
    return np.argsort(keys, kind="stable")


@cache
def _load_library() -> ctypes.CDLL:
    """Load the Embree that embreex ships, with the types of the functions used here."""
    try:
        import embreex  # noqa: PLC0415
    except ImportError:
        msg = (
            "this benchmark compares with Embree, which is not installed; "
            "pip install 'umbra-benchmarks[embree]'"
        )
        raise InputError(msg) from None
    package = Path(embreex.__file__).parent
    found = sorted(path for folder in (package, package.parent / "embreex.libs")
                   for path in folder.glob("*embree4*"))  # fmt: skip
    if not found:
        msg = f"embreex in {package.parent} brings no Embree 4; reinstall it from a wheel of PyPI"
        raise InputError(msg)
    library = ctypes.CDLL(str(found[0]))
    pointer, number, size = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
    for name, result, arguments in (
        ("rtcNewDevice", pointer, [ctypes.c_char_p]),
        ("rtcReleaseDevice", None, [pointer]),
        ("rtcNewScene", pointer, [pointer]),
        ("rtcReleaseScene", None, [pointer]),
        ("rtcNewGeometry", pointer, [pointer, ctypes.c_int]),
        ("rtcReleaseGeometry", None, [pointer]),
        (
            "rtcSetNewGeometryBuffer", pointer,
            [pointer, ctypes.c_int, number, ctypes.c_int, size, size],
        ),
        ("rtcCommitGeometry", None, [pointer]),
        ("rtcAttachGeometry", number, [pointer, pointer]),
        ("rtcCommitScene", None, [pointer]),
        ("rtcOccluded16", None, [pointer, pointer, pointer, pointer]),
    ):  # fmt: skip
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def _make_aligned(shape: tuple[int, int]) -> NDArray[np.float32]:
    """Make zeros that begin at a multiple of 64 bytes."""
    size = 4 * shape[0] * shape[1]
    raw = np.zeros(size + _ALIGNMENT, np.uint8)
    begin = -raw.ctypes.data % _ALIGNMENT
    return raw[begin : begin + size].view(np.float32).reshape(shape)


@cache
def _make_loop() -> Callable[..., None]:
    """Compile the loop that fills packets, asks Embree, and reads the answers."""
    occluded16 = _load_library().rtcOccluded16

    @kernel
    def run(scene, arguments, valid_at, rays_at, valid, rays, flags, origins, directions, far, out):
        # Rays that no packet's end holds stay invalid; no mask, time 0.
        flags[_MASK] = -1
        flags[_TIME] = 0
        count = len(origins)
        for first in range(0, count, _WIDTH):
            last = min(first + _WIDTH, count)
            for lane in range(_WIDTH):
                ray = min(first + lane, count - 1)
                along = ray if len(directions) > 1 else 0
                for axis in range(3):
                    rays[_ORG + axis, lane] = origins[ray, axis]
                    rays[_DIR + axis, lane] = directions[along, axis]
                rays[_TNEAR, lane] = 0.0
                rays[_TFAR, lane] = far[ray if len(far) > 1 else 0]
                valid[lane] = -1 if first + lane < count else 0
            occluded16(valid_at, scene, rays_at, arguments)
            # Embree sets the far end of a ray that meets something to minus infinity.
            for ray in range(first, last):
                out[ray] = rays[_TFAR, ray - first] < 0.0

    return run
