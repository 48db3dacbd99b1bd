"""What a window needs before it opens."""

import pytest

from umbra.errors import InputError, UmbraError
from umbra.window import screen


@pytest.mark.parametrize("package", ["moderngl", "glfw", "imgui_bundle"])
def test_a_missing_package_names_the_extra(monkeypatch, package):
    monkeypatch.setattr(screen, "find_spec", lambda name: None if name == package else name)
    with pytest.raises(UmbraError, match=r"pip install .*\[view\]") as caught:
        screen.check_display("umbra render")
    assert package.replace("_", "-") in str(caught.value)


def test_a_display_is_asked_for_where_there_must_be_one(monkeypatch):
    monkeypatch.setattr(screen, "find_spec", lambda name: name)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(screen.sys, "platform", "linux")
    with pytest.raises(InputError, match=r"no display .* umbra render a\.glb"):
        screen.check_display("umbra render a.glb")
    monkeypatch.setattr(screen.sys, "platform", "darwin")
    screen.check_display("umbra render a.glb")
    monkeypatch.setattr(screen.sys, "platform", "linux")
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    screen.check_display("umbra render a.glb")
