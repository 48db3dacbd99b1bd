"""Files of an earlier study that a later one does not replace are named, whoever wrote them."""

import warnings

import pytest
from support.shapes import box

import umbra
from umbra.writers import output_formats
from umbra.writers.folder import write

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")


def write_own(job):
    (job.folder / "own.txt").write_text(str(float(job.study.shadow_hours.sum())))
    return ["own.txt"]


@pytest.fixture
def study(monkeypatch):
    monkeypatch.setitem(output_formats.FORMATS, "own", output_formats.Format(write_own))
    monkeypatch.setattr(umbra.receivers.plan.PlanKind, "formats", ("own", "csv"))
    scene = umbra.make_scene(*box((-1, -1, 0), (1, 1, 3)), name="tower")
    return umbra.shadow_study(
        scene, SITE, date="2026-03-21", every="4h", extent=(-5, -5, 5, 5), cell=1
    )


def stale(study, folder, *names):
    """Give the words of the warnings about files of earlier studies."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        study.write(folder, *names, pictures=False)
    return " ".join(str(one.message) for one in caught if "earlier study" in str(one.message))


def test_a_file_of_ones_own_format_is_named_once_it_is_stale(study, tmp_path):
    assert stale(study, tmp_path, "own") == ""
    (tmp_path / "notes.txt").write_text("the office's own")
    # It is named as long as it lies there, and no file that umbra did not write.
    for _ in range(2):
        said = stale(study, tmp_path)
        assert "own.txt" in said
        assert "notes.txt" not in said
    assert stale(study, tmp_path, "own") == ""
    (tmp_path / "own.txt").unlink()
    assert stale(study, tmp_path) == ""


def test_usual_files_need_no_list(study, tmp_path):
    assert stale(study, tmp_path, "csv") == ""
    assert not (tmp_path / write.LISTING).exists()
    assert "cells.csv" in stale(study, tmp_path)


def test_a_list_that_is_damaged_or_a_link_is_not_followed(study, tmp_path):
    assert stale(study, tmp_path, "own") == ""
    listing = tmp_path / write.LISTING
    listing.write_bytes(b"\xff\x00../../etc/passwd\nown.txt\n")
    assert "own.txt" in stale(study, tmp_path)
    listing.unlink()
    secret = tmp_path / "secret"
    secret.write_text("notes.txt\n")
    (tmp_path / "notes.txt").write_text("")
    listing.symlink_to(secret)
    assert "notes.txt" not in stale(study, tmp_path, "own")
    assert secret.read_text() == "notes.txt\n"
