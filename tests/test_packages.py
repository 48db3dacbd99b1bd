"""How a missing package is installed: a clone installs itself, else the index does."""

import pytest

from umbra import packages
from umbra.errors import find_similar


@pytest.fixture
def clone(tmp_path):
    folder = tmp_path / "my clone"
    (folder / "src" / "umbra").mkdir(parents=True)
    (folder / "pyproject.toml").write_text("[project]\n")
    return folder


class Installed:
    def __init__(self, url):
        self.url = url

    def read_text(self, name):
        assert name == "direct_url.json"
        return self.url and f'{{"url": "{self.url}", "dir_info": {{}}}}'


def test_a_clone_installs_itself_as_it_is_used(clone, monkeypatch, tmp_path):
    monkeypatch.setattr(packages, "__file__", str(clone / "src" / "umbra" / "packages.py"))
    monkeypatch.chdir(clone)
    assert packages.write_install("ifc") == "pip install -e '.[ifc]'"
    monkeypatch.chdir(tmp_path)
    assert packages.write_install("ifc") == f"pip install -e '{clone}[ifc]'"


def test_what_was_installed_from_a_clone_is_installed_from_there(clone, monkeypatch, tmp_path):
    monkeypatch.setattr(packages, "__file__", str(tmp_path / "site" / "umbra" / "packages.py"))
    monkeypatch.setattr("importlib.metadata.distribution", lambda _: Installed(clone.as_uri()))
    monkeypatch.chdir(clone)
    assert packages.write_install("ifc") == "pip install '.[ifc]'"


@pytest.mark.parametrize("url", ["file:///gone", "https://example.org/umbra.whl", None])
def test_what_an_index_installed_comes_from_there(monkeypatch, tmp_path, url):
    monkeypatch.setattr(packages, "__file__", str(tmp_path / "site" / "umbra" / "packages.py"))
    monkeypatch.setattr("importlib.metadata.distribution", lambda _: Installed(url))
    assert packages.write_install("ifc") == "pip install 'umbra-shadows[ifc]'"


@pytest.mark.parametrize(
    ("word", "known", "meant"),
    [
        ("--vsc", ["--device", "--masks", "--cast", "--every"], []),
        ("--shape", ["--sheet", "--show"], []),
        ("--recievers", ["--receivers", "--report"], ["--receivers"]),
        ("--longitude", ["--lat", "--lon"], ["--lon"]),
        ("latitude", ["min-altitude", "lat"], ["lat"]),
        ("--everyday", ["--every", "--every-days"], ["--every-days"]),
        ("Tower", ["Flower bed", "tower"], ["tower"]),
        ("by", ["by_day", "on"], []),
    ],
)
def test_words_are_similar_if_most_letters_are(word, known, meant):
    assert find_similar(word, known) == meant
