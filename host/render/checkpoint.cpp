#include "render/checkpoint.h"

#include <algorithm>
#include <cstring>
#include <sstream>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "castor/error.h"
#include "scene/section_file.h"

namespace castor {

namespace {

constexpr std::string_view kPicture = "checkpoint of a picture";
constexpr ElementType kText{"bytes", 1}, kFloat{"float", 4}, kUint{"uint", 4}, kFloat3{"float3", 12}, kFlag{"uchar", 1}, kFloat4{"float4", 16};
static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::vec4) == 16);

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

std::string section_of(const FilmPlane& plane) { return "plane " + plane.name; }

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

/// The first line that is not the same, of both.
std::string difference(const std::string& found, const std::string& expected) {
    const std::vector<std::string> a = lines_of(found), b = lines_of(expected);
    for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
        const std::string left = i < a.size() ? a[i] : "nothing", right = i < b.size() ? b[i] : "nothing";
        if (left != right) return fmt::format("it has \"{}\", this one \"{}\"", left, right);
    }
    return "they differ";
}

class Reader {
public:
    explicit Reader(const std::filesystem::path& file) : name_(file.string()), sections_(file) {}

    std::string text(std::string_view section) {
        const auto bytes = sections_.section(section, kText);
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
    template <class T>
    std::vector<T> column(std::string_view section, const ElementType& type) {
        const auto bytes = sections_.section(section, type);
        std::vector<T> values(bytes.size() / sizeof(T));
        if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
        return values;
    }
    template <class T>
    void column(std::string_view section, const ElementType& type, std::vector<T>& target) {
        std::vector<T> values = column<T>(section, type);
        if (values.size() != target.size())
            refuse(fmt::format("its section \"{}\" has {} values where {} were expected", section, values.size(), target.size()));
        target = std::move(values);
    }
    void expect_no_more() const { sections_.expect_no_more(); }
    [[noreturn]] void refuse(const std::string& reason) const { throw SceneError(name_, 0, reason); }

private:
    std::string name_;
    SectionFile sections_;
};

}  // namespace

void save_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint) {
    std::vector<std::uint32_t> numbers, samples;
    std::vector<glm::vec4> sums;
    for (const auto& [number, block] : checkpoint.partial_blocks) {
        numbers.push_back(number);
        samples.push_back(block.samples);
        sums.insert(sums.end(), block.sums.begin(), block.sums.end());
    }
    const Film& film = checkpoint.film;
    std::vector<std::string> names;
    for (const FilmPlane& plane : film.planes) names.push_back(section_of(plane));
    std::vector<Section> sections{{kPicture, kText, std::as_bytes(std::span(checkpoint.picture))},
                                  {"pixels", kFloat3, bytes_of(film.pixels)},
                                  {"done", kFlag, bytes_of(film.done)},
                                  {"partial blocks", kUint, bytes_of(numbers)},
                                  {"samples of partial blocks", kUint, bytes_of(samples)},
                                  {"sums of partial blocks", kFloat4, bytes_of(sums)}};
    for (std::size_t i = 0; i < names.size(); ++i) {
        const FilmPlane& plane = film.planes[i];
        sections.push_back(plane.indices.empty() ? Section{names[i], kFloat, bytes_of(plane.values)} : Section{names[i], kUint, bytes_of(plane.indices)});
    }
    write_section_file(file, sections);
}

Checkpoint load_checkpoint(const std::filesystem::path& file, Checkpoint expected) {
    Reader reader(file);
    const std::string picture = reader.text(kPicture);
    if (picture != expected.picture) reader.refuse("is a checkpoint of another picture: " + difference(picture, expected.picture));
    Checkpoint checkpoint = std::move(expected);
    Film& film = checkpoint.film;
    reader.column("pixels", kFloat3, film.pixels);
    reader.column("done", kFlag, film.done);
    for (FilmPlane& plane : film.planes) {
        const std::string name = section_of(plane);
        if (plane.indices.empty())
            reader.column(name, kFloat, plane.values);
        else
            reader.column(name, kUint, plane.indices);
    }
    const auto numbers = reader.column<std::uint32_t>("partial blocks", kUint);
    std::vector<std::uint32_t> samples(numbers.size());
    reader.column("samples of partial blocks", kUint, samples);
    std::vector<glm::vec4> sums(numbers.size() * PixelBlocks::kPixels);
    reader.column("sums of partial blocks", kFloat4, sums);
    reader.expect_no_more();
    const std::uint32_t block_count = PixelBlocks(film.width, film.height).count();
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (numbers[i] >= block_count || samples[i] == 0 || samples[i] >= film.samples_per_pixel)
            reader.refuse(fmt::format("its partial block {} has number {} of {} and {} of {} samples", i, numbers[i], block_count, samples[i],
                                      film.samples_per_pixel));
        PartialBlock& block = checkpoint.partial_blocks[numbers[i]];
        block.samples = samples[i];
        std::copy_n(sums.begin() + i * PixelBlocks::kPixels, PixelBlocks::kPixels, block.sums.begin());
    }
    return checkpoint;
}

bool is_checkpoint(const std::filesystem::path& file) {
    return is_section_file(file);
}

}  // namespace castor
