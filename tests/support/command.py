"""How the tests call the command line."""

import sys
from pathlib import Path

SCRIPT = Path(sys.executable).with_name("umbra")
VIENNA = ["--lat", "48.2", "--lon", "16.37"]
