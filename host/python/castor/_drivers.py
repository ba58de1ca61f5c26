"""Finds an OpenCL loader, and drivers that lie in wheels."""

from __future__ import annotations

import ctypes
import os
import pathlib
import re
import sys

SYSTEM_LIST = pathlib.Path("/etc/OpenCL/vendors")
# Wheels that hold a driver or what it needs, and the variables by which users choose their own drivers.
WHEELS = ("pocl-binary-distribution", "intel-opencl-rt", "tbb")
CHOICES = ("OCL_ICD_VENDORS", "OCL_ICD_FILENAMES", "OPENCL_VENDOR_PATH")
_WITHOUT_ROOT = "pip install intel-opencl-rt intel-cmplr-lib-rt (x86-64)"
# Programs without which a driver ends the process when it compiles a kernel.
_NEEDED_PROGRAMS = {"libpocl": ("ld", "gcc")}
_left_out: list[str] = []  # drivers of wheels, and why


def load_opencl(folder: pathlib.Path) -> None:
    """Loads the system's OpenCL loader, else the one that lies in this package's or another wheel, and offers it the
    drivers of wheels. libcastor_c then uses the loader that is there."""
    _offer_drivers()
    brought = [folder / "opencl/libOpenCL.so.1", *(path for path in _files() if path.name == "libOpenCL.so.1")]
    for loader in ["libOpenCL.so.1", *(str(path) for path in brought if path.exists())]:
        try:
            ctypes.CDLL(loader)
            return
        except OSError:
            continue
    raise ImportError("castor: found no OpenCL loader (libOpenCL.so.1): apt-get install ocl-icd-libopencl1 "
                      f"pocl-opencl-icd; or, without root: {_WITHOUT_ROOT}")


def advice() -> str:
    """What to add to an error of devices: nothing where drivers are listed."""
    if any(os.environ.get(name) for name in CHOICES) or _listed(SYSTEM_LIST):
        return ""
    return f"; or, without root: {_WITHOUT_ROOT}" + "".join(f"; {sentence}" for sentence in _left_out)


def _listed(folder: pathlib.Path) -> list[pathlib.Path]:
    return sorted(folder.glob("*.icd")) if folder.is_dir() else []


def _files() -> list[pathlib.Path]:
    """The files of installed wheels that hold drivers."""
    names = [wheel.replace("-", "_") for wheel in WHEELS]
    records = [record for folder in map(pathlib.Path, sys.path) for name in names
               for record in folder.glob(f"{name}-*.dist-info")]
    if not records:
        return []
    from importlib import metadata  # which takes longer to import than all else here

    return [pathlib.Path(str(file.locate())).resolve() for record in records
            for file in metadata.Distribution.at(record).files or []]


def _driver_name(library: str) -> str:
    """libpocl of /usr/lib/libpocl.so.2.10.0 and of libpocl-21062cec.so."""
    return re.split(r"[-.]", pathlib.Path(library).name)[0]


def _missing_programs(driver: str) -> list[str]:
    if driver not in _NEEDED_PROGRAMS:
        return []
    import shutil

    return [program for program in _NEEDED_PROGRAMS[driver] if shutil.which(program) is None]


def _offer_drivers() -> None:
    """Sets OCL_ICD_VENDORS to a folder with the system's list and the drivers of wheels, unless the user chose."""
    if any(os.environ.get(name) for name in CHOICES):
        return
    files = _files()
    lists = {path: path.read_text(encoding="utf-8").strip() for path in files if path.suffix == ".icd"}
    system = _listed(SYSTEM_LIST)
    known = {_driver_name(path.read_text(encoding="utf-8").strip()) for path in system}
    found = {}
    for path, library in lists.items():
        # A wheel's list names a file of the wheel, with a path that may be another machine's.
        places = [file for file in files if file.name == pathlib.Path(library).name]
        driver = _driver_name(library)
        if not places or driver in known:
            continue
        missing = _missing_programs(driver)
        if missing:
            _left_out.append(f"{places[0]} is not used, since it needs {' and '.join(missing)}")
        else:
            found[path.name] = str(places[0])
    if not found:
        return
    for path in files:
        if path.name == "libtbb.so.12":  # before Castor's own, which may be too old for the driver
            ctypes.CDLL(str(path))
    import atexit
    import shutil
    import tempfile

    folder = pathlib.Path(tempfile.mkdtemp(prefix="castor-drivers-"))
    owner = os.getpid()
    atexit.register(lambda: shutil.rmtree(folder, ignore_errors=True) if os.getpid() == owner else None)
    for path in system:
        shutil.copy(path, folder)
    for name, driver in found.items():
        (folder / f"wheel-{name}").write_text(driver + "\n", encoding="utf-8")
    os.environ["OCL_ICD_VENDORS"] = str(folder)
