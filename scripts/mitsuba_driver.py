"""Renders a glTF file with Mitsuba 3: started by scripts/compare_paths, once for a scene. Reads lines of JSON with
samples, seed and file; writes the picture there as float32 rows of RGBA, row 0 on top, and answers with a line of JSON
that has the seconds of rendering. Alpha is 1. The first argument is a JSON object: what to render.

The first answer has Mitsuba's version, and `approximate`: the materials for which it has no equal. Equal are

    diffuse surfaces   specularFactor 0, metallicFactor 0: `diffuse`, on both sides
    metal              metallicFactor 1: `principled`, which has Schlick's Fresnel term and GGX too, but not the energy
                       that rough metal keeps: up to MOST_ROUGHNESS that is less than a hundredth
    glass              transmissionFactor 1, white, with a thickness: `dielectric` and `roughdielectric`; without one,
                       `thindielectric`
    alpha              BLEND: `mask`

All others become `principled`, whose diffuse part is Disney's."""

import json
import math
import os
import pathlib
import sys
import tempfile
import time

import numpy

from gltf_scene import lights_of, read_gltf
from render_scenes import Failure

MOST_ROUGHNESS = 0.35
SAMPLER = "ldsampler"  # the fastest of those with the least noise


def srgb_to_linear(values):
    return numpy.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


class Materials:
    def __init__(self, mi, document):
        self.mi, self.document = mi, document
        self.approximate = []

    def pixels(self, texture):
        """The picture of a texture, (height, width, channels) from 0 to 1, and what it does beyond its edges."""
        file, wrap = self.document.picture(texture)
        bitmap = self.mi.Bitmap(str(file))
        pixels = numpy.array(bitmap)
        if pixels.dtype != numpy.uint8:
            raise Failure(f"{file.name} has more than 8 bits, and cannot be handed on")
        return pixels.reshape(*pixels.shape[:2], -1) / 255.0, wrap

    def bitmap(self, pixels, wrap):
        bitmap = self.mi.Bitmap(numpy.ascontiguousarray(pixels, numpy.float32))
        return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": wrap}

    def color(self, factor, texture):
        if texture is None:
            return {"type": "rgb", "value": list(factor)}
        pixels, wrap = self.pixels(texture)
        pixels = numpy.repeat(pixels, 3, axis=2) if pixels.shape[2] < 3 else pixels[:, :, :3]
        return self.bitmap(srgb_to_linear(pixels) * factor, wrap)

    def channel(self, factor, texture, channel):
        """A factor, or a texture of one channel. 0 and 1 stay factors: Mitsuba knows then what is not there."""
        if texture is None:
            return factor
        pixels, wrap = self.pixels(texture)
        values = pixels[:, :, min(channel, pixels.shape[2] - 1)] * factor
        if values.min() == values.max():
            return float(values.min())
        return self.bitmap(values[:, :, None], wrap)

    def glass(self, material, color, roughness, is_thin):
        index = material.get("extensions", {}).get("KHR_materials_ior", {}).get("ior", 1.5)
        if index == 1 and not is_thin and min(color) == 1:
            return {"type": "null"}
        bsdf = {"type": "dielectric", "int_ior": index, "ext_ior": 1.0}
        if min(color) < 1:
            bsdf["specular_transmittance"] = {"type": "rgb", "value": list(color)}
        if is_thin:
            bsdf["type"] = "thindielectric"
            if roughness > 0:
                self.approximate.append(material)
        elif roughness > 0:
            bsdf |= {"type": "roughdielectric", "distribution": "ggx", "alpha": roughness**2}
        if min(color) < 1:
            self.approximate.append(material)
        return bsdf

    def principled(self, material, color, metallic, roughness, specular):
        if metallic != 1.0 or not isinstance(roughness, float) or roughness > MOST_ROUGHNESS:
            self.approximate.append(material)
        bsdf = {"type": "principled", "base_color": color, "metallic": metallic, "roughness": roughness}
        return bsdf | {"specular": 0.5 * specular}

    def bsdf(self, material):
        """The plugin of a glTF material."""
        for name in ("normalTexture", "emissiveTexture"):
            if name in material:
                raise Failure(f"{name} cannot be handed on")
        extensions, pbr = material.get("extensions", {}), material.get("pbrMetallicRoughness", {})
        *factor, alpha = pbr.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        texture = pbr.get("baseColorTexture")
        rough = pbr.get("metallicRoughnessTexture")
        roughness = self.channel(float(pbr.get("roughnessFactor", 1)), rough, 1)
        metallic = self.channel(float(pbr.get("metallicFactor", 1)), rough, 2)
        specular = extensions.get("KHR_materials_specular", {})
        transmission = extensions.get("KHR_materials_transmission", {}).get("transmissionFactor", 0)
        if set(specular) - {"specularFactor"} or transmission not in (0, 1) or transmission and (texture or rough):
            raise Failure("textures and colours of specular and transmitted light cannot be handed on")
        if transmission:
            thickness = extensions.get("KHR_materials_volume", {}).get("thicknessFactor", 0)
            bsdf = self.glass(material, factor, roughness, thickness == 0)
        else:
            color = self.color(factor, texture)
            if metallic == 0.0 and specular.get("specularFactor", 1) == 0:
                bsdf = {"type": "diffuse", "reflectance": color}
            elif max(factor) == 0 and metallic == 1.0 and roughness == 1.0:  # lamps; only grazing light is reflected
                bsdf = {"type": "diffuse", "reflectance": color}
            else:
                bsdf = self.principled(material, color, metallic, roughness, specular.get("specularFactor", 1))
            bsdf = {"type": "twosided", "bsdf": bsdf}
        if material.get("alphaMode", "OPAQUE") == "MASK" or material.get("alphaMode") == "BLEND" and texture:
            raise Failure("textures of alpha cannot be handed on")
        if material.get("alphaMode") == "BLEND" and alpha < 1:
            bsdf = {"type": "mask", "opacity": alpha, "bsdf": bsdf}
        return bsdf


def single_scattering_albedo(color, anisotropy):
    """Of KHR_materials_volume_scatter; color: what many scatterings leave."""
    s = 4.09712 + 4.20863 * color - numpy.sqrt(9.59217 + 41.6808 * color + 17.7126 * color**2)
    return numpy.where(color > 0, (1 - s**2) / (1 - anisotropy * s**2), 0.0)


def medium(material):
    """What is inside of a solid of the material, or None."""
    extensions = material.get("extensions", {})
    volume = extensions.get("KHR_materials_volume", {})
    attenuation = numpy.array(volume.get("attenuationColor", (1, 1, 1)), float)
    if not volume.get("thicknessFactor") or "attenuationDistance" not in volume or attenuation.min() == 1:
        return None
    scattering = extensions.get("KHR_materials_volume_scatter", {})
    anisotropy = scattering.get("scatterAnisotropy", 0.0)
    color = numpy.array(scattering.get("multiscatterColor", (0, 0, 0)), float)
    extinction = -numpy.log(attenuation) / volume["attenuationDistance"]
    return {
        "type": "homogeneous",
        "sigma_t": {"type": "rgb", "value": (extinction / extinction.max()).tolist()},
        "scale": float(extinction.max()),
        "albedo": {"type": "rgb", "value": single_scattering_albedo(color, anisotropy).tolist()},
        "phase": {"type": "hg", "g": anisotropy},
    }


def write_ply(file, geometry):
    """Positions, normals and coordinates of float32 each, and triangles."""
    columns = {"x y z": geometry.points, "nx ny nz": geometry.normals, "u v": geometry.coordinates}
    columns = {names: values for names, values in columns.items() if values is not None}
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(geometry.points)}\n"
    header += "".join(f"property float {name}\n" for names in columns for name in names.split())
    header += f"element face {len(geometry.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    faces = numpy.empty(len(geometry.triangles), [("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, geometry.triangles
    vertices = numpy.concatenate(list(columns.values()), axis=1).astype("<f4")
    file.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def sensor(mi, given):
    camera = given["camera"]
    _, right, _, _ = camera["window"]
    at, gaze = numpy.array(camera["position"], float), numpy.array(camera["gaze"], float)
    return {
        "type": "perspective",
        "fov_axis": "x",
        "fov": math.degrees(2 * math.atan(right / camera["distance"])),
        "near_clip": 1e-4,
        "far_clip": 1e6,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=at.tolist(), target=(at + gaze).tolist(), up=list(camera["up"])
        ),
        "film": {
            "type": "hdrfilm",
            "width": given["width"],
            "height": given["height"],
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
        "sampler": {"type": SAMPLER},
    }


def environment(mi, given):
    if isinstance(given["environment"], str):
        turned = mi.ScalarTransform4f().rotate([0, 1, 0], 180)  # the middle of the picture is at -z
        return {"type": "envmap", "filename": given["environment"], "to_world": turned}
    return {"type": "constant", "radiance": {"type": "rgb", "value": given["environment"]}}


def emitter(position, direction, light):
    """The plugin of a light that has no extent."""
    intensity = [light.get("intensity", 1.0) * value for value in light.get("color", (1.0, 1.0, 1.0))]
    if "range" in light or light["type"] == "spot":
        raise Failure("spots and ranges of lights cannot be handed on")
    if light["type"] == "directional":
        radiance = {"type": "rgb", "value": intensity}
        return {"type": "directional", "direction": direction.tolist(), "irradiance": radiance}
    return {"type": "point", "position": position.tolist(), "intensity": {"type": "rgb", "value": intensity}}


def prepare(mi, given, folder):
    """The scene, and the names of materials that have no equal."""
    document, geometries = read_gltf(given["file"])
    materials = Materials(mi, document)
    # A path scatters so many times at most, and Mitsuba counts all edges.
    scene = {"type": "scene", "sensor": sensor(mi, given)}
    scene["integrator"] = {"type": "path", "max_depth": given["bounces"] + 1}
    if given["environment"]:
        scene["environment"] = environment(mi, given)
    for number, light in enumerate(lights_of(document)):
        scene[f"light{number}"] = emitter(*light)
    known = {}
    for number, geometry in enumerate(geometries):
        file = folder / f"{number}.ply"
        write_ply(file, geometry)
        material = geometry.material
        key = json.dumps(material, sort_keys=True)
        if key not in known:
            known[key] = f"material{len(known)}"
            scene[known[key]] = materials.bsdf(material)
        shape = {"type": "ply", "filename": str(file), "face_normals": geometry.normals is None}
        shape["bsdf"] = {"type": "ref", "id": known[key]}
        if inside := medium(material):
            shape["interior"] = inside
            scene["integrator"] = {"type": "volpathmis"}  # to which a step within a solid is a bounce
        strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
        emission = [strength * value for value in material.get("emissiveFactor", (0, 0, 0))]
        if max(emission) > 0:
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": emission}}
        scene[f"mesh{number}"] = shape
    return mi.load_dict(scene), sorted({material.get("name", "nameless") for material in materials.approximate})


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(value):
        answers.write(json.dumps(value) + "\n")
        answers.flush()

    given = json.loads(sys.argv[1])
    try:
        import drjit
        import mitsuba as mi

        mi.set_variant(given["variant"])
        drjit.set_thread_count(given["threads"])
        with tempfile.TemporaryDirectory() as folder:
            scene, approximate = prepare(mi, given, pathlib.Path(folder))
    except (Failure, ImportError, RuntimeError, OSError) as failure:
        answer({"failure": str(failure)})
        return
    answer({"version": f"Mitsuba {mi.__version__} ({given['variant']})", "approximate": approximate})
    compiled = set()
    for line in sys.stdin:
        wanted = json.loads(line)
        if wanted["samples"] not in compiled:  # there are kernels for each number
            numpy.array(mi.render(scene, spp=wanted["samples"]))
            compiled.add(wanted["samples"])
        begin = time.monotonic()
        picture = numpy.array(mi.render(scene, spp=wanted["samples"], seed=wanted["seed"]))  # an array: it is done
        seconds = time.monotonic() - begin
        numpy.concatenate([picture, numpy.ones_like(picture[:, :, :1])], axis=2).astype("<f4").tofile(wanted["file"])
        answer({"seconds": seconds})


if __name__ == "__main__":
    main()
