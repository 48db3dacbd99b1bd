"""The notebook of the docs runs from a clean kernel, and is kept without what it puts out."""

import sys
from pathlib import Path

import pytest

from umbra.machine import FIRST_RUN

NOTEBOOK = Path(__file__).parents[2] / "docs" / "study.ipynb"


@pytest.fixture(scope="module")
def notebook():
    nbformat = pytest.importorskip("nbformat")
    return nbformat.read(NOTEBOOK, as_version=4)


def test_it_is_kept_without_outputs(notebook):
    for cell in notebook.cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


def test_it_runs_alone_in_any_folder(notebook, tmp_path):
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    # This Python, whatever kernels are installed.
    manager = pytest.importorskip("jupyter_client").AsyncKernelManager(kernel_name="python3")
    manager.kernel_spec.argv[0] = sys.executable
    folder = {"metadata": {"path": str(tmp_path)}}
    done = nbclient.NotebookClient(notebook, km=manager, timeout=600, resources=folder).execute()
    outputs = [output for cell in done.cells for output in cell.get("outputs", ())]
    pictures = [one for one in outputs if "image/png" in one.get("data", {})]
    assert len(pictures) == 7
    printed = "".join(one.text for one in outputs if one.output_type == "stream")
    assert "42 parts, 168 triangles" in printed
    assert "half an hour is lost on" in printed
    assert "sky view factor on the bench 0." in printed
    assert "the shadow at 15:00 covers" in printed
    assert "study.nc, hours.png, profile.png" in printed
    assert "report.html" in printed
    said = [one.text for one in outputs if one.get("name") == "stderr"]
    assert not "".join(said).replace(f"umbra: {FIRST_RUN}\n", ""), printed
