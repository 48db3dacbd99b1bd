"""Studies in chunks: Dask arrays with the bytes of a study in one piece."""

import sys

import numpy as np
import pytest
from support.shapes import box, merge, sheet, turned

import umbra
from umbra.study import chunked

dask = pytest.importorskip("dask")
SITE = umbra.Site(latitude=48.2, longitude=16.37, zone="Europe/Vienna")
PLAN = {"extent": (-31.0, -40.0, 71.0, 60.0), "cell": 0.7, "ground": 0.0}
DAY = {"date": "2026-01-15", "every": "1h"}
TIMES = {"prepare_seconds", "count_seconds", "threads"}


def make_town():
    houses = [
        turned(box((9 * i, 7 * j, -1), (9 * i + 5, 7 * j + 3, 3 + (5 * i + 3 * j) % 11)), 7 * i + j)
        for i in range(5) for j in range(5)
    ]  # fmt: skip
    vertices, faces = merge(*houses)
    parts = np.array([f"house {n}" for n in range(25)])[np.arange(len(faces)) // 12]
    roof = sheet([(50, 0, 3), (60, 1, 5.5), (59, 9, 9.7), (49, 8, 7.2)])  # slopes to both sides
    vertices, faces = merge((vertices, faces), roof)
    return umbra.Scene.from_arrays(vertices, faces, [*parts, "roof", "roof"])


@pytest.fixture(scope="module")
def town():
    return make_town()


def compare(whole, lazy):
    """Compare every byte of two datasets, and their attributes but the times that they took."""
    lazy = lazy.compute()
    assert set(whole.variables) == set(lazy.variables)
    for name in whole.variables:
        one, two = whole[name], lazy[name]
        assert (one.dims, one.dtype, one.attrs) == (two.dims, two.dtype, two.attrs), name
        assert one.values.tobytes() == two.values.tobytes(), name
    facts = [{k: v for k, v in d.attrs.items() if k not in TIMES} for d in (whole, lazy)]
    assert facts[0] == facts[1]


@pytest.mark.parametrize(
    "options",
    [
        {"receivers": "ground"},
        {"receivers": "top", "masks": True, "spells": True},
        {
            "receivers": "ground",
            "date": "2026-01-15,2026-03-20",
            "who": ["house 1*"],
            "masks": True,
        },
        {"receivers": "top", "canopy": ["house 2*"], "transmissivity": 0.4},
    ],
)
@pytest.mark.parametrize("chunks", [64, (37, 143), {"x": 50}])
def test_any_chunks_give_the_bytes_of_the_whole(town, options, chunks):
    given = DAY | PLAN | options
    whole = umbra.shadow_study(town, SITE, **given)
    study = umbra.shadow_study(town, SITE, **given, chunks=chunks)
    assert study.shadow_hours.chunks is not None
    assert len(study.shadow_hours.data.dask) > 1
    compare(whole.dataset, study.dataset)


def test_chunks_across_the_tiles_of_the_whole_have_its_bytes(town, monkeypatch):
    for name in ("TILE", "STREAMED_TILE"):
        monkeypatch.setattr(f"umbra.receivers.plan.{name}", 61)
    given = DAY | PLAN | {"receivers": "top", "spells": True, "threads": 1}
    whole = umbra.shadow_study(town, SITE, **given)
    study = umbra.shadow_study(town, SITE, **given, chunks=50)
    compare(whole.dataset, study.dataset)


def test_only_what_is_asked_for_is_counted(town, monkeypatch):
    counted = []
    count = chunked.ChunkJob.count

    def note(job, rows, cols):
        counted.append((rows.start, cols.start))
        return count(job, rows, cols)

    monkeypatch.setattr(chunked.ChunkJob, "count", note)
    study = umbra.shadow_study(town, SITE, **DAY, **PLAN, receivers="ground", chunks=50)
    assert counted == []
    part = study.sun_hours[60:70, 10:140].compute()
    assert sorted(counted) == [(50, 0), (50, 50), (50, 100)]
    assert part.shape == (10, 130)
    # All variables of a chunk come from one count.
    counted.clear()
    study.dataset.isel(x=slice(0, 9), y=slice(0, 9)).compute()
    assert counted == [(0, 0)]


def test_pictures_and_files_are_of_the_whole(town, tmp_path):
    given = DAY | PLAN | {"receivers": "ground"}
    study = umbra.shadow_study(town, SITE, **given, chunks=64)
    assert "not counted yet" in repr(study)
    assert "shadow_hours" in dir(study)
    assert len(study.plot()._repr_png_()) > 5000
    whole = umbra.shadow_study(town, SITE, **given)
    assert np.array_equal(study.result.shadow_hours, whole.result.shadow_hours)


def test_a_plan_larger_than_memory_is_laid_out(town):
    given = DAY | {"receivers": "top", "extent": (-20, -20, 60, 60), "cell": 1e-4, "ground": 0.0}
    with pytest.raises(umbra.InputError, match="GB"):
        umbra.shadow_study(town, SITE, **given)
    study = umbra.shadow_study(town, SITE, **given, chunks="auto")
    assert study.shadow_hours.shape == (800_000, 800_000)
    assert study.shadow_hours[399_990:400_000, :8].compute().shape == (10, 8)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"chunks": 0}, "one cell at least"),
        ({"chunks": "many"}, "'auto'"),
        ({"chunks": {"z": 5}}, "axis 'z'"),
        ({"chunks": 64, "receivers": "surfaces"}, "counted whole; leave chunks= out"),
        ({"chunks": 64, "proposed": ["house 1"]}, "leave chunks= out"),
    ],
)
def test_chunks_that_cannot_be_are_refused(town, options, told):
    plan = PLAN if "receivers" not in options else {"ground": 0.0}
    with pytest.raises(umbra.InputError, match=told) as caught:
        umbra.shadow_study(town, SITE, **{**DAY, **plan, "receivers": "ground", **options})
    assert caught.value.option == "chunks"


def test_without_dask_an_error_names_the_extra(town, monkeypatch):
    monkeypatch.setitem(sys.modules, "dask.array", None)
    with pytest.raises(umbra.InputError, match=r"pip install .*\[city\]"):
        umbra.shadow_study(town, SITE, **DAY, **PLAN, chunks=64)


def test_a_cluster_gets_the_scene_once_and_gives_the_same_bytes(town):
    distributed = pytest.importorskip("distributed")
    given = DAY | PLAN | {"receivers": "top", "masks": True}
    whole = umbra.shadow_study(town, SITE, **given).dataset
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as all_,
        distributed.Client(all_) as client,
    ):
        study = umbra.shadow_study(town, SITE, **given, chunks=20)
        graph = study.shadow_hours.data.dask
        assert sum(name[0].startswith("umbra-chunk") for name in graph if len(name) == 3) == 64
        compare(whole, study.dataset)
        got = client.run(_list_transfers).values()
        prepared = client.run(_count_prepared).values()
    assert all(len(keys) <= 1 for keys in got)
    assert max(prepared) == 1


def _list_transfers(dask_worker):
    """List the names of the jobs that came from another worker."""
    logs = dask_worker.transfer_incoming_log
    return [key for log in logs for key in log["keys"] if str(key).startswith("umbra-job")]


def _count_prepared():
    return len(chunked._prepared)
