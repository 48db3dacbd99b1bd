"""Commands that take the land far away."""

import pytest


@pytest.mark.parametrize("command", ["render", "sky"])
def test_commands_say_what_hides_the_sun(umbra_here, tmp_path, command):
    """A picture at a time behind the land is refused, in a line; a place's spells begin there."""
    model = tmp_path / "house.obj"
    model.write_text("v 0 0 0\nv 4 0 0\nv 0 4 3\nf 1 2 3\n")
    land = tmp_path / "ring.csv"
    land.write_text("azimuth,elevation\n" + "".join(f"{45 * k},12\n" for k in range(8)))
    where = ["--lat", "48.2", "--lon", "16.37", "--date", "2026-03-21", "--horizon", land]
    if command == "sky":
        told = umbra_here("sky", model, "--at", "20,-20,0", "--json", *where)
        assert '"out_of": "land"' in told.out
        return
    picture = ["--out", tmp_path / "a.png", "--size", "64x48", "--style", "plain"]
    dark = umbra_here("render", model, "--at", "06:45", *where, *picture)
    assert dark.status == 2
    assert len(dark.err.strip().splitlines()) == 1
    assert umbra_here("render", model, "--at", "12:00", *where, *picture).status == 0
    alone = umbra_here("render", model, "--horizon", land, *picture)
    assert alone.status == 2


def test_a_view_reads_it_and_needs_the_place(umbra_here, tmp_path):
    model = tmp_path / "house.obj"
    model.write_text("v 0 0 0\nv 4 0 0\nv 0 4 3\nf 1 2 3\n")
    land = tmp_path / "ring.csv"
    land.write_text("azimuth,elevation\n" + "".join(f"{45 * k},12\n" for k in range(8)))
    asked = ["view", model, "--out", tmp_path / "p.html", "--horizon"]
    nowhere = umbra_here(*asked, land)
    assert (nowhere.status, len(nowhere.err.strip().splitlines())) == (2, 1)
    where = ["--lat", "48.2", "--lon", "16.37"]
    assert umbra_here(*asked, land, *where).status == 0
    assert "up to 12.0° high, hides the sun" in (tmp_path / "p.html").read_text()
    for wrong in (["none.csv"], [land, "--horizon-from", "3km"], [model]):
        refused = umbra_here(*asked, *wrong, *where)
        assert (refused.status, len(refused.err.strip().splitlines())) == (2, 1)
