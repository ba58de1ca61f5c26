// Decodes PNG, JPEG, BMP, TGA and Radiance HDR with stb_image. Only this file includes that header.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <new>
#include <span>
#include <unordered_set>
#include <utility>

#include "castor/error.h"
#include "image/decode.h"
#include "image/jpeg_steps.h"

namespace castor {

namespace {

/// What stb_image has allocated in this thread. It is freed by whoever began the decoding, so that a file which ends
/// too early can end the decoding by an exception.
thread_local std::unordered_set<void*> blocks;

void* allocate(std::size_t size) {
    void* const block = std::malloc(size);
    if (block) blocks.insert(block);
    return block;
}

void release(void* block) {
    blocks.erase(block);
    std::free(block);
}

void* reallocate(void* block, std::size_t size) {
    if (!block) return allocate(size);
    auto known = blocks.extract(block);
    void* const larger = std::realloc(block, size);
    if (larger) known.value() = larger;
    blocks.insert(std::move(known));
    return larger;
}

struct FreeBlocks {
    ~FreeBlocks() {
        for (void* const block : blocks) std::free(block);
        blocks.clear();
    }
};

}  // namespace

}  // namespace castor

// Static, so that a program that links Castor may bring its own copy. Without SIMD: one decoder on all machines.
#define STBIDEF [[maybe_unused]] static
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_NO_STDIO
#define STBI_NO_SIMD
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_BMP
#define STBI_ONLY_TGA
#define STBI_ONLY_HDR
#define STBI_ASSERT(condition) ((void)0)
#define STBI_MALLOC(size) castor::allocate(size)
#define STBI_REALLOC(block, size) castor::reallocate(block, size)
#define STBI_FREE(block) castor::release(block)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wshadow"
#include <stb_image.h>
#pragma GCC diagnostic pop

namespace castor {

namespace {

/// A file that stb_image reads. stb_image itself takes what is behind the end for zeros, in some formats silently, in
/// others for ever.
class Source {
public:
    explicit Source(std::string_view bytes) : rest_(bytes) {}

    static int read(void* source, char* target, int size) {
        return static_cast<Source*>(source)->take(target, static_cast<std::size_t>(size));
    }
    static void skip(void* source, int size) {
        std::string_view& rest = static_cast<Source*>(source)->rest_;
        rest.remove_prefix(std::min(static_cast<std::size_t>(std::max(size, 0)), rest.size()));
    }
    static int is_at_end(void* source) { return static_cast<Source*>(source)->rest_.empty(); }

private:
    int take(char* target, std::size_t size) {
        // The first call fills stb_image's own buffer, and all that do so may get less than they ask for.
        if (!buffer_) buffer_ = target;
        const std::size_t count = std::min(size, rest_.size());
        if (count == 0 || (target != buffer_ && count < size)) throw Error("the file ends before its picture does");
        std::memcpy(target, rest_.data(), count);
        rest_.remove_prefix(count);
        return static_cast<int>(count);
    }

    std::string_view rest_;
    const char* buffer_ = nullptr;
};

constexpr stbi_io_callbacks kCallbacks{Source::read, Source::skip, Source::is_at_end};

struct Format {
    std::string_view name;
    std::string_view magic;
    // How far each compresses: PNG with one bit a texel and 1032 times by deflate, JPEG with one bit for 8x8 texels,
    // TGA and HDR with runs of 128 and 127.
    std::uint64_t most_texels_a_byte;
};

constexpr std::array<Format, 5> kFormats = {{
    {"PNG", "\x89PNG\r\n\x1a\n", 8 * 1032},
    {"JPEG", "\xff\xd8\xff", 8 * 64},
    {"BMP", "BM", 8},
    {"HDR", "#?RADIANCE\n", 127},
    {"HDR", "#?RGBE\n", 127},
}};
constexpr Format kTga{"TGA", "", 128};

const Format& format_of(std::string_view bytes, bool may_be_tga) {
    for (const Format& format : kFormats)
        if (bytes.starts_with(format.magic)) return format;
    const bool begins_as_tga = bytes.size() > 1 && (bytes[1] == 0 || bytes[1] == 1);  // without a palette, or with one
    if (may_be_tga && begins_as_tga) return kTga;
    throw Error(
        fmt::format("a picture in PNG, JPEG, WebP, BMP, HDR, EXR or TGA (named .tga) was expected, but the file "
                    "begins with {:02x}",
                    fmt::join(std::as_bytes(std::span(bytes.substr(0, 4))), " ")));
}

std::uint32_t big_endian_at(std::string_view bytes, std::size_t i) {
    std::uint32_t number = 0;
    for (const char c : bytes.substr(i, 4)) number = number << 8 | static_cast<unsigned char>(c);
    return number;
}

/// The checksum of PNG's chunks (ISO/IEC 15948, annex D).
std::uint32_t png_checksum(std::string_view bytes) {
    static const std::array<std::uint32_t, 256> kTable = [] {
        std::array<std::uint32_t, 256> table{};
        for (std::uint32_t i = 0; i < table.size(); ++i) {
            std::uint32_t sum = i;
            for (int bit = 0; bit < 8; ++bit) sum = (sum & 1 ? 0xedb88320u : 0u) ^ sum >> 1;
            table[i] = sum;
        }
        return table;
    }();
    std::uint32_t sum = 0xffffffffu;
    for (const char c : bytes) sum = kTable[(sum ^ static_cast<unsigned char>(c)) & 0xff] ^ sum >> 8;
    return ~sum;
}

/// Checks what stb_image takes on trust: that chunks are in the file, for which it asks memory, and not damaged.
void check_png_chunks(std::string_view bytes) {
    constexpr std::size_t kMagic = 8, kFrame = 12;  // a chunk's length, type and checksum
    for (std::size_t i = kMagic;;) {
        if (bytes.size() - i < kFrame || bytes.size() - i - kFrame < big_endian_at(bytes, i))
            throw Error("the file ends before its picture does");
        const std::size_t length = big_endian_at(bytes, i);
        const std::string_view type_and_data = bytes.substr(i + 4, 4 + length);
        if (png_checksum(type_and_data) != big_endian_at(bytes, i + 8 + length))
            throw Error(fmt::format("the PNG file is broken: the checksum of the chunk at byte {} is wrong", i));
        if (type_and_data.starts_with("IEND")) return;
        i += kFrame + length;
    }
}

/// Refuses Huffman tables of more than 256 codes, for which stb_image would write behind its own (ITU-T T.81, annex B).
void check_jpeg_tables(std::string_view bytes) {
    constexpr unsigned kTables = 0xc4, kScan = 0xda, kEnd = 0xd9, kFirstRestart = 0xd0;
    const auto byte_at = [&](std::size_t i) -> unsigned {
        return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0;
    };
    bool is_in_scan = false;  // where 0 and restart markers may follow 0xff
    for (std::size_t i = 2; i < bytes.size();) {
        const unsigned marker = byte_at(i + 1);
        const bool is_data = is_in_scan && (marker == 0 || (marker >= kFirstRestart && marker < kFirstRestart + 8));
        if (byte_at(i) != 0xff || marker == 0xff || is_data) {
            ++i;
            continue;
        }
        if (marker == kEnd) return;
        const std::size_t segment = i + 2, length = byte_at(segment) << 8 | byte_at(segment + 1);
        is_in_scan = marker == kScan;
        i = segment + length;
        for (std::size_t table = segment + 2; marker == kTables && table < i;) {
            std::size_t code_count = 0;
            for (std::size_t bits = 1; bits <= 16; ++bits) code_count += byte_at(table + bits);
            if (code_count > 256)
                throw Error(fmt::format("the JPEG file is broken: a Huffman table has {} codes, expected at most 256",
                                        code_count));
            table += 17 + code_count;
        }
    }
}

/// What stbi_load_from_callbacks does for JPEG, with other steps where decoders round (jpeg_steps.h).
stbi_uc* load_jpeg(const stbi_io_callbacks* callbacks, void* source, int* width, int* height, int* channels,
                   int wanted_channels) {
    stbi_io_callbacks own_callbacks = *callbacks;
    stbi__context context;
    stbi__start_callbacks(&context, &own_callbacks, source);
    stbi__jpeg* const decoder = static_cast<stbi__jpeg*>(allocate(sizeof(stbi__jpeg)));
    if (!decoder) throw std::bad_alloc();
    std::memset(decoder, 0, sizeof(stbi__jpeg));
    decoder->s = &context;
    stbi__setup_jpeg(decoder);
    decoder->idct_block_kernel = jpeg_inverse_dct;
    decoder->resample_row_hv_2_kernel = jpeg_double_row;
    decoder->YCbCr_to_RGB_kernel = jpeg_rgb_row;
    stbi_uc* const values = load_jpeg_image(decoder, width, height, channels, wanted_channels);
    release(decoder);
    return values;
}

[[noreturn]] void refuse(const Format& format) {
    throw Error(fmt::format("the {} file is broken: {}", format.name, stbi_failure_reason()));
}

}  // namespace

Image decode_stb(std::string_view bytes, bool may_be_tga) {
    const Format& format = format_of(bytes, may_be_tga);
    if (format.name == "PNG") {
        check_png_chunks(bytes);
        constexpr std::size_t kWidth = 16, kHeight = 20;  // after the magic bytes, and the first chunk's frame
        if (bytes.substr(12).starts_with("IHDR") && bytes.size() >= kHeight + 4)
            require_plausible_size(big_endian_at(bytes, kWidth), big_endian_at(bytes, kHeight), bytes.size(),
                                   format.most_texels_a_byte);
    }
    if (format.name == "JPEG") check_jpeg_tables(bytes);
    const FreeBlocks guard;
    int width = 0, height = 0, channels = 0;
    Source header(bytes);
    if (!stbi_info_from_callbacks(&kCallbacks, &header, &width, &height, &channels))
        throw Error(fmt::format("the header of the {} file is broken: {}", format.name, stbi_failure_reason()));
    require_plausible_size(static_cast<std::uint64_t>(std::max(width, 0)),
                           static_cast<std::uint64_t>(std::max(height, 0)), bytes.size(), format.most_texels_a_byte);

    Source source(bytes);
    Image image;
    const std::size_t value_count = std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const auto decode = [&](auto load, int kept_channels) {
        const auto* const first = load(&kCallbacks, &source, &width, &height, &channels, kept_channels);
        if (!first) refuse(format);
        return first;
    };
    constexpr int kRgb = 3, kRgba = 4;
    if (format.name == "HDR") {
        const float* const first = decode(stbi_loadf_from_callbacks, kRgb);
        image.floats.assign(first, first + value_count);
    } else if (format.name == "JPEG") {
        const stbi_uc* const first = decode(load_jpeg, kRgb);
        image.bytes.assign(first, first + value_count);
    } else {
        set_rgba(image, {decode(stbi_load_from_callbacks, kRgba), value_count / 3 * 4});
    }
    image.width = static_cast<std::uint32_t>(width);
    image.height = static_cast<std::uint32_t>(height);
    return image;
}

}  // namespace castor
