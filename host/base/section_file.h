#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/column.h"
#include "base/mapped_file.h"
#include "base/progress.h"

namespace castor {

// A file of named sections, each an array of values as they stand in memory, to be mapped and used in place:
//
//     head      magic, byte order, version, size of the file, number of sections, checksum of the head, kind; then an
//     entry a section: its name,
//               type, bytes of an element, offset, number of elements, checksum
//     sections  each from a multiple of kSectionPageBytes on; zeros up to the next multiple
//
// in the byte order of the machine, without gaps. Checksums are XXH3's, of whole pages: every byte of the file is under
// one of them. They find damage, not malice: values may be anything although the checksums are right, and whoever reads
// a section checks them.

inline constexpr std::size_t kSectionPageBytes = 4096;

/// To be raised with every change of what sections there are or of what they mean.
inline constexpr std::uint32_t kSectionFileVersion = 24;

/// What a file is for; the name stands in its head.
struct SectionFileKind {
    std::string_view name;    // at most 31 bytes
    std::string_view remedy;  // for messages: what to do where such a file cannot be used
};

inline constexpr SectionFileKind kBuiltSceneFile{"built scene", "build it again from its scene"};
inline constexpr SectionFileKind kCheckpointFile{"checkpoint", "begin the picture anew"};
inline constexpr SectionFileKind kHitsPartFile{"part of hits", "trace it again"};

/// What a section is an array of; both are compared when it is read.
struct ElementType {
    std::string_view name;
    std::size_t bytes;
    bool operator==(const ElementType&) const = default;
};

struct Section {
    std::string_view name;  // at most 31 bytes, as the type's
    ElementType type;
    std::span<const std::byte> bytes;
};

/// Writes the sections to a file, which is replaced in one step. Throws FileError.
void write_section_file(const std::filesystem::path& file, const SectionFileKind& kind,
                        const std::vector<Section>& sections, const Progress& progress = {});

/// Returns whether the file begins as a section file, of any kind and version and however damaged. False for what
/// cannot be read.
bool is_section_file(const std::filesystem::path& file);

/// Returns whether it is a section file of another kind, as far as its beginning tells. False where that cannot be
/// read, or is of another version.
bool is_section_file_of_another_kind(const std::filesystem::path& file, const SectionFileKind& kind);

/// A section as the head of a file describes it.
struct SectionPlace {
    std::string name, type;
    std::uint64_t element_bytes, offset, count, checksum;
};

/// A section file in memory, mapped. For one thread.
class SectionFile {
public:
    /// Checks every byte, in parallel. Throws SceneError where the file is damaged, cut short, or of another kind,
    /// version or byte order, with the place, what was found and what was expected.
    SectionFile(const std::filesystem::path& file, const SectionFileKind& kind, const Progress& progress = {});

    /// Returns the bytes of a section. Throws SceneError where there is none of this name and type.
    std::span<const std::byte> section(std::string_view name, const ElementType& type);
    /// Throws SceneError if there is a section that nobody asked for.
    void expect_no_more() const;

    const std::shared_ptr<const MappedFile>& mapping() const { return mapping_; }
    /// The sections in the order of the file.
    const std::vector<SectionPlace>& places() const { return places_; }

private:
    [[noreturn]] void refuse(const std::string& reason) const;
    void read_head();
    void check_sections(const Progress& progress) const;

    std::string name_;
    SectionFileKind kind_;
    std::shared_ptr<const MappedFile> mapping_;
    std::vector<SectionPlace> places_;
    std::map<std::string, std::size_t, std::less<>> numbers_;  // of sections, by name
    std::vector<bool> used_;                                   // by number
};

/// Where the head and the entries of a section file begin and how long they are, for tests that forge files.
struct SectionFileLayout {
    static constexpr std::size_t kHeadBytes = 72, kEntryBytes = 96;
};

/// Writes the right checksums into a section file in memory that was changed, for tests that forge files: of the
/// sections as its head now describes them, as far as they lie within the file, and of the head.
void restore_checksums(std::span<std::byte> file);

}  // namespace castor
