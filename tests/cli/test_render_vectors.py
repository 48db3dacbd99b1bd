"""``umbra render --out FILE.svg`` and ``.pdf``."""

import pytest
from support.model_files import save_obj
from support.shapes import box


def test_command_writes_vectors_beside_arrays(umbra_here, tmp_path):
    path = save_obj(tmp_path / "a.obj", {"a": box((0, 0, 0), (2, 2, 6))})
    out, arrays = tmp_path / "a.svg", tmp_path / "a.npz"
    said = umbra_here(
        "render", path, "--light", "-1,-1,1,0", "--out", out, "--arrays", arrays,
        "--shadows", "hatched", "--size", "90x60", "--json",
    )  # fmt: skip
    assert said.status == 0, said
    assert '"faces"' in said.out
    assert '"pixels"' in said.out
    assert 'inkscape:label="Shadows"' in out.read_text()
    assert arrays.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--out", "a.bmp"), "would be a PNG, SVG or PDF; name it"),
        (("--out", "a.svg", "--soft", "wedges"), "--soft is for pictures"),
        (("--out", "a.svg", "--spot", "0,0,9,0,0,0,20"), "vectors have no curves; write a PNG"),
    ],
)
def test_what_no_drawing_shows_is_refused(umbra_here, tmp_path, options, words):
    path = save_obj(tmp_path / "a.obj", {"a": box((0, 0, 0), (2, 2, 6))})
    given = [tmp_path / one if one.startswith("a.") else one for one in options]
    said = umbra_here("render", path, *given)
    assert said.status == 2
    assert words in said.err
