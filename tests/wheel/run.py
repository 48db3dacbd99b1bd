"""
The wheel as its users get it: all files in it, installed alone, and the numbers of the clone.

    python tests/wheel/run.py out/dist out/wheel

Takes the one wheel in the first folder and makes the second anew. Installing into a new virtual
environment finds what an editable installation hides: a file that is not packed, a package that
only the tests' environment has, a path that leads out of the package.
"""

import shutil
import subprocess
import sys
import venv
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import xarray as xr

ROOT = Path(__file__).parents[2]
STUDY = (
    "--date", "2026-03-21", "--from", "09:00", "--to", "17:00", "--every", "1h",
    "--extent", "2545,340005,2895,340245", "--cell", "1", "--report",
)  # fmt: skip
FILES = {"study.nc", "hours.png", "profile.png", "report.html", "study.toml"}


def find_packed(wheel):
    """Return the names of umbra's files in a wheel."""
    with ZipFile(wheel) as archive:
        return {name for name in archive.namelist() if name.startswith("umbra/")}


def find_sources():
    """Return the names of umbra's files in the clone."""
    return {
        path.relative_to(ROOT / "src").as_posix()
        for path in (ROOT / "src/umbra").rglob("*")
        if path.is_file() and path.parent.name != "__pycache__"
    }


def run(*command, folder):
    """Run a command elsewhere than in the clone; return what it printed."""
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if ended.returncode:
        sys.exit(f"{' '.join(map(str, command))}: status {ended.returncode}\n{ended.stderr}")
    return ended.stdout


def main():
    """Check the wheel; end with a line and status 1 where it falls short."""
    (wheel,) = Path(sys.argv[1]).resolve().glob("*.whl")
    folder = Path(sys.argv[2]).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)

    differ = find_packed(wheel) ^ find_sources()
    if differ:
        sys.exit(f"{wheel.name}: {len(differ)} files only there or only in src: {sorted(differ)}")

    venv.create(folder / "venv", with_pip=True)
    programs = folder / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    # Only the modules that are used are compiled, at their import.
    install = ("-m", "pip", "install", "--quiet", "--no-compile", wheel)
    run(programs / "python", *install, folder=folder)
    version = run(programs / "umbra", "--version", folder=folder).split()[-1]
    if version not in wheel.name.split("-"):
        sys.exit(f"{wheel.name}: umbra --version prints {version}")

    run(sys.executable, ROOT / "examples/city_block.py", folder / "block.city.json", folder=folder)
    for name, umbra in (
        ("installed", programs / "umbra"),
        ("clone", Path(sys.executable).with_name("umbra")),
    ):
        run(umbra, "study", "block.city.json", *STUDY, "--out", name, folder=folder)
    written = {path.name for path in (folder / "installed").iterdir()}
    if not written >= FILES:
        sys.exit(f"the installed wheel did not write {sorted(FILES - written)}")
    installed, clone = (
        xr.load_dataset(folder / name / "study.nc", engine="h5netcdf")
        for name in ("installed", "clone")
    )
    for name in clone.variables:
        np.testing.assert_array_equal(installed[name], clone[name], err_msg=name)
    print(f"{wheel.name}: {len(find_sources())} files, version {version}, the clone's numbers")


if __name__ == "__main__":
    main()
