"""Verdicts of cited rules on what a study is of: its areas, windows, or points as windows."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from umbra.errors import InputError
from umbra.rules.record import Rule
from umbra.study.options import StudyOptions
from umbra.study.result import Study
from umbra.verdicts.judge import RuleVerdict, judge_rules
from umbra.verdicts.judged_receivers import Gathered, Lacking
from umbra.verdicts.subjects import of_points
from umbra.verdicts.sunlight import Model, SunlightOf

__all__ = ["judge_study"]


class _OfPoints(Gathered):
    """A study's points with normals, which are judged as windows."""

    study: Study

    def _find_kind(self, kind: str, requirement: Any) -> "SunlightOf | Lacking":
        if kind == "windows" and self.windows is None:
            return self._keep((kind, "points"), self._read_points)
        return super()._find_kind(kind, requirement)

    def _read_points(self) -> Any:
        places = self.study.places
        normals = np.array(places.normals)
        turn = np.degrees(np.arctan2(normals[:, 0], normals[:, 1])) - self.study.true_north
        given = self.study.more.get("name")
        names = [f"point {k + 1}" for k in range(len(normals))]
        if given is not None:
            names = [str(name) for name in given[1]]
        return of_points("windows", names, np.array(places.points), normals, azimuths=turn % 360)


def judge_study(study: Study, options: StudyOptions, rules: Sequence[Rule]) -> list[RuleVerdict]:
    """
    Judge a study's named receivers by a cited rule.

    Parameters
    ----------
    study : Study
    options : StudyOptions
        Of the study.
    rules : sequence of Rule
        The variants of a rule.

    Raises
    ------
    InputError
        If a rule is none, or the study has no site, which rules of the sun need.
    """
    if not all(isinstance(rule, Rule) for rule in rules):
        msg = "rules= is the name of a cited rule, a file, or what umbra.read_rule returns"
        raise InputError(msg, option="rules")
    if study.site is None:
        msg = "rules= of the sun need a place; give latitude and longitude with site="
        raise InputError(msg, option="rules")
    days = study.period.days
    model = Model(
        scene=study.model.scene, site=study.site, year=days[0].year if days else 2001,
        options=options, proposed=tuple(options.proposed),
    )  # fmt: skip
    given: dict[str, Any] = {
        name: getattr(options, name, None) for name in ("areas", "windows", "reveal")
    } | {"areas_on": options.areas_on}  # fmt: skip
    if study.kind.name == "points" and np.isfinite(study.places.normals).all():
        gathered: Gathered = _OfPoints(model, **given)
        gathered.study = study  # type: ignore[attr-defined]
    else:
        gathered = Gathered(model, **given)
    return judge_rules(gathered, [rules])
