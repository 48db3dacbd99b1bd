"""What ``umbra study`` writes when it is asked for more than its three files."""

import pytest
from support.command import VIENNA

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
    assert text.count("data:image/png;base64,") == 3  # two sheets and the roofs
    assert "tower.obj" in text
    assert "--report" in text  # the command
    assert study(out="plain").status == 0
    assert not (tmp_path / "plain" / "report.html").exists()
