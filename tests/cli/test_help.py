"""What a newcomer types first."""

import inspect
import re

import click
import pytest

import umbra
from umbra.calls.reading_options import CanopyOptions, ReadingOptions, SiteOptions
from umbra.cli import main, render, study, view
from umbra.option_fields import list_options


@pytest.mark.parametrize("arguments", [["--help"], ["study", "--help"], ["render", "-h"]])
def test_help_goes_to_the_output(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    said = capsys.readouterr()
    assert said.out.startswith("Usage: umbra")
    assert not said.err


@pytest.mark.parametrize("which", [study, render, view], ids=["study", "render", "view"])
def test_long_helps_have_every_option_once_under_a_heading(capsys, which):
    with pytest.raises(SystemExit):
        main([str(which.command.name), "--help"])
    lines = capsys.readouterr().out.splitlines()
    lines = lines[lines.index(f"{which.HEADINGS[0]}:") :]
    headings = [line[:-1] for line in lines if line.endswith(":") and not line.startswith(" ")]
    assert headings == [*which.HEADINGS]
    listed = [line.split()[0].rstrip(",") for line in lines if re.match(r"  -\S", line)]
    options = [p for p in which.command.params if isinstance(p, click.Option)]
    assert len([line for line in lines if line.startswith("  FILE")]) == 1  # with its formats
    assert sorted(listed) == sorted(["-h", *(option.opts[0] for option in options)])


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


def test_reading_options_are_those_of_umbra_read():
    shown = set(inspect.signature(umbra.read).parameters) - {"paths", "canopy"}
    typed = {name for name, _, _ in list_options(ReadingOptions)} - {"time", "animation"}
    typed |= {name for name, _, _ in list_options(CanopyOptions)}
    assert typed - {"up_axis", "no_cache"} == shown - {"up", "cache"}
    placed = set(inspect.signature(umbra.find_site).parameters) - {"scene", "tell"}
    assert {name for name, _, _ in list_options(SiteOptions)} == placed
