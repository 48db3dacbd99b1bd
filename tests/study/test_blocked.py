"""The share of the open sky that each group of casters takes, by directions and exactly."""

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.scene import Mesh, Part, make_scene

NAMES = ["fence", "house", "tower"]


@pytest.fixture(scope="module")
def yard():
    """A fence before a tower, and a house behind the yard; the fence ends in the house's wall."""
    boxes = {
        "fence": ((-6, 6, 0), (20, 6.2, 3)),
        "house": ((-12, -8, 0), (-6, 9, 6)),
        "tower": ((2, 9, 0), (7, 15, 20)),
    }
    return make_scene(
        [Part(name, "stone" if name != "house" else "brick", Mesh(*box(*corners)))
         for name, corners in boxes.items()]
    )  # fmt: skip


def ask(scene, measure=("sky_blocked_by", "sky_component"), **options):
    options = {"receivers": "ground", "ground": 0.0, "sky_directions": 400, **options}
    if options["receivers"] in {"ground", "top"}:
        options = {"extent": (-5, -5, 15, 5), "cell": 2.0, **options}
    return umbra.shadow_study(scene, measure=list(measure), **options).dataset


@pytest.fixture(scope="module")
def exact(yard):
    return ask(yard, by="part", exact=True)


def test_shares_and_the_free_sky_are_the_whole(yard, exact):
    for data, error in ((ask(yard, by="part"), 1e-4), (exact, 1e-9)):
        assert list(data.caster.values) == NAMES
        whole = data.sky_blocked_by.sum("caster") + data.sky_component  # of a level open plane
        assert np.abs(whole.values - 100).max() < error
        assert np.abs(data.sky_blocked_by.sum("caster") - data.sky_blocked).max() < 1e-9
        assert data.sky_blocked_by.units == "%"
        assert (data.sky_blocked_by.max(("y", "x")) > 3).all()


def test_directions_come_near_the_exact_shares(yard, exact):
    many = ask(yard, by="part", sky_directions=20000)
    assert float(np.abs(many.sky_blocked_by - exact.sky_blocked_by).max()) < 0.15


def test_the_near_wall_takes_what_both_hide():
    """Endless walls seen at 20 and 40 degrees: what is lower than 20 is the near one's alone."""

    def wall(at, degrees):
        top = at * np.tan(np.radians(degrees))
        return Mesh(*box((at, -1e5, 0), (at + 1, 1e5, top)))

    def component(degrees):
        t = np.radians(degrees)
        return 300 / (7 * np.pi) * ((np.pi / 2) * (1 - np.sin(t)) + 4 / 3 * np.cos(t) ** 2)

    scene = make_scene([Part("far", "", wall(50.0, 40)), Part("near", "", wall(10.0, 20))])
    whole = component(0)
    wanted = {
        "near": 100 * (whole - component(20)) / whole,
        "far": 100 * (component(20) - component(40)) / whole,
    }
    for how, error in (({"exact": True}, 1e-2), ({"sky_directions": 4096}, 0.5)):
        data = ask(
            scene, ["sky_blocked_by"], receivers="points", points=[[0, 0, 0, 1, 0, 0]], by="part",
            ground=None, **how,
        )  # fmt: skip
        for name, share in wanted.items():
            got = float(data.sky_blocked_by.sel(caster=name)[0])
            assert got == pytest.approx(share, abs=error), (name, how)


@pytest.mark.parametrize("receivers", ["surfaces", "top", "215/35"])
def test_every_kind_of_receivers_adds_up(yard, receivers):
    given = {
        "surfaces": {"spacing": 3.0},
        "top": {"cell": 3.0},
        "215/35": {"cell": 3.0},
    }[receivers]
    data = ask(yard, by="kind", receivers=receivers, **given)
    assert list(data.caster.values) == ["stone", "brick"]
    left = 100 - data.sky_blocked_by.sum("caster")
    if receivers == "surfaces":
        upright = np.abs(data.normal.values[:, 2]) < 1e-9
        free = data.sky_component.values[upright]
        # An open wall has 39.6 %, which 400 directions miss by a little at each azimuth.
        assert np.abs(left.values[upright] * 0.396 - free).max() < 0.3
        assert upright.sum() > 100
    known = np.isfinite(data.sky_blocked.values)
    assert known.any()
    assert np.abs((left + data.sky_blocked).values[known] - 100).max() < 1e-9


def test_groups_may_overlap_and_leave_others_out(yard, exact):
    data = ask(yard, who=["stone", "tower"], exact=True)
    assert list(data.caster.values) == ["stone", "tower"]
    of = {name: exact.sky_blocked_by.sel(caster=name).values for name in NAMES}
    assert np.abs(data.sky_blocked_by[0] - (of["fence"] + of["tower"])).max() < 1e-9
    assert np.abs(data.sky_blocked_by[1] - of["tower"]).max() < 1e-9
    assert np.abs(data.sky_blocked - sum(of.values())).max() < 1e-9


@pytest.mark.parametrize("how", [{"exact": True}, {}])
def test_before_and_after_a_proposal(yard, how):
    data = ask(yard, ["sky_blocked_by"], by="part", proposed=["fence"], **how)
    without = ask(yard, ["sky_blocked_by"], by="part", no_cast=["fence"], **how)
    fence = data.sky_blocked_by_before.sel(caster="fence")
    assert float(fence.max()) == 0
    for name in ("house", "tower"):
        before = data.sky_blocked_by_before.sel(caster=name)
        assert np.abs(before - without.sky_blocked_by.sel(caster=name)).max() < 1e-9
    lost = data.sky_blocked_by_lost.sel(caster="tower")  # the fence takes it
    assert float(lost.max()) > 1


def test_hours_by_part_share_the_casters(yard):
    site = umbra.Site(48.2, 16.37, "Europe/Vienna")
    study = umbra.shadow_study(
        yard, site, date="2026-03-21", every="2h", measure=["sun_hours", "sky_blocked_by"],
        by="part", receivers="ground", ground=0.0, extent=(-5, -5, 15, 5), cell=5.0,
        sky_directions=50,
    )  # fmt: skip
    data = study.dataset
    assert data.cast_hours.dims[0] == data.sky_blocked_by.dims[0] == "caster"
    assert list(data.caster.values) == NAMES


@pytest.mark.parametrize(
    ("given", "option"),
    [({}, "by"), ({"by": "part", "canopy": ["tower"]}, "canopy"), ({"who": ["shed"]}, "who")],
)
def test_what_cannot_be_told(yard, given, option):
    with pytest.raises(InputError) as caught:
        ask(yard, **given)
    assert caught.value.option == option


def test_maps_are_of_those_that_take_most(yard, tmp_path):
    study = umbra.shadow_study(
        yard, measure="sky_blocked_by", by="part", receivers="ground", ground=0.0,
        extent=(-5, -5, 15, 5), cell=5.0, sky_directions=50,
    )  # fmt: skip
    names = {path.name for path in study.write(tmp_path / "out")}
    assert {"sky_blocked.png", *(f"sky_blocked_by_{n}.png" for n in (1, 2, 3))} <= names


def test_what_is_0_everywhere_has_no_map(tmp_path):
    low = make_scene([Part("slab", "", Mesh(*box((0, 0, -3), (9, 9, -1))))])
    study = umbra.shadow_study(
        low, measure="sky_blocked_by,sky_component", by="part", receivers="ground", ground=0.0,
        extent=(-5, -5, 15, 5), cell=5.0, sky_directions=50,
    )  # fmt: skip
    names = {path.name for path in study.write(tmp_path / "out")}
    assert not any(name.startswith("sky_blocked") for name in names)
    assert "sky_component.png" in names
