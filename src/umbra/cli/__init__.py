"""The command line: it parses and prints, and calls other packages for the work."""

import os
import signal
import threading

# Before numpy loads: its products are of many short rows, and BLAS would wake threads for each.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# While modules load, Ctrl-C ends the process at once, without the stack of what was loading.
_is_deaf = (
    threading.current_thread() is threading.main_thread()
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
)
if _is_deaf:
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from umbra.cli.main import main  # noqa: E402  (see above)

if _is_deaf:
    signal.signal(signal.SIGINT, signal.default_int_handler)

__all__ = ["main"]
