#!/usr/bin/env python3
"""Renderers and films, by the package in PYTHONPATH."""

import os
import pathlib
import tempfile
import unittest
import unittest.mock

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

    def test_tone_maps_make_8_bits(self):
        # The photographic operator in double precision; see castor/scene.h.
        pixels = self.film.pixels.astype(np.float64).clip(0)
        luminance = pixels @ [0.2126, 0.7152, 0.0722]
        scaled = 0.18 * luminance / np.exp(np.log(1e-6 + luminance).mean())
        white = np.sort(scaled, axis=None)[int((scaled.size - 1) * (1 - 1.0 / 100))]
        display = scaled * (1 + scaled / white**2) / (1 + scaled)
        ratio = np.divide(pixels, luminance[..., None], out=np.zeros_like(pixels), where=luminance[..., None] > 0)
        expected = 255 * (display[..., None] * ratio).clip(0, 1) ** (1 / np.float64(np.float32(2.2)))
        mapped = self.film.tone_map()
        self.assertEqual((mapped.shape, mapped.dtype), ((40, 60, 3), np.uint8))
        self.assertLessEqual(np.abs(mapped + 0.5 - expected).max(), 0.5 + 1e-3)
        grey = self.film.tone_map("aces", key=0.3, burn_percent=0, saturation=0, gamma="sRGB")
        np.testing.assert_array_equal(grey[..., 0], grey[..., 2])
        self.assertEqual(grey.max(), 255)
        for wrong in ({"operator": "reinhard"}, {"key": 0}, {"gamma": 0}, {"gamma": "linear"}, {"burn_percent": 101},
                      {"saturation": -1}):
            with self.assertRaises(castor.UsageError):
                self.film.tone_map(**wrong)

    def test_cameras_have_the_tone_maps_of_a_file(self):
        scene = castor.Scene.load(SCENES / "tone.xml")
        maps = scene.cameras[0].tone_maps
        self.assertEqual([each.operator for each in maps], ["photographic", "aces", "filmic"])
        again = castor.Scene()
        again.add_camera(castor.Camera())
        camera = castor.Camera(tone_maps=[castor.ToneMap("filmic", key=0.5, gamma="sRGB", extension="_f.png"), *maps])
        again.add_camera(camera)
        self.assertEqual(list(again.cameras[0].tone_maps), [])
        self.assertEqual(again.cameras[1].tone_maps, camera.tone_maps)
        self.assertEqual(again.cameras[1].resized(8, 8).tone_maps, camera.tone_maps)
        aces = castor.ToneMap("aces", key=0.3, burn_percent=0, saturation=0, gamma="sRGB")
        np.testing.assert_array_equal(
            self.film.tone_map(aces), self.film.tone_map("aces", key=0.3, burn_percent=0, saturation=0, gamma="sRGB"))

    def test_path_traced_pictures_have_groups_of_lights_and_stop_at_noise(self):
        film = self.renderer.render(self.camera, integrator="path", samples_per_pixel=64, noise=0.05, sample_order="z",
                                    light_groups={"key": [0]}, planes=["samples"])
        self.assertEqual(list(film.planes), ["samples", "group-key", "group-rest"])
        self.assertEqual(self.scene.find_lights("PointLight-1", "0"), [0])
        with self.assertRaisesRegex(castor.UsageError, 'there is no light "Key".*"PointLight-1"'):
            self.scene.find_lights("Key")
        self.assertLess(film["samples"].min(), 64)
        np.testing.assert_allclose(film["group-key"] + film["group-rest"], film.pixels, rtol=1e-5, atol=1e-4)
        film = self.renderer.render(self.camera, integrator="path", samples_per_pixel=64, stop_after=1e-9)
        self.assertLess(film.samples_per_pixel, 64)
        with self.assertRaisesRegex(castor.UsageError, "noise of -1"):
            self.renderer.render(self.camera, samples_per_pixel=64, noise=-1.0)
        for of_zero in ({"noise": 0.0}, {"stop_after": 0}):
            with self.assertRaisesRegex(castor.UsageError, "found 0, expected a number above 0"):
                self.renderer.render(self.camera, samples_per_pixel=64, **of_zero)
        with self.assertRaisesRegex(castor.UsageError, "sample_order"):
            self.renderer.render(self.camera, sample_order="hilbert")
        with self.assertRaisesRegex(castor.UsageError, "the light 9"):
            self.renderer.render(self.camera, integrator="path", light_groups={"key": [9]})

    def test_noise_is_removed_by_either_denoiser(self):
        library = os.environ.get("CASTOR_TEST_OIDN")
        if not library:
            self.skipTest("CASTOR_TEST_OIDN names no library; ctest sets it")
        path = {"integrator": "path", "samples_per_pixel": 4}
        noisy = self.renderer.render(self.camera, **path)
        own = self.renderer.render(self.camera, denoise=True, planes=["noisy"], **path)
        np.testing.assert_array_equal(own["noisy"], noisy.pixels)
        named = self.renderer.render(self.camera, denoiser="castor", **path)
        np.testing.assert_array_equal(named.pixels, own.pixels)
        self.assertEqual(self.renderer.statistics["oidn_version"], 0)
        with self.assertRaisesRegex(castor.UsageError, "denoiser: found 'optix', expected one of castor, oidn"):
            self.renderer.render(self.camera, denoiser="optix")
        with unittest.mock.patch.dict(os.environ, CASTOR_OIDN_LIBRARY="/dev/null"):
            with self.assertRaisesRegex(castor.UsageError, "Open Image Denoise cannot be loaded"):
                self.renderer.render(self.camera, denoiser="oidn", **path)
        with unittest.mock.patch.dict(os.environ, CASTOR_OIDN_LIBRARY=library):
            film = self.renderer.render(self.camera, denoiser="oidn", planes=["mean-albedo", "mean-normal"], **path)
            self.assertEqual(self.renderer.statistics["oidn_version"], 20303)
            # What the stand-in makes of the film: tests/support/oidn_stand_in.cpp.
            expected = (noisy.pixels * (0.5 * film["mean-albedo"][..., :3] + 0.25) + (0.5 * film["mean-normal"] + 0.25))
            np.testing.assert_allclose(film.pixels, expected, rtol=1e-5, atol=1e-5)
            with unittest.mock.patch.dict(os.environ, OIDN_STAND_IN_FAILS="oidnExecuteFilter"):
                with self.assertRaisesRegex(castor.DeviceError, "out of luck") as caught:
                    self.renderer.render(self.camera, denoiser="oidn", **path)
            np.testing.assert_array_equal(caught.exception.film.pixels, noisy.pixels)

    def test_lights_have_planes_whose_sum_is_the_picture(self):
        film = self.renderer.render(self.camera, planes=["depth", "lights"])
        names = [name for name in film.planes if name.startswith("light-")]
        self.assertEqual(names, ["light-0-point", "light-none"])
        np.testing.assert_array_equal(film.pixels, self.film.pixels)
        np.testing.assert_allclose(sum(film[name].astype(np.float64) for name in names), film.pixels, rtol=1e-5)
        self.assertTrue(all(film[name].any() for name in names))

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
            self.film.save(pathlib.Path(folder) / "layers.exr", layers=True)
            self.assertIn(b"depth.Z", (pathlib.Path(folder) / "layers.exr").read_bytes())
            with self.assertRaises(castor.UsageError):
                self.film.save(pathlib.Path(folder) / "layers.exr", plane="depth", layers=True)
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


class Surfaces(unittest.TestCase):
    def square(self, **texture):
        """A square that fills the picture, with a texture of which nothing but itself is seen."""
        scene = castor.Scene()
        picture = scene.add_image(np.array([[[255, 0, 0], [0, 255, 0]]], np.uint8), "two texels")
        material = scene.add_material(textures=[scene.add_texture(image=picture, target="replace_all", **texture)])
        scene.add_mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]], material=material,
                       texture_coordinates=[[0, 0], [1, 0], [1, 1], [0, 1]])
        scene.add_camera(castor.Camera((0, 0, 2), distance=2, window=(-0.9, 0.9, -0.9, 0.9), width=4, height=4))
        return scene

    def test_a_picture_is_seen_on_a_square(self):
        scene = self.square()
        self.assertEqual((scene.counts["images"], scene.counts["textures"]), (1, 1))
        pixels = castor.Renderer(scene).render(0).pixels
        np.testing.assert_array_equal(pixels[:, :2], np.broadcast_to([255, 0, 0], (4, 2, 3)))
        np.testing.assert_array_equal(pixels[:, 2:], np.broadcast_to([0, 255, 0], (4, 2, 3)))

    def test_wrong_surfaces_name_the_reason(self):
        with self.assertRaisesRegex(castor.UsageError, "filter: found 'cubic', expected one of nearest"):
            self.square(filter="cubic")
        with self.assertRaisesRegex(castor.UsageError, "normalizer: found 0.0"):
            self.square(normalizer=0.0)
        scene = castor.Scene()
        with self.assertRaisesRegex(castor.UsageError, "image: found int64 of shape"):
            scene.add_image(np.zeros((2, 2, 3), np.int64))
        with self.assertRaisesRegex(castor.SceneError, "none.png"):
            scene.add_image("none.png")
        with self.assertRaisesRegex(castor.UsageError, "brdf: found 'glass'"):
            scene.add_material(brdf="glass")
        with self.assertRaisesRegex(castor.UsageError, "the textures"):
            scene.set_background_texture(0)

    def test_principled_materials_are_kept(self):
        scene = castor.Scene()
        picture = scene.add_image(np.array([[[255, 0, 0, 128]]], np.uint8))
        texture = scene.add_texture(image=picture, target="principled", mirror=True, coordinate_set=1,
                                    transform=[[1, 0, 0.5], [0, 1, 0]])
        varnish = castor.PrincipledMaterial(metallic=0, clearcoat=1, clearcoat_normal_texture=texture)
        material = scene.add_principled_material(varnish, base_color_texture=texture, alpha_mode="mask",
                                                 iridescence=0.5)
        corners, ones = [[0, 0], [1, 0], [0, 1]], [[1, 0, 0, 1]] * 3
        scene.add_mesh([[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2]], material=material,
                       texture_coordinates=corners, texture_coordinates_1=corners, colors=ones, tangents=ones)
        scene.add_spot_light((0, 0, 1), (0, 0, -1), (1, 1, 1), square_falloff=True)
        self.assertEqual((scene.counts["materials"], scene.counts["textures"]), (1, 1))
        castor.Tracer(scene)
        with self.assertRaisesRegex(castor.UsageError, "alpha_mode: found 'glass', expected one of opaque"):
            scene.add_principled_material(alpha_mode="glass")
        with self.assertRaisesRegex(castor.UsageError, "transform: found 1 rows, expected 2"):
            scene.add_texture(image=picture, target="principled", transform=[[1, 0, 0]])
        with self.assertRaisesRegex(castor.UsageError, "colors: found 3, expected as many as vertices, 4"):
            scene.add_mesh(np.zeros((4, 3)), [[0, 1, 2]], colors=ones)
        scene.add_principled_material(metallic=2)
        with self.assertRaisesRegex(castor.SceneError, "metallic is 2"):
            castor.Tracer(scene)
        scene = castor.Scene()
        scene.add_principled_material(base_color=(1, 1, 1.5))
        with self.assertRaisesRegex(castor.SceneError, r"base colour is \(1, 1, 1.5\), expected numbers from 0 to 1"):
            castor.Tracer(scene)

    def test_lamps_and_lenses_are_kept(self):
        scene = self.square()
        scene.add_area_light((0, 2, 0), (0, -1, 0), 1, (9, 9, 9))
        scene.add_mesh_light(0)
        scene.add_sphere_light(scene.add_sphere((0, 0, -3), 1))
        scene.add_instance_light(scene.add_instance(0, np.eye(4)[:3] + [[0, 0, 0, 3]] * 3))
        scene.add_environment_light(0, "probe", cosine_sampling=True)
        scene.set_sphere_motions([[0, 1, 0]])
        scene.add_camera(castor.Camera((0, 0, 2), aperture_size=0.5, focus_distance=3))
        camera = scene.cameras[1]
        self.assertEqual((camera.aperture_size, camera.focus_distance), (0.5, 3))
        self.assertIsNone(camera.path_tracing)
        for tracing in (castor.PathTracing(), castor.PathTracing(False, True, False, None, None, 7.5, "uniform")):
            scene.add_camera(castor.Camera((0, 0, 2), path_tracing=tracing))
            self.assertEqual(scene.cameras[-1].path_tracing, tracing)
        self.assertEqual(scene.counts["lights"], 5)


if __name__ == "__main__":
    unittest.main()
