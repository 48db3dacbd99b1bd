"""The wing has its own door: nothing else of umbra goes through it."""

from pathlib import Path

import umbra
from umbra import realtime

SOURCE = Path(umbra.__file__).parent


def test_no_other_package_imports_the_wing():
    others = [p for p in SOURCE.rglob("*.py") if "realtime" not in p.relative_to(SOURCE).parts]
    assert [p for p in others if "umbra.realtime" in p.read_text(encoding="utf-8")] == []


def test_the_wing_imports_no_study():
    for file in (SOURCE / "realtime").glob("*.py"):
        text = file.read_text(encoding="utf-8")
        for package in ("study", "writers", "calls", "readers", "devices", "cpu", "window"):
            assert f"umbra.{package}" not in text, file


def test_public_names():
    assert {"Renderer", "ShadowVolumes"} <= set(realtime.__all__)
    assert all(hasattr(realtime, name) for name in realtime.__all__)
