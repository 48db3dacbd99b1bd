"""Pixels of a camera's picture as receivers."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.ground.choice import find_ground
from umbra.machine import find_memory, name_memory
from umbra.receivers.kind import ReceiverKind, Request
from umbra.receivers.orthographic import PIXEL_BYTES
from umbra.receivers.seen import SeenRaster, ViewModel, ViewTile
from umbra.scene import Camera
from umbra.scene.grid import Grid

__all__ = ["CameraPicture"]

_PIXELS = (1024, 768)
_STEEPEST = 1e-9  # horizontal distance to the target of a camera that looks straight down [m]


class CameraPicture(ReceiverKind):
    """Surfaces that a camera sees, including the ground plane."""

    name = "camera"
    has_scale = False
    formats = ()

    def lay_out(self, request: Request) -> SeenRaster:
        """Find the surfaces visible to the camera."""
        ground = find_ground(request.scene, request.options.ground)
        level, plane = ground.level, None if ground.is_added else ground.level
        shown = request.find_shown()
        eye, target, fov = request.options.eye, request.options.target, request.options.fov
        size = request.options.size
        cols, rows = size or _PIXELS
        whole = Camera(np.array(eye), np.array(target), size=(cols, rows), fov=fov)
        casting = request.prepare()

        def make_camera(grid: Grid) -> Camera:
            return Camera(whole.eye, whole.target, size=(grid.cols, grid.rows), fov=fov)

        model = ViewModel(
            request.scene, casting.soup, casting.caster, request.threads, request.casters,
            make_camera, plane, shown, canopy=request.canopy,
            lights=request.lights, proposed=request.find_proposed(),
        )  # fmt: skip
        bytes_each = PIXEL_BYTES + request.bytes_kept + request.bytes_of_masks
        if cols * rows * bytes_each > find_memory():
            msg = (
                f"a picture of {cols}x{rows} pixels needs {cols * rows * bytes_each / 1e9:.1f} GB "
                f"and {name_memory(find_memory())}; give a smaller size="
            )
            raise InputError(msg, option="size", size=size)
        grid = Grid(0.0, 0.0, 1.0, 1.0, cols, rows)
        tile = model.make_tile(grid)
        return SeenRaster(
            self, model, tile.shape, ("row", "col"), _find_areas(tile),
            {"ground_z": level, **ground.describe()},
            x=grid.x, y=grid.y, ground=level, grid=grid, tile=tile,
        )  # fmt: skip

    def describe_receivers(self, study: Any) -> str:
        """Describe the camera."""
        facts = study.facts
        eye, target = (
            ", ".join(f"{float(v):g}" for v in np.asarray(facts[name]).ravel())
            for name in ("eye", "target")
        )
        return f"what is seen from {eye} toward {target}, {facts['fov_deg']:g}° high"

    def tell_view(self, facts: dict[str, Any], receivers: str) -> str:
        """Name the view."""
        return ", a camera\N{RIGHT SINGLE QUOTATION MARK}s view"

    def tell_cells(self, grid: Grid, facts: dict[str, Any]) -> str:
        """Describe the camera."""
        eye, target = (
            ", ".join(f"{float(v):.6g}" for v in np.asarray(facts[name]).ravel())
            for name in ("eye", "target")
        )
        return f"from {eye} toward {target}, {facts['fov_deg']:g}° high"

    def find_north(self, facts: dict[str, Any], true_north: float) -> tuple[float | None, float]:
        """Find the direction of true north in the picture; none if it looks straight down."""
        way = np.asarray(facts["target"]) - np.asarray(facts["eye"])
        level = math.hypot(way[0], way[1])
        if level < _STEEPEST:
            return None, 1.0
        toward = math.degrees(math.atan2(way[0], way[1]))
        return true_north - toward, abs(way[2]) / math.hypot(level, way[2])

    def find_counted(self, study: Any) -> None:
        """Count none: a pixel has no area."""


def _find_areas(tile: ViewTile) -> NDArray[np.float64]:
    """Return the area of surface that each pixel of a perspective picture shows [m2]."""
    camera = tile.camera
    depth = (np.nan_to_num(tile.frame.position[::-1]) - camera.eye) @ camera.axes()[2]
    ray = np.nan_to_num(tile.frame.position[::-1]) - camera.eye
    length = np.maximum(np.linalg.norm(ray, axis=-1), 1e-12)
    pixel = 2 * math.tan(math.radians(camera.fov) / 2) / camera.size[1]
    facing = -np.einsum("ijk,ijk->ij", np.nan_to_num(tile.frame.normal[::-1]), ray) / length
    cosine = np.maximum(depth / length, 1e-12)
    return np.where(tile.is_seen, pixel**2 * depth**2 / np.maximum(facing, 1e-6) * cosine, 0.0)
