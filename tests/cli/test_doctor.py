"""``umbra doctor``: what runs here, and what to install."""

import importlib.util

import pytest

from umbra.packages import write_install

NEEDED = {"version", "vendor", "renderer", "is_software", "stencil_bits", "depth_bounds"}


def test_it_says_what_runs(umbra_here):
    report = umbra_here("doctor", "--json").json()
    assert report["cpu"]["runs"] is True
    assert report["cpu"]["cores"] >= 1
    assert report["packages"]["numpy"]
    for found in report["gl"]["backends"].values():
        assert set(found) == {"reason"} or set(found) == NEEDED | {"timer_queries"}
    if report["gl"]["runs"]:
        running = [f for f in report["gl"]["backends"].values() if "reason" not in f]
        assert all(found["stencil_bits"] == 8 for found in running)
        assert not report["advice"]


def test_a_person_reads_the_same(umbra_here):
    said = umbra_here("doctor")
    report = umbra_here("doctor", "--json").json()
    assert said.status == 0
    lines = said.out.splitlines()
    assert lines[0].startswith(f"umbra {report['umbra']}, Python")
    assert any(line.startswith("cpu  runs") for line in lines)
    assert any(
        line == ("gl   runs" if report["gl"]["runs"] else "gl   does not run") for line in lines
    )


def test_it_says_where_the_cache_is_and_how_large(umbra_here, tmp_path, monkeypatch):
    monkeypatch.setenv("UMBRA_CACHE", str(tmp_path))
    (tmp_path / "a.npz").write_bytes(bytes(1_500_000))
    cache = umbra_here("doctor", "--json").json()["cache"]
    assert cache == {
        "folder": str(tmp_path), "files": 1, "bytes": 1_500_000, "limit": 1_000_000_000,
    }  # fmt: skip
    said = umbra_here("doctor").out
    assert f"cache {tmp_path}, 1 file, 1.5 MB of at most 1000" in said


def test_without_any_driver_it_says_what_to_install(umbra_here, monkeypatch):
    pytest.importorskip("moderngl")

    reason = {"reason": "libEGL is not loaded"}
    monkeypatch.setattr("umbra.calls.doctor.probe", lambda _: reason)
    said = umbra_here("doctor", "--json").json()
    assert not said["gl"]["runs"]
    assert said["gl"]["backends"]["egl"] == {"reason": "libEGL is not loaded"}
    assert "libgl1-mesa-dri" in said["advice"][0]
    assert "To do: " in umbra_here("doctor").out


def test_without_the_extra_it_is_named(umbra_here, monkeypatch):
    from importlib import metadata  # noqa: PLC0415

    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("umbra.calls.doctor.version", missing)
    report = umbra_here("doctor", "--json").json()
    assert report["advice"] == [f"for the gl device: {write_install('gl')}"]
    assert importlib.util.find_spec("umbra.gl") is not None


def test_a_driver_that_crashes_is_survived(umbra_here, monkeypatch):
    pytest.importorskip("moderngl")
    monkeypatch.setattr("umbra.machine.sys.executable", "/bin/false")
    report = umbra_here("doctor", "--json").json()
    assert not report["gl"]["runs"]
    reasons = [found["reason"] for found in report["gl"]["backends"].values()]
    assert reasons == ["its driver ended the process: status 1"] * 3
