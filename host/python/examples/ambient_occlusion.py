#!/usr/bin/env python3
"""Ambient occlusion: how much of the sky each visible point of a mesh sees."""

import pathlib
import sys

import castor
import numpy as np
from castor import Array

MESH = pathlib.Path(__file__).resolve().parents[3] / "scenes/knot.ply"


def sky(points: Array, normals: Array, tracer: castor.Tracer, samples: int, reach: float) -> Array:
    """The share of cosine-weighted directions that are free for `reach`: (n,) of points and normals (n, 3)."""
    random, free = np.random.default_rng(1), np.zeros(len(points))
    for _ in range(samples):
        # A point of the unit sphere on the tip of the normal: its direction is distributed as the cosine.
        directions = random.normal(size=points.shape)
        directions = normals + directions / np.linalg.norm(directions, axis=1, keepdims=True)
        free += ~tracer.any_hit(castor.make_rays(points, directions, t_min=1e-3 * reach, t_max=reach))
    return free / samples


def main() -> None:
    scene = castor.Scene.load(MESH)
    tracer = castor.Tracer(scene)
    rays = scene.cameras[0].resized(320, 240).rays()
    hits = tracer.closest_hit(rays, coherent=True)
    seen = np.isfinite(hits["t"])
    surfaces = tracer.surfaces(rays[seen], hits[seen])
    facing = np.einsum("ij,ij->i", surfaces.normals, rays[seen][:, 4:7]) < 0
    normals = np.where(facing[:, None], surfaces.normals, -surfaces.normals)
    picture = np.zeros(seen.shape)
    picture[seen] = 255 * sky(surfaces.points, normals, tracer, samples=64, reach=float(np.ptp(surfaces.points)) / 4)
    castor.write_png(sys.argv[1] if len(sys.argv) > 1 else "ambient_occlusion.png", picture)


if __name__ == "__main__":
    main()
