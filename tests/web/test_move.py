"""A proposal that one takes by a handle: its shadows are umbra's, and so is the option to copy."""

import json

import numpy as np
import pytest
from support.shapes import box
from support.web import SMALL, describe_camera

import umbra
from umbra.cpu.frame import FrameCounter
from umbra.rays.depth import NOTHING
from umbra.scene import Camera, directional_light
from umbra.web.pack import quantise

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna")
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"
SIZE = (200, 150)
CAMERA = Camera((70, -110, 80), (5, 5, 5), size=SIZE)
NOWHERE = {"dx": 0, "dy": 0, "turn": 0}
SUN = (-0.55, -0.6, 0.58)


def write_box(path, low, high):
    vertices, faces = box(low, high)
    lines = ["v {} {} {}".format(*row) for row in vertices]
    lines += ["f " + " ".join(str(k + 1) for k in row) for row in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A tower that stays, and an oblong one that is moved."""
    folder = tmp_path_factory.mktemp("move")
    return (
        f"old={write_box(folder / 'old.obj', (-5, -5, 0), (5, 5, 30))}",
        f"new={write_box(folder / 'new.obj', (20, -8, 0), (34, 18, 40))}",
    )


@pytest.fixture
def live(page, files, tmp_path):
    """Open the page of both, by options of reading."""

    def open_page(**options):
        scene = umbra.read(*files, **options)
        umbra.show(scene, VIENNA, date="2026-06-21", at="15:00", proposed="new", ground=0,
                   size=SMALL, out=tmp_path / "scene.html")  # fmt: skip
        page.resize(1000, 700)
        page.open(tmp_path / "scene.html", READY)
        return page

    return open_page


def write(dx, dy, turn):
    return json.dumps({"dx": dx, "dy": dy, "turn": turn}, separators=(",", ":"))


def put(page, *move):
    page.ask(f"umbra.set({{ move: {write(*move)} }})")
    page.wait("umbra.waits === 0")


def find_places(page, part):
    """Return the corners of a part in the page, in the model's own coordinates, sorted."""
    rows = page.ask(
        f"(() => {{ const {{ model }} = umbra, found = new Map(); model.facePart.forEach((p, f) =>"
        f"{{ if (model.parts[p].layer !== '{part}') return; for (let k = 0; k < 3; k++) {{"
        "const i = model.faces[3 * f + k]; found.set(i, [0, 1, 2].map((a) =>"
        "model.places[3 * i + a] + model.origin[a])); } }); return [...found.values()]; })()"
    )
    return np.array(sorted(rows))


@pytest.mark.parametrize("move", [(3.25, -14.5, 0.0), (-8.0, 6.0, 30.0)])
def test_counts_after_a_move_are_umbras(picture, files, move):
    """The page moves the model that it was given; umbra reads the files with the option."""
    scene = umbra.read(*files)
    moved = umbra.read(*files, move="new={},{},,{}".format(*move))
    rounded = quantise(scene)
    picture.load(scene, SIZE, samples=1)
    picture.set("camera", describe_camera(CAMERA, rounded))
    picture.set("ground", float(-rounded.origin[2]))
    picture.set("lights", [{"direction": SUN}])
    before = picture.count()
    picture.page.ask(
        f"(move => {{ const found = new Proposal(picture.model).put([1], move);"
        f"picture.remake(found.faces, found.turned, move.turn); }})({write(*move)})"
    )
    found = picture.count()
    light = directional_light(np.array(SUN) / np.linalg.norm(SUN))
    own = quantise(moved)
    counter = FrameCounter(own, ground=0.0)
    view, _ = counter.see(CAMERA)
    expected = counter.count(view, CAMERA, light)
    seen = view.face != NOTHING
    differs = (found != expected) & seen
    # Edges of the picture and of shadows fall on either side of a pixel's centre.
    assert differs.sum() < 0.012 * seen.sum()
    wide = np.pad(differs, 1)
    assert not (wide[1:-1, 1:-1] & wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2]
                & wide[1:-1, 2:]).any()  # fmt: skip
    assert ((before != expected) & seen).sum() > 0.03 * seen.sum()


def test_a_moved_model_is_the_model_of_the_moved_files(live, files):
    page = live()
    move = (12.5, -7.25, -40.0)
    put(page, *move)
    moved = umbra.read(*files, move="new={},{},,{}".format(*move))
    part = moved.select(["new"])[0]
    expected = moved.parts[part].mesh.vertices + moved.origin
    np.testing.assert_allclose(
        find_places(page, "new"), sorted(np.unique(expected, axis=0).tolist()), atol=2e-4
    )
    # Rays, bounds and boxes follow.
    bounds = np.array(page.ask("umbra.model.bounds")) + page.ask("umbra.model.origin")
    np.testing.assert_allclose(bounds, moved.bounds(), atol=2e-4)
    centre = expected.mean(0)
    hit = page.ask(f"umbra.model.trace({[*centre[:2].tolist(), 90.0]}.map((v, k) => v - "
                   "umbra.model.origin[k]), [0, 0, -1])[0]")  # fmt: skip
    assert hit["distance"] == pytest.approx(50, abs=1e-3)
    page.ask("umbra.set({ move: { dx: 0, dy: 0, turn: 0 } })")
    page.wait("umbra.waits === 0")
    assert np.abs(find_places(page, "new") - sorted(box((20, -8, 0), (34, 18, 40))[0].tolist())
                  ).max() == 0  # fmt: skip


@pytest.mark.parametrize("given", [(), (6.0, -2.0, 1.5, 20.0)])
def test_the_option_that_one_copies_brings_the_shell_there(live, files, given):
    """Also of a layer that the option had moved and turned before."""
    first = {"move": "new=" + ",".join(map(str, given))} if given else {}
    page = live(**first)
    put(page, -11.37, 4.2, 33.5)
    option = page.ask("document.querySelector('.option').textContent")
    assert option.startswith("--move new=")
    again = umbra.read(*files, move=option.removeprefix("--move "))
    part = again.select(["new"])[0]
    expected = again.parts[part].mesh.vertices + again.origin
    np.testing.assert_allclose(
        find_places(page, "new"), sorted(np.unique(expected, axis=0).tolist()), atol=2e-3
    )
    # What the numbers say is where its middle is.
    x, y = page.ask(
        "[...document.querySelectorAll('.number input')].slice(2, 4).map((e) => +e.value)"
    )
    middle = (expected[:, :2].min(0) + expected[:, :2].max(0)) / 2
    assert (x, y) == pytest.approx(middle, abs=2e-3)


def test_handles_numbers_undo_and_links(live):
    page = live()
    page.ask("umbra.orbit.look(0, -89.9); umbra.set({ compare: 'after' })")
    page.wait("umbra.waits === 0")
    grip, knob = (
        page.ask(f"(({{ x, y, width, height }}) => [x + width / 2, y + height / 2])"
                 f"(document.querySelector('{name}').getBoundingClientRect())")
        for name in (".grip:not(.knob)", ".knob")
    )  # fmt: skip
    metres = page.ask("2 * umbra.state.viewpoint.distance * Math.tan(umbra.state.viewpoint.fov *"
                      "Math.PI / 360) / umbra.stage.size.high")  # fmt: skip

    def drag(start, by):
        page.mouse("mousePressed", *start, button="left", clickCount=1)
        for share in (0.5, 1):
            page.mouse("mouseMoved", *(a + share * b for a, b in zip(start, by, strict=True)),
                       button="left", buttons=1)  # fmt: skip
        page.mouse("mouseReleased", start[0] + by[0], start[1] + by[1], button="left")
        page.wait("umbra.waits === 0")

    drag(grip, (60, 40))
    move = page.ask("umbra.state.move")
    assert (move["dx"], move["dy"]) == pytest.approx((60 * metres, -40 * metres), abs=0.02)
    assert move["turn"] == 0
    assert page.ask("umbra.state.place") is None  # the picture took no click
    # The knob stands to the north of the foot, which moved: a quarter turn to the east.
    foot = page.ask("umbra.stage.renderer.project(umbra.proposal.carry(umbra.proposal.foot,"
                    f"{json.dumps(NOWHERE)}, umbra.state.move))")  # fmt: skip
    start = (knob[0] + 60, knob[1] + 40)
    drag(start, (foot["x"] + (foot["y"] - start[1]) - start[0], foot["y"] - start[1]))
    assert page.ask("umbra.state.move.turn") == pytest.approx(90, abs=1)
    turned = page.ask("Object.values(umbra.state.move)")
    page.wait(f"location.hash.endsWith(',{turned[2]}')")
    kept = page.ask("location.hash")
    click = ("(t => [...document.querySelectorAll('.panel button')].find((e) => e.textContent ==="
             " t).click())('%s')")  # fmt: skip
    page.ask(click % "Undo")
    assert page.ask("umbra.state.move") == move
    page.ask(click % "Undo")
    page.wait("umbra.waits === 0")
    assert page.ask("umbra.state.move") == NOWHERE
    assert page.ask("document.querySelector('.option').textContent") == ""
    # Typed, and by keys.
    page.ask("(e => { e.value = '-3,5'; e.dispatchEvent(new Event('change')); })"
             "(document.querySelector('.number input'))")  # fmt: skip
    assert page.ask("umbra.state.move.dx") == -3.5
    page.ask("document.querySelector('.grip').focus()")
    page.press("ArrowUp")
    page.press("ArrowRight")
    assert page.ask("umbra.state.move") == {"dx": -2.5, "dy": 1, "turn": 0}
    heading = page.ask("umbra.state.viewpoint.heading")
    page.press("z", modifiers=2)
    assert page.ask("umbra.state.move") == {"dx": -3.5, "dy": 0, "turn": 0}
    assert page.ask("umbra.state.viewpoint.heading") == heading
    page.wait("location.hash.endsWith('move=-3.5,0,0')")
    # A link keeps it, and one without it goes back.
    for link, expected in ((kept, turned), (kept.split("&move=")[0], (0, 0, 0))):
        page.ask(f"location.hash = {link!r}")
        page.wait(f"JSON.stringify(umbra.state.move) === '{write(*expected)}'")


def test_the_page_without_a_proposal_has_no_handle(page, files, tmp_path):
    umbra.show(
        umbra.read(*files),
        VIENNA,
        date="2026-06-21",
        at="15:00",
        size=SMALL,
        out=tmp_path / "s.html",
    )
    page.resize(1000, 700)
    page.open(tmp_path / "s.html", READY)
    hidden = "[...document.querySelectorAll('.handles, .numbers')].every((e) => !e.offsetParent)"
    assert page.ask(hidden)
    page.ask("umbra.parts.put([0], 'proposed')")
    page.wait("umbra.waits === 0")
    assert page.ask("!document.querySelector('.handles').hidden")


def test_handles_and_numbers_are_accessible(live):
    page = live()
    page.resize(390, 844, is_phone=True)
    page.ask("document.querySelectorAll('.panel > details').forEach((e) => { e.open = true; })")
    put(page, 5, 0, 10)
    assert page.audit() == []
    small = page.ask(
        "[...document.querySelectorAll('.grip, .number input, .option + button')].map((e) => "
        "e.getBoundingClientRect()).filter(({ width, height }) => width < 40 || height < 44)"
    )
    assert small == []
    assert page.ask("document.documentElement.scrollWidth") <= 390
