"""
Keep settings that lie in the current folder from turning what umbra does.

numba takes ``.numba_config.yaml`` from there (so a cache, which holds pickles, in a folder
of a stranger's choice), and matplotlib takes ``matplotlibrc``.
"""

import contextlib
import os
from importlib import import_module
from typing import Any

from umbra.children import HOME

__all__ = ["pass_over_settings"]


def pass_over_settings() -> None:
    """Import numba and matplotlib from another folder if the current one holds their settings."""
    if os.path.lexists(".numba_config.yaml"):
        with contextlib.chdir(HOME):
            config: Any = import_module("numba.core.config")
        config._config_fname = os.devnull  # it looks again whenever it compiles
    if os.path.lexists("matplotlibrc"):
        with contextlib.chdir(HOME):
            import_module("matplotlib")
