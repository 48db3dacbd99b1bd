"""Rasters, tables, models and films: read back by other people's programs."""

import csv
import datetime as dt
import gzip
from contextlib import contextmanager

import numpy as np
import pytest
import trimesh
from PIL import Image
from support.shapes import box, moved

from umbra.errors import UmbraError
from umbra.receivers import find_kind
from umbra.receivers.counted import find_near
from umbra.scene import Mesh, Part, make_scene
from umbra.study import run_study
from umbra.study.preview import make_preview
from umbra.sun import Site
from umbra.sun.clock import Stamps
from umbra.writers import csv_tables, day_film
from umbra.writers.csv_tables import write_cells, write_instants
from umbra.writers.glb import write_model_glb
from umbra.writers.output_formats import FORMATS, Job
from umbra.writers.outputs import write_formats
from umbra.writers.pixels import shade_ramp

CLOCK = [f"{hour:02}:00" for hour in range(8, 19)]
VIENNA = Site(48.2, 16.37, "Europe/Vienna")
HOUSES = {
    "house": moved(box((-6, -4, 0), (4, 6, 14)), (2500, 340000, 180)),
    "shed": moved(box((14, -9, 0), (20, -6, 4)), (2500, 340000, 180)),
}


def make_study(crs="EPSG:31256", **options):
    scene = make_scene([Part(name, "", Mesh(*mesh)) for name, mesh in HOUSES.items()], crs=crs)
    chosen = {"date": "2026-09-18", "start": "08:00", "end": "18:00", "every": "1h",
              "size": (84, 71), "extent": (2470, 339980, 2540, 340035)} | options  # fmt: skip
    return run_study(scene, VIENNA, **chosen)


@pytest.fixture(scope="module")
def study():
    return make_study()


def write(study, folder, *names):
    said = []
    return write_formats(Job(study, folder, "Houses", said.append), names), said


@pytest.mark.parametrize("crs", ["EPSG:31256", "EPSG:31256+5778", None])
def test_geotiff_lies_where_the_study_does(tmp_path, crs):
    rasterio = pytest.importorskip("rasterio")
    study = make_study(crs)
    assert write(study, tmp_path, "geotiff") == (["hours.tif"], [])
    with rasterio.open(tmp_path / "hours.tif") as raster:
        assert raster.descriptions == ("shadow_hours", "sun_hours")
        assert raster.units == ("h", "h")
        assert raster.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
        assert np.isnan(raster.nodata)
        assert raster.tags()["time_zone"] == "Europe/Vienna"
        assert raster.crs == (rasterio.crs.CRS.from_epsg(31256) if crs else None)
        for row, col in ((0, 0), (70, 83), (12, 40)):
            x, y = raster.xy(raster.height - 1 - row, col)
            assert (x, y) == pytest.approx((study.x[col], study.y[row]), abs=1e-6)
        np.testing.assert_array_equal(raster.read(1)[::-1], study.shadow_hours)
        np.testing.assert_array_equal(raster.read(2)[::-1], study.sun_hours)


def test_cells_csv_has_a_line_for_each_cell(tmp_path):
    study = make_study(spells=True, receivers="top")
    write_cells(tmp_path / "cells.csv", study)
    with (tmp_path / "cells.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == study.shadow_hours.size
    for name in ("shadow_hours", "sun_hours", "receiver_z"):
        values = np.array([float(line[name]) for line in lines]).reshape(study.shadow_hours.shape)
        np.testing.assert_allclose(values, study.variables()[name][1], atol=6e-4)
    assert (float(lines[85]["x"]), float(lines[85]["y"])) == pytest.approx(
        (study.x[1], study.y[1]), abs=6e-4
    )
    first = np.asarray(study.variables()["first_sun"][1]).ravel()
    for line, instant in zip(lines, first, strict=True):
        if np.isnat(instant):
            assert not line["first_sun"]
        else:
            seconds = instant.astype("datetime64[s]").item()
            assert dt.datetime.fromisoformat(line["first_sun"]) == seconds.replace(tzinfo=dt.UTC)


def test_a_large_table_of_cells_is_packed_and_announced(study, tmp_path, monkeypatch):
    cells = study.shadow_hours.size
    write_cells(tmp_path / "all.csv", study)
    with (tmp_path / "all.csv").open() as file:
        numbers = cells * len(file.readline().split(","))
    monkeypatch.setattr(csv_tables, "MOST_NUMBERS", numbers)
    names, _ = write(study, tmp_path, "csv")
    assert names[0] == "cells.csv"
    monkeypatch.setattr(csv_tables, "MOST_NUMBERS", numbers - 1)
    (tmp_path / "packed").mkdir()
    names, said = write(study, tmp_path / "packed", "csv")
    assert names == ["cells.csv.gz", "instants.csv", "areas_by_hours.csv"]
    assert f"note: cells.csv.gz is packed: {cells:,} lines, " in said[0]
    packed = (tmp_path / "packed" / "cells.csv.gz").read_bytes()
    assert gzip.decompress(packed) == (tmp_path / "cells.csv").read_bytes()
    assert packed[4:8] == bytes(4)  # no time: two runs write the same


def test_instants_csv_has_a_line_for_each_step(study, tmp_path):
    write_instants(tmp_path / "instants.csv", study)
    with (tmp_path / "instants.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == len(study.period.hours)
    assert lines[0]["from"] == "2026-09-18T08:00:00+02:00"
    assert lines[0]["judged_at_utc"] == "2026-09-18T06:30:00.000Z"
    assert lines[-1]["to"] == "2026-09-18T18:00:00+02:00"
    altitudes = [float(line["sun_altitude"]) for line in lines]
    np.testing.assert_allclose(altitudes, study.sun.altitude, atol=1e-4)


def test_csv_counts_the_shaded_ground(study, tmp_path):
    names, _ = write(study, tmp_path, "csv")
    assert names == ["cells.csv", "instants.csv", "areas_by_hours.csv"]
    with (tmp_path / "instants.csv").open(newline="") as file:
        areas = [float(line["shadow_area_m2"]) for line in csv.DictReader(file)]
    masked = make_study(masks=True)
    is_open = masked.heights <= masked.ground
    cell = masked.grid.dx * masked.grid.dy
    expected = [np.count_nonzero((mask > 0) & is_open) * cell for mask in masked.masks]
    np.testing.assert_allclose(areas, expected)
    with (tmp_path / "areas_by_hours.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    hours = int(rows[1][0].split()[0])
    assert rows[0][1] == "open ground in the frame, within 20 m of buildings [m²]"
    size = study.grid.dx, study.grid.dy
    near = is_open & find_near(~is_open, size, 20.0 + min(size) / 2)  # from walls
    area = np.count_nonzero((study.sun_hours >= hours - 1e-3) & near) * cell
    assert float(rows[1][1]) == pytest.approx(area, abs=0.06)


@pytest.mark.parametrize("receivers", ["ground", "top"])
def test_glb_carries_the_hours_as_colours(tmp_path, receivers):
    study = make_study(receivers=receivers)
    write_model_glb(tmp_path / "hours.glb", study)
    loaded = trimesh.load(tmp_path / "hours.glb", process=False)
    # glTF's y is up: 14 m is the tallest.
    np.testing.assert_allclose(loaded.bounds[:, 1], [0, 14], atol=1e-4)
    origin = loaded.metadata.get("origin", None)
    meshes = {node: loaded.geometry[loaded.graph[node][1]] for node in loaded.graph.nodes_geometry}
    assert set(meshes) == {"ground", "model"} | ({"surfaces"} if receivers == "top" else set())
    assert origin is None or len(origin) == 3
    ramp = shade_ramp()
    linear = np.where(ramp <= 0.04045, ramp / 12.92, ((ramp + 0.055) / 1.055) ** 2.4)
    middle = np.round((study.grid.x[[0, -1]].mean(), study.grid.y[[0, -1]].mean()))

    def expected(points):
        col = np.rint((points[:, 0] + middle[0] - study.grid.x0) / study.grid.dx).astype(int)
        row = np.rint((-points[:, 2] + middle[1] - study.grid.y0) / study.grid.dy).astype(int)
        share = study.shadow_hours[row, col] / study.up_hours
        return linear[np.clip(share * 255 + 0.5, 0, 255).astype(int)] * 255

    ground = meshes["ground"]
    rgb = np.asarray(ground.visual.vertex_attributes["color"])[:, :3]
    if receivers == "ground":
        assert np.abs(rgb - expected(ground.vertices)).max() <= 1
        assert len(np.unique(rgb, axis=0)) > 5
    else:
        surfaces = meshes["surfaces"]
        assert np.ptp(surfaces.triangles, axis=1).max() < 2.1  # divided to cells
        inner = np.abs(surfaces.vertices[:, 1] - 14) < 1e-3
        rgb = np.asarray(surfaces.visual.vertex_attributes["color"])[inner, :3]
        assert np.median(np.abs(rgb - expected(surfaces.vertices[inner]))) <= 1


def test_a_film_shows_round_times_as_dense_as_the_steps(study, tmp_path):
    moments = day_film.find_frames(study)
    assert [f"{moment.local:%H:%M}" for moment in moments] == CLOCK
    assert write(study, tmp_path, "gif") == (["day.gif"], [])
    view = make_preview(study, steps=Stamps(stamps=study.steps.stamps, zone=study.site.zone))
    with Image.open(tmp_path / "day.gif") as gif:
        assert gif.n_frames == len(moments)
        assert gif.info["loop"] == 0
        rows, cols = view.shadows.shape[1:]
        wide, high = gif.width, gif.height - day_film.STRIP
        assert high / wide == pytest.approx(55 / 70, rel=0.01)
        checked = 0
        for k in (1, 5, 9):
            gif.seek(k)
            pixels = np.asarray(gif.convert("RGB")).astype(int)
            mask = view.shadows[k]
            for row, col in np.argwhere(view.heights <= 0)[::97]:
                y = day_film.STRIP + high - round((row + 0.5) / rows * high)
                around = mask[max(0, row - 1) : row + 2, max(0, col - 1) : col + 2]
                if around.any() != around.all():
                    continue
                assert (pixels[y, round((col + 0.5) / cols * wide), 0] < 190) == mask[row, col]
                checked += 1
    assert checked > 60


def test_a_film_shows_the_times_that_are_asked_for(study, tmp_path):
    job = Job(study, tmp_path, "tower", print, at=("15:00,09:00", "12:00"))
    assert write_formats(job, ["gif"]) == ["day.gif"]
    with Image.open(tmp_path / "day.gif") as gif:
        assert gif.n_frames == 3


def test_mp4_plays_as_long_as_the_gif(study, tmp_path):
    av = pytest.importorskip("av")
    assert write(study, tmp_path, "mp4") == (["day.mp4"], [])
    with av.open(tmp_path / "day.mp4") as film_:
        stream = film_.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        frames = list(film_.decode(video=0))
    assert len(frames) == len(CLOCK)
    assert frames[0].width % 2 == frames[0].height % 2 == 0


def test_a_night_has_no_film_and_says_so(tmp_path):
    night = make_study(start="22:00", end="24:00")
    names, said = write(night, tmp_path, "gif", "csv", "glb")
    assert "day.gif" not in names
    assert "below the horizon" in said[0]


def test_top_has_lines_and_no_outlines_and_says_so(tmp_path):
    pytest.importorskip("ezdxf")
    pytest.importorskip("pyclipr")
    pytest.importorskip("shapely")
    names, said = write(make_study(receivers="top"), tmp_path, "geojson", "dxf")
    assert names == ["hour_lines.geojson", "study.dxf"]
    assert "level ground only" in said[0]


def test_every_format_names_its_files(tmp_path, study):
    for package in ("pyclipr", "shapely", "pyogrio", "rasterio", "ezdxf", "av"):
        pytest.importorskip(package)
    names, said = write(study, tmp_path, *study.kind.formats)
    assert sorted(names) == sorted(path.name for path in tmp_path.iterdir())
    assert [line.partition(" at ")[0] for line in said if "volumes" not in line] == [
        "note: shadows are outlined"
    ]
    assert sum("volumes" in line for line in said) == 2  # of which times, and where they end


@contextmanager
def small_disk():
    """No file of this process grows beyond 3 kB, as on a disk that is full."""
    import resource  # noqa: PLC0415 - not on Windows

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, hard))
    try:
        yield
    finally:  # before pytest itself writes, to what may be a file
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("name", find_kind("ground").formats)
def test_a_full_disk_is_an_error_and_not_half_a_file(study, tmp_path, name):
    for package in ("resource", *FORMATS[name].packages):
        pytest.importorskip(package)
    job = Job(study, tmp_path, "Houses", print)
    write_formats(job, ["geojson"] if name != "geojson" else ["gpkg"])  # imports, compilation
    with small_disk(), pytest.raises((OSError, UmbraError)):
        FORMATS[name].write(job)
