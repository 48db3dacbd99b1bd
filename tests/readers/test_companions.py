"""A model may have any file of its own folder opened, and no other."""

import os
import sys

import numpy as np
import pytest
from PIL import Image as Picture
from support.gltf_files import Document

import umbra
from umbra import InputError
from umbra.readers.checks import Companions, encoded_image

POINTS = np.array([[0, 0, 0], [2, 0, 0], [0, 0, 3]], "<f4")
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n{}f 1 2 3\n"

needs_links = pytest.mark.skipif(sys.platform == "win32", reason="links and pipes need rights")


@pytest.fixture
def folder(tmp_path):
    """A folder for models, beside a secret."""
    (tmp_path / "secret.bin").write_bytes(POINTS.tobytes())
    (tmp_path / "secret.mtl").write_text("newmtl red\nKd 1 0 0\n")
    models = tmp_path / "models"
    (models / "deep").mkdir(parents=True)
    (models / "deep" / "own.bin").write_bytes(POINTS.tobytes())
    (models / "own.mtl").write_text("newmtl red\nKd 1 0 0\n")
    return models


def gltf(folder, uri):
    document = Document()
    mesh = document.mesh({"attributes": {"POSITION": document.accessor(POINTS)}})
    document.node(mesh=mesh)
    path = folder / "model.gltf"
    path.write_text(document.gltf(uri))
    return path


def red_obj(folder, *lines):
    path = folder / "model.obj"
    path.write_text(TRIANGLE.format("".join(f"{line}\n" for line in (*lines, "usemtl red"))))
    return path


@pytest.mark.parametrize("uri", ["deep/own.bin", "./deep/../deep/own.bin", "deep%2Fown%2ebin"])
def test_buffers_in_the_folder_and_below_are_read(folder, uri):
    assert umbra.read(gltf(folder, uri)).parts[0].triangles == 1


@pytest.mark.parametrize(
    "uri",
    ["../secret.bin", "%2e%2e/secret.bin", "deep/../../secret.bin", "/proc/self/environ"]
    + ["/dev/zero", "file:///etc/passwd", "{above}/secret.bin"],
)
def test_buffers_elsewhere_are_refused(folder, uri):
    uri = uri.format(above=folder.parent)
    with pytest.raises(InputError, match=r"buffer '.*' (lies outside|is not beside)") as caught:
        umbra.read(gltf(folder, uri))
    assert ("allow_outside=True" in str(caught.value)) == (uri[:4] != "file")


def test_who_means_it_reads_them(folder):
    scene = umbra.read(gltf(folder, "../secret.bin"), allow_outside=True)
    assert scene.parts[0].triangles == 1
    assert [source.name for source in scene.sources] == ["model.gltf", "../secret.bin"]


@needs_links
def test_a_link_that_leads_out_is_elsewhere(folder):
    (folder / "link.bin").symlink_to(folder.parent / "secret.bin")
    with pytest.raises(InputError, match=r"'link\.bin' lies outside"):
        umbra.read(gltf(folder, "link.bin"))
    (folder / "inner.bin").symlink_to(folder / "deep" / "own.bin")
    assert umbra.read(gltf(folder, "inner.bin")).parts[0].triangles == 1


@needs_links
def test_neither_pipes_nor_folders_nor_devices_are_opened(folder):
    os.mkfifo(folder / "pipe.bin")  # reading it would wait for ever
    for name in ("pipe.bin", "deep"):
        with pytest.raises(InputError, match="is not a regular file"):
            umbra.read(gltf(folder, name))
    with pytest.raises(InputError, match="is not a regular file"):
        umbra.read(gltf(folder, "/dev/zero"), allow_outside=True)


def test_a_file_of_too_many_bytes_is_not_read(folder):
    found = Companions(folder / "model.gltf")
    assert len(found.read("deep/own.bin", most=36)) == 36
    with pytest.raises(InputError, match=r"'own\.bin' is larger than 0 MB"):
        found.read("deep/own.bin", most=35)
    assert found.record == {"deep/own.bin": None}


def test_a_pointer_to_a_file_is_not_the_file(folder):
    (folder / "far.bin").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    with pytest.raises(InputError, match=r"'far.bin' is a Git LFS pointer.*; run git lfs pull$"):
        umbra.read(gltf(folder, "far.bin"))


@pytest.mark.parametrize("name", ["../secret.mtl", "..\\secret.mtl", "{above}/secret.mtl"])
def test_material_libraries_elsewhere_are_noted(folder, name):
    path = red_obj(folder, f"mtllib {name}".format(above=folder.parent))
    scene = umbra.read(path)
    assert "lies outside the model's folder" in scene.notes[0]
    assert scene.parts[0].material.color != (1, 0, 0)
    assert umbra.read(path, allow_outside=True).parts[0].material.color == (1, 0, 0)
    assert umbra.read(red_obj(folder, "mtllib own.mtl")).parts[0].material.color == (1, 0, 0)


def test_textures_elsewhere_are_noted(folder):
    Picture.new("RGB", (2, 2)).save(folder.parent / "brick.png")
    (folder / "own.mtl").write_text("newmtl red\nmap_Kd ../brick.png\n")
    scene = umbra.read(red_obj(folder, "mtllib own.mtl"))
    assert "textures outside the model's folder" in scene.notes[0]
    assert scene.parts[0].material.image is None
    allowed = umbra.read(red_obj(folder, "mtllib own.mtl"), allow_outside=True)
    assert allowed.parts[0].material.image.pixels.shape == (2, 2, 4)


@needs_links
def test_a_texture_is_looked_at_again_when_it_is_drawn(folder):
    Picture.new("RGB", (2, 2)).save(folder / "brick.png")
    (folder / "own.mtl").write_text("newmtl red\nmap_Kd brick.png\n")
    image = umbra.read(red_obj(folder, "mtllib own.mtl")).parts[0].material.image
    (folder / "brick.png").rename(folder.parent / "brick.png")
    (folder / "brick.png").symlink_to(folder.parent / "brick.png")
    with pytest.raises(InputError, match=r"texture 'brick\.png' lies outside"):
        _ = image.pixels


def test_pictures_that_are_programs_are_none():
    script = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n%%EOF\n"
    with pytest.raises(InputError, match="its image format is unknown"):
        _ = encoded_image("a.eps", lambda: script).pixels


@needs_links
def test_what_gdal_would_open_beside_a_raster_is_looked_at(folder):
    rasterio = pytest.importorskip("rasterio")
    path = folder / "height.tif"
    with rasterio.open(
        path, "w", driver="GTiff", width=4, height=3, count=1, dtype="float32", crs="EPSG:32633",
        transform=rasterio.transform.from_origin(600000, 5340000, 1, 1),
    ) as file:  # fmt: skip
        file.write(np.ones((1, 3, 4), "float32"))
    assert umbra.read(path).parts[0].triangles == 12
    (folder / "height.tif.msk").symlink_to(folder.parent / "secret.bin")
    with pytest.raises(InputError, match=r"'height\.tif\.msk' lies outside"):
        umbra.read(path)
