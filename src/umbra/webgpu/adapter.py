"""The WebGPU device: an adapter that can count, or an error that names what it lacks."""

from functools import lru_cache
from importlib import resources
from typing import Any

from umbra.errors import UmbraError
from umbra.packages import need

__all__ = ["load_shader", "open_adapter"]

_FEATURES = {
    "depth32float-stencil8": "32 bits of depth with a stencil",
    "clip-distances": "clip distances",
    "float32-blendable": "sums of floats",
}
_LIMITS = "max-storage-buffer-binding-size", "max-buffer-size", "max-texture-dimension-2d"


@lru_cache(maxsize=1)
def open_adapter() -> Any:
    """
    Open the fastest adapter, once; return the wgpu device.

    Raises
    ------
    UmbraError
        If wgpu is not installed, there is no adapter, or none that can count.
    """
    wgpu = need("wgpu", "wgpu", "device='wgpu'")
    advice = "install a Vulkan driver (Debian: mesa-vulkan-drivers), or use device='gl' or 'cpu'"
    try:
        adapter = wgpu.gpu.request_adapter_sync(power_preference="high-performance")
    except RuntimeError as error:
        msg = f"WebGPU finds no graphics adapter ({str(error).splitlines()[0]}); {advice}"
        raise UmbraError(msg, option="device") from None
    lacking = [words for name, words in _FEATURES.items() if name not in adapter.features]
    if lacking:
        name = adapter.info["device"]
        msg = f"WebGPU's adapter {name} lacks {', '.join(lacking)}; {advice}"
        raise UmbraError(msg, option="device")
    limits = {name: adapter.limits[name] for name in _LIMITS}
    return adapter.request_device_sync(required_features=list(_FEATURES), required_limits=limits)


@lru_cache
def load_shader(name: str) -> str:
    """Read a file of ``shaders/``."""
    return (resources.files("umbra.webgpu") / "shaders" / name).read_text("utf-8")
