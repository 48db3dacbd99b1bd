"""FlatCityBuf: the same city as its CityJSON, and of a box only the features that meet it."""

import numpy as np
import pytest

import umbra
from umbra import InputError

fcb = pytest.importorskip("flatcitybuf", reason="flatcitybuf is not installed")

from support.fcb_files import make_fcb  # noqa: E402 - after the skip
from support.gml_files import prism  # noqa: E402

X, Y = 85_000.0, 447_000.0
HOUSES = {
    f"house {n}": [np.array(corners) + (X + 20 * n, Y, 0) for _, corners in prism()]
    for n in range(5)
}


@pytest.fixture
def city(tmp_path):
    path = tmp_path / "city.fcb"
    path.write_bytes(make_fcb(HOUSES))
    return path


def test_features_are_read_with_names_kinds_places_and_crs(city):
    scene = umbra.read(city)
    assert scene.sources[0].format == "FlatCityBuf 2.0"
    assert scene.crs == "EPSG:28992"
    assert [(part.name, part.kind, part.triangles) for part in scene.parts] == [
        (f"house {n}", "Building", 12) for n in range(5)
    ]
    np.testing.assert_allclose(scene.bounds(), [[X, Y, 0], [X + 84, Y + 6, 3]], atol=1e-3)


@pytest.mark.parametrize("is_indexed", [True, False])
def test_a_box_keeps_the_same_whole_objects_with_and_without_an_index(tmp_path, is_indexed):
    path = tmp_path / "city.fcb"
    path.write_bytes(make_fcb(HOUSES, is_indexed=is_indexed))
    scene = umbra.read(path, bbox=(X + 22, Y + 1, X + 41, Y + 2))
    assert [part.name for part in scene.parts] == ["house 1", "house 2"]
    np.testing.assert_allclose(scene.bounds()[:, 0], [X + 20, X + 44], atol=1e-3)
    assert "left out: 3" in scene.notes[0]


def test_an_index_spares_what_it_leaves_out(city, monkeypatch):
    read = []
    decode = fcb.to_cityjson_feature
    monkeypatch.setattr(
        fcb, "to_cityjson_feature", lambda one, h: read.append(one.id) or decode(one, h)
    )
    umbra.read(city, bbox=(X, Y, X + 1, Y + 1))
    assert read == ["house 0"]


def test_a_box_without_a_feature_is_an_error(city):
    with pytest.raises(InputError, match="no object meets bbox=0,0,1000,1000") as caught:
        umbra.read(city, bbox="0,0,1000,1000")
    assert caught.value.data["option"] == "bbox"


def test_a_file_that_breaks_off_is_damaged(city):
    data = city.read_bytes()
    city.write_bytes(data[:-20])
    with pytest.raises(InputError, match="damaged FlatCityBuf"):
        umbra.read(city)
