"""Makes the scenes of scripts/compare_paths as glTF files: a room, open in front, with three things in it and a lamp.

Those of EXACT mean the same to Castor, Cycles and Mitsuba: triangles are flat, diffuse surfaces are Lambert's, metals
are polished, glass does not absorb. Those of FIDELITY have balls with normals, of the materials that glTF files have
beside these, as far as both Castor and Cycles' importer know them."""

import json
import math

import numpy

from render_scenes import box_triangles

HALF = (3.0, 1.7, 2.5)  # of the room; the picture shows its open side, 16 : 9
DISTANCE = 6.0  # of the camera from there


def box(center, half):
    """Points and triangles, seen from outside counter-clockwise."""
    corners = numpy.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    return numpy.array(center) + corners * half, box_triangles()


def turned(points, degrees, center):
    """About the vertical through a centre."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (points - center) @ numpy.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) + center


def ball(center, radius, rings=96):
    """Points, triangles, normals, and texture coordinates: around, and from the upper pole down."""
    segments = 2 * rings
    polar, around = numpy.meshgrid(numpy.linspace(0, 1, rings + 1), numpy.linspace(0, 1, segments + 1), indexing="ij")
    directions = numpy.stack(
        [
            numpy.sin(math.pi * polar) * numpy.cos(2 * math.pi * around),
            numpy.cos(math.pi * polar),
            -numpy.sin(math.pi * polar) * numpy.sin(2 * math.pi * around),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = (a.ravel() for a in numpy.meshgrid(numpy.arange(rings), numpy.arange(segments), indexing="ij"))
    a, b = i * (segments + 1) + j, (i + 1) * (segments + 1) + j
    lower, upper = numpy.stack([a, b, b + 1], 1), numpy.stack([a, b + 1, a + 1], 1)
    triangles = numpy.concatenate([lower[i < rings - 1], upper[i > 0]])  # without those that end in a pole
    coordinates = numpy.stack([around.ravel(), polar.ravel()], axis=1)
    return numpy.array(center) + radius * directions, triangles, directions, coordinates


def surface(color, metallic=0.0, roughness=1.0, **extensions):
    """A material; extensions without KHR_materials_."""
    material = {
        "pbrMetallicRoughness": {
            "baseColorFactor": [*color, 1.0],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        },
        "doubleSided": True,
    }
    if extensions:
        material["extensions"] = {"KHR_materials_" + name: value for name, value in extensions.items()}
    return material


def diffuse(*color):
    return surface(color, specular={"specularFactor": 0.0})


def glass(roughness=0.0, color=(1.0, 1.0, 1.0), **volume):
    return surface(
        color,
        0.0,
        roughness,
        transmission={"transmissionFactor": 1.0},
        ior={"ior": 1.5},
        volume={"thicknessFactor": 1.0, **volume},
    )


def lamp(color, strength):
    return {
        **diffuse(0.0, 0.0, 0.0),
        "emissiveFactor": list(color),
        "extensions": {
            "KHR_materials_specular": {"specularFactor": 0.0},
            "KHR_materials_emissive_strength": {"emissiveStrength": strength},
        },
    }


def with_alpha(material, alpha):
    material["pbrMetallicRoughness"]["baseColorFactor"][3] = alpha
    return {**material, "alphaMode": "BLEND"}


class Scene:
    """A glTF document in the making."""

    def __init__(self):
        self.data = bytearray()
        names = ("nodes", "meshes", "materials", "accessors", "bufferViews", "cameras")
        self.document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], **{n: [] for n in names}}

    def accessor(self, values, component, kind):
        document = self.document
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes})
        accessor = {"bufferView": len(document["bufferViews"]) - 1, "componentType": component, "type": kind}
        accessor["count"] = len(values)
        if kind == "VEC3":
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self.data += values.tobytes()
        document["accessors"].append(accessor)
        return len(document["accessors"]) - 1

    def add_node(self, node):
        self.document["nodes"].append(node)
        self.document["scenes"][0]["nodes"].append(len(self.document["nodes"]) - 1)

    def add(self, material, points, triangles, normals=None, coordinates=None):
        attributes = {"POSITION": self.accessor(points.astype("<f4"), 5126, "VEC3")}
        if normals is not None:
            attributes["NORMAL"] = self.accessor(normals.astype("<f4"), 5126, "VEC3")
        if coordinates is not None:
            attributes["TEXCOORD_0"] = self.accessor(coordinates.astype("<f4"), 5126, "VEC2")
        indices = self.accessor(triangles.astype("<u4").reshape(-1, 1), 5125, "SCALAR")
        materials = self.document["materials"]
        if material not in materials:
            materials.append({**material, "name": f"material {len(materials)}"})
        number = next(i for i, m in enumerate(materials) if {**m, "name": 0} == {**material, "name": 0})
        primitive = {"attributes": attributes, "indices": indices, "material": number}
        self.document["meshes"].append({"primitives": [primitive]})
        self.add_node({"mesh": len(self.document["meshes"]) - 1})

    def add_light(self, light, **node):
        lights = self.document.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(light)
        self.add_node({**node, "extensions": {"KHR_lights_punctual": {"light": len(lights) - 1}}})

    def add_room(self):
        """Walls, floor and ceiling of a room; white, and one wall red and one green."""
        points, triangles = box((0, 0, 0), HALF)
        for side, color in enumerate([(0.6, 0.1, 0.08), (0.12, 0.45, 0.15)] + 3 * [(0.7, 0.7, 0.7)]):
            self.add(diffuse(*color), points, triangles[2 * side : 2 * side + 2, ::-1])  # seen from inside

    def write(self, file):
        width, height, depth = HALF
        camera = {"yfov": 2 * math.atan(height / DISTANCE), "znear": 0.1, "aspectRatio": width / height}
        self.document["cameras"].append({"type": "perspective", "perspective": camera})
        self.add_node({"camera": 0, "translation": [0.0, 0.0, depth + DISTANCE]})
        used = {name for material in self.document["materials"] for name in material.get("extensions", {})}
        self.document["extensionsUsed"] = sorted(used | set(self.document.get("extensions", {})))
        self.document["buffers"] = [{"uri": file.with_suffix(".bin").name, "byteLength": len(self.data)}]
        file.with_suffix(".bin").write_bytes(self.data)
        file.write_text(json.dumps(self.document))


def on_floor(x, z, radius):
    """Where the centre of a thing is. It does not touch the floor: what a ray meets first would be anybody's guess."""
    return (x, radius - HALF[1] + 0.01, z)


def add_ceiling_lamp(scene):
    scene.add(lamp((1.0, 0.9, 0.75), 9.0), *box((0, HALF[1] - 0.12, 0.3), (1.0, 0.06, 0.8)))


def add_things(scene, left, middle, right):
    """A ball, a turned block and a small ball, flat."""
    scene.add(left, *ball(on_floor(-1.7, -0.6, 0.85), 0.85)[:2])
    center = numpy.array(on_floor(0.3, -1.2, 1.0))
    points, triangles = box(center, (0.55, 1.0, 0.55))
    scene.add(middle, turned(points, 25, center), triangles)
    scene.add(right, *ball(on_floor(1.75, 0.5, 0.65), 0.65)[:2])


def things(left, middle, right):
    scene = Scene()
    scene.add_room()
    add_ceiling_lamp(scene)
    add_things(scene, left, middle, right)
    return scene


def lamps():
    """Many small lamps of different colours and strengths, near and far."""
    scene = Scene()
    scene.add_room()
    add_things(scene, diffuse(0.7, 0.7, 0.7), diffuse(0.2, 0.3, 0.7), diffuse(0.7, 0.5, 0.2))
    for row in range(4):
        for column in range(9):
            k = 9 * row + column
            place = (-2.6 + 0.65 * column, 1.4 - 0.3 * (k % 3), -2.0 + 1.1 * row)
            color = [0.5 + 0.5 * math.cos(k + phase) for phase in (0.0, 2.1, 4.2)]
            scene.add(lamp(color, 4.0 * (1 + k % 5)), *box(place, (0.05, 0.05, 0.05)))
    return scene


def balls(*materials):
    """Three balls with normals and texture coordinates."""
    scene = Scene()
    scene.add_room()
    add_ceiling_lamp(scene)
    for x, material in zip((-1.85, 0.0, 1.85), materials):
        points, triangles, normals, coordinates = ball(on_floor(x, -0.2, 0.85), 0.85)
        scene.add(material, points, triangles, normals, coordinates)
    return scene


GOLD, COPPER, RED = (1.0, 0.77, 0.34), (0.95, 0.64, 0.54), (0.7, 0.06, 0.04)
EXACT = {
    "lambert": lambda: things(diffuse(0.7, 0.7, 0.7), diffuse(0.2, 0.3, 0.7), diffuse(0.7, 0.5, 0.2)),
    "metal": lambda: things(surface(GOLD, 1.0, 0.2), surface(COPPER, 1.0, 0.3), surface((0.95, 0.95, 0.95), 1.0, 0.1)),
    "glass": lambda: things(glass(), glass(), glass(0.25)),
    "lamps": lamps,
    "mixed": lambda: things(glass(), diffuse(0.2, 0.3, 0.7), surface(GOLD, 1.0, 0.2)),
}
FIDELITY = {
    "metals": lambda: balls(*(surface(GOLD, 1.0, r) for r in (0.05, 0.5, 1.0))),
    "dielectrics": lambda: balls(*(surface(RED, 0.0, r) for r in (0.05, 0.4, 1.0))),
    "metallic": lambda: balls(*(surface(RED, m, 0.3) for m in (0.25, 0.5, 0.75))),
    "ior": lambda: balls(*(surface(RED, 0.0, 0.2, ior={"ior": n}) for n in (1.2, 1.8, 2.4))),
    "specular": lambda: balls(
        surface(RED, 0.0, 0.2, specular={"specularFactor": 0.3}),
        surface(RED, 0.0, 0.2, specular={"specularColorFactor": [0.3, 0.6, 1.0]}),
        surface(RED, 0.0, 0.6, specular={"specularFactor": 0.0}),
    ),
    "glossiness": lambda: balls(
        *(
            surface(RED, pbrSpecularGlossiness={"diffuseFactor": [*d, 1.0], "specularFactor": s, "glossinessFactor": g})
            for d, s, g in ((RED, [0.04, 0.04, 0.04], 0.8), (RED, [0.2, 0.5, 0.3], 0.6), ((0, 0, 0), GOLD, 0.8))
        )
    ),
    "clearcoat": lambda: balls(
        *(
            surface(RED, m, 0.6, clearcoat={"clearcoatFactor": c, "clearcoatRoughnessFactor": r})
            for m, c, r in ((0.0, 1.0, 0.0), (1.0, 0.5, 0.2), (0.0, 1.0, 0.4))
        )
    ),
    "sheen": lambda: balls(
        *(
            surface(c, 0.0, 0.9, sheen={"sheenColorFactor": [0.9, 0.8, 0.9], "sheenRoughnessFactor": r})
            for c, r in (((0.05, 0.05, 0.2), 0.3), (RED, 0.5), ((0.05, 0.05, 0.05), 0.9))
        )
    ),
    "thin": lambda: balls(
        *(
            surface(c, 0.0, r, transmission={"transmissionFactor": 1.0})
            for c, r in (((1.0, 1.0, 1.0), 0.0), ((0.4, 0.7, 1.0), 0.0), ((1.0, 1.0, 1.0), 0.4))
        )
    ),
    "volume": lambda: balls(
        glass(), glass(0.0, attenuationColor=[0.2, 0.7, 0.4], attenuationDistance=1.0), glass(0.3, (1.0, 0.6, 0.5))
    ),
    "alpha": lambda: balls(*(with_alpha(surface(RED, 0.0, 0.4), a) for a in (0.2, 0.5, 0.8))),
    "anisotropy": lambda: balls(
        *(
            surface(GOLD, 1.0, 0.3, anisotropy={"anisotropyStrength": s, "anisotropyRotation": r})
            for s, r in ((0.5, 0.0), (0.9, 0.0), (0.9, math.pi / 2))
        )
    ),
}


def milk(index, roughness, color, distance, multiscatter, anisotropy):
    """A solid whose inside scatters light."""
    return surface(
        (1.0, 1.0, 1.0),
        0.0,
        roughness,
        transmission={"transmissionFactor": 1.0},
        ior={"ior": index},
        volume={"thicknessFactor": 1.0, "attenuationColor": color, "attenuationDistance": distance},
        volume_scatter={"multiscatterColor": multiscatter, "scatterAnisotropy": anisotropy},
    )


def fog():
    """A room full of fog, lit by two points in it and a sun outside of it."""
    scene = Scene()
    scene.add_room()
    add_things(scene, diffuse(0.7, 0.7, 0.7), diffuse(0.2, 0.3, 0.7), diffuse(0.7, 0.5, 0.2))
    points, triangles = box((0, 0, 0), numpy.array(HALF) - 0.02)
    scene.add(milk(1.0, 0.0, [0.7, 0.65, 0.6], 1.0, [0.8, 0.8, 0.8], 0.3), points, triangles)
    scene.add_light({"type": "point", "intensity": 4.0, "color": [1.0, 0.8, 0.5]}, translation=[-0.9, 0.9, 0.4])
    scene.add_light({"type": "point", "intensity": 2.0, "color": [0.5, 0.7, 1.0]}, translation=[1.6, -0.2, -1.4])
    scene.add_light({"type": "directional", "intensity": 1.5}, rotation=[-0.25881905, 0.0, 0.0, 0.96592583])
    return scene


# To Castor and Mitsuba they mean the same; Cycles does not read what scatters within solids.
WITHIN = {
    "scattering": lambda: balls(
        milk(1.3, 0.0, [0.5, 0.5, 0.5], 0.2, [0.9, 0.9, 0.9], 0.0),
        milk(1.3, 0.0, [0.6, 0.3, 0.2], 0.1, [0.9, 0.5, 0.3], 0.6),
        milk(1.1, 0.0, [0.3, 0.5, 0.8], 1.0, [0.2, 0.6, 0.8], -0.4),
    ),
    "fog": fog,
}
SCENES = {**EXACT, **FIDELITY, **WITHIN}


def make_scene(name, folder):
    """Writes the scene, and returns its file."""
    file = folder / f"{name}.gltf"
    SCENES[name]().write(file)
    return file
