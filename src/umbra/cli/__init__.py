"""The command line: it parses and prints, and calls other packages for the work."""

from umbra.cli.main import main

__all__ = ["main"]
