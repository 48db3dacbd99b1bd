"""Shadow studies: from a scene, a place and a day to hours of shadow."""

from umbra.study.study import Study, run_study, shadow_study

__all__ = ["Study", "run_study", "shadow_study"]
