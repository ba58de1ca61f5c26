#!/usr/bin/env python3
"""A depth map: how far each pixel's ray flies before it hits the mesh."""

import pathlib
import sys

import castor
import numpy as np
from castor import Array

MESH = pathlib.Path(__file__).resolve().parents[3] / "scenes/knot.ply"


def depth_map(scene: castor.Scene, camera: castor.Camera) -> Array:
    """Distances from the eye, inf where there is nothing: float32 (height, width)."""
    rays = camera.rays()
    hits = castor.Tracer(scene).closest_hit(rays, coherent=True)
    # t counts in lengths of the direction.
    distances: Array = hits["t"] * np.linalg.norm(rays[..., 4:7], axis=-1)
    return distances


def main() -> None:
    scene = castor.Scene.load(MESH)
    depth = depth_map(scene, scene.cameras[0].resized(320, 240))
    seen = np.isfinite(depth)
    near, far = depth[seen].min(), depth[seen].max()
    print(f"{seen.mean():.0%} of the pixels see the mesh, from {near:.3f} to {far:.3f} away")
    grey = np.where(seen, 255 - 200 * (depth - near) / (far - near), 0)
    castor.write_png(sys.argv[1] if len(sys.argv) > 1 else "depth_map.png", grey)


if __name__ == "__main__":
    main()
