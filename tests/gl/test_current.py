"""Several contexts in one process, on any backend, and threads: none draws another's scene."""

import os
import shutil
import subprocess
import sys
import threading
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from support.desk import Display
from support.shapes import HOUSE, box

from umbra.errors import UmbraError
from umbra.gl.backends import BACKENDS
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.plan_sweep import GlSweep
from umbra.gl.scene_renderer import SceneRenderer
from umbra.gl.target import Target
from umbra.scene import Camera, make_scene, point_light
from umbra.scene.grid import Grid

CAMERA = Camera((20, -25, 14), (0, 0, 3), size=(40, 30))
LAMP = point_light((8, -3.3, 20))
SCENES = [
    HOUSE,
    box((-5, -1, 0), (-4, 4, 9)),
    box((1, -6, 0), (6, -5, 2)),
    box((0, 0, 4), (5, 5, 5)),
]
GRID = Grid(-9.5, -9.5, 1.0, 1.0, 20, 20)
SUNS = np.array([[0.48, 0.36, 0.8], [-0.6, 0.0, 0.8]])


def count_alone(mesh):
    """Count in a context that is alone in its thread's attention."""
    with GlFrameCounter(make_scene(*mesh), ground=0.0) as counter:
        view, _ = counter.see(CAMERA)
        return counter.count(view, CAMERA, LAMP)


@pytest.fixture(scope="module")
def alone(shared_device):
    return [count_alone(mesh) for mesh in SCENES]


def test_counters_in_turn_count_their_own_scenes(alone):
    counters = [GlFrameCounter(make_scene(*mesh), ground=0.0) for mesh in SCENES]
    views = [counter.see(CAMERA)[0] for counter in counters]
    for _ in range(2):
        for counter, view, expected in zip(counters, views, alone, strict=True):
            np.testing.assert_array_equal(counter.count(view, CAMERA, LAMP), expected)
    # One that goes takes nothing from the others.
    for gone, counter in enumerate(counters):
        counter.release()
        for other, view, expected in list(zip(counters, views, alone, strict=True))[gone + 1 :]:
            np.testing.assert_array_equal(other.count(view, CAMERA, LAMP), expected)


def test_renderers_counters_and_sweeps_in_turn(shared_device, alone):
    def make(mesh):
        scene = make_scene(*mesh)
        return (
            SceneRenderer(scene, ground=0.0),
            GlFrameCounter(scene, ground=0.0),
            GlSweep(scene, None, GRID, 0.0, False),
        )

    def use(renderer, counter, sweep):
        yield renderer.render(CAMERA, [LAMP])
        yield counter.see(CAMERA)[1].part
        yield counter.count(counter.see(CAMERA)[0], CAMERA, LAMP)
        yield sweep.masks(SUNS)

    expected = []
    for mesh in SCENES[:2]:
        things = make(mesh)
        expected.append([np.array(found) for found in use(*things)])
        for thing in things:
            thing.release()
    both = [make(mesh) for mesh in SCENES[:2]]
    for first, second, *right in zip(use(*both[0]), use(*both[1]), *expected, strict=True):
        np.testing.assert_array_equal(first, right[0])
        np.testing.assert_array_equal(second, right[1])
    assert (expected[0][0] != expected[1][0]).any()
    for things in both:
        for thing in things:
            thing.release()


def test_what_was_current_is_current_again(shared_device):
    import moderngl  # noqa: PLC0415

    if shared_device.backend != "egl":
        pytest.skip("one backend of several, egl, does not open here")
    Target(shared_device, (8, 8)).release()  # current until another is
    theirs = moderngl.create_context(require=330, standalone=True, backend="egl")
    buffer = theirs.buffer(b"theirs: 1234")
    counter = GlFrameCounter(make_scene(*HOUSE), ground=0.0)
    view, _ = counter.see(CAMERA)
    counter.count(view, CAMERA, LAMP)
    counter.release()
    assert buffer.read() == b"theirs: 1234"
    buffer.write(b"THEIRS")
    assert buffer.read() == b"THEIRS: 1234"
    assert theirs.error == "GL_NO_ERROR"
    theirs.release()


def test_a_released_device_says_so(shared_device):
    counter = GlFrameCounter(make_scene(*HOUSE), ground=0.0)
    view, _ = counter.see(CAMERA)
    counter.release()
    with pytest.raises(UmbraError, match="device was released; open another"):
        counter.count(view, CAMERA, LAMP)
    counter.device.release()  # twice is once


def test_threads_that_each_own_one(alone):
    found, errors = {}, []
    together = threading.Barrier(len(SCENES))

    def work(k):
        try:
            with GlFrameCounter(make_scene(*SCENES[k]), ground=0.0) as counter:
                view, _ = counter.see(CAMERA)
                for _ in range(3):
                    together.wait(60)
                    found[k] = counter.count(view, CAMERA, LAMP)
        except Exception as error:  # noqa: BLE001
            errors.append(error)
            together.abort()

    threads = [threading.Thread(target=work, args=(k,)) for k in range(len(SCENES))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    for k, expected in enumerate(alone):
        np.testing.assert_array_equal(found[k], expected)


def test_another_threads_device_is_refused_in_a_line(device):
    said = []

    def work():
        for use in (lambda: Target(device, (8, 8)), lambda: device.context.buffer(b"a")):
            try:
                use()
            except UmbraError as error:
                said.append(str(error))

    thread = threading.Thread(target=work, name="the other one")
    thread.start()
    thread.join()
    assert len(said) == 2
    for line in said:
        assert "opened in the thread 'MainThread' and is used in 'the other one'" in line
        assert "open one in each thread that draws" in line
        assert "\n" not in line


ALL = """
import sys
import numpy as np
from support.shapes import HOUSE, box
from umbra.errors import UmbraError
from umbra.gl.backends import BACKENDS
from umbra.gl.context import open_device
from umbra.gl.frame_counter import GlFrameCounter
from umbra.scene import Camera, make_scene, point_light
camera, lamp = Camera((20, -25, 14), (0, 0, 3), size=(40, 30)), point_light((8, -3.3, 20))
meshes = [HOUSE, box((-5, -1, 0), (-4, 4, 9)), box((1, -6, 0), (6, -5, 2))]
counters, names = [], []
for name in BACKENDS:
    try:
        device = open_device(name)
    except UmbraError as error:
        continue
    names.append(name)
    for mesh in meshes:
        counters.append((mesh, GlFrameCounter(make_scene(*mesh), ground=0.0, device=device)))
expected = {}
for turn in range(3):
    for mesh, counter in counters[::1 - 2 * (turn % 2)]:
        view, _ = counter.see(camera)
        count = counter.count(view, camera, lamp)
        right = expected.setdefault(id(mesh), count)
        assert (count != right).mean() < 0.01, (turn, counter.device.backend)
        assert count.max() == 1
assert len({count.tobytes() for count in expected.values()}) == 3
for _, counter in counters:
    counter.release()
for device in {counter.device for _, counter in counters}:
    assert not device.live
    device.release()
print(*names)
"""


def run_beside(script, timeout=None):
    """Run a script in a process of its own, on a display of its own where there can be one."""
    folder = Path(__file__).parents[1]
    with Display() if shutil.which("Xvfb") else nullcontext() as display:
        done = subprocess.run(
            [sys.executable, "-c", script],
            cwd=folder, capture_output=True, text=True, check=False,
            timeout=timeout, env=display.environment if display else None,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_every_backend_that_opens_beside_every_other():
    found = run_beside(ALL)
    if not found:
        pytest.skip("there is no OpenGL here")
    assert set(found) <= set(BACKENDS)


FORK = """
import os, sys
import numpy as np
from support.shapes import HOUSE
from umbra.errors import UmbraError
from umbra.gl.frame_counter import GlFrameCounter
from umbra.scene import Camera, make_scene
camera, scene = Camera((20, -25, 14), (0, 0, 3), size=(40, 30)), make_scene(*HOUSE)
kept = GlFrameCounter(scene, ground=0.0)
kept.see(camera)
child = os.fork()
if not child:
    lines = []
    for see in (lambda: kept.see(camera), lambda: GlFrameCounter(scene, ground=0.0)):
        try:
            see()
        except UmbraError as error:
            lines.append(str(error))
    print(len(lines), *("spawn" in line and "\\n" not in line for line in lines), flush=True)
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
kept.see(camera)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_after_a_fork_a_line_says_what_would_hang(shared_device):
    assert run_beside(FORK, timeout=300) == ["2", "True", "True"]


WINDOW = """
import sys
import numpy as np
from support.shapes import HOUSE, box
try:
    from umbra.window.screen import Screen
    screen = Screen("umbra", (300, 200), "umbra render")
except Exception as error:
    print("none:", error)
    sys.exit()
from umbra.gl.frame_counter import GlFrameCounter
from umbra.gl.scene_renderer import SceneRenderer as Renderer
from umbra.scene import Camera, make_scene, point_light
screen.start_gui()
camera, lamp = Camera((20, -25, 14), (0, 0, 3), size=(40, 30)), point_light((8, -3.3, 20))
scene, other = make_scene(*HOUSE), make_scene(*box((-5, -1, 0), (-4, 4, 9)))
with Renderer(scene, ground=0.0, device=screen.device) as renderer:
    first = renderer.render(camera, [lamp])
    with GlFrameCounter(other, ground=0.0) as counter, Renderer(other, ground=0.0) as beside:
        counts, pictures = [], []
        for _ in range(3):
            counts.append(counter.count(counter.see(camera)[0], camera, lamp))
            screen.begin()
            pictures.append(beside.render(camera, [lamp]))
            assert (renderer.render(camera, [lamp]) == first).all()
            screen.end()
        assert (counts[0] == counts[1:]).all() and counts[0].any()
        assert (pictures[0] == pictures[1:]).all() and (pictures[0] != first).any()
    screen.begin()
    screen.end()
    assert (renderer.render(camera, [lamp]) == first).all()
assert not screen.device.live
screen.close()
print("right")
"""


def test_a_window_beside_devices_without_one():
    found = run_beside(WINDOW)
    if found[0] == "none:":
        pytest.skip(f"no window can be tried: {' '.join(found[1:])}")
    assert found == ["right"]
