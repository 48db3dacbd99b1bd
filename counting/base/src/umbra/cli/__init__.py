"""The command line: it parses and prints, and calls other packages for the work."""

import os

# Before numpy loads: its products are of many short rows, and BLAS would wake threads for each.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from umbra.cli.main import main

__all__ = ["main"]
