"""The public face: every name loads, is typed statically and is in the docs."""

import ast
import contextlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import umbra

FACE = Path(umbra.__file__)
API = Path(__file__).parents[2] / "docs" / "api.md"


def test_every_name_loads_and_says_what_it_is():
    for name in umbra.__all__:
        one = getattr(umbra, name)
        assert one.__name__ == name
        assert inspect.getdoc(one), name


def test_type_checkers_see_every_name():
    typed = {
        alias.name
        for node in ast.walk(ast.parse(FACE.read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("umbra.")
        for alias in node.names
    }
    assert set(umbra.__all__) <= typed
    assert (FACE.parent / "py.typed").exists()
    assert umbra.__all__ == sorted(umbra.__all__)


def test_the_docs_list_every_name():
    listed = re.search(r"autosummary::\n\n((?:   \w+\n)+)", API.read_text())[1].split()
    assert sorted(listed) == umbra.__all__
    for name in umbra.__all__:
        assert re.search(rf"auto\w+:: {name}$", API.read_text(), re.MULTILINE), name


def test_signatures_name_their_types_in_a_word():
    # What a notebook shows: `ArrayLike`, not the page of unions that it stands for.
    public = [getattr(umbra, name) for name in umbra.__all__]
    methods = [
        method
        for one in public
        if inspect.isclass(one)
        for name, method in inspect.getmembers(one, inspect.isroutine)
        if not name.startswith("_")
    ]
    own = [one for one in public + methods if getattr(one, "__module__", "").startswith("umbra")]
    assert len(own) > 60
    for one in own:
        with contextlib.suppress(ValueError):  # an exception has none
            assert "numpy." not in str(inspect.signature(one)), one


def test_umbra_alone_loads_next_to_nothing():
    text = "import sys, umbra; print([m for m in ('numpy', 'numba', 'xarray') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
