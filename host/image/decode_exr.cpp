// OpenEXR through tinyexr. tinyexr takes much of a file on trust, so this file checks first what tinyexr will find
// ("The OpenEXR File Layout", openexr.com): the header's attributes, and where each chunk of lines begins and ends.
#include <fmt/format.h>
#include <tinyexr.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "castor/error.h"
#include "image/decode.h"

namespace castor {

namespace {

constexpr std::string_view kMagic("\x76\x2f\x31\x01", 4);

/// Takes numbers and texts from the front of a file.
class Reader {
public:
    explicit Reader(std::string_view bytes) : rest_(bytes) {}

    std::string_view take(std::size_t size) {
        if (size > rest_.size()) throw Error("the file ends before its picture does");
        const std::string_view bytes = rest_.substr(0, size);
        rest_.remove_prefix(size);
        return bytes;
    }

    /// Takes a text up to the zero that ends it.
    std::string_view take_text() {
        constexpr std::size_t kLongest = 255;
        const std::size_t length = rest_.substr(0, kLongest + 1).find('\0');
        if (length == std::string_view::npos) throw Error("the header of the EXR file is broken: a name without end");
        const std::string_view text = take(length);
        take(1);
        return text;
    }

    template <class T>
    T take_number() {
        T number;
        std::memcpy(&number, take(sizeof(T)).data(), sizeof(T));
        return number;
    }

    std::size_t remaining() const { return rest_.size(); }

private:
    std::string_view rest_;
};

struct Channel {
    std::string name;
    std::int32_t type = 0, x_sampling = 0, y_sampling = 0;
};

struct Header {
    std::vector<Channel> channels;
    int compression = 0;
    std::int32_t min_x = 0, min_y = 0, max_x = 0, max_y = 0;

    std::int64_t width() const { return std::int64_t{max_x} - min_x + 1; }
    std::int64_t height() const { return std::int64_t{max_y} - min_y + 1; }
};

/// How many lines a chunk has, for each compression that tinyexr knows.
std::int64_t lines_a_chunk(int compression) {
    switch (compression) {
        case TINYEXR_COMPRESSIONTYPE_NONE:
        case TINYEXR_COMPRESSIONTYPE_RLE:
        case TINYEXR_COMPRESSIONTYPE_ZIPS:
            return 1;
        case TINYEXR_COMPRESSIONTYPE_ZIP:
            return 16;
        case TINYEXR_COMPRESSIONTYPE_PIZ:
            return 32;
        default:
            throw Error(
                fmt::format("the EXR file is compressed by method {}; there are 0 (none), 1 (RLE), 2 (ZIPS), 3 "
                            "(ZIP) and 4 (PIZ)",
                            compression));
    }
}

std::vector<Channel> take_channels(Reader value) {
    std::vector<Channel> channels;
    while (true) {
        Channel channel{std::string(value.take_text())};
        if (channel.name.empty()) return channels;
        channel.type = value.take_number<std::int32_t>();
        value.take(4);  // how it was to be displayed, and what is reserved
        channel.x_sampling = value.take_number<std::int32_t>();
        channel.y_sampling = value.take_number<std::int32_t>();
        channels.push_back(channel);
    }
}

Header take_header(Reader& file) {
    file.take(kMagic.size());
    const auto version = file.take_number<std::uint32_t>();
    if ((version & 0xffu) != 2) throw Error(fmt::format("the EXR file has version {}, expected 2", version & 0xffu));
    constexpr std::uint32_t kLongNames = 0x400;
    if ((version & ~(0xffu | kLongNames)) != 0)
        throw Error("the EXR file is tiled, deep or has several parts; expected one picture in lines");
    Header header;
    bool has_channels = false, has_compression = false, has_window = false;
    for (std::string_view name = file.take_text(); !name.empty(); name = file.take_text()) {
        file.take_text();  // the type, which the name implies
        const auto size = file.take_number<std::uint32_t>();
        Reader value(file.take(size));
        if (name == "channels") {
            header.channels = take_channels(value);
            has_channels = true;
        } else if (name == "compression") {
            header.compression = value.take_number<std::uint8_t>();
            has_compression = true;
        } else if (name == "dataWindow") {
            for (std::int32_t* edge : {&header.min_x, &header.min_y, &header.max_x, &header.max_y})
                *edge = value.take_number<std::int32_t>();
            has_window = true;
        }
    }
    if (!has_channels || !has_compression || !has_window)
        throw Error("the header of the EXR file is broken: channels, compression or dataWindow is missing");
    return header;
}

void check_header(const Header& header, std::size_t byte_count) {
    // By deflate, a byte becomes 1032, and two of them are a value.
    constexpr std::uint64_t kMostValuesAByte = 1032 / 2;
    const auto width = static_cast<std::uint64_t>(std::max<std::int64_t>(header.width(), 0));
    const auto height = static_cast<std::uint64_t>(std::max<std::int64_t>(header.height(), 0));
    require_plausible_size(width, height, byte_count, kMostValuesAByte);
    // Of each channel there are as many values as texels.
    if (header.channels.size() > byte_count * kMostValuesAByte / (width * height))
        throw Error(fmt::format("the header says {} channels of {}x{} values, but a file of {} bytes has at most {}",
                                header.channels.size(), width, height, byte_count, byte_count * kMostValuesAByte));
    constexpr std::int64_t kFarthest = 1 << 20;  // tinyexr's own limit for the numbers of lines
    for (const std::int64_t edge : {header.min_x, header.min_y, header.max_x, header.max_y})
        if (std::abs(edge) > kFarthest)
            throw Error(fmt::format("the EXR file's dataWindow reaches to {}, expected at most {}", edge, kFarthest));
    for (const Channel& channel : header.channels) {
        if (channel.x_sampling != 1 || channel.y_sampling != 1)
            throw Error(fmt::format("the channel \"{}\" of the EXR file has fewer values than the picture has texels",
                                    channel.name));
        if (channel.type != TINYEXR_PIXELTYPE_HALF && channel.type != TINYEXR_PIXELTYPE_FLOAT &&
            channel.type != TINYEXR_PIXELTYPE_UINT)
            throw Error(fmt::format("the channel \"{}\" of the EXR file has type {}; there are 0 to 2", channel.name,
                                    channel.type));
    }
}

std::uint64_t bytes_a_line(const Header& header) {
    std::uint64_t bytes = 0;
    for (const Channel& channel : header.channels)
        bytes += static_cast<std::uint64_t>(header.width()) * (channel.type == TINYEXR_PIXELTYPE_HALF ? 2 : 4);
    return bytes;
}

/// Checks the sizes in a chunk of PIZ: of the bitmap of values in use, and of the Huffman code of `bits` bits behind
/// it.
void check_piz(Reader chunk) {
    constexpr std::uint16_t kBitmapSize = 8192;
    constexpr std::uint32_t kCodeHeader = 20;
    const auto first = chunk.take_number<std::uint16_t>(), last = chunk.take_number<std::uint16_t>();
    bool is_good = last < kBitmapSize;
    if (is_good && first <= last) chunk.take(last - first + 1u);
    const auto length = is_good ? chunk.take_number<std::uint32_t>() : 0;
    is_good = is_good && length >= kCodeHeader && length <= chunk.remaining();
    if (is_good) {
        chunk.take(12);  // the first and last code, and the size of their table
        is_good = chunk.take_number<std::uint32_t>() <= (length - kCodeHeader) * std::uint64_t{8};
    }
    if (!is_good) throw Error("the EXR file is broken: a chunk of lines that is compressed by PIZ has wrong sizes");
}

/// Checks that each chunk of lines is there, lies in the file, and begins with the line that it should.
void check_chunks(const Header& header, Reader table, std::string_view bytes) {
    const std::int64_t lines = lines_a_chunk(header.compression);
    const std::int64_t count = (header.height() + lines - 1) / lines;
    std::vector<bool> is_there(static_cast<std::size_t>(count));
    const std::size_t first_chunk = bytes.size() - table.remaining() + static_cast<std::size_t>(count) * 8;
    for (std::int64_t i = 0; i < count; ++i) {
        const auto offset = table.take_number<std::uint64_t>();
        if (offset >= bytes.size()) throw Error("the file ends before its picture does");
        if (offset < first_chunk) throw Error("the EXR file is broken: a chunk of lines is missing");
        Reader chunk(bytes.substr(offset));
        const std::int64_t line = std::int64_t{chunk.take_number<std::int32_t>()} - header.min_y;
        const auto size = chunk.take_number<std::uint32_t>();
        const std::string_view data = chunk.take(size);
        const bool is_good = line >= 0 && line < header.height() && line % lines == 0 && size > 0;
        if (!is_good || is_there[static_cast<std::size_t>(line / lines)])
            throw Error(fmt::format("the EXR file is broken: chunk {} of lines begins with line {} of {}", i + 1, line,
                                    header.height()));
        is_there[static_cast<std::size_t>(line / lines)] = true;
        const auto line_count = static_cast<std::uint64_t>(std::min(lines, header.height() - line));
        const bool is_stored = size == line_count * bytes_a_line(header);
        if (header.compression == TINYEXR_COMPRESSIONTYPE_PIZ && !is_stored) check_piz(Reader(data));
    }
}

struct ExrFile {
    EXRHeader header;
    EXRImage image;

    ExrFile() {
        InitEXRHeader(&header);
        InitEXRImage(&image);
    }
    ~ExrFile() {
        FreeEXRImage(&image);
        FreeEXRHeader(&header);
    }
    ExrFile(const ExrFile&) = delete;
    ExrFile& operator=(const ExrFile&) = delete;
};

void require_success(int status, const char* message) {
    if (status == TINYEXR_SUCCESS) return;
    std::string text = message ? message : fmt::format("status {}", status);
    FreeEXRErrorMessage(message);
    while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
    throw Error("the EXR file is broken: " + text);
}

void load(ExrFile& file, std::string_view bytes) {
    const auto* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    EXRVersion version;
    const char* message = nullptr;
    require_success(ParseEXRVersionFromMemory(&version, data, bytes.size()), message);
    require_success(ParseEXRHeaderFromMemory(&file.header, &version, data, bytes.size(), &message), message);
    for (int i = 0; i < file.header.num_channels; ++i)
        if (file.header.pixel_types[i] == TINYEXR_PIXELTYPE_HALF)
            file.header.requested_pixel_types[i] = TINYEXR_PIXELTYPE_FLOAT;
    // tinyexr itself frees the planes of a broken file, as many as the image says that there are.
    file.image.num_channels = file.header.num_channels;
    const int status = LoadEXRImageFromMemory(&file.image, &file.header, data, bytes.size(), &message);
    if (status != TINYEXR_SUCCESS) InitEXRImage(&file.image);
    require_success(status, message);
}

/// Returns where R, G and B are among the channels: all three are the only channel of a grey picture.
std::array<std::size_t, 3> colour_channels(const Header& header) {
    const auto find = [&](std::string_view name) -> std::optional<std::size_t> {
        for (std::size_t i = 0; i < header.channels.size(); ++i)
            if (header.channels[i].name == name && header.channels[i].type != TINYEXR_PIXELTYPE_UINT) return i;
        return std::nullopt;
    };
    if (const auto red = find("R"), green = find("G"), blue = find("B"); red && green && blue)
        return {*red, *green, *blue};
    if (const auto grey = find("Y"); grey && !find("RY") && !find("BY")) return {*grey, *grey, *grey};
    if (header.channels.size() == 1 && header.channels[0].type != TINYEXR_PIXELTYPE_UINT) return {0, 0, 0};
    std::vector<std::string> names;
    for (const Channel& channel : header.channels) names.push_back(channel.name);
    throw Error(fmt::format("the EXR file has the channels \"{}\", expected floats R, G and B, or Y, or one alone",
                            fmt::join(names, "\", \"")));
}

}  // namespace

bool is_exr(std::string_view bytes) {
    return bytes.starts_with(kMagic);
}

Image decode_exr(std::string_view bytes) {
    Reader reader(bytes);
    const Header header = take_header(reader);
    check_header(header, bytes.size());
    check_chunks(header, reader, bytes);
    const std::array<std::size_t, 3> channels = colour_channels(header);
    ExrFile file;
    load(file, bytes);
    if (file.image.width != header.width() || file.image.height != header.height() ||
        file.image.num_channels != static_cast<int>(header.channels.size()) || !file.image.images)
        throw Error("the header of the EXR file is broken: an attribute stands twice");
    Image image;
    image.width = static_cast<std::uint32_t>(header.width());
    image.height = static_cast<std::uint32_t>(header.height());
    const std::size_t texel_count = std::size_t{image.width} * image.height;
    image.floats.resize(texel_count * 3);
    for (std::size_t c = 0; c < 3; ++c) {
        const auto* const plane = reinterpret_cast<const float*>(file.image.images[channels[c]]);
        for (std::size_t i = 0; i < texel_count; ++i) image.floats[3 * i + c] = plane[i];
    }
    return image;
}

}  // namespace castor
