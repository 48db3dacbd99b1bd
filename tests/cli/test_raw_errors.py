"""What used to end in a raw error, or without a word, is one line that says what to do."""

import os
import subprocess
import sys
import textwrap

import numpy as np
import pyogrio
import pytest
import shapely
from support.command import SCRIPT, VIENNA
from support.forks import run_umbra
from support.model_files import save_obj
from support.shapes import box

import umbra
from umbra import machine as kernel_cache
from umbra.folders.atomic import replace_file
from umbra.lights import make_period
from umbra.sun.clock import check_steps, make_steps

VIENNESE = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")


@pytest.fixture
def model(tmp_path):
    return save_obj(tmp_path / "box.obj", {"box": box((0, 0, 0), (4, 4, 9))})


def run(*command, **options):
    return subprocess.run([SCRIPT, *command], check=False, text=True, **options)


@pytest.mark.parametrize(
    "command",
    [["study", *VIENNA, "--date", "2026-03-21", "--out"], ["render", "--out"],
     ["render", "--arrays"]],
)  # fmt: skip
def test_an_empty_name_is_no_place_to_write(model, tmp_path, command):
    done = run_umbra(command[0], model, *command[1:], "", cwd=tmp_path)
    assert done.returncode == 2
    assert f"'{command[-1]}': the name is empty" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["box.obj"]


@pytest.mark.parametrize(
    "line", ['out = "a\\u0000b"', 'files = ["a\\u0000b.obj"]', 'rules = "a\\u0000b.yaml"']
)
def test_a_null_character_in_a_name_is_told(tmp_path, line):
    (tmp_path / "study.toml").write_text(f"date = '2026-03-21'\n{line}\n")
    options = tmp_path / "study.toml"
    done = run_umbra("study", "box.obj", "--options", options, "--out", tmp_path / "o")
    assert done.returncode == 2
    assert f"'{line.split()[0]}' holds a null character" in done.stderr
    with (
        pytest.raises(umbra.InputError, match=r"cannot write .*null byte.*choose another"),
        replace_file(tmp_path / "nul\0l.png"),
    ):
        pytest.fail("the work began")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")  # noqa: PTH110
def test_streams_that_are_full_or_closed(model):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = run("inspect", model, stdout=full, stderr=subprocess.PIPE)
        said = done.stderr.replace(f"umbra: {kernel_cache.FIRST_RUN}\n", "")
        assert (done.returncode, said.count("\n")) == (1, 1)
        assert "the output stream takes no more" in done.stderr
        done = run("inspect", "none.obj", stdout=-1, stderr=full)
        assert (done.returncode, done.stdout) == (2, "")
    done = subprocess.run(f"'{SCRIPT}' inspect none.obj 2>&-", shell=True, check=False)
    assert done.returncode == 2


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"cell": 1e-320}, "a cell must be larger than 0 m, 1e-09 at least"),
        ({"size": (2.5, 2)}, r"size has 2 whole numbers; got \(2.5, 2\)"),
        ({"size": (True, 2)}, "size has 2 whole numbers"),
        ({"receivers": "north", "size": (2.5, 2)}, "size has 2 whole numbers"),
        ({"receivers": "north", "cell": 1e-320}, "a cell must be larger than 0 m"),
    ],
)
def test_a_raster_of_no_size(model, option, words):
    with pytest.raises(umbra.InputError, match=words):
        umbra.shadow_study(umbra.read(model), VIENNESE, date="2026-03-21", **option)


def test_a_picture_of_half_a_pixel():
    with pytest.raises(umbra.InputError, match="two whole numbers of pixels"):
        umbra.Camera((0, 0, 9), (1, 1, 0), size=(2.5, 2))


def test_a_year_of_seconds_is_refused_before_any_work(model, tmp_path):
    with pytest.raises(
        umbra.InputError, match=r"365 dates in steps of 1s make 10,512,000 suns.*6s"
    ):
        make_period("2026", "09:00", "17:00", "1s", VIENNESE)
    words = "--date", "2026", "--every", "1s"
    done = run_umbra("study", "none.obj", *VIENNA, *words, "--out", tmp_path)
    assert done.returncode == 2
    assert "10,512,000 suns" in done.stderr
    check_steps(make_steps("2026-01-01", "00:00", "24:00", "16s", "UTC"), 365, "16s")


def test_a_projection_of_an_unknown_name_is_a_note(tmp_path):
    pyogrio.raw.write(
        tmp_path / "lot.shp", geometry=shapely.to_wkb([shapely.box(0, 0, 9, 9)]),
        fields=["height"], field_data=[np.array([5.0])], geometry_type="Polygon", crs="EPSG:31256",
    )  # fmt: skip
    prj = tmp_path / "lot.prj"
    prj.write_text(prj.read_text().replace("Transverse_Mercator", "Nonsense"))
    done = run_umbra("inspect", tmp_path / "lot.shp", "--json")
    assert done.returncode == 0, done.stderr
    assert "is not known, so coordinates are taken as metres" in done.stdout


def find_cache(monkeypatch, tmp_path):
    """As where neither umbra's folder nor a home can be written to."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(kernel_cache, "_is_writable", lambda _: False)
    monkeypatch.setattr(kernel_cache, "_has_user_folder", lambda: False)
    monkeypatch.setattr(kernel_cache.tempfile, "tempdir", str(tmp_path))
    kernel_cache.find_kernel_cache.cache_clear()
    note = kernel_cache.find_kernel_cache()
    kernel_cache.find_kernel_cache.cache_clear()
    return note


def test_kernels_are_kept_for_a_run_where_they_cannot_stay(monkeypatch, tmp_path):
    assert kernel_cache.find_kernel_cache() is None  # here they can
    assert "set NUMBA_CACHE_DIR" in find_cache(monkeypatch, tmp_path)
    (folder,) = tmp_path.iterdir()
    assert os.environ.pop("NUMBA_CACHE_DIR") == str(folder)
    kernel_cache._remove(str(folder), os.getpid())
    assert not folder.exists()


def test_kernels_compile_where_nothing_can_be_written():
    code = """
    from umbra import machine as kernel_cache
    def refuse(**_):
        raise FileNotFoundError
    kernel_cache._is_writable = lambda _: False
    kernel_cache._has_user_folder = lambda: False
    kernel_cache.tempfile.mkdtemp = refuse
    assert kernel_cache.find_kernel_cache()
    from numba.core import caching
    caching.CacheImpl._locator_classes = []
    from numba import njit
    @njit(cache=True)
    def add(a):
        return a + 1
    assert add(1) == 2
    """
    env = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=True, env=env)
