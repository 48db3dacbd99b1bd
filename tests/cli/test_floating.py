"""What is said of things that float above the ground."""

import pytest
from support.model_files import save_obj
from support.shapes import box


@pytest.fixture
def hillside(tmp_path):
    boxes = {f"h{k}": box((20 * k, 0, 5 * k), (20 * k + 8, 9, 5 * k + 6)) for k in range(5)}
    return save_obj(tmp_path / "hill.obj", boxes)


def test_a_study_of_a_hillside_says_what_to_type(study, hillside):
    said = study(files=[hillside])
    assert said.status == 0
    assert "note: 4 of 5 things" in said.err
    assert "--ground 10 " in said.err
    assert said.err.count("\n") == 1
    for options in (["--ground", "10"], ["--receivers", "top"], ["--quiet"]):
        assert "things" not in study(*options, files=[hillside]).err
