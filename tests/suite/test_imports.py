"""Every import of umbra's own names, those inside functions too, finds its module and its name."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"


def list_modules():
    for path in SOURCE.rglob("*.py"):
        name = ".".join(path.relative_to(SOURCE).with_suffix("").parts)
        yield name.removesuffix(".__init__"), path


def list_names(tree):
    """List the names that a module binds anywhere, and whether it makes others on demand."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names.update(alias.asname or alias.name for alias in node.names)
    return names


def test_every_import_finds_its_module_and_its_name():
    modules = {name: list_names(ast.parse(path.read_text())) for name, path in list_modules()}
    wrong = []
    for folder in ("src", "tests", "benchmarks", "examples"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Import):
                    asked = [(alias.name, None) for alias in node.names]
                elif isinstance(node, ast.ImportFrom) and not node.level:
                    asked = [(node.module, alias.name) for alias in node.names]
                else:
                    continue
                for module, name in asked:
                    if module.partition(".")[0] != "umbra":
                        continue
                    if module not in modules:
                        wrong.append(f"{path}:{node.lineno} {module}")
                    elif name and name not in modules[module] and f"{module}.{name}" not in modules:
                        wrong.append(f"{path}:{node.lineno} {module}: {name}")
    assert not wrong
