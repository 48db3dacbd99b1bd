"""Dates by one, by range, by month and by year."""

import datetime as dt

import numpy as np
import pandas as pd
import pytest

from umbra.errors import InputError
from umbra.sun import parse_dates
from umbra.sun.date_words import tell_skipped


@pytest.mark.parametrize(
    ("words", "every", "count", "first", "last"),
    [
        ("2026-03-21", 1, 1, "2026-03-21", "2026-03-21"),
        (dt.date(2026, 3, 21), 1, 1, "2026-03-21", "2026-03-21"),
        (dt.datetime(2026, 3, 21), 1, 1, "2026-03-21", "2026-03-21"),
        (np.datetime64("2026-03-21"), 1, 1, "2026-03-21", "2026-03-21"),
        (np.datetime64("2026-03-21T00:00:00.000000000"), 1, 1, "2026-03-21", "2026-03-21"),
        (pd.Timestamp("2026-03-21"), 1, 1, "2026-03-21", "2026-03-21"),
        (pd.Timestamp("2026-03-21", tz="Europe/Vienna"), 1, 1, "2026-03-21", "2026-03-21"),
        (pd.date_range("2026-03-21", periods=3), 1, 3, "2026-03-21", "2026-03-23"),
        (pd.date_range("2026-03-21", periods=3).values, 1, 3, "2026-03-21", "2026-03-23"),
        (["2026-06-21", "2026-03-21"], 1, 2, "2026-03-21", "2026-06-21"),
        ("2026-06-21,2026-03-21, 2026-06-21", 1, 2, "2026-03-21", "2026-06-21"),
        ("2026-03-21..2026-09-23", 1, 187, "2026-03-21", "2026-09-23"),
        ("2026-03-21..2026-09-23", 7, 27, "2026-03-21", "2026-09-19"),
        ("2026", 1, 365, "2026-01-01", "2026-12-31"),
        ("2028", 1, 366, "2028-01-01", "2028-12-31"),
        ("2028-02", 1, 29, "2028-02-01", "2028-02-29"),
        ("2026-02..2026-03", 1, 59, "2026-02-01", "2026-03-31"),
        ("2026-*-21", 1, 12, "2026-01-21", "2026-12-21"),
        ("2026-*-30", 1, 11, "2026-01-30", "2026-12-30"),
    ],
)
def test_words_name_these_dates(words, every, count, first, last):
    days = parse_dates(words, every)
    assert len(days) == count
    assert (str(days[0]), str(days[-1])) == (first, last)
    assert list(days) == sorted(set(days))


@pytest.mark.parametrize(
    ("words", "every", "says"),
    [
        ("yesterday", 1, "is not a date"),
        ("2026-02-30", 1, "28 days"),
        ("2026-13", 1, "months go from 01 to 12"),
        ("2026-00", 1, "months go from 01 to 12"),
        ("1066", 1, "year"),
        ("2026-*-40", 1, "31 days"),
        ("2026-09-23..2026-03-21", 1, "ends before it begins"),
        ("2026-09-23..", 1, "is not a date"),
        ("", 1, "is not a date"),
        ([], 1, "no date"),
        ("2026", 0, "give 1 or more"),
    ],
)
def test_slips_are_told(words, every, says):
    with pytest.raises(InputError, match=says):
        parse_dates(words, every)


@pytest.mark.parametrize(
    ("words", "lost"),
    [("2026-*-31", 5), ("2026-*-30", 1), ("2024-*-29", 0), ("2026-*-28", 0), ("2026-02", 0)],
)
def test_months_without_such_a_day_are_named(words, lost):
    told = tell_skipped([dt.date(2026, 3, 21), f"2026-03-21, {words}"])
    assert sum(line.count(",") for line in told) == lost
    assert ("left out are February" in " ".join(told)) == (lost > 0)
