"""The tables of masks without a stencil: that they say what was issued and measured."""

import json

import numpy as np
import pytest
from PIL import Image
from support.bench import run_quick

pytestmark = pytest.mark.usefixtures("opengl")


def run(*arguments):
    return run_quick("roettger", *arguments, "--repeat", "1").stdout


def test_the_tables_have_the_papers_shape(tmp_path):
    found = json.loads(run("--json", "--pictures", str(tmp_path)))
    with Image.open(tmp_path / "roettger_figure_3.png") as sheet:
        begun, normalised = np.array(sheet)[:, [10, -10]].T  # beside the blocks: lit throughout
    assert {*begun[20:]} == {64}  # a quarter, above all text
    assert {*normalised} == {254}
    assert (found["benchmark"], found["quick"], found["repeat"]) == ("roettger", True, 1)
    assert len(found["table_1"]) == 4
    for row in found["table_1"]:
        assert row["ambient"] == row["paper_ambient"]
        assert row["attenuated"] == row["paper_attenuated"]
    rows = {row["mask"]: row for row in found["table_2"]}
    assert {"screen", "alpha", "stencil", "alpha 1/2", "alpha 1/4", "none"} <= set(rows)
    for row in rows.values():
        assert row["frames_per_second"] == pytest.approx(1e3 / row["ms"])
        assert row["to_stencil"] == pytest.approx(rows["stencil"]["ms"] / row["ms"])
        assert row["paper_to_stencil"] is None  # the paper has no window of 64²


def test_ratios_stand_beside_the_papers():
    from umbra_benchmarks.measure import Timing  # noqa: PLC0415
    from umbra_benchmarks.report import BenchmarkRun  # noqa: PLC0415
    from umbra_benchmarks.roettger import Roettger  # noqa: PLC0415

    run = BenchmarkRun(repeat=1, quick=False)
    times = {1024: {"alpha": Timing(0.2, 0.1), "stencil": Timing(0.1, 0.1)}}
    text = Roettger(run, "brush", "a sphere", {"alpha": ((2, 4), (1, 4))}, times).to_table()
    assert "| 1024²  | alpha   | 5.0      | 0.50       | 10.2             | 1.15 " in text
    assert "| alpha | 2/4     | 2/4   | 1/4        | 1/4   |" in text
    assert "--quick" not in text
