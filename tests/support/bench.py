"""What tests borrow from the package of the benchmarks; they skip where it is not installed."""

import json
from functools import cache

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


def once(measure):
    """Measure at the first call, and give what was found then at each."""
    found = []

    def give(run):
        if not found:
            found.append(measure(run))
        return found[0]

    return give


@cache
def run_both(name, *arguments):
    """Run a benchmark once; return its JSON and its table, both of the same measurement."""
    module, function = borrow(name), f"bench_{name}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, function, once(getattr(module, function)))
        arguments = (name, *arguments, "--repeat", "1")
        return json.loads(run_quick(*arguments, "--json").stdout), run_quick(*arguments).stdout
