"""State: a pass sets all of it, and the block leaves none behind."""

import numpy as np
import pytest

from umbra.errors import UmbraError
from umbra.gl.state import Pass, State, Stencil
from umbra.gl.target import Target

# OpenGL's own initial values (3.3 core, tables 6.12 to 6.23).
ENABLES = {0x0B71, 0x0B90, 0x0C11, 0x0B44, 0x0BE2, 0x864F, 0x3000, 0x8037, 0x8E51}
VALUES = {
    0x0B74: 0x0201,  # depth function: less
    0x0B72: 1,  # depth mask
    0x0B92: 0x0207, 0x8800: 0x0207,  # stencil functions, front and back: always
    0x0B97: 0, 0x8CA3: 0,  # references
    0x0B94: 0x1E00, 0x0B95: 0x1E00, 0x0B96: 0x1E00,  # front operations: keep
    0x8801: 0x1E00, 0x8802: 0x1E00, 0x8803: 0x1E00,  # back operations
    0x0B91: 0,  # stencil clear value
    0x80C9: 1, 0x80C8: 0,  # blend source and destination
    0x8009: 0x8006,  # blend equation: add
    0x0B45: 0x0405,  # cull face: back
}  # fmt: skip

BUSY = Pass(
    depth_test="gequal",
    depth_write=True,
    color_write=False,
    blend="multiply",
    cull="front",
    stencil=Stencil(test="equal", reference=3, front_depth_pass="up", back_depth_fail="down"),
    scissor=(1, 2, 3, 4),
    depth_clamp=True,
    clip_near=True,
    polygon_offset=(1.0, 2.0),
    sample=0,
)


def read_state(gl):
    found = {name: gl.integers(name)[0] for name in VALUES}
    mask = np.zeros(4, np.uint8)
    gl.GetBooleanv(0x0C23, mask.ctypes.data)
    enabled = {name for name in ENABLES if gl.IsEnabled(name)}
    offset = gl.floats(0x8038) + gl.floats(0x2A00)
    return enabled, found, mask.tolist(), offset, gl.floats(0x0B73)


def test_a_block_leaves_nothing_behind(device):
    with Target(device, (4, 3)) as target, State(device) as state:
        target.use()
        state.use(BUSY)
        state.clear(depth=0.5, stencil=7)
    enabled, values, mask, offset, depth = read_state(device.gl)
    assert not enabled
    assert values == VALUES
    assert mask == [1, 1, 1, 1]
    assert offset == [0.0, 0.0]
    assert depth == [1.0]
    assert device.gl.integers(0x0B98)[0] & 0xFF == 0xFF  # stencil write mask
    if device.reverses_depth:
        assert device.gl.integers(0x935D) == [0x935E]  # depth from -1 to 1


def test_an_error_in_a_block_leaves_nothing_behind_either(device):
    def fail():
        with State(device) as state:
            state.use(BUSY)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not read_state(device.gl)[0]


def test_a_pass_sets_everything_that_it_names(device):
    gl = device.gl
    with Target(device, (4, 3)) as target, State(device) as state:
        target.use()
        for other in (Pass(), BUSY, Pass(depth_test="less"), BUSY):
            state.use(other)
        assert {name for name in ENABLES if gl.IsEnabled(name)} == ENABLES
        reverses = device.reverses_depth
        assert gl.integers(0x0B74) == [0x0203 if reverses else 0x0206]  # farther, or as far
        assert gl.floats(0x8038) + gl.floats(0x2A00) == ([-1, -2] if reverses else [1, 2])
        if reverses:
            assert gl.integers(0x935D) == [0x935F]  # depth from 0 to 1
        assert gl.integers(0x0B97) == [3]
        assert [gl.integers(n)[0] for n in (0x0B94, 0x0B95, 0x0B96)] == [0x1E00, 0x1E00, 0x8507]
        assert [gl.integers(n)[0] for n in (0x8801, 0x8802, 0x8803)] == [0x1E00, 0x8508, 0x1E00]
        assert gl.integers(0x0C10, 4) == [1, 2, 3, 4]
        state.use(Pass())
        assert not any(gl.IsEnabled(name) for name in ENABLES)
        assert gl.integers(0x0B72) == [0]


def test_one_may_write_alpha_alone_and_take_the_larger(device):
    gl, mask = device.gl, np.zeros(4, np.uint8)
    with State(device) as state:
        state.use(Pass(color_write="alpha", blend="max"))
        gl.GetBooleanv(0x0C23, mask.ctypes.data)
        assert mask.tolist() == [0, 0, 0, 1]
        assert gl.integers(0x8009) == [0x8008]
        state.use(Pass(color_write="rgb", blend="double"))
        gl.GetBooleanv(0x0C23, mask.ctypes.data)
        assert mask.tolist() == [1, 1, 1, 0]
        assert gl.integers(0x8009) == [0x8006]
        assert [gl.integers(n)[0] for n in (0x80C9, 0x80C8)] == [0x0306, 1]


def test_operations_have_no_order_to_confuse():
    with pytest.raises(TypeError):
        Stencil("always", 0, "up", "down")


def test_depth_bounds_are_refused_where_there_are_none(device):
    if device.has_depth_bounds:
        pytest.skip("this driver has depth bounds")
    with State(device) as state, pytest.raises(UmbraError, match="no depth bounds test"):
        state.use(Pass(depth_bounds=(0.1, 0.9)))


def test_a_clear_passes_by_masks_and_the_pass_scissor(device):
    with Target(device, (4, 3), ("rgba8",)) as target, State(device) as state:
        target.use()
        state.use(Pass())
        state.use(Pass(scissor=(3, 2, 1, 1)))
        state.clear(depth=1.0, stencil=5)
        state.clear(stencil=9, scissor=(0, 0, 2, 1))
        np.testing.assert_array_equal(
            target.read_stencil(), [[5, 5, 5, 5], [5, 5, 5, 5], [9, 9, 5, 5]]
        )
        assert device.gl.integers(0x0B72) == [0]  # the pass writes no depth
        assert device.gl.integers(0x0C10, 4) == [3, 2, 1, 1]
