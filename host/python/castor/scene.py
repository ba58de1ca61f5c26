"""Scenes: what a file or a program describes."""

from __future__ import annotations

import ctypes
import dataclasses
import os
import threading
from typing import Any, Optional, Sequence, Union

import numpy as np

from . import _c
from ._arrays import address, host_array, rows_of_transform, table, vector
from ._errors import UsageError
from ._library import (
    Handle,
    Progress,
    ask,
    call_with_progress,
    check,
    choose,
    lib,
    struct,
    text,
    warn,
    warnings_of,
)

_MATERIAL_KINDS = {"plain": _c.CASTOR_MATERIAL_KIND_PLAIN, "mirror": _c.CASTOR_MATERIAL_KIND_MIRROR,
                   "conductor": _c.CASTOR_MATERIAL_KIND_CONDUCTOR, "dielectric": _c.CASTOR_MATERIAL_KIND_DIELECTRIC}

_BRDFS = {"blinn_phong": _c.CASTOR_BRDF_KIND_BLINN_PHONG,
          "modified_blinn_phong": _c.CASTOR_BRDF_KIND_MODIFIED_BLINN_PHONG, "phong": _c.CASTOR_BRDF_KIND_PHONG,
          "modified_phong": _c.CASTOR_BRDF_KIND_MODIFIED_PHONG,
          "torrance_sparrow": _c.CASTOR_BRDF_KIND_TORRANCE_SPARROW}
_TEXTURE_KINDS = {"image": _c.CASTOR_TEXTURE_KIND_IMAGE, "perlin": _c.CASTOR_TEXTURE_KIND_PERLIN,
                  "checkerboard": _c.CASTOR_TEXTURE_KIND_CHECKERBOARD}
_TEXTURE_TARGETS = {"replace_diffuse": _c.CASTOR_TEXTURE_TARGET_REPLACE_DIFFUSE,
                    "blend_diffuse": _c.CASTOR_TEXTURE_TARGET_BLEND_DIFFUSE,
                    "replace_specular": _c.CASTOR_TEXTURE_TARGET_REPLACE_SPECULAR,
                    "replace_all": _c.CASTOR_TEXTURE_TARGET_REPLACE_ALL,
                    "background": _c.CASTOR_TEXTURE_TARGET_BACKGROUND,
                    "normal_map": _c.CASTOR_TEXTURE_TARGET_NORMAL_MAP, "bump_map": _c.CASTOR_TEXTURE_TARGET_BUMP_MAP,
                    "principled": _c.CASTOR_TEXTURE_TARGET_PRINCIPLED}
_ALPHA_MODES = {"opaque": _c.CASTOR_ALPHA_MODE_OPAQUE, "mask": _c.CASTOR_ALPHA_MODE_MASK,
                "blend": _c.CASTOR_ALPHA_MODE_BLEND}
_TEXTURE_FILTERS = {"nearest": _c.CASTOR_TEXTURE_FILTER_NEAREST, "bilinear": _c.CASTOR_TEXTURE_FILTER_BILINEAR,
                    "trilinear": _c.CASTOR_TEXTURE_FILTER_TRILINEAR}
_ENVIRONMENT_MAPPINGS = {"latlong": _c.CASTOR_ENVIRONMENT_MAPPING_LATLONG,
                         "probe": _c.CASTOR_ENVIRONMENT_MAPPING_PROBE}

# What add_default_view gives to scenes without a material.
_CLAY: dict[str, Any] = {"ambient": (0.82, 0.66, 0.53), "diffuse": (0.82, 0.66, 0.53), "specular": (0.18, 0.18, 0.18),
                         "phong_exponent": 30.0}

Vector = Sequence[float]
PathLike = Union[str, "os.PathLike[str]"]


_TONE_OPERATORS = {"photographic": _c.CASTOR_TONE_OPERATOR_PHOTOGRAPHIC, "aces": _c.CASTOR_TONE_OPERATOR_ACES,
                   "filmic": _c.CASTOR_TONE_OPERATOR_FILMIC, "linear": _c.CASTOR_TONE_OPERATOR_LINEAR,
                   "agx": _c.CASTOR_TONE_OPERATOR_AGX}


_LIGHT_CHOICES = {"tree": 0, "uniform": _c.CASTOR_PATH_TRACING_UNIFORM_LIGHTS}


@dataclasses.dataclass
class ToneMap:
    """How linear values become 8 bits: Reinhard's photographic operator, the curve "aces" or "filmic", "linear" or
    "agx"."""

    operator: str = "photographic"
    key: float = 0.18  #: the luminance, above 0, that the average becomes, and that of AgX's middle grey
    burn_percent: float = 1.0  #: of the pixels are brighter than white, but by AgX
    saturation: float = 1.0  #: 0 makes grey
    gamma: float | str = 2.2  #: a number above 0, or "sRGB"
    extension: str = ""  #: of the picture's file name, such as "_phot.png"; "": ".png"

    def _struct(self) -> Any:
        is_srgb = isinstance(self.gamma, str)
        if is_srgb and self.gamma != "sRGB":
            raise UsageError(f"gamma: found {self.gamma!r}, expected a number above 0, or 'sRGB'")
        # The library takes zeros for its defaults, which here are no zeros.
        for name, value in [("key", self.key)] + ([] if is_srgb else [("gamma", float(self.gamma))]):
            if not value > 0:
                raise UsageError(f"{name}: found {value!r}, expected a number above 0")
        return struct("castor_tone_map", tone_operator=choose(self.operator, _TONE_OPERATORS, "operator"),
                      srgb=int(is_srgb), key=self.key, burn_percent=self.burn_percent, saturation=self.saturation,
                      gamma=0.0 if is_srgb else float(self.gamma))

    @classmethod
    def _of(cls, made: Any, extension: str) -> ToneMap:
        operator = next(word for word, code in _TONE_OPERATORS.items() if code == made.tone_operator)
        return cls(operator, made.key, made.burn_percent, made.saturation, "sRGB" if made.srgb else made.gamma,
                   extension)


@dataclasses.dataclass
class PathTracing:
    """How the light of a path-traced picture is found. All settings give the same picture but for noise, except that
    fewer bounces, or a limit of samples, make it darker."""

    samples_brdf: bool = True  #: directions are drawn as surfaces scatter; else uniformly
    samples_lights: bool = True  #: at each bounce a ray goes to a light
    weighs: bool = True  #: light that rays meet by chance counts as well, by weight
    roulette_from: Optional[int] = 3  #: bounces after which paths end at random
    bounces: Optional[int] = 12  #: at most; None: only roulette ends paths
    largest_sample: float = np.inf  #: limits the channels of a sample
    light_choice: str = "tree"  #: which light such rays go to: "tree": by what each may give; "uniform": any

    def _put(self, made: Any) -> None:
        made.path_tracing = (_c.CASTOR_PATH_TRACING_ON | self.samples_brdf * _c.CASTOR_PATH_TRACING_SAMPLES_BRDF
                             | self.samples_lights * _c.CASTOR_PATH_TRACING_SAMPLES_LIGHTS
                             | self.weighs * _c.CASTOR_PATH_TRACING_WEIGHS
                             | (self.roulette_from is not None) * _c.CASTOR_PATH_TRACING_ROULETTE
                             | (self.bounces is not None) * _c.CASTOR_PATH_TRACING_BOUNCES
                             | choose(self.light_choice, _LIGHT_CHOICES, "light_choice"))
        made.roulette_from = self.roulette_from or 0
        made.bounces = self.bounces or 0
        made.largest_sample = 0.0 if np.isinf(self.largest_sample) else self.largest_sample

    @classmethod
    def _of(cls, made: Any) -> Optional[PathTracing]:
        bits = made.path_tracing
        if not bits:
            return None
        return cls(bool(bits & _c.CASTOR_PATH_TRACING_SAMPLES_BRDF), bool(bits & _c.CASTOR_PATH_TRACING_SAMPLES_LIGHTS),
                   bool(bits & _c.CASTOR_PATH_TRACING_WEIGHS),
                   made.roulette_from if bits & _c.CASTOR_PATH_TRACING_ROULETTE else None,
                   made.bounces if bits & _c.CASTOR_PATH_TRACING_BOUNCES else None, made.largest_sample or np.inf,
                   "uniform" if bits & _c.CASTOR_PATH_TRACING_UNIFORM_LIGHTS else "tree")


@dataclasses.dataclass
class PrincipledMaterial:
    """A physically based material, with the parameters of glTF 2.0 and of its extensions. Textures are numbers of
    textures whose target is "principled"; each is multiplied by what its name says. Colours are from 0 to 1, but
    `specular_color` and `emissive` may be more."""

    base_color: Vector = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    alpha_mode: str = "opaque"  #: or "mask", with `alpha_cutoff`, or "blend": alpha is the share that is there
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    unlit: bool = False  #: sends its base colour, and reflects nothing
    metallic: float = 1.0
    roughness: float = 1.0
    normal_scale: float = 1.0
    emissive: Vector = (0.0, 0.0, 0.0)  #: radiance, 1 is white
    emissive_strength: float = 1.0
    ior: float = 1.5  #: 0: all light is reflected
    specular: float = 1.0
    specular_color: Vector = (1.0, 1.0, 1.0)
    transmission: float = 0.0
    thickness: float = 0.0  #: 0: the surface is a thin wall
    attenuation_distance: float = np.inf  #: at which `attenuation_color` is left
    attenuation_color: Vector = (1.0, 1.0, 1.0)
    multiscatter_color: Vector = (0.0, 0.0, 0.0)  #: of what is inside of a solid; black: it scatters nothing
    scattering_anisotropy: float = 0.0  #: the mean cosine of the angle by which light is turned there
    dispersion: float = 0.0  #: 20 / Abbe number
    diffuse_transmission: float = 0.0
    diffuse_transmission_color: Vector = (1.0, 1.0, 1.0)
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.0
    clearcoat_normal_scale: float = 1.0
    sheen_color: Vector = (0.0, 0.0, 0.0)
    sheen_roughness: float = 0.0
    anisotropy: float = 0.0
    anisotropy_rotation_radians: float = 0.0  #: counter-clockwise, from the tangent
    iridescence: float = 0.0
    iridescence_ior: float = 1.3
    iridescence_thickness_minimum: float = 100.0  #: nanometres
    iridescence_thickness_maximum: float = 400.0
    diffuse_roughness: float = 0.0  #: of the model EON; 0: the diffuse part is Lambert's
    base_color_texture: Optional[int] = None  #: A: alpha
    metallic_roughness_texture: Optional[int] = None  #: G: roughness, B: metallic
    normal_texture: Optional[int] = None
    emissive_texture: Optional[int] = None
    specular_texture: Optional[int] = None  #: A
    specular_color_texture: Optional[int] = None
    transmission_texture: Optional[int] = None  #: R
    thickness_texture: Optional[int] = None  #: G
    diffuse_transmission_texture: Optional[int] = None  #: A
    diffuse_transmission_color_texture: Optional[int] = None
    clearcoat_texture: Optional[int] = None  #: R
    clearcoat_roughness_texture: Optional[int] = None  #: G
    clearcoat_normal_texture: Optional[int] = None
    sheen_color_texture: Optional[int] = None
    sheen_roughness_texture: Optional[int] = None  #: A
    anisotropy_texture: Optional[int] = None  #: R, G: the direction, B: the strength
    iridescence_texture: Optional[int] = None  #: R
    iridescence_thickness_texture: Optional[int] = None  #: G: between minimum and maximum
    diffuse_roughness_texture: Optional[int] = None  #: R

    def _struct(self) -> Any:
        made = struct("castor_principled_material")
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name == "alpha_mode":
                made.alpha_mode = choose(value, _ALPHA_MODES, "alpha_mode")
            elif field.name.endswith("_texture"):
                number = _c.CASTOR_NO_TEXTURE if value is None else int(_numbers([value], field.name)[0])
                setattr(made, field.name, number)
            elif isinstance(field.default, tuple):
                getattr(made, field.name)[:] = vector(value, field.name)
            else:
                setattr(made, field.name, value)
        return made


@dataclasses.dataclass
class Camera:
    """A camera with a pinhole, or with a lens where `aperture_size` is not 0. It looks along `gaze`; the image plane's
    window is [left, right] x [bottom, top] at `distance`. A hit counts for t in [t_min, t_max], where 1 is on the image
    plane."""

    position: Vector = (0.0, 0.0, 0.0)
    gaze: Vector = (0.0, 0.0, -1.0)  #: a direction, not normalised
    up: Vector = (0.0, 1.0, 0.0)
    window: Vector = (-1.0, 1.0, -1.0, 1.0)  #: left, right, bottom, top
    distance: float = 1.0
    width: int = 512
    height: int = 512
    samples_per_pixel: int = 1
    t_min: float = 0.0
    t_max: float = np.inf
    left_handed: bool = False
    image_name: str = ""
    aperture_size: float = 0.0  #: edge of the square lens around the eye
    focus_distance: float = 1.0  #: along the gaze, at which the picture is sharp
    is_orthographic: bool = False  #: rays are parallel to the gaze, and begin in the window, moved to `position`
    tone_maps: Sequence[ToneMap] = ()  #: of the pictures that `castor render` makes; for Film.tone_map
    path_tracing: Optional[PathTracing] = None  #: how the picture is path traced, where nothing else is asked for

    @classmethod
    def look_at(cls, position: Vector, target: Vector, up: Vector = (0.0, 1.0, 0.0), *, fov_y_degrees: float = 45.0,
                width: int = 512, height: int = 512, samples_per_pixel: int = 1) -> Camera:
        """A camera at `position` with `target` in the middle of the picture, whose pixels are square."""
        if not 0 < fov_y_degrees < 180:
            raise UsageError(f"fov_y_degrees: found {fov_y_degrees}, expected an angle between 0 and 180")
        top = float(np.tan(np.radians(fov_y_degrees / 2)))
        right = top * width / height
        gaze = np.subtract(vector(target, "target"), vector(position, "position")).tolist()
        return cls(position, gaze, up, (-right, right, -top, top), 1.0, width, height, samples_per_pixel)

    def resized(self, width: int, height: int) -> Camera:
        """The camera with another size in pixels, which keep their shape: the window grows or shrinks in width."""
        resized = self._struct()
        check(lib.castor_camera_resize(ctypes.byref(resized), width, height))
        return dataclasses.replace(self._of(resized), tone_maps=self.tone_maps)

    def rays(self, t_min: Optional[float] = None, t_max: Optional[float] = None) -> Any:
        """The eye rays of a pinhole through the middles of the pixels: float32 (height, width, 8), row 0 on top.
        Directions are not normalised: t = 1 is on the image plane."""
        from ._arrays import make_rays

        gaze, up = (np.asarray(vector(value, name)) for value, name in ((self.gaze, "gaze"), (self.up, "up")))
        backward = -gaze / np.linalg.norm(gaze)
        right = np.cross(up, backward)
        right /= np.linalg.norm(right)
        upward = np.cross(backward, right)
        if self.left_handed:
            right = -right
        x0, x1, y0, y1 = vector(self.window, "window", 4)
        x = x0 + (np.arange(self.width) + 0.5) * (x1 - x0) / self.width
        y = y1 - (np.arange(self.height) + 0.5) * (y1 - y0) / self.height
        origins = np.asarray(vector(self.position, "position"))
        directions = x[None, :, None] * right + y[:, None, None] * upward
        if self.is_orthographic:
            origins, directions = origins + directions, np.broadcast_to(-self.distance * backward, directions.shape)
        else:
            directions = directions - self.distance * backward
        return make_rays(origins, directions, self.t_min if t_min is None else t_min,
                         self.t_max if t_max is None else t_max)

    def _struct(self) -> Any:
        # The library takes zeros for its defaults, which here are no zeros: nobody means a camera that looks nowhere.
        for name in ("gaze", "up", "window", "distance", "t_max", "width", "height", "samples_per_pixel",
                     "focus_distance"):
            if not np.any(getattr(self, name)):
                raise UsageError(f"{name}: found {getattr(self, name)!r}, expected another value than 0")
        made = struct("castor_camera", image_name=self.image_name.encode() or None, distance=self.distance,
                      t_min=self.t_min, t_max=self.t_max, width=self.width, height=self.height,
                      samples_per_pixel=self.samples_per_pixel, left_handed=int(self.left_handed),
                      aperture_size=self.aperture_size, focus_distance=self.focus_distance,
                      orthographic=int(self.is_orthographic))
        if self.path_tracing is not None:
            self.path_tracing._put(made)
        for name in ("position", "gaze", "up"):
            getattr(made, name)[:] = vector(getattr(self, name), name)
        made.left, made.right, made.bottom, made.top = vector(self.window, "window", 4)
        return made

    @classmethod
    def _of(cls, made: Any) -> Camera:
        return cls(tuple(made.position), tuple(made.gaze), tuple(made.up),
                   (made.left, made.right, made.bottom, made.top), made.distance, made.width, made.height,
                   made.samples_per_pixel, made.t_min, made.t_max, bool(made.left_handed), text(made.image_name),
                   made.aperture_size, made.focus_distance, bool(made.orthographic),
                   path_tracing=PathTracing._of(made))


class Scene:
    """Meshes, spheres, planes, materials, lights and cameras. Indices count from 0.

    World space is right-handed; triangles wind counter-clockwise seen from outside. Colours are linear RGB, and 255 is
    white. Nothing is checked while a scene is filled but shapes and dtypes: Tracer and Renderer check it all, and raise
    SceneError. They take the scene as it is then; later changes do not reach them. Usable from several threads.
    """

    def __init__(self) -> None:
        self._handle = Handle("scene")
        self._lock = threading.Lock()
        check(lib.castor_scene_create(self._handle.out()))

    @classmethod
    def load(cls, path: PathLike, progress: Progress = None, *, environment: Optional[PathLike] = None,
             time_seconds: Optional[float] = None, animation: Optional[str | int] = None,
             material_variant: Optional[str | int] = None, sun_angle_radians: Optional[float] = None) -> Scene:
        """Reads a scene file (.xml, .json, .gltf, .glb), or a mesh (.ply, .obj, .stl), which gets a camera, lights and
        a material.

        `environment`: a picture of light from all directions, in which 1 is white; no other light is added then.
        `time_seconds`: when a glTF file's animation is shown; None: the rest pose. `animation`: which one, a number
        from 1 on, a name or "all"; None: the first. `material_variant`: of a glTF file, a number from 1 on or a name.
        `sun_angle_radians`: under which the directional lights are seen, at most pi; None: as the file says.

        What the reader does not know becomes a SceneWarning. Raises SceneError if the file is missing or wrong, and
        UsageError if it has no such animation or variant, no time, or no directional light.
        """
        scene = cls.__new__(cls)
        scene._handle, scene._lock = Handle("scene"), threading.Lock()
        file, out = os.fsencode(path), scene._handle.out()
        time = None if time_seconds is None else ctypes.c_double(time_seconds)
        sun_angle = None if sun_angle_radians is None else ctypes.c_float(sun_angle_radians)
        options = struct("castor_load_options", environment=None if environment is None else os.fsencode(environment),
                         time_seconds=None if time is None else ctypes.addressof(time),
                         animation=None if animation is None else str(animation).encode(),
                         material_variant=None if material_variant is None else str(material_variant).encode(),
                         sun_angle_radians=None if sun_angle is None else ctypes.addressof(sun_angle))

        def call(hook: Any) -> int:
            options.progress = hook
            return int(lib.castor_scene_load_with_options(file, ctypes.byref(options), out))

        call_with_progress(call, _c.castor_progress_function, lambda fraction, user: fraction, progress,
                           f"loading {os.path.basename(os.fsdecode(path))}")
        warn(scene.warnings)
        return scene

    @classmethod
    def from_mesh(cls, vertices: Any, triangles: Any, **options: Any) -> Scene:
        """A scene of one mesh; arguments as of add_mesh."""
        scene = cls()
        scene.add_mesh(vertices, triangles, **options)
        return scene

    def add_mesh(self, vertices: Any, triangles: Any, *, normals: Any = None, smooth: bool = False,
                 material: Optional[int] = None, transform: Any = None, texture_coordinates: Any = None,
                 motion: Vector = (0.0, 0.0, 0.0), texture_coordinates_1: Any = None, colors: Any = None,
                 tangents: Any = None) -> int:
        """Adds a mesh, and returns its number. It stands in the world once, unless add_instance places it.

        `vertices`: numbers of shape (n, 3). `triangles`: integers of shape (m, 3). `normals`: None for flat shading, or
        unit normals of vertices (n, 3); `smooth` computes them. `transform`: 3x4 or 4x4, from the mesh's own space to
        the world. `material`: a number; None means number 0, which is clay if the scene has no material yet.
        `texture_coordinates`: u, v of vertices (n, 2). `motion`: how far it has moved when the shutter closes. For
        principled materials: `texture_coordinates_1`, the second set (n, 2); `colors` of vertices, linear, 0 to 1,
        with alpha (n, 4); `tangents`, unit, with the sign of the bitangent (n, 4). Arrays are copied.
        """
        positions = table(vertices, "vertices", np.float32, 3)
        indices = table(triangles, "triangles", np.uint32, 3)
        directions = None if normals is None else table(normals, "normals", np.float32, 3)
        if directions is not None and len(directions) != len(positions):
            raise UsageError(f"normals: found {len(directions)}, expected as many as vertices, {len(positions)}")
        rows = None if transform is None else _floats(rows_of_transform(transform))
        of_vertices: dict[str, Any] = {}
        for name, values, width in (("texture_coordinates", texture_coordinates, 2),
                                    ("texture_coordinates_1", texture_coordinates_1, 2), ("colors", colors, 4),
                                    ("tangents", tangents, 4)):
            of_vertices[name] = None if values is None else table(values, name, np.float32, width)
            if values is not None and len(of_vertices[name]) != len(positions):
                raise UsageError(f"{name}: found {len(of_vertices[name])}, expected as many as vertices, "
                                 f"{len(positions)}")
        mesh = struct("castor_mesh", vertices=address(positions), vertex_count=len(positions),
                      triangles=address(indices), triangle_count=len(indices),
                      normals=None if directions is None else address(directions),
                      transform=None if rows is None else ctypes.addressof(rows), material=self._material(material),
                      smooth=int(smooth),
                      **{name: None if rows is None else address(rows) for name, rows in of_vertices.items()})
        mesh.motion[:] = vector(motion, "motion")
        return self._add(lambda index: lib.castor_scene_add_mesh(self._handle.value, ctypes.byref(mesh), index))

    def add_instance(self, mesh: int, transform: Any, material: Optional[int] = None) -> int:
        """Places a mesh once more by a transform, 3x4 or 4x4, from its own space to the world. Returns the instance's
        number i; hits name it as i + 1."""
        return self.add_instances([mesh], np.asarray(rows_of_transform(transform)).reshape(1, 3, 4),
                                  [self._material(material)])

    def add_instances(self, meshes: Any, transforms: Any, materials: Any = None) -> int:
        """Places meshes, by their numbers (n,), with transforms (n, 3, 4) or (n, 4, 4). Returns the first number."""
        numbers = _numbers(meshes, "meshes")
        matrices = host_array(transforms, "transforms")
        if matrices.shape[1:] not in ((3, 4), (4, 4)) or len(matrices) != len(numbers):
            raise UsageError(f"transforms: found shape {matrices.shape}, expected ({len(numbers)}, 3, 4) or "
                             f"({len(numbers)}, 4, 4)")
        rows = np.ascontiguousarray(matrices[:, :3], np.float32)
        kinds = self._materials(materials, len(numbers))
        return self._add(lambda first: lib.castor_scene_add_instances(
            self._handle.value, len(numbers), address(numbers), address(kinds), address(rows), first))

    def add_sphere(self, center: Vector, radius: float, *, material: Optional[int] = None,
                   transform: Any = None) -> int:
        """Adds a sphere, of which `transform` may make an ellipsoid. Returns its number."""
        placed = None if transform is None else np.asarray(rows_of_transform(transform)).reshape(1, 3, 4)
        return self.add_spheres([vector(center, "center")], [radius], [self._material(material)], placed)

    def add_spheres(self, centers: Any, radii: Any, materials: Any = None, transforms: Any = None) -> int:
        """Adds spheres by centers (n, 3) and radii (n,). Returns the first number."""
        middle = table(centers, "centers", np.float32, 3)
        size = host_array(radii, "radii")
        if size.shape != (len(middle),) or size.dtype.kind not in "iuf":
            raise UsageError(f"radii: found {size.dtype} of shape {size.shape}, expected ({len(middle)},) numbers")
        both = np.column_stack((middle, size.astype(np.float32)))
        kinds = self._materials(materials, len(middle))
        rows = None
        if transforms is not None:
            matrices = host_array(transforms, "transforms")
            if matrices.shape[1:] not in ((3, 4), (4, 4)) or len(matrices) != len(middle):
                raise UsageError(f"transforms: found shape {matrices.shape}, expected ({len(middle)}, 3, 4)")
            rows = np.ascontiguousarray(matrices[:, :3], np.float32)
        return self._add(lambda first: lib.castor_scene_add_spheres(
            self._handle.value, len(both), address(both), address(kinds),
            None if rows is None else address(rows), first))

    def add_plane(self, point: Vector, normal: Vector, *, material: Optional[int] = None) -> int:
        """Adds an infinite plane; the normal need not be normalised. Returns its number."""
        place, way = (np.asarray([vector(value, name)], np.float32) for value, name in
                      ((point, "point"), (normal, "normal")))
        kind = np.asarray([self._material(material)], np.uint32)
        return self._add(lambda first: lib.castor_scene_add_planes(self._handle.value, 1, address(place), address(way),
                                                                   address(kind), first))

    def add_material(self, *, kind: str = "plain", ambient: Vector = (0.0, 0.0, 0.0),
                     diffuse: Vector = (0.0, 0.0, 0.0), specular: Vector = (0.0, 0.0, 0.0),
                     mirror: Vector = (0.0, 0.0, 0.0), phong_exponent: float = 1.0, refraction_index: float = 1.0,
                     absorption_index: float = 0.0, absorption: Vector = (0.0, 0.0, 0.0), roughness: float = 0.0,
                     emission: Vector = (0.0, 0.0, 0.0), brdf: str = "blinn_phong", brdf_normalized: bool = False,
                     diffuse_fresnel: bool = False, textures: Sequence[int] = ()) -> int:
        """Adds a material: reflectances (r, g, b), at least 0. `kind`: "plain", "mirror", "conductor", "dielectric".
        `absorption` is a dielectric's, `emission` a radiance, and `textures` are numbers, applied in their order.
        `brdf`: "blinn_phong", "modified_blinn_phong", "phong", "modified_phong", "torrance_sparrow". Returns its
        number."""
        numbers = _numbers(list(textures), "textures") if len(textures) else np.zeros(0, np.uint32)
        made = struct("castor_material", kind=choose(kind, _MATERIAL_KINDS, "kind"), phong_exponent=phong_exponent,
                      refraction_index=refraction_index, absorption_index=absorption_index, roughness=roughness,
                      brdf=choose(brdf, _BRDFS, "brdf"), brdf_normalized=int(brdf_normalized),
                      diffuse_fresnel=int(diffuse_fresnel), textures=address(numbers), texture_count=len(numbers))
        for name, value in (("ambient", ambient), ("diffuse", diffuse), ("specular", specular), ("mirror", mirror),
                            ("absorption", absorption), ("emission", emission)):
            getattr(made, name)[:] = vector(value, name)
        return self._add(lambda index: lib.castor_scene_add_material(self._handle.value, ctypes.byref(made), index))

    def add_principled_material(self, material: Optional[PrincipledMaterial] = None, **parameters: Any) -> int:
        """Adds a physically based material: a PrincipledMaterial, of which `parameters` replace some. Only path tracing
        knows these materials, and pictures of scenes with them are path traced. Returns its number."""
        made = dataclasses.replace(PrincipledMaterial() if material is None else material, **parameters)._struct()
        return self._add(
            lambda index: lib.castor_scene_add_principled_material(self._handle.value, ctypes.byref(made), index))

    def add_image(self, image: Any, name: str = "") -> int:
        """Adds the texels of a picture, row 0 on top: an array (height, width, 3) of uint8, or of linear floats;
        (height, width, 4) of uint8, with alpha for principled materials; or a file: PNG, JPEG, WebP, BMP, TGA, Radiance
        HDR or OpenEXR. Returns its number."""
        if isinstance(image, (str, os.PathLike)):
            file = os.fsencode(image)
            return self._add(lambda index: lib.castor_scene_add_image_file(self._handle.value, file, index))
        texels = host_array(image, "image")
        has_bytes = texels.dtype == np.uint8
        if (texels.ndim != 3 or texels.shape[2] not in ((3, 4) if has_bytes else (3,))
                or (not has_bytes and texels.dtype.kind != "f")):
            raise UsageError(f"image: found {texels.dtype} of shape {texels.shape}, expected uint8 or floats of shape "
                             "(height, width, 3), or uint8 of shape (height, width, 4)")
        alpha = np.ascontiguousarray(texels[:, :, 3]) if texels.shape[2] == 4 else None
        texels = np.ascontiguousarray(texels[:, :, :3], np.uint8 if has_bytes else np.float32)
        made = struct("castor_image", name=name.encode() or None, width=texels.shape[1], height=texels.shape[0],
                      bytes=address(texels) if has_bytes else None, floats=None if has_bytes else address(texels),
                      alpha=None if alpha is None else address(alpha))
        return self._add(lambda index: lib.castor_scene_add_image(self._handle.value, ctypes.byref(made), index))

    def add_texture(self, kind: str = "image", *, image: int = 0, target: str = "replace_diffuse",
                    filter: str = "nearest", clamp: bool = False, normalizer: float = 255.0, bump_factor: float = 1.0,
                    noise_scale: float = 1.0, noise_octaves: int = 1, noise_absolute: bool = False,
                    black: Vector = (0.0, 0.0, 0.0), white: Vector = (1.0, 1.0, 1.0), checker_scale: float = 1.0,
                    checker_offset: float = 0.0, mirror: bool = False, coordinate_set: int = 0,
                    transform: Any = None) -> int:
        """Adds a texture, which materials name: `kind` is "image", "perlin" or "checkerboard"; `target` is what it
        changes, "replace_diffuse", "blend_diffuse", "replace_specular", "replace_all", "background", "normal_map",
        "bump_map", or "principled" for those of principled materials, which alone have a `coordinate_set`; `filter` is
        "nearest", "bilinear" or "trilinear". An image is repeated, or with `mirror` every second time mirrored, or ends
        at its edges with `clamp`; `transform` (2, 3) is applied to (u, v, 1). Returns its number."""
        given: dict[str, Any] = {"normalizer": normalizer, "bump_factor": bump_factor, "noise_scale": noise_scale,
                                 "noise_octaves": noise_octaves, "checker_scale": checker_scale, "white": white}
        for name, value in given.items():
            if not np.any(value):  # the library takes zeros for its defaults
                raise UsageError(f"{name}: found {value!r}, expected another value than 0")
        rows = None if transform is None else table(transform, "transform", np.float32, 3)
        if rows is not None and len(rows) != 2:
            raise UsageError(f"transform: found {len(rows)} rows, expected 2")
        made = struct("castor_texture", kind=choose(kind, _TEXTURE_KINDS, "kind"), image=image,
                      target=choose(target, _TEXTURE_TARGETS, "target"),
                      filter=choose(filter, _TEXTURE_FILTERS, "filter"), clamp=int(clamp), normalizer=normalizer,
                      bump_factor=bump_factor, noise_scale=noise_scale, noise_octaves=noise_octaves,
                      noise_absolute=int(noise_absolute), checker_scale=checker_scale, checker_offset=checker_offset,
                      mirror=int(mirror), coordinate_set=coordinate_set,
                      transform=None if rows is None else address(rows))
        made.black[:], made.white[:] = vector(black, "black"), vector(white, "white")
        return self._add(lambda index: lib.castor_scene_add_texture(self._handle.value, ctypes.byref(made), index))

    def set_background_texture(self, texture: int) -> None:
        """Makes a texture, whose target is "background", what eye rays see that meet nothing."""
        with self._lock:
            check(lib.castor_scene_set_background_texture(self._handle.value, texture))

    def set_instance_motions(self, motions: Any, first: int = 0) -> None:
        """Sets how far instances, from number `first` on, have moved when the shutter closes: (n, 3)."""
        self._set_motions(lib.castor_scene_set_instance_motions, motions, first)

    def set_sphere_motions(self, motions: Any, first: int = 0) -> None:
        """Sets how far spheres, from number `first` on, have moved when the shutter closes: (n, 3)."""
        self._set_motions(lib.castor_scene_set_sphere_motions, motions, first)

    def add_point_light(self, position: Vector, intensity: Vector, *, range: Optional[float] = None) -> int:
        """Adds a light whose irradiance at distance r is intensity / r^2; with a range, that times
        1 - (r / range)^4, and beyond it nothing. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_POINT, {"range": _range(range)}, position=position,
                               intensity=intensity)

    def add_directional_light(self, direction: Vector, radiance: Vector, *, angle_radians: float = 0.0) -> int:
        """Adds a light whose irradiance is `radiance` everywhere; it travels along `direction`. With an angle it comes
        from all of a disk that is seen under so many radians, at most pi, and shadows have soft edges. Where paths are
        traced, rays that meet nothing see the disk. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_DIRECTIONAL, {"angle_radians": angle_radians}, direction=direction,
                               intensity=radiance)

    def add_spot_light(self, position: Vector, direction: Vector, intensity: Vector, *, coverage_radians: float = 1.0,
                       falloff_radians: Optional[float] = None, square_falloff: bool = False,
                       range: Optional[float] = None) -> int:
        """Adds a point light with a cone: all its light inside the falloff angle (None: 0.8 times the other), none
        outside the coverage angle; both are full angles. Between them light falls as a fourth power, or as a square, as
        in glTF. `range` is as that of a point light. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_SPOT,
                               {"square_falloff": int(square_falloff), "range": _range(range)}, position=position,
                               direction=direction, intensity=intensity, coverage_radians=coverage_radians,
                               falloff_radians=0.8 * coverage_radians if falloff_radians is None else falloff_radians)

    def add_area_light(self, position: Vector, normal: Vector, edge: float, radiance: Vector) -> int:
        """Adds a square that lights both of its sides, and is not seen. Returns its number."""
        if not edge > 0:
            raise UsageError(f"edge: found {edge}, expected a positive number")
        return self._add_light(_c.CASTOR_LIGHT_KIND_AREA, {"edge": edge}, position=position, direction=normal,
                               intensity=radiance)

    def add_mesh_light(self, mesh: int) -> int:
        """Adds the light of a mesh whose material has an emission. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_MESH, {"object": mesh})

    def add_sphere_light(self, sphere: int) -> int:
        """Adds the light of a sphere whose material has an emission. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_SPHERE, {"object": sphere})

    def add_instance_light(self, instance: int) -> int:
        """Adds the light of an instance of a mesh, whose material has an emission. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_INSTANCE, {"object": instance})

    def add_environment_light(self, image: int, mapping: str = "latlong", *, cosine_sampling: bool = False) -> int:
        """Adds light from all directions, by an image of radiances; `mapping` is "latlong" or "probe". Directions to
        it are drawn by the cosine with the normal, or as the image's light is distributed. Returns its number."""
        return self._add_light(_c.CASTOR_LIGHT_KIND_ENVIRONMENT,
                               {"image": image, "mapping": choose(mapping, _ENVIRONMENT_MAPPINGS, "mapping"),
                                "cosine_sampling": int(cosine_sampling)})

    def add_camera(self, camera: Camera) -> int:
        """Adds a camera, and returns its number."""
        made, maps = camera._struct(), [(each._struct(), each.extension.encode()) for each in camera.tone_maps]
        number = self._add(lambda index: lib.castor_scene_add_camera(self._handle.value, ctypes.byref(made), index))
        for tone_map, extension in maps:
            with self._lock:
                check(lib.castor_scene_add_tone_map(self._handle.value, number, ctypes.byref(tone_map), extension))
        return number

    def add_default_view(self) -> None:
        """Adds a camera and lights that show all of the scene, and a material if it has none."""
        with self._lock:
            check(lib.castor_scene_add_default_view(self._handle.value))

    def set_background(self, color: Vector) -> None:
        """Sets the colour where rays hit nothing; (0, 0, 0) in a new scene."""
        self._set(background=color)

    def set_ambient_light(self, radiance: Vector) -> None:
        """Sets the light that ambient reflectances multiply; (0, 0, 0) in a new scene."""
        self._set(ambient_light=radiance)

    @property
    def cameras(self) -> list[Camera]:
        """Copies of the scene's cameras."""
        with self._lock:
            counts = ask("castor_scene_get_counts", "castor_scene_counts", self._handle.value)
            return [dataclasses.replace(Camera._of(ask("castor_scene_get_camera", "castor_camera", self._handle.value,
                                                       i)), tone_maps=self._tone_maps(i))
                    for i in range(counts.cameras)]

    @property
    def counts(self) -> dict[str, int]:
        """How many vertices, triangles, meshes, instances, spheres, planes, materials, lights, cameras, images and
        textures there are."""
        with self._lock:
            counts = ask("castor_scene_get_counts", "castor_scene_counts", self._handle.value)
        return {field[0]: int(getattr(counts, field[0])) for field in _c.castor_scene_counts._fields_[1:]}

    def find_lights(self, *words: str) -> list[int]:
        """The numbers of the lights that answer to words, each once, as Renderer.render takes them for `light_groups`.
        A word is a name of one or several, as the file gives and castor info lists it. Raises UsageError where it is
        none, with ten of the names at most."""
        found: dict[int, None] = {}
        with self._lock:
            for word in words:
                count = ctypes.c_size_t()
                check(lib.castor_scene_find_lights(self._handle.value, word.encode(), None, 0, ctypes.byref(count)))
                lights = (ctypes.c_uint32 * count.value)()
                check(lib.castor_scene_find_lights(self._handle.value, word.encode(), lights, len(lights),
                                                   ctypes.byref(count)))
                found.update(dict.fromkeys(lights))
        return list(found)

    @property
    def warnings(self) -> list[str]:
        """What the reader of the file noticed."""
        with self._lock:
            return warnings_of("scene", self._handle)

    def __repr__(self) -> str:
        parts = [f"{number} {name}" for name, number in self.counts.items() if number]
        return f"<castor.Scene: {', '.join(parts) or 'empty'}>"

    def _build(self, devices: Handle, strategy: int, quality: int, use_profiles: bool, progress: Progress) -> Handle:
        """The scene made ready for devices. Can be interrupted, unlike making a tracer or a renderer."""
        built = Handle("built_scene")

        def call(hook: Any) -> int:
            options = struct("castor_build_options", strategy=strategy, quality=quality,
                             ignore_profiles=int(not use_profiles), progress=hook)
            with self._lock:
                return int(lib.castor_built_scene_create(self._handle.value, devices.value, ctypes.byref(options),
                                                         built.out()))

        call_with_progress(call, _c.castor_progress_function, lambda fraction, user: fraction, progress, "building")
        return built

    def _tone_maps(self, camera: int) -> list[ToneMap]:
        count, made, extension = ctypes.c_size_t(), struct("castor_tone_map"), ctypes.c_char_p()
        check(lib.castor_scene_get_tone_map_count(self._handle.value, camera, ctypes.byref(count)))
        found = []
        for i in range(count.value):
            check(lib.castor_scene_get_tone_map(self._handle.value, camera, i, ctypes.byref(made),
                                                ctypes.byref(extension)))
            found.append(ToneMap._of(made, text(extension.value)))
        return found

    def _add(self, call: Any) -> int:
        index = ctypes.c_uint32()
        with self._lock:
            check(call(ctypes.byref(index)))
        return index.value

    def _material(self, number: Optional[int]) -> int:
        if number is None and self.counts["materials"] == 0:
            self.add_material(**_CLAY)
        return int(_numbers([0 if number is None else number], "material")[0])

    def _materials(self, numbers: Any, length: int) -> Any:
        return _numbers([self._material(None)] * length if numbers is None else numbers, "materials", length)

    def _set_motions(self, function: Any, motions: Any, first: int) -> None:
        rows = table(motions, "motions", np.float32, 3)
        with self._lock:
            check(function(self._handle.value, first, len(rows), address(rows)))

    def _add_light(self, kind: int, fields: Optional[dict[str, Any]] = None, *, coverage_radians: float = 0.0,
                   falloff_radians: float = 0.0, **vectors: Vector) -> int:
        made = struct("castor_light", kind=kind, coverage_radians=coverage_radians, falloff_radians=falloff_radians,
                      **(fields or {}))
        for name, value in vectors.items():
            getattr(made, name)[:] = vector(value, name)
        return self._add(lambda index: lib.castor_scene_add_light(self._handle.value, ctypes.byref(made), index))

    def _set(self, **vectors: Vector) -> None:
        with self._lock:
            settings = ask("castor_scene_get_settings", "castor_scene_settings", self._handle.value)
            for name, value in vectors.items():
                getattr(settings, name)[:] = vector(value, name)
            check(lib.castor_scene_set_settings(self._handle.value, ctypes.byref(settings)))


def _range(value: Optional[float]) -> float:
    """A light's range as the library has it: 0 where it has none."""
    if value is not None and not value > 0:
        raise UsageError(f"range: found {value}, expected a number above 0, or None")
    return value or 0.0


def _floats(values: Sequence[float]) -> Any:
    return (ctypes.c_float * len(values))(*values)


def _numbers(value: Any, name: str, length: Optional[int] = None) -> Any:
    """Indices (n,) as uint32."""
    numbers = table(host_array(value, name).reshape(-1, 1), name, np.uint32, 1).reshape(-1)
    if length is not None and len(numbers) != length:
        raise UsageError(f"{name}: found {len(numbers)}, expected {length}")
    return numbers
