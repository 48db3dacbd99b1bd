"""Files of formats that are not read: the error names them, and what converts them."""

import json

import pytest

import umbra
from umbra import InputError

XML = '<?xml version="1.0"?>\n'
OLD_GLTF = {"accessors": {"a": {}}, "meshes": {"m": {}}, "nodes": {"n": {}}}


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.kml", XML + "<kml></kml>", r"KML .*ogr2ogr FILE\.geojson FILE\.kml"),
        ("a.kmz", b"PK\x03\x04...", "ZIP archive without .* KML"),
        ("a.xml", XML + "<svg>", "XML is not read"),
        ("a.3dm", b"3D Geometry File Format        7", "Rhino"),
        ("a.skp", "\ufeffSketchUp Model".encode("utf-16-le"), "SketchUp"),
        ("a.skp", b"\xff\xfe\xff\x0eS\0k\0e\0t\0c\0h\0U\0p\0", "SketchUp"),
        ("a.dwg", b"AC1027\0\0", "ODA File"),
        ("a.dxf", b"  0\nSECTION\n  2\nHEADER\n", "DXF .*FreeCAD"),
        ("a.dxf", b"999\nmade by hand\n  0\nSECTION\n", "DXF .*FreeCAD"),
        ("a.fbx", b"Kaydara FBX Binary  \0", "FBX .*Blender"),
        ("a.fbx", b"; FBX 7.3.0 project file", "FBX .*Blender"),
        ("a.3mf", b"PK\x03\x04...", "3MF"),
        ("a.blend", b"BLENDER-v402", "Blender .*glTF"),
        ("a.blend", b"\x28\xb5\x2f\xfd...", "Blender .*glTF"),
        ("a.usdz", b"PK\x03\x04...", "USD"),
        ("a.asc", b"ncols 4\nnrows 3\n", r"gdal_translate FILE\.asc FILE\.tif"),
        ("a.rvt", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "Revit .*IFC"),
        ("a.gltf", json.dumps({"asset": {"version": "1.0"}}), r"glTF 1\.0.*gltf-pipeline"),
        ("a.gltf", json.dumps(OLD_GLTF), r"glTF 1\.0.*gltf-pipeline"),
        ("a.glb", b"glTF\1\0\0\0" + bytes(20), "GLB version 1.*gltf-pipeline"),
        ("a.zip", b"PK\x03\x04...", "ZIP archive"),
        ("a.obj.gz", b"\x1f\x8b\x08", "gzip"),
        ("a.obj", b"version https://git-lfs.github.com/spec/v1", "git lfs pull"),
        ("a.xyz", b"1 2 3\n", "its format is unknown"),
    ],
)
def test_a_file_that_is_not_read_is_called_by_its_name(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError, match=words) as caught:
        umbra.read(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_an_ending_alone_takes_no_file_away(tmp_path):
    path = tmp_path / "mesh.asc"  # any program may have called it so
    path.write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n")
    with path.open("a") as file:
        file.write("property float z\nelement face 1\nproperty list uchar int vertex_indices\n")
        file.write("end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    assert umbra.read(path).parts[0].triangles == 1
