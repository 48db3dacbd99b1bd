"""What is written as NetCDF is read back by both engines, in a fresh process."""

import json
import os
import subprocess
import sys

import h5py
import numpy as np
import pytest
import xarray as xr
from support.shapes import city

import umbra
from umbra.errors import UmbraError
from umbra.scene import make_scene
from umbra.study import run_study
from umbra.study.accumulators.step_masks import Masks
from umbra.study.result import SunHours
from umbra.sun import Site
from umbra.writers import netcdf
from umbra.writers.netcdf import write_netcdf

VIENNA = Site(48.2, 16.37, "Europe/Vienna")
ROWS, COLS, STEPS = 40, 50, 3


HOURS = np.linspace(0, 8, ROWS * COLS, dtype=np.float32).reshape(ROWS, COLS)
HOURS[0, 0] = np.nan
TIME = np.datetime64("2026-09-18T07:07:30.500", "ns") + np.arange(STEPS) * np.timedelta64(900, "s")
PLAN = ("y", "x")
VARIABLES = {
    "shadow_hours": (PLAN, HOURS),
    "receiver_z": (PLAN, np.full((ROWS, COLS), 1 / 3)),
    "in_shadow": (("time", *PLAN), np.repeat((HOURS > 4)[None], STEPS, 0).astype(np.uint8)),
    "sun_altitude": (("time",), np.array([10.0, 20.0, 30.0])),
    "x": (("x",), 2_683_000.25 + 0.5 * np.arange(COLS)),
    "y": (("y",), 1_247_000.25 + 0.5 * np.arange(ROWS)),
    "time": (("time",), TIME),
}
FACTS = {"umbra_version": "0.1.0", "threads": 2, "count_seconds": 0.25, "command": None}


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_a_fresh_process_reads_the_same(tmp_path, engine):
    if engine == "netcdf4":
        pytest.importorskip("netCDF4")
    write_netcdf(tmp_path / "study.nc", VARIABLES, FACTS)
    script = f"""
import json, xarray
d = xarray.open_dataset({str(tmp_path / "study.nc")!r}, engine={engine!r})
print(json.dumps({{
    "dtypes": {{n: str(v.dtype) for n, v in d.variables.items()}},
    "hours": d.shadow_hours.values.ravel()[[1, 7, -1]].tolist(),
    "missing": int(d.shadow_hours.isnull().sum()),
    "masks": d.in_shadow.sum(("y", "x")).values.tolist(),
    "time": [str(t) for t in d.time.values],
    "x": d.x.values[[0, -1]].tolist(),
    "z": float(d.receiver_z[3, 4]),
    "attrs": {{k: str(v) for k, v in d.attrs.items()}},
    "units": {{n: v.attrs.get("units") for n, v in d.variables.items()}},
    "names": [d.shadow_hours.long_name, d.sun_altitude.standard_name, d.time.standard_name],
}}))"""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=True
    )
    read = json.loads(done.stdout)
    assert read["dtypes"]["shadow_hours"] == "float32"
    assert read["dtypes"]["receiver_z"] == "float64"
    assert read["dtypes"]["in_shadow"] == "uint8"
    assert read["hours"] == HOURS.ravel()[[1, 7, -1]].tolist()
    assert read["missing"] == 1
    assert read["masks"] == [int((HOURS > 4).sum())] * STEPS
    assert read["time"] == [str(t) for t in TIME]  # to the half second
    assert read["x"] == [2_683_000.25, 2_683_024.75]
    assert read["z"] == 1 / 3
    assert read["attrs"]["threads"] == "2"
    assert read["attrs"]["Conventions"].startswith("CF-")
    assert "command" not in read["attrs"]  # a fact that is not known
    assert read["units"]["shadow_hours"] == "h"
    assert read["units"]["x"] == "m"
    assert read["names"] == ["hours in shadow", "solar_elevation_angle", "time"]


@pytest.mark.parametrize("every", ["15m", "1s", "1500ms", "125us"])
def test_instants_come_back_exactly(tmp_path, every):
    step = np.timedelta64(int(every.rstrip("msu")), every.lstrip("0123456789"))
    time = np.datetime64("2026-03-29T00:59:59", "ns") + np.arange(5) * step
    write_netcdf(tmp_path / "study.nc", {"time": (("time",), time)}, {})
    with xr.open_dataset(tmp_path / "study.nc") as read:
        np.testing.assert_array_equal(read.time.values, time)


def test_the_file_is_what_the_dataset_says(tmp_path):
    study = run_study(
        make_scene(*city(2)), umbra.Site(48.2, 16.37, "Europe/Vienna"),
        date="2026-09-18", every="1h", size=(40, 30), masks=True,
    )  # fmt: skip
    write_netcdf(tmp_path / "study.nc", study.variables(), study.facts)
    with xr.open_dataset(tmp_path / "study.nc") as read:
        xr.testing.assert_equal(read, study.to_dataset())


def test_rasters_are_compressed_and_coordinates_have_no_fill(tmp_path):
    h5py = pytest.importorskip("h5py")
    write_netcdf(tmp_path / "study.nc", VARIABLES, FACTS)
    with h5py.File(tmp_path / "study.nc") as file:
        for name in ("shadow_hours", "receiver_z", "in_shadow"):
            assert file[name].compression == "gzip"
        assert file["in_shadow"].chunks == (1, ROWS, COLS)
        assert "_FillValue" in file["shadow_hours"].attrs
        for name in ("x", "y", "time"):
            assert "_FillValue" not in file[name].attrs


@pytest.mark.parametrize("crs", ["EPSG:2056", "EPSG:7415", "EPSG:31256"])
def test_a_known_crs_becomes_a_grid_mapping(tmp_path, crs):
    pyproj = pytest.importorskip("pyproj")
    write_netcdf(tmp_path / "study.nc", VARIABLES, FACTS | {"crs": crs})
    with xr.open_dataset(tmp_path / "study.nc") as read:
        assert read.attrs["crs"] == crs
        assert read.shadow_hours.attrs["grid_mapping"] == "spatial_ref"
        assert read.x.attrs["standard_name"] == "projection_x_coordinate"
        mapping = read["spatial_ref"].attrs
    assert pyproj.CRS.from_cf(mapping) == pyproj.CRS(crs)


def test_a_crs_that_pyproj_does_not_know_is_kept_as_text(tmp_path):
    write_netcdf(tmp_path / "study.nc", VARIABLES, FACTS | {"crs": "the site's own grid"})
    with xr.open_dataset(tmp_path / "study.nc") as read:
        assert read.attrs["crs"] == "the site's own grid"
        assert "spatial_ref" not in read.variables


def test_a_file_that_cannot_be_written_is_an_error_of_one_line(tmp_path):
    with pytest.raises(UmbraError, match="could not write") as caught:
        write_netcdf(tmp_path / "none" / "study.nc", VARIABLES, FACTS)
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(os.name != "posix", reason="needs a limit on the size of files")
@pytest.mark.parametrize("limit", [0, 3000, 20_000, 200_000])
def test_a_disk_that_fills_is_told_in_a_line(tmp_path, limit):
    """In a process of its own: HDF5 could end it, when it ends at the latest."""
    code = f"""
import resource, signal
import numpy as np
from umbra.errors import UmbraError
from umbra.writers.netcdf import write_netcdf
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
noise = np.random.default_rng(1).random((20, 90, 90))
names = [f"v{{n}}" for n in range(5)]
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, resource.RLIM_INFINITY))
try:
    write_netcdf("{tmp_path}/a.nc", {{name: (("t", "y", "x"), noise) for name in names}}, {{}})
except UmbraError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("could not write 'a.nc' (file too large); free some space")
    assert not done.stderr


def test_large_rasters_are_packed_in_bounded_chunks_and_read_back_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(netcdf, "_CHUNK", 16)
    monkeypatch.setattr(netcdf, "_AT_ONCE", 256)
    masks = Masks(np.array([True, False, True]), (ROWS, COLS))
    masks.keep(np.array([0, 2]), np.stack([HOURS > 2, HOURS > 6]).astype(np.uint8))
    position = np.arange(ROWS * COLS * 3, dtype=np.float64).reshape(ROWS, COLS, 3)
    large = {
        "shadow_hours": (PLAN, HOURS),
        "sun_hours": (PLAN, SunHours(8.0, HOURS)),
        "receiver_z": (PLAN, np.broadcast_to(1 / 3, (ROWS, COLS))),
        "in_shadow": (("time", *PLAN), masks),
        "position": ((*PLAN, "xyz"), position),
    }
    write_netcdf(tmp_path / "study.nc", large, FACTS)
    with h5py.File(tmp_path / "study.nc") as file:
        for name, (_, array) in large.items():
            np.testing.assert_array_equal(file[name][...], np.asarray(array), err_msg=name)
        chunks = [file[name].chunks for name in large]
    assert chunks == [(16, 16)] * 3 + [(1, 16, 16), (1, 16, 3)]


def test_a_dataset_may_be_changed_in_place():
    study = run_study(
        make_scene(*city()), VIENNA, date="2026-09-18", every="4h", receivers="ground"
    )
    dataset = study.to_dataset()
    dataset.receiver_z[0, 0] = 7.0
    dataset.sun_hours[0, 0] = -1.0
    assert float(dataset.receiver_z[0, 1]) == study.ground
    assert study.variables()["sun_hours"][1][0, 0] >= 0
