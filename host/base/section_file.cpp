#include "base/section_file.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <fstream>

#include "base/atomic_file.h"
#include "base/checksum.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr char kMagic[8] = {'C', 'A', 'S', 'T', 'O', 'R', '\x1a', '\n'};
constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr std::size_t kNameBytes = 32;

struct Head {
    char magic[8];
    std::uint32_t byte_order;
    std::uint32_t version;
    std::uint64_t file_bytes;
    std::uint64_t section_count;
    std::uint64_t checksum;  // of the head's pages, with 0 here
    char kind[kNameBytes];
};
static_assert(sizeof(Head) == SectionFileLayout::kHeadBytes);

struct Entry {
    char name[kNameBytes];
    char type[kNameBytes];
    std::uint64_t element_bytes;
    std::uint64_t offset;  // bytes from the file's beginning
    std::uint64_t count;   // of elements
    std::uint64_t checksum;
};
static_assert(sizeof(Entry) == SectionFileLayout::kEntryBytes);

std::uint64_t whole_pages(std::uint64_t bytes) {
    return (bytes + kSectionPageBytes - 1) / kSectionPageBytes * kSectionPageBytes;
}

std::uint64_t head_bytes(std::uint64_t section_count) {
    return whole_pages(sizeof(Head) + section_count * sizeof(Entry));
}

/// Pieces are read by several threads; the checksum of the whole is that of the pieces' checksums.
constexpr std::size_t kPieceBytes = std::size_t{4} << 20;

/// Returns the checksum of the bytes and of the zeros that follow them up to a whole page: the last page is a piece of
/// its own.
std::uint64_t page_checksum(std::span<const std::byte> bytes, ProgressCount& bytes_done) {
    if (bytes.empty()) return 0;
    const std::span<const std::byte> before = bytes.first((bytes.size() - 1) / kSectionPageBytes * kSectionPageBytes);
    std::array<std::byte, kSectionPageBytes> last{};
    std::copy(bytes.begin() + static_cast<std::ptrdiff_t>(before.size()), bytes.end(), last.begin());
    const std::size_t piece_count = (before.size() + kPieceBytes - 1) / kPieceBytes;
    std::vector<std::uint64_t> pieces(piece_count + 1, XXH3_64bits(last.data(), last.size()));
    tbb::parallel_for(std::size_t{0}, piece_count, [&](std::size_t i) {
        const std::size_t begin = i * kPieceBytes;
        const std::size_t size = std::min(kPieceBytes, before.size() - begin);
        pieces[i] = XXH3_64bits(before.data() + begin, size);
        bytes_done.add(size);
    });
    return XXH3_64bits(pieces.data(), pieces.size() * sizeof pieces[0]);
}

/// The share of the time of writing that checksums take.
constexpr double kChecksums = 0.1;

void store_name(char (&to)[kNameBytes], std::string_view name) {
    assert(name.size() < kNameBytes);
    std::copy(name.begin(), name.end(), to);
}

std::uint64_t head_checksum(Head head, std::span<const std::byte> pages) {
    head.checksum = 0;
    return XXH3_64bits_withSeed(pages.data() + sizeof head, pages.size() - sizeof head,
                                XXH3_64bits(&head, sizeof head));
}

template <class T>
T read_at(std::string_view bytes, std::size_t offset) {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

std::string text_of(const char (&name)[kNameBytes]) {
    return {name, std::find(name, name + kNameBytes, '\0')};
}

/// Returns the head of a file, with zeros for what is not there or cannot be read.
Head beginning_of(const std::filesystem::path& file) {
    Head head{};
    std::error_code error;
    if (std::filesystem::is_regular_file(file, error))
        std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(&head), sizeof(head));
    return head;
}

}  // namespace

void write_section_file(const std::filesystem::path& file, const SectionFileKind& kind,
                        const std::vector<Section>& sections, const Progress& progress) {
    std::uint64_t section_bytes = 1;
    for (const Section& section : sections) section_bytes += section.bytes.size();
    ProgressCount bytes_done(progress.part(0.0, kChecksums), section_bytes);
    std::vector<std::byte> head(head_bytes(sections.size()));
    static constexpr std::array<std::byte, kSectionPageBytes> kZeros{};
    std::vector<std::span<const std::byte>> pieces{head};
    std::uint64_t offset = head.size();
    for (std::size_t i = 0; i < sections.size(); ++i) {
        const Section& section = sections[i];
        Entry entry{};
        store_name(entry.name, section.name);
        store_name(entry.type, section.type.name);
        entry.element_bytes = section.type.bytes;
        entry.offset = offset;
        entry.count = section.bytes.size() / section.type.bytes;
        entry.checksum = page_checksum(section.bytes, bytes_done);
        std::memcpy(head.data() + sizeof(Head) + i * sizeof(Entry), &entry, sizeof(Entry));
        const std::uint64_t end = whole_pages(offset + section.bytes.size());
        pieces.push_back(section.bytes);
        pieces.push_back(std::span(kZeros).first(end - offset - section.bytes.size()));
        offset = end;
    }
    Head first{{}, kByteOrder, kSectionFileVersion, offset, sections.size(), 0, {}};
    std::memcpy(first.magic, kMagic, sizeof(kMagic));
    store_name(first.kind, kind.name);
    first.checksum = head_checksum(first, head);
    std::memcpy(head.data(), &first, sizeof(Head));
    write_file_atomically(file, pieces, progress.part(kChecksums, 1.0));
}

bool is_section_file(const std::filesystem::path& file) {
    const Head head = beginning_of(file);
    return std::memcmp(head.magic, kMagic, sizeof(kMagic)) == 0;
}

bool is_section_file_of_another_kind(const std::filesystem::path& file, const SectionFileKind& kind) {
    const Head head = beginning_of(file);
    return std::memcmp(head.magic, kMagic, sizeof(kMagic)) == 0 && head.byte_order == kByteOrder &&
           head.version == kSectionFileVersion && text_of(head.kind) != kind.name;
}

SectionFile::SectionFile(const std::filesystem::path& file, const SectionFileKind& kind, const Progress& progress)
    : name_(file.string()), kind_(kind), mapping_(std::make_shared<const MappedFile>(file)) {
    read_head();
    check_sections(progress);
}

void SectionFile::refuse(const std::string& reason) const {
    throw SceneError(name_, 0, reason);
}

void SectionFile::read_head() {
    const std::string_view bytes = mapping_->bytes();
    if (bytes.size() < sizeof(kMagic) || std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0)
        refuse(fmt::format("is no {}: it does not begin with Castor's signature", kind_.name));
    if (bytes.size() < sizeof(Head))
        refuse(fmt::format("is cut short: the head of a {} has {} bytes, the file {}", kind_.name, sizeof(Head),
                           bytes.size()));
    const auto head = read_at<Head>(bytes, 0);
    // These come first: a head in another byte order reads as nonsense, and one of another version may be laid out
    // differently.
    if (head.byte_order == __builtin_bswap32(kByteOrder))
        refuse(fmt::format(
            "was saved on a machine of the other byte order (at byte {}: found {:#010x}, expected {:#010x}); {}",
            offsetof(Head, byte_order), head.byte_order, kByteOrder, kind_.remedy));
    if (head.byte_order != kByteOrder)
        refuse(fmt::format("is damaged: its byte order (at byte {}) is {:#010x}, expected {:#010x}",
                           offsetof(Head, byte_order), head.byte_order, kByteOrder));
    if (head.version != kSectionFileVersion)
        refuse(fmt::format("is of version {} of the format (at byte {}), this Castor reads version {}; {}",
                           head.version, offsetof(Head, version), kSectionFileVersion, kind_.remedy));
    if (head.file_bytes != bytes.size())
        refuse(fmt::format("is {}: it says that it has {} bytes (at byte {}), the file has {}",
                           bytes.size() < head.file_bytes ? "cut short or damaged" : "damaged", head.file_bytes,
                           offsetof(Head, file_bytes), bytes.size()));
    if (head.section_count > bytes.size() / sizeof(Entry) || head_bytes(head.section_count) > bytes.size())
        refuse(fmt::format("is damaged: it says that it has {} sections (at byte {}), more than fit",
                           head.section_count, offsetof(Head, section_count)));
    const auto* begin = reinterpret_cast<const std::byte*>(bytes.data());
    const std::size_t size = head_bytes(head.section_count);
    const std::uint64_t found = head_checksum(head, {begin, size});
    if (found != head.checksum)
        refuse(fmt::format("is damaged: the checksum of its head (bytes 0 to {}) is {:016x}, expected {:016x}",
                           size - 1, found, head.checksum));
    if (text_of(head.kind) != kind_.name)
        refuse(fmt::format("is a {}; a {} was expected", text_of(head.kind), kind_.name));
    std::uint64_t next = size;  // where the next section is to begin
    for (std::size_t i = 0; i < head.section_count; ++i) {
        const std::size_t at = sizeof(Head) + i * sizeof(Entry);
        const auto entry = read_at<Entry>(bytes, at);
        places_.push_back(
            {text_of(entry.name), text_of(entry.type), entry.element_bytes, entry.offset, entry.count, entry.checksum});
        const std::string& section = places_.back().name;
        const bool fits = entry.element_bytes > 0 && entry.offset <= bytes.size() &&
                          entry.count <= (bytes.size() - entry.offset) / entry.element_bytes;
        if (!fits || bytes.size() % kSectionPageBytes != 0)
            refuse(
                fmt::format("is damaged: its section {} (described at byte {}) does not lie within the file's {} bytes",
                            section, at, bytes.size()));
        if (entry.offset != next)
            refuse(fmt::format("is damaged: its section {} (described at byte {}) begins at byte {}, expected {}",
                               section, at, entry.offset, next));
        next = whole_pages(entry.offset + entry.count * entry.element_bytes);
        if (!numbers_.emplace(section, i).second)
            refuse(fmt::format("is damaged: it has two sections {} (the second described at byte {})", section, at));
    }
    if (next != bytes.size())
        refuse(fmt::format("is damaged: its last section ends at byte {}, the file at {}", next, bytes.size()));
    used_.resize(places_.size());
}

void SectionFile::check_sections(const Progress& progress) const {
    ProgressCount bytes_done(progress, mapping_->bytes().size());
    const auto* begin = reinterpret_cast<const std::byte*>(mapping_->bytes().data());
    for (const SectionPlace& place : places_) {
        const std::uint64_t bytes = whole_pages(place.count * place.element_bytes);
        const std::uint64_t found = page_checksum({begin + place.offset, bytes}, bytes_done);
        if (found != place.checksum)
            refuse(
                fmt::format("is damaged: the checksum of its section {} (bytes {} to {}) is {:016x}, expected {:016x}",
                            place.name, place.offset, place.offset + bytes - 1, found, place.checksum));
    }
}

std::span<const std::byte> SectionFile::section(std::string_view name, const ElementType& type) {
    const auto number = numbers_.find(name);
    if (number == numbers_.end()) refuse(fmt::format("has no section {}; {}", name, kind_.remedy));
    const SectionPlace& place = places_[number->second];
    const ElementType found{place.type, place.element_bytes};
    if (found != type)
        refuse(fmt::format("has {} of {} bytes in its section {}, expected {} of {} bytes; {}", found.name, found.bytes,
                           name, type.name, type.bytes, kind_.remedy));
    used_[number->second] = true;
    const auto* begin = reinterpret_cast<const std::byte*>(mapping_->bytes().data());
    return {begin + place.offset, place.count * place.element_bytes};
}

void SectionFile::expect_no_more() const {
    for (std::size_t i = 0; i < places_.size(); ++i)
        if (!used_[i])
            refuse(fmt::format("has a section {} that this Castor does not know; {}", places_[i].name, kind_.remedy));
}

void restore_checksums(std::span<std::byte> file) {
    ProgressCount nobody_waits({}, 1);
    const std::string_view bytes(reinterpret_cast<const char*>(file.data()), file.size());
    if (bytes.size() < sizeof(Head)) return;
    auto head = read_at<Head>(bytes, 0);
    if (head.section_count > bytes.size() / sizeof(Entry) || head_bytes(head.section_count) > bytes.size()) return;
    for (std::size_t i = 0; i < head.section_count; ++i) {
        const std::size_t at = sizeof(Head) + i * sizeof(Entry);
        auto entry = read_at<Entry>(bytes, at);
        if (entry.element_bytes == 0 || entry.offset > file.size() ||
            entry.count > (file.size() - entry.offset) / entry.element_bytes)
            continue;
        const std::uint64_t size = whole_pages(entry.count * entry.element_bytes);
        if (size > file.size() - entry.offset) continue;
        entry.checksum = page_checksum(file.subspan(entry.offset, size), nobody_waits);
        std::memcpy(file.data() + at, &entry, sizeof(Entry));
    }
    head.checksum = head_checksum(head, file.first(head_bytes(head.section_count)));
    std::memcpy(file.data(), &head, sizeof(Head));
}

}  // namespace castor
