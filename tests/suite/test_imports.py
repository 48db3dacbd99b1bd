"""Every import of umbra's own names finds them and runs downward, in functions and in text, too."""

import ast
import inspect
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"
NAMED = re.compile(r"umbra(?:\.\w+)+(?::\w+)?")  # a module, or module:name
CODE = re.compile(r"\bfrom (umbra[\w.]*) import (\w+)")  # for a child process
NO_MODULES = {"umbra.commands", "umbra.reading"}  # a group of entry points, a key of click


def list_modules():
    for path in SOURCE.rglob("*.py"):
        name = ".".join(path.relative_to(SOURCE).with_suffix("").parts)
        yield name.removesuffix(".__init__"), path


def parse(path):
    return list(ast.walk(ast.parse(path.read_text())))


def list_names(nodes):
    """List the names that a module binds anywhere."""
    names = set()
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names.update(alias.asname or alias.name for alias in node.names)
    return names


def list_imports(nodes):
    """Yield (line, module, name or None) of every import of umbra's, also those in text."""
    prose = set()
    for node in nodes:
        if isinstance(node, ast.Expr):
            prose.add(id(node.value))
            continue
        if isinstance(node, ast.Import):
            asked = [(alias.name, None) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            asked = [(node.module, alias.name) for alias in node.names]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            asked = [] if id(node) in prose else list_text(node.value)
        else:
            continue
        for module, name in asked:
            if module.partition(".")[0] == "umbra":
                yield node.lineno, module, name


def list_text(text):
    """List the modules, and names in them, that a string names."""
    if NAMED.fullmatch(text.rstrip(".")) and text not in NO_MODULES:
        module, _, name = text.rstrip(".").partition(":")
        return [(module, name or None)]
    return CODE.findall(text)


@pytest.fixture(scope="module")
def sources():
    """The syntax nodes of each module of umbra's."""
    return {name: parse(path) for name, path in list_modules()}


@pytest.fixture(scope="module")
def modules(sources):
    return {name: list_names(nodes) for name, nodes in sources.items()}


def is_bound(modules, module, name):
    if module not in modules and name is None:  # a text may name an object by a dot
        module, _, name = module.rpartition(".")
    names = modules.get(module, ())
    return module in modules and (not name or name in names or f"{module}.{name}" in modules)


def test_every_import_finds_its_module_and_its_name(sources, modules):
    others = {
        str(path): [node for node in parse(path) if not isinstance(node, ast.Constant)]
        for folder in ("tests", "benchmarks", "examples")
        for path in (ROOT / folder).rglob("*.py")
    }  # whose text is not umbra's
    wrong = [
        f"{where}:{line} {module}: {name}"
        for where, nodes in (sources | others).items()
        for line, module, name in list_imports(nodes)
        if not is_bound(modules, module, name)
    ]
    assert not wrong


def test_modules_named_in_text_lie_below(sources):
    """As `import-linter` holds for imports, which are all that it sees."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    (contract,) = settings["contracts"]
    depth = {name: level for level, name in enumerate(contract["layers"])}

    def find_depth(module):
        return depth.get(".".join(module.split(".")[:2]))

    wrong = [
        f"{name}:{line} {module}"
        for name, nodes in sources.items()
        for line, module, _ in list_imports(nodes)
        if find_depth(name) is not None
        and find_depth(module) is not None
        and find_depth(module) < find_depth(name)
    ]
    assert not wrong
    assert not contract.get("ignore_imports")


def test_entry_points_find_their_objects():
    seen = 0
    ours = (ROOT, ROOT / "benchmarks", *(ROOT / "examples").rglob("*"))
    for settings in (path for folder in ours if (path := folder / "pyproject.toml").exists()):
        project = tomllib.loads(settings.read_text()).get("project", {})
        for points in (project.get("scripts", {}), *project.get("entry-points", {}).values()):
            for module, _, name in (point.partition(":") for point in points.values()):
                stem = module.replace(".", "/")
                (path,) = (
                    path
                    for folder in ("", "src")
                    for ending in (".py", "/__init__.py")
                    if (path := settings.parent / folder / f"{stem}{ending}").exists()
                )
                assert name in list_names(parse(path)), f"{settings}: {name}"
                seen += 1
    assert seen >= 7


def test_imports_in_text_are_seen():
    code = """
        def serve():
            "Named in prose: umbra.cli.main."
            import_module("umbra.cli.main"), run("import os; from umbra.web.page import pack")
            import_module(f"umbra.calls.{name}"), load_named("umbra.soft.weng:find"), {"umbra.gl"}
        """
    nodes = ast.walk(ast.parse(inspect.cleandoc(code)))
    found = [pair for _, *pair in list_imports(nodes)]
    assert sorted(found, key=str) == [
        ["umbra.calls", None],
        ["umbra.cli.main", None],
        ["umbra.gl", None],
        ["umbra.soft.weng", "find"],
        ["umbra.web.page", "pack"],
    ]
