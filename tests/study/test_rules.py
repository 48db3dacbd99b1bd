"""Rules: verdicts that can be done by hand, and every slip named with its line."""

import csv
import datetime as dt
import re
import zoneinfo
from pathlib import Path

import numpy as np
import pytest
from support.forks import run_python
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.rules.first_format import CHECK_KEYS
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.rules import judge, read_rules
from umbra.sun import Site
from umbra.writers.csv_tables import write_samples, write_table
from umbra.writers.report.tables import make_verdict_table

ROOT = Path(__file__).parents[2]
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
RULES = """\
format: 1
name: An example
version: "0"
source: Invented for a test
checks:
  - name: open ground
    dates: [03-21, 2025-12-21]
    from: 09:00
    to: 17:00
    every: 15min
    at_least: 2h
    share: 50
  - name: windows
    dates: 03-21
    from: 10:00
    to: 14:00
    every: 10min
    at_least: 1h30min
    where:
      - {name: north, x: 0, y: 8}
      - {name: south, x: 0, y: -8}
"""


def make_study(**options):
    scene = make_scene([Part("tower", "", Mesh(*box((-5, -4, 0), (5, 4, 20))))])
    chosen = {"date": "2026-06-01", "start": "12:00", "end": "13:00", "every": "1h",
              "cell": 0.5, "extent": (-30, -20, 30, 40)} | options  # fmt: skip
    return run_study(scene, VIENNA, **chosen)


def read(tmp_path, text):
    path = tmp_path / "rules.yaml"
    path.write_text(text)
    return read_rules(path)


@pytest.fixture(scope="module")
def study():
    return make_study()


def test_a_file_is_read_as_it_is_written(tmp_path):
    rules = read(tmp_path, RULES)
    assert (rules.name, rules.version, rules.source) == ("An example", "0", "Invented for a test")
    ground, windows = rules.checks
    assert ground.dates == ((None, 3, 21), (2025, 12, 21))
    assert (ground.start, ground.end, ground.every) == ("09:00", "17:00", "15min")
    assert (ground.limit, ground.is_least) == (dt.timedelta(hours=2), True)
    assert (ground.share, ground.area, ground.measure) == (50.0, "open_ground", "sun_hours")
    assert windows.start == "10:00"  # YAML's own reading would be 600
    assert windows.limit == dt.timedelta(hours=1.5)
    assert [(p.name, p.x, p.y) for p in windows.places] == [("north", 0, 8), ("south", 0, -8)]


def test_areas_are_judged_by_the_cells_that_meet_the_limit(study, tmp_path):
    march, december, *_ = judge(study, read(tmp_path, RULES))
    assert march.date == dt.date(2026, 3, 21)  # the study's year
    assert december.date == dt.date(2025, 12, 21)
    for verdict in (march, december):
        alone = make_study(date=verdict.date.isoformat(), start="09:00", end="17:00", every="15min")
        is_open = alone.heights <= alone.ground
        share = 100 * np.mean(alone.sun_hours[is_open] >= 2 - 1e-3)
        assert verdict.measured == f"{share:.1f} % of the area"
        assert verdict.passes == (share >= 50)
        assert f"of {is_open.sum() * 0.25:,.0f} m² in a plan of 60 x 60 m" in verdict.evidence
        assert verdict.wanted == "at least 2 h of sun on 50 % of the area"


def test_places_are_judged_one_by_one(study, tmp_path):
    *_, north, south = judge(study, read(tmp_path, RULES))
    assert (north.where, north.passes, north.measured) == ("north", False, "0 h")
    assert north.evidence.startswith("no sun")
    assert (south.where, south.passes, south.measured) == ("south", True, "4 h")
    assert "4 h of sun in 1 spell, from 10:00 to 14:00" in south.evidence
    assert south.wanted == "at least 1 h 30 min of sun"


@pytest.mark.parametrize(
    ("measure", "more", "name"),
    [
        ("shadow_hours", "at_most: 3h", "shadow_hours"),
        ("longest_sun_hours", "at_least: 3h", "longest_sun_hours"),
        ("sun_hours_in_spells", "at_least: 3h\n    min_spell: 2h", "sun_hours_in_spells"),
    ],
)
def test_every_measure_is_that_of_the_study(tmp_path, measure, more, name):
    text = RULES[: RULES.index("  - name: windows")].replace("at_least: 2h", more)
    text = text.replace("share: 50", f"share: 20\n    measure: {measure}").replace(
        "[03-21, 2025-12-21]", "03-21"
    )
    (verdict,) = judge(make_study(), read(tmp_path, text))
    alone = make_study(
        date="2026-03-21", start="09:00", end="17:00", every="15min", spells=True, min_spell="2h"
    )
    values = np.asarray(alone.variables()[name][1])[alone.heights <= alone.ground]
    meets = values <= 3 + 1e-3 if measure == "shadow_hours" else values >= 3 - 1e-3
    assert verdict.measured == f"{100 * meets.mean():.1f} % of the area"
    assert 0 < meets.mean() < 1


def test_the_sun_counts_from_an_altitude_up(study, tmp_path):
    text = RULES.replace("    every: 10min\n", "    every: 1min\n    min_altitude: 40\n")
    text = text.replace("to: 14:00", "to: 16:00")
    *_, south = judge(study, read(tmp_path, text))
    hour, minute = (int(part) for part in
                    south.measured.replace(" h", "").replace(" min", "").split())  # fmt: skip
    from umbra.sun import find_sun  # noqa: PLC0415

    zone = zoneinfo.ZoneInfo("Europe/Vienna")
    midnight = dt.datetime(2026, 3, 21, 10, tzinfo=zone)
    minutes = [midnight + dt.timedelta(minutes=k + 0.5) for k in range(360)]
    assert hour * 60 + minute == np.count_nonzero(find_sun(VIENNA, minutes).altitude >= 40)
    assert "sun at 40° or higher" in south.evidence


def test_verdicts_go_into_a_table_with_their_source(study, tmp_path):
    rules = read(tmp_path, RULES)
    table = make_verdict_table(rules, judge(study, rules))
    assert table.title.startswith("An example, 0: ")
    assert table.title.endswith("of 4 fail")
    assert table.note == "Source: Invented for a test"
    write_table(tmp_path / "verdicts.csv", table.columns, table.rows)
    with (tmp_path / "verdicts.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["verdict"] for line in lines][2:] == ["fail", "pass"]


SLIPS = {
    "a wrong key": ("at_least: 2h", "at_lest: 2h", "line 11.*'at_lest'.*did you mean 'at_least'"),
    "a far key": ("share: 50", "zzz: 50", "line 12.*'zzz'; there are name, dates"),
    "a wrong key above": ("source:", "sorce:", "line 4.*'sorce'.*did you mean 'source'"),
    "a key twice": ("to: 17:00", "to: 17:00\n    to: 18:00", "line 10.*'to' twice"),
    "no limit": ("    at_least: 2h\n", "", "line 6.*needs 'at_least' or 'at_most'"),
    "two limits": ("share: 50", "at_most: 3h", "both 'at_least' and 'at_most'"),
    "no name": ("name: An example\n", "", "lacks 'name'"),
    "no source": ("source: Invented for a test\n", "", "lacks 'source'"),
    "a wrong date": ("[03-21, 2025-12-21]", "[03-21, 21.12.]", "line 7.*a date is written 03-21"),
    "no such date": ("[03-21, 2025-12-21]", "2025-02-29", "line 7.*there is no date '2025-02-29'"),
    "a wrong duration": ("at_least: 2h", "at_least: two hours", "line 11.*'two hours' is not"),
    "a wrong time": ("to: 17:00", "to: 27:00", "line 6.*check 1.*end 27:00 is not on the clock"),
    "a wrong step": ("every: 15min", "every: 0min", "line 10.*'every' '0min' is not longer"),
    "a long step": ("every: 15min", "every: 9h", "check 1: the step 9h is longer"),
    "a wrong share": ("share: 50", "share: 120", "'share' must be above 0"),
    "a share of text": ("share: 50", "share: half", "line 12.*must be a number; got 'half'"),
    "a wrong area": (
        "share: 50",
        "where: garden",
        "open_ground, roofs, walls, everywhere; got 'garden'",
    ),
    "a wrong measure": ("share: 50", "measure: hours", "sun_hours, longest_sun_hours"),
    "a place without x": ("{name: north, x: 0, y: 8}", "{name: north, y: 8}", "line 20.*lacks 'x'"),
    "a lone least spell": ("share: 50", "min_spell: 5min", "goes with measure"),
    "a share of places": ("every: 10min", "share: 5", "places are judged one by one"),
    "another format": ("format: 1", "format: 2", "line 1.*this version reads 1"),
    "not YAML": ("checks:", "checks: [", "this is not YAML"),
    "no mapping": (RULES, "- a\n- b\n", "must be keys with values"),
    "nothing": (RULES, "", "are empty; give"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_named_with_its_line(tmp_path, slip):
    right, wrong, message = SLIPS[slip]
    assert right in RULES
    with pytest.raises(InputError, match=f"(?s){message}") as caught:
        read(tmp_path, RULES.replace(right, wrong, 1))
    assert "\n" not in str(caught.value)


def test_a_missing_or_unreadable_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the rules '.*none.yaml' \(No such file"):
        read_rules(tmp_path / "none.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00x")
    with pytest.raises(InputError, match="not UTF-8"):
        read_rules(tmp_path / "binary.yaml")


def test_a_place_outside_the_plan_is_refused_by_name(study, tmp_path):
    rules = read(tmp_path, RULES.replace("x: 0, y: 8", "x: 900, y: 8"))
    with pytest.raises(InputError, match=r"the place .north. .* lies outside the plan"):
        judge(study, rules)


def test_roofs_need_the_topmost_surfaces(study, tmp_path):
    rules = read(tmp_path, RULES.replace("share: 50", "where: roofs", 1))
    with pytest.raises(InputError, match="receivers='top'"):
        judge(study, rules)
    verdict, *_ = judge(make_study(receivers="top"), rules)
    assert verdict.measured == "100.0 % of the area"
    assert "80 of 80 m²" in verdict.evidence


def test_the_example_of_the_docs_is_right(tmp_path):
    page = (ROOT / "docs" / "results.md").read_text()
    (example,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    rules = read(tmp_path, example)
    assert "Invented" in rules.source
    assert [len(check.dates) for check in rules.checks] == [1, 2]
    for key in CHECK_KEYS:  # each has its row in the table
        assert f"`{key}`" in page


def test_the_places_of_the_docs_lie_in_the_open(tmp_path):
    path = tmp_path / "block.city.json"
    run_python(ROOT / "examples" / "city_block.py", path, check=True)
    scene = umbra.read(path)
    options = {"date": "2026-03-21", "every": "4h", "cell": 4}
    study = run_study(scene, umbra.find_site(scene), **options)
    (text,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/results.md").read_text(), re.DOTALL)
    verdicts = judge(study, read(tmp_path, text))[1:]
    # One that passes on both dates, one that fails on one: each word of the page is earned.
    assert [(v.where, v.date.month, v.passes, v.standing) for v in verdicts] == [
        ("playground", 3, True, ""), ("bench", 3, True, ""),
        ("playground", 12, True, ""), ("bench", 12, False, ""),
    ]  # fmt: skip
    inside = judge(study, read(tmp_path, text.replace("x: 2670, y: 340090", "x: 2720, y: 340095")))
    assert inside[1].standing == "inside Church-nave"


STANDING = {
    "tower": box((-5, -4, 0), (5, 4, 20)),
    "bridge": box((10, -4, 5), (20, 4, 6)),
    "hall": tuple(array[:, ::-1] if k else array for k, array in
                  enumerate(box((-5, 10, 0), (5, 16, 6)))),
}  # fmt: skip


@pytest.mark.parametrize(
    ("x", "y", "receivers", "standing"),
    [
        (0, 0, "ground", "inside tower"),
        (15, 0, "ground", "under bridge"),
        (1, 12, "ground", "inside hall"),  # wound inside out
        (5.2, 0, "ground", ""),
        (0, 8, "ground", ""),
        (15, 0, "top", "on top of bridge"),
        (0, 8, "top", ""),
    ],
)
def test_a_place_in_under_or_on_something_is_told(tmp_path, x, y, receivers, standing):
    parts = [Part(name, "", Mesh(*mesh)) for name, mesh in STANDING.items()]
    options = {"date": "2026-06-01", "start": "12:00", "end": "13:00", "every": "1h", "cell": 1,
               "extent": (-30, -20, 30, 40), "receivers": receivers}  # fmt: skip
    found = run_study(make_scene(parts), VIENNA, **options)
    text = RULES.replace("name: north, x: 0, y: 8", f"name: north, x: {x}, y: {y}")
    *_, north, south = judge(found, read(tmp_path, text))
    assert (north.standing, south.standing) == (standing, "")
    assert north.evidence.startswith(f"{standing}: ") == bool(standing)


def test_a_place_is_marked_once_and_passes_if_all_its_verdicts_do(study, tmp_path):
    text = RULES.replace("x: 0, y: 8", "x: 0, y: 0")
    rules = read(tmp_path, text)
    table = make_verdict_table(rules, judge(study, rules))
    assert [(p.name, p.x, p.y, p.passes, p.standing) for p in table.pins] == [
        ("north", 0, 0, False, "inside tower"), ("south", 0, -8, True, ""),
    ]  # fmt: skip
    assert list(table.index) == [None, None, 0, 1]
    assert (table.kind, table.columns[table.link]) == ("place", "where")


WINDOWS = """\
format: 1
name: Windows
version: "0"
source: Invented for a test
checks:
  - name: two hours
    dates: [03-21, 12-21]
    from: 09:00
    to: 17:00
    every: 15min
    at_least: 2h
    share: 60
"""


def run_points(**options):
    scene = make_scene(
        [Part("tower", "", Mesh(*box((-5, -4, 0), (5, 4, 20)))),
         Part("house", "", Mesh(*box((-5, 10, 0), (5, 16, 6))))]
    )  # fmt: skip
    chosen = {"date": "2026-03-21", "start": "09:00", "end": "17:00", "every": "15min",
              "receivers": "surfaces"} | options  # fmt: skip
    return scene, run_study(scene, VIENNA, **chosen)


def test_windows_are_judged_one_by_one(tmp_path):
    points = [(0, -4.001, 10, 0, -1, 0), (0, 4.001, 10, 0, 1, 0), (0, 9.999, 1, 0, -1, 0)]
    _, found = run_points(receivers="points", points=points, names=["S", "N", "behind"])
    verdicts = judge(found, read(tmp_path, WINDOWS))
    assert [(v.where, v.date.month) for v in verdicts] == [
        (name, month) for month in (3, 12) for name in ("S", "N", "behind")
    ]
    for verdict, hours in zip(verdicts[:3], found.sun_hours, strict=True):
        assert verdict.passes == (hours >= 2 - 1e-3)
        assert sum(int(n) * f for n, f in zip(re.findall(r"\d+", verdict.measured), (60, 1))) == (
            round(hours * 60)
        )
    assert verdicts[0].passes
    assert not verdicts[1].passes
    assert verdicts[1].evidence.startswith("no sun")


def test_surfaces_are_judged_part_by_part(tmp_path):
    _, found = run_points(receivers="surfaces", spacing=1.0, spells=True)
    verdicts = judge(found, read(tmp_path, WINDOWS))
    assert [(v.where, v.date.month) for v in verdicts] == [
        (name, month) for month in (3, 12) for name in ("house", "tower")
    ]
    area, owner = (np.asarray(found.more[n][1]) for n in ("area", "surface_of_sample"))
    part = np.asarray(found.more["surface_part"][1])[owner]
    for k, verdict in enumerate(verdicts[:2]):
        mine = part == k
        share = 100 * area[mine & (found.sun_hours >= 2 - 1e-3)].sum() / area[mine].sum()
        assert verdict.measured == f"{share:.1f} % of the area"
        assert verdict.passes == (share >= 60)


def test_roofs_and_walls_are_judged_alone(tmp_path):
    _, found = run_points(receivers="surfaces", spacing=1.0)
    area, owner = (np.asarray(found.more[n][1]) for n in ("area", "surface_of_sample"))
    part = np.asarray(found.more["surface_part"][1])[owner]
    is_roof = found.places.normals[:, 2] > 0.5
    for where, which in (("roofs", is_roof), ("walls", ~is_roof)):
        rules = read(tmp_path, WINDOWS.replace("share: 60", f"share: 60\n    where: {where}"))
        verdicts = judge(found, rules)
        for k, verdict in enumerate(verdicts[:2]):
            mine = which & (part == k)
            share = 100 * area[mine & (found.sun_hours >= 2 - 1e-3)].sum() / area[mine].sum()
            assert verdict.measured == f"{share:.1f} % of the area of its {where}"
            assert f"of {area[mine].sum():,.1f} m²" in verdict.evidence
    _, flat = run_points(receivers="points", points=[(0, -9, 1)])
    with pytest.raises(InputError, match="names walls of a model"):
        judge(flat, rules)
    with pytest.raises(InputError, match="is for walls; run the study with receivers='surfaces'"):
        judge(make_study(), rules)


def test_places_of_a_plan_are_not_points(tmp_path):
    _, found = run_points(receivers="points", points=[(0, -9, 1)])
    with pytest.raises(InputError, match="names places of a plan"):
        judge(found, read(tmp_path, RULES))


def test_samples_go_into_tables(tmp_path):
    _, found = run_points(receivers="surfaces", spacing=2.0, spells=True)
    assert write_samples(tmp_path, found) == ["samples.csv", "surfaces.csv", "parts.csv"]
    tables = {}
    for name in ("samples", "surfaces", "parts"):
        with (tmp_path / f"{name}.csv").open(newline="") as file:
            tables[name] = list(csv.DictReader(file))
    assert [line["part"] for line in tables["parts"]] == ["house", "tower"]
    hours = [float(line["sun_hours"]) for line in tables["samples"]]
    np.testing.assert_allclose(hours, found.sun_hours, atol=1e-4)
    positions = [[float(line[axis]) for axis in "xyz"] for line in tables["samples"]]
    np.testing.assert_allclose(positions, found.places.points, atol=1e-4)
    assert len(tables["surfaces"]) == len(found.more["surface_area"][1])
    _, found = run_points(receivers="points", points=[(0, -9, 1)], names=["a, b"])
    assert write_samples(tmp_path, found) == ["points.csv"]
    with (tmp_path / "points.csv").open(newline="") as file:
        (line,) = csv.DictReader(file)
    assert (line["name"], line["nx"]) == ("a, b", "")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("rules: " + "[" * 20_000, "nested too deep"),
        ("a: &a [1, 2]\nb: &b [*a, *a]\n", r"line 2: .*an alias \(\*name\)"),
        ("#" * 1_000_001, "larger than 1 MB"),
    ],
)
def test_rules_are_short_and_flat(tmp_path, text, match):
    path = tmp_path / "rules.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=match):
        read_rules(path)
