"""Runs Castor and other renderers on the same scenes, each in a process of its own, and compares their pictures. Used
by scripts/compare_renders."""

import glob
import importlib.util
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass, field

import numpy

from render_scenes import ALBEDO, WHITE, Failure, read_ply

LONGEST_SECONDS = 3600  # of one process
BLOCKS = 16  # pictures are compared by the means of 16 x 16 blocks
MOST_DIFFERENCE = 0.01  # of the picture's mean, beyond what noise explains
POVRAY_SCALE = 100  # its rays begin a fixed distance off a surface, which must be small beside the scene
POVRAY_FADE = 0.01 * POVRAY_SCALE
POVRAY_WHITE = 8  # radiance of the brightest pixel that its files hold


@dataclass
class Renderer:
    """One renderer beside Castor; those of one family come from one package."""

    key: str
    family: str
    name: str
    note: str  # how its rays differ from Castor's
    package: str = ""  # for pip; "" for a program
    module: str = ""
    hint: str = ""  # how to get it
    environment: dict = field(default_factory=dict)
    version: str = ""
    missing: str = ""  # "" where it was found


@dataclass
class Run:
    """Seconds of one process, the linear picture, and the version of what made it."""

    seconds: dict  # load, first, render, all
    picture: numpy.ndarray
    version: str
    rays: int = 0


def renderers():
    """All that this script knows."""
    mitsuba = (
        "takes as many shadow rays for a hit as there are lights, each to a light at random: as many rays as Castor, "
        "and more noise"
    )
    one_light = (
        "takes one shadow ray for a hit, to a light at random: two rays where Castor traces three, and more noise"
    )
    pip = {"mitsuba": ("mitsuba", "mitsuba"), "cycles": ("bpy", "bpy"), "luxcore": ("pyluxcore", "pyluxcore")}

    def python(key, family, name, note):
        package, module = pip[family]
        return Renderer(
            key, family, name, note, package, module, f"--install, or pip install --target FOLDER {package}"
        )

    return [
        python("mitsuba-llvm", "mitsuba", "Mitsuba, LLVM", mitsuba),
        python("mitsuba-scalar", "mitsuba", "Mitsuba, scalar", mitsuba),
        python("cycles", "cycles", "Cycles", one_light),
        python("luxcore", "luxcore", "LuxCore", one_light),
        Renderer(
            "povray",
            "povray",
            "POV-Ray",
            "takes a square number of samples, on a grid, after one through the pixel's centre; all lights for each",
            hint="apt-get install povray",
        ),
    ]


FAMILIES = list(dict.fromkeys(renderer.family for renderer in renderers()))


def find_llvm():
    """The newest LLVM library, or ""."""
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return os.environ["DRJIT_LIBLLVM_PATH"]
    found = {}
    for file in glob.glob("/usr/lib/*/libLLVM*.so*") + glob.glob("/usr/lib*/llvm*/lib*/libLLVM*.so*"):
        match = re.search(r"libLLVM(?:-|\.so\.)(\d+)", file)
        if match:
            found[int(match[1])] = file
    return found[max(found)] if found else ""


def install(renderer, packages):
    """Says what went wrong, or ""."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--target", packages / renderer.package]
    result = subprocess.run([str(part) for part in [*command, renderer.package]], capture_output=True, text=True)
    return "" if result.returncode == 0 else last_line(result.stderr)


def find(families, packages, install_missing):
    """The renderers of these families, with `missing` where one is not there."""
    chosen = [renderer for renderer in renderers() if renderer.family in families]
    for renderer in chosen:
        if not renderer.package:
            if not shutil.which(renderer.family):
                renderer.missing = f"no {renderer.family} on the PATH; {renderer.hint}"
            continue
        folder = packages / renderer.package
        failure = ""
        if install_missing and not (folder / renderer.module).exists():
            failure = install(renderer, packages)
        if (folder / renderer.module).exists():
            renderer.environment["PYTHONPATH"] = str(folder)
        elif importlib.util.find_spec(renderer.module) is None:
            renderer.missing = f"no Python package {renderer.module}: {failure or renderer.hint}"
        if renderer.family == "luxcore":
            # Its libraries crash where they meet some OpenCL drivers, and the CPU needs none.
            renderer.environment["OCL_ICD_VENDORS"] = "/nonexistent"
        if renderer.key == "mitsuba-llvm" and not renderer.missing:
            library = find_llvm()
            renderer.environment["DRJIT_LIBLLVM_PATH"] = library
            if not library:
                renderer.missing = "no libLLVM; on Debian: apt-get install libllvm15, or set DRJIT_LIBLLVM_PATH"
    return chosen


def last_line(text):
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "it said nothing"


def run_process(command, environment=None, folder=None, message=last_line):
    """The finished process and its seconds; `message` finds its error in what it printed."""
    began = time.perf_counter()
    try:
        result = subprocess.run(
            [str(part) for part in command],
            env={**os.environ, **(environment or {})},
            cwd=folder,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=LONGEST_SECONDS,
        )
    except subprocess.TimeoutExpired as error:
        raise Failure(f"it ran longer than {LONGEST_SECONDS} s") from error
    seconds = time.perf_counter() - began
    if result.returncode != 0:
        raise Failure(f"it ended with status {result.returncode}: {message(result.stderr)}")
    return result, seconds


def read_pfm(file):
    with open(file, "rb") as data:
        data.readline()
        width, height = map(int, data.readline().split())
        order = "<" if float(data.readline()) < 0 else ">"
        return numpy.fromfile(data, order + "f4").reshape(height, width, 3)[::-1]


def read_wide_ppm(file):
    """A binary PPM with two bytes a value, as values from 0 to 1."""
    data = pathlib.Path(file).read_bytes()
    header = re.match(rb"P6\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s+65535\s", data)
    if not header:
        raise Failure("its picture is no PPM of 16 bits")
    width, height = int(header[1]), int(header[2])
    return numpy.frombuffer(data, ">u2", width * height * 3, header.end()).reshape(height, width, 3) / 65535


def run_castor(castor, device, scene, samples, threads, folder):
    picture = folder / "castor.pfm"
    command = [castor, "render", scene.castor_file, "--samples", samples, "--filter", "box", "-o", picture]
    command += ["--device", device, "--json", "--quiet"]
    try:
        result, seconds = run_process(
            command, {"POCL_MAX_PTHREAD_COUNT": str(threads)}, message=lambda text: text.strip().split("\n")[0]
        )
    except Failure as failure:
        raise Failure(f"{scene.name} with castor render: {failure}") from failure
    document = json.loads(result.stdout)
    phases = document["seconds"]
    load = sum(phases[phase] for phase in ("load", "flatten", "build", "setup"))
    # A picture may begin before all programs are read from the cache, and waits for them then.
    programs = max(device["setup_seconds"] for device in document["pictures"][0]["devices"])
    render = phases["render"] - programs
    return Run(
        {"load": load + programs, "first": phases["render"], "render": render, "all": seconds},
        read_pfm(picture) / WHITE,
        document["device"],
        document["rays"],
    )


def run_python(renderer, scene, samples, threads, size, folder):
    """With scripts/render_drivers.py."""
    job, result, picture = folder / "job.json", folder / "result.json", folder / "picture.npy"
    result.unlink(missing_ok=True)
    job.write_text(
        json.dumps(
            {
                "mesh": str(scene.mesh_file),
                "eye": scene.eye,
                "target": scene.target,
                "fov_y_degrees": scene.fov_y_degrees,
                "lights": [[*light.position, light.intensity] for light in scene.lights],
                "albedo": ALBEDO,
                "size": size,
                "samples": samples,
                "threads": threads,
                "picture": str(picture),
                "result": str(result),
            }
        )
    )
    # A home of its own: what the renderer keeps from one run to the next, such as compiled kernels, begins empty.
    environment = {**renderer.environment, "HOME": str(folder)}
    drivers = pathlib.Path(__file__).with_name("render_drivers.py")
    _, seconds = run_process([sys.executable, drivers, renderer.key, job], environment, folder)
    found = json.loads(result.read_text())
    measured = found["seconds"]
    measured["all"] = seconds - measured.pop("extra")
    return Run(measured, numpy.load(picture), found["version"])


def write_povray_scene(file, scene):
    """POV-Ray adds k color attenuation cos, without 1 / pi, and the attenuation is 2 / (1 + (r / fade_distance)^2):
    close to 2 fade_distance^2 / r^2 where the light is many of these distances away."""
    mesh = read_ply(scene.mesh_file)

    def vector(v):
        return "<" + ",".join(f"{POVRAY_SCALE * x:.9g}" for x in v) + ">"

    lights = "".join(
        f"light_source {{ {vector(light.position)} color rgb "
        f"{light.intensity * POVRAY_SCALE**2 / (2 * POVRAY_FADE**2 * POVRAY_WHITE):.9g} "
        f"fade_distance {POVRAY_FADE} fade_power 2 }}\n"
        for light in scene.lights
    )
    points = ",\n".join("<%.9g,%.9g,%.9g>" % tuple(p) for p in (POVRAY_SCALE * mesh.points.astype(float)).tolist())
    faces = ",\n".join("<%d,%d,%d>" % tuple(t) for t in mesh.triangles.tolist())
    # The axis to the right is turned, since POV-Ray's own axes are left-handed.
    file.write_text(
        "#version 3.7;\n"
        "global_settings { assumed_gamma 1.0 max_trace_level 1 }\n"
        "background { color rgb 0 }\n"
        f"camera {{ perspective location {vector(scene.eye)} sky <0,1,0> right -x up y "
        f"angle {scene.fov_y_degrees} look_at {vector(scene.target)} }}\n"
        f"{lights}"
        f"mesh2 {{ vertex_vectors {{ {len(mesh.points)},\n{points} }}\n"
        f"face_indices {{ {len(mesh.triangles)},\n{faces} }}\n"
        f"texture {{ pigment {{ color rgb {ALBEDO} }} finish {{ ambient 0 diffuse 1 }} }} }}\n"
    )


def run_povray(scene, samples, threads, size, folder):
    file, picture = scene.mesh_file.with_suffix(".pov"), folder / "povray.ppm"
    side = math.isqrt(samples)
    if side * side != samples:
        raise Failure(f"it takes square numbers of samples, and {samples} is none")
    if not file.exists():
        write_povray_scene(file, scene)
    picture.unlink(missing_ok=True)
    smoothing = ["-A"] if samples == 1 else ["+A0.0", "+AM1", f"+R{side}", "-J"]
    command = ["povray", f"+I{file.name}", f"+O{picture.name}", f"+W{size}", f"+H{size}", "+FP", "Bits_Per_Color=16"]
    command += ["File_Gamma=1.0", "-D", f"+WT{threads}", *smoothing]
    result, seconds = run_process(command, {"HOME": str(folder)}, folder)
    trace = re.search(r"Trace Time:.*\(([0-9.]+) seconds\)", result.stderr)
    if not trace:
        raise Failure("it does not tell its trace time")
    render = float(trace[1])
    version = re.search(r"Version (\d[\d.]*\d)", result.stderr)
    values = read_wide_ppm(picture) * POVRAY_WHITE
    return Run(
        {"load": seconds - render, "first": render, "render": render, "all": seconds},
        values,
        version[1] if version else "",
    )


def run(renderer, scene, samples, threads, size, folder):
    if renderer.key == "povray":
        return run_povray(scene, samples, threads, size, folder)
    return run_python(renderer, scene, samples, threads, size, folder)


def beyond_noise(differences):
    """How far the mean is from 0, less twice its standard error."""
    return max(0.0, abs(differences.mean()) - 2 * differences.std() / math.sqrt(differences.size))


def compare_pictures(castor, other):
    """Both linear. All but the ratio are shares of the mean of Castor's picture:

    mean_ratio    the mean of the other over that of Castor's
    pixels        the mean absolute difference of pixels: noise and silhouettes too
    blocks        that of the blocks' means
    beyond_noise  the same, less twice the standard error of each block's mean; or that of the whole picture's mean, if
                  it is larger
    """
    if castor.shape != other.shape:
        raise Failure(f"its picture is {other.shape[1]} x {other.shape[0]} pixels")
    a, b = castor.astype(float).mean(axis=2), other.astype(float).mean(axis=2)
    mean, difference = a.mean(), b - a
    if not numpy.isfinite(difference).all():
        raise Failure("its picture has values that are not finite")
    if not mean > 0:
        raise Failure("Castor's picture is black")
    blocks = [
        block for rows in numpy.array_split(difference, BLOCKS) for block in numpy.array_split(rows, BLOCKS, axis=1)
    ]
    beyond = sum(beyond_noise(block) for block in blocks) / len(blocks)
    found = {
        "mean_ratio": b.mean() / mean,
        "pixels": numpy.abs(difference).mean() / mean,
        "blocks": sum(abs(block.mean()) for block in blocks) / len(blocks) / mean,
        "beyond_noise": max(beyond, beyond_noise(difference)) / mean,
    }
    return {name: float(value) for name, value in found.items()}
