"""Pictures of scenes."""

from __future__ import annotations

import ctypes
import dataclasses
import os
from typing import Any, Mapping, Optional, Sequence

import numpy as np

from . import _c
from ._arrays import Array, describe
from ._errors import DeviceError, UsageError
from ._library import (
    Handle,
    Progress,
    ask,
    call_with_progress,
    check,
    check_process,
    choose,
    lib,
    struct,
    text,
    warn,
    warnings_of,
)
from .devices import Devices, select
from .png import encode_png
from .scene import Camera, PathLike, Scene, ToneMap
from .tracer import QUALITIES, STRATEGIES, borrow

_FILTERS = {"auto": _c.CASTOR_RECONSTRUCTION_FILTER_AUTOMATIC, "box": _c.CASTOR_RECONSTRUCTION_FILTER_BOX,
            "tent": _c.CASTOR_RECONSTRUCTION_FILTER_TENT, "gaussian": _c.CASTOR_RECONSTRUCTION_FILTER_GAUSSIAN}
_DENOISERS = {"castor": _c.CASTOR_DENOISER_CASTOR, "oidn": _c.CASTOR_DENOISER_OIDN}
_INTEGRATORS = {"auto": _c.CASTOR_INTEGRATOR_AUTOMATIC, "whitted": _c.CASTOR_INTEGRATOR_WHITTED,
                "path": _c.CASTOR_INTEGRATOR_PATH}
_RULES = {"r2022": _c.CASTOR_RULE_SET_R2022, "r795": _c.CASTOR_RULE_SET_R795, "r2020": _c.CASTOR_RULE_SET_R2020,
          "r2018": _c.CASTOR_RULE_SET_R2018}
_SAMPLE_ORDERS = {"pixel": _c.CASTOR_SAMPLE_ORDER_PIXEL, "z": _c.CASTOR_SAMPLE_ORDER_Z}


def _light_groups(groups: Mapping[str, Sequence[int]]) -> tuple[Any, list[Any]]:
    """The groups as an array of castor_light_group, and the arrays that it points to."""
    made = (_c.castor_light_group * len(groups))()
    owned = [(ctypes.c_uint32 * len(lights))(*lights) for lights in groups.values()]
    for target, name, lights in zip(made, groups, owned):
        target.name = name.encode()
        target.lights = ctypes.addressof(lights)
        target.light_count = len(lights)
    return made, owned


class Film:
    """A picture as linear, unlimited floats: 255 is white in an 8-bit image. Row 0 is on top.

    numpy.asarray(film) and film.pixels are float32 (height, width, 3); film["depth"] is the plane of that name, of
    shape (height, width) or (height, width, channels). Arrays are read-only views, which stay valid without the film.
    """

    def __init__(self, handle: Handle) -> None:
        info = ask("castor_film_get_info", "castor_film_info", handle.value)
        size = int(info.height), int(info.width)
        self._handle = handle
        self.pixels: Array = borrow(info.pixels, (*size, 3), np.dtype(np.float32), handle)
        #: Where all samples were taken: bool (height, width).
        self.done: Array = borrow(info.done, size, np.dtype(np.bool_), handle)
        self.samples_per_pixel = int(info.samples_per_pixel)
        self.complete = bool(info.complete)
        #: The further planes, by name.
        self.planes: dict[str, Array] = {}
        for i in range(info.plane_count):
            plane = ask("castor_film_get_plane", "castor_film_plane", handle.value, i)
            shape = size if plane.channel_count == 1 else (*size, int(plane.channel_count))
            kind = np.dtype(np.float32 if plane.values else np.uint32)
            self.planes[text(plane.name)] = borrow(plane.values or plane.indices, shape, kind, handle)

    def __getitem__(self, name: str) -> Array:
        if name not in self.planes:
            raise UsageError(f"plane: found {name!r}, expected " +
                             (f"one of {', '.join(self.planes)}" if self.planes else "none: this film has no planes"))
        return self.planes[name]

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> Array:
        return self.pixels if dtype is None and not copy else np.array(self.pixels, dtype)

    @property
    def width(self) -> int:
        return int(self.pixels.shape[1])

    @property
    def height(self) -> int:
        return int(self.pixels.shape[0])

    def save(self, path: PathLike, plane: Optional[str] = None, *, layers: bool = False) -> None:
        """Writes the picture in the format of the path's extension: .png and .ppm with 8 bits, .pfm, .hdr and .exr with
        the linear values; or a plane of it as .exr or .pfm; or with layers the picture and all planes into one .exr.
        Only a complete file replaces an old one."""
        file = os.fsencode(path)
        if layers and plane is not None:
            raise UsageError(f"save: a file with layers has all planes, and the plane {plane} was asked for")
        if layers:
            check(lib.castor_film_write_layers(self._handle.value, file))
        elif plane is None:
            check(lib.castor_film_write_image(self._handle.value, file, None))
        else:
            check(lib.castor_film_write_plane(self._handle.value, plane.encode(), file))

    def tone_map(self, operator: str | ToneMap = "photographic", **options: Any) -> Array:
        """The picture as uint8 (height, width, 3), for castor.write_png: by a tone map, such as one of a camera's, or
        by an operator and other options of castor.ToneMap."""
        if isinstance(operator, ToneMap):
            mapping = dataclasses.replace(operator, **options)._struct()
        else:
            mapping = ToneMap(operator, **options)._struct()
        rgb = np.empty((self.height, self.width, 3), np.uint8)
        check(lib.castor_film_apply_tone_map(self._handle.value, ctypes.byref(mapping), rgb.ctypes.data))
        return rgb

    def _repr_png_(self) -> bytes:
        """The picture as notebooks show it."""
        return encode_png(self.pixels)

    def __repr__(self) -> str:
        planes = f", planes {', '.join(self.planes)}" if self.planes else ""
        return (f"<castor.Film: {self.width}x{self.height}, {self.samples_per_pixel} samples per pixel{planes}"
                f"{'' if self.complete else ', not complete'}>")


class Renderer:
    """Renders pictures of one scene on all of its devices. A pixel has the same bits on every device. Usable from
    several threads; renders take turns."""

    def __init__(self, scene: Scene, devices: Devices = "all", *, strategy: str = "auto", quality: str = "medium",
                 use_profiles: bool = True, progress: Progress = None) -> None:
        """Builds the scene's trees and uploads it to the devices; arguments and errors as of Tracer."""
        if not isinstance(scene, Scene):
            raise UsageError(f"scene: found {describe(scene)}, expected a castor.Scene")
        way, care = choose(strategy, STRATEGIES, "strategy"), choose(quality, QUALITIES, "quality")
        chosen = select(devices)
        built = scene._build(chosen, way, care, use_profiles, progress)
        options = struct("castor_renderer_options", strategy=way, quality=care, ignore_profiles=int(not use_profiles))
        self._handle = Handle("renderer")
        check(lib.castor_renderer_create_from_built(built.value, chosen.value, ctypes.byref(options),
                                                    self._handle.out()))
        #: The scene's cameras when the renderer was made.
        self.cameras = scene.cameras
        warn(self.warnings)

    def render(self, camera: Camera | int = 0, *, samples_per_pixel: int = 0, planes: Sequence[str] = (),
               filter: str = "auto", rules: str = "r2022", seed: int = 0, cull_back_faces: bool = False,
               max_recursion_depth: Optional[int] = None, integrator: str = "auto", bounces: Optional[int] = None,
               largest_sample: Optional[float] = None, denoise: bool = False, denoiser: Optional[str] = None,
               noise: Optional[float] = None, stop_after: Optional[float] = None, sample_order: str = "pixel",
               light_groups: Optional[Mapping[str, Sequence[int]]] = None, progress: Progress = None,
               checkpoint: Optional[PathLike] = None, resume: Optional[PathLike] = None) -> Film:
        """Renders what a camera sees, or the scene's camera of that number.

        `samples_per_pixel`: 0 means the camera's own. `integrator`: "whitted", "path" or "auto", which is path tracing
        where the camera has path_tracing; `bounces` and `largest_sample` change what that says. `planes`: further
        planes to make, of castor.plane_names(); "lights" makes one for each light, such as film["light-0-point"], and
        film["light-none"] of all else. `denoise`: removes noise from the picture; the plane "noisy" is what it was.
        `denoiser`: what removes it: "castor", as `denoise` alone, or "oidn", Open Image Denoise, where it is installed
        (see CASTOR_DENOISER_OIDN in castor_c.h); where that fails in the end, DeviceError.film is the noisy picture.
        `noise`: blocks of 8x8 pixels stop at this relative error, such as 0.01, of more than 16 samples a pixel; the
        plane "samples" tells when. `stop_after`: the picture is complete after the first pass over it that ends so many
        seconds after its begin. `sample_order`: "z" lets pixels share a sequence of points, "pixel" gives each its own.
        `light_groups`: names, each with numbers of lights, as Scene.find_lights tells them; film["group-NAME"] is their
        light in a path-traced picture, and film["group-rest"] all other.
        `progress`: True for a bar, or a function of the fraction done; an exception of it ends the render, and so does
        Ctrl-C. `checkpoint`: a file that keeps what is done, each minute and when the render ends early; `resume`: such
        a file to go on from. Raises SceneError if the camera is wrong, DeviceError once the last device has failed; its
        `film` is what was done by then.
        """
        check_process()
        if isinstance(camera, int):
            if not 0 <= camera < len(self.cameras):
                raise UsageError(f"camera: found {camera}, expected a castor.Camera, or a number below "
                                 f"{len(self.cameras)}, the scene's cameras")
            camera = self.cameras[camera]
        elif not isinstance(camera, Camera):
            raise UsageError(f"camera: found {describe(camera)}, expected a castor.Camera or a number")
        seen = camera._struct()
        depth = None if max_recursion_depth is None else ctypes.c_uint32(max_recursion_depth)
        most = None if bounces is None else ctypes.c_uint32(bounces)
        for name, value in (("noise", noise), ("stop_after", stop_after)):
            if value == 0:  # the C interface takes it for None
                raise UsageError(f"{name}: found 0, expected a number above 0, or None")
        groups, _owned = _light_groups(light_groups or {})
        noise_goes_by = "castor" if denoise and denoiser is None else denoiser
        options = struct(
            "castor_render_options", noise=noise or 0.0, stop_after_seconds=stop_after or 0.0,
            sample_order=choose(sample_order, _SAMPLE_ORDERS, "sample_order"), light_group_count=len(groups),
            light_groups=ctypes.addressof(groups) if groups else None,
            integrator=choose(integrator, _INTEGRATORS, "integrator"),
            bounces=None if most is None else ctypes.addressof(most),
            largest_sample=0.0 if largest_sample is None else largest_sample,
            samples_per_pixel=samples_per_pixel, filter=choose(filter, _FILTERS, "filter"),
            rules=choose(rules, _RULES, "rules"), seed=seed, cull_back_faces=int(cull_back_faces),
            max_recursion_depth=None if depth is None else ctypes.addressof(depth),
            planes=",".join(planes).encode() or None,
            checkpoint_file=None if checkpoint is None else os.fsencode(checkpoint),
            resume_file=None if resume is None else os.fsencode(resume),
            denoise=0 if noise_goes_by is None else choose(noise_goes_by, _DENOISERS, "denoiser"))
        film = Handle("film")

        def call(hook: Any) -> int:
            options.progress = hook
            return int(lib.castor_renderer_render(self._handle.value, ctypes.byref(seen), ctypes.byref(options),
                                                  film.out()))

        try:
            call_with_progress(call, _c.castor_render_progress_function, _fraction, progress, "rendering")
        except DeviceError as error:
            error.film = Film(film) if film.value else None
            raise
        return Film(film)

    @property
    def warnings(self) -> list[str]:
        """What was noticed when the renderer was made."""
        return warnings_of("renderer", self._handle)

    @property
    def statistics(self) -> dict[str, float]:
        """Numbers of the renderer's making and its last render: seconds, rays, samples, primitives."""
        answer = ask("castor_renderer_get_statistics", "castor_render_statistics", self._handle.value)
        return {name: getattr(answer, name) for name, _ in answer._fields_
                if name != "size" and not name.startswith("reserved")}


def plane_names() -> list[str]:
    """The planes that a render can make."""
    return text(lib.castor_plane_names()).split(",")


def _fraction(progress: Any, user: Any) -> float:
    made = progress.contents
    return float(made.samples_done / max(made.samples_total, 1))
