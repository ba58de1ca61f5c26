#!/usr/bin/env python3
"""Renderers and films, by the package in PYTHONPATH."""

import pathlib
import tempfile
import unittest

import castor
import numpy as np
from shapes import read_png, sphere

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = castor.Scene.load(SCENES / "spheres.xml")
        cls.renderer = castor.Renderer(cls.scene)
        cls.camera = cls.scene.cameras[0].resized(60, 40)
        cls.film = cls.renderer.render(cls.camera, planes=["depth", "normal", "primitive"])

    def test_a_film_is_an_array(self):
        film = self.film
        self.assertEqual((film.width, film.height, film.complete), (60, 40, True))
        self.assertTrue(film.done.all())
        pixels = np.asarray(film)
        self.assertEqual((pixels.shape, pixels.dtype), ((40, 60, 3), np.float32))
        self.assertGreater(pixels.std(), 1)
        self.assertFalse(pixels.flags.writeable)
        self.assertEqual(np.array(film, dtype=np.float64).dtype, np.float64)
        np.testing.assert_array_equal(np.from_dlpack(pixels.copy()), pixels)
        self.assertIn("60x40", repr(film))

    def test_planes_have_names(self):
        self.assertEqual(list(self.film.planes), ["depth", "normal", "primitive"])
        self.assertEqual(self.film["depth"].shape, (40, 60))
        self.assertEqual(self.film["normal"].shape, (40, 60, 3))
        self.assertEqual(self.film["primitive"].dtype, np.uint32)
        with self.assertRaisesRegex(castor.UsageError, "found 'albedo', expected one of depth, normal, primitive"):
            self.film["albedo"]
        with self.assertRaisesRegex(castor.UsageError, "dept"):
            self.renderer.render(self.camera, planes=["dept"])
        self.assertIn("depth", castor.plane_names())

    def test_planes_agree_with_the_tracer(self):
        hits = castor.Tracer(self.scene).closest_hit(self.camera.rays())
        alike = hits["primitive"] == self.film["primitive"]
        self.assertGreater(alike.mean(), 0.99)  # rays are rounded elsewhere here
        both = alike & np.isfinite(hits["t"])
        self.assertTrue(both.any())

    def test_the_same_picture_is_the_same_bytes(self):
        again = castor.Renderer(self.scene).render(self.camera)
        np.testing.assert_array_equal(again.pixels, self.film.pixels)
        np.testing.assert_array_equal(self.renderer.render(0).pixels.shape[:2],
                                      (self.scene.cameras[0].height, self.scene.cameras[0].width))

    def test_arrays_outlive_the_film(self):
        film = self.renderer.render(self.camera)
        expected = film.pixels.copy()
        pixels = film.pixels
        del film
        np.testing.assert_array_equal(pixels, expected)

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("film.png", "film.ppm", "film.pfm", "film.hdr", "film.exr"):
                path = pathlib.Path(folder) / name
                self.film.save(path)
                self.assertGreater(path.stat().st_size, 100)
            values = (pathlib.Path(folder) / "film.ppm").read_text().split()[4:]
            np.testing.assert_array_equal(read_png(self.film._repr_png_()).reshape(-1), np.array(values, int))
            np.testing.assert_array_equal(read_png((pathlib.Path(folder) / "film.png").read_bytes()),
                                          read_png(self.film._repr_png_()))
            self.film.save(pathlib.Path(folder) / "depth.pfm", plane="depth")
            with self.assertRaisesRegex(castor.UsageError, "png"):
                self.film.save(pathlib.Path(folder) / "film.gif")
            missing = pathlib.Path(folder) / "missing/film.png"
            with self.assertRaises(castor.FileError) as caught:
                self.film.save(missing)
            self.assertIsInstance(caught.exception, OSError)
            self.assertIn("film.png", caught.exception.filename)

    def test_a_checkpoint_is_gone_on_from(self):
        class Enough(Exception):
            pass

        def stop(fraction):
            if fraction > 0:
                raise Enough

        camera = self.scene.cameras[0].resized(600, 400)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "picture.checkpoint"
            with self.assertRaises(Enough):
                self.renderer.render(camera, samples_per_pixel=64, checkpoint=path, progress=stop)
            resumed = self.renderer.render(camera, samples_per_pixel=64, resume=path)
        self.assertGreater(self.renderer.statistics["samples_resumed"], 0)
        whole = self.renderer.render(camera, samples_per_pixel=64)
        np.testing.assert_array_equal(resumed.pixels, whole.pixels)

    def test_wrong_arguments(self):
        for call, message in (
            (lambda: self.renderer.render(99), "camera: found 99, expected"),
            (lambda: self.renderer.render("0"), "camera: found str"),
            (lambda: self.renderer.render(self.camera, filter="mitchell"), "filter: found 'mitchell', expected one of"),
            (lambda: self.renderer.render(self.camera, rules="r1999"), "rules: found"),
        ):
            with self.subTest(message), self.assertRaisesRegex(castor.UsageError, message):
                call()
        for wrong in ({"gaze": (0, 0, 0)}, {"width": 0}, {"distance": 0}, {"up": (0, 1)}):
            with self.assertRaisesRegex(castor.UsageError, f"{next(iter(wrong))}: found"):
                self.renderer.render(castor.Camera(**wrong))
        with self.assertRaises(castor.SceneError):
            self.renderer.render(castor.Camera(gaze=(0, 1, 0)))  # parallel to up
        with self.assertRaisesRegex(castor.UsageError, "fov_y_degrees: found 180"):
            castor.Camera.look_at((0, 0, 1), (0, 0, 0), fov_y_degrees=180)

    def test_a_scene_that_a_program_made(self):
        scene = castor.Scene.from_mesh(*sphere(), smooth=True)
        scene.add_default_view()
        film = castor.Renderer(scene).render(scene.cameras[0].resized(32, 32))
        self.assertGreater(film.pixels[16, 16].sum(), film.pixels[0, 0].sum())


if __name__ == "__main__":
    unittest.main()
