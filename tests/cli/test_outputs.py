"""What ``umbra study`` writes when it is asked for more than its three files."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.command import VIENNA
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra.packages import write_install
from umbra.writers.folder import Outputs

DAY = ["--date", "2026-09-18", "--from", "10:00", "--to", "14:00", "--every", "1h", "--cell", "1"]


@pytest.fixture
def study(umbra_here, tower, tmp_path):
    """Run a small study of the tower with true pictures."""

    def run(*options, files=None, out="out"):
        where = ["--out", tmp_path / out]
        return umbra_here("study", *(files or [tower]), *VIENNA, *DAY, *where, *options)

    return run


def test_a_report_is_written_when_asked_for(study, tmp_path):
    said = study("--report")
    assert said.status == 0, said
    assert said.out.splitlines()[-1] == str(tmp_path / "out" / "report.html")
    text = (tmp_path / "out" / "report.html").read_text()
    assert (
        text.count("data:image/png;base64,") == 4
    )  # two sheets, the roofs, the live model's hours
    assert "tower.obj" in text
    assert "--report" in text  # the command
    assert study(out="plain").status == 0
    assert not (tmp_path / "plain" / "report.html").exists()


def test_a_report_is_written_with_canopies(study, tmp_path):
    crowned = {"house": box((-2, -2, 0), (2, 2, 12)), "crown": box((-8, -4, 4), (-3, 2, 9))}
    files = [save_obj(tmp_path / "crowned.obj", crowned)]
    leaves = ["--canopy", "crown", "--transmissivity", "0.03:50%", "--leaf-on", "04-15..10-31"]
    assert study(*leaves, "--report", "--write", "gif", files=files).status == 0
    text = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "3 % of the sun from 04-15 to 10-31 and 50 % on other dates" in text
    assert '"behind":"' in text


def test_formats_are_named_by_commas_or_one_by_one(study, tmp_path):
    said = study("--write", "csv,GIF", "--write", "glb", "--json")
    assert said.status == 0, said
    names = ["cells.csv", "instants.csv", "areas_by_hours.csv", "day.gif", "hours.glb"]
    assert [Path(name).name for name in said.json()["files"]][4:] == names
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {"study.nc", *names}


@pytest.mark.parametrize(
    ("given", "advice"),
    [("geotif", "did you mean geotiff?"), ("shp", "there are geotiff, geojson"), ("gpgk", "gpkg?")],
)
def test_an_unknown_format_is_refused_before_any_work(study, tmp_path, given, advice):
    said = study("--write", f"csv,{given}")
    assert f"'{given}'" in said.refusal()
    assert advice in said.refusal()
    assert not (tmp_path / "out").exists()


def test_a_missing_extra_is_named_before_any_work(study, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    refusal = study("--write", "geotiff").refusal()
    assert "geotiff needs rasterio" in refusal
    assert write_install("gis") in refusal
    assert not (tmp_path / "out").exists()


def test_a_disk_that_fills_midway_leaves_the_old_results(umbra_alone, tower, tmp_path):
    pytest.importorskip("resource")
    folder = tmp_path / "out"
    run = ["study", tower, *VIENNA, *DAY, "--out", folder]
    assert umbra_alone(*run).status == 0
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    # The three files just fit.
    limits = {"RLIMIT_FSIZE": max(map(len, before.values())) + 1000}
    for options in (["--write", "csv"], ["--report"]):
        said = umbra_alone(*run, "--cell", "0.2", *options, limits=limits)
        assert said.status == 1
        assert said.err.count("\n") == 1
        assert "could not write" in said.err
        assert "earlier results are unchanged" in said.err
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_plain_study_loads_nothing_of_this():
    code = (
        "import sys; from umbra.cli import main, study; "
        "print(*[name for name in sys.modules if name.startswith(('umbra.writers.', 'numpy'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = ("folder", "output_formats", "outputs")
    light = [f"umbra.writers.{name}" for name in names]
    assert sorted(done.stdout.split()) == light


def test_without_pictures_nothing_that_draws_is_loaded(tmp_path):
    code = (
        "import sys; from umbra.cli import main\n"
        "with __import__('contextlib').suppress(SystemExit): main(sys.argv[1:])\n"
        "print(*sorted({'matplotlib', 'scipy', 'xarray', 'PIL'} & sys.modules.keys()))"
    )
    model = tmp_path / "boxes.obj"
    model.write_text("v 0 0 0\nv 9 0 0\nv 9 9 0\nv 4 4 8\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    asked = (
        f"study {model} --date 2026-06-21 --lat 48.2 --lon 16.37 --tz Europe/Vienna --cell 1 "
        f"--no-pictures --out {tmp_path / 'out'}"
    ).split()
    done = subprocess.run(
        [sys.executable, "-c", code, *asked], capture_output=True, text=True, check=True
    )
    assert (tmp_path / "out" / "study.nc").exists()
    assert done.stdout.splitlines()[-1] in {"", "PIL"}


RULES = """\
format: 1
name: An example
version: "0"
source: Invented
checks:
  - {name: ground, dates: 03-21, at_least: 2h, share: 30}
"""


def test_rules_give_verdicts_in_csv_and_report(study, tmp_path):
    (tmp_path / "rules.yaml").write_text(RULES)
    said = study("--rules", tmp_path / "rules.yaml", "--report")
    assert said.status == 0, said
    text = (tmp_path / "out" / "verdicts.csv").read_text()
    assert "ground,2026-03-21,open ground,at least 2 h of sun on 30 % of the area" in text
    assert "An example, 0: all pass" in (tmp_path / "out" / "report.html").read_text()


def test_a_share_of_a_plan_that_nobody_chose_is_told(study, tmp_path):
    (tmp_path / "rules.yaml").write_text(RULES)
    said = study("--rules", tmp_path / "rules.yaml")
    assert "note: check 'ground' judges a share of the whole plan" in said.err
    chosen = study("--rules", tmp_path / "rules.yaml", "--extent", "-20,-20,20,20")
    assert "whole plan" not in chosen.err


def test_a_place_inside_a_building_is_told(study, tmp_path):
    check = "{name: bench, dates: 03-21, at_least: 2h, where: [{name: seat, x: 1, y: 0}]}"
    (tmp_path / "rules.yaml").write_text(RULES + f"  - {check}\n")
    said = study("--rules", tmp_path / "rules.yaml")
    assert said.status == 0
    assert "not in the open: 'seat' inside tower; each is judged where it is" in said.err
    assert "inside tower: no sun" in (tmp_path / "out" / "verdicts.csv").read_text()


def test_a_slip_in_the_rules_is_found_before_any_work(study, tmp_path):
    (tmp_path / "rules.yaml").write_text(RULES.replace("at_least", "atleast"))
    refusal = study("--rules", tmp_path / "rules.yaml").refusal()
    assert "rules.yaml, line 6: check 1 has the unknown key 'atleast'" in refusal
    assert "did you mean 'at_least'?" in refusal
    assert not (tmp_path / "out").exists()


def test_points_have_verdicts_and_tables(umbra_here, tower, tmp_path):
    (tmp_path / "rules.yaml").write_text(RULES)
    (tmp_path / "points.csv").write_text("name,x,y,z\nsouth,0,-9,1\nnorth,0,2.5,1\n")
    day = [option for option in DAY if option not in {"--cell", "1"}]
    where = ["--receivers", "points", "--points", tmp_path / "points.csv", "--out", tmp_path / "o"]
    more = ["--rules", tmp_path / "rules.yaml", "--write", "csv"]
    said = umbra_here("study", tower, *VIENNA, *day, *where, *more)
    assert said.status == 0, said
    verdicts = (tmp_path / "o" / "verdicts.csv").read_text().splitlines()
    assert [line.split(",")[2] for line in verdicts[1:]] == ["south", "north"]
    assert ",pass," in verdicts[1]
    assert (tmp_path / "o" / "points.csv").read_text().startswith("name,x,y,z,")
    assert said.out.splitlines()[-2:] == [str(tmp_path / "o" / n) for n in
                                          ("points.csv", "verdicts.csv")]  # fmt: skip


@pytest.mark.parametrize("options", [["--write", "gif"], ["--rules", "RULES"]])
def test_an_elevation_has_no_maps_and_rules(study, tmp_path, options):
    (tmp_path / "rules.yaml").write_text(RULES)
    options = [str(tmp_path / "rules.yaml") if o == "RULES" else o for o in options]
    assert "plans" in study("--receivers", "south", *options).refusal()


def test_formats_that_a_view_has_not_are_refused_by_name(study):
    said = study("--receivers", "south", "--write", "csv,geotiff,mp4").refusal()
    assert "--write geotiff,mp4 is not for --receivers south" in said
    assert "dxf" in study("--receivers", "215/35", "--write", "glb").refusal()
    camera = ["--receivers", "camera", "--eye", "9,9,9", "--target", "0,0,0"]
    assert "--write dxf is not" in study(*camera, "--write", "dxf").refusal()


def test_a_sheet_has_the_plan_and_its_elevations(study, tmp_path):
    said = study("--sheet", "--spells", "--every", "2h")
    assert said.status == 0, said
    assert str(tmp_path / "out" / "sheet.png") in said.out.splitlines()
    assert "--sheet shows a plan" in study("--sheet", "--receivers", "south").refusal()


@pytest.mark.parametrize("receivers", ["surfaces", "points"])
def test_surfaces_and_points_have_a_report(umbra_here, tower, tmp_path, receivers):
    (tmp_path / "rules.yaml").write_text(RULES)
    (tmp_path / "points.csv").write_text("name,x,y,z\nsouth,0,-9,1\nnorth,0,2.5,1\n")
    day = [option for option in DAY if option not in {"--cell", "1"}]
    where = ["--receivers", receivers, "--out", tmp_path / "o"]
    where += ["--points", tmp_path / "points.csv"] if receivers == "points" else ["--spacing", "2"]
    more = ["--rules", tmp_path / "rules.yaml", "--report"]
    said = umbra_here("study", tower, *VIENNA, *day, *where, *more)
    assert said.status == 0, said
    assert said.out.splitlines()[-1] == str(tmp_path / "o" / "report.html")
    text = (tmp_path / "o" / "report.html").read_text()
    named = "Tower, walls and roofs" if receivers == "surfaces" else "Tower, points"
    assert f"<h1>{named} · sun on 18 September 2026</h1>" in text
    assert "An example, 0: " in text
    assert "Part by part" in text or "Point by point" in text


def test_pictures_are_pdf_and_svg_too_when_asked_for(study, tmp_path):
    said = study("--write", "pdf,svg", "--json", "--quiet")
    names = [Path(name).name for name in said.json()["files"]]
    pictures = [
        f"{name}.{ending}" for name in ("hours", "profile") for ending in ("png", "pdf", "svg")
    ]
    assert names == ["study.nc", *pictures, "study.toml"]
    assert all((tmp_path / "out" / name).exists() for name in names)


def test_a_title_and_what_is_shown_reach_pictures_report_and_lines(study, tmp_path):
    words = ("--title", "Mill <Lane>", "--subtitle", "Option B", "--show", "sun")
    assert study(*words, "--report", "--write", "dxf,svg").status == 0
    picture = (tmp_path / "out" / "hours.svg").read_text()
    assert all(f">{text}</text>" in picture for text in ("Mill &lt;Lane&gt;", "Option B", "2 h"))
    assert ">hours of sun</text>" in picture
    page = (tmp_path / "out" / "report.html").read_text()
    assert '<h1>Mill &lt;Lane&gt;</h1>\n<p class="lead">Option B</p>' in page
    assert "<span>Hours of sun<span" in page
    assert '"show":"sun"' in page  # which mirrors the key
    drawing = (tmp_path / "out" / "study.dxf").read_text()
    assert "SUN_03" in drawing
    assert "HOURS_" not in drawing
    options = (tmp_path / "out" / "study.toml").read_text()
    assert 'title = "Mill <Lane>"' in options
    assert 'show = "sun"' in options


def test_a_view_with_a_title_of_its_own_tells_from_where_it_is_seen(study, tmp_path):
    assert study("--receivers", "south", "--title", "Mill Lane", "--write", "svg").status == 0
    picture = (tmp_path / "out" / "hours.svg").read_text()
    assert ">Mill Lane</text>" in picture
    assert ">elevation from the south · 18 September 2026, 10:00 to 14:00" in picture


def test_the_times_that_are_asked_for_are_shown(study, tmp_path):
    given = ("--at", "13:00,10:30", "--at", "12:00", "--write", "dxf,svg")
    assert study(*given).status == 0
    picture = (tmp_path / "out" / "profile.svg").read_text()
    assert all(f">{clock}</text>" in picture for clock in ("10:30", "12:00", "13:00"))
    assert ">11:00</text>" not in picture
    drawing = (tmp_path / "out" / "study.dxf").read_text()
    found = {line for line in drawing.splitlines() if line.startswith("SHADOW_")}
    assert found == {f"SHADOW_2026-09-18_{clock}" for clock in ("1030", "1200", "1300")}
    assert "BUILDINGS" in drawing
    assert 'at = ["13:00,10:30", "12:00"]' in (tmp_path / "out" / "study.toml").read_text()


def test_a_time_that_is_none_is_refused_before_any_work(study):
    assert "'noon' is not a clock time" in study("--at", "09:00,noon").refusal()


def test_the_axes_of_an_elevation_begin_at_nought(umbra_here, tmp_path):
    far = save_obj(tmp_path / "far.obj", {"tower": box((2600, 340000, 171), (2610, 340004, 183))})
    where = ["--out", tmp_path / "out", "--receivers", "south", "--write", "svg"]
    assert umbra_here("study", far, *VIENNA, *DAY[:-2], *where).status == 0
    picture = (tmp_path / "out" / "hours.svg").read_text()
    assert ">along the facade [m], from its left end; heights above z = 171 m</text>" in picture
    texts = set(re.findall(r">([^<]*)</text>", picture))
    assert {"0", "2", "8", "10"} <= texts
    assert not any(text.startswith(("2 6", "2\u20096", "17", "18")) for text in texts)


def test_files_of_an_earlier_study_are_named(study, tmp_path):
    assert "earlier" not in study("--write", "csv,gif", "--report").err
    mine = tmp_path / "out" / "notes.csv"
    mine.write_text("mine")
    said = study("--write", "csv", "--no-pictures")
    assert (
        "note: day.gif, hours.png, profile.png, report.html in "
        f"'{tmp_path / 'out'}' are of an earlier study, which this one did not replace; remove "
        "what is not wanted, or write into a new folder\n"
    ) in said.err
    assert mine.exists()
    assert (tmp_path / "out" / "report.html").exists()


def test_a_study_in_python_names_files_of_an_earlier_one(study, tmp_path):
    study("--no-pictures")
    scene = umbra.read(tmp_path / "tower.obj", up="z")
    site = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
    done = umbra.shadow_study(scene, site, date="2026-09-18", cell=4.0)
    with pytest.warns(UserWarning, match=r"note: study\.toml in .* is of an earlier study"):
        done.write(tmp_path / "out", pictures=False)


@pytest.mark.parametrize("alone", [{"paper": "a1"}, {"logo": "office.png"}])
def test_what_is_of_a_sheet_is_refused_without_it(alone):
    with pytest.raises(umbra.InputError) as caught:
        Outputs(**alone)
    assert caught.value.option == next(iter(alone))
