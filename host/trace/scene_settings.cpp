#include "trace/scene_settings.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <type_traits>

namespace castor {

namespace {

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, glm::vec3>;

/// Appends values; lengths of lists as 64 bits.
class Writer {
public:
    template <class... Values>
    void operator()(const Values&... values) {
        (put(values), ...);
    }
    std::vector<std::byte> bytes;

private:
    template <Plain T>
    void put(const T& value) {
        const auto* begin = reinterpret_cast<const std::byte*>(&value);
        bytes.insert(bytes.end(), begin, begin + sizeof value);
    }
    template <class T>
    void put(const T& value) {
        exchange(*this, const_cast<T&>(value));
    }
    template <class T>
    void put(const std::vector<T>& values) {
        put(std::uint64_t{values.size()});
        for (const T& value : values) put(value);
    }
    template <class T>
    void put(const std::optional<T>& value) {
        put(value.has_value());
        if (value) put(*value);
    }
    void put(const std::string& text) {
        put(std::uint64_t{text.size()});
        for (const char c : text) put(c);
    }
};

/// Takes values away in the same order. After a problem all are as they were. A list grows by what is there, whatever
/// length is told of it, so that no file makes it take much more memory than the file itself.
class Reader {
public:
    explicit Reader(std::span<const std::byte> bytes) : size_(bytes.size()), left_(bytes) {}

    template <class... Values>
    void operator()(Values&... values) {
        (get(values), ...);
    }
    /// Returns what is wrong with the bytes now that all values are taken; empty: nothing.
    std::string problem() const {
        if (!problem_.empty() || left_.empty()) return problem_;
        return fmt::format("has {} bytes after its last value, byte {}", left_.size(), position());
    }

private:
    template <Plain T>
    void get(T& value) {
        if (failed()) return;
        if (left_.size() < sizeof value) {
            problem_ = fmt::format("ends within the value that begins at byte {}", position());
            return;
        }
        std::memcpy(&value, left_.data(), sizeof value);
        left_ = left_.subspan(sizeof value);
    }
    void get(bool& flag) {
        std::uint8_t value = flag;
        get(value);
        if (value > 1) problem_ = fmt::format("has the flag {} at byte {}, expected 0 or 1", value, position() - 1);
        flag = value == 1;
    }
    template <class T>
    void get(T& value) {
        exchange(*this, value);
    }
    template <class T>
    void get(std::vector<T>& values) {
        std::uint64_t size = 0;
        get(size);
        values.clear();
        for (std::uint64_t i = 0; i < size && !failed(); ++i) get(values.emplace_back());
    }
    template <class T>
    void get(std::optional<T>& value) {
        bool is_there = false;
        get(is_there);
        value.reset();
        if (is_there) get(value.emplace());
    }
    void get(std::string& text) {
        std::uint64_t size = 0;
        get(size);
        for (char c = 0; text.size() < size && !failed(); text += c) get(c);
    }

    bool failed() const { return !problem_.empty(); }
    std::size_t position() const { return size_ - left_.size(); }

    std::size_t size_;
    std::span<const std::byte> left_;
    std::string problem_;
};

// Lists the values of each kind, for both directions.

template <class Exchange>
void exchange(Exchange& e, ToneMap& t) {
    e(t.tone_operator, t.key, t.burn_percent, t.saturation, t.is_srgb, t.gamma, t.extension);
}

template <class Exchange>
void exchange(Exchange& e, PathTracing& p) {
    e(p.samples_brdf, p.samples_lights, p.weighs, p.roulette_from, p.bounces, p.largest_sample, p.light_choice);
}

template <class Exchange>
void exchange(Exchange& e, Camera& c) {
    e(c.image_name, c.position, c.gaze, c.up, c.left, c.right, c.bottom, c.top, c.distance, c.t_min, c.t_max, c.width,
      c.height, c.samples_per_pixel, c.left_handed, c.line, c.aperture_size, c.focus_distance, c.is_orthographic,
      c.tone_maps, c.path_tracing);
}

template <class Exchange>
void exchange(Exchange& e, Light& l) {
    e(l.kind, l.point.position, l.point.intensity, l.point.range, l.spot.range, l.directional.direction,
      l.directional.radiance, l.directional.angle_radians, l.spot.position, l.spot.direction, l.spot.intensity,
      l.spot.coverage_radians, l.spot.falloff_radians, l.spot.falloff, l.area.position, l.area.normal, l.area.size,
      l.area.radiance, l.object.object, l.environment.image, l.environment.mapping, l.environment.sampling, l.line,
      l.names);
}

template <class Exchange>
void exchange(Exchange& e, PrincipledMaterial& m) {
    e(m.base_color, m.alpha, m.base_color_texture, m.alpha_mode, m.alpha_cutoff, m.is_double_sided, m.is_unlit,
      m.metallic, m.roughness, m.metallic_roughness_texture, m.normal_texture, m.normal_scale, m.emissive,
      m.emissive_texture, m.emissive_strength, m.ior, m.specular, m.specular_texture, m.specular_color,
      m.specular_color_texture, m.transmission, m.transmission_texture, m.thickness, m.thickness_texture,
      m.attenuation_distance, m.attenuation_color, m.dispersion, m.diffuse_transmission, m.diffuse_transmission_texture,
      m.diffuse_transmission_color, m.diffuse_transmission_color_texture, m.clearcoat, m.clearcoat_texture,
      m.clearcoat_roughness, m.clearcoat_roughness_texture, m.clearcoat_normal_texture, m.clearcoat_normal_scale,
      m.sheen_color, m.sheen_color_texture, m.sheen_roughness, m.sheen_roughness_texture, m.anisotropy,
      m.anisotropy_rotation_radians, m.anisotropy_texture, m.iridescence, m.iridescence_texture, m.iridescence_ior,
      m.iridescence_thickness_minimum, m.iridescence_thickness_maximum, m.iridescence_thickness_texture,
      m.diffuse_roughness, m.diffuse_roughness_texture, m.multiscatter_color, m.scattering_anisotropy);
}

template <class Exchange>
void exchange(Exchange& e, Material& m) {
    e(m.kind, m.ambient, m.diffuse, m.specular, m.mirror, m.phong_exponent, m.refraction_index, m.absorption_index,
      m.absorption, m.roughness, m.emission, m.brdf, m.brdf_normalized, m.diffuse_fresnel, m.textures, m.principled,
      m.name);
}

/// Without the texels, which are columns.
template <class Exchange>
void exchange(Exchange& e, Image& i) {
    e(i.file, i.width, i.height);
}

template <class Exchange>
void exchange(Exchange& e, Texture& t) {
    e(t.kind, t.target, t.image, t.filter, t.wrap, t.normalizer, t.bump_factor, t.noise_scale, t.noise_octaves,
      t.noise_conversion, t.black, t.white, t.checker_scale, t.checker_offset, t.line);
}

template <class Exchange>
void exchange(Exchange& e, Warning& w) {
    e(w.file, w.line, w.text);
}

template <class Exchange>
void exchange(Exchange& e, Scene& s) {
    e(s.background, s.ambient_light, s.shadow_ray_epsilon, s.max_recursion_depth, s.cameras, s.lights, s.materials,
      s.images, s.textures, s.warnings, s.shades_both_sides);
    std::uint32_t background_texture = s.background_texture.value_or(CASTOR_INVALID_INDEX);
    e(background_texture);
    s.background_texture =
        background_texture == CASTOR_INVALID_INDEX ? std::nullopt : std::optional(background_texture);
}

template <class Exchange>
void exchange(Exchange& e, SceneSettings& s) {
    e(s.background, s.ambient_light, s.shadow_ray_epsilon, s.max_recursion_depth, s.background_texture, s.warnings,
      s.shades_both_sides);
}

template <class Exchange>
void exchange(Exchange& e, Box& box) {
    for (int axis = 0; axis < 3; ++axis) {
        float lower = box.lower[axis], upper = box.upper[axis];
        e(lower, upper);
        box.lower[axis] = lower;
        box.upper[axis] = upper;
    }
}

template <class Exchange>
void exchange(Exchange& e, SceneCounts& c) {
    e(c.triangles, c.spheres, c.planes, c.meshes, c.vertices);
}

template <class Exchange>
void exchange(Exchange& e, Chunk& c) {
    e(static_cast<SceneSettings&>(c.arrays), c.bounds, c.has_compressed, c.compressed_levels, c.has_wide, c.wide_root);
}

template <class Exchange>
void exchange(Exchange& e, SceneContents& p) {
    e(p.description, p.fingerprint, p.counts, p.chunks);
}

}  // namespace

std::vector<std::byte> settings_of(const SceneContents& contents) {
    Writer writer;
    writer(contents);
    return std::move(writer.bytes);
}

std::string set_settings(SceneContents& contents, std::span<const std::byte> bytes) {
    Reader reader(bytes);
    reader(contents);
    return reader.problem();
}

}  // namespace castor
