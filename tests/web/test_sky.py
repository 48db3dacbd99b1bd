"""The sky above a place of the live page, beside the exact one."""

import json
from datetime import datetime

import numpy as np
import pytest
from PIL import Image
from support.shapes import box
from support.web import SMALL

import umbra
from umbra.sky.projections import PROJECTIONS, find_projection
from umbra.web.bundle import bundle

VIENNA = umbra.Site(48.2, 16.37, "Europe/Vienna", true_north=12.0)
READY = "document.documentElement?.dataset.ready == 'yes' && umbra.waits === 0"
DATE = "2026-03-21"
PLACES = [
    (0, -9, 0, 0, 0, 1), (17, 3, 0, 0, 0, 1), (-30, 19.5, 1.5, 0, 0, 1), (5, 0, 12, 1, 0, 0),
    (-40, 25, 2, -1, 0, 0), (29.5, 0, 7, -0.6, 0, 0.8),
]  # fmt: skip
STATE = """(() => {
  const text = (path) => [...document.querySelectorAll(`.sky ${path}`)].map((e) => e.textContent);
  return {figures: text('dd'), shares: text('.sky-key b'), names: text('.sky-key span'),
          times: text('.sky-spells b'), ends: text('.sky-spells span'), figure: text('svg text')};
})()"""


@pytest.fixture(scope="module")
def town():
    """Two towers, a house, a slab in the air and a roof ridge."""
    blocks = {
        "tower": ((-5, -5, 0), (5, 5, 30)), "slab": ((-9, -20, 9), (9, -14, 10)),
        "high-rise": ((30, -8, 0), (44, 8, 45)), "house": ((-40, 20, 0), (-20, 30, 6)),
    }  # fmt: skip
    parts = []
    for name, ends in blocks.items():
        vertices, faces = box(*ends)
        parts.append(umbra.Part(name, "building", umbra.Mesh(vertices, faces)))
    return umbra.make_scene(parts, ground=0.0)


@pytest.fixture(scope="module")
def written(town, tmp_path_factory):
    path = tmp_path_factory.mktemp("sky") / "scene.html"
    umbra.show(town, VIENNA, date=DATE, at="15:00", size=SMALL, out=path)
    return path


def choose(page, place, normal):
    own = [float(v) for v in place]
    page.ask(
        f"umbra.set({{place: {{position: {own}.map((v, k) => v - umbra.model.origin[k]), "
        f"normal: {[float(v) for v in normal]}, part: -1}}}})"
    )
    page.wait("umbra.waits === 0")
    return page.ask(STATE)


def test_a_place_has_the_numbers_names_and_spells_of_the_exact_sky(page, written, town):
    page.open(written, READY)
    for row in PLACES:
        place, normal = np.array(row[:3], float), np.array(row[3:], float)
        shown = choose(page, place, normal)
        exact = umbra.sky_view(town, place + 1e-4 * normal, normal, VIENNA)
        factor, component = (float(words.split()[0]) for words in shown["figures"])
        assert factor == pytest.approx(exact.sky_view_factor, abs=0.0015)
        assert component == pytest.approx(exact.sky_component, abs=0.15)
        told = {name: share for name, share in exact.blocked_by.items() if share > 0.002}
        assert shown["names"][: len(told)] == list(told)
        shares = [float(words.split("\u00a0")[0]) for words in shown["shares"][: len(told)]]
        np.testing.assert_allclose(shares, 100 * np.array(list(told.values())), atol=0.2)
        spells = exact.sun(DATE)
        assert len(shown["times"]) == len(spells)
        for spell, times, ends in zip(spells, shown["times"], shown["ends"], strict=True):
            for clock, when in zip(times.split("\u2013"), (spell.start, spell.end), strict=True):
                read = datetime.strptime(clock, "%H:%M:%S")
                off = read - when.replace(tzinfo=None, year=1900, month=1, day=1)
                assert abs(off.total_seconds()) <= 4  # the page's shorter series of the sun
            names = [end.removeprefix("the ").removeprefix("its ")
                     for end in ends.removeprefix("out of ").split(", behind ")]  # fmt: skip
            assert names == [spell.out_of, spell.behind]


def test_a_sky_is_used_by_keys_on_a_phone_and_closed_by_escape(page, written):
    page.resize(390, 800, is_phone=True)
    page.open(written, READY)
    is_open = "document.querySelector('.sky-dialog').open"
    page.ask("umbra.stage.canvas.focus()")
    page.press("Enter")
    page.wait("umbra.state.place !== null && umbra.waits === 0")
    assert page.ask("getComputedStyle(document.querySelector('.sky-small')).display") == "block"
    page.ask("document.querySelector('.sky-small').focus()")
    page.press("Enter", text="\r")
    page.wait(is_open)
    assert page.audit() == []
    seen = "document.querySelector('.sky-dialog canvas').getBoundingClientRect()"
    assert page.ask(f"{seen}.right <= 390 && {seen}.width > 280")
    page.press("Escape")
    page.wait(f"!{is_open}")
    assert page.ask("document.activeElement.className") == "sky-small"
    assert page.audit() == []
    page.ask("umbra.stage.canvas.focus()")
    page.press("Escape")
    page.wait("umbra.state.place === null && umbra.waits === 0")
    assert page.ask("document.querySelectorAll('.sky svg').length") == 0


def test_what_stood_before_a_proposal_has_its_own_sky(page, town, tmp_path):
    umbra.show(
        town, VIENNA, date=DATE, proposed="high-rise", size=SMALL, out=tmp_path / "both.html"
    )
    page.open(tmp_path / "both.html", READY)
    page.ask("umbra.set({compare: 'after'})")
    after = choose(page, (17, 3, 0), (0, 0, 1))
    page.ask("umbra.set({compare: 'before'})")
    page.wait("umbra.waits === 0")
    before = page.ask(STATE)
    assert "high-rise" in after["names"]
    assert "high-rise" not in before["names"]
    exact = umbra.sky_view(town, (17, 3, 1e-4), no_cast=["high-rise"])
    assert float(before["figures"][0]) == pytest.approx(exact.sky_view_factor, abs=0.0015)


def test_charts_are_those_of_umbras_own_pictures(page, tmp_path):
    file = tmp_path / "charts.html"
    script = f"{{ {bundle('sky_charts')} window.Chart = $sky_charts.Chart; }}"
    file.write_text(f"<!doctype html><meta charset=utf-8><script>{script}</script>")
    page.open(file, "Boolean(window.Chart)")
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(40, 3))
    directions[:, 2] = np.abs(directions[:, 2])
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for name in PROJECTIONS:
        for normal in ([0.0, 0.0, 1.0], [0.6, -0.8, 0.0]):
            expected = find_projection(name, np.array(normal), 12.0).project(directions)
            given = json.dumps([name, normal, directions.tolist()])
            places, back = page.ask(f"""(() => {{
              const [name, normal, directions] = {given}, chart = new Chart(name, normal, 12);
              const places = directions.map((one) => chart.place(one)), into = new Float64Array(3);
              const back = places.map((at) => at && chart.look(...at, into) && [...into]);
              return [places, back];
            }})()""")
            for place, found, own, known in zip(places, back, directions, expected, strict=True):
                assert (place is None) == bool(np.isnan(known).any())
                if place is not None:
                    np.testing.assert_allclose(place, known, atol=1e-12)
                    np.testing.assert_allclose(found, own, atol=2e-5)


def test_a_direction_names_the_object_that_is_nearest_there(page, tmp_path):
    file = tmp_path / "cube.html"
    names = "window.lookAround = $sky_cube.lookAround; window.findHit = $sky_cube.findHit;"
    script = f"{{ {bundle('sky_cube')} {names} }}"
    file.write_text(f"<!doctype html><meta charset=utf-8><script>{script}</script>")
    page.open(file, "Boolean(window.findHit)")
    # A box lopsidedly to each side, one nearer before another, and one overhead.
    ends = [
        ((2, 6, -1), (9, 8, 5)), ((5, -7, -1), (8, -1, 9)), ((-4, -9, -1), (3, -6, 2)),
        ((-9, 1, -1), (-6, 7, 7)), ((3, 4, -1), (4, 5, 3)), ((-1, -3, 6), (2, 1, 7)),
    ]  # fmt: skip
    solids = [box(*some) for some in ends]
    corners = np.concatenate([np.asarray(v, float)[np.asarray(f)] for v, f in solids])
    owner = np.repeat(np.arange(len(solids)), [len(f) for _, f in solids])
    rng = np.random.default_rng(3)
    ways = rng.normal(size=(300, 3))
    ways[:, 2] = np.abs(ways[:, 2])
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    expected, is_sure = zip(*(_find_nearest(corners, owner, way) for way in ways), strict=True)
    given = json.dumps([corners.reshape(-1).tolist(), owner.tolist(), ways.tolist()])
    hits = page.ask(f"""(() => {{
      const [places, owner, ways] = {given}, count = owner.length;
      const faces = Array.from({{length: 3 * count}}, (_, k) => k);
      const model = {{places, facePart: owner, faces,
        faceStarts: [0, count], shells: [-99, -99, -99, 99, 99, 99], shellCount: 1}};
      const cube = lookAround(model, [0, 0, 0], [0, 1, 2, 3, 4, 5], null, 512);
      return ways.map((way) => findHit(cube, ...way) - 1);
    }})()""")
    kept = np.array(is_sure)
    assert kept.sum() > 250
    np.testing.assert_array_equal(np.array(hits)[kept], np.array(expected)[kept])
    assert set(np.array(expected)[kept]) == {-1, 0, 1, 2, 3, 4, 5}


def _find_nearest(corners, owner, way):
    """The solid that a ray from the origin meets first, -1: none; and whether no edge is near."""
    a, b, c = corners.transpose(1, 0, 2)
    volumes = np.stack([np.cross(p, q) @ way for p, q in ((a, b), (b, c), (c, a))])
    sizes = [np.linalg.norm(np.cross(p, q), axis=1) for p, q in ((a, b), (b, c), (c, a))]
    near = np.abs(volumes / np.maximum(sizes, 1e-12)).min(0)
    inside = (volumes > 0).all(0) | (volumes < 0).all(0)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (normal * a).sum(1) / (normal @ way)
    far = np.where(inside & (far > 0), far, np.inf)
    crossing = np.isfinite(far)
    is_sure = not crossing.any() or near[crossing].min() > 0.01
    return (int(owner[far.argmin()]) if crossing.any() else -1), is_sure


def test_a_chosen_place_leaves_the_picture_of_the_model_as_it_is(page, written, tmp_path):
    """Its sky and its mark are drawn without the model, which looks as if it had been drawn."""
    is_fine = "umbra.stage.renderer.samples === 4 && umbra.waits === 0"  # as it is at rest
    page.open(written, READY)
    page.wait(is_fine)
    page.ask("""(() => {
      const { renderer } = umbra.stage, draw = renderer.draw.bind(renderer);
      window.draws = 0;
      renderer.draw = () => { draws += 1; draw(); };
    })()""")
    page.click(420, 400)
    page.wait("umbra.state.place !== null && umbra.waits === 0")
    first = page.ask("umbra.state.place.position")
    assert page.ask("document.querySelectorAll('.sky svg').length") > 0
    page.click(560, 430)
    page.wait(f"umbra.state.place.position[0] !== {first[0]} && umbra.waits === 0")
    assert page.ask("draws") == 0
    page.shoot(tmp_path / "kept.png")
    page.ask("umbra.redraw()")
    page.wait(f"draws > 0 && {is_fine}")
    page.shoot(tmp_path / "drawn.png")
    wide, high = page.ask("[umbra.stage.canvas.clientWidth, umbra.stage.canvas.clientHeight]")
    kept, drawn = (
        np.asarray(Image.open(tmp_path / name).convert("RGB"))[:high, :wide]
        for name in ("kept.png", "drawn.png")
    )
    np.testing.assert_array_equal(kept, drawn)
    page.ask("umbra.stage.canvas.focus()")
    page.press("ArrowLeft")
    page.wait("draws > 1 && umbra.waits === 0")
    page.ask("umbra.set({ date: '2026-06-21', place: null })")
    page.wait("draws > 2 && umbra.waits === 0")
