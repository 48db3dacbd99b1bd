"""Options stand once: signatures, docstrings and the command's help follow from their records."""

from __future__ import annotations

import inspect
from dataclasses import MISSING

import click
import pytest

import umbra
from umbra.calls.camera_options import CameraOptions
from umbra.calls.city import RunOptions
from umbra.calls.massing_options import EnvelopeOptions, PartOptions
from umbra.calls.picture_options import DrawingOptions, RenderOptions, ViewOptions
from umbra.calls.prove_options import JudgedOptions
from umbra.cli.click_options import record_options
from umbra.errors import write_for_shell
from umbra.option_fields import Given, Options, list_options, needed, option, record
from umbra.signatures import takes
from umbra.study.options import StudyOptions
from umbra.writers.folder import Outputs


@record
class TeaOptions(Options):
    water: Given[float | str, float] = option(
        "length", "Height of the water; see leaves=.", more="In the pot.", default=0.1
    )
    leaves: str = needed("patterns", "What is in it.")
    lid: bool | None = option("flag", flag="--lid/--no-lid")
    guests: int = option("whole", "Only in Python.", default=2, flag=None)


@takes(TeaOptions, "a tea")
def brew(pot, cups=4, *, options):
    """
    Brew tea.

    Parameters
    ----------
    pot : str
    options : TeaOptions
        Each by its name.

    Returns
    -------
    tea : tuple
    """
    return pot, cups, options.water, options.leaves


def test_a_call_takes_each_option_by_its_name():
    assert brew("blue", leaves="assam") == ("blue", 4, 0.1, "assam")
    assert brew(pot="blue", leaves="mint", water=0.2, cups=1) == ("blue", 1, 0.2, "mint")
    with pytest.raises(umbra.InputError, match="a tea has no option 'leafs'; did you mean"):
        brew("blue", leafs="mint")
    with pytest.raises(TypeError, match=r"brew\(\) needs leaves="):
        brew("blue")
    with pytest.raises(TypeError, match="positional"):
        brew("blue", 3, 0.2, leaves="mint")


def test_a_signature_shows_the_options_as_they_are_given():
    shown = inspect.signature(brew).parameters
    assert list(shown) == ["pot", "cups", "water", "leaves", "lid", "guests"]
    assert shown["water"].annotation == "float | str"
    assert (shown["water"].default, shown["leaves"].default) == (0.1, inspect.Parameter.empty)
    assert shown["lid"].kind is inspect.Parameter.KEYWORD_ONLY


def test_a_docstring_has_an_entry_for_each_option():
    lines = brew.__doc__.splitlines()
    start = lines.index("water : float or str, default 0.1")
    assert lines[start + 1] == "    Height of the water; see ``leaves``. In the pot."
    assert "leaves : str or sequence of str" in lines
    assert "options : TeaOptions" not in lines
    assert lines[lines.index("Returns") - 1] == ""


def test_a_command_has_the_options_that_can_be_typed():
    command = record_options(TeaOptions)(click.command("brew")(lambda **_: None))
    texts = {one.name: one.help for one in command.params}
    assert texts["water"] == "Height of the water; see --leaves."
    assert texts["leaves"] == "What is in it; repeatable."
    assert {one.name: one.required for one in command.params} == {
        "water": False, "leaves": True, "lid": False,
    }  # fmt: skip
    assert write_for_shell("lid=False") == "--no-lid"


@pytest.mark.parametrize(
    ("call", "record"),
    [
        (umbra.shadow_study, StudyOptions),
        (umbra.render, RenderOptions),
        (umbra.make_camera, CameraOptions),
        (umbra.show, ViewOptions),
        (umbra.envelope, EnvelopeOptions),
        (umbra.part_height, PartOptions),
        (umbra.prove, JudgedOptions),
        (umbra.city_study, RunOptions),
        (umbra.draw_vectors, DrawingOptions),
    ],
)
def test_public_calls_show_their_records(call, record):
    shown = {name: one.default for name, one in inspect.signature(call).parameters.items()}
    told = call.__doc__.split("Returns")[0]
    for name, said, default in list_options(record):
        assert shown[name] == (inspect.Parameter.empty if default is MISSING else default)
        assert f"{name} : " in told
        assert said.help, name


def test_a_study_writes_what_the_command_writes():
    shown = inspect.signature(umbra.ShadowStudy.write).parameters
    assert {name: one.default for name, one in shown.items() if one.kind is one.KEYWORD_ONLY} == {
        name: default for name, _, default in list_options(Outputs) if name != "formats"
    }
