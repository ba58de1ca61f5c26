"""Runs Castor and Embree on the same files of rays, in one sitting and in turns. Used by scripts/compare_throughput."""

import json
import os
import pathlib
import statistics
import subprocess
from dataclasses import dataclass, field

import numpy

HIT = numpy.dtype([("t", "<f4"), ("u", "<f4"), ("v", "<f4"), ("primitive", "<u4"), ("instance", "<u4")])
BYTES_A_RAY = 32


class Failure(Exception):
    """Something that the user must know; its text is a sentence."""


def run_json(command, environment=None, given=None):
    """The JSON document that the command prints. `given`: a document that it reads."""
    result = subprocess.run(
        [str(part) for part in command],
        env={**os.environ, **(environment or {})},
        input=None if given is None else json.dumps(given),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    if result.returncode != 0:
        raise Failure(f"{' '.join(map(str, command))}\nended with status {result.returncode}:\n{result.stderr.strip()}")
    return json.loads(result.stdout)


def rate(rays, seconds):
    return rays / seconds / 1e6


@dataclass
class Programs:
    castor: pathlib.Path
    embree_trace: pathlib.Path
    folder: pathlib.Path  # for hits and cut files of rays


@dataclass
class Task:
    """A file of rays for a scene."""

    scene_file: str
    ray_file: str
    ray_count: int
    query: str
    hint: str


@dataclass
class Round:
    """The median rates, in Mray/s, of one call of each program."""

    castor: float
    embree: dict  # by the width of the calls

    @property
    def embree_best(self):
        return max(self.embree.values())


@dataclass
class Duel:
    """What both did with one task."""

    rounds: list = field(default_factory=list)
    castor_seconds: list = field(default_factory=list)
    embree_seconds: dict = field(default_factory=dict)
    castor_build_seconds: list = field(default_factory=list)
    embree_build_seconds: list = field(default_factory=list)
    strategy: str = ""
    embree_version: str = ""
    differing: int = 0  # rays with another primitive: mostly those that meet an edge
    far_apart: int = 0  # of them, those whose distances differ too
    ray_count: int = 0

    @property
    def castor_rate(self):
        return rate(self.ray_count, statistics.median(self.castor_seconds))

    @property
    def embree_rates(self):
        return {width: rate(self.ray_count, statistics.median(s)) for width, s in self.embree_seconds.items()}

    @property
    def embree_rate(self):
        return max(self.embree_rates.values())

    @property
    def ratios(self):
        """Of each round: what disturbs a round disturbs both programs."""
        return [r.castor / r.embree_best for r in self.rounds]

    @property
    def ratio(self):
        return statistics.median(self.ratios)

    @property
    def ratio_spread(self):
        return min(self.ratios), max(self.ratios)


def compare_hits(castor_file, embree_file, query):
    """How many rays have another primitive, and how many of these another distance as well."""
    castor, embree = numpy.fromfile(castor_file, HIT), numpy.fromfile(embree_file, HIT)
    if len(castor) != len(embree):
        raise Failure(f"{castor_file} has {len(castor)} hits and {embree_file} has {len(embree)}")
    differing = castor["primitive"] != embree["primitive"]
    if query == "any":
        return int(differing.sum()), int(differing.sum())
    a, b = castor["t"][differing].astype(float), embree["t"][differing].astype(float)
    with numpy.errstate(invalid="ignore"):
        near = numpy.abs(a - b) <= 1e-3 * numpy.maximum(numpy.abs(a), numpy.abs(b))
    return int(differing.sum()), int((~near | ~numpy.isfinite(a) | ~numpy.isfinite(b)).sum())


def duel(programs, task, device, rounds, repeat, threads, castor_threads=None):
    """Both programs, `rounds` times; who begins changes. `castor_threads` limits PoCL's threads."""
    castor_hits, embree_hits = programs.folder / "castor.hits", programs.folder / "embree.hits"
    common = [task.scene_file, "--rays", task.ray_file, "--query", task.query, "--hint", task.hint, "--repeat", repeat]
    environment = {"POCL_MAX_PTHREAD_COUNT": str(castor_threads)} if castor_threads else {}

    def run_castor():
        return run_json(
            [programs.castor, "trace", *common, "--hits", castor_hits, "--device", device, "--json", "--quiet"],
            environment,
        )

    def run_embree():
        return run_json([programs.embree_trace, *common, "--hits", embree_hits, "--threads", threads])

    result = Duel(ray_count=task.ray_count)
    for number in range(rounds):
        if number % 2 == 0:
            castor, embree = run_castor(), run_embree()
        else:
            embree = run_embree()
            castor = run_castor()
        result.castor_seconds += castor["seconds"]
        result.castor_build_seconds.append(castor["build_seconds"])
        result.embree_build_seconds.append(embree["build_seconds"])
        for width, seconds in embree["seconds"].items():
            result.embree_seconds.setdefault(width, []).extend(seconds)
        result.rounds.append(
            Round(
                rate(task.ray_count, statistics.median(castor["seconds"])),
                {width: rate(task.ray_count, statistics.median(s)) for width, s in embree["seconds"].items()},
            )
        )
        result.strategy = castor["strategy"]
        result.embree_version = embree["embree_version"]
    result.differing, result.far_apart = compare_hits(castor_hits, embree_hits, task.query)
    return result


def task_of(measured):
    """From a result of `castor bench`."""
    return Task(
        measured["scene_file"], measured["ray_file"], measured["ray_count"], measured["query"], measured["hint"]
    )


def make_rays(programs, scenes, rays, size, device, name):
    """The document of `castor bench`, which checks every answer, and its files of rays in a folder of that name."""
    return run_json(
        [
            programs.castor,
            "bench",
            *scenes,
            "--rays",
            ",".join(rays),
            "--size",
            size,
            "--repeat",
            1,
            "--device",
            device,
            "--save-rays",
            programs.folder / name,
            "--json",
            "--quiet",
        ]
    )


def measure_packages(python, build, measured, work):
    """What throughput_packages.py tells, started with that Python, of the rays of results of `castor bench`."""
    tasks = [{key: m[key] for key in ("scene_file", "ray_file", "query", "hint", "device_index")} for m in measured]
    script = pathlib.Path(__file__).with_name("throughput_packages.py")
    environment = {"PYTHONPATH": str((build / "host/python").resolve())}
    return run_json([python, script], environment, {**work, "tasks": tasks})


def cut_task(programs, task, count):
    """The first `count` rays of a task."""
    file = programs.folder / "cut.rays"
    with open(task.ray_file, "rb") as rays:
        file.write_bytes(rays.read(count * BYTES_A_RAY))
    return Task(task.scene_file, str(file), count, task.query, task.hint)


def measure_kernels(programs, size, repeat, device):
    """The single kernels of `castor bench --kernels`, whose answers are checked too."""
    return run_json(
        [
            programs.castor,
            "bench",
            "--kernels",
            "--size",
            size,
            "--repeat",
            repeat,
            "--device",
            device,
            "--json",
            "--quiet",
        ]
    )["kernels"]
