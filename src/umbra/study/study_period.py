"""The suns of a study's dates, which need a place."""

from dataclasses import replace

from umbra.errors import InputError
from umbra.lights import Period, make_no_period, make_period
from umbra.study.options import StudyOptions
from umbra.sun import Site

__all__ = ["ask_for_site", "find_period"]


def find_period(options: StudyOptions, site: Site | None) -> Period:
    """
    Return the suns of a study's dates; none where it has no date.

    Raises
    ------
    InputError
        If a date or a time is wrong, or there is no site.
    """
    if options.date is None:
        return replace(make_no_period(site), horizon=options.horizon)
    if site is None:
        raise ask_for_site()
    period = make_period(
        options.date, options.start, options.end, options.every, site,
        every_days=options.every_days, refraction=options.refraction, clock=options.clock,
    )  # fmt: skip
    return replace(period, horizon=options.horizon)


def ask_for_site() -> InputError:
    """Return the error of a study of the sun that has no place."""
    msg = "a study of the sun needs a place; give latitude and longitude with site="
    return InputError(msg, option="latitude")
