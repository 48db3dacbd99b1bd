"""The version is one in all places, and each has a screen of what changed."""

import re
from pathlib import Path

import yaml

import umbra

ROOT = Path(__file__).parents[2]
SCREEN = 60  # lines
SECTIONS = re.split(r"(?m)^## ", (ROOT / "CHANGELOG.md").read_text())[1:]


def test_the_changelog_has_the_version_and_room_for_the_next():
    assert SECTIONS[0].startswith("Unreleased\n")
    versions = [section.split()[0] for section in SECTIONS[1:]]
    assert versions[0] == umbra.__version__
    assert versions == sorted(versions, key=lambda name: [*map(int, name.split("."))], reverse=True)


def test_each_version_takes_a_screen():
    lines = {section.split()[0]: len(section.splitlines()) for section in SECTIONS}
    assert max(lines.values()) <= SCREEN, lines


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == umbra.__version__
    (date,) = re.findall(rf"(?m)^{re.escape(umbra.__version__)} \((\S+)\)", "\n".join(SECTIONS))
    assert str(citation["date-released"]) == date
