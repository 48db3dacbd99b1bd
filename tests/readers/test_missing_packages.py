"""A format whose package is not installed names it, and the extra that brings it."""

import sys

import pytest

import umbra
from umbra import InputError
from umbra.packages import write_install

CASES = [
    ("a.gml", b'<c:CityModel xmlns:c="http://www.opengis.net/citygml/2.0"/>', "lxml", "citygml"),
    ("a.fcb", b"fcb\x01fcb\x00", "flatcitybuf", "city"),
    ("a.parquet", b"PAR1" + bytes(20), "pyarrow", "city"),
    ("a.laz", b"LASF" + bytes(20), "laspy", "city"),
    ("a.laz", b"LASF" + bytes(20), "lazrs", "city"),
    ("a.3dm", b"3D Geometry File Format" + bytes(20), "rhino3dm", "cad"),
    ("a.dae", b"<COLLADA/>", "collada", "cad"),
]


@pytest.mark.parametrize(("name", "content", "package", "extra"), CASES)
def test_the_error_says_how_to_install_it(tmp_path, monkeypatch, name, content, package, extra):
    path = tmp_path / name
    path.write_bytes(content)
    for module in [one for one in sys.modules if one.partition(".")[0] == package]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=f"{package}.* not installed") as caught:
        umbra.read(path)
    assert caught.value.data["extra"] == extra
    assert write_install(extra) in str(caught.value)
