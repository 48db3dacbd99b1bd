"""A proposal that lies outside a plan in tiles is told, as in one piece."""

import pytest

import umbra

CUBE = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"


def write_cube(path, x):
    corners = [(x + a, b, c) for a in (0, 5) for b in (0, 5) for c in (0, 5)]
    path.write_text("".join("v {} {} {}\n".format(*corner) for corner in corners) + CUBE)


@pytest.mark.parametrize(("east", "is_told"), [(20, True), (120, False)])
def test_a_proposal_outside_the_plan_is_told(tmp_path, east, is_told):
    old, new = tmp_path / "old.obj", tmp_path / "new.obj"
    write_cube(old, 0)
    write_cube(new, 100)
    city = umbra.city_study(
        [old, new], umbra.Site(48.2, 16.4, "Europe/Vienna"), out=tmp_path / "out",
        date="2026-03-21", every="4h", cell=2.0, receivers="ground", proposed=["new*"],
        extent=(-10, -10, east, 20), tiles="50m", reading={"up": "z"},
    )  # fmt: skip
    told = [note for note in city.notes if "80 m outside" in note]
    assert len(told) == is_told
