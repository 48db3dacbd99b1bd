"""What packages beside umbra return: checked where it is handed over, and refused in one line."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import umbra
from umbra.devices import REGISTRY as DEVICES
from umbra.extending import (
    Lights,
    Measure,
    Output,
    PlacedKind,
    PlacedSamples,
    PointDevice,
    Quantity,
    find_directions,
)  # fmt: skip
from umbra.receivers import REGISTRY as KINDS
from umbra.study.measures import MEASURES
from umbra.writers.outputs import REGISTRY as OUTPUTS

SITE = umbra.Site(latitude=48, longitude=16, zone="UTC")
TOWARD, ANGLES = find_directions(64)
BOX = [(x, y, z) for x in (1000, 1008) for y in (2000, 2006) for z in (0, 7)]
FACES = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6),
         (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
POINTS = np.array([[1004.0, 1999, 1], [1004, 1998, 2], [1004, 1997, 3]])
UP = np.tile([0.0, 0, 1], (3, 1))


@pytest.fixture
def scene():
    mesh = umbra.Mesh(np.array(BOX, float), np.array(FACES, np.int32))
    return umbra.make_scene([umbra.Part("box", "building", mesh)])


@pytest.fixture
def add(monkeypatch):
    """Register an object as if a package brought it."""

    def register(registry, given):
        name = given.name
        monkeypatch.setitem(registry._loaded, name, given)
        monkeypatch.setitem(vars(registry), "added", {name: (SimpleNamespace(name=name),)})
        return name

    return register


def make_measure(lights=lambda _asked: Lights.of(TOWARD, ANGLES), **more):
    own = {"name": "mine", "unit": "1", "long_name": "words", **more}
    return type("Mine", (Measure,), {**own, "make_lights": lambda _, asked: lights(asked)})()


def measure(scene, name, **more):
    return umbra.shadow_study(scene, receivers="ground", cell=4, measure=name, **more)


def spoil(array, value):
    found = array.copy()
    found[3] = value
    return found


LIGHTS = {
    "flat vectors": lambda _: Lights.of(TOWARD[:, :2], ANGLES),
    "few weights": lambda _: Lights.of(TOWARD, ANGLES[:10]),
    "a tuple": lambda _: (TOWARD, ANGLES),
    "nothing": lambda _: None,
    "text": lambda _: Lights.of(TOWARD, ["a"] * 64),
    "nan weight": lambda _: Lights.of(TOWARD, spoil(ANGLES, np.nan)),
    "infinite weight": lambda _: Lights.of(TOWARD, spoil(ANGLES, np.inf)),
    "negative weight": lambda _: Lights.of(TOWARD, spoil(ANGLES, -1)),
    "nan vector": lambda _: Lights.of(spoil(TOWARD, np.nan), ANGLES),
    "long vector": lambda _: Lights.of(spoil(TOWARD, (0, 0, 7)), ANGLES),
    "wrong w": lambda _: Lights.of(np.column_stack([TOWARD, np.full(64, 0.5)]), ANGLES),
    "no date": lambda asked: asked.period.make_lights(),
    "a column each": lambda _: Lights.of(*[np.tile(TOWARD, (9, 1)), np.eye(576)]),
}


@pytest.mark.parametrize("how", LIGHTS)
def test_lights_of_a_measure_that_cannot_be_counted_are_refused(scene, add, how):
    name = add(MEASURES, make_measure(LIGHTS[how]))
    with pytest.raises(umbra.InputError) as told:
        measure(scene, name)
    assert "'mine'" in str(told.value)
    assert told.value.measure == "mine"
    assert told.value.option == "measure"


def test_lights_in_float32_and_of_no_number_are_counted(scene, add):
    add(MEASURES, make_measure(lambda _: Lights.of(TOWARD.astype(np.float32), ANGLES)))
    assert float(measure(scene, "mine").dataset.mine.max()) > 0
    add(MEASURES, make_measure(lambda _: Lights.of(np.zeros((0, 3)))))
    assert float(np.nanmax(measure(scene, "mine").dataset.mine)) == 0


@pytest.mark.parametrize(
    "more",
    [{"takes": ("sky_direction",)}, {"takes": "points"},
     {"quantities": (Quantity("sun_hours", "h", "of umbra's own"),)},
     {"quantities": (Quantity("other", None, "words"),)}, {"quantities": ("other",)}],
)  # fmt: skip
def test_what_a_measure_says_of_itself_is_checked(scene, add, more):
    add(MEASURES, make_measure(**more))
    with pytest.raises(umbra.InputError) as told:
        measure(scene, "mine")
    assert "'mine'" in str(told.value)
    assert told.value.option == "measure"


def make_kind(place, takes=()):
    own = {"name": "spots", "takes": takes, "place": lambda _, scene, _options: place(scene)}
    return type("Spots", (PlacedKind,), own)()


KINDS_GIVEN = {
    "a tuple": lambda _: (POINTS, UP),
    "nothing": lambda _: None,
    "flat points": lambda _: PlacedSamples(POINTS[:, :2]),
    "one row": lambda _: PlacedSamples(POINTS[0]),
    "none": lambda _: PlacedSamples(np.zeros((0, 3))),
    "nan": lambda _: PlacedSamples(spoil(np.tile(POINTS, (2, 1)), np.nan)),
    "one normal": lambda _: PlacedSamples(POINTS, UP[0]),
    "zero normals": lambda _: PlacedSamples(POINTS, 0 * UP),
    "infinite normals": lambda _: PlacedSamples(POINTS, np.full((3, 3), np.inf)),
    "one name": lambda _: PlacedSamples(POINTS, UP, names=["a"]),
    "negative area": lambda _: PlacedSamples(POINTS, UP, areas=[-1, 1, 1]),
    "nan area": lambda _: PlacedSamples(POINTS, UP, areas=[1, np.nan, 1]),
    "no area": lambda _: PlacedSamples(POINTS, UP, areas=[0, 0, 0]),
    "no such part": lambda _: PlacedSamples(POINTS, UP, parts=[0, 9999, 0]),
    "half a part": lambda _: PlacedSamples(POINTS, UP, parts=[0, 0.5, 0]),
}


@pytest.mark.parametrize("how", KINDS_GIVEN)
def test_samples_that_cannot_be_counted_are_refused(scene, add, how):
    name = add(KINDS, make_kind(KINDS_GIVEN[how]))
    with pytest.raises(umbra.InputError) as told:
        umbra.shadow_study(scene, receivers=name, measure="sky_view_factor", sky_directions=50)
    assert "'spots'" in str(told.value)
    assert told.value.option == "receivers"


def test_a_kind_that_takes_no_option_of_a_study_is_refused(scene, add):
    name = add(KINDS, make_kind(lambda _: PlacedSamples(POINTS, UP), ("path_height",)))
    with pytest.raises(umbra.InputError, match="path_height"):
        umbra.shadow_study(scene, receivers=name, measure="sky_view_factor")


def test_a_kind_without_places_cannot_be_made():
    with pytest.raises(TypeError, match="place"):
        type("Bare", (PlacedKind,), {"name": "bare"})()


@pytest.mark.parametrize("away", [0, 1_000_000])
def test_samples_far_from_the_model_are_told(scene, add, away):
    name = add(KINDS, make_kind(lambda _: PlacedSamples(POINTS - (away, 0, 0), UP)))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        umbra.shadow_study(scene, receivers=name, measure="sky_view_factor", sky_directions=50)
    assert len([one for one in told if "'spots'" in str(one.message)]) == bool(away)


class Counted(PointDevice):
    """A device that returns what it is told to, and notes how often it is asked."""

    name, title = "probe", "probe"

    def __init__(self, mask):
        self.mask, self.calls = mask, 0

    def find_hidden(self, _triangles, points, _normals, lights):
        self.calls += 1
        return np.full((len(lights), len(points)), self.mask)


def count(scene):
    return umbra.shadow_study(
        scene, SITE, receivers="ground", cell=4, date="2026-06-21", every="2h", device="probe"
    )


@pytest.mark.parametrize("mask", [0.5, 1.0, np.nan, -1, 2, "1", None])
def test_masks_other_than_0_and_1_are_refused(scene, add, mask):
    add(DEVICES, Counted(mask))
    with pytest.raises(umbra.InputError, match="'probe'"):
        count(scene)


@pytest.mark.parametrize("mask", [True, np.uint8(1), 1, np.int8(1)])
def test_masks_of_0_and_1_are_counted(scene, add, mask):
    add(DEVICES, Counted(mask))
    study = count(scene)
    assert float(np.nanmax(study.sun_hours)) == 0


@pytest.mark.parametrize("samples", [1, 4])
def test_a_device_of_a_package_counts_pixels_centres_alone(scene, add, samples):
    """The default device counts the finer steps at edges, as docs/extending.md says."""
    device = Counted(mask=False)
    add(DEVICES, device)
    umbra.render(
        scene, umbra.make_camera(scene, size=(32, 24)), samples=samples, device="probe",
        style="plain",
        lights=umbra.directional_light((1, 2, 3)), ground=0,
    )  # fmt: skip
    assert device.calls == 1


def make_output(write):
    own = {"name": "notes", "write": lambda _, _study, folder: write(folder)}
    return type("Notes", (Output,), own)()


def leave(*names, returned=None):
    def write(folder):
        for name in names:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text("of a package")
        return list(names) if returned is None else returned(folder)

    return write


WRITTEN = {
    "the result": leave("study.nc"),
    "a picture": leave("mine.png"),
    "a usual name": leave("report.html"),
    "a table": leave("cells.csv"),
    "a text": leave("s.txt", returned=lambda _: "s.txt"),
    "nothing": leave("s.txt", returned=lambda _: None),
    "an absolute path": leave("s.txt", returned=lambda folder: [str(folder / "s.txt")]),
    "a path": leave("s.txt", returned=lambda folder: [folder / "s.txt"]),
    "a subfolder": leave("sub/s.txt"),
    "beside its folder": leave("../s.txt", "t.txt", returned=lambda _: ["t.txt"]),
    "unnamed": leave("s.txt", "t.txt", returned=lambda _: ["t.txt"]),
    "not there": leave(returned=lambda _: ["s.txt"]),
}


@pytest.mark.parametrize("how", WRITTEN)
def test_an_output_writes_names_of_its_own_into_its_folder(scene, add, tmp_path, how):
    add(MEASURES, make_measure())
    study = measure(scene, "mine")
    add(OUTPUTS, make_output(WRITTEN[how]))
    with pytest.raises(umbra.InputError) as told:
        study.write(tmp_path / "out", "notes", pictures=how == "a picture")
    assert told.value.format == "notes"
    names = {path.name for path in (tmp_path / "out").rglob("*")}
    assert names - {".umbra-files"} == {"study.nc"} | (
        {"mine.png"} if how == "a picture" else set()
    )
    for path in (tmp_path / "out").iterdir():
        assert b"of a package" not in path.read_bytes()


@pytest.mark.parametrize("shape", [(3, 2), (3, 5), (3,), (0,)])
def test_vectors_of_lights_have_three_or_four_columns(shape):
    with pytest.raises(umbra.InputError):
        Lights.of(np.ones(shape))
