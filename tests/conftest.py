"""What every test may count on."""

import signal

# A shell that runs the suite in the background has it ignore Ctrl-C, and so do its
# children; the tests of Ctrl-C need it heard, as in front of a terminal.
signal.signal(signal.SIGINT, signal.default_int_handler)
