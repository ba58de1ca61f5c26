"""What the package raises. Each error is also one of Python's own, so that programs need not know Castor's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional

if TYPE_CHECKING:
    from .renderer import Film


class Error(Exception):
    """Base of all errors of Castor."""


class SceneError(Error, ValueError):
    """The input is wrong: a scene, mesh or film file, or a scene that a program made.

    `file` is empty and `line` 0 where none is known.
    """

    def __init__(self, message: str, file: str = "", line: int = 0) -> None:
        super().__init__(message)
        self.file = file
        self.line = line


class UsageError(Error, ValueError):
    """An argument that cannot be used: a wrong dtype or shape, an unknown device, plane or file type."""


class DeviceError(Error, RuntimeError):
    """A device, or its driver, refuses. `device` is its name, `call` the OpenCL call, `code` its status (0: none).
    Of a render, `film` is what was done by then, a castor.Film, if there is anything."""

    def __init__(self, message: str, device: str = "", call: str = "", code: int = 0) -> None:
        super().__init__(message)
        self.device = device
        self.call = call
        self.code = code
        self.film: Optional["Film"] = None


class FileError(Error, OSError):
    """The file system refuses: a file cannot be written, a disk is full. `filename` names the file."""

    def __init__(self, message: str, file: str = "") -> None:
        super().__init__(message)
        self.filename = file or None


class SceneWarning(UserWarning):
    """A fault of a scene that did not end its reading or building."""
