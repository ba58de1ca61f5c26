"""Castor casts rays: nearest hits, visibility, all crossings, and pictures, with the same bits on every device.

    scene = castor.Scene.load("bunny.ply")
    tracer = castor.Tracer(scene)
    hits = tracer.closest_hit(castor.make_rays(origins, directions))

castor.trimesh and castor.open3d stand in for those packages' ray casters.
"""

from ._arrays import HIT, INVALID_INDEX, Array, make_rays
from ._errors import DeviceError, Error, FileError, SceneError, SceneWarning, UsageError
from ._library import lib as _lib
from ._library import text as _text
from .devices import Device, devices
from .png import encode_png, write_png
from .renderer import Film, Renderer, plane_names
from .scene import Camera, PathTracing, PrincipledMaterial, Scene, ToneMap
from .tracer import Crossings, Surfaces, Tracer

__version__ = _text(_lib.castor_version_string())
__all__ = [
    "HIT",
    "INVALID_INDEX",
    "Array",
    "Camera",
    "Crossings",
    "Device",
    "DeviceError",
    "Error",
    "FileError",
    "Film",
    "PathTracing",
    "PrincipledMaterial",
    "Renderer",
    "Scene",
    "SceneError",
    "SceneWarning",
    "Surfaces",
    "ToneMap",
    "Tracer",
    "UsageError",
    "devices",
    "encode_png",
    "make_rays",
    "plane_names",
    "write_png",
]
