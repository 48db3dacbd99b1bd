"""Verdicts on named receivers of a city in tiles are those of one study of all files."""

import json
import re
import shutil
import warnings
from base64 import b64decode

import numpy as np
import pytest
from support.cities import DAY, make_houses

import umbra
from umbra.cli.main import main
from umbra.errors import InputError
from umbra.readers.window_files import read_windows
from umbra.rules import read_rule
from umbra.tiles import city_runs, city_verdicts
from umbra.tiles.city_verdicts import gather_city, judge_city
from umbra.verdicts import Gathered, Model, judge_rules
from umbra.writers.proof.rows import list_conditions_of, list_rows, tell_verdicts
from umbra.writers.proof.verdict_files import list_verdict_tables

shapely = pytest.importorskip("shapely")

OPTIONS = {
    **DAY, "every": "3h", "receivers": "ground", "cell": 7.5, "date": "2026-03-21",
    "extent": (85000, 447000, 85240, 447240),
}  # fmt: skip
GARDENS = {
    "long": shapely.box(85020, 447090, 85200, 447102),
    "bent": shapely.Polygon([(85090, 447150), (85130, 447150), (85090, 447190)]),
    "patch": shapely.box(85125, 447084, 85135, 447090),  # in the square of a run of the yard
    "yard": shapely.box(85150, 447100, 85160, 447112),
}
PROPOSAL = {"proposed": ["west 11"], "replace": ["west 2?"]}
ZONE = "Europe/Amsterdam"


@pytest.fixture(autouse=True)
def runs(monkeypatch):
    """Cut receivers into runs of small squares."""
    monkeypatch.setattr(city_runs, "_SIDE", 40.0)


def judge_both(city, folder, rules, given=(), **options):
    """Return the rows of verdicts and conditions in tiles and of one model."""
    given, asked = dict(given), {**OPTIONS, **options}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = umbra.read(*city)
        study = umbra.shadow_study(scene, umbra.find_site(scene), **asked)
        made = umbra.city_study(city, out=folder, tiles=120, **asked)
    options = made.job.options
    model = Model(
        scene=study.result.model.scene, site=study.result.site, year=2026, options=options,
        proposed=tuple(options.proposed),
    )  # fmt: skip
    shared = {"areas": options.areas, "areas_on": options.areas_on, **given}
    rules = [read_rule(name) for name in rules]
    found = judge_rules(gather_city(made.job, 2026, **shared), rules)
    whole = judge_rules(Gathered(model, **shared), rules)
    if not given:
        assert list_rows(judge_city(made.job, rules), ZONE) == list_rows(found, ZONE)
    for one in (list_rows, list_conditions_of):
        assert one(found, ZONE) == one(whole, ZONE)
    assert [one.notes for one in found] == [one.notes for one in whole]
    return found


def test_gardens_are_judged_as_of_one_study(city, tmp_path):
    (found,) = judge_both(city, tmp_path, ["bre-209-gardens"], areas=GARDENS, **PROPOSAL)
    assert [one.where for one in found.findings] == list(GARDENS)
    assert any(one.outcome.before != one.outcome.after for one in found.findings)


@pytest.mark.parametrize("more", [{"areas_on": "top"}, {"ground": "feet"}, {"canopy": "west 1?"}])
def test_gardens_of_other_models_are_judged_as_of_one_study(city, tmp_path, more):
    judge_both(city, tmp_path, ["zurich-abv"], areas=GARDENS, **PROPOSAL, **more)


def test_windows_and_bands_are_judged_as_of_one_study(city, tmp_path):
    """By hours, by the exact sky, with reveals, within a wall, in bands by the sun's time."""
    table = tmp_path / "windows.csv"
    rows = ["name,x,y,z,azimuth,width,height,reveal,flat,room"]
    rows += [f"w{k},{85030 + 37 * k},{447040 + 29 * k},{3 + k},{60 * k},1.2,1.5,{0.2 * (k % 2)},"
             f"f{k % 3},living" for k in range(6)]  # fmt: skip
    table.write_text("\n".join(rows))
    windows = read_windows(table)
    given = {"windows": windows, "plot": {"plot": shapely.box(85100, 447100, 85130, 447140)}}
    rules = ["en-17037-sunlight", "bre-209-vsc", "japan-56-2:4m-4h", "nsw-adg-4a"]
    found = judge_both(city, tmp_path / "out", rules, given, areas=GARDENS, **PROPOSAL)
    assert [len(one.findings) > 0 for one in found] == [True] * 4
    assert len({one.outcome.value for one in found[1].findings}) > 3


def test_what_tiles_lack_is_unknown_which_overrides_pass(city, tmp_path):
    _, x, y, _, wide, deep, _, turn = make_houses(1, 60, (85000, 447000), (85250, 447240))[15]
    middle = complex(x, y) + complex(wide, deep) / 2 * np.exp(1j * turn)
    areas = {**GARDENS, "cellar": shapely.Point(middle.real, middle.imag).buffer(1)}
    made = umbra.city_study(city, out=tmp_path, tiles=120, **OPTIONS, areas=areas)
    (verdict,) = judge_city(made.job, [read_rule("tno-light")])
    assert [one.verdict for one in verdict.findings] == ["unknown"]
    assert "tiles=" in verdict.findings[0].outcome.needs
    (verdict,) = judge_city(made.job, [read_rule("bre-209-gardens")])
    assert [one.verdict for one in verdict.findings] == ["pass"] * 4 + ["unknown"]  # no proposal
    assert verdict.verdict == "unknown"


def test_the_command_writes_verdicts_and_a_report(city, tmp_path, capsys):
    """With a name that is no HTML, and of areas that fail, pass and are unknown."""
    areas = tmp_path / "areas.geojson"
    shapes = {**GARDENS, "<b>&": shapely.box(85100, 447020, 85130, 447050)}
    features = [
        {"type": "Feature", "properties": {"name": name},
         "geometry": shapely.geometry.mapping(shape)}
        for name, shape in shapes.items()
    ]  # fmt: skip
    areas.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    words = [
        "study", *map(str, city), "--date", "2026-03-21", "--every", "3h", "--receivers", "ground",
        "--cell", "7.5", "--extent", "85000,447000,85240,447240", "--areas", str(areas),
        "--proposed", "west 11", "--rules", "bre-209-gardens", "--report",
    ]  # fmt: skip
    said = {}
    for name, more in (("tiles", ["--tiles", "120"]), ("whole", ["--no-pictures"])):
        with pytest.raises(SystemExit) as ended:
            main([*words, *more, "--out", str(tmp_path / name)])
        said[name] = capsys.readouterr().err
        assert ended.value.code == 0, said[name]
    for name in ("verdicts.csv", "areas.csv"):
        texts = [(tmp_path / one / name).read_text() for one in ("tiles", "whole")]
        assert texts[0] == texts[1]
    page = (tmp_path / "tiles/report.html").read_text()
    assert page.count('class="area ') == len(shapes)
    assert '<g class="area pass" id="area-0"><title>long: pass</title>' in page
    assert "<b>" not in page
    assert "within 20 m of buildings" in page.replace("\N{NO-BREAK SPACE}", " ")
    assert "data:image/png;base64," in page
    lines = [line for line in said["whole"].splitlines() if " sun reaches " in line]
    assert lines
    assert set(lines) <= set(said["tiles"].splitlines())


def test_what_a_rule_takes_for_granted_is_told(city, tmp_path):
    """Without a proposal the shadows of all parts count."""
    made = umbra.city_study(city, out=tmp_path, tiles=120, **OPTIONS, areas=GARDENS)
    verdicts = judge_city(made.job, [read_rule("zurich-abv")])
    (note,) = verdicts[0].notes
    assert note in tell_verdicts(verdicts)[-1]
    (table,) = list_verdict_tables(verdicts, ZONE)
    assert note in table.note


def test_rules_that_judge_no_areas_are_refused_before_counting(city, tmp_path):
    first = tmp_path / "rules.yaml"
    first.write_text(
        "format: 1\nname: r\nversion: '1'\nsource: s\nchecks:\n"
        "  - {name: c, dates: 03-21, at_least: 2h, share: 50}\n"
    )
    out = tmp_path / "out"
    for rules, areas, option in (
        (first, GARDENS, "rules"), ("tno-light", None, "areas"),
    ):  # fmt: skip
        made = {**OPTIONS, "areas": areas}
        with pytest.raises(InputError) as caught:
            umbra.city_study(city, out=out, tiles=120, **made).judge(rules)
        assert caught.value.option == option
        shutil.rmtree(out)


def test_a_proof_in_tiles_is_that_of_one_model_and_goes_on_where_it_ended(
    city, tmp_path, capsys, monkeypatch
):
    """With bands across a road, reveals, a proposal that replaces; ended in the midst."""
    table = tmp_path / "windows.csv"
    rows = ["name,x,y,z,azimuth,width,height,reveal,flat,room"]
    rows += [f"w{k},{85030 + 37 * k},{447040 + 29 * k},{3 + k},{60 * k},1.2,1.5,{0.2 * (k % 2)},"
             f"f{k % 3},living" for k in range(6)]  # fmt: skip
    table.write_text("\n".join(rows))
    shapes = {
        "gardens": GARDENS, "plot": {"plot": shapely.box(85100, 447100, 85130, 447140)},
        "roads": {"road": shapely.box(85080, 447140, 85160, 447146)},
    }  # fmt: skip
    for name, own in shapes.items():
        features = [
            {"type": "Feature", "properties": {"name": key},
             "geometry": shapely.geometry.mapping(shape)}
            for key, shape in own.items()
        ]  # fmt: skip
        text = json.dumps({"type": "FeatureCollection", "features": features})
        (tmp_path / f"{name}.geojson").write_text(text)
    rules = ("bre-209-gardens", "en-17037-sunlight:czechia", "japan-56-2:4m-4h")
    words = [
        "prove", *map(str, city), "--areas", f"{tmp_path}/gardens.geojson", "--windows", str(table),
        "--plot", f"{tmp_path}/plot.geojson", "--roads", f"{tmp_path}/roads.geojson", "--proposed",
        "west 11", "--replace", "west 2?", "--year", "2026", "--quiet",
        *(word for rule in rules for word in ("--rules", rule)),
    ]  # fmt: skip
    counted = []
    count = city_verdicts.count_among

    def run(name, *more, ends_after=99):
        counted.clear()

        def end_sometimes(*given):
            if len(counted) == ends_after:
                raise KeyboardInterrupt
            counted.append(given)
            return count(*given)

        monkeypatch.setattr(city_verdicts, "count_among", end_sometimes)
        with pytest.raises(SystemExit) as ended:
            main([*words, *more, "--out", str(tmp_path / name)])
        assert (ended.value.code == 0) == (ends_after == 99), capsys.readouterr().err
        return len(counted)

    run("whole")
    assert run("tiles", "--tiles", "60", ends_after=5) == 5
    assert not (tmp_path / "tiles/verdicts.csv").exists()
    kept = sorted((tmp_path / "tiles/verdicts").iterdir())
    kept[0].write_bytes(kept[0].read_bytes()[:-9])
    rest = run("tiles", "--tiles", "60")
    every = len([*(tmp_path / "tiles/verdicts").iterdir()])
    assert every - 5 + 1 == rest > 5  # also that of which nine bytes are missing
    for name in ("verdicts.csv", "conditions.csv"):
        texts = {(tmp_path / one / name).read_text() for one in ("tiles", "whole")}
        assert len(texts) == 1
    pages = [(tmp_path / one / "proof.html").read_text() for one in ("tiles", "whole")]
    packed = [re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", page) for page in pages]
    drawn = [len(re.findall(rb"<(?:path|poly|use)", b64decode(own))) for (own,) in packed]
    assert drawn[0] > 100
    assert drawn[0] == pytest.approx(drawn[1], rel=0.05)  # what two files hold is drawn once
