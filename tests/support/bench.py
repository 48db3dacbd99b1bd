"""What tests borrow from the package of the benchmarks; they skip where it is not installed."""

import pytest

REASON = "the benchmarks (umbra-benchmarks) are not installed"


def borrow(module):
    """Give a module of the benchmarks."""
    return pytest.importorskip(f"umbra_benchmarks.{module}", reason=REASON)
