"""The JavaScript's types, which are stated in comments, are checked by TypeScript."""

import shutil
import subprocess
from pathlib import Path

import pytest

import umbra.web

FOLDER = Path(umbra.web.__file__).parent
OPTIONS = (
    "--noEmit", "--allowJs", "--checkJs", "--strict", "--target", "es2022",
    "--lib", "es2022,dom,dom.iterable", "--moduleResolution", "node",
)  # fmt: skip


def check(files):
    if shutil.which("tsc") is None:
        pytest.skip("there is no TypeScript on this machine")
    done = subprocess.run(
        ["tsc", *OPTIONS, *map(str, files)], capture_output=True, text=True, check=False
    )
    return done.stdout


def test_types_are_right_and_a_wrong_one_is_found(tmp_path):
    wrong = tmp_path / "wrong.js"
    wrong.write_text("/** @param {number} a */\nexport const f = (a) => a.length;\n")
    (found,) = check([*FOLDER.glob("*.js"), *FOLDER.glob("*.d.ts"), wrong]).splitlines()
    assert "wrong.js(2,27): error TS2339" in found
    assert "Property 'length' does not exist on type 'number'" in found
