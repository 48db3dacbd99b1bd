"""What a request may not have meant is said, where it is asked: in Python and in the shell."""

import json
import warnings
from functools import partial

import numpy as np
import pytest
from support.command import VIENNA
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra.cli import main
from umbra.option_fields import list_options
from umbra.scene import Mesh, Part, make_scene
from umbra.study import StudyOptions
from umbra.study.remarks import tell_panes, tell_request

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
DAY = {"date": "2026-03-21", "every": "4h"}
PLAN = {"extent": (-5, -5, 25, 25), "cell": 2.0}
OLD = box((0, 0, 0), (10, 10, 8))
SHEET = ([[-50, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]], [[0, 1, 2], [0, 2, 3]])


def part(name, shape, kind="", layer=""):
    vertices, faces = shape
    return Part(name, kind, Mesh(np.array(vertices, float), np.array(faces, np.int32)), layer=layer)


def tell(*parts, **options):
    given = {**DAY, "proposed": "new", **options}
    return tell_request(make_scene(list(parts)), StudyOptions(**given))


@pytest.mark.parametrize(
    ("new", "share"),
    [
        (box((5, 0, 0), (15, 10, 6)), 50),
        (box((2, 2, 1), (4, 4, 6)), 100),  # within it
        (box((10, 0, 0), (20, 10, 6)), 0),  # a party wall
        (box((0, 0, 8), (10, 10, 12)), 0),  # further storeys
        (box((30, 0, 0), (40, 10, 6)), 0),
        (box((9.9, 0, 0), (19.9, 10, 6)), 0),  # by 10 cm
    ],
)
def test_a_proposal_within_what_stands_there_is_said(new, share):
    told = tell(part("new", new), part("old", OLD), part("land", SHEET))
    assert len(told) == (share > 0)
    if told:
        assert "'old'" in told[0]
        said = float(told[0].split(" %")[0].split()[-1])
        assert said == pytest.approx(share, abs=3)
    # What casts no shadow, before and after, is not in the way.
    assert tell(part("new", new), part("old", OLD), no_cast="old") == []


def test_a_sheet_or_an_open_shell_fills_no_place():
    vertices, faces = box((-50, -50, -5), (50, 50, 3))
    roofless = (vertices, [face for face in faces if not all(vertices[k][2] == 3 for k in face)])
    assert tell(part("new", OLD), part("land", SHEET), part("shell", roofless)) == []


@pytest.mark.parametrize(
    ("extent", "metres"),
    [((0, 0, 5, 5), None), ((-20, 0, -3, 10), 3), ((13, 14, 20, 20), 5), ((10, 0, 20, 5), None)],
)
def test_a_proposal_outside_the_extent_is_said(extent, metres):
    told = tell(part("new", OLD), part("other", box((40, 0, 0), (41, 1, 1))), extent=extent)
    assert len(told) == (metres is not None)
    assert metres is None or f"{metres} m outside extent=" in told[0]
    # An elevation's extent is of another plane.
    side = tell(part("new", OLD), extent=(0, 0, 1, 1), receivers="north")
    assert side == tell(part("new", OLD), extent=(500, 0, 501, 1), receivers="north") == []


def test_a_device_that_counts_no_canopies_is_said():
    parts = (part("tree", OLD), part("house", box((20, 0, 0), (25, 5, 5))))
    ask = partial(tell, *parts, proposed=(), canopy="tree")
    (told,) = ask(device="gl")
    assert "device='gl'" in told
    assert ask(device="auto") == ask(device="cpu") == ask() == []
    with pytest.warns(UserWarning, match="device='gl'"):
        study = umbra.shadow_study(
            make_scene(list(parts)), SITE, **DAY, **PLAN, canopy="tree", device="gl"
        )
    assert study.attrs["device"] == "cpu"


@pytest.mark.parametrize(
    ("kind", "receivers", "count"),
    [
        ("IfcWindow", "surfaces", 1),
        ("Window", "surfaces", 1),
        ("IfcDoor", "surfaces", 1),
        ("WallSurface", "surfaces", 0),
        ("IfcWindow", "ground", 0),
    ],
)
def test_rules_on_windows_are_said_to_judge_all_their_faces(kind, receivers, count):
    scene = make_scene([part("a", OLD, kind), part("b", box((20, 0, 0), (21, 1, 1)), "IfcWall")])
    on = {"on": kind} if receivers == "surfaces" else {}
    told = tell_panes(scene, StudyOptions(**DAY, receivers=receivers, **on))
    assert len(told) == count
    assert not count or {"points='FILE.csv'", kind + ":"} <= set(told[0].split())


def test_python_warns_and_the_shell_notes_the_same(capsys, tmp_path):
    old = save_obj(tmp_path / "old.obj", {"old": OLD})
    new = save_obj(tmp_path / "new.obj", {"new": box((5, 0, 0), (15, 10, 6))})
    scene = umbra.read(old, new)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        umbra.shadow_study(scene, SITE, **DAY, **PLAN, proposed="new")
    (told,) = [str(one.message) for one in caught if "overlaps" in str(one.message)]
    words = ["study", old, new, *VIENNA, "--date", DAY["date"], "--every", "4h", "--cell", "2"]
    words += ["--extent", "-5,-5,25,25", "--proposed", "new", "--no-pictures", "--json"]
    with pytest.raises(SystemExit) as ended:
        main([*map(str, words), "--out", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert not ended.value.code
    assert json.loads(said.out)["files"]
    assert told.split(";")[0] in said.err


def test_points_without_receivers_name_the_receivers():
    scene = make_scene([part("old", OLD)])
    for name, value in (("points", [[0, 0, 1.0]]), ("spacing", 1.0)):
        with pytest.raises(umbra.InputError) as caught:
            umbra.shadow_study(scene, SITE, **DAY, **{name: value})
        assert caught.value.option == name
        (kind,) = next(said for one, said, _ in list_options(StudyOptions) if one == name).receivers
        assert f"receivers='{kind}'" in str(caught.value)


@pytest.mark.parametrize(("text", "metres"), [("30 ft", 9.144), ("50cm", 0.5), ("2 m", 2.0)])
def test_lengths_in_python_may_have_a_unit(text, metres):
    options = StudyOptions(**DAY, ground=text, cell=text)
    assert (options.ground, options.cell) == (metres, metres)
    assert StudyOptions(**DAY, receivers="surfaces", spacing=text).spacing == metres
    for wrong in ("2", "two m", "m"):
        with pytest.raises(umbra.InputError) as caught:
            StudyOptions(**DAY, cell=wrong)
        assert caught.value.option == "cell"


@pytest.fixture(scope="module")
def study():
    return umbra.shadow_study(make_scene([part("old", OLD)]), SITE, **DAY, **PLAN)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("save", "write"),
        ("export", "write"),
        ("hours", "sun_hours"),
        ("sun_hour", "sun_hours"),
        ("qqqq", "study.dataset"),
    ],
)
def test_what_a_study_lacks_names_what_it_has(study, name, meant):
    with pytest.raises(AttributeError, match=meant):
        getattr(study, name)


def test_a_study_lists_all_that_works(study):
    listed = {name for name in dir(study) if not name.startswith("_")}
    lacking = {name for name in dir(study.dataset) if not name.startswith("_")} - listed
    assert not lacking
    assert {"sun_hours", "write", "sel", "latitude", "x"} <= listed
    for name in listed - {"rio"}:
        getattr(study, name)


def test_a_folder_named_as_a_file_is_refused(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("out.png", "a/study.nc", "report.html", "OUT.TIF"):
        with pytest.raises(umbra.InputError, match="folder") as caught:
            study.write(name, pictures=False)
        assert caught.value.option == "out"
    assert list(tmp_path.iterdir()) == []
    assert study.write("v1.2", pictures=False)
    (tmp_path / "old.png").mkdir()
    assert study.write("old.png", pictures=False)
