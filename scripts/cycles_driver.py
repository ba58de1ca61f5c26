"""Renders a glTF file with Cycles: started by scripts/compare_paths, once for a scene. Reads lines of JSON with
samples, seed and file; writes the picture there as float32 rows of RGBA, row 0 on top, and answers with a line of JSON
that has the seconds of rendering. With `covered`, the environment is not seen, and alpha is the share of a pixel in
which there is a surface; else alpha is 1. The first argument is a JSON object: what to render."""

import json
import math
import os
import sys
import tempfile
import time

import bpy
import mathutils
import numpy


def from_gltf(v):
    """A vector of glTF, whose y is up, in Blender's space, whose z is."""
    return mathutils.Vector((v[0], -v[2], v[1]))


def add_camera(scene, given):
    """Castor's camera: {position, gaze, up, window: [left, right, bottom, top], distance}."""
    data = bpy.data.cameras.new("camera")
    camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(camera)
    w = -from_gltf(given["gaze"]).normalized()
    u = from_gltf(given["up"]).cross(w).normalized()
    v = w.cross(u)
    at = from_gltf(given["position"])
    camera.matrix_world = mathutils.Matrix(
        ((u.x, v.x, w.x, at.x), (u.y, v.y, w.y, at.y), (u.z, v.z, w.z, at.z), (0, 0, 0, 1))
    )
    _, right, _, top = given["window"]
    data.sensor_fit = "HORIZONTAL" if right >= top else "VERTICAL"
    data.angle = 2 * math.atan(max(right, top) / given["distance"])
    data.clip_start, data.clip_end = 1e-4, 1e6
    scene.camera = camera


def add_environment(tree, given):
    """A radiance from everywhere, or a picture of all directions, whose middle is -z of glTF."""
    background = tree.nodes["Background"]
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    if not isinstance(given, str):
        background.inputs["Strength"].default_value = given
        return
    texture, mapping = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeMapping")
    texture.image = bpy.data.images.load(given)
    texture.image.colorspace_settings.name = "Non-Color"  # it is linear
    texture.interpolation = "Closest"
    mapping.inputs["Rotation"].default_value = (0, 0, -math.pi / 2)
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])


def prepare(given):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=given["file"])
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "FIXED"
    scene.render.threads = given["threads"]
    scene.render.resolution_x, scene.render.resolution_y = given["width"], given["height"]
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGBA"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    # A path scatters so many times at most; in Cycles, where light comes straight from a lamp is no bounce.
    limit = given["bounces"] - 1
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = limit
    cycles.transparent_max_bounces = 64
    cycles.pixel_filter_type = "BOX"
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    add_environment(world.node_tree, given["environment"])
    scene.world = world
    add_camera(scene, given["camera"])
    return scene


def pixels_of(file):
    image = bpy.data.images.load(file)
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    values = numpy.empty(width * height * 4, dtype=numpy.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(height, width, 4)[::-1].astype("<f4")


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Blender talks on standard output
    scene = prepare(json.loads(sys.argv[1]))
    answers.write(json.dumps({"version": "Cycles " + bpy.app.version_string}) + "\n")
    answers.flush()
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            wanted = json.loads(line)
            scene.cycles.samples, scene.cycles.seed = wanted["samples"], wanted["seed"]
            scene.render.film_transparent = wanted.get("covered", False)
            scene.render.filepath = os.path.join(folder, "picture.exr")
            begin = time.monotonic()
            bpy.ops.render.render(write_still=True)
            seconds = time.monotonic() - begin
            pixels_of(scene.render.filepath).tofile(wanted["file"])
            answers.write(json.dumps({"seconds": seconds}) + "\n")
            answers.flush()


if __name__ == "__main__":
    main()
