#!/usr/bin/env python3
"""A scanner's point cloud: what a lidar on a mast sees of a scene, written as PLY, and drawn from above."""

import pathlib
import sys

import castor
import numpy as np
from castor import Array

SCENE = pathlib.Path(__file__).resolve().parents[3] / "scenes/knot.xml"


def scan(tracer: castor.Tracer, position: tuple[float, float, float], beams: int, turns: int) -> Array:
    """Points (n, 3) that `beams` rays, one above the other, hit in a turn of `turns` steps, with 5 mm of noise."""
    turn, tilt = np.linspace(0, 2 * np.pi, turns, endpoint=False), np.radians(np.linspace(-45, 20, beams))
    around, height = np.meshgrid(turn, tilt)
    directions = np.stack((np.cos(around), np.tan(height), np.sin(around)), axis=-1)
    rays = castor.make_rays(position, directions, t_max=12)
    distances = tracer.closest_hit(rays)["t"][..., None]
    distances += np.random.default_rng(1).normal(scale=0.005, size=distances.shape).astype(np.float32)
    found: Array = (position + distances * directions)[np.isfinite(distances[..., 0])]
    return found


def main() -> None:
    points = scan(castor.Tracer(castor.Scene.load(SCENE)), (3.5, 3.0, 3.0), 192, 1800)
    axes = "\n".join(f"property float {axis}" for axis in "xyz")
    output = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "lidar.png")
    header = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{axes}\nend_header"
    np.savetxt(output.with_suffix(".ply"), points, "%.4f", header=header, comments="")
    picture = np.zeros((400, 400))  # from above: a pixel is 4 cm wide, and brighter where its points are higher
    shown = points[np.abs(points[:, [0, 2]]).max(axis=1) < 8]
    column, row = ((shown[:, [0, 2]] + 8) / 0.04).astype(int).T
    np.maximum.at(picture, (row, column), 60 + 40 * shown[:, 1])
    castor.write_png(output, picture)


if __name__ == "__main__":
    main()
