#include "scene/stl_reader.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>
#include <unordered_map>

#include "base/mapped_file.h"
#include "castor/error.h"
#include "castor/shared/constants.h"
#include "scene/text_lines.h"

namespace castor {

namespace {

constexpr std::size_t kHeader = 80, kBegin = 84, kTriangle = 50;

std::uint32_t word_at(std::string_view bytes, std::size_t i) {
    const auto byte = [&](std::size_t k) { return std::uint32_t{static_cast<unsigned char>(bytes[i + k])}; };
    return byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24;
}

/// Gives equal points equal numbers.
class Vertices {
public:
    explicit Vertices(Mesh& mesh) : mesh_(mesh) {}

    std::uint32_t number(const glm::vec3& point) {
        const Key key{bits(point.x), bits(point.y), bits(point.z)};
        const auto [known, is_new] = numbers_.emplace(key, static_cast<std::uint32_t>(mesh_.positions.size()));
        if (is_new) mesh_.positions.push_back(point);
        return known->second;
    }

private:
    using Key = std::array<std::uint32_t, 3>;
    struct Hash {
        std::size_t operator()(const Key& key) const {
            std::uint64_t hash = 0;
            for (const std::uint32_t word : key) {
                hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
                hash ^= hash >> 32;
            }
            return static_cast<std::size_t>(hash);
        }
    };
    static std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x == 0.0f ? 0.0f : x); }  // -0 is 0

    Mesh& mesh_;
    std::unordered_map<Key, std::uint32_t, Hash> numbers_;
};

void require_usable(const std::filesystem::path& file, std::size_t line, const std::string& where, float x) {
    if (!(std::abs(x) <= CASTOR_MAX_COORDINATE))
        throw SceneError(file.string(), line,
                         fmt::format("{}the coordinate {}, expected a finite one of magnitude at most {:g}", where, x,
                                     CASTOR_MAX_COORDINATE));
}

void read_binary(const std::filesystem::path& file, std::string_view bytes, Mesh& mesh, const Progress& progress) {
    const std::size_t count = word_at(bytes, kHeader);
    mesh.triangles.reserve(count);
    Vertices vertices(mesh);
    for (std::size_t i = 0; i < count; ++i) {
        glm::uvec3 triangle;
        for (int corner = 0; corner < 3; ++corner) {
            glm::vec3 point;
            for (int axis = 0; axis < 3; ++axis) {
                const std::size_t at = kBegin + i * kTriangle + 12 * static_cast<std::size_t>(corner + 1) +
                                       4 * static_cast<std::size_t>(axis);
                point[axis] = std::bit_cast<float>(word_at(bytes, at));
                require_usable(file, 0, fmt::format("byte {}: ", at), point[axis]);
            }
            triangle[corner] = vertices.number(point);
        }
        mesh.triangles.push_back(triangle);
        if (i % 65536 == 0) progress.reach(static_cast<double>(i) / static_cast<double>(count));
    }
}

/// The words of a text, with their lines.
class Words {
public:
    Words(const std::filesystem::path& file, std::string_view text) : file_(file), rest_(text), size_(text.size()) {}

    /// Returns the next word; empty at the end.
    std::string_view next() {
        while (!rest_.empty() && is_space(rest_.front())) {
            // Old files end lines with '\r' alone.
            if (rest_.front() == '\n' || (rest_.front() == '\r' && !rest_.substr(1).starts_with('\n'))) ++line_;
            rest_.remove_prefix(1);
        }
        std::size_t end = 0;
        while (end < rest_.size() && !is_space(rest_[end])) ++end;
        const std::string_view word = rest_.substr(0, end);
        rest_.remove_prefix(end);
        return word;
    }
    void skip_line() { rest_.remove_prefix(std::min(rest_.find_first_of("\r\n"), rest_.size())); }
    void expect(std::string_view word) {
        const std::string_view found = next();
        if (!equals(found, word)) reject(found, fmt::format("\"{}\"", word));
    }
    float number() {
        std::string_view word = next();
        const std::string_view shown = word;
        if (word.starts_with('+')) word.remove_prefix(1);
        double value = 0.0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        const bool is_tiny_or_huge = error == std::errc::result_out_of_range;
        if ((error != std::errc() && !is_tiny_or_huge) || end != word.data() + word.size() || word.empty())
            reject(shown, "a number");
        return static_cast<float>(value);
    }
    [[noreturn]] void reject(std::string_view found, const std::string& expected) const {
        std::string shown(found.substr(0, 40));
        for (char& c : shown)
            if (c < ' ' || c > '~') c = '?';
        throw SceneError(file_.string(), line_,
                         found.empty() ? fmt::format("the file ends where {} was expected", expected)
                                       : fmt::format("\"{}\" where {} was expected", shown, expected));
    }
    static bool equals(std::string_view found, std::string_view word) {
        if (found.size() != word.size()) return false;
        for (std::size_t i = 0; i < word.size(); ++i)
            if ((found[i] | 0x20) != word[i]) return false;
        return true;
    }
    std::size_t line() const { return line_; }
    double share() const { return 1.0 - static_cast<double>(rest_.size()) / static_cast<double>(size_); }

private:
    static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

    const std::filesystem::path& file_;
    std::string_view rest_;
    std::size_t size_, line_ = 1;
};

void read_text(const std::filesystem::path& file, std::string_view bytes, Mesh& mesh, const Progress& progress) {
    Words words(file, bytes);
    Vertices vertices(mesh);
    words.expect("solid");
    words.skip_line();
    for (;;) {
        const std::string_view word = words.next();
        if (word.empty()) break;
        if (Words::equals(word, "endsolid")) {
            words.skip_line();
            continue;
        }
        if (Words::equals(word, "solid")) {
            words.skip_line();
            continue;
        }
        if (!Words::equals(word, "facet")) words.reject(word, "\"facet\" or \"endsolid\"");
        words.expect("normal");
        for (int i = 0; i < 3; ++i) words.next();  // often wrong, and NaN in some files
        words.expect("outer");
        words.expect("loop");
        glm::uvec3 triangle;
        for (int corner = 0; corner < 3; ++corner) {
            words.expect("vertex");
            glm::vec3 point;
            for (int axis = 0; axis < 3; ++axis) {
                point[axis] = words.number();
                require_usable(file, words.line(), "", point[axis]);
            }
            triangle[corner] = vertices.number(point);
        }
        words.expect("endloop");
        words.expect("endfacet");
        mesh.triangles.push_back(triangle);
        if (mesh.triangles.size() % 65536 == 0) progress.reach(words.share());
    }
}

/// Whether a file begins with the word "solid", and not as binary ones do that have it in their header: these have
/// zeros after it, in the header, in the number of triangles or in the first triangle.
bool is_text_stl(std::string_view bytes) {
    bytes = bytes.substr(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
    return Words::equals(bytes.substr(0, 5), "solid") && bytes.substr(0, kBegin + kTriangle).find('\0') == bytes.npos;
}

}  // namespace

bool is_binary_stl(std::string_view beginning, std::uint64_t size) {
    return beginning.size() >= kBegin && size == kBegin + std::uint64_t{kTriangle} * word_at(beginning, kHeader);
}

Mesh read_stl(const std::filesystem::path& file, const Progress& progress) {
    const MappedFile mapped(file);
    const std::string_view bytes = mapped.bytes();
    Mesh mesh;
    std::string storage;
    if (is_binary_stl(bytes, bytes.size()))
        read_binary(file, bytes, mesh, progress);
    else if (const std::string_view text = to_utf8(bytes, storage); is_text_stl(text))
        read_text(file, text, mesh, progress);
    else
        throw SceneError(
            file.string(), 0,
            bytes.size() < kBegin
                ? fmt::format("has {} bytes and does not begin with \"solid\": it is no STL file", bytes.size())
                : fmt::format("byte {}: {} triangles need {} bytes, but the file has {}", kHeader,
                              word_at(bytes, kHeader), kBegin + std::uint64_t{kTriangle} * word_at(bytes, kHeader),
                              bytes.size()));
    if (mesh.triangles.empty()) throw SceneError(file.string(), 0, "the file has no triangle");
    return mesh;
}

}  // namespace castor
