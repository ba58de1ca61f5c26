#include "render/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/description.h"
#include "base/section_file.h"
#include "castor/error.h"
#include "castor/tone_map.h"
#include "render/aov.h"

namespace castor {

namespace {

// Pixels along each side of a picture.
constexpr std::uint32_t kLargestEdge = 65536;

constexpr std::string_view kToneMaps = "tone maps ", kPlanes = "planes ";
constexpr std::string_view kPicture = "checkpoint of a picture";
constexpr ElementType kText{"bytes", 1}, kFloat{"float", 4}, kUint{"uint", 4}, kFloat3{"float3", 12}, kFlag{"uchar", 1},
    kFloat4{"float4", 16};
static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::vec4) == 16);

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
    return std::as_bytes(std::span(values));
}

/// Calls `visit(block)` for each block that is done.
template <class Visit>
void for_each_done(const Film& film, const PixelBlocks& blocks, const Visit& visit) {
    for (std::uint32_t block = 0; block < blocks.count(); ++block) {
        const glm::uvec2 corner = blocks.corner(block);
        if (film.done[std::size_t{corner.y} * film.width + corner.x] != 0) visit(block);
    }
}

/// Sets the flags of a block's pixels.
void flag(std::vector<std::uint8_t>& of_pixels, const PixelBlocks& blocks, std::uint32_t block) {
    blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
        std::fill_n(of_pixels.begin() + static_cast<std::ptrdiff_t>(pixel), count, std::uint8_t{1});
    });
}

/// Returns a flag a pixel: whether a checkpoint has its planes. Those of a block are there as soon as it is begun.
std::vector<std::uint8_t> pixels_with_planes(const Checkpoint& checkpoint, const PixelBlocks& blocks) {
    std::vector<std::uint8_t> has_planes = checkpoint.film.done;
    for (const auto& [block, state] : checkpoint.partial_blocks) flag(has_planes, blocks, block);
    return has_planes;
}

/// Removes the values of pixels that have no flag; the others stay in their order.
template <class T>
void pack(std::vector<T>& values, std::size_t values_a_pixel, const std::vector<std::uint8_t>& has_values) {
    auto end = values.begin();
    for (std::size_t pixel = 0; pixel < has_values.size(); ++pixel)
        if (has_values[pixel])
            for (std::size_t i = 0; i < values_a_pixel; ++i) *end++ = values[pixel * values_a_pixel + i];
    values.erase(end, values.end());
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
            std::max(film.width, film.height) > kLargestEdge)
            refuse(
                fmt::format("is damaged: its section size says {}x{} pixels of {} samples, expected 1 to {} pixels "
                            "along each side and at least one sample",
                            film.width, film.height, film.samples_per_pixel, kLargestEdge));
        const std::uint64_t pixels = std::uint64_t{film.width} * film.height;
        const PixelBlocks blocks(film.width, film.height);
        const auto is_done = column<std::uint8_t>("done blocks", kFlag, blocks.count());
        film.done.resize(pixels);
        for (std::uint32_t number = 0; number < blocks.count(); ++number) {
            if (is_done[number] > 1)
                refuse(fmt::format("is damaged: its section done blocks has in element {} the flag {}, expected 0 or 1",
                                   number, is_done[number]));
            if (is_done[number]) flag(film.done, blocks, number);
        }
        film.pixels.resize(pixels);
        unpack("pixels of done blocks", kFloat3, film.pixels, 1, film.done);
        const std::uint64_t partial_count = sections_.section("partial blocks", kUint).size() / sizeof(std::uint32_t);
        if (partial_count > blocks.count())
            refuse(
                fmt::format("is damaged: its section partial blocks has {} elements, expected at most {}, one a block",
                            partial_count, blocks.count()));
        const auto numbers = column<std::uint32_t>("partial blocks", kUint, partial_count);
        const auto samples = column<std::uint32_t>("samples of partial blocks", kUint, partial_count);
        const std::uint64_t sums_of_block = rows_of_sums(planes_of(checkpoint.picture, {})) * PixelBlocks::kPixels;
        const auto sums = column<glm::vec4>("sums of partial blocks", kFloat4, partial_count * sums_of_block);
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
            const auto first = sums.begin() + static_cast<std::ptrdiff_t>(i * sums_of_block);
            block.sums.assign(first, first + static_cast<std::ptrdiff_t>(sums_of_block));
        }
        read_stopped_blocks(checkpoint, is_done);
        return checkpoint;
    }

    /// Reads the planes that the film has by name, into the pixels of which there are any.
    void planes(Checkpoint& checkpoint) {
        Film& film = checkpoint.film;
        std::vector<std::uint8_t> has_planes;
        if (!film.planes.empty()) has_planes = pixels_with_planes(checkpoint, PixelBlocks(film.width, film.height));
        for (FilmPlane& plane : film.planes) {
            if (plane.indices.empty())
                unpack(section_of(plane), kFloat, plane.values, plane.channels.size(), has_planes);
            else
                unpack(section_of(plane), kUint, plane.indices, plane.channels.size(), has_planes);
        }
        sections_.expect_no_more();
    }

    /// Makes the planes that the picture's description names, without reading them.
    std::vector<FilmPlane> planes_of(const std::string& picture, const glm::uvec2& size) const {
        std::vector<std::string> names;
        for (const std::string& line : lines_of(picture)) {
            if (!line.starts_with(kPlanes)) continue;
            std::istringstream words(line.substr(kPlanes.size()));
            for (std::string name; std::getline(words, name, ',');) names.push_back(name);
        }
        try {
            return make_planes(names, size.x, size.y);
        } catch (const UsageError& error) {
            refuse(fmt::format("is damaged: {}", error.what()));
        }
    }

    [[noreturn]] void refuse(const std::string& reason) const { throw SceneError(name_, 0, reason); }

private:
    void read_stopped_blocks(Checkpoint& checkpoint, const std::vector<std::uint8_t>& is_done) {
        const std::uint64_t count = sections_.section("stopped blocks", kUint).size() / sizeof(std::uint32_t);
        if (count > is_done.size())
            refuse(
                fmt::format("is damaged: its section stopped blocks has {} elements, expected at most {}, one a block",
                            count, is_done.size()));
        const auto numbers = column<std::uint32_t>("stopped blocks", kUint, count);
        const auto samples = column<std::uint32_t>("samples of stopped blocks", kUint, count);
        for (std::size_t i = 0; i < count; ++i) {
            if (numbers[i] >= is_done.size() || !is_done[numbers[i]] || (i > 0 && numbers[i] <= numbers[i - 1]))
                refuse(
                    fmt::format("is damaged: its section stopped blocks has in element {} the block {}, expected "
                                "blocks below {} that are done, in ascending order",
                                i, numbers[i], is_done.size()));
            if (samples[i] == 0 || samples[i] >= checkpoint.film.samples_per_pixel)
                refuse(
                    fmt::format("is damaged: its section samples of stopped blocks has in element {} {} samples, "
                                "expected 1 to {}",
                                i, samples[i], checkpoint.film.samples_per_pixel - 1));
            checkpoint.stopped_blocks[numbers[i]] = samples[i];
        }
    }

    template <class T>
    std::span<const std::byte> bytes_of_column(std::string_view section, const ElementType& type, std::uint64_t count) {
        const auto bytes = sections_.section(section, type);
        if (bytes.size() / sizeof(T) != count)
            refuse(fmt::format("is damaged: its section {} has {} elements, expected {}", section,
                               bytes.size() / sizeof(T), count));
        return bytes;
    }
    template <class T>
    std::vector<T> column(std::string_view section, const ElementType& type, std::uint64_t count) {
        const auto bytes = bytes_of_column<T>(section, type, count);
        std::vector<T> values(count);
        if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
        return values;
    }
    /// Reads what pack() left into the pixels that have a flag.
    template <class T>
    void unpack(std::string_view section, const ElementType& type, std::vector<T>& values, std::size_t values_a_pixel,
                const std::vector<std::uint8_t>& has_values) {
        const auto count = static_cast<std::uint64_t>(std::count(has_values.begin(), has_values.end(), 1));
        const std::byte* from = bytes_of_column<T>(section, type, count * values_a_pixel).data();
        const std::size_t bytes_a_pixel = values_a_pixel * sizeof(T);
        for (std::size_t pixel = 0; pixel < has_values.size(); ++pixel) {
            if (!has_values[pixel]) continue;
            std::memcpy(values.data() + pixel * values_a_pixel, from, bytes_a_pixel);
            from += bytes_a_pixel;
        }
    }

    std::string name_;
    SectionFile sections_;
};

}  // namespace

void save_checkpoint(const std::filesystem::path& file, Checkpoint checkpoint) {
    std::vector<std::uint32_t> numbers, samples;
    std::vector<glm::vec4> sums;
    for (const auto& [number, block] : checkpoint.partial_blocks) {
        numbers.push_back(number);
        samples.push_back(block.samples);
        sums.insert(sums.end(), block.sums.begin(), block.sums.end());
    }
    std::vector<std::uint32_t> stopped, samples_of_stopped;
    for (const auto& [number, count] : checkpoint.stopped_blocks) {
        stopped.push_back(number);
        samples_of_stopped.push_back(count);
    }
    Film& film = checkpoint.film;
    const PixelBlocks blocks(film.width, film.height);
    std::vector<std::uint8_t> is_done(blocks.count());
    for_each_done(film, blocks, [&](std::uint32_t block) { is_done[block] = 1; });
    pack(film.pixels, 1, film.done);
    std::vector<std::string> names;  // of planes
    std::vector<bool> holds_indices;
    std::vector<std::uint8_t> has_planes;
    if (!film.planes.empty()) has_planes = pixels_with_planes(checkpoint, blocks);
    for (FilmPlane& plane : film.planes) {
        names.push_back(section_of(plane));
        holds_indices.push_back(!plane.indices.empty());
        if (holds_indices.back())
            pack(plane.indices, plane.channels.size(), has_planes);
        else
            pack(plane.values, plane.channels.size(), has_planes);
    }
    const std::uint32_t size[] = {film.width, film.height, film.samples_per_pixel};
    std::vector<Section> sections{{kPicture, kText, std::as_bytes(std::span(checkpoint.picture))},
                                  {"size", kUint, std::as_bytes(std::span(size))},
                                  {"done blocks", kFlag, bytes_of(is_done)},
                                  {"pixels of done blocks", kFloat3, bytes_of(film.pixels)},
                                  {"partial blocks", kUint, bytes_of(numbers)},
                                  {"samples of partial blocks", kUint, bytes_of(samples)},
                                  {"sums of partial blocks", kFloat4, bytes_of(sums)},
                                  {"stopped blocks", kUint, bytes_of(stopped)},
                                  {"samples of stopped blocks", kUint, bytes_of(samples_of_stopped)}};
    for (std::size_t i = 0; i < names.size(); ++i) {
        const FilmPlane& plane = film.planes[i];
        sections.push_back(holds_indices[i] ? Section{names[i], kUint, bytes_of(plane.indices)}
                                            : Section{names[i], kFloat, bytes_of(plane.values)});
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
    reader.planes(checkpoint);
    return checkpoint;
}

Checkpoint load_checkpoint(const std::filesystem::path& file) {
    Reader reader(file);
    Checkpoint checkpoint = reader.checkpoint();
    Film& film = checkpoint.film;
    value_of(checkpoint, "planes");  // or it is of no picture
    film.planes = reader.planes_of(checkpoint.picture, {film.width, film.height});
    reader.planes(checkpoint);
    return checkpoint;
}

std::string value_of(const Checkpoint& checkpoint, std::string_view name) {
    for (const std::string& line : lines_of(checkpoint.picture))
        if (line.starts_with(name) && line.size() > name.size() && line[name.size()] == ' ')
            return line.substr(name.size() + 1);
    throw SceneError("", 0, fmt::format("the checkpoint's description has no line \"{}\"", name));
}

std::string describe(const std::vector<ToneMap>& tone_maps) {
    nlohmann::json list = nlohmann::json::array();
    for (const ToneMap& map : tone_maps)
        list.push_back({{"operator", std::string(to_string(map.tone_operator))},
                        {"key", map.key},
                        {"burn", map.burn_percent},
                        {"saturation", map.saturation},
                        {"srgb", map.is_srgb},
                        {"gamma", map.gamma},
                        {"extension", map.extension}});
    return list.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::vector<ToneMap> tone_maps_of(const Checkpoint& checkpoint) {
    std::vector<ToneMap> maps;
    const std::vector<std::string> lines = lines_of(checkpoint.picture);
    const auto line =
        std::find_if(lines.begin(), lines.end(), [](const std::string& text) { return text.starts_with(kToneMaps); });
    if (line == lines.end()) return maps;
    try {
        for (const auto& entry : nlohmann::json::parse(line->substr(kToneMaps.size()))) {
            ToneMap& map = maps.emplace_back();
            map.tone_operator = tone_operator_from_string(entry.at("operator").get<std::string>());
            entry.at("key").get_to(map.key);
            entry.at("burn").get_to(map.burn_percent);
            entry.at("saturation").get_to(map.saturation);
            entry.at("srgb").get_to(map.is_srgb);
            entry.at("gamma").get_to(map.gamma);
            entry.at("extension").get_to(map.extension);
        }
    } catch (const std::exception& error) {
        throw SceneError("", 0, fmt::format("is damaged: its tone maps cannot be read: {}", error.what()));
    }
    return maps;
}

CheckpointSummary summarize_checkpoint(const std::filesystem::path& file) {
    const Checkpoint checkpoint = Reader(file).checkpoint();
    const Film& film = checkpoint.film;
    CheckpointSummary summary{lines_of(checkpoint.picture), film.width, film.height,
                              film.samples_per_pixel,       0,          samples_done(checkpoint),
                              samples_spared(checkpoint)};
    summary.pixels_done = static_cast<std::uint64_t>(std::count(film.done.begin(), film.done.end(), 1));
    return summary;
}

std::uint64_t samples_spared(const Checkpoint& checkpoint) {
    const Film& film = checkpoint.film;
    const PixelBlocks blocks(film.width, film.height);
    std::uint64_t samples = 0;
    for (const auto& [number, count] : checkpoint.stopped_blocks)
        samples += std::uint64_t{blocks.pixels_in_picture(number)} * (film.samples_per_pixel - count);
    return samples;
}

std::uint64_t samples_done(const Checkpoint& checkpoint) {
    const Film& film = checkpoint.film;
    std::uint64_t samples =
        static_cast<std::uint64_t>(std::count(film.done.begin(), film.done.end(), 1)) * film.samples_per_pixel;
    const PixelBlocks blocks(film.width, film.height);
    for (const auto& [number, block] : checkpoint.partial_blocks)
        samples += std::uint64_t{blocks.pixels_in_picture(number)} * block.samples;
    return samples - samples_spared(checkpoint);
}

}  // namespace castor
