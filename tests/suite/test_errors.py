"""Errors name options in the words of whoever made the call."""

import ast
import re
from pathlib import Path

import click
import pytest

import umbra
from umbra.cli.envelope import command as envelope
from umbra.cli.prove import command as prove
from umbra.cli.render import command as render
from umbra.cli.study import command as study
from umbra.cli.view import command as view
from umbra.errors import FLAGS, InputError, UmbraError, write_for_shell
from umbra.option_fields import Options, list_options

SOURCE = Path(umbra.__file__).parent
SHELL = re.compile(r"(?<!\w)--[a-z]")
FLAG = re.compile(r"--[a-z-]+(/--[a-z-]+)?")


@pytest.mark.parametrize(
    ("python", "shell"),
    [
        ("remove a no_cast= pattern", "remove a --no-cast pattern"),
        ("give latitude= and longitude= in degrees", "give --lat and --lon in degrees"),
        ("run it with receivers='top'", "run it with --receivers top"),
        ("the ground lies at z = 3 m (ground=)", "the ground lies at z = 3 m (--ground)"),
        ("keep the sums of the dates (by_day=False)", "keep the sums of the dates (--sum)"),
        ("receivers='ground' or 'top' show it", "--receivers ground or top show it"),
        ("a size=(512, 384) would fit", "a --size 512x384 would fit"),
        ("its middle: target=(1, 2.5, -3)", "its middle: --target 1,2.5,-3"),
        ("masks=True keeps them", "--masks keeps them"),
        ("give device='gl' and no soft=", "give --device gl and no --soft"),
    ],
)
def test_an_option_is_written_as_it_is_typed(python, shell):
    assert str(InputError(python)) == python
    assert InputError(python).for_shell() == write_for_shell(python) == shell


@pytest.mark.parametrize(
    "text",
    ["'ground=3' matches no part", "/data/on=3/up=1.obj: cut short", "e=mc2", "on == b"],
)
def test_names_of_files_and_parts_stay_as_they_are(text):
    assert write_for_shell(text) == text


def test_an_error_knows_the_option():
    assert InputError("leave device= out, or canopy=").option is None
    assert InputError("wrong", option="cell").option == "cell"
    assert UmbraError("nothing is wrong").option is None
    assert InputError("no part", pattern="x").pattern == "x"


def find_records(base):
    """List umbra's own records of options."""
    for record in base.__subclasses__():
        if record.__module__.startswith("umbra."):
            yield from (record, *find_records(record))


def test_each_option_that_messages_may_name_is_one_of_the_command_line():
    typed = {
        text
        for command in (envelope, prove, render, study, view)
        for parameter in command.params
        if isinstance(parameter, click.Option)
        for text in (*parameter.opts, *parameter.secondary_opts)
    }
    flags = {
        FLAGS[name]
        for record in find_records(Options)
        for name, said, _ in list_options(record)
        if said.flag is not None
    }
    assert len(flags) > 80
    assert flags <= typed
    assert write_for_shell("by_day=False") == "--sum"


def find_texts(path):
    """List messages in words of the shell; docstrings, flags and a command's remedies are none."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    docs = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    docs |= {id(n.value) for n in nodes if isinstance(n, ast.keyword) and n.arg == "remedy"}
    texts = [n for n in nodes if isinstance(n, ast.Constant) and isinstance(n.value, str)]
    return [
        (path.name, node.lineno)
        for node in texts
        if SHELL.search(node.value) and id(node) not in docs and not FLAG.fullmatch(node.value)
    ]


def test_no_message_of_the_library_speaks_the_shells_words():
    paths = [p for p in SOURCE.rglob("*.py") if "cli" not in p.parts and p.name != "errors.py"]
    assert [found for path in paths for found in find_texts(path)] == []


def read_template(node):
    """Return a message as it is written down, with NUL for what is filled in."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(read_template(one) or "\0" for one in node.values)
    return (
        read_template(node.left) + read_template(node.right) if isinstance(node, ast.BinOp) else ""
    )


def find_untold(path):
    """List the errors that name an option in their message, and not in their data."""
    found = []
    for function in ast.walk(ast.parse(path.read_text())):
        messages = {}
        nodes = ast.walk(function) if isinstance(function, ast.FunctionDef) else ()
        for node in sorted(
            (n for n in nodes if isinstance(n, (ast.Assign, ast.Call))),
            key=lambda n: (n.lineno, n.col_offset),
        ):
            if isinstance(node, ast.Assign):
                messages[ast.unparse(node.targets[0])] = read_template(node.value)
            elif ast.unparse(node.func) in {"InputError", "UmbraError"} and node.args:
                told = messages.get(ast.unparse(node.args[0]), "")
                is_named = write_for_shell(told) != told or "\0=" in told
                if is_named and not {"option", None} & {one.arg for one in node.keywords}:
                    found.append((path.name, node.lineno))
    return found


def test_an_error_about_an_option_carries_it():
    assert [found for path in SOURCE.rglob("*.py") for found in find_untold(path)] == []
