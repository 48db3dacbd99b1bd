"""Wallner's tables: that ways agree, what they say, and models of one's own."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from support.bench import once, run_quick

from umbra.volume.adjacency import make_caster
from umbra_benchmarks import wallner
from umbra_benchmarks.command import command
from umbra_benchmarks.towers import make_lattice_tower, make_office_tower
from umbra_benchmarks.wallner_pictures import draw_figure_5, draw_figure_6


def run(*arguments):
    return run_quick("wallner", *arguments, "--repeat", "1")


def write_boxes(path, boxes):
    lines = []
    for k in range(boxes):
        lines.append(f"g box{k}")
        lines += [
            f"v {3 * k + x} {y} {z}"
            for z in (0, 2 + k)
            for x, y in ((0, 0), (2, 0), (2, 2), (0, 2))
        ]
        faces = ("4 3 2 1", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8")
        lines += [
            "f " + " ".join(str(int(corner) + 8 * k) for corner in face.split()) for face in faces
        ]
    path.write_text("\n".join(lines))


@pytest.mark.usefixtures("opengl")
def test_figures_5_and_6_show_shadows_volumes_and_profile():
    for draw in (draw_figure_5, draw_figure_6):
        drawn = np.asarray(draw((96, 72))).astype(int).reshape(72, 3, 96, 3)
        shadows, volumes, profile = drawn.transpose(1, 0, 2, 3)
        warmer = (volumes[..., 0] - volumes[..., 2]) > (shadows[..., 0] - shadows[..., 2]) + 20
        assert warmer.mean() > 0.02
        levels = np.unique(profile[..., 0])
        assert len(levels) >= 7  # of 7 and 9 suns
        assert (profile[..., 0] > 240).mean() > 0.4


def test_the_tables_say_what_was_found(monkeypatch):
    monkeypatch.setattr(wallner, "bench_wallner", once(wallner.bench_wallner))
    result = run("--json")
    assert "--model FILE" in result.stderr
    found = json.loads(result.stdout)
    assert (found["benchmark"], found["quick"], found["suns"]) == ("wallner", True, 3)
    tower, town = found["rows"]
    assert tower["faces"] == 11_148
    assert tower["paper"]["scene"] == "Eiffel Tower"
    assert tower["paper"]["brute_to_hextree"] == pytest.approx(4.584 / 4.236)
    assert town["faces"] == 13_584
    assert town["paper"]["faces"] == 13_585
    for row in found["rows"]:
        assert row["edges"] == 1.5 * row["faces"]
        assert row["disagreements"] == 0
        assert 0 < row["silhouette_edges"] <= min(row["tested_edges"].values())
        assert max(row["tested_edges"].values()) < 1.01 * row["edges"]
        assert set(row["ms"]) == {"as printed", "brute", "hextree", "hough", "tree", "64 at once"}
        for tree in ("hextree", "tree"):
            assert row["brute_to"][tree] == pytest.approx(
                row["min_ms"]["brute"] / row["min_ms"][tree]
            )
            assert row["bytes"][tree] > 32 * row["edges"]
            assert row["build_ms"][tree] > 0
    text = run().stdout
    assert "Industry Area: 13,585, 7.299, 5.799" in text
    assert "0 edges differ from brute force" in text
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert len(tables) == 2 * (2 + 2)


def test_a_city_of_ones_own_stands_for_the_papers(tmp_path, monkeypatch):
    write_boxes(tmp_path / "boxes.obj", 5)
    monkeypatch.setattr(wallner, "AREA", wallner.AREA._replace(faces=40))
    result = run("--json", "--model", str(tmp_path / "boxes.obj"))
    assert "--model" not in result.stderr
    rows = json.loads(result.stdout)["rows"]
    assert [row["scene"] for row in rows[1:]] == ["some of boxes.obj", "boxes.obj"]
    assert [row["faces"] for row in rows[1:]] == [36, 60]  # whole parts, of 12 triangles each
    assert rows[1]["paper"]["faces"] == 40
    assert rows[2]["paper"] is None


def test_disagreements_are_told(monkeypatch):
    monkeypatch.setattr(wallner, "_ask_as_printed", lambda *_: 0)
    rows = json.loads(run("--json").stdout)["rows"]
    for row in rows:
        assert row["disagreements"] == pytest.approx(3 * row["silhouette_edges"])


def test_models_are_for_wallner_and_must_exist(tmp_path):
    refused = CliRunner().invoke(command, ["weng", "--model", __file__])
    assert refused.exit_code == 2
    assert "--model is for walls, wallner and all" in refused.output
    missing = CliRunner().invoke(command, ["wallner", "--model", str(tmp_path / "none.obj")])
    assert missing.exit_code == 2
    assert "none.obj" in missing.output


@pytest.mark.parametrize("which", ["lattice", "shell", "whole"])
def test_towers_are_closed_and_wound_outward(which):
    model = make_lattice_tower() if which == "lattice" else getattr(make_office_tower(), which)
    caster = make_caster(model.vertices, model.faces)
    assert len(caster.faces) == {"lattice": 11_148, "shell": 147_084, "whole": 181_860}[which]
    assert caster.is_closed.all()
    a, b, c = (caster.vertices[caster.faces[:, k]] for k in range(3))
    place = caster.vertices[np.zeros(1, int)]
    volumes = np.bincount(
        caster.component, np.einsum("ij,ij->i", a - place, np.cross(b - place, c - place)) / 6
    )
    assert volumes.min() > 0
    assert (model.vertices[:, :2].min(0) > 0).all()
    assert (model.vertices[:, :2].max(0) < model.side).all()
