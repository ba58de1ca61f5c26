"""Meshes, rays and a reader of pictures that several tests share."""

import struct
import zlib

import numpy as np


def box(lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 1.0)):
    """Vertices (8, 3) and outward triangles (12, 3) of a box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
    vertices = np.asarray(lower, np.float32) + corners * np.subtract(upper, lower).astype(np.float32)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(a, b, c) for a, b, c, d in quads] + [(a, c, d) for a, b, c, d in quads]
    return vertices, np.array(triangles, np.uint32)


def sphere(rows=24, columns=48):
    """Vertices and outward triangles of a closed ball of radius 1."""
    polar = np.linspace(0, np.pi, rows + 1)[1:-1, None]
    around = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None, :]
    ring = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around),
                     np.cos(polar) * np.ones_like(around)), -1)
    vertices = np.concatenate(([[0, 0, 1]], ring.reshape(-1, 3), [[0, 0, -1]])).astype(np.float32)
    triangles = []
    last = len(vertices) - 1
    for column in range(columns):
        beside = (column + 1) % columns
        triangles.append((0, 1 + column, 1 + beside))
        triangles.append((last, last - columns + beside, last - columns + column))
        for row in range(rows - 2):
            a, b = 1 + row * columns + column, 1 + row * columns + beside
            triangles += [(a, a + columns, b + columns), (a, b + columns, b)]
    return vertices, np.array(triangles, np.uint32)


def random_rays(count, seed=1, span=2.0):
    """Rays (count, 6) from points of a cube to all sides."""
    random = np.random.default_rng(seed)
    return np.concatenate((random.uniform(-span, span, (count, 3)), random.normal(size=(count, 3))), 1).astype("f4")


def read_png(data):
    """The pixels of a PNG with 8 bits a channel, grey or RGB: uint8 (height, width) or (height, width, 3)."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height, bits, colour = struct.unpack(">IIBB", data[16:26])
    assert bits == 8 and colour in (0, 2)
    place, packed = 8, b""
    while place < len(data):
        (length,), name = struct.unpack(">I", data[place : place + 4]), data[place + 4 : place + 8]
        if name == b"IDAT":
            packed += data[place + 8 : place + 8 + length]
        place += 12 + length
    step = 3 if colour == 2 else 1
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * step)
    pixels = np.zeros((height + 1, width + 1, step), np.uint8)  # with a border of zeros above and to the left
    for y, row in enumerate(rows):
        line = row[1:].reshape(width, step)
        if row[0] in (0, 2):
            pixels[y + 1, 1:] = line + (pixels[y, 1:] if row[0] == 2 else 0)
        elif row[0] == 1:
            pixels[y + 1, 1:] = np.cumsum(line, axis=0, dtype=np.uint8)
        else:
            for x in range(width):
                left, up, corner = (pixels[at].astype(int) for at in ((y + 1, x), (y, x + 1), (y, x)))
                if row[0] == 3:
                    guess = (left + up) // 2
                else:
                    near = np.abs([up - corner, left - corner, left + up - 2 * corner])
                    guess = np.choose(np.argmin(near, axis=0), (left, up, corner))
                pixels[y + 1, x + 1] = line[x] + guess.astype(np.uint8)
    return pixels[1:, 1:].reshape((height, width, 3) if step == 3 else (height, width))
