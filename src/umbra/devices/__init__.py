"""
Devices: where shadows are counted, one file each.

    device.py    what a device gives                CountingDevice, TileCounters, FrameCounts
    counters.py  the counters of a study's tiles, on the device that is asked for or the faster one
    cpu.py, gl.py

Importing this room loads no kernels and no OpenGL: a device does so when it first counts.
"""

from typing import get_args

from umbra.devices.cpu import CpuDevice
from umbra.devices.device import CountingDevice
from umbra.devices.gl import GlDevice
from umbra.errors import InputError
from umbra.machine import count_cores
from umbra.methods import DeviceName

__all__ = ["CHOICES", "DEFAULT", "DEVICES", "check_device", "find_device"]

DEVICES: dict[str, CountingDevice] = {device.name: device for device in (CpuDevice(), GlDevice())}
"""Every device by the name that options and results say."""
DEFAULT = "cpu"
CHOICES = get_args(DeviceName)
"""What may be asked for."""


def find_device(name: str) -> CountingDevice:
    """
    Return a device by its name; the default for ``auto``.

    Raises
    ------
    InputError
        If there is none of this name.
    """
    if name not in CHOICES:
        msg = f"device '{name}' is not one of {', '.join(CHOICES)}"
        raise InputError(msg, device=name)
    return DEVICES[DEFAULT if name == "auto" else name]


def check_device(name: str, threads: int | None) -> int:
    """
    Refuse devices that do not exist; return the number of threads.

    Parameters
    ----------
    name : str
        Of ``CHOICES``.
    threads : int, optional
        All cores by default.

    Raises
    ------
    InputError
        If there is no such device, or less than one thread.
    """
    find_device(name)
    threads = count_cores() if threads is None else threads
    if threads < 1:
        msg = f"threads must be at least 1; got {threads}"
        raise InputError(msg, threads=threads)
    return threads
