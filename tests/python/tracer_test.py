#!/usr/bin/env python3
"""Scenes, tracers and their errors, by the package in PYTHONPATH."""

import base64
import ctypes
import json
import pathlib
import tempfile
import unittest
import warnings

import castor
import numpy as np
from shapes import box, random_rays, sphere

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"
DOWN = np.array([[0.25, 0.5, 3, 0, 0, -1], [5, 5, 5, 0, 0, -1]], np.float32)


class Rays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tracer = castor.Tracer(castor.Scene.from_mesh(*box()))

    def test_hits_and_misses_of_a_box(self):
        hits = self.tracer.closest_hit(DOWN)
        self.assertEqual(hits.dtype, castor.HIT)
        self.assertEqual(hits.dtype.itemsize, 20)
        self.assertEqual(hits["t"].tolist(), [2.0, np.inf])
        self.assertEqual(hits["instance"].tolist(), [0, castor.INVALID_INDEX])
        self.assertEqual(hits["primitive"][1], castor.INVALID_INDEX)
        self.assertEqual(hits[["u", "v"]][1].tolist(), (0, 0))
        vertices, triangles = box()
        p0, p1, p2 = vertices[triangles[hits["primitive"][0]]]
        u, v = hits["u"][0], hits["v"][0]
        np.testing.assert_allclose((1 - u - v) * p0 + u * p1 + v * p2, (0.25, 0.5, 1), atol=1e-6)

    def test_shapes_are_kept(self):
        for shape in ((), (0,), (7,), (3, 4), (2, 0, 5), (2, 3, 4)):
            rays = np.broadcast_to(castor.make_rays((0.25, 0.5, 3), (0, 0, -1)), (*shape, 8)).copy()
            self.assertEqual(self.tracer.closest_hit(rays).shape, shape)
            self.assertEqual(self.tracer.any_hit(rays).shape, shape)
            self.assertTrue(np.all(self.tracer.closest_hit(rays)["t"] == 2))
            self.assertTrue(np.all(self.tracer.count(rays) == 2))
            crossings = self.tracer.list(rays)
            self.assertEqual(crossings.counts.shape, shape)
            self.assertEqual(len(crossings), int(np.prod(shape)))

    def test_six_and_eight_columns_agree(self):
        rays = random_rays(5000)
        full = castor.make_rays(rays[:, :3], rays[:, 3:])
        self.assertEqual(full.shape, (5000, 8))
        expected = self.tracer.closest_hit(full)
        self.assertEqual(self.tracer.closest_hit(rays).tobytes(), expected.tobytes())
        self.assertEqual(self.tracer.closest_hit(full, coherent=True).tobytes(), expected.tobytes())
        self.assertTrue(100 < np.isfinite(expected["t"]).sum() < 4900)
        np.testing.assert_array_equal(self.tracer.any_hit(full), np.isfinite(expected["t"]))

    def test_ranges_of_rays(self):
        rays = castor.make_rays((0.25, 0.5, 3), (0, 0, -1), t_min=[0, 2, 2.5, 0], t_max=[2, np.inf, 2.75, 1.5])
        self.assertEqual(self.tracer.closest_hit(rays)["t"].tolist(), [2, 2, np.inf, np.inf])
        self.assertEqual(self.tracer.count(rays).tolist(), [1, 2, 0, 0])

    def test_out(self):
        hits, seen = np.empty(2, castor.HIT), np.empty(2, bool)
        self.assertIs(self.tracer.closest_hit(DOWN, out=hits), hits)
        self.assertIs(self.tracer.any_hit(DOWN, out=seen), seen)
        self.assertEqual((hits["t"][0], seen.tolist()), (2, [True, False]))
        frozen = np.empty(2, castor.HIT)
        frozen.flags.writeable = False
        for wrong in (np.empty(3, castor.HIT), np.empty(2), [1, 2], np.empty(4, castor.HIT)[::2], frozen):
            with self.assertRaisesRegex(castor.UsageError, "^out: found .*expected a writable C-contiguous array"):
                self.tracer.closest_hit(DOWN, out=wrong)

    def test_eight_columns_are_read_in_place(self):
        """What lies behind the rays is not copied: a buffer of the C library's own layout serves."""
        memory = (ctypes.c_float * 16)(0.25, 0.5, 3, 0, 0, 0, -1, np.inf, 5, 5, 5, 0, 0, 0, -1, np.inf)
        rays = np.frombuffer(memory, np.float32).reshape(2, 8)
        self.assertEqual(self.tracer.closest_hit(rays)["t"].tolist(), [2, np.inf])
        memory[2] = 11
        self.assertEqual(self.tracer.closest_hit(rays)["t"].tolist(), [10, np.inf])

    def test_dlpack(self):
        class Foreign:
            def __init__(self, array):
                self.array = array

            def __dlpack__(self, **options):
                return self.array.__dlpack__()

            def __dlpack_device__(self):
                return self.array.__dlpack_device__()

        hits = self.tracer.closest_hit(Foreign(DOWN))
        self.assertEqual(hits["t"].tolist(), [2, np.inf])
        np.testing.assert_array_equal(np.from_dlpack(self.tracer.count(DOWN)), [2, 0])

    def test_wrong_rays(self):
        expected = r", expected float32 of shape \(..., 8\) .* or \(..., 6\)"
        for rays, found in ((DOWN.astype(np.float64), r"float64 of shape \(2, 6\)"),
                            (DOWN[:, :5], r"float32 of shape \(2, 5\)"), (np.float32(1), r"float32 of shape \(\)"),
                            (DOWN.tolist(), r"float64 of shape \(2, 6\)"), (DOWN.astype(">f4"), "float32")):
            with self.assertRaisesRegex(castor.UsageError, f"^rays: found {found}"):
                self.tracer.closest_hit(rays)
        with self.assertRaisesRegex(ValueError, expected):
            self.tracer.any_hit(DOWN[:, :5])
        with self.assertRaisesRegex(castor.UsageError, "expected an array of numbers"):
            self.tracer.count(object())
        with self.assertRaisesRegex(castor.UsageError, "found strides .* expected a C-contiguous array"):
            self.tracer.count(np.zeros((8, 4), np.float32).T)
        for rays in (np.zeros((3, 8), np.float32), np.full((3, 8), np.nan, np.float32)):  # nothing to hit with
            self.assertFalse(self.tracer.any_hit(rays).any())

    def test_counts_of_a_closed_surface(self):
        vertices, triangles = sphere()
        tracer = castor.Tracer(castor.Scene.from_mesh(vertices, triangles))
        corners = vertices[triangles].astype(np.float64)
        targets = np.concatenate((vertices, (corners[:, 0] + corners[:, 1]) / 2))  # vertices, and middles of edges
        outside = np.array([3.0, -2.0, 5.0])
        self.assertFalse(np.any(tracer.count(castor.make_rays(outside, targets - outside)) % 2))
        self.assertTrue(np.all(tracer.count(castor.make_rays((0, 0, 0), targets)) == 1))

    def test_lists(self):
        rays = random_rays(2000, seed=2)
        counts, all_of_them = self.tracer.count(rays), self.tracer.list(rays)
        self.assertTrue(all_of_them.complete)
        np.testing.assert_array_equal(all_of_them.counts, counts)
        np.testing.assert_array_equal(np.diff(all_of_them.offsets), counts)
        self.assertEqual(len(all_of_them.hits), counts.sum())
        self.assertTrue(all(np.all(np.diff(one["t"]) >= 0) for one in all_of_them))
        first = self.tracer.list(rays, limit=1)
        self.assertFalse(first.complete)
        np.testing.assert_array_equal(first.counts, counts)
        crossed = np.flatnonzero(counts)
        expected = all_of_them.hits[all_of_them.offsets[:-1][crossed]]
        self.assertEqual(first.hits.tobytes(), expected.tobytes())
        self.assertEqual(first[int(crossed[0])].tobytes(), expected[:1].tobytes())
        self.assertEqual(self.tracer.list(rays, limit=9).hits.tobytes(), all_of_them.hits.tobytes())
        self.assertEqual(len(self.tracer.list(rays, limit=0).hits), 0)
        with self.assertRaisesRegex(castor.UsageError, "limit: found -1"):
            self.tracer.list(rays, limit=-1)
        with self.assertRaises(ValueError):
            all_of_them.hits["t"] = 0  # borrowed of the library
        hits = all_of_them.hits
        del all_of_them
        self.assertEqual(len(hits), counts.sum())  # and kept as long as the array

    def test_surfaces(self):
        rays = castor.make_rays([[0.25, 0.5, 3], [3, 0.5, 0.25], [9, 9, 9]], [[0, 0, -2], [-1, 0, 0], [1, 0, 0]])
        found = self.tracer.surfaces(rays, self.tracer.closest_hit(rays))
        np.testing.assert_array_equal(found.points, [[0.25, 0.5, 1], [1, 0.5, 0.25], [0, 0, 0]])
        np.testing.assert_array_equal(found.normals, [[0, 0, 1], [1, 0, 0], [0, 0, 0]])
        np.testing.assert_array_equal(found.shading_normals, found.normals)
        np.testing.assert_array_equal(found.materials, [0, 0, castor.INVALID_INDEX])
        with self.assertRaisesRegex(castor.UsageError, r"hits: found .*expected castor.HIT of shape \(3,\)"):
            self.tracer.surfaces(rays, np.empty(2, castor.HIT))
        wrong = np.zeros(3, castor.HIT)
        wrong["primitive"] = 12
        with self.assertRaises(castor.UsageError):
            self.tracer.surfaces(rays, wrong)


class Scenes(unittest.TestCase):
    def test_load(self):
        scene = castor.Scene.load(SCENES / "meshes/block.obj")
        self.assertEqual((len(scene.cameras), scene.counts["meshes"]), (1, 2))
        self.assertIn("triangles", repr(scene))
        self.assertTrue(castor.Tracer(scene).any_hit(scene.cameras[0].resized(16, 16).rays()).any())

    def test_options_of_files(self):
        positions = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], np.float32).tobytes()
        keys = np.array([0, 2, 0, 0, 0, 8, 0, 0], np.float32).tobytes()
        data = base64.b64encode(positions + keys).decode()
        channel = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
        mappings = [{"material": 1, "variants": [0]}]
        primitive = {"attributes": {"POSITION": 0}, "material": 0,
                     "extensions": {"KHR_materials_variants": {"mappings": mappings}}}
        lamp = {"name": "lamp", "emissiveFactor": [1, 1, 1]}
        document = {
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "extensions": {"KHR_materials_variants": {"variants": [{"name": "Bright"}]}},
            "materials": [{}, lamp], "meshes": [{"primitives": [primitive]}],
            "animations": [{"name": "Go", "channels": [channel], "samplers": [{"input": 1, "output": 2}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                          {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR"},
                          {"bufferView": 1, "byteOffset": 8, "componentType": 5126, "count": 2, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 32}],
            "buffers": [{"byteLength": 68, "uri": "data:;base64," + data}]}
        with tempfile.TemporaryDirectory() as folder:
            file, sky = pathlib.Path(folder) / "moving.gltf", pathlib.Path(folder) / "sky.hdr"
            file.write_text(json.dumps(document))
            sky.write_text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n0000")

            def hit_at(x, **options):
                tracer = castor.Tracer(castor.Scene.load(file, **options))
                return bool(tracer.any_hit(np.array([[x + 0.25, 0.25, 1, 0, 0, -1]], np.float32))[0])

            self.assertTrue(hit_at(0))
            self.assertTrue(hit_at(2, time_seconds=0.5))
            self.assertTrue(hit_at(4, time_seconds=1, animation="Go"))
            self.assertTrue(hit_at(4, time_seconds=1, animation=1))
            bright = castor.Scene.load(file, material_variant="Bright", environment=sky)
            self.assertEqual(len(bright.find_lights("lamp")), 1)
            for options, message in (({"material_variant": "Dark"}, "no material variant"),
                                     ({"sun_angle_radians": 0.1}, "no directional light"),
                                     ({"animation": "Go"}, "needs a time")):
                with self.subTest(message), self.assertRaisesRegex(castor.UsageError, message):
                    castor.Scene.load(file, **options)
            with self.assertRaises(castor.SceneError):
                castor.Scene.load(file, environment=pathlib.Path(folder) / "no.hdr")

    def test_files_that_are_wrong(self):
        with self.assertRaises(castor.SceneError) as caught:
            castor.Scene.load("/nowhere/no.xml")
        self.assertIsInstance(caught.exception, ValueError)
        self.assertEqual(caught.exception.file, "/nowhere/no.xml")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bad ü.obj"
            path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
            with self.assertRaises(castor.SceneError) as caught:
                castor.Scene.load(path)
            self.assertEqual((caught.exception.file, caught.exception.line), (str(path), 4))

    def test_warnings_of_a_file(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "odd.obj"
            path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib missing.mtl\nf 1 2 3\n")
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                scene = castor.Scene.load(path)
        self.assertTrue(scene.warnings)
        self.assertEqual([str(w.message) for w in caught], scene.warnings)
        self.assertTrue(all(w.category is castor.SceneWarning and w.filename == __file__ for w in caught))
        self.assertIn("odd.obj", scene.warnings[0])

    def test_everything_that_can_be_added(self):
        scene = castor.Scene()
        self.assertEqual(repr(scene), "<castor.Scene: empty>")
        red = scene.add_material(diffuse=(1, 0, 0))
        glass = scene.add_material(kind="dielectric", diffuse=(1, 1, 1), refraction_index=1.5)
        mesh = scene.add_mesh(*box(), smooth=True, material=red, transform=np.eye(4))
        shift = np.eye(4)[:3] + [[0, 0, 0, 10], [0, 0, 0, 0], [0, 0, 0, 0]]
        self.assertEqual(scene.add_instance(mesh, shift, glass), 0)
        self.assertEqual(scene.add_instances([mesh, mesh], np.stack((shift * 1.5, np.eye(4)[:3])), [red, glass]), 1)
        self.assertEqual(scene.add_sphere((0, 0, 5), 1), 0)
        self.assertEqual(scene.add_spheres([[0, 5, 0], [5, 0, 0]], [1, 2], [red, glass]), 1)
        self.assertEqual(scene.add_plane((0, 0, -1), (0, 0, 2)), 0)
        self.assertEqual(scene.add_point_light((1, 2, 3), (9, 9, 9), range=5), 0)
        with self.assertRaisesRegex(castor.UsageError, "range: found -1, expected a number above 0"):
            scene.add_point_light((1, 2, 3), (9, 9, 9), range=-1)
        self.assertEqual(scene.add_directional_light((0, 0, -1), (9, 9, 9)), 1)
        self.assertEqual(scene.add_spot_light((1, 2, 3), (0, 0, -1), (9, 9, 9), coverage_radians=0.5), 2)
        camera = castor.Camera.look_at((9, 8, 7), (0, 0, 0), width=40, height=20)
        self.assertEqual(scene.add_camera(camera), 0)
        np.testing.assert_allclose(scene.cameras[0].window, camera.window, rtol=1e-6)
        scene.set_background((1, 2, 3))
        scene.set_ambient_light((4, 5, 6))
        self.assertEqual(scene.counts, {"vertices": 8, "triangles": 12, "meshes": 1, "instances": 3, "spheres": 3,
                                        "planes": 1, "materials": 2, "lights": 3, "cameras": 1, "images": 0,
                                        "textures": 0})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", castor.SceneWarning)  # of the dielectric
            tracer = castor.Tracer(scene)
        rays = castor.make_rays([[10.3, 0.5, 9], [0, 0, 9], [50, 50, 9]], (0, 0, -1))
        hits = tracer.closest_hit(rays)
        self.assertEqual(hits["t"].tolist(), [8, 3, 10])
        self.assertEqual(hits["instance"].tolist(), [1, 0, 0])
        self.assertEqual(tracer.surfaces(rays, hits).materials.tolist(), [glass, 0, 0])

    def test_default_view(self):
        scene = castor.Scene.from_mesh(*sphere())
        scene.add_default_view()
        self.assertEqual((scene.counts["cameras"], scene.counts["materials"]), (1, 1))
        camera = scene.cameras[0].resized(33, 21)
        seen = castor.Tracer(scene).any_hit(camera.rays())
        self.assertEqual(seen.shape, (21, 33))
        self.assertTrue(seen[10, 16])
        self.assertFalse(seen[0, 0])

    def test_an_empty_scene_is_all_misses(self):
        tracer = castor.Tracer(castor.Scene())
        self.assertTrue(np.isinf(tracer.closest_hit(DOWN)["t"]).all())
        self.assertEqual(tracer.count(DOWN).tolist(), [0, 0])
        self.assertEqual(len(tracer.list(DOWN).hits), 0)

    def test_back_faces(self):
        tracer = castor.Tracer(castor.Scene.from_mesh(*box()), cull_back_faces=True)
        self.assertEqual(tracer.any_hit(castor.make_rays([[0.5, 0.4, 3], [0.5, 0.4, 0.5]], (0, 0, -1))).tolist(),
                         [True, False])

    def test_wrong_arguments(self):
        vertices, triangles = box()
        scene = castor.Scene()
        for call, message in (
            (lambda: scene.add_mesh(vertices[:, :2], triangles), r"vertices: found float32 of shape \(8, 2\), exp"),
            (lambda: scene.add_mesh(vertices, triangles - 1.0), "triangles: found float64 of shape .* to uint32"),
            (lambda: scene.add_mesh(vertices, triangles.astype(int) - 1), "triangles: found -1, expected indices"),
            (lambda: scene.add_mesh(vertices, [[0, 1, 1 << 32]]), "triangles: found 4294967296"),
            (lambda: scene.add_mesh(vertices, triangles, normals=vertices[1:]), "normals: found 7, .* as vertices, 8"),
            (lambda: scene.add_mesh(vertices, triangles, transform=np.eye(3)), "transform: found .*3x4 or 4x4"),
            (lambda: scene.add_instance(0, np.ones((4, 4))), r"transform: found the last row \[1.0, 1.0, 1.0, 1.0\]"),
            (lambda: scene.add_instances([0, 0], np.eye(4)[None]), r"transforms: found shape \(1, 4, 4\)"),
            (lambda: scene.add_sphere((0, 0), 1), r"center: found \(0, 0\), expected 3 numbers"),
            (lambda: scene.add_spheres([[0, 0, 0]], [1, 2]), "radii: found"),
            (lambda: scene.add_material(kind="wood"), "kind: found 'wood', expected one of plain, mirror"),
            (lambda: castor.Tracer(scene, strategy="fast"), "strategy: found 'fast', expected one of auto, brute"),
            (lambda: castor.Tracer(scene, devices="no such device"), "no such device"),
            (lambda: castor.Tracer(scene, devices=[3]), "devices: found"),
            (lambda: castor.Tracer(vertices), "scene: found float32 of shape .* expected a castor.Scene"),
            (lambda: castor.make_rays((0, 0), (0, 0, 1)), "origins: found int64 of shape"),
            (lambda: castor.make_rays(np.zeros((2, 3)), np.zeros((3, 3))), "do not broadcast"),
        ):
            with self.subTest(message), self.assertRaisesRegex(castor.UsageError, message):
                call()
        scene.add_mesh(vertices, triangles + 1)
        with self.assertRaises(castor.SceneError):
            castor.Tracer(scene)

    def test_devices(self):
        found = castor.devices()
        self.assertTrue(found)
        self.assertEqual([device.index for device in found], list(range(len(found))))
        self.assertEqual(castor.devices("0"), found[:1])
        self.assertEqual(castor.devices(f"{found[0].name},0"), castor.devices(found[0].name))
        tracer = castor.Tracer(castor.Scene.from_mesh(*box()), found[0])
        self.assertEqual(tracer.count(DOWN).tolist(), [2, 0])
        with self.assertRaisesRegex(castor.UsageError, "no such"):
            castor.devices("no such")


if __name__ == "__main__":
    unittest.main()
