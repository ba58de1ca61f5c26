#include "render/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/description.h"
#include "base/section_file.h"
#include "castor/error.h"
#include "render/aov.h"

namespace castor {

namespace {

// Along each side of a picture.
constexpr std::uint32_t kMostPixels = 65536;

constexpr std::string_view kPicture = "checkpoint of a picture";
constexpr ElementType kText{"bytes", 1}, kFloat{"float", 4}, kUint{"uint", 4}, kFloat3{"float3", 12}, kFlag{"uchar", 1},
    kFloat4{"float4", 16};
static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::vec4) == 16);

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

std::string section_of(const FilmPlane& plane) {
    return "plane " + plane.name;
}

class Reader {
public:
    explicit Reader(const std::filesystem::path& file) : name_(file.string()), sections_(file, kCheckpointFile) {}

    std::string picture() {
        const auto bytes = sections_.section(kPicture, kText);
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }

    /// Reads all but the planes. Pixels and sums may be any floats: they are only added to and written to pictures.
    Checkpoint checkpoint() {
        Checkpoint checkpoint;
        checkpoint.picture = picture();
        Film& film = checkpoint.film;
        const auto size = column<std::uint32_t>("size", kUint, 3);
        film.width = size[0];
        film.height = size[1];
        film.samples_per_pixel = size[2];
        // A block is named by 16 bits a coordinate.
        if (std::min({film.width, film.height, film.samples_per_pixel}) == 0 ||
            std::max(film.width, film.height) > kMostPixels)
            refuse(
                fmt::format("is damaged: its section size says {}x{} pixels of {} samples, expected 1 to {} pixels "
                            "along each side and at least one sample",
                            film.width, film.height, film.samples_per_pixel, kMostPixels));
        const std::uint64_t pixels = std::uint64_t{film.width} * film.height;
        film.pixels = column<glm::vec3>("pixels", kFloat3, pixels);
        film.done = column<std::uint8_t>("done", kFlag, pixels);
        const PixelBlocks blocks(film.width, film.height);
        std::vector<std::uint8_t> is_done(blocks.count());
        for (std::uint32_t number = 0; number < blocks.count(); ++number) {
            const glm::uvec2 corner = blocks.corner(number);
            const std::uint8_t first = is_done[number] = film.done[std::size_t{corner.y} * film.width + corner.x];
            blocks.for_each_row(number, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                const auto row = film.done.begin() + static_cast<std::ptrdiff_t>(pixel);
                if (first > 1 || std::count(row, row + count, first) != count)
                    refuse(fmt::format("is damaged: its section done has in block {} other flags than all 0 or all 1",
                                       number));
            });
        }
        const std::uint64_t partial_count = sections_.section("partial blocks", kUint).size() / sizeof(std::uint32_t);
        if (partial_count > blocks.count())
            refuse(
                fmt::format("is damaged: its section partial blocks has {} elements, expected at most {}, one a block",
                            partial_count, blocks.count()));
        const auto numbers = column<std::uint32_t>("partial blocks", kUint, partial_count);
        const auto samples = column<std::uint32_t>("samples of partial blocks", kUint, partial_count);
        const auto sums = column<glm::vec4>("sums of partial blocks", kFloat4, partial_count * PixelBlocks::kPixels);
        for (std::size_t i = 0; i < partial_count; ++i) {
            if (numbers[i] >= blocks.count() || is_done[numbers[i]] || (i > 0 && numbers[i] <= numbers[i - 1]))
                refuse(
                    fmt::format("is damaged: its section partial blocks has in element {} the block {}, expected "
                                "blocks below {} that are not done, in ascending order",
                                i, numbers[i], blocks.count()));
            if (samples[i] == 0 || samples[i] >= film.samples_per_pixel)
                refuse(
                    fmt::format("is damaged: its section samples of partial blocks has in element {} {} samples, "
                                "expected 1 to {}",
                                i, samples[i], film.samples_per_pixel - 1));
            PartialBlock& block = checkpoint.partial_blocks[numbers[i]];
            block.samples = samples[i];
            std::copy_n(sums.begin() + static_cast<std::ptrdiff_t>(i * PixelBlocks::kPixels), PixelBlocks::kPixels,
                        block.sums.begin());
        }
        return checkpoint;
    }

    void planes(std::vector<FilmPlane>& planes) {
        for (FilmPlane& plane : planes) {
            if (plane.indices.empty())
                plane.values = column<float>(section_of(plane), kFloat, plane.values.size());
            else
                plane.indices = column<std::uint32_t>(section_of(plane), kUint, plane.indices.size());
        }
        sections_.expect_no_more();
    }

    [[noreturn]] void refuse(const std::string& reason) const { throw SceneError(name_, 0, reason); }

private:
    template <class T>
    std::vector<T> column(std::string_view section, const ElementType& type, std::uint64_t count) {
        const auto bytes = sections_.section(section, type);
        if (bytes.size() / sizeof(T) != count)
            refuse(fmt::format("is damaged: its section {} has {} elements, expected {}", section,
                               bytes.size() / sizeof(T), count));
        std::vector<T> values(count);
        if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
        return values;
    }

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
    const std::uint32_t size[] = {film.width, film.height, film.samples_per_pixel};
    std::vector<Section> sections{{kPicture, kText, std::as_bytes(std::span(checkpoint.picture))},
                                  {"size", kUint, std::as_bytes(std::span(size))},
                                  {"pixels", kFloat3, bytes_of(film.pixels)},
                                  {"done", kFlag, bytes_of(film.done)},
                                  {"partial blocks", kUint, bytes_of(numbers)},
                                  {"samples of partial blocks", kUint, bytes_of(samples)},
                                  {"sums of partial blocks", kFloat4, bytes_of(sums)}};
    for (std::size_t i = 0; i < names.size(); ++i) {
        const FilmPlane& plane = film.planes[i];
        sections.push_back(plane.indices.empty() ? Section{names[i], kFloat, bytes_of(plane.values)}
                                                 : Section{names[i], kUint, bytes_of(plane.indices)});
    }
    write_section_file(file, kCheckpointFile, sections);
}

Checkpoint load_checkpoint(const std::filesystem::path& file, const Checkpoint& expected,
                           const std::string& expected_name) {
    Reader reader(file);
    const std::string picture = reader.picture();
    if (picture != expected.picture)
        reader.refuse("is a checkpoint of another picture: " + difference(picture, expected.picture, expected_name));
    Checkpoint checkpoint = reader.checkpoint();
    if (checkpoint.film.width != expected.film.width || checkpoint.film.height != expected.film.height ||
        checkpoint.film.samples_per_pixel != expected.film.samples_per_pixel)
        reader.refuse("is damaged: its size is not that of its picture");
    checkpoint.film.planes = expected.film.planes;
    reader.planes(checkpoint.film.planes);
    return checkpoint;
}

Checkpoint load_checkpoint(const std::filesystem::path& file) {
    Reader reader(file);
    Checkpoint checkpoint = reader.checkpoint();
    Film& film = checkpoint.film;
    std::istringstream words(value_of(checkpoint, "planes"));
    std::vector<std::string> names;
    for (std::string name; std::getline(words, name, ',');) names.push_back(name);
    try {
        film.planes = make_planes(names, film.width, film.height);
    } catch (const UsageError& error) {
        reader.refuse(fmt::format("is damaged: {}", error.what()));
    }
    reader.planes(film.planes);
    return checkpoint;
}

std::string value_of(const Checkpoint& checkpoint, std::string_view name) {
    for (const std::string& line : lines_of(checkpoint.picture))
        if (line.starts_with(name) && line.size() > name.size() && line[name.size()] == ' ')
            return line.substr(name.size() + 1);
    throw SceneError("", 0, fmt::format("the checkpoint's description has no line \"{}\"", name));
}

CheckpointSummary summarize_checkpoint(const std::filesystem::path& file) {
    const Checkpoint checkpoint = Reader(file).checkpoint();
    const Film& film = checkpoint.film;
    CheckpointSummary summary{lines_of(checkpoint.picture), film.width, film.height,
                              film.samples_per_pixel,       0,          samples_done(checkpoint)};
    summary.pixels_done = static_cast<std::uint64_t>(std::count(film.done.begin(), film.done.end(), 1));
    return summary;
}

std::uint64_t samples_done(const Checkpoint& checkpoint) {
    const Film& film = checkpoint.film;
    std::uint64_t samples =
        static_cast<std::uint64_t>(std::count(film.done.begin(), film.done.end(), 1)) * film.samples_per_pixel;
    const PixelBlocks blocks(film.width, film.height);
    for (const auto& [number, block] : checkpoint.partial_blocks)
        samples += std::uint64_t{blocks.pixels_in_picture(number)} * block.samples;
    return samples;
}

}  // namespace castor
