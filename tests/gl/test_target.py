"""Framebuffers: what is drawn is read back, row 0 the top; all is released."""

import numpy as np
import pytest

from umbra.errors import InputError, UmbraError
from umbra.gl.state import Pass, State
from umbra.gl.target import FORMATS, Target

WRITE = Pass(color_write=True)


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_holds_what_is_cleared(device, name):
    with Target(device, (5, 3), (name,)) as target, State(device) as state:
        target.use()
        state.use(WRITE)
        target.clear_color(-7 if name == "r32i" else 0.25)
        values = target.read()
    assert values.shape[:2] == (3, 5)
    assert values.dtype == FORMATS[name][3]
    expected = {"r32i": -7, "rgba8": 64}.get(name, 0.25)
    np.testing.assert_array_equal(values, expected)


def test_row_0_is_the_top(device):
    with Target(device, (4, 3), ("r32i",)) as target, State(device) as state:
        target.use()
        state.use(WRITE)
        target.clear_color(1)
        state.use(Pass(color_write=True, scissor=(0, 0, 1, 1)))  # OpenGL's lowest row
        target.clear_color(2)
        np.testing.assert_array_equal(target.read(), [[1, 1, 1, 1], [1, 1, 1, 1], [2, 1, 1, 1]])


def test_several_attachments(device):
    with Target(device, (2, 2), ("rgba16f", "r32i")) as target, State(device) as state:
        target.use()
        state.use(WRITE)
        target.clear_color(0.5, 0.25, 0.125, 1.0)
        target.clear_color(9, attachment=1)
        np.testing.assert_array_equal(target.read()[0, 0], [0.5, 0.25, 0.125, 1.0])
        np.testing.assert_array_equal(target.read(1), np.full((2, 2), 9))


def test_depth_and_stencil_may_be_shared(device):
    with Target(device, (2, 2)) as one:
        other = Target(device, (2, 2), ("r32f",), depth_of=one)
        with State(device) as state:
            one.use()
            state.clear(depth=0.5, stencil=200)
            other.use()
            np.testing.assert_array_equal(other.read_stencil(), np.full((2, 2), 200))
            np.testing.assert_allclose(other.read_depth(), 0.5, atol=1e-6)
        other.release()
        np.testing.assert_array_equal(one.read_stencil(), np.full((2, 2), 200))
        assert one.stencil_bits() == 8


def test_a_picture_that_is_too_large_is_refused(device):
    with pytest.raises(InputError, match=r"at most .* choose a smaller size="):
        Target(device, (10**6, 10))


def test_no_stencil_is_an_error(device, monkeypatch):
    monkeypatch.setattr(Target, "stencil_bits", lambda _: 0)
    with pytest.raises(UmbraError, match=r"no framebuffer .*8 of stencil .*use device='cpu'"):
        Target(device, (4, 4))
