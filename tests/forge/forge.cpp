#include "forge/forge.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "base/mapped_file.h"

namespace castor::test {

namespace {

template <class T>
T read_at(const std::vector<std::byte>& bytes, std::size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

template <class T>
void write_at(std::vector<std::byte>& bytes, std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
}

}  // namespace

Forger::Forger(const std::filesystem::path& file, const SectionFileKind& kind) {
    const SectionFile sections(file, kind);
    const std::string_view bytes = sections.mapping()->bytes();
    const auto* begin = reinterpret_cast<const std::byte*>(bytes.data());
    bytes_.assign(begin, begin + bytes.size());
    for (const SectionPlace& place : sections.places()) {
        counts_.push_back(static_cast<std::uint32_t>(place.count));
        if (place.count > 0) places_.push_back(place);
    }
}

Forgery Forger::forge(reference::RandomSource& random) const {
    Forgery forgery{bytes_, ""};
    const std::uint32_t changes = 1 + (random.below(4) == 0 ? random.below(3) : 0);
    for (std::uint32_t i = 0; i < changes; ++i) {
        const std::string change =
            random.below(16) == 0 ? change_head(forgery.bytes, random) : change_section(forgery.bytes, random);
        forgery.changes += (i == 0 ? "" : "; ") + change;
    }
    restore_checksums(forgery.bytes);
    return forgery;
}

/// Changes a value of one, four or eight bytes.
std::string Forger::change_section(std::vector<std::byte>& bytes, reference::RandomSource& random) const {
    const SectionPlace& place = places_[random.below(static_cast<std::uint32_t>(places_.size()))];
    const std::uint64_t element = random.below(static_cast<std::uint32_t>(place.count));
    const std::uint64_t size = place.element_bytes * place.count;
    const auto at_byte = [&](std::uint64_t offset) { return place.offset + offset; };
    // The settings are values of all sizes without padding.
    const bool has_loose_values = place.element_bytes == 1;
    const std::uint64_t width = has_loose_values ? (random.below(2)   ? 1u
                                                    : random.below(2) ? 4u
                                                                      : 8u)
                                                 : (random.below(8) == 0 ? 1u : 4u);
    std::uint64_t offset = element * place.element_bytes;
    if (!has_loose_values) {
        const auto values = static_cast<std::uint32_t>(place.element_bytes / width);
        offset += width * random.below(std::max(values, 1u));
    }
    if (offset + width > size) offset = size - std::min(size, width);
    std::string what;
    if (width == 1 || offset + width > size) {
        const auto before = std::to_integer<std::uint8_t>(bytes[at_byte(offset)]);
        const std::uint8_t choices[] = {0,
                                        1,
                                        2,
                                        0x7f,
                                        0x80,
                                        0xff,
                                        static_cast<std::uint8_t>(before + 1),
                                        static_cast<std::uint8_t>(before ^ (1u << random.below(8)))};
        bytes[at_byte(offset)] = std::byte{choices[random.below(std::size(choices))]};
        what = fmt::format("{:#x} -> {:#x}", before, std::to_integer<std::uint8_t>(bytes[at_byte(offset)]));
    } else if (width == 8) {
        const auto before = read_at<std::uint64_t>(bytes, at_byte(offset));
        const std::uint64_t choices[] = {0,
                                         1,
                                         ~std::uint64_t{0},
                                         before + 1,
                                         before - 1,
                                         before << 32,
                                         std::uint64_t{1} << random.below(64),
                                         before * 1000};
        write_at(bytes, at_byte(offset), choices[random.below(std::size(choices))]);
        what = fmt::format("{:#x} -> {:#x}", before, read_at<std::uint64_t>(bytes, at_byte(offset)));
    } else {
        const auto before = read_at<std::uint32_t>(bytes, at_byte(offset));
        write_at(bytes, at_byte(offset), strange_value(before, random));
        what = fmt::format("{:#x} -> {:#x}", before, read_at<std::uint32_t>(bytes, at_byte(offset)));
    }
    return fmt::format("{}[{}] byte {}: {}", place.name, element, offset - element * place.element_bytes, what);
}

std::uint32_t Forger::strange_value(std::uint32_t before, reference::RandomSource& random) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const auto count = counts_[random.below(static_cast<std::uint32_t>(counts_.size()))];
    const float as_float = std::bit_cast<float>(before);
    switch (random.below(18)) {
        case 0:
            return 0;
        case 1:
            return 1;
        case 2:
            return 0xffffffffu;
        case 3:
            return 0x7fffffffu;
        case 4:
            return 0x80000000u;
        case 5:
            return before + 1;
        case 6:
            return before - 1;
        case 7:
            return count;
        case 8:
            return count + 1;
        case 9:
            return count - 1;
        case 10:
            return random.below(std::max(count, 1u));
        case 11:
            return std::bit_cast<std::uint32_t>(std::numeric_limits<float>::quiet_NaN());
        case 12:
            return std::bit_cast<std::uint32_t>(random.below(2) ? kInfinity : -kInfinity);
        case 13:
            return std::bit_cast<std::uint32_t>(random.below(2) ? 3e38f : 1e-42f);
        case 14:
            return std::bit_cast<std::uint32_t>(-as_float);
        case 15:
            return std::bit_cast<std::uint32_t>(as_float * (random.below(2) ? 1e6f : 1e-6f));
        case 16:
            return random.bits();
        default:
            return before ^ (1u << random.below(32));
    }
}

/// Changes a section's entry: its length, most of all, which checksums do not hinder.
std::string Forger::change_head(std::vector<std::byte>& bytes, reference::RandomSource& random) const {
    const auto section = random.below(static_cast<std::uint32_t>(counts_.size()));
    const std::size_t entry = SectionFileLayout::kHeadBytes + section * SectionFileLayout::kEntryBytes;
    const std::size_t count_at = entry + 80;
    const std::uint32_t field = random.below(8);
    if (field < 5) {
        const auto before = read_at<std::uint64_t>(bytes, count_at);
        const std::uint64_t choices[] = {0, 1, before - 1, before + 1, before / 2, before * 2, ~std::uint64_t{0} / 3};
        write_at(bytes, count_at, choices[random.below(std::size(choices))]);
        return fmt::format("entry {}: count {} -> {}", section, before, read_at<std::uint64_t>(bytes, count_at));
    }
    // A number of the head after its version, or any part of the entry.
    const std::size_t at = field == 5 ? 16 + 4 * random.below(6) : entry + 4 * random.below(24);
    const auto before = read_at<std::uint32_t>(bytes, at);
    write_at(bytes, at, strange_value(before, random));
    return fmt::format("byte {} of the head: {:#x} -> {:#x}", at, before, read_at<std::uint32_t>(bytes, at));
}

}  // namespace castor::test
