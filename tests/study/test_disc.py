"""Hours by the share of the sun's disc that is seen, and its contacts."""

import itertools

import numpy as np
import pytest
from support.shapes import box

import umbra
from umbra.errors import InputError
from umbra.rays.disc_marks import mark_cut_discs
from umbra.scene import Mesh, Part, make_scene

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")


@pytest.fixture(scope="module")
def scene():
    """A wall that ends in the south, and a mast before it."""
    boxes = {"wall": ((-900, -41, 0), (0, -40, 400)), "mast": ((8, -30, 0), (8.2, -29.8, 40))}
    return make_scene([Part(name, "", Mesh(*box(*corners))) for name, corners in boxes.items()])


def ask(scene, **options):
    given = {"date": "2026-03-21", "start": "08:00", "end": "16:00", "receivers": "ground",
             "ground": 0.0, "extent": (-10, -20, 10, 0), "cell": 4.0}  # fmt: skip
    return umbra.shadow_study(scene, SITE, **given | options).dataset


def test_hours_are_those_of_the_middle_but_for_the_rim(scene):
    disc, middle = ask(scene, disc=True, every="1min"), ask(scene, every="1min")
    assert float(np.abs(disc.sun_hours - middle.sun_hours).max()) < 0.1
    assert float(np.abs(disc.sun_hours - middle.sun_hours).max()) > 1e-4
    assert np.allclose(disc.sun_hours + disc.shadow_hours, 8, atol=1e-5)
    assert disc.attrs["sun_disc_deg"] == 0.2666


def test_contacts_are_the_radius_before_the_middle(scene):
    """The sun comes out behind an upright edge: its rim leads by the radius over its speed."""
    point = {"receivers": "points", "points": [[0.0, 0.0, 0.0]], "extent": None, "cell": None,
             "ground": None}  # fmt: skip
    no_mast = {**point, "no_cast": ["mast"]}
    disc = ask(scene, disc=True, **no_mast)
    exact = ask(scene, spells=True, exact=True, **no_mast)

    def seconds(value):
        return value.values.astype("datetime64[us]").astype(np.int64)[0] / 1e6

    gone = seconds(exact.last_sun)
    when = np.array([gone * 1e6], np.int64).view("datetime64[us]")
    one, two = (umbra.find_sun(SITE, when + np.timedelta64(60 * k, "s")) for k in (0, 1))
    # Across the upright edge's plane, in degrees a second.
    normal = np.array([1.0, 0.0, 0.0])
    speed = (
        abs(np.degrees(np.arcsin(two.direction[0] @ normal) - np.arcsin(one.direction[0] @ normal)))
        / 60
    )
    wanted = 0.2666 / speed
    assert seconds(disc.last_contact) - gone == pytest.approx(wanted, abs=3)
    assert disc.first_contact.values[0] == np.datetime64(
        "2026-03-21T07:00:00"
    )  # in the sun at once


def test_each_date_has_its_hours(scene):
    disc = ask(scene, disc=True, date=["2026-03-21", "2026-12-21"], every="30min")
    assert np.allclose(disc.shadow_hours_by_day.sum("day"), disc.shadow_hours, atol=1e-4)
    first, last = (
        ask(scene, disc=True, date=date, every="30min") for date in ("2026-03-21", "2026-12-21")
    )
    assert (disc.first_contact == first.first_contact).all()
    assert (disc.last_contact == last.last_contact).all()


def test_what_sees_no_sun_has_no_contact(scene):
    points = [[-30, -39.9, 1, 0, 1, 0], [4, 0, 0, 0, -1, 0]]
    disc = ask(scene, disc=True, every="30min", receivers="points", points=points, extent=None,
               cell=None, ground=None)  # fmt: skip
    assert np.isnat(disc.first_contact.values).tolist() == [True, False]
    assert np.isnat(disc.last_contact.values).tolist() == [True, False]
    assert disc.sun_hours.values[0] == 0


@pytest.mark.parametrize("other", [{"spells": True}, {"by": "part"}, {"exact": True}])
def test_what_is_of_the_middle_is_refused(scene, other):
    with pytest.raises(InputError) as caught:
        ask(scene, disc=True, **other)
    assert caught.value.option == "disc"


def test_the_rim_rises_before_the_middle_and_sets_after_it_whatever_the_step():
    field = make_scene([Part("post", "", Mesh(*box((500, 500, 0), (501, 501, 3))))])
    point = {"receivers": "points", "points": [[0.0, 0.0, 0.0]], "extent": None, "cell": None,
             "ground": None}  # fmt: skip
    found = [
        ask(field, disc=True, start="00:00", end="24:00", every=every, **point)
        for every in ("7min", "1h")
    ]
    for name in ("first_contact", "last_contact"):
        times = np.array([disc[name].values[0] for disc in found]).astype("datetime64[us]")
        assert np.ptp(times.astype(np.int64)) < 2_000_000
        # Some of the disc is up, and its middle is not.
        assert (umbra.find_sun(SITE, times).altitude > -0.2666).all()
        assert (umbra.find_sun(SITE, times).altitude < -0.2).all()


def test_contacts_lie_beside_the_steps_that_see_the_disc():
    """Behind slats the sun comes and goes: no contact is farther than the neighbour's middle."""
    slats = make_scene([
        Part(f"slat {k}", "", Mesh(*box((x, -8.1, 0), (x + 3, -8, 30))))
        for k, x in enumerate((-31, -23, -15.5, -9, -4, 0.7, 6, 12, 21))
    ])  # fmt: skip
    points = np.column_stack([np.linspace(-12, 12, 30), np.zeros(30), np.ones(30)]).tolist()
    point = {"receivers": "points", "points": points, "extent": None, "cell": None, "ground": None}
    hours = [f"{8 + k / 2:04.1f}" for k in range(17)]
    clock = [f"{one[:2]}:{'30' if one.endswith('5') else '00'}" for one in hours]
    steps = [
        ask(slats, disc=True, start=a, end=b, every="30min", **point).sun_hours.values
        for a, b in itertools.pairwise(clock)
    ]
    seen = np.array(steps) > 1e-4
    assert (np.diff(seen.astype(int), axis=0) != 0).sum(0).min() > 4
    whole = ask(slats, disc=True, every="30min", **point)
    begin, half = np.datetime64("2026-03-21T07:00:00", "us"), np.timedelta64(30, "m")
    middles = begin + half / 2 + half * np.arange(16)
    rows = np.flatnonzero(seen.any(0))
    assert len(rows) == 30
    first, last = seen.argmax(0), 15 - seen[::-1].argmax(0)
    before = np.append(begin, middles)[first]
    after = np.append(middles, begin + 16 * half)[last + 1]
    second = np.timedelta64(1, "s")
    begins, ends = (whole[name].values.astype("datetime64[us]") for name in
                    ("first_contact", "last_contact"))  # fmt: skip
    assert ((before - second <= begins) & (begins <= middles[first] + second)).all()
    assert ((middles[last] - second <= ends) & (ends <= after + second)).all()
    assert len(np.unique(begins)) > 10
    # To the bit whichever receivers are solved beside.
    turned = ask(slats, disc=True, every="30min", **point | {"points": points[::-2]})
    for name in ("first_contact", "last_contact"):
        assert np.array_equal(turned[name], whole[name][::-2])


@pytest.mark.parametrize("dark", [0, 1])
def test_a_date_without_sun_has_no_part_in_contacts(dark):
    """A roof hides June's high sun, not December's: its hours end the contacts, of either order."""
    roof = make_scene([Part("roof", "", Mesh(*box((-60, -12, 10), (60, 9, 10.2))))])
    dates = ["2025-12-21", "2026-06-21"] if dark else ["2026-06-21", "2026-12-21"]
    point = {"receivers": "points", "points": [[0.0, 0, 0]], "extent": None, "cell": None,
             "ground": None, "start": "10:00", "end": "14:00", "every": "1h"}  # fmt: skip
    june, winter = (ask(roof, disc=True, date=dates[k], **point) for k in (dark, 1 - dark))
    assert (float(june.sun_hours[0]), float(winter.sun_hours[0])) == (0, 4)
    both = ask(roof, disc=True, date=dates, **point)
    day = dates[1 - dark]
    for name, clock in (("first_contact", "09:00:00"), ("last_contact", "13:00:00")):
        assert both[name].values[0] == np.datetime64(f"{day}T{clock}")


@pytest.mark.parametrize("receivers", ["ground", "top", "surfaces", "points"])
def test_discs_told_by_their_middles_are_as_if_all_were_measured(scene, receivers, monkeypatch):
    """Hours and contacts to the bit, with suns at the horizon, in walls' planes and high."""
    houses = make_scene([
        *scene.parts,
        Part("house", "", Mesh(*box((-8, -18, 0), (-4, -12, 5)))),
        Part("its neighbour", "", Mesh(*box((-4, -16, 0), (0, -12, 8)))),
    ])  # fmt: skip
    points = np.random.default_rng(4).uniform((-10, -20, 0), (10, 0, 9), (60, 3)).tolist()
    given = {"receivers": receivers, "start": "00:00", "end": "24:00", "every": "40min"}
    if receivers == "surfaces":
        given |= {"extent": None, "cell": None, "ground": None, "on": ["*house", "its*"],
                  "spacing": 1.0}  # fmt: skip
    elif receivers == "points":
        given |= {"extent": None, "cell": None, "ground": None, "points": points}
    else:
        given |= {"cell": 0.5} | ({"ground": None} if receivers == "top" else {})
    told = ask(houses, disc=True, **given)
    judged = []
    real = mark_cut_discs

    def mark_all(*arguments):
        marks = real(*arguments)
        judged.append((~marks).mean())
        return np.ones_like(marks)

    monkeypatch.setattr("umbra.study.accumulators.disc.mark_cut_discs", mark_all)
    measured = ask(houses, disc=True, **given)
    assert np.mean(judged) > 0.6
    for name in ("sun_hours", "shadow_hours", "first_contact", "last_contact"):
        assert np.array_equal(told[name], measured[name], equal_nan=True)
    assert np.isfinite(told.sun_hours.values).mean() > 0.2
