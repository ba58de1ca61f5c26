"""Rays through scenes."""

from __future__ import annotations

import ctypes
import dataclasses
import threading
from typing import Any, Callable, Iterator, Optional, Sequence

import numpy as np

from . import _c
from ._arrays import HIT, Array, Floats, address, as_rays, describe, host_array, result_array
from ._errors import UsageError
from ._library import GoOn, Handle, Progress, ask, check, check_process, choose, lib, struct, warn, warnings_of
from .devices import Devices, select
from .scene import Scene

STRATEGIES = {"auto": _c.CASTOR_STRATEGY_AUTOMATIC, "brute": _c.CASTOR_STRATEGY_BRUTE,
               "simt": _c.CASTOR_STRATEGY_SIMT, "wide": _c.CASTOR_STRATEGY_WIDE, "packet": _c.CASTOR_STRATEGY_PACKET}
QUALITIES = {"medium": _c.CASTOR_TREE_QUALITY_MEDIUM, "high": _c.CASTOR_TREE_QUALITY_HIGH}


@dataclasses.dataclass(frozen=True)
class Crossings:
    """What rays cross, ray after ray, each ray's sorted by (t, instance, primitive)."""

    hits: Array  #: structured castor.HIT, shape (listed,)
    offsets: Array  #: int64, shape (rays + 1,): hits[offsets[i]:offsets[i + 1]] are those of ray i
    counts: Array  #: uint32, the rays' shape (...): how many crossings each ray has, also those that are not listed

    @property
    def complete(self) -> bool:
        """Whether all crossings are listed."""
        return len(self.hits) == int(self.counts.sum(dtype=np.int64))

    def __len__(self) -> int:
        """The number of rays."""
        return len(self.offsets) - 1

    def __getitem__(self, ray: int) -> Array:
        """The listed crossings of a ray, which counts over all of the rays' shape."""
        first, end = self.offsets[range(len(self))[ray]:][:2]
        return self.hits[first:end]

    def __iter__(self) -> Iterator[Array]:
        return (self[i] for i in range(len(self)))


@dataclasses.dataclass(frozen=True)
class Surfaces:
    """Where rays met surfaces. All zero, and material 0xffffffff, for misses."""

    points: Floats  #: (..., 3), in the world
    normals: Floats  #: (..., 3): unit, (p1-p0) x (p2-p0) of triangles, outward of spheres; not turned to the ray
    shading_normals: Floats  #: (..., 3): interpolated where a mesh has normals, else as `normals`
    materials: Array  #: (...): uint32


class Tracer:
    """Finds what rays meet in one scene. Answers are a function of ray and scene alone, with the same bits on every
    device.

    Rays are float32 arrays: C-contiguous (..., 8) [origin, t_min, direction, t_max], which are read in place, or
    (..., 6) [origin, direction], of which a copy is made with t in [0, inf]. castor.make_rays makes them. t is in units
    of the direction's length, which need not be 1. Rays with NaN, or with an infinite or zero direction, hit nothing.
    Other arrays in host memory are taken by DLPack.

    Calls release the GIL, and may come from several threads; batches then take turns. Ctrl-C ends a batch. An array
    must not be changed while a call reads it.
    """

    def __init__(self, scene: Scene, devices: Devices = "all", *, cull_back_faces: bool = False,
                 strategy: str = "auto", quality: str = "medium", use_profiles: bool = True,
                 progress: Progress = None) -> None:
        """Builds the scene's trees and uploads it to the devices, as castor.devices selects them.

        `cull_back_faces`: flat triangles seen from behind are not hit. `quality`: "medium" or "high", which takes
        longer to build. `progress`: of building. Raises SceneError if the scene is wrong, DeviceError if a device
        refuses or there is none. What is odd about scene or devices becomes a SceneWarning.
        """
        if not isinstance(scene, Scene):
            raise UsageError(f"scene: found {describe(scene)}, expected a castor.Scene")
        way, care = choose(strategy, STRATEGIES, "strategy"), choose(quality, QUALITIES, "quality")
        chosen = select(devices)
        built = scene._build(chosen, way, care, use_profiles, progress)
        options = struct("castor_tracer_options", strategy=way, quality=care, ignore_profiles=int(not use_profiles),
                         cull_back_faces=int(cull_back_faces))
        self._handle = Handle("tracer")
        check(lib.castor_tracer_create_from_built(built.value, chosen.value, ctypes.byref(options),
                                                  self._handle.out()))
        self._of_thread = threading.local()
        warn(self.warnings)

    def closest_hit(self, rays: Any, out: Optional[Array] = None, coherent: bool = False) -> Array:
        """The nearest hit of each ray, as a structured array of castor.HIT in the rays' shape (...).

        A hit has t, u, v, primitive and instance: a triangle's point is (1-u-v) p0 + u p1 + v p2. A miss has t = inf
        and primitive = instance = 0xffffffff. `out` receives the hits, if given. `coherent` says that neighbouring rays
        are alike, as those of small blocks of pixels; it may make them faster.
        """
        asked = as_rays(rays)
        hits = result_array(out, asked.shape[:-1], HIT)
        self._batch(lib.castor_tracer_closest_hit, coherent, address(asked), hits.size, address(hits))
        return hits

    def any_hit(self, rays: Any, out: Optional[Array] = None, coherent: bool = False) -> Array:
        """Whether each ray hits anything, as bool in the rays' shape (...)."""
        asked = as_rays(rays)
        occluded = result_array(out, asked.shape[:-1], np.dtype(np.bool_))
        self._batch(lib.castor_tracer_any_hit, coherent, address(asked), occluded.size, address(occluded))
        return occluded

    def count(self, rays: Any, out: Optional[Array] = None, coherent: bool = False) -> Array:
        """How many primitives each ray crosses in its range, as uint32 in the rays' shape (...).

        Each crossing of a closed surface belongs to exactly one triangle, also through edges and vertices: the count is
        even from outside and odd from inside, without exception.
        """
        asked = as_rays(rays)
        counts = result_array(out, asked.shape[:-1], np.dtype(np.uint32))
        self._batch(lib.castor_tracer_count_crossings, coherent, address(asked), counts.size, address(counts))
        return counts

    def list(self, rays: Any, limit: Optional[int] = None, coherent: bool = False) -> Crossings:
        """All crossings of each ray, or its first `limit` ones; counted as count() does.

        Without a limit, rays are traced twice. With one, they are traced once, with memory for so many hits of each.
        """
        asked = as_rays(rays)
        if limit is None:
            return self._list_all(asked, coherent)
        if limit < 0:
            raise UsageError(f"limit: found {limit}, expected at least 0")
        counts = np.empty(asked.shape[:-1], np.uint32)
        hits = np.empty((counts.size, limit), HIT)
        self._batch(lib.castor_tracer_list_crossings, coherent, address(asked), counts.size, limit, address(hits),
                    address(counts))
        offsets = _offsets(np.minimum(counts.reshape(-1), limit))
        return Crossings(_without_gaps(hits, offsets), offsets, counts)

    def surfaces(self, rays: Any, hits: Array) -> Surfaces:
        """Points, normals and materials of hits, which rays of the same shape have. Computed in double precision and
        rounded once."""
        asked, found = as_rays(rays), host_array(hits, "hits")
        if found.dtype != HIT or found.shape != asked.shape[:-1]:
            raise UsageError(f"hits: found {describe(found)}, expected castor.HIT of shape {asked.shape[:-1]}")
        found = np.ascontiguousarray(found)
        points, normals, shading = (np.empty((*found.shape, 3), np.float32) for _ in range(3))
        materials = np.empty(found.shape, np.uint32)
        go_on = self._go_on()
        go_on.finish(lib.castor_tracer_find_surfaces(self._handle.value, address(asked), address(found), found.size,
                                                     address(points), address(normals), address(shading),
                                                     address(materials), go_on.options(False)))
        return Surfaces(points, normals, shading, materials)

    @property
    def warnings(self) -> Sequence[str]:
        """What was noticed when the tracer was made."""
        return warnings_of("tracer", self._handle)

    @property
    def build_seconds(self) -> float:
        """What the trees took."""
        return float(ask("castor_tracer_get_info", "castor_tracer_info", self._handle.value).build_seconds)

    def _go_on(self) -> GoOn:
        """What watches for signals during this thread's calls."""
        check_process()
        go_on: Optional[GoOn] = getattr(self._of_thread, "go_on", None)
        if go_on is None or go_on.stopped:
            go_on = self._of_thread.go_on = GoOn()
        return go_on

    def _batch(self, function: Callable[..., int], coherent: bool, *arguments: int) -> None:
        go_on = self._go_on()
        go_on.finish(function(self._handle.value, *arguments, go_on.options(coherent)))

    def _list_all(self, rays: Floats, coherent: bool) -> Crossings:
        handle, ray_count = Handle("crossings"), rays.size // 8
        go_on = self._go_on()
        go_on.finish(lib.castor_tracer_list_all_crossings(self._handle.value, address(rays), ray_count,
                                                          go_on.options(coherent), handle.out()))
        arrays = ask("castor_crossings_get_arrays", "castor_crossings_arrays", handle.value)
        offsets = borrow(arrays.first, (ray_count + 1,), np.dtype(np.int64), handle)
        hits = borrow(arrays.hits, (int(offsets[-1]),), HIT, handle)
        counts = np.empty(rays.shape[:-1], np.uint32)
        np.subtract(offsets[1:], offsets[:-1], out=counts.reshape(-1), casting="unsafe")
        return Crossings(hits, offsets, counts)


def borrow(where: Optional[int], shape: tuple[int, ...], dtype: np.dtype[Any], owner: Handle) -> Array:
    """A read-only array of memory that belongs to `owner`, which lives as long as the array does."""
    length = int(np.prod(shape)) * dtype.itemsize
    if length == 0 or where is None:
        return np.empty(shape, dtype)
    memory = (ctypes.c_char * length).from_address(where)
    memory.owner = owner  # type: ignore[attr-defined]
    array: Array = np.frombuffer(memoryview(memory), dtype).reshape(shape)
    array.flags.writeable = False
    return array


def _offsets(counts: Array) -> Array:
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(counts, dtype=np.int64)))


def _without_gaps(hits: Array, offsets: Array) -> Array:
    """The first hits of each row, of which `offsets` tells the places. In steps, between which a signal is noticed."""
    packed = np.empty(int(offsets[-1]), HIT)
    limit = hits.shape[1]
    rows = max(1, (1 << 20) // max(1, limit))
    for row in range(0, len(hits), rows):
        places = offsets[row : row + rows + 1]
        listed = np.diff(places)
        packed[places[0] : places[-1]] = hits[row : row + rows][np.arange(limit) < listed[:, None]]
    return packed
