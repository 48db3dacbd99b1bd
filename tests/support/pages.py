"""What a report's page shows, read back: words, places, pixels."""

import datetime as dt
import re
import zoneinfo

import numpy as np

RECT = (
    "(r => [r.left, r.top, r.width, r.height])"
    "(document.getElementById('map').getBoundingClientRect())"
)
INK = (
    "(([x, y]) => {{ const m = document.getElementById('map'), b = m.getBoundingClientRect();"
    "const d = m.getContext('2d').getImageData((x - b.left) / b.width * m.width,"
    "(y - b.top) / b.height * m.height, 1, 1).data; return [...d]; }})([{}, {}])"
)
AROUND = INK.replace("m.width,", "m.width - 1,").replace("m.height, 1, 1", "m.height - 1, 3, 3")
"""The inks of a pixel and its eight neighbours, row by row."""
READY = "document.documentElement.dataset.ready == 'yes'"

FIGURES = ("in-sun", "in-shadow", "first", "last", "spells", "longest")


def place_of(page, study, row, col):
    """Give where a cell is in the window."""
    page.ask("document.getElementById('map').scrollIntoView({block: 'center'})")
    box = page.ask(RECT)
    rows, cols = study.shadow_hours.shape
    return box[0] + (col + 0.5) / cols * box[2], box[1] + (rows - row - 0.5) / rows * box[3]


def words(page, *names):
    return [page.ask(f"document.getElementById('{name}').textContent") for name in names]


def say(hours):
    minutes = round(hours * 60)
    h, m = divmod(minutes, 60)
    return f"{m} min" if not h and m else f"{h} h" + (f" {m} min" if m else "")


def expect(study, *where):
    """Tell a receiver's day by the study's own masks, in the words of the page."""
    steps = study.period.steps[0]
    zone = zoneinfo.ZoneInfo(steps.zone)
    stamps = [t.replace(tzinfo=dt.UTC).astimezone(zone) for t in steps.stamps.tolist()]
    lit = study.sun.is_up & (np.asarray(study.masks)[:, *where] == 0)
    if "under_canopy" in study.more:
        lit &= np.asarray(study.more["under_canopy"][1])[:, *where] == 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lit, [0]])))
    spells = edges.reshape(-1, 2)
    lengths = [steps.hours[a:b].sum() for a, b in spells]
    clock = [when.strftime("%H:%M") for when in stamps]
    return [
        say(float(study.sun_hours[where])),
        say(float(study.shadow_hours[where])),
        clock[spells[0][0]] if len(spells) else "none",
        clock[spells[-1][1]] if len(spells) else "none",
        str(len(spells)),
        say(max(lengths)) if lengths else "none",
    ]


def find_sample(page, study):
    """Give the sample that is read, by its place in words; each place is some sample's."""
    said = words(page, "where")[0].replace("\u2212", "-")
    place = [float(v) for v in re.search(r"x (\S+), y (\S+), z (\S+) m", said).groups()]
    apart = np.abs(study.places.points - place).max(1)
    assert apart.min() < 0.006
    return int(apart.argmin()), said


def walk(page, count, seed=1):
    """Give places all over the picture."""
    page.ask("document.getElementById('map').scrollIntoView({block: 'center'})")
    left, top, wide, high = page.ask(RECT)
    spots = np.random.default_rng(seed).uniform((left, top), (left + wide, top + high), (count, 2))
    return np.floor(spots).tolist()


def read_at(page, study, spots):
    """Read many places; those where nothing is sampled show what is kept, and are left out."""
    page.mouse("mouseMoved", 5, 5)
    pinned = words(page, "where")[0]
    for x, y in spots:
        page.mouse("mouseMoved", x, y)
        if words(page, "where")[0] != pinned:
            yield x, y, *find_sample(page, study)
