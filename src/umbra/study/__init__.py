"""Shadow studies: from a scene, a place and a day to hours of shadow."""

from umbra.study.by_date import split_dates, tell_dates
from umbra.study.compare import compare
from umbra.study.finer import FinerHours, count_finer
from umbra.study.point_table import read_points
from umbra.study.points import PointStudy, run_point_study
from umbra.study.preview import Preview, make_preview
from umbra.study.result import Study
from umbra.study.study import run_study, shadow_study

__all__ = [
    "FinerHours",
    "PointStudy",
    "Preview",
    "Study",
    "compare",
    "count_finer",
    "make_preview",
    "read_points",
    "run_point_study",
    "run_study",
    "shadow_study",
    "split_dates",
    "tell_dates",
]
