"""`RaycastingScene` with the ray calls of `open3d.t.geometry.RaycastingScene`, answered by Castor.

Arrays may be NumPy's or Open3D's tensors; answers are tensors where the rays are. Open3D is imported only then. What
differs from Open3D's class:

- Counts and lists are exact: each crossing of a closed surface counts once, also through edges and vertices, and does
  not depend on the order of traversal. `list_intersections` sorts the crossings of each ray by distance.
- `t_hit` and `primitive_uvs` are the same bits on every device; Open3D's differ from them in the last digits. Where a
  ray meets an edge, the triangle with the smaller number is hit.
- Errors are castor.UsageError and castor.DeviceError, not RuntimeError.
- There are no closest-point queries (compute_closest_points, compute_distance, compute_signed_distance).
"""

from __future__ import annotations

import importlib
from typing import Any, Optional

import numpy as np

from ._arrays import INVALID_INDEX, Array, Floats, describe, make_rays, table
from ._errors import UsageError
from .devices import Devices
from .scene import Scene
from .tracer import Tracer

# Directions for compute_occupancy, none of them along an axis or a diagonal.
_DIRECTIONS = np.array([[0.4395, 0.6176, 0.6522], [-0.8107, 0.3319, 0.4823], [0.2718, -0.7613, 0.5888],
                        [0.5613, 0.2277, -0.7956], [-0.3141, -0.5926, -0.7417]])


def _is_tensor(value: Any) -> bool:
    return type(value).__module__.split(".")[0] == "open3d"


def _array(value: Any) -> Array:
    return np.asarray(value.cpu().numpy() if _is_tensor(value) else value)


def _like(given: Any, answer: Array) -> Any:
    """The answer in the kind of array that the question came in."""
    if not _is_tensor(given):
        return answer
    return importlib.import_module("open3d").core.Tensor.from_numpy(np.ascontiguousarray(answer))


def _like_all(given: Any, answers: dict[str, Array]) -> dict[str, Any]:
    return {name: _like(given, answer) for name, answer in answers.items()}


class RaycastingScene:
    """Meshes, and rays through them.

    `nthreads` is accepted everywhere and ignored: devices use all of their cores. `device` may be only Open3D's
    "CPU:0", the home of the arrays; `devices` selects Castor's, as `castor.devices` takes it.
    """

    INVALID_ID = INVALID_INDEX

    def __init__(self, nthreads: int = 0, device: Any = None, *, devices: Devices = "all") -> None:
        if device is not None and not str(device).startswith("CPU"):
            raise UsageError(f"device: found {device}, expected CPU:0, where arrays lie; `devices` selects Castor's")
        self._devices = devices
        self._meshes: list[tuple[Array, Array]] = []
        self._tracer: Optional[Tracer] = None
        self._normals: Floats = np.empty((0, 3), np.float32)
        self._first_triangle = np.zeros(1, np.int64)

    def add_triangles(self, vertices: Any, triangles: Any = None) -> int:
        """Adds a mesh: float32 (n, 3) and integer (m, 3) arrays, or a `TriangleMesh`. Returns its geometry's number."""
        if triangles is None:
            if not hasattr(vertices, "vertex") or not hasattr(vertices, "triangle"):
                raise UsageError(f"add_triangles: found {type(vertices).__name__} without triangles, expected a "
                                 "t.geometry.TriangleMesh, or vertices and triangles")
            vertices, triangles = vertices.vertex.positions, vertices.triangle.indices
        positions, indices = _array(vertices), _array(triangles)
        if positions.dtype != np.float32:
            raise UsageError(f"vertices: found {describe(positions)}, expected float32 of shape (n, 3)")
        # Copies: the scene is built when the first ray comes, and the caller may change the arrays before.
        self._meshes.append((table(positions, "vertices", np.float32, 3).copy(),
                             table(indices, "triangles", np.uint32, 3).copy()))
        self._tracer = None
        return len(self._meshes) - 1

    def cast_rays(self, rays: Any, nthreads: int = 0) -> dict[str, Any]:
        """The nearest hit of each ray, float32 (..., 6) [origin, direction].

        Returns t_hit (inf without a hit), geometry_ids and primitive_ids (INVALID_ID without one), primitive_uvs
        (..., 2) and primitive_normals (..., 3).
        """
        hits = self._commit().closest_hit(self._rays(rays))
        geometry, primitive = self._identify(hits["primitive"])
        # A last row of zeros is for misses, whose index is cut to it.
        normals = self._normals[np.minimum(hits["primitive"], np.uint32(len(self._normals) - 1))]
        return _like_all(rays, {"t_hit": np.ascontiguousarray(hits["t"]), "geometry_ids": geometry,
                                "primitive_ids": primitive, "primitive_uvs": np.stack((hits["u"], hits["v"]), -1),
                                "primitive_normals": normals})

    def test_occlusions(self, rays: Any, tnear: float = 0.0, tfar: float = np.inf, nthreads: int = 0) -> Any:
        """Whether each ray hits anything between tnear and tfar."""
        return _like(rays, self._commit().any_hit(self._rays(rays, tnear, tfar)))

    def count_intersections(self, rays: Any, nthreads: int = 0) -> Any:
        """How many surfaces each ray crosses, as int32."""
        return _like(rays, self._commit().count(self._rays(rays)).astype(np.int32))

    def list_intersections(self, rays: Any, nthreads: int = 0) -> dict[str, Any]:
        """All crossings of all rays, ray after ray, each ray's by distance.

        Returns ray_splits (rays + 1: ray i has the crossings [ray_splits[i], ray_splits[i + 1])), ray_ids, t_hit,
        geometry_ids, primitive_ids, and primitive_uvs (crossings, 2).
        """
        crossings = self._commit().list(self._rays(rays).reshape(-1, 8))
        hits, splits = crossings.hits, crossings.offsets.astype(np.uint32)
        geometry, primitive = self._identify(hits["primitive"])
        ray_ids = np.repeat(np.arange(len(splits) - 1, dtype=np.uint32), np.diff(crossings.offsets))
        return _like_all(rays, {"ray_splits": splits, "ray_ids": ray_ids, "t_hit": np.ascontiguousarray(hits["t"]),
                                "geometry_ids": geometry, "primitive_ids": primitive,
                                "primitive_uvs": np.stack((hits["u"], hits["v"]), -1)})

    def compute_occupancy(self, query_points: Any, nthreads: int = 0, nsamples: int = 1) -> Any:
        """1 for points inside closed meshes, else 0, as float32. `nsamples`, an odd number, is how many rays vote; one
        is exact for a closed mesh."""
        points = _array(query_points)
        if points.dtype != np.float32 or points.ndim < 1 or points.shape[-1] != 3:
            raise UsageError(f"query_points: found {describe(points)}, expected float32 of shape (..., 3)")
        if nsamples < 1 or nsamples % 2 == 0:
            raise UsageError(f"nsamples: found {nsamples}, expected an odd number")
        votes = np.zeros(points.shape[:-1], np.int64)
        for sample in range(nsamples):
            direction = np.roll(_DIRECTIONS[sample % len(_DIRECTIONS)], sample // len(_DIRECTIONS))
            votes += self._commit().count(make_rays(points, direction)) % 2
        return _like(query_points, (votes > nsamples // 2).astype(np.float32))

    @staticmethod
    def create_rays_pinhole(*args: Any, **kwargs: Any) -> Any:
        """Rays (height, width, 6) of a pinhole camera, by (intrinsic_matrix, extrinsic_matrix, width_px, height_px) or
        by (fov_deg, center, eye, up, width_px, height_px)."""
        if "fov_deg" in kwargs or len(args) + len(kwargs) == 6:
            return _rays_of_view(*args, **kwargs)
        return _rays_of_matrices(*args, **kwargs)

    def _commit(self) -> Tracer:
        if self._tracer is None:
            scene = Scene()
            for vertices, triangles in self._meshes:
                scene.add_mesh(vertices, triangles)
            counts = [len(triangles) for _, triangles in self._meshes]
            self._first_triangle = np.concatenate((np.zeros(1, np.int64), np.cumsum(counts, dtype=np.int64)))
            normals = [_normals(vertices, triangles) for vertices, triangles in self._meshes]
            self._normals = np.concatenate([*normals, np.zeros((1, 3), np.float32)])
            self._tracer = Tracer(scene, self._devices)
        return self._tracer

    @staticmethod
    def _rays(rays: Any, t_min: float = 0.0, t_max: float = np.inf) -> Floats:
        array = _array(rays)
        if array.dtype != np.float32 or array.ndim < 2 or array.shape[-1] != 6:
            raise UsageError(f"rays: found {describe(array)}, expected float32 of shape (..., 6) [origin, direction], "
                             "with two dimensions or more")
        return make_rays(array[..., :3], array[..., 3:], t_min, t_max)

    def _identify(self, primitives: Array) -> tuple[Array, Array]:
        """The numbers of geometries and of triangles in them, of numbers that count all triangles."""
        first = self._first_triangle
        if len(first) <= 2:
            return np.where(primitives == INVALID_INDEX, np.uint32(INVALID_INDEX), np.uint32(0)), primitives.copy()
        geometry = np.searchsorted(first, primitives, side="right") - 1
        is_hit = primitives != INVALID_INDEX
        within = primitives - first[np.minimum(geometry, len(first) - 1)]
        return (np.where(is_hit, geometry, INVALID_INDEX).astype(np.uint32),
                np.where(is_hit, within, INVALID_INDEX).astype(np.uint32))


def _normals(vertices: Array, triangles: Array) -> Floats:
    """Unit normals of triangles; zero for degenerate ones."""
    p0, p1, p2 = (vertices[triangles[:, corner]].astype(np.float64) for corner in range(3))
    normals = np.cross(p1 - p0, p2 - p0)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: Floats = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0).astype(np.float32)
    return unit


def _rays_of_matrices(intrinsic_matrix: Any, extrinsic_matrix: Any, width_px: int, height_px: int) -> Any:
    intrinsic = np.asarray(_array(intrinsic_matrix), np.float64)
    extrinsic = np.asarray(_array(extrinsic_matrix), np.float64)
    if intrinsic.shape != (3, 3) or extrinsic.shape != (4, 4):
        raise UsageError(f"create_rays_pinhole: found matrices of shapes {intrinsic.shape} and {extrinsic.shape}, "
                         "expected (3, 3) and (4, 4)")
    to_world = extrinsic[:3, :3].T
    columns, rows = np.meshgrid(np.arange(width_px) + 0.5, np.arange(height_px) + 0.5)
    pixels = np.stack((columns, rows, np.ones_like(columns)), -1)
    rays = np.empty((height_px, width_px, 6), np.float32)
    rays[..., :3] = -to_world @ extrinsic[:3, 3]
    rays[..., 3:] = pixels @ (to_world @ np.linalg.inv(intrinsic)).T
    return _like(intrinsic_matrix, rays)


def _rays_of_view(fov_deg: float, center: Any, eye: Any, up: Any, width_px: int, height_px: int) -> Any:
    target, position, upwards = (np.asarray(_array(value), np.float64) for value in (center, eye, up))
    focal_length = 0.5 * width_px / np.tan(np.radians(0.5 * fov_deg))
    intrinsic = np.array([[focal_length, 0, 0.5 * width_px], [0, focal_length, 0.5 * height_px], [0, 0, 1]])
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(upwards, forward)
    right /= np.linalg.norm(right)
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = right, np.cross(forward, right), forward
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ position
    return _like(eye, _rays_of_matrices(intrinsic, extrinsic, width_px, height_px))
