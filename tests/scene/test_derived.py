"""What is made of a record once, and kept with it."""

import gc
import threading
import weakref
from dataclasses import dataclass, replace

import numpy as np
from support.shapes import box

import umbra
from umbra.casters.casting import prepare_casting
from umbra.scene.derived import derive

SITE = umbra.Site(48.2, 16.37, "Europe/Vienna")
SMALL = {"every": "1h", "extent": (-5, -5, 5, 5), "cell": 0.25}


@dataclass(frozen=True, eq=False)
class Owner:
    number: int = 0


def test_it_is_made_once_for_each_key_and_the_oldest_go():
    owner, made = Owner(), []

    def ask(key):
        return derive(owner, "thing", key, lambda: made.append(key) or [key])

    assert ask(1) is ask(1)
    first = ask(1)
    ask(2)
    assert ask(1) is first
    ask(3)  # 2 was asked for longest ago
    assert ask(1) is first
    ask(2)
    assert made == [1, 2, 3, 2]
    assert derive(owner, "other", 1, lambda: "mine") == "mine"
    assert derive(replace(owner), "thing", 1, lambda: "new") == "new"


def test_it_goes_with_its_owner():
    owner = Owner()
    thing = derive(owner, "thing", None, Owner)
    gone = weakref.ref(thing)
    del owner, thing
    gc.collect()
    assert gone() is None


def test_threads_share_one():
    owner, found = Owner(), []
    barrier = threading.Barrier(8)

    def ask():
        barrier.wait()
        found.append(derive(owner, "thing", None, object))

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({id(one) for one in found}) == 1


def make_town():
    rng = np.random.default_rng(3)
    parts = []
    for n in range(12):
        x, y = rng.uniform(-5, 4, 2)
        low, high = (x, y, -1), (x + rng.uniform(0.3, 1), y + 1, rng.uniform(1, 4))
        parts.append(umbra.Part(f"house {n}", "", umbra.Mesh(*box(low, high))))
    return umbra.make_scene(parts)


def test_a_second_study_is_that_of_a_scene_never_studied():
    scene = make_town()
    for receivers in ("ground", "top"):
        for options in ({}, {"no_cast": "house 1"}, {}, {"ground": 0.5}, {"cast": ["house 1*"]}):
            for date in ("2026-03-21", "2026-06-21"):
                given = {**SMALL, "date": date, "receivers": receivers, "ground": 0.0, **options}
                again = umbra.shadow_study(scene, SITE, **given)
                fresh = umbra.shadow_study(make_town(), SITE, **given)
                np.testing.assert_array_equal(again.shadow_hours, fresh.shadow_hours)
                np.testing.assert_array_equal(again.receiver_z, fresh.receiver_z)


def test_studies_at_once_give_what_they_give_one_by_one():
    scene, dates = make_town(), [f"2026-0{month}-21" for month in range(3, 9)]
    given = {**SMALL, "receivers": "ground", "ground": 0.0, "threads": 1}
    found = {}

    def study(date):
        found[date] = umbra.shadow_study(scene, SITE, date=date, **given).result.shadow_hours

    threads = [threading.Thread(target=study, args=(date,)) for date in dates]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for date in dates:
        alone = umbra.shadow_study(make_town(), SITE, date=date, **given)
        np.testing.assert_array_equal(found[date], alone.result.shadow_hours)


def test_casters_are_made_once_for_a_choice_of_parts():
    scene = make_town()
    one, two = (prepare_casting(scene, range(12), 1) for _ in range(2))
    assert one.caster is two.caster
    assert one.tree is two.tree
    assert one.soup is two.soup
    assert prepare_casting(scene, [1, 2], 1).caster is not one.caster
