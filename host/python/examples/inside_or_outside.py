#!/usr/bin/env python3
"""Which of a million points are inside a closed mesh: those from which a ray crosses it an odd number of times."""

import pathlib
import sys
import time

import castor
import numpy as np
from castor import Array

MESH = pathlib.Path(__file__).resolve().parents[3] / "scenes/knot.ply"


def is_inside(points: Array, tracer: castor.Tracer) -> Array:
    """For points (..., 3), in the shape (...). Exact also where a ray meets an edge or a vertex."""
    inside: Array = tracer.count(castor.make_rays(points, (0.6, 0.5, 0.62))) % 2 == 1
    return inside


def main() -> None:
    tracer = castor.Tracer(castor.Scene.load(MESH))
    # A slice through the middle of the mesh, row 0 on top.
    x, y = np.meshgrid(np.linspace(-2.3, 2.7, 1000), np.linspace(5, 0, 1000))
    points = np.stack((x, y, np.zeros_like(x)), axis=-1)
    started = time.perf_counter()
    inside = is_inside(points, tracer)
    seconds = time.perf_counter() - started
    print(f"{inside.mean():.1%} of {inside.size} points are inside the mesh, in {seconds:.2f} s")
    castor.write_png(sys.argv[1] if len(sys.argv) > 1 else "inside_or_outside.png", np.where(inside, 220, 20))


if __name__ == "__main__":
    main()
