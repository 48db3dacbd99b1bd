"""Scenes of boxes whose shadows are solved by hand, and verdicts on them."""

import numpy as np
from shapely.geometry import box as rectangle
from support.shapes import box

from umbra.rules import read_rule
from umbra.scene import Mesh, Part, make_scene
from umbra.study.options import StudyOptions
from umbra.sun import Site, find_sun, make_steps
from umbra.verdicts import Gathered, Model, judge_rules
from umbra.verdicts.subjects import of_points

LONDON = Site(51.5, -0.12, "Europe/London")
SOUTH = (0.0, -1.0, 0.0)


class Judged(Gathered):
    """Receivers given as samples, besides those that are laid out."""

    def __init__(self, model, given=(), **more):
        super().__init__(model, **more)
        self.given = {one.kind: one for one in given}

    def _find_kind(self, kind, requirement):
        if kind in self.given:
            return self._keep(kind, lambda: self.given[kind])
        return super()._find_kind(kind, requirement)


def make_model(boxes, site=LONDON, proposed=(), year=2026, **options):
    """Return a model of boxes by name, each two corners."""
    parts = [Part(name, "", Mesh(*box(*corners))) for name, corners in boxes.items()]
    asked = StudyOptions(date=f"{year}-03-21", ground=0.0, **options)
    return Model(scene=make_scene(parts), site=site, year=year, options=asked, proposed=proposed)


def judge(model, rule, given=(), **more):
    """Return the verdict on one rule."""
    gathered = Judged(model, given, **more)
    return judge_rules(gathered, [rule if isinstance(rule, list) else read_rule(rule)])[0]


def windows(points, normal=SOUTH, **more):
    """Return windows at points, each a sample."""
    names = [f"w{k + 1}" for k in range(len(points))]
    azimuth = np.degrees(np.arctan2(normal[0], normal[1])) % 360
    return of_points("windows", names, points, [normal] * len(points),
                     azimuths=np.full(len(points), azimuth), **more)  # fmt: skip


def find_lit(boxes, point, directions, normal=None):
    """Return at which directions toward the sun a point is lit, by rays against boxes."""
    lit = np.ones(len(directions), bool) if normal is None else directions @ normal > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in boxes:
            a = (np.asarray(low, float) - point) / directions
            b = (np.asarray(high, float) - point) / directions
            enters, leaves = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
            lit &= ~((leaves > np.maximum(enters, 0.0) + 1e-12) & (leaves > 1e-9))
    return lit


def find_suns(site, date, start, end, every):
    """Return midpoints' sun directions that are up, their lengths [h], altitudes and instants."""
    steps = make_steps(date, start, end, every, site.zone)
    sun = find_sun(site, steps.instants)
    up = sun.is_up
    return sun.direction[up], steps.hours[up], sun.altitude[up], steps.instants[up]


def hand_hours(boxes, point, site, date, start="00:00", end="24:00", every="5min", *,
               normal=None, altitude=0.0):  # fmt: skip
    """Return the hours of sun of a point."""
    directions, hours, altitudes, _ = find_suns(site, date, start, end, every)
    lit = find_lit(boxes.values(), np.asarray(point, float), directions, normal)
    return float(hours[lit & (altitudes >= altitude)].sum())


__all__ = ["LONDON", "SOUTH", "find_lit", "find_suns", "hand_hours", "judge", "make_model",
           "rectangle", "windows"]  # fmt: skip
