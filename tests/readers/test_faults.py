"""Whatever a library raises on a damaged file, `umbra.read` raises an InputError in one line."""

import io
import random
import re
import struct
import zipfile

import pytest
from support.dae_files import document
from support.gml_files import building, city, prism

import umbra
from umbra.readers.checks import damage_of, find_reason

CLASS = re.compile(r"\b[A-Z]\w*(Error|Exception)\b|object at 0x|\n")


def packed(member, text):
    """Give an archive with one member, compressed."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(member, text)
    return file.getvalue()


def read(path):
    """Read a file: True if it is read, False if it is refused in a line."""
    try:
        umbra.read(path)
    except umbra.InputError as error:
        told = str(error)
    else:
        return True
    assert not CLASS.search(told), told
    return False


@pytest.mark.parametrize(
    ("ending", "package"), [("zae", "collada"), ("kmz", "collada"), ("zip", "lxml")]
)
def test_archives_with_damaged_members_are_refused_in_a_line(tmp_path, ending, package):
    pytest.importorskip(package)
    member, text = "model.dae", document()
    if ending == "zip":
        member, text = "town.gml", city(building("h", prism(0)))
    whole = packed(member, text)
    path = tmp_path / f"town.{ending}"
    path.write_bytes(whole)
    assert read(path)
    dice = random.Random(26)
    refused = 0
    for _ in range(150):
        data = bytearray(whole)
        for _ in range(dice.choice((1, 1, 3))):
            data[dice.randrange(len(data))] = dice.randrange(256)
        path.write_bytes(data[: dice.choice((len(data), len(data), dice.randrange(len(data))))])
        refused += not read(path)
    assert refused > 75


@pytest.mark.parametrize(
    "raised",
    [
        RuntimeError("Entity #3 given twice"), struct.error("unpack requires 4 bytes"),
        zipfile.BadZipFile("Bad CRC-32"), NotImplementedError("compression type 99"), EOFError(),
        OSError("Couldn't deserialize thrift: TProtocolException: Invalid data"), KeyError("x"),
        OverflowError("too large"), StopIteration(), type("OfALibrary", (Exception,), {})("odd"),
        MemoryError(), RecursionError(), AssertionError(),
    ],
    ids=lambda error: type(error).__name__,
)  # fmt: skip
def test_all_that_a_reader_raises_becomes_one_line(raised):
    with pytest.raises(umbra.InputError, match=r"^town: is damaged") as caught, damage_of("town"):
        raise raised
    assert caught.value.__cause__ is raised
    assert not CLASS.search(str(caught.value))


def test_what_umbra_raises_stays_itself():
    with pytest.raises(umbra.UmbraError) as caught, damage_of("town"):
        raise umbra.UmbraError("no package")  # noqa: EM101
    assert not isinstance(caught.value, umbra.InputError)
    with pytest.raises(umbra.InputError, match=r"^town: is empty$"), damage_of("town"):
        raise umbra.InputError("is empty")  # noqa: EM101
    with pytest.raises(KeyboardInterrupt), damage_of("town"):
        raise KeyboardInterrupt


def test_reasons_name_no_class():
    for text, told in {
        "Couldn't read: TProtocolException: Invalid data": "Couldn't read: Invalid data",
        "lazrs.LazrsError: IoError: failed": "failed",
        "std::RuntimeError: no": "no",
        "an Error": "an",
        "two\nlines": "two lines",
    }.items():
        assert find_reason(ValueError(text)) == told


@pytest.mark.parametrize("length", range(0, 40, 3))
def test_a_composite_tile_cut_short_is_refused(tmp_path, length):
    tile = struct.pack("<4s3I", b"cmpt", 1, 44, 2) + struct.pack(
        "<4s6I", b"b3dm", 1, 28, 0, 0, 0, 0
    )
    (tmp_path / "tile.cmpt").write_bytes(tile[:length])
    ball = '"boundingVolume":{"sphere":[4e6,1e6,4.8e6,100]}'
    root = f'{{"geometricError":0,{ball},"content":{{"uri":"tile.cmpt"}},"refine":"ADD"}}'
    path = tmp_path / "tileset.json"
    path.write_text(f'{{"asset":{{"version":"1.0"}},"geometricError":1,"root":{root}}}')
    assert not read(path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-7", "iso-8859-1", "utf-32", "cp037"])
@pytest.mark.parametrize("is_declared", [False, True])
def test_a_document_type_hides_in_no_encoding(tmp_path, encoding, is_declared):
    pytest.importorskip("collada")
    body = re.sub(r"<\?xml.*?\?>", "", document()).strip()
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    kind = '<!DOCTYPE COLLADA [<!ENTITY a "b">]>' if is_declared else ""
    if encoding == "utf-7":
        text = head + kind.replace("<!", "+ADwAIQ-") + body
        data = text.encode()
    else:
        data = (head + kind + body).encode(encoding)
    for name, content in (("a.dae", data), ("a.zae", packed("a.dae", data))):
        (tmp_path / name).write_bytes(content)
        expected = encoding in {"utf-8", "utf-16"} and not is_declared
        assert read(tmp_path / name) == expected, name


def test_a_line_break_in_a_column_breaks_no_line(tmp_path):
    pytest.importorskip("mapbox_earcut")
    square = "[[[0,0],[9,0],[9,9],[0,9],[0,0]]]"
    shape = f'{{"type":"Polygon","coordinates":{square}}}'
    properties = '{"height\\nof it":9,"height":null,"name":"a"}'
    feature = f'{{"type":"Feature","properties":{properties},"geometry":{shape}}}'
    path = tmp_path / "plan.geojson"
    path.write_text(f'{{"type":"FeatureCollection","features":[{feature}]}}')
    scene = umbra.read(path, height_column="height\nof it")
    assert not any("\n" in note for note in scene.notes)
    with pytest.raises(umbra.InputError) as caught:
        umbra.read(path, height_column="no\nsuch")
    assert "\n" not in str(caught.value)


def test_a_null_in_a_name_is_written_by_all_formats(tmp_path):
    from support.shapes import box  # noqa: PLC0415

    mesh = umbra.Mesh(*box((0, 0, 0), (2, 2, 2)))
    scene = umbra.make_scene([umbra.Part("to\0wer", "wa\0ll", mesh, layer="l\0", tags=("t\0",))])
    assert scene.parts[0].name == "to\ufffdwer"
    study = umbra.shadow_study(
        scene, umbra.Site(48, 16, "UTC"), date="2026-03-21", every="4h", receivers="surfaces",
        spacing=1, device="cpu",
    )  # fmt: skip
    study.dataset.to_netcdf(tmp_path / "study.nc", engine="h5netcdf")
    given = umbra.shadow_study(
        scene, umbra.Site(48, 16, "UTC"), date="2026-03-21", every="4h", receivers="points",
        points=[[5, 5, 0]], names=["a\0b"], device="cpu",
    )  # fmt: skip
    given.dataset.to_netcdf(tmp_path / "points.nc", engine="h5netcdf")
    assert given.dataset.name.values.tolist() == ["a\ufffdb"]
