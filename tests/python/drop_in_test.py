#!/usr/bin/env python3
"""castor.trimesh and castor.open3d, which need neither trimesh nor Open3D: a mesh is whatever has a mesh's arrays."""

import copy
import pickle
import unittest

import castor
import castor.open3d
import castor.trimesh
import numpy as np
from shapes import box, random_rays, sphere


class Mesh:
    """What RayMeshIntersector needs of a trimesh.Trimesh."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)

    @property
    def bounds(self):
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def __hash__(self):
        return hash(self.vertices.tobytes() + self.faces.tobytes())


class Trimesh(unittest.TestCase):
    def setUp(self):
        self.ray = castor.trimesh.RayMeshIntersector(Mesh(*box()))
        self.origins = np.array([[0.25, 0.5, 3], [0.25, 0.5, 0.5], [9, 9, 9], [0.3, 0.4, -2]])
        self.directions = np.array([[0, 0, -2], [0, 0, 1], [1, 0, 0], [0, 0, 5.0]])

    def test_every_hit(self):
        triangles, rays, points = self.ray.intersects_id(self.origins, self.directions, return_locations=True)
        self.assertEqual([a.dtype.name for a in (triangles, rays, points)], ["int64", "int64", "float64"])
        self.assertEqual(rays.tolist(), [0, 1, 3, 0, 3])  # the first hits of all rays, then the second ones
        np.testing.assert_array_equal(points, [[0.25, 0.5, 1], [0.25, 0.5, 1], [0.3, 0.4, 0], [0.25, 0.5, 0],
                                               [0.3, 0.4, 1]])
        swapped = self.ray.intersects_location(self.origins, self.directions)
        for found, expected in zip(swapped, (points, rays, triangles)):
            np.testing.assert_array_equal(found, expected)
        self.assertEqual(len(self.ray.intersects_id(self.origins, self.directions)), 2)

    def test_the_first_hit(self):
        first = self.ray.intersects_first(self.origins, self.directions)
        triangles, rays = self.ray.intersects_id(self.origins, self.directions, multiple_hits=False)
        self.assertEqual(rays.tolist(), [0, 1, 3])
        self.assertEqual(first.tolist(), [triangles[0], triangles[1], -1, triangles[2]])
        self.assertEqual(self.ray.intersects_any(self.origins, self.directions).tolist(), [True, True, False, True])
        for most, expected in ((0, []), (1, [0, 1, 3]), (2, [0, 1, 3, 0, 3])):
            self.assertEqual(self.ray.intersects_id(self.origins, self.directions, max_hits=most)[1].tolist(), expected)

    def test_edges_and_vertices_are_crossed_once(self):
        vertices, triangles = sphere()
        ray = castor.trimesh.RayMeshIntersector(Mesh(vertices, triangles))
        _, rays = ray.intersects_id(np.zeros_like(vertices), vertices)
        np.testing.assert_array_equal(np.bincount(rays), np.ones(len(vertices)))

    def test_points_inside(self):
        random = np.random.default_rng(3)
        for shift, scale in ((0, 1), (1e6, 1), (0, 1e-4), (-1e4, 1e3)):
            vertices, triangles = sphere()
            mesh = Mesh(vertices.astype(np.float64) * scale + shift, triangles)
            ray = castor.trimesh.RayMeshIntersector(mesh)
            points = random.uniform(-1.2, 1.2, (3000, 3))
            radius = np.linalg.norm(points, axis=1)
            clear = np.abs(radius - 0.995) > 0.006  # the surface lies between these radii
            inside = ray.contains_points(points * scale + shift)
            np.testing.assert_array_equal(inside[clear], radius[clear] < 0.995)
        self.assertEqual(self.ray.contains_points(np.empty((0, 3))).tolist(), [])

    def test_an_open_mesh_has_an_outside(self):
        vertices, triangles = box()
        ray = castor.trimesh.RayMeshIntersector(Mesh(vertices, triangles[1:]))
        points = np.random.default_rng(4).uniform(0.1, 0.9, (500, 3))
        inside = ray.contains_points(points)
        self.assertGreater(inside.mean(), 0.5)
        self.assertFalse(ray.contains_points(points + 1.5).any())

    def test_a_mesh_that_changes_is_built_anew(self):
        self.assertTrue(self.ray.intersects_any([[0.5, 0.4, 3]], [[0, 0, -1]])[0])
        self.ray.mesh.vertices += 5
        self.assertFalse(self.ray.intersects_any([[0.5, 0.4, 3]], [[0, 0, -1]])[0])

    def test_copies(self):
        expected = self.ray.intersects_first(self.origins, self.directions).tolist()
        for other in (copy.copy(self.ray), copy.deepcopy(self.ray), pickle.loads(pickle.dumps(self.ray))):
            self.assertEqual(other.intersects_first(self.origins, self.directions).tolist(), expected)

    def test_wrong_rays(self):
        for origins, directions in ((self.origins[:2], self.directions), (self.origins[:, :2], self.directions[:, :2]),
                                    ("a", "b")):
            with self.assertRaises(castor.UsageError):
                self.ray.intersects_id(origins, directions)
        self.assertEqual(len(self.ray.intersects_first(np.empty((0, 3)), np.empty((0, 3)))), 0)
        self.assertFalse(self.ray.intersects_any([[0.5, 0.5, 0.5]], [[0, 0, 0]])[0])


class Open3D(unittest.TestCase):
    def setUp(self):
        self.scene = castor.open3d.RaycastingScene()
        self.rays = np.array([[0.25, 0.5, -1, 0, 0, 1], [0.25, 0.5, 0.5, 0, 0, 2], [10, 10, 10, 1, 0, 0]], np.float32)

    def fill(self):
        vertices, triangles = box()
        self.assertEqual(self.scene.add_triangles(vertices, triangles), 0)
        self.assertEqual(self.scene.add_triangles(vertices + np.float32(3), triangles), 1)

    def test_nearest_hits(self):
        empty = self.scene.cast_rays(self.rays)
        self.assertTrue(np.all(empty["geometry_ids"] == castor.open3d.RaycastingScene.INVALID_ID))
        self.fill()
        rays = np.concatenate((self.rays, [[3.25, 3.5, 2, 0, 0, 0.5]])).astype(np.float32)
        found = self.scene.cast_rays(rays)
        self.assertEqual({name: array.dtype.name for name, array in found.items()},
                         {"t_hit": "float32", "geometry_ids": "uint32", "primitive_ids": "uint32",
                          "primitive_uvs": "float32", "primitive_normals": "float32"})
        self.assertEqual(found["t_hit"].tolist(), [1, 0.25, np.inf, 2])
        invalid = castor.open3d.RaycastingScene.INVALID_ID
        self.assertEqual(found["geometry_ids"].tolist(), [0, 0, invalid, 1])
        self.assertEqual(found["primitive_ids"][2], invalid)
        self.assertEqual(found["primitive_ids"][0], found["primitive_ids"][3])
        self.assertEqual(found["primitive_normals"].tolist(), [[0, 0, -1], [0, 0, 1], [0, 0, 0], [0, 0, -1]])

    def test_other_calls(self):
        self.fill()
        self.assertEqual(self.scene.test_occlusions(self.rays).tolist(), [True, True, False])
        self.assertEqual(self.scene.test_occlusions(self.rays, tnear=0.5).tolist(), [True, False, False])
        self.assertEqual(self.scene.test_occlusions(self.rays, tfar=0.5).tolist(), [False, True, False])
        counts = self.scene.count_intersections(self.rays)
        self.assertEqual((counts.dtype.name, counts.tolist()), ("int32", [2, 1, 0]))
        listed = self.scene.list_intersections(self.rays)
        self.assertEqual(listed["ray_splits"].tolist(), [0, 2, 3, 3])
        self.assertEqual(listed["ray_ids"].tolist(), [0, 0, 1])
        self.assertEqual(listed["t_hit"].tolist(), [1, 2, 0.25])
        self.assertEqual(listed["primitive_uvs"].shape, (3, 2))
        points = np.array([[[0.5, 0.5, 0.5], [-0.5, 0.5, 0.5]], [[3.1, 3.2, 3.3], [2, 2, 2]]], np.float32)
        for samples in (1, 3, 11):
            inside = self.scene.compute_occupancy(points, nsamples=samples)
            self.assertEqual((inside.dtype.name, inside.tolist()), ("float32", [[1, 0], [1, 0]]))

    def test_shapes_are_kept(self):
        self.fill()
        rays = random_rays(30).reshape(2, 3, 5, 6)
        for name, array in self.scene.cast_rays(rays).items():
            self.assertEqual(array.shape[:3], (2, 3, 5), name)
        self.assertEqual(self.scene.count_intersections(rays).shape, (2, 3, 5))

    def test_rays_of_a_pinhole(self):
        rays = castor.open3d.RaycastingScene.create_rays_pinhole(90, [0, 0, 1], [0, 0, 0], [0, -1, 0], 4, 2)
        self.assertEqual(rays.shape, (2, 4, 6))
        np.testing.assert_allclose(rays[0, 0, 3:], [0.75, 0.25, 1], atol=1e-6)
        np.testing.assert_allclose(rays[1, 3, 3:], [-0.75, -0.25, 1], atol=1e-6)

    def test_wrong_arguments(self):
        self.fill()
        for call, message in (
            (lambda: self.scene.cast_rays(self.rays.astype(float)), r"rays: found float64 of shape \(3, 6\)"),
            (lambda: self.scene.cast_rays(self.rays[0]), r"rays: found float32 of shape \(6,\)"),
            (lambda: self.scene.compute_occupancy(self.rays), "query_points: found"),
            (lambda: self.scene.compute_occupancy(self.rays[:, :3], nsamples=2), "nsamples: found 2, expected an odd"),
            (lambda: self.scene.add_triangles(np.eye(3), [[0, 1, 2]]), "vertices: found float64"),
            (lambda: self.scene.add_triangles(np.eye(3, dtype="f4")), "found ndarray without triangles"),
            (lambda: castor.open3d.RaycastingScene(device="CUDA:0"), "device: found CUDA:0, expected CPU:0"),
        ):
            with self.subTest(message), self.assertRaisesRegex(castor.UsageError, message):
                call()
        with self.assertRaisesRegex(AttributeError, "compute_distance"):
            self.scene.compute_distance(self.rays[:, :3])


if __name__ == "__main__":
    unittest.main()
