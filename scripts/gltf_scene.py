"""Reads the part of glTF 2.0 that scripts/compare_paths hands on to renderers without a reader of their own: triangles
in world space, and the materials as the file has them. What a file asks for beyond that is refused by its name."""

import json
import pathlib
import struct
import urllib.parse
from dataclasses import dataclass

import numpy

from render_scenes import Failure

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES = 4
KNOWN_EXTENSIONS = {
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
}


@dataclass
class Geometry:
    """The triangles of one material. Normals and coordinates are (n, 3) and (n, 2), or None."""

    material: dict
    points: numpy.ndarray  # float32 (n, 3), in world space
    normals: numpy.ndarray | None
    coordinates: numpy.ndarray | None
    triangles: numpy.ndarray  # uint32 (m, 3)


class Document:
    """A glTF file, its buffers and its pictures."""

    def __init__(self, file):
        self.folder = file.parent
        data = file.read_bytes()
        self.buffers = {}
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            self.json = json.loads(data[20 : 20 + length])
            self.buffers[0] = data[20 + length + 8 :]
        else:
            self.json = json.loads(data)

    def has_light(self):
        return "KHR_lights_punctual" in self.json.get("extensionsUsed", []) or any(
            max(material.get("emissiveFactor", [0])) > 0 for material in self.json.get("materials", [])
        )

    def path(self, uri):
        if uri.startswith("data:"):
            raise Failure("data in URIs cannot be handed on")
        return self.folder / urllib.parse.unquote(uri)

    def buffer(self, number):
        if number not in self.buffers:
            self.buffers[number] = self.path(self.json["buffers"][number]["uri"]).read_bytes()
        return self.buffers[number]

    def accessor(self, number):
        """The values, as float32 where they are no indices: (count, width)."""
        accessor = self.json["accessors"][number]
        if "sparse" in accessor or "bufferView" not in accessor or accessor.get("normalized"):
            raise Failure("sparse and normalised accessors cannot be handed on")
        view = self.json["bufferViews"][accessor["bufferView"]]
        kind, width = numpy.dtype(COMPONENTS[accessor["componentType"]]), WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stride = view.get("byteStride", kind.itemsize * width)
        return numpy.ndarray(
            (accessor["count"], width), kind, self.buffer(view["buffer"]), start, (stride, kind.itemsize)
        )

    def picture(self, texture):
        """The file of a texture's picture, and what it does beyond its edges: repeat, mirror or clamp."""
        if texture.get("texCoord", 0) != 0:
            raise Failure("a second set of texture coordinates cannot be handed on")
        texture = self.json["textures"][texture["index"]]
        sampler = self.json["samplers"][texture["sampler"]] if "sampler" in texture else {}
        # Renderers that have one rule for both directions get that of u.
        wrap = {33071: "clamp", 33648: "mirror"}.get(sampler.get("wrapS"), "repeat")
        return self.path(self.json["images"][texture["source"]]["uri"]), wrap


def matrix_of(node):
    """The transform of a node, (4, 4): points are columns."""
    if "matrix" in node:
        return numpy.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    matrix = numpy.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= node.get("scale", (1, 1, 1))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def nodes_of(document):
    """(transform, node) of each node of the scene."""
    scene, nodes = document.json["scenes"][document.json.get("scene", 0)], document.json["nodes"]
    waiting = [(numpy.eye(4), number) for number in reversed(scene["nodes"])]
    while waiting:
        parent, number = waiting.pop()
        node = nodes[number]
        matrix = parent @ matrix_of(node)
        waiting += [(matrix, child) for child in reversed(node.get("children", []))]
        yield matrix, node


def meshes_of(document):
    """(transform, mesh) of each node of the scene that has one."""
    for matrix, node in nodes_of(document):
        if "skin" in node or "weights" in node:
            raise Failure("skins and morph targets cannot be handed on")
        if "mesh" in node:
            yield matrix, document.json["meshes"][node["mesh"]]


def lights_of(document):
    """(position, direction, light) of each light of KHR_lights_punctual in the scene."""
    for matrix, node in nodes_of(document):
        extension = node.get("extensions", {}).get("KHR_lights_punctual")
        if extension:
            light = document.json["extensions"]["KHR_lights_punctual"]["lights"][extension["light"]]
            yield matrix[:3, 3], -matrix[:3, 2] / numpy.linalg.norm(matrix[:3, 2]), light


def placed(document, matrix, primitive):
    """Points, normals, coordinates and triangles of a primitive in world space."""
    if primitive.get("mode", TRIANGLES) != TRIANGLES or "targets" in primitive:
        raise Failure("strips, fans, lines, points and morph targets cannot be handed on")
    attributes = {name: document.accessor(number) for name, number in primitive["attributes"].items()}
    if "COLOR_0" in attributes:
        raise Failure("colours of vertices cannot be handed on")
    linear = matrix[:3, :3]
    points = attributes["POSITION"] @ linear.T + matrix[:3, 3]
    normals = attributes.get("NORMAL")
    if normals is not None:
        normals = normals @ numpy.linalg.inv(linear)
        normals /= numpy.maximum(numpy.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    if "indices" in primitive:
        triangles = document.accessor(primitive["indices"]).reshape(-1, 3)
    else:
        triangles = numpy.arange(len(points)).reshape(-1, 3)
    if numpy.linalg.det(linear) < 0:
        triangles = triangles[:, ::-1]  # a mirrored mesh keeps its outside
    return points, normals, attributes.get("TEXCOORD_0"), triangles


def geometries(document):
    """All triangles of the scene: a Geometry for each material and set of attributes."""
    groups = {}
    for matrix, mesh in meshes_of(document):
        for primitive in mesh["primitives"]:
            parts = placed(document, matrix, primitive)
            key = (primitive.get("material", -1), parts[1] is None, parts[2] is None)
            groups.setdefault(key, []).append(parts)
    result = []
    for (number, _, _), parts in groups.items():
        points, normals, coordinates, triangles = zip(*parts)
        starts = numpy.cumsum([0] + [len(p) for p in points[:-1]])
        result.append(
            Geometry(
                document.json["materials"][number] if number >= 0 else {},
                numpy.concatenate(points).astype("<f4"),
                numpy.concatenate(normals).astype("<f4") if normals[0] is not None else None,
                numpy.concatenate(coordinates).astype("<f4") if coordinates[0] is not None else None,
                numpy.concatenate([t.astype("<u4") + numpy.uint32(s) for t, s in zip(triangles, starts)]),
            )
        )
    return result


def read_gltf(file):
    """The document, and all triangles of its scene. Raises Failure where it has what cannot be handed on."""
    try:
        document = Document(pathlib.Path(file))
        unknown = sorted(set(document.json.get("extensionsUsed", [])) - KNOWN_EXTENSIONS)
        if unknown:
            raise Failure(f"{', '.join(unknown)} cannot be handed on")
        return document, geometries(document)
    except (KeyError, IndexError, TypeError, ValueError, struct.error) as error:
        raise Failure(f"{file} is no glTF file that can be handed on: {error!r}") from error
