"""What tests borrow from the package of the benchmarks; they skip where it is not installed."""

import pytest
from click.testing import CliRunner

REASON = "the benchmarks (umbra-benchmarks) are not installed"


def borrow(module):
    """Give a module of the benchmarks."""
    return pytest.importorskip(f"umbra_benchmarks.{module}", reason=REASON)


def run_quick(*arguments):
    """Run a benchmark at small sizes, once; return click's result."""
    result = CliRunner().invoke(borrow("command").command, [*arguments, "--quick"])
    assert result.exception is None, result.output
    return result
