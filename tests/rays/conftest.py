"""Overflow, division by zero and invalid values are errors here."""

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _raise_on_float_errors():
    with np.errstate(divide="raise", over="raise", invalid="raise"):
        yield
