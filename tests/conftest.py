"""What every test may count on."""

import signal

import pytest

# A shell that runs the suite in the background has it ignore Ctrl-C, and so do its
# children; the tests of Ctrl-C need it heard, as in front of a terminal.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True, scope="session")
def _cache_of_the_tests(tmp_path_factory):
    """Leave the user's own cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("UMBRA_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
