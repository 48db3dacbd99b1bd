"""What umbra starts, opens and unpacks was decided for each module; docs/security.md tells true."""

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

from umbra.cli.options_file import _is_kept, _name_parameters
from umbra.cli.study import command

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src/umbra"
DOORS = {
    # Children of this run, which talk through pipes.
    "subprocess": {"calls.doctor", "readers.child", "tiles.workers", "writers.painter"},
    # To and from those children; to a cluster that the user trusts; chunks of one's own study.
    "pickle": {
        "study.chunked", "tiles.cluster", "tiles.workers", "writers.painter",
    },
    # The page's server; the machine's name in a lock file.
    "socket": {"web.server", "folders.unfinished_folder"},
    "http": {"web.server"},
    "webbrowser": {"web.server"},
    "distributed": {"tiles.cluster"},
    "yaml": {"rules.file", "rules.read"},
}  # fmt: skip
NEVER = {
    "asyncio", "code", "dill", "ftplib", "httpx", "joblib", "marshal", "multiprocessing",
    "requests", "runpy", "shelve", "smtplib", "socketserver", "urllib.request", "xmlrpc",
}  # fmt: skip
CALLS = {"eval", "exec", "__import__", "os.popen", "os.system"}


def parse_modules():
    for path in SOURCE.rglob("*.py"):
        yield ".".join(path.relative_to(SOURCE).with_suffix("").parts), ast.parse(path.read_text())


def list_imports(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module


def test_each_module_that_opens_a_door_was_decided():
    found = defaultdict(set)
    for module, tree in parse_modules():
        for name in list_imports(tree):
            assert not {name, name.partition(".")[0]} & NEVER, module
            if name.partition(".")[0] in DOORS:
                found[name.partition(".")[0]].add(module)
    assert found == DOORS


def test_nothing_is_evaluated_or_unpickled_from_a_file():
    names = set()
    for module, tree in parse_modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                assert ast.unparse(node.func) not in CALLS, module
                names |= {word.value.value for word in node.keywords
                          if word.arg == "allow_pickle"}  # fmt: skip
    assert names == {False}


SECURITY = (ROOT / "docs/security.md").read_text()


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(tests/[\w/]+\.py::\w+)`", SECURITY))))
def test_tests_that_hold_the_promises_exist(name):
    path, _, function = name.partition("::")
    assert re.search(rf"^def {function}\(", (ROOT / path).read_text(), re.MULTILINE)


def test_the_promises_name_tests():
    promises = re.findall(r"^### .*?(?=^##|\Z)", SECURITY, re.MULTILINE | re.DOTALL)
    assert len(promises) >= 6
    assert all("`tests/" in promise for promise in promises)


def test_security_lists_what_a_file_may_not_set():
    typed = {name for name, one in _name_parameters(command).items() if not _is_kept(one)}
    assert all(f"`{name}`" in SECURITY for name in typed)
