"""`RayMeshIntersector` with the interface of trimesh's, answered by Castor.

    mesh.ray = castor.trimesh.RayMeshIntersector(mesh)    # for one mesh
    castor.trimesh.install()                              # for every mesh that is made from now on

trimesh is not imported until install() is called. What differs from trimesh's own two intersectors:

- With several hits, each crossing of a closed surface comes once, also through an edge or a vertex: rays need not be
  moved past a surface and cast again, so no thin wall is skipped, and no face is reported twice. Of coincident faces
  each is a crossing.
- A ray along a face does not cross it. The first hit alone also counts faces that are met edge on, and the border of an
  open surface.
- Hits come as trimesh's Embree intersector gives them: the first hits of all rays, by ray, then the second ones, ...
"""

from __future__ import annotations

import importlib
import sys
from typing import Any, Optional

import numpy as np

from ._arrays import Array, Floats, describe, host_array, make_rays
from ._errors import UsageError
from .devices import Devices
from .scene import Scene
from .tracer import Tracer

# The way of contains_points' rays, and that of its second attempt.
_DIRECTION = np.array([0.4395064455, 0.617598629942, 0.652231566745])
_OTHER_DIRECTION = np.array([-0.8107131, 0.3319271, 0.4823117])


class RayMeshIntersector:
    """Rays through one mesh, which must have `vertices`, `faces` and `bounds` as trimesh's have.

    `scale_to_box` is accepted and ignored: Castor's precision does not depend on the scale. A mesh that changes is
    built anew at the next call.
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True, *, devices: Devices = "all") -> None:
        self.mesh = geometry
        self._devices = devices
        self._built: Optional[tuple[int, Tracer]] = None

    def intersects_id(self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True, max_hits: int = 100,
                      return_locations: bool = False, **kwargs: Any) -> tuple[Array, ...]:
        """Which triangles rays (n, 3) hit: all of them, up to `max_hits` a ray, or with multiple_hits=False the first.

        Returns index_tri (m,), index_ray (m,) and, with return_locations, the points (m, 3).
        """
        origins, directions = _ray_arrays(ray_origins, ray_directions)
        if max_hits < 0:
            raise UsageError(f"max_hits: found {max_hits}, expected at least 0")
        index_tri, index_ray = self._hits(origins, directions, max_hits if multiple_hits else min(max_hits, 1),
                                          multiple_hits)
        if not return_locations:
            return index_tri, index_ray
        return index_tri, index_ray, self._locations(origins[index_ray], directions[index_ray], index_tri)

    def intersects_location(self, ray_origins: Any, ray_directions: Any, multiple_hits: bool = True,
                            **kwargs: Any) -> tuple[Array, Array, Array]:
        """Where rays (n, 3) hit: the points (m, 3), index_ray (m,) and index_tri (m,)."""
        index_tri, index_ray, locations = self.intersects_id(ray_origins, ray_directions, multiple_hits=multiple_hits,
                                                             return_locations=True, **kwargs)
        return locations, index_ray, index_tri

    def intersects_first(self, ray_origins: Any, ray_directions: Any, **kwargs: Any) -> Array:
        """The first triangle that each ray hits, or -1."""
        hits = self._tracer().closest_hit(self._rays(*_ray_arrays(ray_origins, ray_directions)))
        return np.where(np.isinf(hits["t"]), np.int64(-1), hits["primitive"].astype(np.int64))

    def intersects_any(self, ray_origins: Any, ray_directions: Any, **kwargs: Any) -> Array:
        """Whether each ray hits the mesh."""
        return self._tracer().any_hit(self._rays(*_ray_arrays(ray_origins, ray_directions)))

    def contains_points(self, points: Any) -> Array:
        """Whether each point (n, 3) is inside the mesh. Points on the surface may count as either.

        A closed mesh is answered exactly. For another, a ray and its opposite must agree; where they do not, a point
        from which one of them is free is outside, and others are tried once more in another direction.
        """
        places = host_array(points, "points")
        if places.ndim != 2 or places.shape[1] != 3 or places.dtype.kind not in "iuf":
            raise UsageError(f"points: found {describe(places)}, expected numbers of shape (n, 3)")
        contains = np.zeros(len(places), bool)
        lower, upper = np.asarray(self.mesh.bounds, np.float64)
        asked = np.flatnonzero(np.all((places > lower) & (places < upper), axis=1))
        for direction in (_DIRECTION, _OTHER_DIRECTION):
            if len(asked) == 0:
                break
            ahead, behind = (self._tracer().count(self._rays(places[asked], sign * direction)) for sign in (1, -1))
            agree = ahead % 2 == behind % 2
            contains[asked[agree]] = ahead[agree] % 2 == 1
            asked = asked[~agree & (ahead > 0) & (behind > 0)]
        return contains

    def _hits(self, origins: Array, directions: Array, most: int, multiple_hits: bool) -> tuple[Array, Array]:
        rays = self._rays(origins, directions)
        if most == 0:
            return np.empty(0, np.int64), np.empty(0, np.int64)
        if not multiple_hits:
            first = self._tracer().closest_hit(rays)
            index_ray = np.flatnonzero(~np.isinf(first["t"]))
            return first["primitive"][index_ray].astype(np.int64), index_ray
        crossings = self._tracer().list(rays)
        index_ray = np.repeat(np.arange(len(rays)), crossings.counts)
        depth = np.arange(len(index_ray)) - np.repeat(crossings.offsets[:-1], crossings.counts)
        order = np.argsort(depth, kind="stable")
        order = order[depth[order] < most]
        return crossings.hits["primitive"][order].astype(np.int64), index_ray[order]

    def _locations(self, origins: Array, directions: Array, index_tri: Array) -> Array:
        """Where rays meet the planes of triangles, in double precision as the mesh is."""
        corners = np.asarray(self.mesh.vertices, np.float64)[np.asarray(self.mesh.faces)[index_tri]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        along = np.einsum("ij,ij->i", normals, directions)
        ahead = np.einsum("ij,ij->i", normals, corners[:, 0] - origins)
        with np.errstate(divide="ignore", invalid="ignore"):
            points: Array = origins + (ahead / along)[:, None] * directions
        # A triangle that is met nearly edge on has no exact such point: one in its box stands for it.
        lower, upper = corners.min(axis=1), corners.max(axis=1)
        points = np.where(np.isfinite(points), np.clip(points, lower, upper), corners[:, 0])
        return points

    def _rays(self, origins: Array, directions: Array) -> Floats:
        return make_rays(origins - self._center(), directions)

    def _center(self) -> Array:
        """The mesh is moved here, so that float32 serves a small mesh that is far away."""
        bounds = self.mesh.bounds
        center: Array = np.zeros(3) if bounds is None else np.asarray(bounds, np.float64).mean(axis=0)
        return center

    def _tracer(self) -> Tracer:
        key = hash(self.mesh)
        if self._built is None or self._built[0] != key:
            vertices = np.asarray(self.mesh.vertices, np.float64) - self._center()
            scene = Scene.from_mesh(vertices.astype(np.float32), np.asarray(self.mesh.faces))
            self._built = key, Tracer(scene, self._devices)
        return self._built[1]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_built": None}

    def __copy__(self) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh, devices=self._devices)

    def __deepcopy__(self, memo: Any) -> RayMeshIntersector:
        return self.__copy__()


def _ray_arrays(ray_origins: Any, ray_directions: Any) -> tuple[Array, Array]:
    """Both as float64 (n, 3), directions of length 1 (or 0)."""
    try:
        origins, directions = (np.asarray(rays, np.float64) for rays in (ray_origins, ray_directions))
    except (TypeError, ValueError) as error:
        raise UsageError(f"rays: found what is no array of numbers ({error}), expected two of shape (n, 3)") from error
    if origins.shape != directions.shape or origins.ndim != 2 or origins.shape[1] != 3:
        raise UsageError(f"rays: found origins of shape {origins.shape} and directions of shape {directions.shape}, "
                         "expected both (n, 3)")
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    return origins, np.divide(directions, lengths, out=np.zeros_like(directions), where=lengths > 0)


def install() -> None:
    """Makes Castor the intersector of every mesh that trimesh makes from now on, unless it is made with
    use_embree=False."""
    ray = importlib.import_module("trimesh.ray")
    ray.ray_pyembree = sys.modules[__name__]  # type: ignore[attr-defined]
    ray.has_embree = True  # type: ignore[attr-defined]
