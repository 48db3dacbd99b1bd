"""The names in docs/contributing.md exist, and its table has every package."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs/contributing.md").read_text()
SOURCE = ROOT / "src/umbra"


def find_packages():
    return sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))


@pytest.mark.parametrize("name", find_packages())
def test_every_package_is_in_the_table(name):
    assert f"\n| `{name}/` |" in TEXT


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(umbra(?:\.\w+)+)", TEXT))))
def test_dotted_names_exist(name):
    head, _, last = name.rpartition(".")
    try:
        importlib.import_module(name)
    except ModuleNotFoundError:
        assert hasattr(importlib.import_module(head), last)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`([\w/]+/[a-z_]+\.py)`", TEXT))))
def test_modules_exist(name):
    assert any((place / name).exists() for place in (SOURCE, SOURCE.parent, ROOT))


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`([A-Z][a-z]+[A-Z]\w+)`", TEXT))))
def test_classes_exist(name):
    pattern = re.compile(rf"^(class {name}\b|{name}[:\s].*=)", re.MULTILINE)
    assert any(pattern.search(path.read_text()) for path in SOURCE.rglob("*.py"))
