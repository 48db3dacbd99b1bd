"""What reaches a terminal: names in files, and files' names, command nothing there."""

import re
import sys
from pathlib import Path

import pytest
from support.model_files import save_obj
from support.shapes import box, moved

from umbra import cli
from umbra.cli.terminal import echo_path
from umbra.errors import LONGEST, InputError, UmbraError, make_printable, shorten, show_count

HOSTILE = "\x1b]0;owned\x07\x9b31m\u202egnp.exe\u2066\x7f\u2028"
COMMANDS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
BLOCK = {HOSTILE: box((0, 0, 0), (3, 3, 9)), "hut": moved(box((0, 0, 0), (2, 2, 2)), (5, 0, 0))}


def test_commands_are_written_out_and_words_stay():
    assert make_printable("a\x1b[2Jb\u202ec\x9bd") == r"a\x1b[2Jb\u202ec\x9bd"
    plain = "Straße 5, 東京\tعربي می\u200cخواهم\n½ m²"  # noqa: RUF001
    assert make_printable(plain) == plain
    assert make_printable("\udc9b") == r"\udc9b"


def test_one_is_no_plural():
    shown = [show_count(n, "part") for n in (0, 1, 2000)]
    assert shown == ["0 parts", "1 part", "2,000 parts"]
    assert show_count(1, "area lies", "areas lie") == "1 area lies"


def test_a_long_message_keeps_its_beginning_and_its_remedy():
    text = "part '" + "x" * 5000 + "' is empty; remove it"
    cut = shorten(text)
    assert len(cut) == LONGEST
    assert cut.startswith("part 'xxx")
    assert cut.endswith("xxx' is empty; remove it")
    assert "5,027 characters" in cut
    assert shorten("y" * LONGEST) == "y" * LONGEST


@pytest.mark.parametrize("kind", [UmbraError, InputError])
def test_errors_are_plain_in_python_too(kind):
    error = kind(f"'{HOSTILE}' " + "z" * 900, name=HOSTILE)
    assert not COMMANDS.search(str(error))
    assert len(str(error)) == LONGEST
    assert error.name == HOSTILE


@pytest.fixture
def hostile(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    # OBJ names end at a line's end; U+2028 is none there.
    return save_obj(folder / f"{HOSTILE[:9]}\u202e.obj", BLOCK)


def test_inspect_shows_names_without_commands(umbra_here, hostile):
    said = umbra_here("inspect", hostile)
    assert said.status == 0
    assert r"\x1b]0;owned\x07" in said.out
    assert not COMMANDS.search(said.out + said.err)
    told = umbra_here("inspect", hostile, "--json")
    assert not COMMANDS.search(told.out)
    # JSON gives them back as they are.
    assert any("\x1b]0;owned\x07\x9b31m\u202e" in part["name"] for part in told.json()["parts"])


def test_refusals_are_one_short_line_without_commands(umbra_here, tmp_path):
    said = umbra_here("inspect", str(tmp_path / (HOSTILE + "\n" + "x" * 900 + ".obj")))
    line = said.refusal()
    assert not COMMANDS.search(line)
    assert len(line) <= LONGEST + 1
    said = umbra_here("study", "--" + HOSTILE)
    assert not COMMANDS.search(said.refusal())


def test_a_script_gets_a_path_as_it_is_and_a_person_gets_it_written_out(capsys, monkeypatch):
    path = Path("out") / HOSTILE
    echo_path(path)
    assert capsys.readouterr().out == f"{path}\n"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    echo_path(path)
    assert not COMMANDS.search(capsys.readouterr().out)


def test_nothing_else_prints():
    folder = Path(cli.__file__).parent
    for path in folder.glob("*.py"):
        found = re.findall(r"click\.s?echo\(|\bprint\(|\.print_exc\(", path.read_text("utf-8"))
        assert path.name == "terminal.py" or not found, path.name
