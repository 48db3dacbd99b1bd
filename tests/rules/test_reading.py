"""Rules as files: every shipped one, and every slip named with its line."""

import json
from pathlib import Path

import pytest
from support.forks import run_umbra

import umbra
from umbra.errors import InputError
from umbra.rules import Alternative, Condition, list_conditions, read_rule
from umbra.rules.read import find_shipped
from umbra.rules.words import STANDINGS

NAMES = {
    "bre-209-gardens", "bre-209-apsh", "bre-209-vsc", "en-17037-sunlight", "tno-light",
    "tno-strict", "zurich-abv", "japan-56-2", "china-gb-50180", "korea-sunlight", "nsw-adg-4a",
    "nyc-ceqr", "sf-295", "poland-wt-60", "germany-before-after",
}  # fmt: skip
OWN = """\
format: 2
name: An example
edition: "0"
source: Invented for a test
checks:
  - name: two hours
    receivers: areas
    dates: [03-21, 02-19..10-21]
    from: sunrise+1h
    to: 17:00
    at_least: 2h
    any_of:
      - share: 50
      - ratio_to_before: 0.8
"""


def read(tmp_path, text):
    path = tmp_path / "own.yaml"
    path.write_text(text)
    return read_rule(path)


def test_all_rules_are_there_and_cited():
    rules = umbra.list_rules()
    assert {rule.name for rule in rules} == NAMES == set(find_shipped())
    for rule in rules:
        assert rule.standing in STANDINGS
        assert rule.standing != "own"
        for fact in ("title", "place", "edition", "source", "asks", "read", "first_hand",
                     "second_hand", "before_use"):  # fmt: skip
            assert getattr(rule, fact), (rule.name, fact)
        assert rule.text.startswith("format: 2\n")


def test_a_printed_rule_is_read_again_the_same(tmp_path):
    for name in find_shipped():
        path = tmp_path / f"{name}.yaml"
        path.write_text(read_rule(name)[0].text)
        assert read_rule(path) == read_rule(name)


def limits(rule):
    return [
        (one.at_least, one.at_most, one.share, one.ratio_to_before, one.loss_at_most)
        for requirement in rule.requirements
        for one in list_conditions(requirement.condition)
    ]


PUBLISHED = {
    "bre-209-gardens": [(2, None, 50, None, None), (2, None, None, 0.8, None)],
    "bre-209-vsc": [(27, None, None, None, None), (None, None, None, 0.8, None)],
    "en-17037-sunlight": [(h, None, None, None, None) for h in (1.5, 3, 4)],
    "tno-light": [(2, None, None, None, None)],
    "tno-strict": [(3, None, None, None, None)],
    "zurich-abv": [(None, 3, None, None, None)],
    "japan-56-2:1.5m-3h": [(None, 3, None, None, None), (None, 2, None, None, None)],
    "japan-56-2:4m-4h": [(None, 4, None, None, None), (None, 2.5, None, None, None)],
    "japan-56-2:6.5m-5h": [(None, 5, None, None, None), (None, 3, None, None, None)],
    "japan-56-2:hokkaido-4m-2h": [(None, 2, None, None, None), (None, 1.5, None, None, None)],
    "china-gb-50180": [(2, None, None, None, None)],
    "china-gb-50180:nursery": [(3, None, None, None, None)],
    "korea-sunlight": [(4, None, None, None, None), (2, None, None, None, None)],
    "nsw-adg-4a:elsewhere": [(3, None, None, None, None), (None, 0, None, None, None)],
    "poland-wt-60": [(3, None, None, None, None)],
    "poland-wt-60:city-centre": [(1.5, None, None, None, None)],
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_limits_are_those_published(name):
    assert limits(read_rule(name)[0]) == PUBLISHED[name]


def test_times_are_those_published():
    first = {name: next(list_conditions(read_rule(name)[0].requirements[0].condition))
             for name in ("tno-light", "tno-strict", "nyc-ceqr", "sf-295", "zurich-abv",
                          "japan-56-2:hokkaido-4m-2h", "japan-56-2:4m-4h")}  # fmt: skip
    assert first["tno-light"].dates == ("02-19..10-21",)
    assert first["tno-strict"].dates == ("01-21..11-22",)
    assert (first["tno-light"].over, first["nyc-ceqr"].over) == ("worst", "each")
    assert first["nyc-ceqr"].dates == ("12-21", "03-21", "05-06", "06-21")
    assert (first["sf-295"].start, first["sf-295"].end) == ("sunrise+1h", "sunset-1h")
    assert first["zurich-abv"].dates == ("11-03", "02-08")
    hokkaido, japan = first["japan-56-2:hokkaido-4m-2h"], first["japan-56-2:4m-4h"]
    assert (hokkaido.start, hokkaido.end, hokkaido.clock) == ("09:00", "15:00", "solar")
    assert (japan.start, japan.end) == ("08:00", "16:00")
    korea = [*list_conditions(read_rule("korea-sunlight")[0].requirements[0].condition)]
    assert [(one.start, one.end, one.measure) for one in korea] == [
        ("08:00", "16:00", "sun_hours"), ("09:00", "15:00", "longest_sun_hours"),
    ]  # fmt: skip


def test_variants_are_chosen_set_and_refused():
    assert len(read_rule("japan-56-2")) == 18
    assert [one.variant for one in read_rule("tno-light")] == ["as-tno"]
    assert len(read_rule("tno-light:every")) == 2
    (own,) = read_rule("en-17037-sunlight:lowest_sun=11.5")
    assert next(list_conditions(own.requirements[0].condition)).min_altitude == 11.5
    with pytest.raises(InputError, match="did you mean 'den-haag'") as caught:
        read_rule("tno-light:den-hag")
    assert caught.value.option == "rules"
    with pytest.raises(InputError, match="it has lowest_sun"):
        read_rule("tno-light:lowest=3")
    with pytest.raises(InputError, match="did you mean 'bre-209-gardens'"):
        read_rule("bre-209-garden")


def test_what_a_condition_does_not_say_is_of_the_check(tmp_path):
    (rule,) = read(tmp_path, OWN)
    alternative = rule.requirements[0].condition
    assert isinstance(alternative, Alternative)
    share, ratio = alternative.conditions
    assert (share.dates, share.start, share.at_least) == (
        ("03-21", "02-19..10-21"), "sunrise+1h", 2.0,
    )  # fmt: skip
    assert (share.share, ratio.share, ratio.ratio_to_before) == (50, None, 0.8)
    assert (share.needs_before, ratio.needs_before) == (False, True)


def test_files_of_format_1_are_read_too(tmp_path):
    text = OWN.replace("format: 2", "format: 1").replace("edition", "version")
    limit = "    dates: 03-21\n    at_least: 2h\n    share: 50\n"
    text = text[: text.index("    receivers")] + limit
    (rule,) = read(tmp_path, text)
    (requirement,) = rule.requirements
    assert requirement.receivers == ("areas", "windows")
    assert requirement.condition == Condition(dates=("03-21",), at_least=2.0, share=50.0)


SLIPS = {
    "a wrong key": ("at_least", "at_lest", "line 11.*'at_lest'.*did you mean 'at_least'"),
    "a wrong key inside": ("      - share", "      - shares", "line 13.*'shares'.*'share'"),
    "a wrong date": ("03-21,", "21.3.,", "line 8.*'21.3.' is not a date"),
    "no such date": ("03-21,", "02-30,", "line 8.*there is no date '02-30'"),
    "a wrong time": ("sunrise+1h", "dawn", "line 9.*'dawn' is not a time"),
    "a wrong hour": ("to: 17:00", "to: 27:00", "line 10.*27:00 is not on the clock"),
    "no dates": ("    dates: [03-21, 02-19..10-21]\n", "", "lacks 'dates'"),
    "dates of the sky": ("at_least: 2h", "measure: sky_component", "is of no date"),
    "a wrong measure": ("at_least: 2h", "measure: sun_hour", "did you mean 'sun_hours'"),
    "a wrong amount": ("at_least: 2h", "at_least: 2", "is an amount .*such as 1h30min"),
    "wrong receivers": ("receivers: areas", "receivers: gardens", "areas, windows, band, places"),
    "one alternative": ("      - ratio_to_before: 0.8\n", "", "needs 2 to 20 conditions; got 1"),
    "no limit": ("      - ratio_to_before: 0.8\n", "      - every: 5min\n", None),
    "facing of areas": ("at_least: 2h", "facing: 90..270\n    at_least: 2h", "is of windows"),
    "a share of windows": ("receivers: areas", "receivers: windows", "'share' is of areas"),
    "a value of no variant": ("at_least: 2h", "at_least: $limit", "'\\$limit' is in no variant"),
    "two alternatives": ("    any_of", "    levels: {a: 2h}\n    any_of", "has both 'any_of'"),
    "falling levels": ("    any_of:\n      - share: 50\n      - ratio_to_before: 0.8\n",
                       "    levels: {a: 3h, b: 2h}\n", "rise from the first"),
    "a lone spell": ("at_least: 2h", "at_least: 2h\n    min_spell: 5min", "goes with measure"),
    "a wrong standing": ("source:", "standing: known\nsource:", "first-hand, in-part"),
    "another format": ("format: 2", "format: 3", "line 1.*this version reads 1 and 2"),
    "a share of flats": ("at_least: 2h", "share_of: flat\n    at_least: 2h", "share_at_least"),
    "a band of areas": ("at_least: 2h", "band: 5..10\n    at_least: 2h", "receivers: band"),
}  # fmt: skip


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_named_with_its_line(tmp_path, slip):
    right, wrong, message = SLIPS[slip]
    assert right in OWN
    if message is None:  # it has the limit of the check around it
        read(tmp_path, OWN.replace(right, wrong, 1))
        return
    with pytest.raises(InputError, match=f"(?s){message}") as caught:
        read(tmp_path, OWN.replace(right, wrong, 1))
    assert caught.value.line >= 1
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("checks: " + "[" * 20_000, "nested too deep"),
        (OWN + "      - any_of:\n" + "".join(
            f"{' ' * (10 + 4 * k)}- share: 50\n{' ' * (10 + 4 * k)}- any_of:\n" for k in range(8)
        ), "nested"),
        (OWN.replace("checks:", "checks:\n" + "  - {name: a}\n" * 200), "give 100 at most"),
        ("#" * 1_000_001, "larger than 1 MB"),
    ],
)  # fmt: skip
def test_rules_are_bounded(tmp_path, text, match):
    with pytest.raises(InputError, match=match):
        read(tmp_path, text)


def run(*words):
    made = run_umbra("rules", *words)
    return made.returncode, made.stdout, made.stderr


def test_the_command_lists_prints_and_refuses():
    status, out, _ = run()
    lines = out.splitlines()
    assert status == 0
    assert {line.split()[0] for line in lines} == NAMES
    assert len(lines) == len(NAMES)
    status, out, _ = run("bre-209-vsc")
    text = (Path(umbra.__file__).parent / "rules/bre-209-vsc.yaml").read_text()
    assert (status, out) == (0, text)
    found = json.loads(run("--json")[1])["rules"]
    assert {rule["name"] for rule in found} == NAMES
    assert "4m-4h" in next(rule for rule in found if rule["name"] == "japan-56-2")["variants"]
    status, _, err = run("bre-209-sky")
    assert status == 2
    assert err.count("\n") == 1
