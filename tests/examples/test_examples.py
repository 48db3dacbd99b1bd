"""Every example runs as shown, in a folder of its own."""

import itertools
import shutil
from ctypes.util import find_library
from pathlib import Path

import moderngl
import numpy as np
import pytest
from PIL import Image
from support.desk import Display
from support.forks import run_python

import umbra
from umbra.errors import UmbraError
from umbra.gl.context import open_device
from umbra.methods import SOFT
from umbra.volume.inspection import inspect_scene

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name, *arguments):
    done = run_python(EXAMPLES / name, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def quarter(tmp_path_factory):
    file = tmp_path_factory.mktemp("quarter") / "block.city.json"
    assert run("city_block.py", file).strip() == str(file)
    return file


def test_each_example_has_a_test():
    tested = Path(__file__).read_text(encoding="utf-8")
    assert [p.name for p in EXAMPLES.glob("*.py") if f'"{p.name}"' not in tested] == []


def test_the_quarter_is_closed_and_in_vienna(quarter):
    scene = umbra.read(quarter)
    assert scene.notes == ()
    assert scene.crs == "EPSG:31256"
    assert (scene.latitude, scene.longitude) == pytest.approx((48.2, 16.369), abs=1e-3)
    found = inspect_scene(scene)
    assert found.total.closed
    assert found.total.degenerate_triangles == found.total.duplicate_triangles == 0
    kinds = {part.kind for part in scene.parts}
    assert kinds == {"WallSurface", "RoofSurface", "GroundSurface", "SolitaryVegetationObject"}
    low, high = scene.bounds()
    assert high[2] - low[2] == 67.5  # the high-rise; in whole millimetres


def test_the_quarter_can_do_without_trees(quarter, tmp_path):
    file = tmp_path / "bare.city.json"
    run("city_block.py", file, "--no-trees")
    houses = {p.name for p in umbra.read(quarter).parts if not p.name.startswith("Tree")}
    assert {part.name for part in umbra.read(file).parts} == houses


def test_study_in_python(tmp_path):
    said = run("study_in_python.py", tmp_path)
    assert (tmp_path / "square.nc").exists()
    hours = {line.split("  ")[0].strip(): float(line[14:].split()[0]) for line in said.splitlines()
             if line.startswith("with")}  # fmt: skip
    assert hours["with trees"] > hours["without trees"] > 0


def test_an_offices_case(quarter, tmp_path):
    said = run("office_case.py", quarter, tmp_path, 2700, 340090, "--windows", 30)
    assert said.startswith("4 gardens and 30 windows")
    scene = umbra.read(quarter)
    study = umbra.shadow_study(
        scene, umbra.find_site(scene), measure="sky_view_factor", receivers="windows",
        windows=tmp_path / "windows.csv", areas=tmp_path / "gardens.geojson",
    )  # fmt: skip
    assert len(study.areas) == 4
    assert study.windows["sky_view_factor"].max() > 0.2  # none lies in its wall
    assert study.windows["sky_view_factor"].min() > 0


def test_shadow_of_a_pole():
    assert "10.00 m due north" in run("shadow_of_a_pole.py")


def test_count_in_a_frame(tmp_path):
    run("count_in_a_frame.py", tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"table.png", "table_count.png"}


def test_draw_diagrams(tmp_path):
    run("draw_diagrams.py", tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"shadow_count.svg", "multiplicity.svg"}


@pytest.fixture
def _has_gl():
    try:
        open_device().release()
    except UmbraError as error:
        pytest.skip(f"there is no OpenGL here: {error}")


@pytest.mark.usefixtures("_has_gl")
def test_three_cases(tmp_path):
    said = run("three_cases.py", tmp_path)
    assert "46, 1 and 1" in said
    assert said.split()[-2:] == [str(tmp_path / "three_cases.png"), str(tmp_path / "volumes.png")]
    with Image.open(tmp_path / "three_cases.png") as picture:
        colors = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)
    red, green, blue = colors.T
    assert ((green > red + 40) & (green > blue + 30)).sum() > 10_000  # case 3
    assert ((blue > red + 40) & (blue > green + 30)).sum() > 20_000  # case 1
    assert (tmp_path / "volumes.png").exists()


@pytest.mark.usefixtures("_has_gl")
def test_frame_by_pass(tmp_path):
    run("frame_by_pass.py", tmp_path)
    with Image.open(tmp_path / "frame_by_pass.png") as picture:
        drawn = np.asarray(picture.convert("RGB")).astype(int)
    ambient, lit = drawn[:400, :640], drawn[400:, 640:]
    counts = drawn[400:, :640]
    is_zero = counts.min(-1) > 180  # the colour of no volume
    assert 0.02 < (~is_zero).mean() < 0.5
    gained = (lit - ambient).sum(-1)
    assert (gained[is_zero] > 20).mean() > 0.9
    assert np.abs(gained[~is_zero]).max() < 20


@pytest.mark.usefixtures("_has_gl")
def test_hall(tmp_path):
    run("hall.py", tmp_path)
    with Image.open(tmp_path / "hall.png") as picture:
        assert picture.size == (960, 600)
        # Sun through a window, a red lamp's light, and the shadow of both on the floor.
        sun, red, dark = (picture.getpixel(place) for place in ((430, 455), (440, 425), (900, 500)))
        hard = np.asarray(picture).astype(int)
    assert min(sun) > 100 > max(dark)
    assert red[0] > 1.2 * red[2]  # the sky lights shadows blue
    with Image.open(tmp_path / "hall_soft.png") as picture:
        apart = np.abs(np.asarray(picture) - hard).max(-1)
    assert 0.05 < (apart > 3).mean() < 0.4


def test_soft_shadows(tmp_path):
    said = run("soft_shadows.py", tmp_path, "--samples", 64, "--size", "140x100")
    names = {f"soft_{name}.png" for name in ("hard", *SOFT)}
    assert {p.name for p in tmp_path.iterdir()} == names | {"soft_shadows.png", "soft_errors.png"}
    *lines, sheet, apart = said.splitlines()
    assert [sheet, apart] == [str(tmp_path / f"soft_{name}.png") for name in ("shadows", "errors")]
    error = {line.split()[0]: float(line.split()[3]) for line in lines}
    assert error["wedges"] < 0.3 * error["hard"]
    assert error["complexity"] < 0.1 * error["hard"]
    with Image.open(tmp_path / "soft_shadows.png") as sheet:
        assert sheet.size == (420, 244)


@pytest.mark.usefixtures("_has_gl")
def test_shadow_masks(tmp_path):
    said = run("shadow_masks.py", tmp_path)
    *lines, made = said.splitlines()
    assert made == str(tmp_path / "masks.png")
    error = {tuple(line.split()[:2]): float(line.split()[4]) for line in lines}
    for scale in "1/2", "1/4":
        assert 0 < error[scale, "joint:"] < 0.7 * error[scale, "bilinear:"]
    with Image.open(tmp_path / "masks.png") as picture:
        assert picture.size == (960, 240)


@pytest.mark.usefixtures("_has_gl")
def test_realtime_in_twenty_lines(tmp_path):
    said = run("realtime_in_twenty_lines.py", tmp_path)
    assert said.startswith("house")
    pictures = []
    for turn in range(4):
        with Image.open(tmp_path / f"turn_{turn}.png") as picture:
            pictures.append(np.asarray(picture.convert("RGB")).astype(int))
    for picture, other in itertools.pairwise(pictures):
        assert (np.abs(picture - other).max(-1) > 20).mean() > 0.02
    floor = pictures[0][190:260, 290:480].sum(-1)
    assert 0.2 < (floor < 0.7 * floor.max()).mean() < 0.7  # the shadow


@pytest.mark.usefixtures("_has_gl")
def test_realtime_in_your_engine(tmp_path):
    try:
        context = moderngl.create_context(
            standalone=True, backend="egl", libgl=find_library("GL"), libegl=find_library("EGL")
        )
    except Exception as error:  # noqa: BLE001  (drivers raise anything)
        pytest.skip(f"one backend of several, egl, does not open here: {error}")
    context.release()
    assert "9% of the picture in shadow" in run("realtime_in_your_engine.py", tmp_path)
    with Image.open(tmp_path / "own_engine.png") as picture:
        assert picture.size == (640, 480)
        brightest, darkest = picture.getpixel((330, 280)), picture.getpixel((150, 260))
    assert brightest[0] > 4 * darkest[0]


@pytest.mark.usefixtures("_has_gl")
def test_scissors_from_above(tmp_path):
    assert "55% of the frame" in run("scissors_from_above.py", tmp_path)
    with Image.open(tmp_path / "scissors.png") as picture:
        drawn = np.asarray(picture.convert("RGB")).astype(int).reshape(360, 3, 480, 3)
    gold = [(panel[..., 0] > panel[..., 2] + 20).mean() for panel in drawn.transpose(1, 0, 2, 3)]
    assert gold[0] > 0.15  # endless volumes
    assert 0.01 < gold[1] < 0.2 * gold[0]  # what the light's range leaves of them


def test_realtime_in_wgpu(tmp_path):
    pytest.importorskip("wgpu", reason="no WebGPU: wgpu is not installed")
    from umbra.webgpu.adapter import open_adapter  # noqa: PLC0415

    try:
        open_adapter()
    except UmbraError as error:
        pytest.skip(f"no WebGPU: {error}")
    assert run("realtime_in_wgpu.py", tmp_path).startswith("24 points of a lamp")
    with Image.open(tmp_path / "own_wgpu_engine.png") as picture:
        shown = np.asarray(picture.convert("RGB")).astype(int)[310:400, 150:310, 0]
    is_dark, is_lit = shown < 106, shown > 195  # the shadow of the nearest slab, and the floor
    assert 0.2 < is_dark.mean() < 0.4 < is_lit.mean()
    assert len(np.unique(shown[~is_dark & ~is_lit])) > 20  # of the points that reach the penumbra


@pytest.mark.usefixtures("_has_gl")
def test_realtime_in_a_window():
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is missing: no window can be tried")
    with Display() as display:
        done = run_python(EXAMPLES / "realtime_in_a_window.py", 3, env=display.environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("3 frames; the middle shows the house")


@pytest.mark.usefixtures("_has_gl")
def test_realtime_in_qt(tmp_path):
    pytest.importorskip("PySide6", reason="not installed")
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is missing: no window can be tried")
    with Display() as display:
        check_framework(
            "realtime_in_qt.py", tmp_path, {**display.environment, "QT_QPA_PLATFORM": "offscreen"}
        )


@pytest.mark.usefixtures("_has_gl")
def test_realtime_in_pyglet(tmp_path):
    pytest.importorskip("pyglet", reason="not installed")
    check_framework("realtime_in_pyglet.py", tmp_path, None)


def check_framework(name, folder, environment):
    """A frame in another framework's context has the part, and its shadow on the ground."""
    done = run_python(EXAMPLES / name, folder / "drawn.png", env=environment)
    assert done.returncode == 0, done.stderr
    with Image.open(folder / "drawn.png") as picture:
        assert picture.size == (640, 480)
        drawn = np.asarray(picture.convert("RGB")).astype(int).sum(axis=2)
    lit, shadow = np.median(drawn[400:]), drawn.min()
    assert (drawn < (lit + 2 * shadow) / 3).sum() > 5_000
