#include "scene/obj_reader.h"

#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "base/mapped_file.h"
#include "castor/error.h"
#include "scene/named_files.h"
#include "scene/text_lines.h"

namespace castor {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr int kNoMaterial = -1;

/// The share of the time in which lines are read. In the rest, meshes are made of them.
constexpr double kReadingLines = 0.9;

/// The factor on the ambient light of the default view (a tenth of white) with which a material that emits light looks
/// white in its colour.
constexpr float kEmissionAmbient = 10.0f;

bool is_space(char c) {
    return c == ' ' || c == '\t';
}

std::string_view trim(std::string_view text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

/// Takes the next word from the front of `text`.
std::string_view take_word(std::string_view& text) {
    text = trim(text);
    const auto end = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_space) - text.begin());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(end);
    return word;
}

/// Returns the beginning of a word of the file, printable, for a message.
std::string excerpt(std::string_view word) {
    constexpr std::size_t kLongest = 40;
    std::string text(word.substr(0, kLongest));
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

glm::vec3 to_vec3(const tinyobj::real_t* v) {
    return {v[0], v[1], v[2]};
}

/// A vertex, texture coordinates and a normal of the file, counted from 0; kNone: the corner has none.
struct Corner {
    std::uint32_t vertex;
    std::uint32_t texture;
    std::uint32_t normal;
};

/// Consecutive faces of one material.
struct Run {
    int material;
    std::size_t first_triangle;
    std::size_t line;
    bool is_smooth;  // every corner has a normal
};

/// An index of the file and where it stands.
struct Reference {
    std::int64_t index = 0;
    std::size_t line = 0;  // 0: there is none
};

/// The indices by which corners name normals, or texture coordinates. A face may precede the data that it names, so
/// that only the end of the file tells whether an index is in range.
struct NamedData {
    Reference largest;  // of the indices past the data known so far
    Reference wrong;    // the first index that can never be right: 0, or one that goes back past the first

    /// Returns the position that an index names, counted from 0, perhaps of data that follow later; kNone if it is
    /// wrong.
    std::uint32_t resolve(std::int64_t index, std::size_t count, std::size_t line) {
        if (index > 0 && index <= std::numeric_limits<std::int32_t>::max()) {
            if (static_cast<std::size_t>(index) > count && index > largest.index) largest = {index, line};
            return static_cast<std::uint32_t>(index - 1);
        }
        const std::size_t back = std::size_t{0} - static_cast<std::size_t>(index);
        if (index < 0 && back <= count) return static_cast<std::uint32_t>(count - back);
        if (wrong.line == 0) wrong = {index, line};
        return kNone;
    }

    /// Returns an index that is out of range; its line is 0 if there is none.
    Reference missing(std::size_t count) const {
        if (wrong.line != 0) return wrong;
        return static_cast<std::size_t>(largest.index) > count ? largest : Reference{};
    }
};

/// Reads the lines of an OBJ file and makes a scene of them.
class ObjReader {
public:
    ObjReader(const std::filesystem::path& file, std::string_view text, const Progress& progress, bool smooth)
        : file_(file), text_size_(text.size()), progress_(progress), lines_(text), smooth_(smooth) {}

    Scene read() {
        while (lines_.next()) {
            report();
            read_line(lines_.line());
        }
        if (static_cast<std::size_t>(largest_vertex_.index) > positions_.size())
            throw SceneError(
                file_.string(), largest_vertex_.line,
                fmt::format("vertex index {} where 1 to {} was expected", largest_vertex_.index, positions_.size()));
        if (triangles_.empty())
            throw SceneError(file_.string(), 0,
                             fmt::format("the file has no triangle, that is no face of three vertices or more: it has "
                                         "{} points and {} lines",
                                         positions_.size(), line_element_count_));
        warn_missing(named_normals_.missing(normals_.size()), normals_.size(), "normal",
                     "consecutive faces of one material, of which one has no normal, are flat");
        warn_missing(named_texture_coordinates_.missing(texture_coordinates_.size()), texture_coordinates_.size(),
                     "texture coordinate", "the face is read without");
        return make_scene();
    }

private:
    [[noreturn]] void fail(const std::string& reason) { throw SceneError(file_.string(), lines_.number(), reason); }

    void warn(std::size_t line, std::string text) {
        scene_.warnings.push_back({file_.string(), line, std::move(text)});
    }

    void warn_missing(const Reference& reference, std::size_t count, const char* kind, const char* consequence) {
        if (reference.line == 0) return;
        warn(reference.line, fmt::format("{} index {}, but the file has {} {}{}: {}", kind, reference.index, count,
                                         kind, count == 1 ? "" : "s", consequence));
    }

    /// Reports the progress once in many lines.
    void report() {
        constexpr std::size_t kBytes = std::size_t{1} << 18;
        if (lines_.passed() < next_report_) return;
        next_report_ = lines_.passed() + kBytes;
        progress_.reach(kReadingLines * static_cast<double>(lines_.passed()) / static_cast<double>(text_size_));
    }

    /// Reads one line. Groups, smoothing groups and curves are not used.
    void read_line(std::string_view rest) {
        const std::string_view keyword = take_word(rest);
        if (keyword == "v")
            positions_.push_back(read_vec3(rest));
        else if (keyword == "vn")
            normals_.push_back(read_vec3(rest));
        else if (keyword == "vt")
            texture_coordinates_.push_back(read_texture_coordinates(rest));
        else if (keyword == "f")
            read_face(rest);
        else if (keyword == "l")
            ++line_element_count_;
        else if (keyword == "usemtl")
            use_material(trim(rest));
        else if (keyword == "mtllib")
            read_material_files(trim(rest));
    }

    // ---- Geometry

    double read_number(std::string_view word) {
        const std::string_view digits = word.substr(word.front() == '+' ? 1 : 0);
        double value = 0.0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        const bool is_number = error == std::errc() && end == digits.data() + digits.size();
        if (!is_number || !(std::abs(value) <= std::numeric_limits<float>::max()))
            fail(fmt::format("found '{}' where a finite number was expected", excerpt(word)));
        return value;
    }

    /// Reads the three numbers at the front of `rest`; further ones (a weight, a colour) are not used.
    glm::vec3 read_vec3(std::string_view rest) {
        glm::vec3 numbers;
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = take_word(rest);
            if (word.empty()) fail(fmt::format("found {} numbers where three were expected", i));
            numbers[i] = static_cast<float>(read_number(word));
        }
        return numbers;
    }

    /// Reads u, and v, which is 0 where it is left out; a third number is not used.
    glm::vec2 read_texture_coordinates(std::string_view rest) {
        const std::string_view u = take_word(rest), v = take_word(rest);
        if (u.empty()) fail("found no number where texture coordinates were expected");
        // Row 0 of a picture is on top, and v of an OBJ file points up.
        return {static_cast<float>(read_number(u)), static_cast<float>(1.0 - (v.empty() ? 0.0 : read_number(v)))};
    }

    /// Takes one of the up to three indices of a corner from the front of `rest`, with the slash after it. Returns
    /// nullopt where it is left out.
    std::optional<std::int64_t> take_index(std::string_view& rest, std::string_view corner) {
        const std::string_view digits = rest.substr(0, rest.find('/'));
        rest.remove_prefix(std::min(digits.size() + 1, rest.size()));
        if (digits.empty()) return std::nullopt;
        std::int64_t index = 0;
        const char* end = digits.data() + digits.size();
        const auto [stop, error] = std::from_chars(digits.data(), end, index);
        if (error != std::errc() || stop != end) fail_corner(corner);
        return index;
    }

    [[noreturn]] void fail_corner(std::string_view corner) {
        fail(fmt::format("found '{}' where the indices of a corner, from 1 on or below 0, were expected",
                         excerpt(corner)));
    }

    /// Returns the position of a vertex, counted from 0. An index of the file counts from 1, or back from the newest at
    /// -1.
    std::uint32_t vertex_place(std::int64_t index) {
        const std::size_t count = positions_.size();
        if (index > std::numeric_limits<std::int32_t>::max()) fail(fmt::format("vertex index {} is too large", index));
        if (index > 0) {
            if (static_cast<std::size_t>(index) > count && index > largest_vertex_.index)
                largest_vertex_ = {index, lines_.number()};
            return static_cast<std::uint32_t>(index - 1);
        }
        const std::size_t back = std::size_t{0} - static_cast<std::size_t>(index);
        if (back > count) fail(fmt::format("vertex index {} goes back past the first of {} so far", index, count));
        return static_cast<std::uint32_t>(count - back);
    }

    Corner read_corner(std::string_view word) {
        std::string_view rest = word;
        const std::optional<std::int64_t> vertex = take_index(rest, word), texture = take_index(rest, word),
                                          normal = take_index(rest, word);
        if (vertex == 0) fail_corner(word);
        if (!vertex || !rest.empty())
            fail(fmt::format("found '{}' where a corner was expected: v, v/vt, v//vn or v/vt/vn", excerpt(word)));
        return {vertex_place(*vertex),
                texture ? named_texture_coordinates_.resolve(*texture, texture_coordinates_.size(), lines_.number())
                        : kNone,
                normal ? named_normals_.resolve(*normal, normals_.size(), lines_.number()) : kNone};
    }

    /// Reads a polygon as a fan of triangles.
    void read_face(std::string_view rest) {
        std::array<Corner, 3> fan{};
        int count = 0;
        for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
            if (count == 0 && (runs_.empty() || runs_.back().material != material_))
                runs_.push_back({material_, triangles_.size(), lines_.number(), true});
            const Corner corner = read_corner(word);
            if (corner.normal == kNone) runs_.back().is_smooth = false;
            if (count == 0) fan[0] = corner;
            fan[1] = fan[2];
            fan[2] = corner;
            if (++count >= 3) triangles_.push_back(fan);
        }
    }

    // ---- Materials

    /// Reads the MTL files that a line names: one whose name may have spaces, or else several. A file that is not where
    /// its path leads is looked for beside the OBJ file.
    void read_material_files(std::string_view text) {
        if (text.size() > 1 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
        std::string names(text);
        std::replace(names.begin(), names.end(), '\\', '/');
        const auto read = [&](std::string_view name) { return read_material_file(name); };
        const auto read_beside = [&](std::string_view name) {
            return read_material_file(name.substr(name.find_last_of('/') + 1));
        };
        if (read(names)) return;
        std::vector<std::string_view> missing;
        std::string_view rest = names;
        for (std::string_view name = take_word(rest); !name.empty(); name = take_word(rest)) missing.push_back(name);
        const std::size_t count = missing.size();
        std::erase_if(missing, read);
        if (missing.size() == count && read_beside(names)) return;
        std::erase_if(missing, read_beside);
        if (missing.size() == count) missing = {text};
        for (const std::string_view name : missing)
            if (missing_.insert(std::string(name)).second)
                warn(lines_.number(),
                     fmt::format("the material file '{}' cannot be read; its materials are grey", name));
    }

    /// Reads an MTL file, once, whose path is relative to the folder of the OBJ file. Returns false if there is none.
    bool read_material_file(std::string_view name) {
        const std::filesystem::path path = (file_.parent_path() / name).lexically_normal();
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(path, ignored)) return false;
        std::ifstream stream(path, std::ios::binary);
        if (!stream) return false;
        if (material_files_.insert(path).second) read_materials(stream, path.string());
        return true;
    }

    /// Hands the materials one by one to tinyobjloader, which needs many times the memory of their text.
    void read_materials(std::istream& stream, const std::string& mtl) {
        const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
        std::string storage, material;
        TextLines lines(to_utf8(bytes, storage));
        std::size_t line = 0;
        while (lines.next()) {
            std::string_view rest = lines.line();
            if (take_word(rest) == "newmtl") {
                read_material(material, mtl, line);
                material.clear();
                line = lines.number();
            }
            material.append(lines.line()).append(1, '\n');
        }
        read_material(material, mtl, line);
    }

    void read_material(const std::string& text, const std::string& mtl, std::size_t line) {
        if (line == 0) return;  // the lines before the first material
        std::istringstream stream(text);
        std::map<std::string, int> indices;
        std::vector<tinyobj::material_t> materials;
        std::string warnings, errors;  // only about transparency; add_material warns of it
        tinyobj::LoadMtl(&indices, &materials, &stream, &warnings, &errors);
        for (const tinyobj::material_t& material : materials) add_material(material, mtl, line);
    }

    void check_colour(const glm::vec3& colour, const char* key, const std::string& name, const std::string& mtl,
                      std::size_t line) const {
        for (int i = 0; i < 3; ++i) {
            if (colour[i] >= 0.0f && std::isfinite(colour[i])) continue;
            throw SceneError(
                mtl, line,
                fmt::format("material '{}': {} has {}, which is not a finite number from 0 on", name, key, colour[i]));
        }
    }

    void add_material(const tinyobj::material_t& from, const std::string& mtl, std::size_t line) {
        const std::string name(trim(from.name));
        if (name.empty()) return;
        Material material;
        material.ambient = to_vec3(from.ambient);
        material.diffuse = to_vec3(from.diffuse);
        material.specular = to_vec3(from.specular);
        const glm::vec3 emission = to_vec3(from.emission);
        check_colour(material.ambient, "Ka", name, mtl, line);
        check_colour(material.diffuse, "Kd", name, mtl, line);
        check_colour(material.specular, "Ks", name, mtl, line);
        check_colour(emission, "Ke", name, mtl, line);
        if (!std::isfinite(from.shininess))
            throw SceneError(mtl, line, fmt::format("material '{}': Ns is not finite", name));
        material.phong_exponent = std::max(from.shininess, 1.0f);
        if (material.ambient == glm::vec3(0.0f)) material.ambient = material.diffuse;
        const float brightest = std::max({emission.x, emission.y, emission.z});
        if (brightest > 0.0f) material.ambient = emission * (kEmissionAmbient / brightest);
        // Of the illumination models of MTL, 3 and 5 reflect, and 4, 6, 7 and 9 also refract.
        const int model = from.illum;
        const bool is_transparent = model == 4 || model == 6 || model == 7 || model == 9 || from.dissolve < 1.0f;
        if (model == 3 || model == 5 || model == 4 || model == 6 || model == 7) {
            material.kind = MaterialKind::mirror;
            material.mirror = glm::min(material.specular, glm::vec3(1.0f));
        }
        if (is_transparent) {
            scene_.warnings.push_back(
                {mtl, line, fmt::format("material '{}' is transparent; it is drawn opaque", name)});
        }
        if (!from.diffuse_texname.empty()) material.textures.push_back(add_texture(from, name, mtl, line));
        warn_of_other_maps(from, name, mtl, line);
        material_of_.emplace(name, static_cast<int>(scene_.materials.size()));
        scene_.materials.push_back(material);
    }

    /// Makes a texture of map_Kd, and returns its number.
    std::uint32_t add_texture(const tinyobj::material_t& from, const std::string& name, const std::string& mtl,
                              std::size_t line) {
        const auto is_not = [](const tinyobj::real_t(&numbers)[3], tinyobj::real_t usual) {
            return std::any_of(numbers, numbers + 3, [&](tinyobj::real_t number) { return number != usual; });
        };
        const tinyobj::texture_option_t& option = from.diffuse_texopt;
        if (is_not(option.scale, 1) || is_not(option.origin_offset, 0))
            scene_.warnings.push_back(
                {mtl, line, fmt::format("material '{}': -s and -o of map_Kd are not used", name)});
        Texture texture;
        texture.line = line;
        texture.filter = TextureFilter::bilinear;
        if (option.clamp) texture.wrap = TextureWrap::clamp;
        texture.image = image_of(from.diffuse_texname, name, mtl, line);
        scene_.textures.push_back(texture);
        return static_cast<std::uint32_t>(scene_.textures.size() - 1);
    }

    /// Returns the number of a picture, whose path is relative to the folder of the MTL file. One that is not where its
    /// path leads is looked for in that folder itself.
    std::uint32_t image_of(std::string path, const std::string& name, const std::string& mtl, std::size_t line) {
        std::replace(path.begin(), path.end(), '\\', '/');
        const std::filesystem::path folder = std::filesystem::path(mtl).parent_path();
        std::filesystem::path file = (folder / path).lexically_normal();
        const std::filesystem::path beside = folder / std::filesystem::path(path).filename();
        std::error_code ignored;
        if (!std::filesystem::exists(file, ignored) && std::filesystem::exists(beside, ignored)) file = beside;
        const auto [known, is_new] = image_of_.emplace(file, static_cast<std::uint32_t>(scene_.images.size()));
        if (!is_new) return known->second;
        if (leads_out_of(folder, file))
            scene_.warnings.push_back({mtl, line,
                                       fmt::format("the picture '{}' of material '{}' is not in the MTL file's folder",
                                                   file.string(), name)});
        std::string problem;
        scene_.images.push_back(read_named_picture(file, problem));
        if (!problem.empty()) scene_.warnings.push_back({mtl, line, fmt::format("material '{}': {}", name, problem)});
        return known->second;
    }

    /// Warns of pictures that are not read: of each kind once.
    void warn_of_other_maps(const tinyobj::material_t& from, const std::string& name, const std::string& mtl,
                            std::size_t line) {
        const std::pair<const char*, const std::string&> maps[] = {
            {"map_Ka", from.ambient_texname},  {"map_Ks", from.specular_texname},
            {"map_Ke", from.emissive_texname}, {"map_Ns", from.specular_highlight_texname},
            {"map_d", from.alpha_texname},     {"map_Bump", from.bump_texname},
            {"norm", from.normal_texname},     {"disp", from.displacement_texname},
            {"refl", from.reflection_texname},
        };
        for (const auto& [key, file] : maps)
            if (!file.empty() && unread_.insert(key).second)
                scene_.warnings.push_back(
                    {mtl, line, fmt::format("material '{}': {} is not read, as in all materials", name, key)});
    }

    void use_material(std::string_view name) {
        if (name.empty()) return;
        const std::string wanted(name);
        const auto found = material_of_.find(wanted);
        material_ = found == material_of_.end() ? kNoMaterial : found->second;
        if (material_ == kNoMaterial && missing_.insert(wanted).second)
            warn(lines_.number(),
                 fmt::format("the material '{}' is not in any MTL file read; it is grey", wanted.substr(0, 40)));
    }

    // ---- The scene

    Scene make_scene() {
        scene_.file = file_.string();
        first_split_.assign(positions_.size(), kNone);
        for (std::size_t i = 0; i < runs_.size(); ++i) {
            const std::size_t end = i + 1 < runs_.size() ? runs_[i + 1].first_triangle : triangles_.size();
            if (end > runs_[i].first_triangle) scene_.meshes.push_back(make_mesh(runs_[i], end));
        }
        return std::move(scene_);
    }

    std::uint32_t material_index(int material) {
        if (material != kNoMaterial) return static_cast<std::uint32_t>(material);
        if (grey_ == kNone) {
            grey_ = static_cast<std::uint32_t>(scene_.materials.size());
            Material grey;
            grey.ambient = grey.diffuse = glm::vec3(0.7f);
            scene_.materials.push_back(grey);
        }
        return grey_;
    }

    /// Returns whether every corner of the triangles from `begin` to `end` has a normal that is there.
    bool has_normals(std::size_t begin, std::size_t end) const {
        for (std::size_t i = begin; i < end; ++i)
            for (const Corner& corner : triangles_[i])
                if (corner.normal >= normals_.size()) return false;
        return true;
    }

    /// Makes a mesh of a run. It has the vertices that the run uses, one for each position with texture coordinates and
    /// normal, in the order of their first use.
    Mesh make_mesh(Run run, std::size_t end) {
        if (static_cast<std::size_t>(named_normals_.largest.index) > normals_.size())
            run.is_smooth = run.is_smooth && has_normals(run.first_triangle, end);
        Mesh mesh;
        mesh.material = material_index(run.material);
        mesh.line = run.line;
        // Vertices that share a position form a chain: first_split_[position] is the first, next_split[v] the next.
        std::vector<Corner> sources;
        std::vector<std::uint32_t> next_split;
        const auto vertex_of = [&](Corner corner) {
            if (!run.is_smooth) corner.normal = kNone;
            if (corner.texture >= texture_coordinates_.size()) corner.texture = kNone;
            std::uint32_t* link = &first_split_[corner.vertex];
            while (*link != kNone &&
                   (sources[*link].normal != corner.normal || sources[*link].texture != corner.texture))
                link = &next_split[*link];
            if (*link != kNone) return *link;
            const auto vertex = static_cast<std::uint32_t>(sources.size());
            *link = vertex;
            sources.push_back(corner);
            next_split.push_back(kNone);
            return vertex;
        };
        mesh.triangles.reserve(end - run.first_triangle);
        constexpr std::size_t kTriangles = 1 << 16;
        for (std::size_t i = run.first_triangle; i < end; ++i) {
            if (i % kTriangles == 0)
                progress_.reach(kReadingLines + (1.0 - kReadingLines) * static_cast<double>(i) /
                                                    static_cast<double>(triangles_.size()));
            const std::array<Corner, 3>& corners = triangles_[i];
            const std::uint32_t a = vertex_of(corners[0]), b = vertex_of(corners[1]), c = vertex_of(corners[2]);
            mesh.triangles.push_back({a, b, c});
        }
        const bool has_coordinates =
            std::any_of(sources.begin(), sources.end(), [](const Corner& source) { return source.texture != kNone; });
        mesh.positions.reserve(sources.size());
        for (const Corner& source : sources) {
            mesh.positions.push_back(positions_[source.vertex]);
            if (run.is_smooth) mesh.normals.push_back(unit_or_zero(normals_[source.normal]));
            if (has_coordinates)
                mesh.texture_coordinates.push_back(source.texture == kNone ? glm::vec2(0.0f)
                                                                           : texture_coordinates_[source.texture]);
        }
        if (smooth_ && !run.is_smooth) set_smooth_normals(mesh, sources);
        for (const Corner& source : sources) first_split_[source.vertex] = kNone;
        return mesh;
    }

    /// Computes normals, of which vertices at one place of the file have the same, whatever their texture coordinates.
    void set_smooth_normals(Mesh& mesh, const std::vector<Corner>& sources) const {
        Mesh whole;
        whole.positions = mesh.positions;
        for (const glm::uvec3& triangle : mesh.triangles)
            whole.triangles.push_back({first_split_[sources[triangle.x].vertex],
                                       first_split_[sources[triangle.y].vertex],
                                       first_split_[sources[triangle.z].vertex]});
        compute_smooth_normals(whole);
        for (const Corner& source : sources) mesh.normals.push_back(whole.normals[first_split_[source.vertex]]);
    }

    static glm::vec3 unit_or_zero(const glm::vec3& normal) {
        const double length = std::hypot(static_cast<double>(normal.x), normal.y, normal.z);
        if (length == 0.0) return glm::vec3(0.0f);
        return {normal.x / length, normal.y / length, normal.z / length};
    }

    const std::filesystem::path& file_;
    std::size_t text_size_;
    Progress progress_;
    std::size_t next_report_ = 0;  // in bytes of the text
    TextLines lines_;
    const bool smooth_;
    Scene scene_;
    std::vector<glm::vec3> positions_;
    std::vector<glm::vec3> normals_;
    std::vector<glm::vec2> texture_coordinates_;
    std::size_t line_element_count_ = 0;
    std::vector<std::array<Corner, 3>> triangles_;
    std::vector<Run> runs_;
    std::vector<std::uint32_t> first_split_;
    Reference largest_vertex_;  // of the indices past the vertices known so far
    NamedData named_normals_, named_texture_coordinates_;
    std::map<std::string, int> material_of_;
    std::set<std::filesystem::path> material_files_;           // that have been read
    std::map<std::filesystem::path, std::uint32_t> image_of_;  // index in Scene::images
    std::set<std::string> missing_;                            // names of materials and of MTL files
    std::set<std::string> unread_;                             // keys of MTL files of which was warned
    int material_ = kNoMaterial;
    std::uint32_t grey_ = kNone;
};

}  // namespace

Scene read_obj(const std::filesystem::path& file, const Progress& progress, bool smooth) {
    const MappedFile mapped(file);
    if (mapped.bytes().empty()) throw SceneError(file.string(), 0, "the file is empty, not an OBJ file");
    std::string storage;
    return ObjReader(file, to_utf8(mapped.bytes(), storage), progress, smooth).read();
}

}  // namespace castor
