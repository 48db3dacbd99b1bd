"""What comments cite of the papers' errata stands in the documentation."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
CITED = re.compile(r"docs/papers\.md, ([A-Z]\d+)((?:,| and) [A-Z]\d+)*")


def test_every_finding_that_the_code_cites_is_written_down():
    page = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
    written = set(re.findall(r"^\(([A-Z]\d+)\)=$", page, re.MULTILINE))
    cited: dict[str, str] = {}
    for path in [*ROOT.glob("src/**/*.py"), *ROOT.glob("tests/**/*.py")]:
        for found in CITED.finditer(path.read_text(encoding="utf-8")):
            cited |= dict.fromkeys(re.findall(r"[A-Z]\d+", found[0].partition(",")[2]), path.name)
    assert set(cited) >= {"M1", "M3", "M6", "S1"}
    assert {name: cited[name] for name in set(cited) - written} == {}
