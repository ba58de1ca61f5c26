"""Casts the same rays at the same mesh with Castor's Python package, with trimesh over embreex, and with Open3D, in one
process and in turns. Used by scripts/compare_throughput, which starts it with the Python that has these packages:

    PYTHONPATH=build/release/host/python PYTHON scripts/throughput_packages.py < tasks.json

Reads {"rounds", "repeat", "threads", "tasks": [{"scene_file", "ray_file", "query", "hint", "device_index"}]} and prints
{"packages": {name: version}, "missing": {name: why}, "results": [...]}: for each task a list of results, one for each
query; it is empty where the scene is no PLY file of triangles alone.

These packages know no range of a ray: of each ray of the file, origin and direction are taken, and all of [0, inf].
"""

import json
import os
import statistics
import sys
import time

import numpy as np

# Where a ray is so close to an edge of the triangle that it hits, relative to the triangle, rounding may choose between
# this triangle and its neighbour.
EDGE = 1e-4
# Answers whose distances differ by no more, relatively, are of the same place: of an edge, or of faces that touch.
SAME_DISTANCE = 1e-3
NONE = -1


class CastorCaster:
    def __init__(self, castor, vertices, triangles, task, _threads, device):
        self.tracer = castor.Tracer(castor.Scene.from_mesh(vertices, triangles), devices=device)
        self.rays, self.coherent = castor.make_rays(task.origins, task.directions), task.hint == "coherent"
        self.calls = {"closest": self.tracer.closest_hit, "any": self.tracer.any_hit, "count": self.tracer.count}

    def cast(self, query):
        return self.calls[query](self.rays, coherent=self.coherent)

    @staticmethod
    def answers(query, hits):
        if query != "closest":
            return hits.astype(np.int64)
        return np.where(np.isinf(hits["t"]), NONE, hits["primitive"].astype(np.int64))


class TrimeshCaster:
    """One thread: embreex has no more."""

    def __init__(self, packages, vertices, triangles, task, _threads, _device):
        trimesh, intersector = packages
        self.mesh = trimesh.Trimesh(vertices, triangles, process=False)
        self.caster = intersector(self.mesh)
        self.origins, self.directions = task.origins.astype(np.float64), task.directions.astype(np.float64)
        self.calls = {"closest": self.caster.intersects_first, "any": self.caster.intersects_any}

    def cast(self, query):
        return self.calls[query](self.origins, self.directions)

    @staticmethod
    def answers(_query, found):
        return np.asarray(found).astype(np.int64)


class Open3dCaster:
    def __init__(self, open3d, vertices, triangles, task, threads, _device):
        self.scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
        self.scene.add_triangles(open3d.core.Tensor(vertices), open3d.core.Tensor(triangles))
        self.rays = open3d.core.Tensor(np.hstack((task.origins, task.directions)))
        self.threads = threads
        self.calls = {
            "closest": self.scene.cast_rays,
            "any": self.scene.test_occlusions,
            "count": self.scene.count_intersections,
        }

    def cast(self, query):
        return self.calls[query](self.rays, nthreads=self.threads)

    @staticmethod
    def answers(query, found):
        if query != "closest":
            return found.numpy().astype(np.int64)
        primitives = found["primitive_ids"].numpy().astype(np.int64)
        return np.where(np.isinf(found["t_hit"].numpy()), NONE, primitives)


def import_trimesh():
    import embreex
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    return (trimesh, RayMeshIntersector), f"{trimesh.__version__} with embreex {embreex.__version__}"


def import_open3d():
    import open3d

    return open3d, open3d.__version__


CASTERS = {"trimesh": (import_trimesh, TrimeshCaster), "open3d": (import_open3d, Open3dCaster)}


class Task:
    """The origins and directions of a file of rays, and whether neighbours are alike."""

    def __init__(self, ray_file, hint):
        self.hint = hint
        rays = np.fromfile(ray_file, np.float32).reshape(-1, 8)
        self.origins = np.ascontiguousarray(rays[:, 0:3])
        self.directions = np.ascontiguousarray(rays[:, 4:7])
        lengths = np.linalg.norm(self.directions.astype(np.float64), axis=1, keepdims=True)
        self.directions = (self.directions / lengths).astype(np.float32)


def read_ply(path):
    """Vertices (n, 3) float32 and triangles (m, 3) uint32 of a PLY file that has only these, as castor writes them;
    None for another file."""
    with open(path, "rb") as file:
        head = []
        while not head or head[-1] != "end_header":
            line = file.readline()
            if not line or (not head and line.strip() != b"ply"):
                return None
            head.append(line.decode("latin-1").strip())
        data = file.read()
    properties = [line for line in head if line.startswith("property")]
    counts = [int(line.split()[2]) for line in head if line.startswith("element")]
    if (
        "format binary_little_endian 1.0" not in head
        or properties[:3] != [f"property float {axis}" for axis in "xyz"]
        or len(properties) != 4
        or properties[3].split()[:4] not in (["property", "list", "uchar", kind] for kind in ("int", "uint"))
    ):
        return None
    vertices = np.frombuffer(data, np.float32, 3 * counts[0]).reshape(-1, 3)
    faces = np.dtype([("count", "u1"), ("corners", "<u4", 3)])
    if len(data) != vertices.nbytes + counts[1] * faces.itemsize:
        return None
    triangles = np.frombuffer(data, faces, counts[1], vertices.nbytes)
    return (vertices, np.ascontiguousarray(triangles["corners"])) if (triangles["count"] == 3).all() else None


def meeting(vertices, triangles, task, rays, primitives):
    """Where rays meet the planes of their triangles, in double precision: the distances, and how far inside of the
    triangles: the least barycentric coordinate. NaN without a triangle."""
    p0, p1, p2 = (vertices[triangles[primitives, corner]].astype(np.float64) for corner in range(3))
    origin, direction = task.origins[rays].astype(np.float64), task.directions[rays].astype(np.float64)
    e1, e2 = p1 - p0, p2 - p0
    across = np.cross(direction, e2)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1 / np.einsum("ij,ij->i", e1, across)
        from_p0 = origin - p0
        u = np.einsum("ij,ij->i", from_p0, across) * scale
        along = np.cross(from_p0, e1)
        v = np.einsum("ij,ij->i", direction, along) * scale
        t = np.einsum("ij,ij->i", e2, along) * scale
        inside = np.minimum(np.minimum(u, v), 1 - u - v)
    nothing = primitives == NONE
    return np.where(nothing, np.nan, t), np.where(nothing, np.nan, inside)


def differences(mesh, task, query, castor, other):
    """How many answers differ, and why."""
    rays = np.flatnonzero(castor != other)
    found = {"differing": len(rays)}
    if query == "any":
        return {**found, "only_castor": int(castor[rays].sum()), "only_package": int(other[rays].sum())}
    if query == "count":
        return {
            **found,
            "package_more": int((other[rays] > castor[rays]).sum()),
            "package_fewer": int((other[rays] < castor[rays]).sum()),
            "parity": int((castor[rays] % 2 != other[rays] % 2).sum()),
        }
    t_castor, in_castor = meeting(*mesh, task, rays, castor[rays])
    t_other, in_other = meeting(*mesh, task, rays, other[rays])
    extent = np.ptp(mesh[0], axis=0).max()
    missed = other[rays] == NONE
    only_package = castor[rays] == NONE
    both = ~missed & ~only_package
    with np.errstate(invalid="ignore"):
        same = both & (np.abs(t_castor - t_other) <= SAME_DISTANCE * np.maximum(np.abs(t_castor), 1e-3 * extent))
        at_origin = np.fmin(np.abs(t_castor), np.abs(t_other)) <= 1e-5 * extent
        at_edge = np.fmin(np.abs(in_castor), np.abs(in_other)) <= EDGE
    left = ~same
    why = {"same_distance": same}
    for name, which in (("at_origin", at_origin), ("at_edge", at_edge), ("other", np.ones_like(same))):
        why[name] = left & which
        left &= ~which
    return {
        **found,
        "missed": int(missed.sum()),
        "only_package": int(only_package.sum()),
        "why": {name: int(which.sum()) for name, which in why.items()},
    }


def seconds_of(caster, query, repeat):
    """The times of some casts, and the answer of the last."""
    seconds = []
    for _ in range(repeat):
        start = time.perf_counter()
        answer = caster.cast(query)
        seconds.append(time.perf_counter() - start)
    return seconds, answer


def contest(casters, mesh, task, query, rounds, repeat):
    """All that can be asked this, `rounds` times; who begins changes."""
    names = [name for name, caster in casters.items() if query in caster.calls]
    seconds = {name: [] for name in names}
    answers = {}
    for name in names:
        casters[name].cast(query)  # kernels are compiled, trees are built
    for number in range(rounds):
        for name in names[number % len(names) :] + names[: number % len(names)]:
            taken, answers[name] = seconds_of(casters[name], query, repeat)
            seconds[name].append(statistics.median(taken))
    castor = casters["castor"].answers(query, answers["castor"])
    ray_count = len(task.origins)
    rate = {name: ray_count / statistics.median(taken) / 1e6 for name, taken in seconds.items()}
    result = {"query": query, "ray_count": ray_count, "castor_mrays_per_second": rate["castor"], "packages": {}}
    for name in names[1:]:
        ratios = [theirs / ours for ours, theirs in zip(seconds["castor"], seconds[name])]
        result["packages"][name] = {
            "mrays_per_second": rate[name],
            "ratio": statistics.median(ratios),
            "ratio_spread": [min(ratios), max(ratios)],
            **differences(mesh, task, query, castor, casters[name].answers(query, answers[name])),
        }
    return result


def measure(castor, found, asked, work):
    """The results of a task: its query, and where Open3D is, counts too."""
    mesh = read_ply(asked["scene_file"])
    if mesh is None:
        return []
    task = Task(asked["ray_file"], asked["hint"])
    makers = {"castor": (CastorCaster, castor), **{name: (CASTERS[name][1], made) for name, made in found.items()}}
    casters = {
        name: make(package, *mesh, task, work["threads"], str(asked["device_index"]))
        for name, (make, package) in makers.items()
    }
    queries = [asked["query"]] + (["count"] if "open3d" in found and asked["query"] == "closest" else [])
    return [contest(casters, mesh, task, query, work["rounds"], work["repeat"]) for query in queries]


def main():
    # Packages print what they like; the document goes where standard output was.
    output = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    found, versions, missing = {}, {}, {}
    for name, (import_package, _) in CASTERS.items():
        try:
            found[name], versions[name] = import_package()
        except (ImportError, OSError) as error:
            missing[name] = str(error)
    document = {"packages": versions, "missing": missing, "results": []}
    if found:
        try:
            import castor
        except ImportError as error:
            document.update(packages={}, missing={**missing, "castor": str(error)})
        else:
            work = json.load(sys.stdin)
            document["results"] = [measure(castor, found, task, work) for task in work["tasks"]]
    json.dump(document, output)


if __name__ == "__main__":
    main()
