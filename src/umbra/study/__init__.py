"""Shadow studies: hours of shadow from a scene, a site and dates."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from umbra.study.finer import FinerHours, count_finer
    from umbra.study.options import StudyOptions
    from umbra.study.preview import Preview, make_preview, refine_preview
    from umbra.study.result import Study, name_dates, split_dates, tell_dates
    from umbra.study.shadow_study import run, run_study
    from umbra.study.shown_samples import show_samples

_HOMES = {
    "FinerHours": "umbra.study.finer",
    "Preview": "umbra.study.preview",
    "Study": "umbra.study.result",
    "StudyOptions": "umbra.study.options",
    "count_finer": "umbra.study.finer",
    "make_preview": "umbra.study.preview",
    "refine_preview": "umbra.study.preview",
    "run": "umbra.study.shadow_study",
    "run_study": "umbra.study.shadow_study",
    "show_samples": "umbra.study.shown_samples",
    "split_dates": "umbra.study.result",
    "name_dates": "umbra.study.result",
    "tell_dates": "umbra.study.result",
}

__all__ = [
    "FinerHours",
    "Preview",
    "Study",
    "StudyOptions",
    "count_finer",
    "make_preview",
    "name_dates",
    "refine_preview",
    "run",
    "run_study",
    "show_samples",
    "split_dates",
    "tell_dates",
]


def __getattr__(name: str) -> object:
    """Load a name on first use: the command's help needs only the options."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    msg = f"module 'umbra.study' has no attribute {name!r}"
    raise AttributeError(msg)
