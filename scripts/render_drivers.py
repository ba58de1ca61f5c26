"""Renders one scene with one of the renderers beside Castor, in a process of its own:

    render_drivers.py RENDERER JOB.json

Used by scripts/render_runs.py, which writes the job and reads what this leaves: the linear picture, the version, and
seconds:

    load      from the file to the renderer's scene
    first     the first call that renders; builds the tree and compiles, where the renderer does so then
    render    a second call with another seed, with everything loaded, built and compiled
    extra     what does not belong to one picture: the second call, and reading the picture back

Castor's point light makes a surface of reflectance k, at distance r, shine with k intensity cos / r^2, without 1 / pi.
A renderer whose surfaces have the radiance k / pi times the irradiance gets lights that are pi times as strong.
"""

import json
import math
import os
import sys
import time

import numpy


class Stopwatch:
    def __init__(self):
        self.began = time.perf_counter()

    def lap(self):
        """Seconds since the last lap."""
        now = time.perf_counter()
        seconds, self.began = now - self.began, now
        return seconds


def mitsuba_scene(mi, job):
    return {
        "type": "scene",
        # Each of these samples takes one light at random; there are as many samples as Castor's shadow rays.
        "integrator": {
            "type": "direct",
            "emitter_samples": len(job["lights"]),
            "bsdf_samples": 0,
            "hide_emitters": True,
        },
        "sensor": {
            "type": "perspective",
            "fov": job["fov_y_degrees"],
            "to_world": mi.ScalarTransform4f().look_at(origin=job["eye"], target=job["target"], up=[0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": job["size"],
                "height": job["size"],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
            "sampler": {"type": "independent", "sample_count": job["samples"]},
        },
        "mesh": {
            "type": "ply",
            "filename": job["mesh"],
            "face_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": job["albedo"]}},
        },
        **{
            f"light{number}": {
                "type": "point",
                "position": light[:3],
                "intensity": {"type": "rgb", "value": math.pi * light[3]},
            }
            for number, light in enumerate(job["lights"])
        },
    }


def render_with_mitsuba(job, variant):
    import drjit
    import mitsuba as mi

    mi.set_variant(variant)
    drjit.set_thread_count(job["threads"])
    watch = Stopwatch()
    scene = mi.load_dict(mitsuba_scene(mi, job))
    if variant.startswith("llvm"):
        drjit.sync_thread()
    load = watch.lap()
    picture = numpy.array(mi.render(scene, seed=1))  # an array: it is done
    first = watch.lap()
    numpy.array(mi.render(scene, seed=2))
    second = watch.lap()
    picture /= repeated_light(mi, len(job["lights"]))
    return picture, {"load": load, "first": first, "render": second, "extra": second + watch.lap()}, mi.__version__


def repeated_light(mi, samples):
    """How often the direct integrator adds the light of a point: once, or, in versions that do not divide by the number
    of samples where a light is a point (such as 3.9), `samples` times. Told by one pixel of a square under one light.
    """
    mi.set_variant("scalar_rgb")
    means = []
    for count in (1, samples):
        scene = {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": count, "bsdf_samples": 0},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, 2], target=[0, 0, 0], up=[0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
                "sampler": {"type": "independent", "sample_count": 1},
            },
            "square": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(9)},
            "light": {"type": "point", "position": [0, 0, 50]},
        }
        means.append(numpy.array(mi.render(mi.load_dict(scene))).mean())
    return samples if means[1] > 1.5 * means[0] else 1


def render_with_mitsuba_llvm(job):
    import mitsuba as mi

    variants = [name for name in ("llvm_ad_rgb", "llvm_rgb", "llvm_ad_mono", "llvm_mono") if name in mi.variants()]
    if not variants:
        raise RuntimeError("this Mitsuba has no variant for LLVM")
    return render_with_mitsuba(job, variants[0])


def render_with_mitsuba_scalar(job):
    return render_with_mitsuba(job, "scalar_rgb")


def render_with_cycles(job):
    import bpy
    import mathutils

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    scene.render.use_persistent_data = True  # so that the second call finds the scene built
    scene.render.resolution_x = scene.render.resolution_y = job["size"]
    scene.render.resolution_percentage = 100
    scene.cycles.samples = job["samples"]
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0  # light that comes straight from the lamps alone
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"  # linear, without the view's curve
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = job["picture"] + ".exr"

    watch = Stopwatch()
    bpy.ops.wm.ply_import(filepath=job["mesh"], forward_axis="Y", up_axis="Z")
    mesh = bpy.context.object
    material = bpy.data.materials.new("grey")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*[job["albedo"]] * 3, 1)
    diffuse.inputs["Roughness"].default_value = 0
    material.node_tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    mesh.data.materials.clear()
    mesh.data.materials.append(material)
    for x, y, z, intensity in job["lights"]:
        light = bpy.data.lights.new("light", "POINT")
        light.shadow_soft_size = 0
        light.energy = 4 * math.pi * math.pi * intensity  # the power of a point whose intensity is pi times Castor's
        placed = bpy.data.objects.new("light", light)
        placed.location = (x, y, z)
        scene.collection.objects.link(placed)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", math.radians(job["fov_y_degrees"])
    camera.clip_start, camera.clip_end = 1e-3, 1e3
    backwards = (mathutils.Vector(job["eye"]) - mathutils.Vector(job["target"])).normalized()
    right = mathutils.Vector((0, 1, 0)).cross(backwards).normalized()
    axes = mathutils.Matrix((right, backwards.cross(right), backwards)).transposed()
    placed = bpy.data.objects.new("camera", camera)
    placed.matrix_world = mathutils.Matrix.Translation(job["eye"]) @ axes.to_4x4()
    scene.collection.objects.link(placed)
    scene.camera = placed
    load = watch.lap()
    bpy.ops.render.render(write_still=True)
    first = watch.lap()

    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    values = numpy.empty(job["size"] ** 2 * 4, numpy.float32)
    image.pixels.foreach_get(values)
    picture = values.reshape(job["size"], job["size"], 4)[::-1, :, :3]
    scene.cycles.seed = 2
    reading = watch.lap()
    bpy.ops.render.render(write_still=False)
    second = watch.lap()
    return picture, {"load": load, "first": first, "render": second, "extra": reading + second}, bpy.app.version_string


def render_with_luxcore(job):
    import pyluxcore

    pyluxcore.Init(lambda message: None)

    def properties(values):
        result = pyluxcore.Properties()
        for name, value in values.items():
            result.Set(pyluxcore.Property(name, value))
        return result

    watch = Stopwatch()
    scene = pyluxcore.Scene()
    row = 2 / job["size"]  # its camera sees everything one row of pixels lower than the others
    scene.Parse(
        properties(
            {
                "scene.camera.type": "perspective",
                "scene.camera.lookat.orig": job["eye"],
                "scene.camera.lookat.target": job["target"],
                "scene.camera.up": [0.0, 1.0, 0.0],
                "scene.camera.fieldofview": job["fov_y_degrees"],
                "scene.camera.screenwindow": [-1.0, 1.0, -1.0 - row, 1.0 - row],
                "scene.camera.autovolume.enable": False,
                "scene.materials.grey.type": "matte",
                "scene.materials.grey.kd": [job["albedo"]] * 3,
                "scene.shapes.mesh.type": "mesh",
                "scene.shapes.mesh.ply": job["mesh"],
                "scene.objects.mesh.shape": "mesh",
                "scene.objects.mesh.material": "grey",
            }
        )
    )
    for number, (x, y, z, intensity) in enumerate(job["lights"]):
        light = f"scene.lights.light{number}"
        # Its gain is the power of the point; the intensity is that over 4 pi, and pi times Castor's.
        gain = 4 * math.pi * math.pi * intensity
        scene.Parse(
            properties(
                {
                    f"{light}.type": "point",
                    f"{light}.position": [x, y, z],
                    f"{light}.color": [1.0, 1.0, 1.0],
                    f"{light}.gain": [gain] * 3,
                }
            )
        )
    load = watch.lap()

    def render(seed):
        config = pyluxcore.RenderConfig(
            properties(
                {
                    "renderengine.type": "PATHCPU",
                    "renderengine.seed": seed,
                    "sampler.type": "RANDOM",
                    "batch.haltspp": job["samples"],
                    "path.pathdepth.total": 1,
                    "path.pathdepth.diffuse": 1,
                    "native.threads.count": job["threads"],
                    "film.width": job["size"],
                    "film.height": job["size"],
                    "film.filter.type": "BOX",
                    "film.filter.width": 0.5,
                    "film.imagepipelines.0.0.type": "NOP",
                }
            ),
            scene,
        )
        session = pyluxcore.RenderSession(config)
        session.Start()  # builds the tree, and returns when the threads are rendering
        rendering = Stopwatch()
        while not session.HasDone():
            time.sleep(0.002)
            session.UpdateStats()
        seconds = rendering.lap()
        values = numpy.empty(job["size"] ** 2 * 3, numpy.float32)
        session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, values)
        session.Stop()
        return values.reshape(job["size"], job["size"], 3)[::-1], seconds

    picture, _ = render(1)
    first = watch.lap()
    _, second = render(2)
    return picture, {"load": load, "first": first, "render": second, "extra": watch.lap()}, pyluxcore.Version()


DRIVERS = {
    "mitsuba-llvm": render_with_mitsuba_llvm,
    "mitsuba-scalar": render_with_mitsuba_scalar,
    "cycles": render_with_cycles,
    "luxcore": render_with_luxcore,
}


def main():
    with open(sys.argv[2]) as file:
        job = json.load(file)
    picture, seconds, version = DRIVERS[sys.argv[1]](job)
    numpy.save(job["picture"], picture)
    with open(job["result"], "w") as file:
        json.dump({"seconds": seconds, "version": version}, file)
    sys.stdout.flush()
    os._exit(0)  # some of the libraries crash when they are unloaded


if __name__ == "__main__":
    main()
