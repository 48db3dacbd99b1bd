"""In another program's context every public call leaves the OpenGL state as it was."""

import numpy as np
import pytest
from support.shapes import HOUSE, stack_of_triangles

from umbra.errors import UmbraError
from umbra.gl.context import Device
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.functions import TEXTURE_2D
from umbra.gl.plan_sweep import GlSweep
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.state import State
from umbra.gl.target import Target
from umbra.scene import Camera, Mesh, Part, directional_light, make_scene, point_light
from umbra.scene.grid import Grid
from umbra.soft import ball_light

CAMERA = Camera((20, -25, 14), (0, 0, 3), size=(40, 30))
LAMP = point_light((8, -3.3, 20), range=60.0)
INTEGERS = (
    0x8CA6, 0x8CAA, 0x8CA7, 0x8B8D, 0x85B5, 0x8894, 0x8A28, 0x88ED, 0x88EF, 0x84E0,
    0x80C9, 0x80C8, 0x80CB, 0x80CA, 0x8009, 0x883D, 0x0B74, 0x0B72, 0x0B91,
    0x0B92, 0x0B97, 0x0B93, 0x0B94, 0x0B95, 0x0B96, 0x0B98,
    0x8800, 0x8CA3, 0x8CA4, 0x8801, 0x8802, 0x8803, 0x8CA5,
    0x0B45, 0x0B46, 0x0B40, 0x8E4F, 0x0D05, 0x0D02, 0x0CF5, 0x0CF2, 0x0D04,
)  # fmt: skip
QUADS = 0x0BA2, 0x0C10  # viewport and scissor
FLOATS = {0x8005: 4, 0x0C22: 4, 0x0B70: 2, 0x0B73: 1, 0x8038: 1, 0x2A00: 1}
SWITCHES = (
    0x0BE2, 0x0B44, 0x0B71, 0x0B90, 0x0C11, 0x0BD0, 0x809D, 0x864F, 0x8037, 0x8DB9, 0x8C89,
    0x8F9D, 0x809E, 0x8E51, 0x0BF2, 0x3000, 0x3001,
)  # fmt: skip


def look(gl):
    """Read all state that is compared."""
    found = {name: gl.integers(name)[0] for name in INTEGERS}
    found |= {name: gl.integers(name, 4) for name in QUADS}
    found |= {name: gl.floats(name, count) for name, count in FLOATS.items()}
    found |= {("on", name): gl.IsEnabled(name) for name in SWITCHES}
    mask = np.zeros(4, np.uint8)
    for target in range(4):
        gl.GetBooleani_v(0x0C23, target, mask.ctypes.data)
        found["mask", target] = mask.tolist(), gl.IsEnabledi(0x0BE2, target)
    for unit in range(20):
        gl.ActiveTexture(0x84C0 + unit)
        names = 0x8069, 0x9104, 0x8C2C, 0x8919
        found["unit", unit] = [gl.integers(name)[0] for name in names]
    gl.ActiveTexture(found[0x84E0])
    word = np.zeros(4, np.int32)
    gl.GetIntegeri_v(0x8E52, 0, word.ctypes.data)
    found["sample mask"] = int(word[0])
    return found


def set_unusual(theirs, gl):
    """Set the caller's state to values that no pass has; return what keeps it alive."""
    picture = theirs.texture((8, 8), 4)
    frame = theirs.framebuffer([picture])
    other = theirs.framebuffer([theirs.texture((4, 4), 4)])
    buffer = theirs.buffer(b"theirs" * 20)
    program = theirs.program(
        vertex_shader="#version 330\nvoid main() { gl_Position = vec4(0); }",
        fragment_shader="#version 330\nout vec4 c; void main() { c = vec4(1); }",
    )
    array = theirs.vertex_array(program, [])
    sampler = gl.make("Sampler")
    for switch in SWITCHES:
        (gl.Disable if switch in (0x0BD0, 0x809D) else gl.Enable)(switch)
    gl.BindFramebuffer(0x8CA9, frame.glo)
    gl.BindFramebuffer(0x8CA8, other.glo)
    gl.UseProgram(program.glo)
    gl.BindVertexArray(array.glo)
    for target in (0x8892, 0x8A11, 0x88EB, 0x88EC):
        gl.BindBuffer(target, buffer.glo)
    gl.Viewport(1, 2, 3, 4)
    gl.Scissor(0, 1, 2, 1)
    gl.BlendFuncSeparate(0x0305, 0x0304, 0x0302, 0x0303)
    gl.BlendEquationSeparate(0x800A, 0x8007)
    gl.BlendColor(0.1, 0.2, 0.3, 0.4)
    gl.ClearColor(0.5, 0.25, 0.75, 1.0)
    gl.Disablei(0x0BE2, 2)
    gl.ColorMaski(0, 1, 0, 1, 0)
    gl.ColorMaski(1, 0, 0, 1, 1)
    gl.DepthFunc(0x0205)
    gl.DepthMask(0)
    gl.DepthRange(0.25, 0.5)
    gl.ClearDepth(0.25)
    gl.ClearStencil(7)
    for side in (0x0404, 0x0405):
        gl.StencilFuncSeparate(side, 0x0202 + (side & 1), 5, 0x3F)
        gl.StencilOpSeparate(side, 0x1E01, 0x150A, 0x1E02)
        gl.StencilMaskSeparate(side, 0x55 + (side & 1))
    gl.CullFace(0x0408)
    gl.FrontFace(0x0900)
    gl.PolygonMode(0x0408, 0x1B01)
    gl.PolygonOffset(2.0, 3.0)
    gl.ProvokingVertex(0x8E4D)
    gl.SampleMaski(0, 0x5)
    for name, value in ((0x0D05, 8), (0x0D02, 99), (0x0D04, 3), (0x0CF5, 2), (0x0CF2, 77)):
        gl.PixelStorei(name, value)
    for unit in (0, 8, 11, 17):
        gl.bind_texture(unit, picture.glo, TEXTURE_2D)
        gl.BindSampler(unit, sampler)
    gl.ActiveTexture(0x84C0 + 5)
    return frame, other, buffer, program, array, sampler, picture


def list_calls(device):
    """Yield the name of each public call, and what it returns."""
    scene = make_scene([Part("house", "", Mesh(*map(np.asarray, HOUSE)), np.eye(4))])
    turned = make_scene([Part("house", "", scene.parts[0].mesh, np.diag([1, 1, 1.5, 1.0]))])
    renderer = SceneRenderer(scene, 0.0, device=device)
    yield "SceneRenderer", None
    yield "render", renderer.render(CAMERA, [LAMP])
    renderer.draw(CAMERA, [LAMP, LAMP], samples=4)
    yield "draw", renderer.read()
    for soft in ("samples", "wedges", "complexity", "weng"):
        yield soft, renderer.render(CAMERA, [ball_light(LAMP, 0.5)], soft=soft)
    for method in ("alpha", "screen", "z-fail"):
        yield method, renderer.render(CAMERA, [LAMP], method)
    renderer.draw(CAMERA, [LAMP], mask_scale=2)
    yield "small", renderer.read()
    renderer.move(turned)
    yield "move", renderer.render(CAMERA, [LAMP])
    yield "read", renderer.read()
    renderer.release()
    yield "release", None
    with GlFrameCounter(scene, ground=0.0, device=device) as counter:
        yield "GlFrameCounter", None
        view, _ = counter.see(CAMERA)
        yield "see", view.face
        yield "count", counter.count(view, CAMERA, LAMP)
        area = ball_light(LAMP, 0.5)
        yield "visibility", counter.find_visibility(view, CAMERA, [area], "samples")[0]
    yield "released", None
    with GlSweep(scene, None, Grid(-9.5, -9.5, 1.0, 1.0, 20, 20), 0.0, False, device=device) as s:
        yield "masks", s.masks(np.array([[0.48, 0.36, 0.8]]))
    yield "sweep", None


def test_every_public_call_gives_the_callers_state_back(shared_device):
    import moderngl  # noqa: PLC0415

    if shared_device.backend != "egl":
        pytest.skip("one backend of several, egl, does not open here")
    right = list(list_calls(shared_device))
    theirs = moderngl.create_context(require=330, standalone=True, backend="egl")
    with theirs:
        device = Device.of(theirs)
        gl = device.gl
        held = set_unusual(theirs, gl)
        before = look(gl)
        names = []
        for (name, found), (_, expected) in zip(list_calls(device), right, strict=True):
            after = look(gl)
            changed = {
                key: (before[key], after[key]) for key in before if after[key] != before[key]
            }
            assert not changed, (name, changed)
            if expected is not None:
                np.testing.assert_array_equal(found, expected, err_msg=name)
            names.append(name)
        assert len(names) > 15
        device.check("a test ran")
        device.release()
        assert look(gl) == before
        assert held[2].size == 120
    theirs.release()


@pytest.mark.parametrize("bits", [0, 8])
def test_a_framebuffer_without_a_stencil_is_refused(device, bits):
    class Theirs:
        """A framebuffer of another program, which has only what counting asks of a target."""

        size, samples = (40, 30), 1

        def use(self):
            with_stencil.use() if bits else device.gl.BindFramebuffer(0x8CA9, frame.glo)

    picture = device.context.texture((40, 30), 4)
    frame = device.context.framebuffer([picture])
    scene = make_scene(*HOUSE)
    with (
        GlFrameCounter(scene, ground=0.0, device=device) as counter,
        Target(device, (40, 30)) as with_stencil,
        State(device) as state,
    ):
        counter.see(CAMERA)
        plan = counter.planner.plan(counter.planner.project(CAMERA), [LAMP])[0]
        if bits:
            counter.counter.count(state, Theirs(), plan)
        else:
            with pytest.raises(UmbraError, match="stencil") as found:
                counter.counter.count(state, Theirs(), plan)
            assert found.value.bits == 0
    frame.release()
    picture.release()


@pytest.mark.parametrize("is_deep", [False, True])
def test_another_programs_framebuffer_that_cannot_count_is_refused(device, is_deep):
    class Theirs:
        """A framebuffer of another program with a stencil alone, or with depth, too."""

        size, samples = (40, 30), 1

        def use(self):
            whole.use() if is_deep else device.gl.BindFramebuffer(0x8CA9, frame)

    gl = device.gl
    frame, buffer = device.make("Framebuffer"), device.make("Renderbuffer")
    gl.BindFramebuffer(0x8D40, frame)
    gl.BindRenderbuffer(0x8D41, buffer)
    gl.RenderbufferStorage(0x8D41, 0x8D48, 40, 30)
    gl.FramebufferRenderbuffer(0x8D40, 0x8D20, 0x8D41, buffer)
    scene = make_scene(*(stack_of_triangles(600) if is_deep else HOUSE))
    up = directional_light((0, 0.01, 1))
    with (
        GlFrameCounter(scene, ground=-5.0, device=device) as counter,
        Target(device, (40, 30)) as whole,
        State(device) as state,
    ):
        plan = counter.planner.plan(counter.planner.project(CAMERA), [up])[0]
        with pytest.raises(UmbraError) as found:
            counter.counter.count(state, Theirs(), plan)
    assert found.value.most >= 600 if is_deep else found.value.depth == 0
    device.delete("Framebuffer", frame)
    device.delete("Renderbuffer", buffer)


def test_a_callers_errors_are_not_umbras_and_its_open_query_is_refused(shared_device):
    import moderngl  # noqa: PLC0415

    if shared_device.backend != "egl":
        pytest.skip("one backend of several, egl, does not open here")
    theirs = moderngl.create_context(require=330, standalone=True, backend="egl")
    with theirs:
        device = Device.of(theirs)
        gl = device.gl
        with SceneRenderer(make_scene(*HOUSE), 0.0, device=device) as renderer:
            gl.Enable(0xFFFF)
            expected = renderer.render(CAMERA, [LAMP])
            query = gl.make("Query")
            gl.BeginQuery(0x8914, query)
            with pytest.raises(UmbraError) as found:
                renderer.render(CAMERA, [LAMP])
            assert found.value.query == query
            gl.EndQuery(0x8914)
            np.testing.assert_array_equal(renderer.render(CAMERA, [LAMP]), expected)
        device.release()
    theirs.release()
