"""``python -m umbra``: the command line, where the ``umbra`` script is not on the path."""

from umbra.cli import main

main()
