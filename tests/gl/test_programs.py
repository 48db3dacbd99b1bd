"""Shaders: what does not compile is named by file and line."""

from dataclasses import replace

import pytest

from umbra.errors import UmbraError
from umbra.gl import programs
from umbra.gl.programs import Program, load_source

# moderngl leaves broken programs in the context: these tests go without the watch on it.

GOOD_VERTEX = "void main() {\n    gl_Position = vec4(0.0);\n}\n"
GOOD_FRAGMENT = "void main() {\n}\n"


@pytest.fixture
def shaders(tmp_path, monkeypatch):
    """Write shaders into a package of one's own."""
    (tmp_path / "shaders").mkdir()
    monkeypatch.setattr(programs.resources, "files", lambda _: tmp_path)
    load_source.cache_clear()

    def write(**texts):
        for name, text in texts.items():
            (tmp_path / "shaders" / f"{name}.glsl").write_text(text)

    yield write
    load_source.cache_clear()


def test_an_error_names_file_and_line(shared_device, shaders):
    shaders(a="void main() {\n\n    gl_Position = missing;\n}\n", b=GOOD_FRAGMENT)
    with pytest.raises(UmbraError, match=r"does not compile: a\.glsl:3: .*missing"):
        Program(shared_device, "a.glsl", "b.glsl")


def test_an_error_in_an_included_file_names_that_one(shared_device, shaders):
    shaders(
        c="// one\nfloat twice(float x) {\n    return 2.0 * y;\n}\n",
        a='\n\n#include "c.glsl"\n' + GOOD_VERTEX,
        b=GOOD_FRAGMENT,
    )
    with pytest.raises(UmbraError, match=r"c\.glsl:3: "):
        Program(shared_device, "a.glsl", "b.glsl")


def test_lines_after_defines_and_includes_are_right(shared_device, shaders):
    shaders(c="\n\n\n", a='#include "c.glsl"\nvoid main() {\n    oops;\n}\n', b=GOOD_FRAGMENT)
    with pytest.raises(UmbraError, match=r"a\.glsl:3: "):
        Program(shared_device, "a.glsl", "b.glsl", {"LIGHTS": 3, "MODE": 1})


def test_an_error_in_the_fragment_shader(shared_device, shaders):
    shaders(a=GOOD_VERTEX, b="out vec4 c;\nvoid main() {\n    c = vec3(0.0);\n}\n")
    with pytest.raises(UmbraError, match=r"b\.glsl:3: "):
        Program(shared_device, "a.glsl", "b.glsl")


def test_what_does_not_link_names_both(shared_device, shaders):
    shaders(
        a="out vec2 v;\nvoid main() {\n    v = vec2(0.0);\n    gl_Position = vec4(0.0);\n}\n",
        b="in vec4 v;\nout vec4 c;\nvoid main() {\n    c = v;\n}\n",
    )
    with pytest.raises(UmbraError, match=r"a\.glsl and b\.glsl do not link"):
        Program(shared_device, "a.glsl", "b.glsl")


def test_a_missing_file_is_named(shared_device, shaders):
    with pytest.raises(UmbraError, match=r"the shader 'nowhere\.glsl' is missing"):
        Program(shared_device, "nowhere.glsl", "b.glsl")


@pytest.mark.parametrize(
    "line", ["0:4(9): error: no `x'", "0(4) : error C1008: no x", "ERROR: 0:4: no x"]
)
def test_every_drivers_report_is_read(line):
    found = programs._PLACE.match(line)
    assert found[1] == "4"
    assert "no" in found[2]


def test_every_vertex_shader_is_invariant():
    folder = programs.resources.files("umbra.gl") / "shaders"
    for path in folder.iterdir():
        if path.name.endswith(".vert.glsl") and path.name != "picture.vert.glsl":
            assert "invariant gl_Position;" in "\n".join(
                line for line, _ in load_source(path.name)
            ), path.name


def test_a_driver_that_cannot_number_faces_refuses_in_a_line(device):
    broken = replace(device, renderer="softpipe")
    with pytest.raises(UmbraError, match="GALLIUM_DRIVER=llvmpipe") as caught:
        Program(broken, "surface.vert.glsl", "face.frag.glsl")
    assert caught.value.option == "device"
    Program(broken, "surface.vert.glsl", "key.frag.glsl").release()
