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
#include <istream>
#include <limits>
#include <map>
#include <set>
#include <streambuf>
#include <string_view>

#include "base/mapped_file.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
constexpr int kNoMaterial = -1;

/// The share of the time in which lines are collected. Then meshes are made of them.
constexpr double kCollecting = 0.9;

/// Times the ambient light of the default view (a tenth of white), a material that emits looks white in its colour.
constexpr float kEmissionAmbient = 10.0f;

/// A stream buffer over memory that knows how far it was read, and so which line a callback is about.
class TextBuffer : public std::streambuf {
public:
    explicit TextBuffer(std::string_view text) {
        char* begin = const_cast<char*>(text.data());  // never written: there is no put area
        setg(begin, begin, begin + text.size());
    }

    /// The line that was read last.
    std::string_view line() const {
        const char* end = gptr();
        if (end > eback() && end[-1] == '\n') --end;
        if (end > eback() && end[-1] == '\r') --end;
        const char* begin = end;
        while (begin > eback() && begin[-1] != '\n' && begin[-1] != '\r') --begin;
        return {begin, static_cast<std::size_t>(end - begin)};
    }

    /// Bytes that were read.
    std::size_t passed() const { return static_cast<std::size_t>(gptr() - eback()); }

    /// Its number, from 1. Counting goes on from the last question, so that asking often is cheap.
    std::size_t line_number() { return line_number(line()); }
    std::size_t line_number(std::string_view line) {
        const auto at = static_cast<std::size_t>(line.data() - eback());
        if (at < counted_) counted_ = line_ends_ = 0;
        for (; counted_ < at; ++counted_) {
            const char* c = eback() + counted_;
            if (*c == '\n' || (*c == '\r' && c + 1 != egptr() && c[1] != '\n')) ++line_ends_;
        }
        return 1 + line_ends_;
    }

private:
    std::size_t counted_ = 0;    // bytes
    std::size_t line_ends_ = 0;  // among them
};

bool is_space(char c) {
    return c == ' ' || c == '\t';
}

std::string_view trim(std::string_view text) {
    while (!text.empty() && (is_space(text.front()))) text.remove_prefix(1);
    while (!text.empty() && (is_space(text.back()) || text.back() == '\r')) text.remove_suffix(1);
    return text;
}

/// The next word, taken from the front of `text`.
std::string_view take_word(std::string_view& text) {
    text = trim(text);
    const auto end = static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_space) - text.begin());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(end);
    return word;
}

glm::vec3 to_vec3(const tinyobj::real_t* v) {
    return {v[0], v[1], v[2]};
}

/// A vertex and a normal of the file, from 0; kNone: no normal.
struct Corner {
    std::uint32_t vertex;
    std::uint32_t normal;
};

/// Consecutive faces of one material.
struct Run {
    int material;
    std::size_t first_triangle;
    std::size_t line;
    bool is_smooth;  // every corner has a normal
};

/// Where the largest index was used, to be checked when all data is known: a face may precede its vertices.
struct LargestIndex {
    std::size_t index = 0;
    std::string_view line;
};

/// Receives each line that tinyobjloader finds, and reads its numbers again: tinyobjloader takes for 0 what is no
/// number, wraps what is too large, and goes on in the next word where one ends early ("1// 2//").
class ObjCollector {
public:
    ObjCollector(const std::filesystem::path& file, std::string_view text, const Progress& progress)
        : file_(file), text_size_(text.size()), progress_(progress), buffer_(text) {}

    Scene collect() {
        tinyobj::callback_t callbacks;
        callbacks.vertex_cb = [](void* self, auto, auto, auto, auto) { as_this(self)->add_vertex(); };
        callbacks.normal_cb = [](void* self, auto, auto, auto) { as_this(self)->add_normal(); };
        callbacks.index_cb = [](void* self, auto, auto) { as_this(self)->add_face(); };
        callbacks.usemtl_cb = [](void* self, const char* name, int) { as_this(self)->use_material(name); };
        std::istream stream(&buffer_);
        stream.exceptions(std::ios::badbit);
        MaterialFiles material_files(*this);
        std::string warnings, errors;
        const bool ok = tinyobj::LoadObjWithCallback(stream, callbacks, this, &material_files, &warnings, &errors);
        if (!ok || !errors.empty()) throw SceneError(file_.string(), 0, std::string(trim(errors)));
        check_largest(largest_vertex_, positions_.size(), "vertex");
        check_largest(largest_normal_, normals_.size(), "normal");
        if (triangles_.empty()) throw SceneError(file_.string(), 0, "the file has no face of three vertices or more");
        return make_scene();
    }

private:
    static ObjCollector* as_this(void* self) { return static_cast<ObjCollector*>(self); }

    [[noreturn]] void fail(const std::string& reason) {
        throw SceneError(file_.string(), buffer_.line_number(), reason);
    }

    void warn(std::string text) { scene_.warnings.push_back({file_.string(), buffer_.line_number(), std::move(text)}); }

    /// Called for each line; tells how far one is at few of them.
    void report() {
        constexpr std::size_t kBytes = std::size_t{1} << 18;
        if (buffer_.passed() < next_report_) return;
        next_report_ = buffer_.passed() + kBytes;
        progress_.reach(kCollecting * static_cast<double>(buffer_.passed()) / static_cast<double>(text_size_));
    }

    // ---- Geometry

    /// The three numbers after the first word of this line.
    glm::vec3 read_numbers() {
        std::string_view rest = buffer_.line();
        take_word(rest);
        glm::vec3 numbers;
        for (int i = 0; i < 3; ++i) {
            std::string_view word = take_word(rest);
            if (word.empty()) fail(fmt::format("found {} numbers where three were expected", i));
            const std::string_view digits = word.substr(word.front() == '+' ? 1 : 0);
            double value = 0.0;
            const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
            const bool is_number = error == std::errc() && end == digits.data() + digits.size();
            if (!is_number || !(std::abs(value) <= std::numeric_limits<float>::max())) {
                fail(fmt::format("found '{}' where a finite number was expected", word.substr(0, 40)));
            }
            numbers[i] = static_cast<float>(value);
        }
        return numbers;
    }

    void add_vertex() {
        positions_.push_back(read_numbers());
        report();
    }
    void add_normal() {
        normals_.push_back(read_numbers());
        report();
    }

    /// One of the up to three indices of a corner, taken from the front of `rest` with the slash after it; 0: left out.
    std::int64_t take_index(std::string_view& rest, std::string_view corner) {
        const std::string_view digits = rest.substr(0, rest.find('/'));
        rest.remove_prefix(std::min(digits.size() + 1, rest.size()));
        if (digits.empty()) return 0;
        std::int64_t index = 0;
        const char* end = digits.data() + digits.size();
        const auto [stop, error] = std::from_chars(digits.data(), end, index);
        if (error != std::errc() || stop != end || index == 0) {
            fail(fmt::format("found '{}' where the indices of a corner, from 1 on or below 0, were expected",
                             corner.substr(0, 40)));
        }
        return index;
    }

    /// An index of the file counts from 1, or back from the newest at -1.
    std::uint32_t resolve(std::int64_t index, std::size_t count, LargestIndex& largest, const char* kind) {
        if (index > std::numeric_limits<std::int32_t>::max())
            fail(fmt::format("{} index {} is too large", kind, index));
        if (index > 0) {
            if (static_cast<std::size_t>(index) > std::max(count, largest.index)) {
                largest = {static_cast<std::size_t>(index), buffer_.line()};
            }
            return static_cast<std::uint32_t>(index - 1);
        }
        const std::size_t back = std::size_t{0} - static_cast<std::size_t>(index);
        if (back > count) fail(fmt::format("{} index {} goes back past the first of {} so far", kind, index, count));
        return static_cast<std::uint32_t>(count - back);
    }

    Corner read_corner(std::string_view word) {
        std::string_view rest = word;
        const std::int64_t vertex = take_index(rest, word);
        take_index(rest, word);  // of a texture coordinate
        const std::int64_t normal = take_index(rest, word);
        if (vertex == 0 || !rest.empty()) {
            fail(fmt::format("found '{}' where a corner was expected: v, v/vt, v//vn or v/vt/vn", word.substr(0, 40)));
        }
        Corner corner{resolve(vertex, positions_.size(), largest_vertex_, "vertex"), kNone};
        if (normal != 0) corner.normal = resolve(normal, normals_.size(), largest_normal_, "normal");
        return corner;
    }

    void check_largest(const LargestIndex& largest, std::size_t count, const char* kind) {
        if (largest.index <= count) return;
        throw SceneError(file_.string(), buffer_.line_number(largest.line),
                         fmt::format("{} index {} where 1 to {} was expected", kind, largest.index, count));
    }

    void add_face() {
        report();
        if (runs_.empty() || runs_.back().material != material_) {
            runs_.push_back({material_, triangles_.size(), buffer_.line_number(), true});
        }
        std::string_view rest = buffer_.line();
        take_word(rest);
        std::array<Corner, 3> fan{};
        int count = 0;
        for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
            const Corner corner = read_corner(word);
            if (corner.normal == kNone) runs_.back().is_smooth = false;
            if (count == 0) fan[0] = corner;
            fan[1] = fan[2];
            fan[2] = corner;
            if (++count >= 3) triangles_.push_back(fan);
        }
    }

    // ---- Materials

    /// Finds MTL files beside the OBJ file, whatever the working directory is.
    class MaterialFiles : public tinyobj::MaterialReader {
    public:
        explicit MaterialFiles(ObjCollector& collector) : collector_(collector) {}

        bool operator()(const std::string& name, std::vector<tinyobj::material_t>* materials,
                        std::map<std::string, int>* indices, std::string*, std::string*) override {
            return collector_.read_materials(name, *materials, *indices);
        }

    private:
        ObjCollector& collector_;
    };

    bool read_materials(const std::string& name, std::vector<tinyobj::material_t>& materials,
                        std::map<std::string, int>& indices) {
        // A name with spaces arrives in pieces; the line has it whole.
        std::string_view whole = buffer_.line();
        take_word(whole);
        for (std::string candidate : {name, std::string(trim(whole))}) {
            std::replace(candidate.begin(), candidate.end(), '\\', '/');
            const std::filesystem::path path = file_.parent_path() / candidate;
            std::error_code ignored;
            std::ifstream stream(path, std::ios::binary);
            if (!std::filesystem::is_regular_file(path, ignored) || !stream) continue;
            const std::size_t known = materials.size();
            std::string warnings, errors;  // about transparency alone, of which there is a warning below
            tinyobj::LoadMtl(&indices, &materials, &stream, &warnings, &errors);
            for (std::size_t i = known; i < materials.size(); ++i) add_material(materials[i], path.string());
            return true;
        }
        warn(fmt::format("the material file '{}' cannot be read; its materials are grey", name));
        return false;
    }

    void check_colour(const glm::vec3& colour, const char* key, const std::string& name, const std::string& mtl) const {
        for (int i = 0; i < 3; ++i) {
            if (colour[i] >= 0.0f && std::isfinite(colour[i])) continue;
            throw SceneError(
                mtl, 0,
                fmt::format("material '{}': {} has {}, which is not a finite number from 0 on", name, key, colour[i]));
        }
    }

    void add_material(const tinyobj::material_t& from, const std::string& mtl) {
        const std::string name(trim(from.name));
        if (name.empty()) return;  // what tinyobjloader makes of a file without any
        Material material;
        material.ambient = to_vec3(from.ambient);
        material.diffuse = to_vec3(from.diffuse);
        material.specular = to_vec3(from.specular);
        const glm::vec3 emission = to_vec3(from.emission);
        check_colour(material.ambient, "Ka", name, mtl);
        check_colour(material.diffuse, "Kd", name, mtl);
        check_colour(material.specular, "Ks", name, mtl);
        check_colour(emission, "Ke", name, mtl);
        if (!std::isfinite(from.shininess))
            throw SceneError(mtl, 0, fmt::format("material '{}': Ns is not finite", name));
        material.phong_exponent = std::max(from.shininess, 1.0f);
        if (material.ambient == glm::vec3(0.0f)) material.ambient = material.diffuse;
        const float brightest = std::max({emission.x, emission.y, emission.z});
        if (brightest > 0.0f) material.ambient = emission * (kEmissionAmbient / brightest);
        // MTL's illumination models: 3 and 5 reflect, 4, 6, 7 and 9 also refract.
        const int model = from.illum;
        const bool is_transparent = model == 4 || model == 6 || model == 7 || model == 9 || from.dissolve < 1.0f;
        if (model == 3 || model == 5 || model == 4 || model == 6 || model == 7) {
            material.kind = MaterialKind::mirror;
            material.mirror = glm::min(material.specular, glm::vec3(1.0f));
        }
        if (is_transparent) {
            scene_.warnings.push_back({mtl, 0, fmt::format("material '{}' is transparent; it is drawn opaque", name)});
        }
        if (!from.diffuse_texname.empty()) {
            scene_.warnings.push_back(
                {mtl, 0, fmt::format("material '{}': map_Kd is not read; Kd is used alone", name)});
        }
        material_of_.emplace(name, static_cast<int>(scene_.materials.size()));
        scene_.materials.push_back(material);
    }

    void use_material(std::string_view name) {
        const std::string wanted(trim(name));
        const auto found = material_of_.find(wanted);
        material_ = found == material_of_.end() ? kNoMaterial : found->second;
        if (material_ == kNoMaterial && missing_.insert(wanted).second) {
            warn(fmt::format("the material '{}' is not in any MTL file read; it is grey", wanted.substr(0, 40)));
        }
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

    /// The vertices that the run uses, one for each pair of position and normal, in the order of their first use.
    Mesh make_mesh(const Run& run, std::size_t end) {
        Mesh mesh;
        mesh.material = material_index(run.material);
        mesh.line = run.line;
        // Vertices that share a position form a chain: first_split_[position] is the first, next_split[v] the next.
        std::vector<Corner> sources;
        std::vector<std::uint32_t> next_split;
        const auto vertex_of = [&](Corner corner) {
            if (!run.is_smooth) corner.normal = kNone;
            std::uint32_t* link = &first_split_[corner.vertex];
            while (*link != kNone && sources[*link].normal != corner.normal) link = &next_split[*link];
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
                progress_.reach(kCollecting +
                                (1.0 - kCollecting) * static_cast<double>(i) / static_cast<double>(triangles_.size()));
            const std::array<Corner, 3>& corners = triangles_[i];
            const std::uint32_t a = vertex_of(corners[0]), b = vertex_of(corners[1]), c = vertex_of(corners[2]);
            mesh.triangles.push_back({a, b, c});
        }
        mesh.positions.reserve(sources.size());
        for (const Corner& source : sources) {
            mesh.positions.push_back(positions_[source.vertex]);
            if (run.is_smooth) mesh.normals.push_back(unit_or_zero(normals_[source.normal]));
            first_split_[source.vertex] = kNone;
        }
        return mesh;
    }

    static glm::vec3 unit_or_zero(const glm::vec3& normal) {
        const double length = std::hypot(static_cast<double>(normal.x), normal.y, normal.z);
        if (length == 0.0) return glm::vec3(0.0f);
        return {normal.x / length, normal.y / length, normal.z / length};
    }

    const std::filesystem::path& file_;
    std::size_t text_size_;
    Progress progress_;
    std::size_t next_report_ = 0;  // when so many bytes are read
    TextBuffer buffer_;
    Scene scene_;
    std::vector<glm::vec3> positions_;
    std::vector<glm::vec3> normals_;
    std::vector<std::array<Corner, 3>> triangles_;
    std::vector<Run> runs_;
    std::vector<std::uint32_t> first_split_;
    LargestIndex largest_vertex_, largest_normal_;
    std::map<std::string, int> material_of_;
    std::set<std::string> missing_;
    int material_ = kNoMaterial;
    std::uint32_t grey_ = kNone;
};

}  // namespace

Scene read_obj(const std::filesystem::path& file, const Progress& progress) {
    const MappedFile mapped(file);
    if (mapped.bytes().empty()) throw SceneError(file.string(), 0, "the file is empty, not an OBJ file");
    return ObjCollector(file, mapped.bytes(), progress).collect();
}

}  // namespace castor
