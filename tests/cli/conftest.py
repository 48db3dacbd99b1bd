"""The command line in this process and in one of its own, and models to feed it."""

import re
from dataclasses import dataclass
from pathlib import Path

import orjson
import pytest
from support.command import VIENNA
from support.forks import run_umbra
from support.model_files import save_obj
from support.shapes import box

from umbra.cli import main
from umbra.machine import FIRST_RUN
from umbra.writers import painter

COMPILES = f"umbra: {FIRST_RUN}\n"
"""With an empty cache of kernels some test is the first to say it."""
ANSWERS = re.compile(
    r"^.*(?: sun reaches .* on average.*| takes? (?:no )?sun from .*)\n", re.MULTILINE
)
PICTURE = b"\x89PNG, a stand-in"


@dataclass(frozen=True)
class Said:
    """How a run ended and what it said, besides the answers of a study."""

    status: int
    out: str
    err: str
    answers: tuple[str, ...] = ()

    @classmethod
    def of(cls, status, out, err):
        err = err.replace(COMPILES, "")
        return cls(status, out, ANSWERS.sub("", err), tuple(ANSWERS.findall(err)))

    def json(self):
        return orjson.loads(self.out)

    def refusal(self):
        """Give the one line of a run that was refused."""
        assert self.status == 2, self
        assert not self.out, self
        assert self.err.count("\n") == 1, self
        assert self.err.startswith("umbra: "), self
        assert "Traceback" not in self.err
        return self.err


@pytest.fixture
def umbra_here(capsys):
    """Run the command line in this process."""

    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        said = capsys.readouterr()
        return Said.of(ended.value.code or 0, said.out, said.err)

    return run


@pytest.fixture
def umbra_alone():
    """Run the command in a process of its own."""

    def run(*arguments, **options):
        done = run_umbra(*arguments, **options)
        return Said.of(done.returncode, done.stdout, done.stderr)

    return run


class StandIn:
    """A painter that only leaves files: most tests are not about pictures."""

    def __init__(self, endings, advance=None):
        self.endings = endings

    def draw_hours(self, path, plan, days, *args, **options):
        assert all(day.hours.shape == plan.shape for day in days)
        self.leave(path)

    def draw_profile(self, path, plan, days, **options):
        assert all(len(day.shadows) == len(day.labels) for day in days)
        self.leave(path)

    def draw_points(self, path, plan, places, days, *args, **options):
        assert all(len(places) == len(day.hours) for day in days)
        assert plan.shape[0] > 1
        self.leave(path)

    def draw_elevations(self, path, arrangement, maps, max_hours, **options):
        assert [caption.split()[0] for caption, _, _ in maps] == [
            "Plan", "South", "East", "North", "West",
        ]  # fmt: skip
        assert all(day.hours.shape == plan.shape for _, plan, day in maps)
        assert arrangement.scale > 0
        self.leave(path)

    def draw_who(self, path, *args, **options):
        self.leave(path)

    def leave(self, path):
        for ending in self.endings:
            Path(path).with_suffix(f".{ending}").write_bytes(PICTURE)

    def wait(self):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


@pytest.fixture
def no_pictures(monkeypatch):
    monkeypatch.setattr(painter, "Painter", StandIn)


@pytest.fixture
def tower(tmp_path):
    """An OBJ of a tower of 4 x 4 x 12 m about the origin."""
    return save_obj(tmp_path / "tower.obj", {"tower": box((-2, -2, 0), (2, 2, 12))})


@pytest.fixture
def study(umbra_here, no_pictures, tower, tmp_path):
    """Run a small study of the tower, or of other files, with more options."""

    def run(*options, files=None, out=None, day="2026-09-18", site=VIENNA, cell="1"):
        date = ["--date", day] if day else []
        size = ["--cell", cell] if cell else []
        where = ["--out", out or tmp_path / "out"]
        return umbra_here("study", *(files or [tower]), *site, *date, *size, *where, *options)

    return run


@pytest.fixture
def keep(study, tmp_path):
    """Make a result, then give a function that tells whether it is still as it was."""
    folder = tmp_path / "out"
    assert study().status == 0
    (folder / "notes.txt").write_text("mine")

    def snapshot():
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    before = snapshot()
    assert set(before) == {"study.nc", "hours.png", "profile.png", "study.toml", "notes.txt"}
    return lambda: snapshot() == before
