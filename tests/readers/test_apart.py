"""Files too far apart for one study, and the CRS of files that name none."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import umbra
from umbra import InputError
from umbra.cli.main import umbra as command
from umbra.readers.apart import FilePlan, check_apart

SQUARE = [(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)]
FACES = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
VIENNA = (2500, 340500)  # EPSG:31256
HERE = (48.20290, 16.36577)  # of VIENNA [degrees]


@pytest.fixture
def city(tmp_path):
    """A footprint at a place in a CRS."""

    def write(name="city.geojson", place=VIENNA, crs="EPSG:31256"):
        x, y = place
        shape = {"type": "Polygon", "coordinates": [[[x + a, y + b] for a, b in SQUARE]]}
        feature = {"type": "Feature", "properties": {"height": 5.0}, "geometry": shape}
        document = {"type": "FeatureCollection", "features": [feature]}
        if crs is not None:
            document["crs"] = {"type": "name", "properties": {"name": crs}}
        path = tmp_path / name
        path.write_text(json.dumps(document))
        return path

    return write


@pytest.fixture
def house(tmp_path):
    """A tetrahedron at a place, without a CRS."""

    def write(name="house.obj", place=(0, 0)):
        x, y = place
        corners = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2)]
        lines = "".join(f"v {x + a} {y + b} {c}\n" for a, b, c in corners)
        path = tmp_path / name
        path.write_text(lines + FACES)
        return path

    return write


def test_a_file_without_a_crs_far_from_a_city_is_an_error(city, house):
    with pytest.raises(InputError, match=r"house\.obj lies 341 km") as caught:
        umbra.read(city(), f"new={house()}")
    assert caught.value.distance == pytest.approx(np.hypot(2498, 340498))
    assert caught.value.files == ["house.obj"]
    assert caught.value.site is None
    # In any order: the city names its place.
    with pytest.raises(InputError) as caught:
        umbra.read(house(), city())
    assert caught.value.files == ["house.obj"]
    # Two files that name no CRS.
    with pytest.raises(InputError) as caught:
        umbra.read(house("a.obj"), house("b.obj", (12_500, 0)))
    assert caught.value.files == ["b.obj"]


@pytest.mark.parametrize("name", ["study", "render", "view", "inspect", "tiles"])
def test_every_command_refuses_files_far_apart(name, city, house, tmp_path):
    out = tmp_path / "out"
    more = {
        "study": ["--date", "2026-03-21", "--out", out],
        "render": ["--out", tmp_path / "out.png"],
        "view": ["--out", tmp_path / "out.html"],
        "inspect": [],
        "tiles": ["--date", "2026-03-21", "--out", out, "--tiles", "1km"],
    }[name]
    words = [name.replace("tiles", "study"), city(), house(), *more]
    done = CliRunner().invoke(command, list(map(str, words)), obj=[])
    assert isinstance(done.exception, InputError)
    assert done.exception.files == ["house.obj"]
    assert not (out / "study.nc").exists()
    assert not (out / "study.zarr").exists()


def test_honest_far_files_are_read(city, house):
    # Tiles of a city: each beside the next, without a CRS.
    row = [house(f"{k}.obj", (9_000 * k, 0)) for k in range(6)]
    assert len(umbra.read(*row).parts) == 6
    # A ridge 30 km away that says where it is casts shadows in the evening; it is said.
    ridge = city("ridge.geojson", (VIENNA[0] - 30_000, VIENNA[1]))
    scene = umbra.read(city(), ridge)
    assert [note for note in scene.notes if "ridge.geojson lies 30 km" in note]
    # Beyond the horizon there is no shadow to share.
    with pytest.raises(InputError) as caught:
        umbra.read(city(), city("far.geojson", (VIENNA[0] - 150_000, VIENNA[1])))
    assert caught.value.distance == pytest.approx(149_990)


def test_a_site_that_lies_in_the_city_is_named():
    there = FilePlan("city.gml", np.array([[2000.0, 340000], [3000, 341000]]), "EPSG:31256")
    for place, is_there in ((HERE, True), ((52.5, 13.4), False)):
        other = FilePlan("house.ifc", np.array([[0.0, 0], [20, 20]]), None, *place)
        with pytest.raises(InputError) as caught:
            check_apart([there, other], "EPSG:31256")
        assert (caught.value.site is not None) == is_there
        if is_there:
            np.testing.assert_allclose(caught.value.site, VIENNA, atol=100)
            assert all(f"{value:.5f}°" in str(caught.value) for value in place)


def test_swapped_degrees_beside_a_city_are_named(city):
    for place, is_swapped in ((HERE, True), ((40.0, 10.0), False)):
        house = city("house.geojson", place, None)
        document = json.loads(house.read_text())
        ring = [[place[0] + a * 1e-5, place[1] + b * 1e-5] for a, b in SQUARE]
        document["features"][0]["geometry"]["coordinates"] = [ring]
        house.write_text(json.dumps(document))
        with pytest.raises(InputError) as caught:
            umbra.read(city(), house)
        assert caught.value.is_swapped == is_swapped


def test_a_crs_is_given_to_files_that_name_none(city, house):
    here = umbra.read(city())
    scene = umbra.read(house(place=VIENNA), crs="EPSG:31256")
    assert scene.crs == here.crs == "EPSG:31256"
    assert scene.latitude == pytest.approx(here.latitude, abs=1e-3)
    # Beside a file that names another it is converted.
    from pyproj import Transformer  # noqa: PLC0415

    place = Transformer.from_crs("EPSG:31256", "EPSG:32633", always_xy=True).transform(*VIENNA)
    both = umbra.read(city(), house(place=place), crs="EPSG:32633")
    assert both.crs == "EPSG:31256"
    np.testing.assert_allclose(both.parts[1].bounds[0, :2] + both.origin[:2], VIENNA, atol=0.1)
    # A note on metres without a CRS is no longer true.
    plain = city(crs=None)
    assert any("no CRS is named" in note for note in umbra.read(plain).notes)
    assert not any("no CRS is named" in note for note in umbra.read(plain, crs="EPSG:31256").notes)


def test_a_crs_bounds_what_is_read(city):
    box = "16.365,48.202,16.367,48.204"
    assert len(umbra.read(city(crs=None), crs="EPSG:31256", bbox=box).parts) == 1
    with pytest.raises(InputError, match="no object meets"):
        umbra.read(city(crs=None), crs="EPSG:31256", bbox="16,48,16.1,48.1")


def test_a_crs_that_is_unknown_or_not_needed_is_said(city):
    with pytest.raises(InputError) as caught:
        umbra.read(city(), crs="EPSG:1")
    assert caught.value.option == "crs"
    scene = umbra.read(city(), crs="EPSG:28992")
    assert scene.crs == "EPSG:31256"
    assert any("crs='EPSG:28992'" in note for note in scene.notes)


@pytest.mark.parametrize("tiles", [[], ["--tiles", "1km"]])
def test_a_study_names_the_crs_that_it_was_given(tiles, house, tmp_path):
    words = ["study", house(place=VIENNA), "--crs", "EPSG:31256", "--date", "2026-03-21"]
    words += ["--out", tmp_path / "out", "--no-pictures", "--cell", "5", "--json", *tiles]
    done = CliRunner().invoke(command, list(map(str, words)), obj=[], catch_exceptions=False)
    assert done.exit_code == 0
    import xarray  # noqa: PLC0415

    store = tmp_path / "out" / ("study.zarr" if tiles else "study.nc")
    found = xarray.open_dataset(store, engine="zarr" if tiles else None)
    assert found.attrs["crs"] == "EPSG:31256"
    assert found.attrs["latitude"] == pytest.approx(HERE[0], abs=0.01)
    assert 'crs = "EPSG:31256"' in (tmp_path / "out" / "study.toml").read_text()
