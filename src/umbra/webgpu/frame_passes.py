"""FramePasses on a wgpu device: the visible faces, and counts by the arrays of a plan."""

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from umbra.errors import InputError
from umbra.gl.plan_arrays import PlannedVolumes, VolumePass
from umbra.gl.volume_plan import STENCIL_MOST, Z_PASS
from umbra.rays.depth import NOTHING
from umbra.webgpu.adapter import load_shader

__all__ = ["FramePasses"]

_DEPTH = "depth32float-stencil8"
# A floor's own triangles round differently: the ground is behind by a few steps of depth.
_STEPS = 8
_OPERATIONS = {"keep": "keep", "up": "increment-wrap", "down": "decrement-wrap"}
# Depth is 1 near and 0 far away. In floats, what fails the depth test behind is what counts.
_NEARER, _FLOAT_TESTS = (
    "greater",
    {"z_pass": "greater", "z_fail": "less-equal", "light_cap": "always"},
)
_VERTEX, _INDEX, _UNIFORM, _STORAGE, _FILLED, _MAPPED = 0x20, 0x10, 0x40, 0x80, 0x8, 0x1
_ATTACHED, _FETCHED, _COPIED = 0x10, 0x4, 0x1  # of textures
_ADDED = {"src_factor": "one", "dst_factor": "one", "operation": "add"}
_SUM = {"format": "r32float", "blend": {"color": _ADDED, "alpha": _ADDED}}
_ROW = 256  # bytes of which a row that is read is a multiple
_Handle = Any


class FramePasses:
    """
    Draws one scene's faces and volumes into textures of its own.

    Parameters
    ----------
    device : wgpu.GPUDevice
    corners : (n_faces, 3) uint32
        Points of each face.
    """

    def __init__(self, device: _Handle, corners: NDArray[np.uint32]) -> None:
        self._device = device
        self._n_corners = corners.size
        self._corners = self._upload(corners if corners.size else np.zeros(1, np.uint32), _STORAGE)
        self._size = (0, 0)
        self._textures: dict[str, _Handle] = {}

    def find_faces(
        self,
        size: tuple[int, int],
        matrix: NDArray[np.float32],
        points: NDArray[np.float64],
        height: float | None,
        n_ground: int,
    ) -> NDArray[np.int32]:
        """
        Draw the scene's faces, and the ground at a height relative to the eye.

        Returns the visible face of each pixel, (rows, cols), row 0 at the top.
        """
        self._fit(size)
        vertices = np.ones((max(len(points), 1), 4), np.float32)
        vertices[: len(points), :3] = points
        view = self._upload(_pack(matrix, height=height or 0.0), _UNIFORM)
        stored = self._upload(vertices, _STORAGE)
        encoder = self._device.create_command_encoder()
        render = encoder.begin_render_pass(
            color_attachments=[self._attach("face", (NOTHING, 0, 0, 0))],
            depth_stencil_attachment=self._attach_depth(
                depth_load_op="clear", depth_store_op="store", depth_clear_value=0.0,
            ),
        )  # fmt: skip
        drawn = (
            ("draw_faces", self._n_corners),
            ("draw_ground", 0 if height is None else n_ground),
        )
        for entry, count in drawn:
            if count:
                pipeline = _make_surface_pipeline(self._device, entry)
                buffers = [view, stored, self._corners] if entry == "draw_faces" else [view]
                render.set_pipeline(pipeline)
                render.set_bind_group(0, self._bind(pipeline, buffers))
                render.draw(count)
        render.end()
        self._device.queue.submit([encoder.finish()])
        return self._read("face", np.int32)

    def count(self, volumes: PlannedVolumes) -> NDArray[np.int32]:
        """
        Count volumes at each pixel of the last ``find_faces``, (rows, cols).

        In the stencil, or in floats where more than 255 may overlap.
        """
        self._draw(volumes)
        if volumes.deepest > STENCIL_MOST:
            return np.rint(self._read("sum", np.float32)).astype(np.int32)
        counts = self._read_stencil()
        if volumes.deepest <= STENCIL_MOST // 2:
            counts[counts > STENCIL_MOST // 2] -= STENCIL_MOST + 1  # below 0 on an edge: it wrapped
        return counts

    def find_share(self, some: Iterable[PlannedVolumes]) -> NDArray[np.float32]:
        """
        Find the share of plans that count 0 at each pixel of the last ``find_faces``, (rows, cols).

        What counts is added up on the device: a plan is drawn, and nothing of it read back.
        """
        n, loads = 0, {"load_op": "clear"}
        for volumes in some:
            self._draw(volumes)
            in_floats = volumes.deepest > STENCIL_MOST
            pipeline = _make_dark_pipeline(self._device, in_floats=in_floats)
            encoder = self._device.create_command_encoder()
            render = encoder.begin_render_pass(
                color_attachments=[{**self._attach("dark", (0, 0, 0, 0)), **loads}],
                depth_stencil_attachment=self._attach_depth(stencil_read_only=True),
            )
            render.set_pipeline(pipeline)
            render.set_stencil_reference(0)
            if in_floats:
                bound = [{"binding": 1, "resource": self._textures["sum"].create_view()}]
                layout = pipeline.get_bind_group_layout(0)
                render.set_bind_group(
                    0, self._device.create_bind_group(layout=layout, entries=bound)
                )
            render.draw(3)
            render.end()
            self._device.queue.submit([encoder.finish()])
            n, loads = n + 1, {"load_op": "load"}
        return (1.0 - self._read("dark", np.float32).astype(np.float64) / n).astype(np.float32)

    def _draw(self, volumes: PlannedVolumes) -> None:
        """Count volumes in the stencil, or in ``sum``."""
        in_floats = volumes.deepest > STENCIL_MOST
        vertices = self._upload(volumes.vertices, _VERTEX)
        indices = self._upload(volumes.indices, _INDEX)
        encoder = self._device.create_command_encoder()
        color = [self._attach("sum", (float(volumes.start), 0, 0, 0))] if in_floats else []
        render = encoder.begin_render_pass(
            color_attachments=color,
            depth_stencil_attachment=self._attach_depth(
                stencil_load_op="clear", stencil_store_op="store",
                stencil_clear_value=volumes.start,
            ),
        )  # fmt: skip
        if volumes.passes:
            render.set_vertex_buffer(0, vertices)
            render.set_index_buffer(indices, "uint32")
        for volume_pass in volumes.passes:
            pipeline = _make_volume_pipeline(self._device, volume_pass, in_floats=in_floats)
            side = 1.0 if volume_pass.kind == Z_PASS else -1.0
            view = self._upload(_pack(volumes.matrix, volumes.near, side=side), _UNIFORM)
            render.set_pipeline(pipeline)
            render.set_bind_group(0, self._bind(pipeline, [view]))
            render.draw_indexed(volume_pass.count, 1, volume_pass.first)
        render.end()
        self._device.queue.submit([encoder.finish()])

    def _fit(self, size: tuple[int, int]) -> None:
        """Make the textures of a size [pixels]."""
        limit = self._device.limits["max-texture-dimension-2d"]
        if max(size) > limit:
            msg = (
                f"a picture of {size[0]}x{size[1]} pixels is too large for device='wgpu', "
                f"which draws at most {limit}x{limit}; choose a smaller size="
            )
            raise InputError(msg, option="size", limit=limit)
        if size != self._size:
            self.release()
            formats = {"face": "r32sint", "sum": "r32float", "dark": "r32float", "depth": _DEPTH}
            self._textures = {
                name: self._device.create_texture(
                    size=(*size, 1), format=form,
                    usage=_ATTACHED | _FETCHED | (0 if name == "depth" else _COPIED),
                )
                for name, form in formats.items()
            }  # fmt: skip
            self._size = size

    def _attach(self, name: str, clear: tuple[float, ...]) -> dict[str, Any]:
        return {
            "view": self._textures[name].create_view(),
            "load_op": "clear", "store_op": "store", "clear_value": clear,
        }  # fmt: skip

    def _attach_depth(self, **how: Any) -> dict[str, Any]:
        """Attach depth and stencil; of the one that ``how`` does not name nothing changes."""
        other = "stencil" if "depth_load_op" in how else "depth"
        return {"view": self._textures["depth"].create_view(), f"{other}_read_only": True, **how}

    def _bind(self, pipeline: _Handle, buffers: list[_Handle]) -> _Handle:
        entries = [
            {"binding": binding, "resource": {"buffer": buffer, "offset": 0, "size": buffer.size}}
            for binding, buffer in enumerate(buffers)
        ]
        layout = pipeline.get_bind_group_layout(0)
        return self._device.create_bind_group(layout=layout, entries=entries)

    def _upload(self, values: NDArray, usage: int) -> _Handle:
        data = np.ascontiguousarray(values)
        if not data.nbytes:
            data = np.zeros(4, np.float32)
        return self._device.create_buffer_with_data(data=data, usage=usage | _FILLED)

    def _read_stencil(self) -> NDArray[np.int32]:
        """Read the stencil by way of the picture of faces."""
        pipeline = _make_stencil_pipeline(self._device)
        stencil = self._textures["depth"].create_view(format="stencil8", aspect="stencil-only")
        encoder = self._device.create_command_encoder()
        render = encoder.begin_render_pass(color_attachments=[self._attach("face", (0, 0, 0, 0))])
        render.set_pipeline(pipeline)
        bound = [{"binding": 0, "resource": stencil}]
        layout = pipeline.get_bind_group_layout(0)
        render.set_bind_group(0, self._device.create_bind_group(layout=layout, entries=bound))
        render.draw(3)
        render.end()
        self._device.queue.submit([encoder.finish()])
        return self._read("face", np.int32)

    def _read(self, name: str, dtype: type) -> NDArray:
        """Read a picture, (rows, cols), row 0 at the top."""
        cols, rows = self._size
        width = np.dtype(dtype).itemsize * cols
        row = -(-width // _ROW) * _ROW
        buffer = self._device.create_buffer(size=row * rows, usage=_FILLED | _MAPPED)
        encoder = self._device.create_command_encoder()
        encoder.copy_texture_to_buffer(
            {"texture": self._textures[name]},
            {"buffer": buffer, "offset": 0, "bytes_per_row": row, "rows_per_image": rows},
            (cols, rows, 1),
        )
        self._device.queue.submit([encoder.finish()])
        buffer.map_sync("READ")
        data = np.frombuffer(buffer.read_mapped(copy=True), np.uint8).reshape(rows, row)
        buffer.destroy()
        return np.ascontiguousarray(data[:, :width]).view(dtype)

    def release(self) -> None:
        """Free the textures."""
        for texture in self._textures.values():
            texture.destroy()
        self._textures, self._size = {}, (0, 0)


def _pack(
    matrix: NDArray[np.float32],
    near: NDArray[np.float32] | None = None,
    *,
    height: float = 0.0,
    side: float = 0.0,
) -> NDArray[np.float32]:
    """Lay the shaders' ``View`` out: columns of the matrix, then the rest."""
    rest = [*(np.zeros(2) if near is None else near), height, side]
    return np.concatenate([matrix.T.ravel(), rest]).astype(np.float32)


@lru_cache
def _load_module(device: _Handle, name: str) -> _Handle:
    return device.create_shader_module(code=load_shader(name))


@lru_cache
def _make_surface_pipeline(device: _Handle, entry: str) -> _Handle:
    module = _load_module(device, "surface.wgsl")
    return device.create_render_pipeline(
        layout="auto",
        vertex={"module": module, "entry_point": entry, "buffers": []},
        primitive={"topology": "triangle-list"},
        depth_stencil={
            "format": _DEPTH, "depth_write_enabled": True, "depth_compare": _NEARER,
            "depth_bias": -_STEPS if entry == "draw_ground" else 0,
        },
        fragment={
            "module": module, "entry_point": "show_face", "targets": [{"format": "r32sint"}],
        },
    )  # fmt: skip


@lru_cache
def _make_stencil_pipeline(device: _Handle) -> _Handle:
    module = _load_module(device, "stencil.wgsl")
    return device.create_render_pipeline(
        layout="auto",
        vertex={"module": module, "entry_point": "fill", "buffers": []},
        primitive={"topology": "triangle-list"},
        fragment={"module": module, "entry_point": "read", "targets": [{"format": "r32sint"}]},
    )


@lru_cache
def _make_dark_pipeline(device: _Handle, *, in_floats: bool) -> _Handle:
    """Make a pipeline that adds 1 where the stencil, or a float, is not 0."""
    module = _load_module(device, "stencil.wgsl")
    kept = {"fail_op": "keep", "depth_fail_op": "keep", "pass_op": "keep"}
    side = {"compare": "always" if in_floats else "not-equal", **kept}
    return device.create_render_pipeline(
        layout="auto",
        vertex={"module": module, "entry_point": "fill", "buffers": []},
        primitive={"topology": "triangle-list"},
        depth_stencil={
            "format": _DEPTH, "depth_write_enabled": False, "depth_compare": "always",
            "stencil_front": side, "stencil_back": side, "stencil_write_mask": 0,
        },
        fragment={
            "module": module, "entry_point": "add_float" if in_floats else "add",
            "targets": [_SUM],
        },
    )  # fmt: skip


def _make_volume_pipeline(device: _Handle, volume_pass: VolumePass, *, in_floats: bool) -> _Handle:
    test = _NEARER if volume_pass.depth_test == "less" else volume_pass.depth_test
    if in_floats:
        test = _FLOAT_TESTS[volume_pass.kind]
    operations = () if in_floats else (volume_pass.front, volume_pass.back)
    return _find_volume_pipeline(device, test, operations, volume_pass.clamps_depth)


@lru_cache
def _find_volume_pipeline(
    device: _Handle, test: str, operations: tuple[tuple[str, str], ...], clamps: bool
) -> _Handle:
    """Make a pipeline that adds to the stencil by operations, or to floats without any."""
    module = _load_module(device, "volume.wgsl")
    sides = {}
    for side, (fails, passes) in zip(("front", "back"), operations, strict=False):
        sides[f"stencil_{side}"] = {
            "compare": "always", "fail_op": "keep",
            "depth_fail_op": _OPERATIONS[fails], "pass_op": _OPERATIONS[passes],
        }  # fmt: skip
    fragment = {
        "module": module,
        "entry_point": "count_in_stencil" if operations else "count_in_floats",
        "targets": [] if operations else [_SUM],
    }
    return device.create_render_pipeline(
        layout=_find_layout(device),
        vertex={
            "module": module,
            "entry_point": "draw_clamped" if clamps else "draw_clipped",
            "buffers": [
                {
                    "array_stride": 16,
                    "attributes": [{"format": "float32x4", "offset": 0, "shader_location": 0}],
                }
            ],
        },
        primitive={"topology": "triangle-list"},
        depth_stencil={
            "format": _DEPTH, "depth_write_enabled": False, "depth_compare": test, **sides,
        },
        fragment=fragment,
    )  # fmt: skip


@lru_cache
def _find_layout(device: _Handle) -> _Handle:
    """Return the layout of volumes' pipelines: one uniform for both shaders."""
    both = 0x1 | 0x2
    entry = {"binding": 0, "visibility": both, "buffer": {"type": "uniform"}}
    group = device.create_bind_group_layout(entries=[entry])
    return device.create_pipeline_layout(bind_group_layouts=[group])
