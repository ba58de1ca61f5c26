"""Checks and conversions of arrays. Every function names what it found and what it expected."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import UsageError

# As numpy.typing.NDArray, whose import takes as long as all of this package's.
Array = np.ndarray[Any, np.dtype[Any]]
Floats = np.ndarray[Any, np.dtype[np.float32]]

#: The number that stands for "no primitive" and "no instance" in a hit that is a miss.
INVALID_INDEX = 0xFFFFFFFF

#: A hit: 20 bytes, as castor::Hit and castor_hit lay it out.
HIT = np.dtype([("t", "<f4"), ("u", "<f4"), ("v", "<f4"), ("primitive", "<u4"), ("instance", "<u4")])


def describe(value: object) -> str:
    """What an argument is, for a message: its dtype and shape, or its type."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype.name or value.dtype} of shape {value.shape}"
    return type(value).__name__


def host_array(value: Any, name: str) -> Array:
    """The argument as a NumPy array: itself, or what lies in host memory behind DLPack or the buffer protocol."""
    if isinstance(value, np.ndarray):
        return value
    if hasattr(value, "__dlpack__"):
        try:
            return np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, ValueError) as error:
            raise UsageError(f"{name}: found {describe(value)} that does not lie in host memory ({error})") from error
    array = np.asarray(value)
    if array.dtype == object:
        raise UsageError(f"{name}: found {describe(value)}, expected an array of numbers")
    return array


def table(value: Any, name: str, dtype: Any, columns: int) -> Array:
    """Rows of `columns` numbers as a C-contiguous array of `dtype`. Floats and integers convert among themselves, but
    an integer is never made of a float."""
    array = host_array(value, name)
    wanted = np.dtype(dtype)
    if array.size == 0 and array.ndim == 1:
        array = array.reshape(0, columns).astype(wanted)
    if array.ndim != 2 or array.shape[1] != columns:
        raise UsageError(f"{name}: found {describe(array)}, expected an array of shape (n, {columns})")
    if array.dtype.kind not in ("iuf" if wanted.kind == "f" else "iu"):
        raise UsageError(f"{name}: found {describe(array)}, expected numbers that convert to {wanted.name}")
    if wanted.kind == "u" and array.size and array.dtype != wanted:
        least, most = int(array.min()), int(array.max())
        if least < 0 or most > np.iinfo(wanted).max:
            found = least if least < 0 else most
            raise UsageError(f"{name}: found {found}, expected indices from 0 to {np.iinfo(wanted).max}")
    return np.ascontiguousarray(array, dtype=wanted)


def vector(value: Any, name: str, length: int = 3) -> list[float]:
    """A few numbers, for a point, a direction or a colour."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (length,):
        raise UsageError(f"{name}: found {value!r}, expected {length} numbers")
    return [float(x) for x in array]


def rows_of_transform(value: Any, name: str = "transform") -> list[float]:
    """The 12 numbers of an affine map, row by row, of a 3x4 or 4x4 matrix that multiplies columns."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise UsageError(f"{name}: found {value!r}, expected a 3x4 or 4x4 matrix") from error
    if array.shape == (4, 4) and not np.array_equal(array[3], (0, 0, 0, 1)):
        raise UsageError(f"{name}: found the last row {array[3].tolist()}, expected [0, 0, 0, 1]")
    if array.shape not in ((3, 4), (4, 4)):
        raise UsageError(f"{name}: found {describe(array)}, expected a 3x4 or 4x4 matrix")
    return [float(x) for x in array[:3].ravel()]


def make_rays(origins: Any, directions: Any, t_min: Any = 0.0, t_max: Any = np.inf) -> Floats:
    """Rays as the tracer takes them: float32 of shape (..., 8), [origin, t_min, direction, t_max].

    `origins` and `directions` have shapes (..., 3), `t_min` and `t_max` shapes (...); they broadcast. A hit counts for
    t in [t_min, t_max], in units of the direction's length, which need not be 1.
    """
    start, along = host_array(origins, "origins"), host_array(directions, "directions")
    for array, name in ((start, "origins"), (along, "directions")):
        if array.ndim == 0 or array.shape[-1] != 3 or array.dtype.kind not in "iuf":
            raise UsageError(f"{name}: found {describe(array)}, expected numbers of shape (..., 3)")
    nearest, farthest = np.asarray(t_min), np.asarray(t_max)
    try:
        shape = np.broadcast_shapes(start.shape[:-1], along.shape[:-1], nearest.shape, farthest.shape)
    except ValueError as error:
        raise UsageError(f"origins, directions, t_min and t_max do not broadcast: found the shapes {start.shape}, "
                         f"{along.shape}, {nearest.shape} and {farthest.shape}") from error
    rays = np.empty((*shape, 8), np.float32)
    rays[..., 0:3] = start
    rays[..., 3] = nearest
    rays[..., 4:7] = along
    rays[..., 7] = farthest
    return rays


def as_rays(value: Any) -> Floats:
    """Rays that the library reads in place: (..., 8) as it is, or (..., 6), origin and direction, with a copy."""
    array = host_array(value, "rays")
    if array.dtype != np.float32 or array.ndim == 0 or array.shape[-1] not in (6, 8):
        raise UsageError(f"rays: found {describe(array)}, expected float32 of shape (..., 8) "
                         "[origin, t_min, direction, t_max] or (..., 6) [origin, direction]")
    if array.shape[-1] == 6:
        return make_rays(array[..., :3], array[..., 3:])
    if not array.flags.c_contiguous or not array.flags.aligned:
        raise UsageError(f"rays: found strides {array.strides} for {describe(array)}, expected a C-contiguous array: "
                         "numpy.ascontiguousarray makes one")
    return array


def result_array(out: Any, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Array:
    """`out` if it can receive the results, or a new array where it is None."""
    if out is None:
        return np.empty(shape, dtype)
    if (not isinstance(out, np.ndarray) or out.dtype != dtype or out.shape != shape or not out.flags.c_contiguous
            or not out.flags.writeable):
        found = describe(out)
        if isinstance(out, np.ndarray) and out.dtype == dtype and out.shape == shape:
            found += ", not contiguous" if not out.flags.c_contiguous else ", read-only"
        raise UsageError(f"out: found {found}, expected a writable C-contiguous array of {dtype} and shape {shape}")
    return out


def address(array: Array) -> int:
    """Where the array's elements lie."""
    return int(array.ctypes.data)
