"""The command line: it parses and prints; all else is done by the rooms it calls."""

from umbra.cli.main import main

__all__ = ["main"]
