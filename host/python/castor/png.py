"""PNG files of arrays."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np

from ._arrays import describe, host_array
from ._errors import FileError, UsageError
from .scene import PathLike


def encode_png(pixels: Any) -> bytes:
    """The PNG of grey (height, width) or RGB (height, width, 3) pixels, row 0 on top: uint8, or numbers that are
    rounded and cut to [0, 255] (NaN becomes 0)."""
    array = host_array(pixels, "pixels")
    if array.shape[2:] not in ((), (3,)) or array.ndim < 2 or array.dtype.kind not in "biuf" or not array.size:
        raise UsageError(f"pixels: found {describe(array)}, expected numbers of shape (height, width) or "
                         "(height, width, 3)")
    if array.dtype != np.uint8:
        array = np.clip(np.floor(np.nan_to_num(array.astype(np.float64)) + 0.5), 0, 255).astype(np.uint8)
    height, width = array.shape[:2]
    rows = array.reshape(height, -1)
    # Each byte less that of the pixel to its left (filter 1), which compresses better.
    step = rows.shape[1] // width
    filtered = np.ones((height, 1 + rows.shape[1]), np.uint8)
    filtered[:, 1 : 1 + step] = rows[:, :step]
    filtered[:, 1 + step :] = rows[:, step:] - rows[:, :-step]

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if step == 3 else 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9)) +
            chunk(b"IEND", b""))


def write_png(path: PathLike, pixels: Any) -> None:
    """Writes what encode_png makes of pixels to a file. Raises FileError."""
    data = encode_png(pixels)
    try:
        with open(path, "wb") as file:
            file.write(data)
    except OSError as error:
        raise FileError(f"{error.filename}: {error.strerror}", str(error.filename)) from error
