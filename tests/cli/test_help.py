"""What a newcomer types first."""

import pytest

from umbra.cli import main


@pytest.mark.parametrize("arguments", [["--help"], ["study", "--help"], ["render", "-h"]])
def test_help_goes_to_the_output(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    said = capsys.readouterr()
    assert said.out.startswith("Usage: umbra")
    assert not said.err


def test_umbra_alone_shows_its_help_in_lines(capsys):
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2
    said = capsys.readouterr()
    assert not said.out
    assert {"Commands:", "Options:"} <= {line.strip() for line in said.err.splitlines()}


def test_an_unknown_command_is_one_line(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["stduy"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1
