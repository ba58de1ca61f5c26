#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/section_file.h"
#include "reference/random_source.h"

namespace castor::test {

/// A section file with some values changed and the right checksums.
struct Forgery {
    std::vector<std::byte> bytes;
    std::string changes;  // for people: a change after the other
};

/// Makes forgeries of one valid section file.
class Forger {
public:
    /// Reads the file, which must be valid.
    Forger(const std::filesystem::path& file, const SectionFileKind& kind);

    /// Changes one to three values. Mostly an aligned value of 32 bits in a random element of a random section, to one
    /// that is likely to do harm (0, 1, -1, a count and its neighbours, NaN, infinity, a flipped bit ...); sometimes an
    /// entry of the head, or the length of a section.
    Forgery forge(reference::RandomSource& random) const;

    const std::vector<std::byte>& original() const { return bytes_; }

private:
    std::string change_section(std::vector<std::byte>& bytes, reference::RandomSource& random) const;
    std::string change_head(std::vector<std::byte>& bytes, reference::RandomSource& random) const;
    std::uint32_t strange_value(std::uint32_t before, reference::RandomSource& random) const;

    std::vector<std::byte> bytes_;
    std::vector<SectionPlace> places_;   // of sections that are not empty
    std::vector<std::uint32_t> counts_;  // of elements, of each section
};

}  // namespace castor::test
