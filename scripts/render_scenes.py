"""Makes the scenes of scripts/compare_renders: triangle meshes, generated or read from PLY and OBJ files, with a camera
and two point lights, and Castor's scene file for them."""

import itertools
import pathlib
import subprocess
import sys
from dataclasses import dataclass

import numpy

ALBEDO = 0.7
WHITE = 255.0  # Castor's white, see include/castor/scene.h; 1 with the other renderers
GENERATED = ["boxes", "interior", "scan"]
SCAN_TRIANGLES = 86_000
BOX_COUNT = 20_000
SLAT_PIECES = 36  # of a slat, lengthwise
MOST_SUBDIVISIONS = 8

PLY_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
FACE = numpy.dtype([("length", "u1"), ("vertices", "<i4", 3)])

# Corners of a box are numbered by their bits: 1 for x, 2 for y, 4 for z. Sides are counter-clockwise from outside.
BOX_SIDES = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]


class Failure(Exception):
    """Something that the user must know; its text is a sentence."""


@dataclass
class Mesh:
    points: numpy.ndarray  # float32, (n, 3)
    triangles: numpy.ndarray  # int32, (m, 3), seen from outside counter-clockwise


@dataclass
class Light:
    position: tuple
    intensity: float  # a surface of reflectance k at distance r gets the radiance k intensity cos / r^2


@dataclass
class Scene:
    """What all renderers are given. One unit is about the radius of the object."""

    name: str
    triangle_count: int
    mesh_file: pathlib.Path
    castor_file: pathlib.Path
    eye: tuple
    target: tuple
    fov_y_degrees: float
    lights: list


def join(meshes):
    """One mesh of all."""
    starts = numpy.cumsum([0] + [len(mesh.points) for mesh in meshes[:-1]])
    return Mesh(
        numpy.concatenate([mesh.points for mesh in meshes]),
        numpy.concatenate([mesh.triangles + start for mesh, start in zip(meshes, starts)]).astype(numpy.int32),
    )


def box_triangles():
    return numpy.array([[(a, b, c), (a, c, d)] for a, b, c, d in BOX_SIDES], numpy.int32).reshape(-1, 3)


def random_rotations(random, count):
    """From unit quaternions, which are distributed evenly over the sphere."""
    w, x, y, z = (lambda q: q / numpy.linalg.norm(q, axis=0))(random.normal(size=(4, count)))
    return numpy.stack(
        [
            numpy.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)]),
            numpy.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)]),
            numpy.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]),
        ]
    ).transpose(2, 0, 1)


def boxes(seed=1):
    """Small boxes, each turned at random, in a cube."""
    random = numpy.random.Generator(numpy.random.PCG64(seed))
    centers = random.uniform(-1, 1, (BOX_COUNT, 1, 3))
    half = random.uniform(0.004, 0.025, (BOX_COUNT, 1, 3))
    corners = numpy.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    points = centers + numpy.einsum("nij,nkj->nki", random_rotations(random, BOX_COUNT), half * corners)
    triangles = box_triangles() + 8 * numpy.arange(BOX_COUNT, dtype=numpy.int32)[:, None, None]
    return Mesh(points.reshape(-1, 3).astype(numpy.float32), triangles.reshape(-1, 3))


def slat(center, half, turn=0.0, pieces=SLAT_PIECES):
    """A box along x, cut lengthwise into pieces and turned about x: 8 `pieces` + 4 triangles."""
    ring = numpy.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float) * half[1:]
    c, s = numpy.cos(turn), numpy.sin(turn)
    ring = ring @ numpy.array([[c, s], [-s, c]])
    x = numpy.linspace(-half[0], half[0], pieces + 1)
    points = numpy.concatenate(
        [numpy.repeat(x, 4)[:, None], numpy.tile(ring, (pieces + 1, 1))], axis=1
    ) + numpy.asarray(center)
    i, k = 4 * numpy.arange(pieces)[:, None], numpy.arange(4)[None, :]
    a, b, c, d = i + k, i + (k + 1) % 4, i + 4 + (k + 1) % 4, i + 4 + k
    sides = numpy.stack([numpy.stack([a, b, c], -1), numpy.stack([a, c, d], -1)], 2).reshape(-1, 3)
    end = 4 * pieces
    ends = [(0, 2, 1), (0, 3, 2), (end, end + 1, end + 2), (end, end + 2, end + 3)]
    return Mesh(points.astype(numpy.float32), numpy.concatenate([sides, ends]).astype(numpy.int32))


def turned_about_y(mesh):
    """By a quarter: x becomes -z."""
    return Mesh(mesh.points[:, [2, 1, 0]] * numpy.array([1, 1, -1], numpy.float32), mesh.triangles)


def interior(seed=1):
    """A room from x = -1 to 1, y = -0.75 to 0.75, z = -1.5 to 1.5, with blinds, shelves, and laths on floor and
    ceiling: 605 long thin boxes of 292 triangles each, and the room's own 12."""
    random = numpy.random.Generator(numpy.random.PCG64(seed))
    half = numpy.array([1.0, 0.75, 1.5])
    corners = numpy.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * half
    parts = [Mesh(corners.astype(numpy.float32), box_triangles()[:, ::-1])]  # seen from inside

    def blind(across, height, depth):
        """45 slats that hang in front of a wall, along x; some are turned a little further than others."""
        return [
            slat(
                (across, height + 0.018 * (k - 22), depth),
                (0.4, 0.0012, 0.008),
                0.7 + random.uniform(-0.15, 0.15),
            )
            for k in range(45)
        ]

    for z in (-0.95, 0.0, 0.95):
        parts += map(turned_about_y, blind(z, 0.1, -0.93))
        parts += map(turned_about_y, blind(z, 0.1, 0.93))
    parts += blind(-0.5, 0.1, -1.43) + blind(0.5, 0.1, -1.43)
    parts += [slat((0, 0.71, -1.47 + 0.0297 * k), (0.98, 0.012, 0.004)) for k in range(100)]
    parts += [turned_about_y(slat((0, -0.74, -0.985 + 0.0221 * k), (1.48, 0.004, 0.0105))) for k in range(90)]
    for side in (-1, 1):
        for k in range(5):  # shelves that stand below the blinds, and what lies on them
            height = -0.68 + 0.06 * k
            parts.append(turned_about_y(slat((0, height, side * 0.88), (1.2, 0.003, 0.07))))
            if k < 4:
                for _ in range(5):
                    place = random.uniform(-1.0, 1.0)
                    size = (random.uniform(0.05, 0.15), 0.012, random.uniform(0.01, 0.04))
                    parts.append(turned_about_y(slat((place, height + 0.0155, side * 0.88), size)))
    parts += [slat((0, -0.6 + 0.06 * k, -1.2), (0.5, 0.004, 0.004)) for k in range(5)]
    return join(parts)


def scan(folder):
    """A bumpy sphere of scripts/make_scan, with its seed 1."""
    file = folder / "made_scan.ply"
    command = [sys.executable, pathlib.Path(__file__).with_name("make_scan"), "--triangles", SCAN_TRIANGLES, "-o", file]
    result = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if result.returncode != 0:
        raise Failure(f"scripts/make_scan failed: {result.stderr.strip()}")
    return read_ply(file)


def subdivided(mesh):
    """Each triangle as four, between the middles of its edges."""
    t, count = mesh.triangles.astype(numpy.int64), len(mesh.points)
    edges = numpy.sort(numpy.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    keys, middle = numpy.unique(edges[:, 0] * count + edges[:, 1], return_inverse=True)
    points = (mesh.points[keys // count] + mesh.points[keys % count]) * numpy.float32(0.5)
    ab, bc, ca = (count + middle).reshape(3, -1)
    a, b, c = t.T
    triangles = numpy.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return Mesh(numpy.concatenate([mesh.points, points]), triangles.astype(numpy.int32))


def fans(faces):
    """Triangles of polygons, each a list of vertex numbers, in fans about their first vertices."""
    return [(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)]


def read_ply_header(lines):
    """The encoding, and the elements: (name, count, properties); properties are (name, type, type of the length of a
    list or None). Leaves the file after the header."""
    encoding, elements = "", []
    if next(lines, b"").strip() != b"ply":
        raise ValueError("it does not begin with the word ply")
    for line in lines:
        words = line.decode("ascii", "replace").split()
        if words[:1] == ["end_header"]:
            return encoding, elements
        if words[:1] == ["format"]:
            encoding = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((words[4], PLY_TYPES[words[3]], PLY_TYPES[words[2]]))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[2], PLY_TYPES[words[1]], None))
    raise ValueError("its header does not end")


def read_ply_text(words, count, properties):
    """The values of an element's records: a list by property."""
    values = {name: [] for name, _, _ in properties}
    for _ in range(count):
        for name, _, length in properties:
            values[name].append(
                [float(w) for w in itertools.islice(words, int(next(words)))] if length else next(words)
            )
    return values


def read_ply_bytes(data, at, order, count, properties):
    """The same from bytes, and where they end."""
    if not any(length for _, _, length in properties):
        record = numpy.dtype([(name, order + kind) for name, kind, _ in properties])
        values = numpy.frombuffer(data, record, count, at)
        return {name: values[name] for name, _, _ in properties}, at + record.itemsize * count
    # Where all lists have the length of the first one, the records have one size; else they are read one by one.
    record, place = [], at
    for name, kind, length in properties:
        if length:
            size = int(numpy.frombuffer(data, order + length, 1, place)[0]) if count else 3
            record += [(name + " length", order + length), (name, order + kind, (size,))]
        else:
            record.append((name, order + kind))
        place = at + numpy.dtype(record).itemsize
    record = numpy.dtype(record)
    if at + record.itemsize * count <= len(data):
        values = numpy.frombuffer(data, record, count, at)
        lists = [name for name, _, length in properties if length]
        if all((values[name + " length"] == values.dtype[name].shape[0]).all() for name in lists):
            return {name: values[name] for name, _, _ in properties}, at + record.itemsize * count
    values = {name: [] for name, _, _ in properties}
    for _ in range(count):
        for name, kind, length in properties:
            size = 1
            if length:
                size = int(numpy.frombuffer(data, order + length, 1, at)[0])
                at += numpy.dtype(length).itemsize
            found = numpy.frombuffer(data, order + kind, size, at)
            values[name].append(found if length else found[0])
            at += found.nbytes
    return values, at


def read_ply(file):
    """The mesh of a PLY file, of any encoding; polygons become fans."""
    with open(file, "rb") as lines:
        encoding, elements = read_ply_header(lines)
        data = lines.read()
    orders = {"binary_little_endian": "<", "binary_big_endian": ">"}
    if encoding not in {*orders, "ascii"}:
        raise ValueError(f'there is no encoding "{encoding}"')
    words, at, found = iter(data.split() if encoding == "ascii" else []), 0, {}
    for name, count, properties in elements:
        if encoding == "ascii":
            found[name] = read_ply_text(words, count, properties)
        else:
            found[name], at = read_ply_bytes(data, at, orders[encoding], count, properties)
    points = numpy.stack([numpy.asarray(found["vertex"][axis], numpy.float32) for axis in "xyz"], axis=1)
    faces = next(found["face"][name] for name in ("vertex_indices", "vertex_index") if name in found["face"])
    if isinstance(faces, numpy.ndarray) and faces.shape[1:] == (3,):
        return Mesh(points, faces.astype(numpy.int32))
    return Mesh(points, numpy.array(fans(faces), numpy.int32))


def read_obj(file):
    """The positions and faces of an OBJ file; polygons become fans."""
    points, faces = [], []
    for line in pathlib.Path(file).read_text(errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([number - 1 if number > 0 else len(points) + number for number in numbers])
    return Mesh(numpy.array(points, numpy.float32), numpy.array(fans(faces), numpy.int32))


def read_mesh(file):
    """The mesh of a PLY or OBJ file, checked."""
    try:
        mesh = read_obj(file) if file.lower().endswith(".obj") else read_ply(file)
        if not len(mesh.triangles):
            raise ValueError("it has no triangles")
        if mesh.triangles.min() < 0 or mesh.triangles.max() >= len(mesh.points):
            raise ValueError("a face names a vertex that is not there")
        if not numpy.isfinite(mesh.points).all():
            raise ValueError("a vertex is not finite")
    except OSError as error:
        raise Failure(f"{file} cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, IndexError, StopIteration, RuntimeError) as error:
        raise Failure(f"{file} is no mesh that can be used: {error or type(error).__name__}") from error
    return mesh


def normalized(mesh):
    """Moved into the ball of radius 1 about the origin, with the middle of its box there."""
    points = mesh.points.astype(float)
    points -= (points.min(axis=0) + points.max(axis=0)) / 2
    radius = numpy.linalg.norm(points, axis=1).max()
    if radius == 0:
        raise Failure("a mesh has no extent")
    return Mesh((points / radius).astype(numpy.float32), mesh.triangles)


def split_name(name):
    """`bunny.ply:2` -> ("bunny.ply", 2); ("bunny.ply", 0) without a number."""
    stem, colon, number = name.rpartition(":")
    if not colon or not number.isdigit():
        return name, 0
    if int(number) > MOST_SUBDIVISIONS:
        raise Failure(
            f"{name}: each subdivision makes 4 times as many triangles; at most {MOST_SUBDIVISIONS} are meant"
        )
    return stem, int(number)


def check_name(name):
    """Says early what can be known without making the mesh."""
    stem, _ = split_name(name)
    if stem not in GENERATED and not pathlib.Path(stem).is_file():
        raise Failure(
            f'there is no file "{stem}", and no scene of that name; the generated ones are {", ".join(GENERATED)}'
        )


def make_mesh(name, folder):
    """The mesh of a generated scene, or of a file, with its subdivisions."""
    stem, subdivisions = split_name(name)
    if stem == "interior":
        mesh = interior()
    elif stem == "boxes":
        mesh = normalized(boxes())
    else:
        mesh = normalized(scan(folder) if stem == "scan" else read_mesh(stem))
    for _ in range(subdivisions):
        mesh = subdivided(mesh)
    return mesh


def write_ply(file, mesh):
    faces = numpy.empty(len(mesh.triangles), FACE)
    faces["length"], faces["vertices"] = 3, mesh.triangles
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment made by scripts/compare_renders\n"
        f"element vertex {len(mesh.points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with open(file, "wb") as output:
        output.write(header.encode())
        output.write(mesh.points.astype("<f4").tobytes())
        output.write(faces.tobytes())


def text(vector):
    return " ".join(f"{x:.9g}" for x in vector)


def castor_scene(scene, size):
    """Grey and diffuse, no bounces and no ambient light; Castor's unit of light is 1 / 255 of the others'."""
    lights = "".join(
        f'    <PointLight id="{number}"><Position>{text(light.position)}</Position>'
        f"<Intensity>{text([WHITE * light.intensity] * 3)}</Intensity></PointLight>\n"
        for number, light in enumerate(scene.lights, 1)
    )
    return f"""<Scene>
<BackgroundColor>0 0 0</BackgroundColor>
<ShadowRayEpsilon>1e-5</ShadowRayEpsilon>
<MaxRecursionDepth>0</MaxRecursionDepth>
<Cameras>
    <Camera id="1" type="lookAt">
        <Position>{text(scene.eye)}</Position>
        <GazePoint>{text(scene.target)}</GazePoint>
        <Up>0 1 0</Up>
        <FovY>{scene.fov_y_degrees}</FovY>
        <NearDistance>1</NearDistance>
        <ImageResolution>{size} {size}</ImageResolution>
        <ImageName>picture.pfm</ImageName>
    </Camera>
</Cameras>
<Lights>
    <AmbientLight>0 0 0</AmbientLight>
{lights}</Lights>
<Materials>
    <Material id="1">
        <AmbientReflectance>0 0 0</AmbientReflectance>
        <DiffuseReflectance>{text([ALBEDO] * 3)}</DiffuseReflectance>
    </Material>
</Materials>
<Objects>
    <Mesh id="1" shadingMode="flat"><Material>1</Material><Faces plyFile="{scene.mesh_file.name}"/></Mesh>
</Objects>
</Scene>
"""


def make_scene(name, number, size, folder):
    """Writes the mesh and Castor's scene into the folder, and tells where everything stands."""
    mesh = make_mesh(name, folder)
    if split_name(name)[0] == "interior":
        eye, target, fov = (0.35, 0.05, 1.38), (-0.1, -0.08, -1.0), 65.0
        lights = [Light((0.3, 0.5, 0.6), 0.45), Light((-0.5, 0.3, -0.7), 0.3)]
    else:  # the ball of radius 1 fills the picture
        fov = 40.0
        direction = numpy.array([0.45, 0.35, 1.0])
        eye = direction / numpy.linalg.norm(direction) / numpy.sin(numpy.radians(fov / 2))
        eye, target = tuple(map(float, eye)), (0.0, 0.0, 0.0)
        lights = [Light((2.5, 3.0, 2.5), 14.0), Light((-3.0, 1.0, 2.5), 6.0)]
    mesh_file, castor_file = folder / f"scene{number}.ply", folder / f"scene{number}.xml"
    scene = Scene(name, len(mesh.triangles), mesh_file, castor_file, eye, target, fov, lights)
    write_ply(mesh_file, mesh)
    castor_file.write_text(castor_scene(scene, size))
    return scene
