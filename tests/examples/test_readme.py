"""The README's commands print what it shows, and its Python runs."""

import re
import shlex
from pathlib import Path

import pytest
from support.bench import borrow
from support.forks import run_python

from umbra.cli.main import COMMANDS, main, umbra

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "docs/getting_started.md"]


def find_blocks(page, *languages):
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [block for language, block in blocks if language in languages]


def find_commands(block):
    """Give (arguments, shown output) of each command of a block, with or without a prompt."""
    block = block.replace("\\\n", " ")
    lines = block.splitlines()
    starts = [n for n, line in enumerate(lines) if re.match(r"(\$ )?umbra ", line)]
    for start, end in zip(starts, [*starts[1:], len(lines)]):
        yield shlex.split(lines[start].removeprefix("$ "))[1:], lines[start + 1 : end]


def run(folder, *arguments):
    done = run_python(*arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.fixture
def run_here(capsys, monkeypatch):
    """
    Run a command in this process: one of its own takes a second or two to start.

    Returns what it prints: results, and its answers after them.
    """

    def run(folder, arguments):
        monkeypatch.chdir(folder)
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        said = capsys.readouterr()
        assert not ended.value.code, said.err
        answers = (line for line in said.err.splitlines() if not re.match("(note|umbra): ", line))
        return [*said.out.splitlines(), *answers]

    return run


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_is_shown_is_what_happens(page, tmp_path, run_here):
    run(ROOT, "examples/city_block.py", str(tmp_path / "out/city_block.city.json"))
    commands = [c for block in find_blocks(page, "", "sh") for c in find_commands(block)]
    assert len(commands) >= 3
    for arguments, shown in commands:
        said = run_here(tmp_path, arguments)
        if not shown:
            continue
        if shown[-1] == "...":
            shown.pop()
            del said[len(shown) :]
        assert [line.rstrip() for line in said] == [line.rstrip() for line in shown]
    for block in find_blocks(page, "python"):
        said = run(tmp_path, "-c", block)
        promised = re.findall(r"print\(.*\)  # (.*)", block)
        for value in promised:
            assert any(line.startswith(value) for line in said)


def find_options(text):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text))


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_is_documented(name):
    text = (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    for_all, *sections = text.split("\n## umbra ")
    section = next(section for section in sections if section.startswith(f"{name}\n"))
    said = find_options(section)
    command = borrow("command").command if name == "bench" else umbra.get_command(None, name)
    params = command.params
    options = {o for p in params for o in (*p.opts, *p.secondary_opts) if o.startswith("--")}
    assert options - find_options(for_all) <= said
    # And nothing that is not there.
    assert said <= options | {"--json"}
