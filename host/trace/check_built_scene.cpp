#include "trace/check_built_scene.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/box.h"
#include "base/range.h"
#include "base/vec3.h"
#include "castor/error.h"
#include "castor/shared/constants.h"
#include "scene/environment_table.h"
#include "scene/light_tree.h"
#include "scene/placement.h"
#include "scene/validate.h"
#include "trace/instance_tree.h"

namespace castor {

namespace {

// The last two 32-bit numbers are not indices: see check_counts in validate.cpp.
constexpr std::uint64_t kMostElements = 0xfffffffeu;

// What `validate` allows, and a little more for what was rounded afterwards.
constexpr float kMostCoordinate = CASTOR_MAX_COORDINATE * (1.0f + 0x1p-20f);
constexpr double kMostCondition = 0x1p21;
constexpr double kMostScale = 0x1p29;
constexpr double kMostTranslation = kMostScale * CASTOR_MAX_COORDINATE;

constexpr float kUnitTolerance = 1e-3f;  // of the square of a length
constexpr float kInfinity = std::numeric_limits<float>::infinity();

constexpr std::uint32_t kBlockLanes = 4;
constexpr std::uint32_t kMostLeafBits = 24;  // of CompressedNode.meta: places of primitives

// Elements that one task checks.
constexpr std::size_t kGrain = 4096;

// False for NaN, too.
bool is_coordinate(float x) {
    return std::abs(x) <= kMostCoordinate;
}
bool are_coordinates(const glm::vec3& v) {
    return is_coordinate(v.x) && is_coordinate(v.y) && is_coordinate(v.z);
}

bool is_unit(const glm::vec3& v) {
    return std::abs(glm::dot(v, v) - 1.0f) <= kUnitTolerance;
}

glm::vec3 vec3_of(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}

/// Finds in which of several spans an element lies. Spans ascend, and each ends where the next begins; asking for one
/// element after the other is fast.
template <class Spans>
class Cursor {
public:
    explicit Cursor(const Spans& spans) : spans_(&spans) {}

    /// Returns the last span that begins at or before `i`: of those that begin there all but the last are empty.
    std::size_t find(std::uint64_t i) {
        const Spans& spans = *spans_;
        if (!(i >= begin_ && i < end_)) {
            std::size_t first = 0;
            for (std::size_t count = spans.size(); count > 1;) {
                const std::size_t half = count / 2;
                if (spans.begin(first + half) <= i) {
                    first += half;
                    count -= half;
                } else {
                    count = half;
                }
            }
            current_ = first;
            begin_ = spans.begin(first);
            end_ = first + 1 < spans.size() ? spans.begin(first + 1) : std::numeric_limits<std::uint64_t>::max();
        }
        return current_;
    }

private:
    const Spans* spans_;
    std::size_t current_ = 0;
    std::uint64_t begin_ = 1, end_ = 0;
};

/// Where the triangles of each mesh range begin.
struct MeshTriangles {
    const Column<shared::MeshRange>& ranges;
    std::size_t size() const { return ranges.size(); }
    std::uint64_t begin(std::size_t i) const { return ranges[i].first_triangle; }
};

/// Where the triangles of each geometry begin.
struct GeometryTriangles {
    const Column<shared::Geometry>& geometries;
    std::size_t size() const { return geometries.size(); }
    std::uint64_t begin(std::size_t i) const { return geometries[i].first_triangle; }
};

/// A geometry's tree among the nodes of all.
struct Tree {
    std::uint32_t geometry;
    Range nodes;  // the first is the root
};

struct Trees {
    std::vector<Tree> trees;
    std::size_t size() const { return trees.size(); }
    std::uint64_t begin(std::size_t i) const { return trees[i].nodes.begin; }
};

/// The parent of each node, set by several threads.
class Parents {
public:
    explicit Parents(std::size_t node_count) : parents_(node_count, CASTOR_INVALID_INDEX), adopted_twice_(node_count) {}

    void set(std::size_t child, std::size_t parent) {
        const std::uint32_t before =
            std::atomic_ref(parents_[child]).exchange(static_cast<std::uint32_t>(parent), std::memory_order_relaxed);
        if (before == CASTOR_INVALID_INDEX) return;
        std::size_t least = adopted_twice_;
        while (child < least && !adopted_twice_.compare_exchange_weak(least, child)) {
        }
    }

    std::uint32_t operator[](std::size_t child) const { return parents_[child]; }
    /// The first node that is the child of two; the number of nodes if there is none.
    std::size_t adopted_twice() const { return adopted_twice_; }

private:
    std::vector<std::uint32_t> parents_;
    std::atomic<std::size_t> adopted_twice_;
};

/// Checks one chunk; the columns that are not cut are the first chunk's.
class ChunkCheck {
public:
    ChunkCheck(const SceneContents& scene, std::size_t number, const std::string& file, ProgressCount& elements_done)
        : scene_(scene),
          chunk_(scene.chunks[number]),
          arrays_(chunk_.arrays),
          number_(number),
          file_(file),
          elements_done_(elements_done) {}

    void run() {
        check_settings();
        check_lengths();
        check_materials();
        check_textures();
        check_texture_images();
        check_lights();
        check_light_tree();
        check_emitters();
        check_environments();
        check_geometries();
        check_mesh_ranges();
        check_vertices();
        check_attributes();
        check_triangles();
        check_spheres();
        check_planes();
        check_primitive_numbers();
        check_instances();
        check_wide_trees();
        check_compressed_trees();
        check_instance_tree();
    }

private:
    // ---- Refusing ----

    [[noreturn]] void refuse(std::string_view section, const std::string& problem) const {
        const std::string suffix = number_ == 0 ? "" : fmt::format("@{}", number_);
        throw SceneError(file_, 0, fmt::format("is damaged: its section {}{} has {}", section, suffix, problem));
    }
    [[noreturn]] void refuse_settings(const std::string& problem) const {
        throw SceneError(file_, 0,
                         fmt::format("is damaged: its section settings has {} of chunk {}", problem, number_));
    }

    void require(bool condition, std::string_view section, const std::string& problem) const {
        if (!condition) refuse(section, problem);
    }
    void require_length(std::string_view section, std::uint64_t found, std::uint64_t expected,
                        std::string_view as) const {
        if (found != expected) refuse(section, fmt::format("{} elements, expected {}, {}", found, expected, as));
    }

    /// Checks elements 0 to `count` in parallel: make_check() makes a check for one thread, and check(i, fail) returns
    /// whether element i is valid, or fail(text), where text() says what is wrong. The first such element is told.
    template <class MakeCheck>
    void check_each(std::string_view section, std::size_t count, const MakeCheck& make_check) const {
        using TaskRange = tbb::blocked_range<std::size_t>;
        const auto search = [&](const TaskRange& range, std::size_t best) {
            if (range.begin() >= best) return best;
            auto check = make_check();
            elements_done_.add(range.size());
            for (std::size_t i = range.begin(); i != range.end(); ++i)
                if (!check(i, [](const auto&) { return false; })) return std::min(best, i);
            return best;
        };
        const std::size_t bad = tbb::parallel_reduce(TaskRange(0, count, kGrain), count, search,
                                                     [](std::size_t a, std::size_t b) { return std::min(a, b); });
        if (bad == count) return;
        std::string problem;
        auto check = make_check();
        check(bad, [&](const auto& describe) {
            problem = describe();
            return false;
        });
        refuse(section, fmt::format("in element {} {}", bad, problem));
    }

    /// The same, where a check is one function for all elements.
    template <class Check>
    void check_all(std::string_view section, std::size_t count, const Check& check) const {
        check_each(section, count, [&] { return [&](std::size_t i, const auto& fail) { return check(i, fail); }; });
    }

    // ---- Settings and looks ----

    void check_settings() const {
        const auto finite = [&](const char* what, const glm::vec3& v) {
            if (!is_finite(v)) refuse_settings(fmt::format("the {} {}, expected finite numbers,", what, text(v)));
        };
        finite("background", arrays_.background);
        finite("ambient light", arrays_.ambient_light);
        if (!(arrays_.shadow_ray_epsilon >= 0.0f && arrays_.shadow_ray_epsilon <= CASTOR_MAX_COORDINATE))
            refuse_settings(fmt::format("the shadow ray epsilon {}, expected 0 to {:g},", arrays_.shadow_ray_epsilon,
                                        CASTOR_MAX_COORDINATE));
        const Box& box = chunk_.bounds;
        for (int axis = 0; axis < 3; ++axis) {
            const float lower = box.lower[axis], upper = box.upper[axis];
            const bool is_empty = lower == kInfinity && upper == -kInfinity;
            if (!is_empty && !(std::isfinite(lower) && std::isfinite(upper) && lower <= upper))
                refuse_settings(
                    fmt::format("the bounds {} to {}, expected finite numbers, the lower one first,", lower, upper));
        }
    }

    void check_lengths() const {
        for_each_column(chunk_, [&](const char* name, const auto& column) {
            require(column.size() <= kMostElements, name,
                    fmt::format("{} elements, expected at most {}", column.size(), kMostElements));
        });
        require(primitive_count() <= kMostElements, "triangle_vertices",
                fmt::format("{} elements, with spheres and planes {}, expected at most {}", arrays_.triangle_count(),
                            primitive_count(), kMostElements));
        require_length("sphere_material", arrays_.sphere_material.size(), arrays_.sphere_count(), "one a sphere");
        require_length("plane_normal", arrays_.plane_normal.size(), arrays_.plane_count(), "one a plane");
        require_length("plane_material", arrays_.plane_material.size(), arrays_.plane_count(), "one a plane");
        require(!arrays_.geometries.empty(), "geometries", "no element, expected at least one");
        if (number_ > 0) {
            require_length("plane_point", arrays_.plane_count(), 0, "since the first chunk has all planes");
            require_length("instances", arrays_.instances.size(), 0, "since the first chunk has all instances");
            require_length("materials", arrays_.materials.size(), 0, "since the first chunk has all materials");
            require_length("principled_materials", arrays_.principled_materials.size(), 0,
                           "since the first chunk has all materials");
            require_length("lights", arrays_.lights.size(), 0, "since the first chunk has all lights");
            require_length("textures", arrays_.textures.size(), 0, "since the first chunk has all textures");
            require_length("texture_uses", arrays_.texture_uses.size(), 0, "since the first chunk has all textures");
            require_length("texture_images", arrays_.texture_images.size(), 0, "since the first chunk has all images");
            require_length("texels", arrays_.texels.size(), 0, "since the first chunk has all images");
            require_length("emitters", arrays_.emitters.size(), 0, "since the first chunk has all emitters");
            require_length("environment_parts", arrays_.environment_parts.size(), 0,
                           "since the first chunk has all environments");
            require_length("light_nodes", arrays_.light_nodes.size(), 0, "since the first chunk has all lights");
            require_length("geometries", arrays_.geometries.size(), scene_.arrays().geometries.size(),
                           "as many as in the first chunk");
        }
        if (scene_.arrays().instances.empty())
            require_length("geometries", arrays_.geometries.size(), 1, "since there are no instances");
    }

    void check_materials() const {
        check_all("materials", arrays_.materials.size(), [&](std::size_t i, const auto& fail) {
            const shared::Material& m = arrays_.materials[i];
            if (m.kind > CASTOR_MATERIAL_PRINCIPLED)
                return fail(
                    [&] { return fmt::format("the kind {}, expected 0 to {}", m.kind, CASTOR_MATERIAL_PRINCIPLED); });
            if ((m.kind == CASTOR_MATERIAL_PRINCIPLED) != (m.principled != CASTOR_INVALID_INDEX) ||
                (m.principled != CASTOR_INVALID_INDEX && m.principled >= arrays_.principled_materials.size()))
                return fail([&] {
                    return fmt::format("the kind {} and the principled material {} of {}", m.kind, m.principled,
                                       arrays_.principled_materials.size());
                });
            if (!is_finite(m.ambient) || !is_finite(m.diffuse) || !is_finite(m.specular) || !is_finite(m.mirror))
                return fail([&] { return "a reflectance that is not finite"; });
            for (const float x : {m.phong_exponent, m.refraction_index, m.absorption_index})
                if (!(x >= 0.0f && std::isfinite(x)))
                    return fail([&] { return fmt::format("the exponent or index {}, expected at least 0", x); });
            for (const float x : m.scattering_albedo)
                if (!(x >= 0.0f && x <= 1.0f))
                    return fail([&] { return fmt::format("the scattering albedo {}, expected 0 to 1", x); });
            if (std::uint64_t{m.first_texture} + m.texture_count > arrays_.texture_uses.size())
                return fail([&] {
                    return fmt::format("{} textures from {} on, expected numbers below {}", m.texture_count,
                                       m.first_texture, arrays_.texture_uses.size());
                });
            if (m.light != CASTOR_INVALID_INDEX && m.light >= arrays_.lights.size())
                return fail([&] { return fmt::format("the light {} of {}", m.light, arrays_.lights.size()); });
            return true;
        });
        check_all("principled_materials", arrays_.principled_materials.size(), [&](std::size_t i, const auto& fail) {
            const shared::PrincipledMaterial& m = arrays_.principled_materials[i];
            for (const auto& color : {std::span(m.base_color), std::span(m.specular_color), std::span(m.sheen_color),
                                      std::span(m.diffuse_transmission_color)})
                for (const float x : color)
                    if (!(x >= 0.0f && std::isfinite(x)))
                        return fail([&] { return fmt::format("the colour {}, expected at least 0", x); });
            for (const float x :
                 {m.metallic, m.specular, m.sheen_roughness, m.diffuse_transmission, m.roughness, m.anisotropy,
                  m.diffuse_roughness, m.transmission, m.refraction_index, m.absorption_index, m.clearcoat,
                  m.clearcoat_roughness, m.alpha, m.alpha_cutoff, m.dispersion, m.iridescence, m.iridescence_index,
                  m.iridescence_thickness_minimum, m.iridescence_thickness_maximum})
                if (!(x >= 0.0f && std::isfinite(x)))
                    return fail([&] { return fmt::format("the parameter {}, expected at least 0", x); });
            for (const float x : {m.normal_scale, m.anisotropy_cosine, m.anisotropy_sine, m.clearcoat_normal_scale})
                if (!std::isfinite(x))
                    return fail([&] { return fmt::format("the parameter {}, expected a finite number", x); });
            if (!(std::abs(m.scattering_anisotropy) < 1.0f))
                return fail([&] {
                    return fmt::format("the scattering anisotropy {}, expected more than -1 and less than 1",
                                       m.scattering_anisotropy);
                });
            for (const std::uint32_t texture : m.texture)
                if (texture != CASTOR_INVALID_INDEX && !is_picture_of_bytes(texture))
                    return fail([&] {
                        return fmt::format("the texture {}, expected an image of bytes among {}", texture,
                                           arrays_.textures.size());
                    });
            return true;
        });
    }

    bool is_picture_of_bytes(std::uint32_t texture) const {
        if (texture >= arrays_.textures.size() || arrays_.textures[texture].kind != CASTOR_TEXTURE_IMAGE) return false;
        const std::uint32_t image = arrays_.textures[texture].image;
        return image < arrays_.texture_images.size() && arrays_.texture_images[image].format == CASTOR_TEXELS_BYTES;
    }

    void check_textures() const {
        check_all("textures", arrays_.textures.size(), [&](std::size_t i, const auto& fail) {
            const shared::Texture& t = arrays_.textures[i];
            if (t.kind > CASTOR_TEXTURE_CHECKERBOARD || t.target > CASTOR_TARGET_PRINCIPLED ||
                t.filter > CASTOR_TEXTURE_TRILINEAR || (t.wrap & CASTOR_WRAP_MASK) > CASTOR_WRAP_MIRROR ||
                t.wrap >> CASTOR_WRAP_BITS > CASTOR_WRAP_MIRROR || t.noise_conversion > CASTOR_NOISE_ABSOLUTE)
                return fail([&] {
                    return fmt::format(
                        "the kind {}, target {}, filter {}, wrap {} and conversion {}, of which one is "
                        "none",
                        t.kind, t.target, t.filter, t.wrap, t.noise_conversion);
                });
            if (t.kind == CASTOR_TEXTURE_IMAGE && t.image >= arrays_.texture_images.size())
                return fail([&] {
                    return fmt::format("the image {}, expected one of {}", t.image, arrays_.texture_images.size());
                });
            if (t.noise_octaves < 1 || t.noise_octaves > CASTOR_MAX_NOISE_OCTAVES)
                return fail([&] {
                    return fmt::format("{} octaves, expected 1 to {}", t.noise_octaves, CASTOR_MAX_NOISE_OCTAVES);
                });
            for (const float x : {t.normalizer, t.bump_factor, t.noise_scale, t.checker_scale, t.checker_offset})
                if (!std::isfinite(x))
                    return fail([&] { return fmt::format("the factor {}, expected a finite number", x); });
            if (!is_finite(t.black) || !is_finite(t.white)) return fail([&] { return "a colour that is not finite"; });
            return true;
        });
        check_all("texture_uses", arrays_.texture_uses.size(), [&](std::size_t i, const auto& fail) {
            if (arrays_.texture_uses[i] < arrays_.textures.size()) return true;
            return fail([&] {
                return fmt::format("the texture {}, expected one of {}", arrays_.texture_uses[i],
                                   arrays_.textures.size());
            });
        });
        const std::uint32_t background = arrays_.background_texture;
        if (background != CASTOR_INVALID_INDEX && (background >= scene_.arrays().textures.size() ||
                                                   scene_.arrays().textures[background].kind != CASTOR_TEXTURE_IMAGE))
            refuse_settings(fmt::format("the background texture {}, expected one of {} that is an image,", background,
                                        scene_.arrays().textures.size()));
    }

    /// One after the other, without gaps.
    void check_texture_images() const {
        std::uint64_t texels = 0;
        for (std::size_t i = 0; i < arrays_.texture_images.size(); ++i) {
            const shared::TextureImage& image = arrays_.texture_images[i];
            const auto most_levels = static_cast<std::uint32_t>(std::bit_width(std::max(image.width, image.height)));
            if (image.width == 0 || image.height == 0 || image.format > CASTOR_TEXELS_FLOATS ||
                image.level_count == 0 || image.level_count > most_levels || image.first_texel != texels)
                refuse("texture_images",
                       fmt::format("in element {} {} levels of {} x {} texels of format {} from {} on, expected 1 to "
                                   "{} from {} on, and format 0 or 1",
                                   i, image.level_count, image.width, image.height, image.format, image.first_texel,
                                   most_levels, texels));
            std::uint64_t width = image.width, height = image.height;
            for (std::uint32_t level = 0; level < image.level_count && texels <= kMostElements; ++level) {
                texels += width * height * (image.format == CASTOR_TEXELS_FLOATS ? 3 : 1);
                width = std::max<std::uint64_t>(1, width / 2);
                height = std::max<std::uint64_t>(1, height / 2);
            }
        }
        require_length("texels", arrays_.texels.size(), texels, "as texture_images says");
    }

    void check_lights() const {
        check_all("lights", arrays_.lights.size(), [&](std::size_t i, const auto& fail) {
            const shared::Light& light = arrays_.lights[i];
            const glm::vec3 position = vec3_of(light.position), direction = vec3_of(light.direction);
            if (light.kind > CASTOR_LIGHT_ENVIRONMENT)
                return fail(
                    [&] { return fmt::format("the kind {}, expected 0 to {}", light.kind, CASTOR_LIGHT_ENVIRONMENT); });
            if (!are_coordinates(position))
                return fail([&] {
                    return fmt::format("the position {}, expected coordinates up to {:g}", text(position),
                                       CASTOR_MAX_COORDINATE);
                });
            if (!is_finite(light.intensity)) return fail([&] { return "an intensity that is not finite"; });
            const bool has_direction = light.kind >= CASTOR_LIGHT_DIRECTIONAL && light.kind <= CASTOR_LIGHT_AREA;
            if (has_direction && !is_unit(direction))
                return fail([&] { return fmt::format("the direction {}, expected a unit vector", text(direction)); });
            if (light.kind == CASTOR_LIGHT_AREA && !is_unit(vec3_of(light.tangent)))
                return fail([&] { return "a tangent that is no unit vector"; });
            if (!(light.size >= 0.0f && std::isfinite(light.size)))
                return fail([&] { return fmt::format("the size {}, expected a number of at least 0", light.size); });
            if (light.kind == CASTOR_LIGHT_DIRECTIONAL && light.size > 1.0f)  // 1 - the cosine of at most a right angle
                return fail([&] { return fmt::format("the size {}, expected 0 to 1", light.size); });
            const bool moves = light.kind == CASTOR_LIGHT_MESH || light.kind == CASTOR_LIGHT_SPHERE;
            if (moves && !are_coordinates(direction))
                return fail([&] {
                    return fmt::format("the motion {}, expected coordinates up to {:g}", text(direction),
                                       CASTOR_MAX_COORDINATE);
                });
            if (light.kind == CASTOR_LIGHT_SPHERE && light.first != 0 && light.first >= arrays_.instances.size())
                return fail([&] {
                    return fmt::format("the instance {}, expected numbers below {}", light.first,
                                       arrays_.instances.size());
                });
            if (light.kind == CASTOR_LIGHT_ENVIRONMENT &&
                (light.first >= arrays_.texture_images.size() || light.mapping > CASTOR_ENVIRONMENT_PROBE ||
                 light.sampling > CASTOR_ENVIRONMENT_PICTURE))
                return fail([&] {
                    return fmt::format("the picture {} of {}, with mapping {} and sampling {}", light.first,
                                       arrays_.texture_images.size(), light.mapping, light.sampling);
                });
            if (light.kind == CASTOR_LIGHT_MESH && light.mapping > CASTOR_MESH_CLOSED_INWARD)
                return fail([&] {
                    return fmt::format("the hull {}, expected numbers up to {}", light.mapping,
                                       CASTOR_MESH_CLOSED_INWARD);
                });
            if (light.kind == CASTOR_LIGHT_MESH && light.sampling > CASTOR_MESH_SMOOTH)
                return fail([&] {
                    return fmt::format("the sampling {} of a mesh, expected numbers up to {}", light.sampling,
                                       CASTOR_MESH_SMOOTH);
                });
            if (light.kind == CASTOR_LIGHT_MESH && std::uint64_t{light.first} + light.count > arrays_.emitters.size())
                return fail([&] {
                    return fmt::format("{} emitters from {} on, expected numbers below {}", light.count, light.first,
                                       arrays_.emitters.size());
                });
            if (light.principled != CASTOR_INVALID_INDEX &&
                (light.principled >= arrays_.principled_materials.size() ||
                 !is_picture_of_bytes(arrays_.principled_materials[light.principled].texture[CASTOR_SLOT_EMISSION])))
                return fail([&] {
                    return fmt::format("the principled material {} of {}, expected one with a picture of its emission",
                                       light.principled, arrays_.principled_materials.size());
                });
            if (!(light.cos_coverage >= -1.0f && light.cos_coverage <= light.cos_falloff && light.cos_falloff <= 1.0f))
                return fail([&] {
                    return fmt::format(
                        "the cosines {} of the coverage and {} of the falloff, expected -1 to 1, the "
                        "second not less than the first",
                        light.cos_coverage, light.cos_falloff);
                });
            return true;
        });
    }

    void check_light_tree() const {
        const std::string problem = problem_of_light_tree(arrays_);
        if (!problem.empty()) refuse("light_nodes", problem);
    }

    void check_environments() const {
        const auto& parts = arrays_.environment_parts;
        for (std::size_t i = 0; i < arrays_.lights.size(); ++i) {
            const shared::Light& light = arrays_.lights[i];
            if (light.kind != CASTOR_LIGHT_ENVIRONMENT || light.sampling != CASTOR_ENVIRONMENT_PICTURE) continue;
            if (light.count % 4 != 0 || light.count > parts.size())
                refuse("lights", fmt::format("in element {} a table from word {} of {} on, expected a multiple of 4", i,
                                             light.count, parts.size()));
            const shared::TextureImage& image = arrays_.texture_images[light.first];
            const std::string problem = problem_of_environment_table(
                std::span(parts.data(), parts.size()).subspan(light.count), image.width, image.height);
            if (!problem.empty()) refuse("environment_parts", fmt::format("for light {} {}", i, problem));
        }
    }

    void check_emitters() const {
        check_all("emitters", arrays_.emitters.size(), [&](std::size_t i, const auto& fail) {
            const shared::Emitter& emitter = arrays_.emitters[i];
            if (!are_coordinates(vec3_of(emitter.corner)) || !are_coordinates(0.5f * vec3_of(emitter.edge_u)) ||
                !are_coordinates(0.5f * vec3_of(emitter.edge_v)))
                return fail([&] {
                    return fmt::format("a corner or edge that is no number, or larger than {:g}",
                                       CASTOR_MAX_COORDINATE);
                });
            if (emitter.begin >= emitter.end || emitter.end > CASTOR_EMITTER_PARTS)
                return fail([&] {
                    return fmt::format("the parts {} to {}, expected some of {}", emitter.begin, emitter.end,
                                       CASTOR_EMITTER_PARTS);
                });
            return true;
        });
    }

    template <class Fail>
    bool check_material_index(std::uint32_t material, const Fail& fail) const {
        const std::size_t count = scene_.arrays().materials.size();
        if (material < count) return true;
        return fail([&] { return fmt::format("the material {}, expected one of {}", material, count); });
    }

    // ---- Primitives ----

    std::uint64_t primitive_count() const {
        return std::uint64_t{arrays_.triangle_count()} + arrays_.sphere_count() + arrays_.plane_count();
    }

    /// One after the other, without gaps: over few elements, each of which depends on the one before.
    void check_geometries() {
        std::uint64_t triangles = 0, spheres = 0;
        for (std::size_t i = 0; i < arrays_.geometries.size(); ++i) {
            const shared::Geometry& geometry = arrays_.geometries[i];
            if (geometry.first_triangle != triangles || geometry.first_sphere != spheres)
                refuse("geometries",
                       fmt::format("in element {} the first triangle {} and sphere {}, expected {} and {}", i,
                                   geometry.first_triangle, geometry.first_sphere, triangles, spheres));
            triangles += geometry.triangle_count;
            spheres += geometry.sphere_count;
            if (triangles > arrays_.triangle_count() || spheres > arrays_.sphere_count())
                refuse("geometries", fmt::format("in element {} {} triangles and {} spheres, more than there are", i,
                                                 geometry.triangle_count, geometry.sphere_count));
            if (!(geometry.largest_coordinate >= 0.0f && geometry.largest_coordinate <= kMostCoordinate))
                refuse("geometries", fmt::format("in element {} the largest coordinate {}, expected 0 to {:g}", i,
                                                 geometry.largest_coordinate, CASTOR_MAX_COORDINATE));
        }
        if (triangles != arrays_.triangle_count() || spheres != arrays_.sphere_count())
            refuse("geometries", fmt::format("{} triangles and {} spheres in all, expected {} and {}", triangles,
                                             spheres, arrays_.triangle_count(), arrays_.sphere_count()));
        has_bounded_.assign(arrays_.geometries.size(), 0);
        for (std::size_t i = 0; i < has_bounded_.size(); ++i)
            has_bounded_[i] = arrays_.geometries[i].sphere_count > 0 ? 1 : 0;
    }

    void check_mesh_ranges() const {
        const auto& ranges = arrays_.mesh_ranges;
        require(ranges.empty() == arrays_.triangle_vertices.empty(), "mesh_ranges",
                fmt::format("{} elements for {} triangles", ranges.size(), arrays_.triangle_count()));
        check_all("mesh_ranges", ranges.size(), [&](std::size_t i, const auto& fail) {
            const shared::MeshRange& range = ranges[i];
            const bool begins_well = i == 0 ? range.first_triangle == 0
                                            : range.first_triangle > ranges[i - 1].first_triangle &&
                                                  range.first_vertex >= ranges[i - 1].first_vertex;
            if (!begins_well || range.first_triangle >= arrays_.triangle_count() ||
                range.first_vertex >= arrays_.vertex_position.size())
                return fail([&] {
                    return fmt::format(
                        "the first triangle {} of {} and vertex {} of {}, expected 0 in the first element and more "
                        "than before in the others",
                        range.first_triangle, arrays_.triangle_count(), range.first_vertex,
                        arrays_.vertex_position.size());
                });
            return check_material_index(range.material, fail);
        });
    }

    void check_vertices() const {
        check_all("vertex_position", arrays_.vertex_position.size(), [&](std::size_t i, const auto& fail) {
            const glm::vec3& p = arrays_.vertex_position[i];
            if (are_coordinates(p)) return true;
            return fail([&] {
                return fmt::format("the position {}, expected coordinates up to {:g}", text(p), CASTOR_MAX_COORDINATE);
            });
        });
        check_all("vertex_normal", arrays_.vertex_normal.size(), [&](std::size_t i, const auto& fail) {
            const glm::vec3& n = arrays_.vertex_normal[i];
            if (is_finite(n)) return true;
            return fail([&] { return fmt::format("the normal {}, expected finite numbers", text(n)); });
        });
        check_all("vertex_uv", arrays_.vertex_uv.size(), [&](std::size_t i, const auto& fail) {
            const glm::vec2& uv = arrays_.vertex_uv[i];
            if (is_coordinate(uv.x) && is_coordinate(uv.y)) return true;
            return fail([&] {
                return fmt::format("the texture coordinates {} {}, expected magnitudes up to {:g}", uv.x, uv.y,
                                   CASTOR_MAX_COORDINATE);
            });
        });
    }

    void check_attributes() const {
        check_all("vertex_attributes", arrays_.vertex_attributes.size(), [&](std::size_t i, const auto& fail) {
            const shared::VertexAttributes& a = arrays_.vertex_attributes[i];
            for (const float x : {a.tangent[0], a.tangent[1], a.tangent[2], a.tangent[3], a.color[0], a.color[1],
                                  a.color[2], a.color[3], a.uv_1[0], a.uv_1[1]})
                if (!is_coordinate(x))
                    return fail([&] {
                        return fmt::format("the number {}, expected a magnitude up to {:g}", x, CASTOR_MAX_COORDINATE);
                    });
            return true;
        });
    }

    void check_triangles() {
        const MeshTriangles meshes{arrays_.mesh_ranges};
        const GeometryTriangles geometries{arrays_.geometries};
        check_each("triangle_vertices", arrays_.triangle_count(), [&] {
            return [&, mesh = Cursor(meshes), geometry = Cursor(geometries)](std::size_t i, const auto& fail) mutable {
                const glm::uvec3& t = arrays_.triangle_vertices[i];
                const std::size_t m = mesh.find(i);
                const Range vertices = vertices_of(m);
                const std::uint32_t least = std::min({t.x, t.y, t.z}), greatest = std::max({t.x, t.y, t.z});
                if (least < vertices.begin || greatest >= vertices.end)
                    return fail([&] {
                        return fmt::format("the vertices {}, {} and {}, expected numbers from {} to {}", t.x, t.y, t.z,
                                           vertices.begin, vertices.end - 1);
                    });
                const shared::MeshRange& range = arrays_.mesh_ranges[m];
                if (range.first_normal != CASTOR_INVALID_INDEX &&
                    range.first_normal + std::uint64_t{greatest - range.first_vertex} >= arrays_.vertex_normal.size())
                    return fail([&] {
                        return fmt::format("the vertex {}, whose normal is {}, expected a number below {}", greatest,
                                           range.first_normal + std::uint64_t{greatest - range.first_vertex},
                                           arrays_.vertex_normal.size());
                    });
                if (range.first_uv != CASTOR_INVALID_INDEX &&
                    range.first_uv + std::uint64_t{greatest - range.first_vertex} >= arrays_.vertex_uv.size())
                    return fail([&] {
                        return fmt::format(
                            "the vertex {}, whose texture coordinates are {}, expected a number below "
                            "{}",
                            greatest, range.first_uv + std::uint64_t{greatest - range.first_vertex},
                            arrays_.vertex_uv.size());
                    });
                if (range.first_attributes != CASTOR_INVALID_INDEX &&
                    range.first_attributes + std::uint64_t{greatest - range.first_vertex} >=
                        arrays_.vertex_attributes.size())
                    return fail([&] {
                        return fmt::format("the vertex {}, whose attributes are {}, expected a number below {}",
                                           greatest,
                                           range.first_attributes + std::uint64_t{greatest - range.first_vertex},
                                           arrays_.vertex_attributes.size());
                    });
                // What is degenerate has no place in a tree: see primitive_ref.cpp.
                if (t.x != t.y) note_bounded(geometry.find(i));
                return true;
            };
        });
    }

    /// The vertices of a mesh's own: no other mesh's triangles have them.
    Range vertices_of(std::size_t mesh) const {
        const auto& ranges = arrays_.mesh_ranges;
        const std::uint64_t end =
            mesh + 1 < ranges.size() ? ranges[mesh + 1].first_vertex : arrays_.vertex_position.size();
        return {ranges[mesh].first_vertex, end};
    }

    void note_bounded(std::size_t geometry) {
        std::atomic_ref flag(has_bounded_[geometry]);
        if (!flag.load(std::memory_order_relaxed)) flag.store(1, std::memory_order_relaxed);
    }

    void check_spheres() const {
        check_all("sphere_center_radius", arrays_.sphere_count(), [&](std::size_t i, const auto& fail) {
            const glm::vec4& sphere = arrays_.sphere_center_radius[i];
            const Box box = sphere_box(sphere);
            bool is_valid = sphere.w > 0.0f && are_coordinates(glm::vec3(sphere));
            for (int axis = 0; axis < 3; ++axis)
                is_valid = is_valid && is_coordinate(box.lower[axis]) && is_coordinate(box.upper[axis]);
            if (is_valid) return true;
            return fail([&] {
                return fmt::format(
                    "the center {} and radius {}, expected a radius above 0 and a box within coordinates up to {:g}",
                    text(glm::vec3(sphere)), sphere.w, CASTOR_MAX_COORDINATE);
            });
        });
        check_all("sphere_material", arrays_.sphere_count(), [&](std::size_t i, const auto& fail) {
            return check_material_index(arrays_.sphere_material[i], fail);
        });
    }

    void check_planes() const {
        check_all("plane_point", arrays_.plane_count(), [&](std::size_t i, const auto& fail) {
            const glm::vec3 point(arrays_.plane_point[i]);
            if (are_coordinates(point)) return true;
            return fail([&] {
                return fmt::format("the point {}, expected coordinates up to {:g}", text(point), CASTOR_MAX_COORDINATE);
            });
        });
        check_all("plane_normal", arrays_.plane_count(), [&](std::size_t i, const auto& fail) {
            const glm::vec3 normal(arrays_.plane_normal[i]);
            if (is_unit(normal)) return true;
            return fail([&] { return fmt::format("the normal {}, expected a unit vector", text(normal)); });
        });
        check_all("plane_material", arrays_.plane_count(), [&](std::size_t i, const auto& fail) {
            return check_material_index(arrays_.plane_material[i], fail);
        });
    }

    /// A chunk's primitives keep their numbers, in which kernels search.
    void check_primitive_numbers() const {
        const auto& numbers = chunk_.primitive_numbers;
        const bool is_whole = scene_.chunks.size() == 1;
        if (is_whole && numbers.empty()) return;
        require_length("primitive_numbers", numbers.size(), primitive_count(), "one a triangle, sphere and plane");
        require(!numbers.empty(), "primitive_numbers", "no element, but the chunk is not the only one");
        const GeometryTriangles geometries{arrays_.geometries};
        const struct GeometrySpheres {
            const Column<shared::Geometry>& geometries;
            std::uint64_t triangle_count;
            std::size_t size() const { return geometries.size(); }
            std::uint64_t begin(std::size_t i) const { return triangle_count + geometries[i].first_sphere; }
        } spheres{arrays_.geometries, arrays_.triangle_count()};
        const std::uint64_t first_sphere = arrays_.triangle_count(),
                            first_plane = first_sphere + arrays_.sphere_count();
        check_each("primitive_numbers", numbers.size(), [&, is_whole] {
            return [&, is_whole, of_triangle = Cursor(geometries), of_sphere = Cursor(spheres)](
                       std::size_t i, const auto& fail) mutable {
                std::uint64_t begin = first_plane, before = 0;  // of the same kind and geometry; other kinds' count
                if (i < first_sphere) {
                    begin = arrays_.geometries[of_triangle.find(i)].first_triangle;
                } else if (i < first_plane) {
                    const shared::Geometry& geometry = arrays_.geometries[of_sphere.find(i)];
                    begin = first_sphere + geometry.first_sphere;
                    before = geometry.triangle_count;
                } else {
                    before = std::uint64_t{arrays_.geometries[0].triangle_count} + arrays_.geometries[0].sphere_count;
                }
                if (is_whole && numbers[i] != before + (i - begin))
                    return fail([&] {
                        return fmt::format("the number {}, expected {}, since the chunk is the only one", numbers[i],
                                           before + (i - begin));
                    });
                if (i > begin && numbers[i] <= numbers[i - 1])
                    return fail([&] {
                        return fmt::format("the number {}, expected more than {}, that of the one before", numbers[i],
                                           numbers[i - 1]);
                    });
                if (numbers[i] > kMostElements)
                    return fail([&] { return fmt::format("the number {}, which is none", numbers[i]); });
                return true;
            };
        });
    }

    // ---- Instances ----

    void check_instances() const {
        check_all("instances", arrays_.instances.size(), [&](std::size_t i, const auto& fail) {
            const shared::Instance& instance = arrays_.instances[i];
            const std::size_t count = arrays_.geometries.size();
            if (i == 0 ? instance.geometry != 0 : instance.geometry == 0 || instance.geometry >= count)
                return fail([&] {
                    return fmt::format("the geometry {} of {}, expected 0 in the first element alone",
                                       instance.geometry, count);
                });
            glm::dmat3 to_object;
            bool is_valid = true;
            for (int row = 0; row < 3; ++row) {
                is_valid = is_valid && is_finite(instance.to_object[row]) && is_finite(instance.to_world[row]) &&
                           std::abs(instance.to_object[row][3]) <= kMostTranslation &&
                           is_coordinate(instance.to_world[row][3]);
                for (int column = 0; column < 3; ++column) to_object[column][row] = instance.to_object[row][column];
            }
            if (!is_valid)
                return fail([&] {
                    return fmt::format("a matrix with values that are not finite, or with translations beyond {:g}",
                                       CASTOR_MAX_COORDINATE);
                });
            const double forth = row_norm(to_object);
            const double back = glm::determinant(to_object) == 0.0 ? std::numeric_limits<double>::infinity()
                                                                   : row_norm(glm::inverse(to_object));
            if (!(forth <= kMostScale && back <= kMostScale && forth * back <= kMostCondition))
                return fail([&] {
                    return fmt::format(
                        "a matrix of norm {:.3g} whose inverse has norm {:.3g}, expected at most {:.3g} "
                        "each and a product of at most {:.3g}",
                        forth, back, kMostScale, kMostCondition);
                });
            if (!are_coordinates(vec3_of(instance.motion)))
                return fail([&] {
                    return fmt::format("the motion {}, expected coordinates up to {:g}", text(vec3_of(instance.motion)),
                                       CASTOR_MAX_COORDINATE);
                });
            return i == 0 || check_material_index(instance.material, fail);
        });
    }

    // ---- Trees ----

    /// The trees side by side, from their roots. `has_trees`: they were built.
    Trees trees_of(const char* nodes, std::size_t node_count, const char* section, const Column<std::uint32_t>& roots,
                   bool has_trees) const {
        require_length(section, roots.size(), has_trees ? arrays_.geometries.size() : 0,
                       has_trees ? "one a geometry" : "since these trees are not built");
        Trees trees;
        for (std::size_t i = 0; i < roots.size(); ++i) {
            if ((roots[i] != CASTOR_INVALID_INDEX) != (has_bounded_[i] != 0))
                refuse(section, fmt::format("in element {} {:#x}, but the geometry has {} bounded primitives", i,
                                            roots[i], has_bounded_[i] ? "some" : "no"));
            if (roots[i] == CASTOR_INVALID_INDEX) continue;
            const bool begins_well = trees.trees.empty() ? roots[i] == 0 : roots[i] > trees.trees.back().nodes.begin;
            if (!begins_well || roots[i] >= node_count)
                refuse(section, fmt::format("in element {} the node {} of {}, expected 0 in the first element and more "
                                            "than before in the others",
                                            i, roots[i], node_count));
            if (!trees.trees.empty()) trees.trees.back().nodes.end = roots[i];
            trees.trees.push_back({static_cast<std::uint32_t>(i), {roots[i], node_count}});
        }
        require(!trees.trees.empty() || node_count == 0, nodes,
                fmt::format("{} elements, expected none, since no geometry has a tree", node_count));
        return trees;
    }

    /// Checks that what was found is trees whose roots are `is_root`, and returns the number of levels.
    template <class IsRoot>
    std::uint32_t levels_of(const char* section, std::size_t node_count, const Parents& parents, std::uint32_t most,
                            const IsRoot& is_root) const {
        require(parents.adopted_twice() == node_count, section,
                fmt::format("two nodes whose child is element {}, expected one", parents.adopted_twice()));
        std::vector<std::uint8_t> levels(node_count);
        std::uint8_t deepest = 0;
        for (std::size_t i = 0; i < node_count; ++i) {
            const std::uint32_t parent = parents[i];
            if (parent == CASTOR_INVALID_INDEX) {
                require(is_root(i), section, fmt::format("the element {}, which is the child of none", i));
                levels[i] = 1;
            } else {
                if (levels[parent] == most)
                    refuse(section,
                           fmt::format("the element {} on level {}, expected at most {}", i, levels[parent] + 1, most));
                levels[i] = static_cast<std::uint8_t>(levels[parent] + 1);
            }
            deepest = std::max(deepest, levels[i]);
        }
        return deepest;
    }

    bool is_primitive_of(std::uint32_t geometry, std::uint32_t primitive) const {
        const shared::Geometry& g = arrays_.geometries[geometry];
        return is_triangle_of(g, primitive) || is_sphere_of(g, primitive);
    }
    static bool is_triangle_of(const shared::Geometry& geometry, std::uint32_t primitive) {
        return primitive - geometry.first_triangle < geometry.triangle_count;  // modulo 2^32
    }
    bool is_sphere_of(const shared::Geometry& geometry, std::uint32_t primitive) const {
        const std::uint64_t first = arrays_.triangle_count() + geometry.first_sphere;
        return primitive >= first && primitive - first < geometry.sphere_count;
    }

    void check_wide_trees() const {
        if (!chunk_.has_wide) {
            require_length("triangle_blocks", chunk_.triangle_blocks.size(), 0, "since these trees are not built");
            require_length("sphere_blocks", chunk_.sphere_blocks.size(), 0, "since these trees are not built");
        }
        const Trees trees =
            trees_of("wide_nodes", chunk_.wide_nodes.size(), "wide_roots", chunk_.wide_roots, chunk_.has_wide);
        const std::uint32_t root = chunk_.wide_roots.empty() ? CASTOR_INVALID_INDEX : chunk_.wide_roots.front();
        if (chunk_.wide_root != root)
            refuse_settings(fmt::format("the root {:#x} of the wide tree, expected {:#x}, the first of wide_roots,",
                                        chunk_.wide_root, root));
        Parents parents(chunk_.wide_nodes.size());
        check_each("wide_nodes", chunk_.wide_nodes.size(), [&] {
            return [&, cursor = Cursor(trees)](std::size_t i, const auto& fail) mutable {
                return check_wide_node(i, trees.trees[cursor.find(i)], parents, fail);
            };
        });
        levels_of("wide_nodes", chunk_.wide_nodes.size(), parents, CASTOR_MAX_STACK, IsRoot(trees));
    }

    template <class Fail>
    bool check_wide_node(std::size_t i, const Tree& tree, Parents& parents, const Fail& fail) const {
        const shared::WideNode& node = chunk_.wide_nodes[i];
        for (std::uint32_t place = 0; place < 8; ++place) {
            const std::uint32_t child = node.child[place];
            for (int axis = 0; axis < 3; ++axis) {
                const float lower = node.planes[axis][0][place], upper = node.planes[axis][1][place];
                // No ray enters a box without a child.
                const bool is_valid = child == CASTOR_INVALID_INDEX
                                          ? lower == kInfinity && upper == -kInfinity
                                          : lower <= upper && lower >= -kMostCoordinate && upper <= kMostCoordinate;
                if (!is_valid)
                    return fail([&] {
                        return fmt::format("at place {} the planes {} and {} around child {:#x}, expected {}", place,
                                           lower, upper, child,
                                           child == CASTOR_INVALID_INDEX ? "inf and -inf, since there is none"
                                                                         : "coordinates, the lower one first");
                    });
            }
            if (child == CASTOR_INVALID_INDEX) continue;
            if (child & CASTOR_WIDE_LEAF) {
                if (!check_wide_leaf(child, tree.geometry, fail)) return false;
                continue;
            }
            if (child <= i || child >= tree.nodes.end)
                return fail([&] {
                    return fmt::format("at place {} the child {}, expected a node from {} to {}", place, child, i + 1,
                                       tree.nodes.end - 1);
                });
            parents.set(child, i);
        }
        return true;
    }

    template <class Fail>
    bool check_wide_leaf(std::uint32_t leaf, std::uint32_t geometry, const Fail& fail) const {
        const bool has_spheres = leaf & CASTOR_WIDE_SPHERES;
        const std::uint32_t first = leaf & CASTOR_WIDE_FIRST_MASK;
        const std::uint32_t count = (leaf >> CASTOR_WIDE_COUNT_SHIFT & CASTOR_WIDE_COUNT_MASK) + 1;
        const auto check_blocks = [&](const auto& blocks, const auto& is_primitive) {
            if (std::uint64_t{first} + count > blocks.size())
                return fail([&] {
                    return fmt::format("a leaf of {} {} blocks from {} on, expected numbers below {}", count,
                                       has_spheres ? "sphere" : "triangle", first, blocks.size());
                });
            for (std::uint32_t block = first; block < first + count; ++block)
                for (std::uint32_t lane = 0; lane < kBlockLanes; ++lane) {
                    const std::uint32_t primitive = blocks[block].primitive[lane];
                    if (is_primitive(primitive) || (lane > 0 && primitive == CASTOR_INVALID_INDEX)) continue;
                    return fail([&] {
                        return fmt::format(
                            "a leaf whose {} block {} has the primitive {:#x} in lane {}, which is none of geometry {}",
                            has_spheres ? "sphere" : "triangle", block, primitive, lane, geometry);
                    });
                }
            return true;
        };
        const shared::Geometry& g = arrays_.geometries[geometry];
        if (has_spheres) return check_blocks(chunk_.sphere_blocks, [&](std::uint32_t p) { return is_sphere_of(g, p); });
        return check_blocks(chunk_.triangle_blocks, [&](std::uint32_t p) { return is_triangle_of(g, p); });
    }

    void check_compressed_trees() const {
        if (!chunk_.has_compressed)
            require_length("compressed_primitives", chunk_.compressed_primitives.size(), 0,
                           "since these trees are not built");
        const Trees trees = trees_of("compressed_nodes", chunk_.compressed_nodes.size(), "compressed_roots",
                                     chunk_.compressed_roots, chunk_.has_compressed);
        Parents parents(chunk_.compressed_nodes.size());
        check_each("compressed_nodes", chunk_.compressed_nodes.size(), [&] {
            return [&, cursor = Cursor(trees)](std::size_t i, const auto& fail) mutable {
                return check_compressed_node(i, trees.trees[cursor.find(i)], parents, fail);
            };
        });
        const std::uint32_t levels =
            levels_of("compressed_nodes", chunk_.compressed_nodes.size(), parents, CASTOR_MAX_STACK, IsRoot(trees));
        if (chunk_.compressed_levels != levels)
            refuse_settings(
                fmt::format("{} levels of the compressed trees, expected {},", chunk_.compressed_levels, levels));
    }

    template <class Fail>
    bool check_compressed_node(std::size_t i, const Tree& tree, Parents& parents, const Fail& fail) const {
        const shared::CompressedNode& node = chunk_.compressed_nodes[i];
        for (int axis = 0; axis < 3; ++axis)
            if (!is_coordinate(node.origin[axis]) || node.exponent[axis] == 0 || node.exponent[axis] == 255)
                return fail([&] {
                    return fmt::format("the origin {} and exponent {}, expected a coordinate and 1 to 254",
                                       node.origin[axis], node.exponent[axis]);
                });
        const std::uint64_t child_count = static_cast<std::uint64_t>(std::popcount(node.inner_mask));
        if (child_count > 0 && (node.first_child <= i || node.first_child + child_count > tree.nodes.end))
            return fail([&] {
                return fmt::format("{} children from {} on, expected nodes from {} to {}", child_count,
                                   node.first_child, i + 1, tree.nodes.end - 1);
            });
        for (std::uint32_t place = 0; place < 8; ++place) {
            const std::uint32_t meta = node.meta[place];
            const bool is_inner = node.inner_mask >> place & 1;
            const std::uint32_t first = meta & ((1u << CASTOR_COMPRESSED_COUNT_SHIFT) - 1);
            const std::uint32_t bits = meta >> CASTOR_COMPRESSED_COUNT_SHIFT;
            const std::uint32_t count = static_cast<std::uint32_t>(std::popcount(bits));
            const bool is_coded =
                is_inner ? meta == CASTOR_COMPRESSED_INNER + place
                         : meta == 0 || (std::has_single_bit(bits + 1) && count > 0 && first + count <= kMostLeafBits);
            if (!is_coded)
                return fail([&] {
                    return fmt::format("at place {} the code {:#x} for {}, which is none", place, meta,
                                       is_inner ? "an inner child" : "a leaf");
                });
            if (is_inner || meta == 0) continue;
            const std::uint64_t begin = std::uint64_t{node.first_primitive} + first;
            if (begin + count > chunk_.compressed_primitives.size())
                return fail([&] {
                    return fmt::format("at place {} {} primitives from {} on, expected numbers below {}", place, count,
                                       begin, chunk_.compressed_primitives.size());
                });
            for (std::uint64_t k = begin; k < begin + count; ++k) {
                const std::uint32_t primitive = chunk_.compressed_primitives[k];
                if (!is_primitive_of(tree.geometry, primitive))
                    return fail([&] {
                        return fmt::format(
                            "a leaf whose primitive {:#x} (element {} of compressed_primitives) is none "
                            "of geometry {}",
                            primitive, k, tree.geometry);
                    });
            }
        }
        for (std::uint64_t child = 0; child < child_count; ++child) parents.set(node.first_child + child, i);
        return true;
    }

    void check_instance_tree() const {
        const auto& nodes = chunk_.instance_nodes;
        if (!chunk_.has_wide && !chunk_.has_compressed)
            require_length("instance_nodes", nodes.size(), 0, "since no trees are built");
        Parents parents(nodes.size());
        check_all("instance_nodes", nodes.size(),
                  [&](std::size_t i, const auto& fail) { return check_instance_node(i, parents, fail); });
        levels_of("instance_nodes", nodes.size(), parents, CASTOR_MAX_INSTANCE_STACK,
                  [](std::size_t i) { return i == 0; });
        check_wide_instance_tree();
    }

    /// It follows from the other tree, so that only one is right.
    void check_wide_instance_tree() const {
        const auto& nodes = chunk_.wide_instance_nodes;
        const Column<shared::WideNode> expected =
            chunk_.has_wide ? widen_instance_tree(chunk_.instance_nodes) : Column<shared::WideNode>{};
        require_length("wide_instance_nodes", nodes.size(), expected.size(), "as the tree of instance_nodes gives");
        check_all("wide_instance_nodes", nodes.size(), [&](std::size_t i, const auto& fail) {
            if (std::memcmp(&nodes[i], &expected[i], sizeof nodes[i]) == 0) return true;
            return fail([] { return std::string("another node than the tree of instance_nodes gives"); });
        });
    }

    template <class Fail>
    bool check_instance_node(std::size_t i, Parents& parents, const Fail& fail) const {
        const auto& nodes = chunk_.instance_nodes;
        const shared::InstanceNode& node = nodes[i];
        for (int axis = 0; axis < 3; ++axis)
            if (!(std::isfinite(node.lower[axis]) && std::isfinite(node.upper[axis]) &&
                  node.lower[axis] <= node.upper[axis]))
                return fail([&] {
                    return fmt::format("the planes {} and {}, expected finite numbers, the lower one first",
                                       node.lower[axis], node.upper[axis]);
                });
        if (!(node.slope >= 0.0f && std::isfinite(node.slope)))
            return fail(
                [&] { return fmt::format("the slope {}, expected a finite number of at least 0", node.slope); });
        if (node.is_leaf > 1) return fail([&] { return fmt::format("is_leaf {}, expected 0 or 1", node.is_leaf); });
        if (node.is_leaf == 0) {
            if (node.first <= i || std::uint64_t{node.first} + 1 >= nodes.size())
                return fail([&] {
                    return fmt::format("the children {} and the next one, expected nodes from {} to {}", node.first,
                                       i + 1, nodes.size() - 1);
                });
            parents.set(node.first, i);
            parents.set(node.first + 1, i);
            return true;
        }
        const auto& instances = scene_.arrays().instances;
        if (node.first == 0 || node.first >= instances.size())
            return fail([&] {
                return fmt::format("the instance {}, expected 1 or more, and less than {}", node.first,
                                   instances.size());
            });
        if (!has_bounded_[instances[node.first].geometry])
            return fail([&] {
                return fmt::format("the instance {}, of whose geometry {} there is nothing here", node.first,
                                   instances[node.first].geometry);
            });
        return true;
    }

    /// Whether a node is the root of a tree; asked in ascending order.
    class IsRoot {
    public:
        explicit IsRoot(const Trees& trees) : trees_(trees) {}
        bool operator()(std::size_t i) const {
            while (next_ < trees_.size() && trees_.begin(next_) < i) ++next_;
            return next_ < trees_.size() && trees_.begin(next_) == i;
        }

    private:
        const Trees& trees_;
        mutable std::size_t next_ = 0;
    };

    const SceneContents& scene_;
    const Chunk& chunk_;
    const SceneArrays& arrays_;
    std::size_t number_;
    const std::string& file_;
    ProgressCount& elements_done_;
    std::vector<std::uint8_t> has_bounded_;  // by geometry: has primitives that trees hold
};

/// Materials, lights and colours as the file said them.
void check_description(const SceneContents& scene, const std::string& file) {
    const auto refuse = [&](const std::string& problem) {
        throw SceneError(file, 0, "is damaged: its section settings says " + problem);
    };
    for (std::size_t i = 0; i < scene.description.materials.size(); ++i) {
        const auto kind = static_cast<std::uint32_t>(scene.description.materials[i].kind);
        if (kind > static_cast<std::uint32_t>(MaterialKind::dielectric))
            refuse(fmt::format("material {}: the kind is {}, expected 0 to {}", i, kind,
                               static_cast<std::uint32_t>(MaterialKind::dielectric)));
        const auto& principled = scene.description.materials[i].principled;
        const auto alpha = principled ? static_cast<std::uint32_t>(principled->alpha_mode) : 0;
        if (alpha > static_cast<std::uint32_t>(AlphaMode::blend))
            refuse(fmt::format("material {}: the mode of alpha is {}, expected 0 to {}", i, alpha,
                               static_cast<std::uint32_t>(AlphaMode::blend)));
    }
    const SceneArrays& arrays = scene.arrays();
    const auto require_as_many = [&](const char* what, std::size_t found, const char* section, std::size_t expected) {
        if (found != expected)
            refuse(fmt::format("there are {} {}, expected {}, as many as its section {} has", found, what, expected,
                               section));
    };
    require_as_many("lights", scene.description.lights.size(), "lights", arrays.lights.size());
    require_as_many("images", scene.description.images.size(), "texture_images", arrays.texture_images.size());
    require_as_many("textures", scene.description.textures.size(), "textures", arrays.textures.size());
    Scene checked = scene.description;
    // Texels, and the objects that lights name, are in the columns alone, which are checked for themselves.
    checked.images.clear();
    checked.textures.clear();
    checked.background_texture.reset();
    for (Material& material : checked.materials) {
        material.textures.clear();
        material.principled.reset();
    }
    std::erase_if(checked.lights, [](const Light& light) {
        return light.kind == Light::Kind::mesh || light.kind == Light::Kind::sphere ||
               light.kind == Light::Kind::environment || light.kind == Light::Kind::instance;
    });
    try {
        validate(checked);
    } catch (const SceneError& error) {
        refuse(error.reason());
    }
}

/// What info and renders tell.
void check_scene_counts(const SceneContents& scene, const std::string& file) {
    SceneCounts held;
    for (const Chunk& chunk : scene.chunks) {
        held.triangles += chunk.arrays.triangle_count();
        held.spheres += chunk.arrays.sphere_count();
        held.planes += chunk.arrays.plane_count();
    }
    // Degenerate triangles are in the whole scene, and in no chunk.
    const bool is_whole = scene.chunks.size() == 1 && scene.chunks.front().primitive_numbers.empty();
    const auto check = [&](const char* what, std::uint64_t found, std::uint64_t least, std::uint64_t most) {
        if (found < least || found > most)
            throw SceneError(file, 0,
                             fmt::format("is damaged: its section settings says {} {}, expected {} to {}", found, what,
                                         least, most));
    };
    const SceneCounts& counts = scene.counts;
    check("triangles", counts.triangles, held.triangles, is_whole ? held.triangles : kMostElements);
    check("spheres", counts.spheres, held.spheres, held.spheres);
    check("planes", counts.planes, held.planes, held.planes);
    check("meshes", counts.meshes, 0, kMostElements);
    check("vertices", counts.vertices, 0, kMostElements);
}

std::uint64_t element_count(const SceneContents& scene) {
    std::uint64_t count = 1;
    for_each_column_of_chunks(scene, [&](const std::string&, const auto& column) { count += column.size(); });
    return count;
}

}  // namespace

void check_built_scene(const SceneContents& scene, const std::string& file, const Progress& progress) {
    if (scene.chunks.empty()) throw SceneError(file, 0, "is damaged: its section settings says that it has no chunk");
    check_description(scene, file);
    ProgressCount elements_done(progress, element_count(scene));
    for (std::size_t i = 0; i < scene.chunks.size(); ++i) ChunkCheck(scene, i, file, elements_done).run();
    check_scene_counts(scene, file);
}

}  // namespace castor
