"""OpenCL devices, and which of them to use."""

from __future__ import annotations

import dataclasses
from typing import Sequence, Union

from . import _c
from ._errors import UsageError
from ._library import Handle, ask, check, check_process, count, lib, text, warn, warnings_of

_TYPES = {_c.CASTOR_DEVICE_TYPE_CPU: "cpu", _c.CASTOR_DEVICE_TYPE_GPU: "gpu",
          _c.CASTOR_DEVICE_TYPE_ACCELERATOR: "accelerator", _c.CASTOR_DEVICE_TYPE_OTHER: "other"}


@dataclasses.dataclass(frozen=True)
class Device:
    """An OpenCL device as its driver describes it, or an equal part of one."""

    index: int  #: its number among all devices
    name: str
    type: str  #: "cpu", "gpu", "accelerator" or "other"
    vendor: str
    platform: str
    driver_version: str
    compute_units: int
    global_memory_bytes: int
    max_allocation_bytes: int
    unified_memory: bool  #: it shares the host's memory
    part: int  #: of a device that was split: which part, from 1 on
    part_count: int  #: of how many; 1: it was not split


#: What selects devices: the words of castor.devices, a device of its list, or several.
Devices = Union[str, Device, Sequence[Device], None]


def devices(selection: str | None = None) -> list[Device]:
    """All OpenCL devices, or those of a selection.

    A selection is a list with commas of "all", "cpu", "gpu", "accelerator", numbers, and parts of names; "/N" after one
    of these splits each such device into N parts. "" is the first GPU, else the first device. Without any device the
    list is empty, but a selection raises DeviceError, which names what to install; UsageError where a word names none.
    Drivers that cannot be asked are left out, with a warning.
    """
    if selection is None:
        check_process()
        handle = Handle("devices")
        check(lib.castor_devices_list(handle.out()))
        warn(warnings_of("devices", handle))
    else:
        handle = select(selection)
    return [_describe(handle, i) for i in range(count("castor_devices_get_count", handle))]


def select(selection: Devices) -> Handle:
    """The library's list of the devices that are selected."""
    check_process()
    if isinstance(selection, Device):
        selection = [selection]
    if selection is not None and not isinstance(selection, str):
        try:
            selection = ",".join(_word(device) for device in selection)
        except (AttributeError, TypeError) as error:
            raise UsageError(f"devices: found {selection!r}, expected a string such as \"all\", a castor.Device, or "
                             "several") from error
    handle = Handle("devices")
    check(lib.castor_devices_select(None if selection is None else selection.encode(), handle.out()))
    return handle


def _word(device: Device) -> str:
    if device.part_count != 1:
        raise UsageError(f"devices: found part {device.part} of {device.name}: a split device is selected as a whole, "
                         f"by \"{device.index}/{device.part_count}\"")
    return str(device.index)


def _describe(handle: Handle, i: int) -> Device:
    info = ask("castor_devices_get_info", "castor_device_info", handle.value, i)
    return Device(int(info.index), text(info.name), _TYPES[info.type], text(info.vendor), text(info.platform_name),
                  text(info.driver_version), int(info.compute_units), int(info.global_memory_bytes),
                  int(info.max_allocation_bytes), bool(info.unified_memory), int(info.part), int(info.part_count))
