"""Shadow studies: from a scene, a place and a day to hours of shadow."""

from umbra.study.compare import compare
from umbra.study.preview import Preview, make_preview
from umbra.study.result import Study
from umbra.study.study import run_study, shadow_study

__all__ = ["Preview", "Study", "compare", "make_preview", "run_study", "shadow_study"]
