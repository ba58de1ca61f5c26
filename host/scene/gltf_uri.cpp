#include "scene/gltf_uri.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <system_error>

namespace castor {

namespace {

int hexadecimal(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

int sextet(char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+') return 62;
    return c == '/' ? 63 : -1;
}

bool is_same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace

std::optional<std::string> percent_decoded(std::string_view text) {
    std::string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            result += text[i];
            continue;
        }
        if (text.size() - i < 3) return std::nullopt;
        const int high = hexadecimal(text[i + 1]), low = hexadecimal(text[i + 2]);
        if (high < 0 || low < 0) return std::nullopt;
        result += static_cast<char>(16 * high + low);
        i += 2;
    }
    return result;
}

std::optional<std::string> base64_decoded(std::string_view text) {
    if (text.size() % 4 == 0 && text.ends_with('=')) text.remove_suffix(text.ends_with("==") ? 2 : 1);
    if (text.size() % 4 == 1) return std::nullopt;
    std::string result;
    result.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const int value = sextet(c);
        if (value < 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        count += 6;
        if (count < 8) continue;
        count -= 8;
        result += static_cast<char>(bits >> count & 255u);
    }
    return result;
}

bool is_data_uri(std::string_view uri) {
    constexpr std::string_view kScheme = "data:";
    return is_same_word(uri.substr(0, kScheme.size()), kScheme);
}

std::optional<std::string> data_of_uri(std::string_view uri) {
    constexpr std::string_view kBase64 = ";base64";
    const std::size_t comma = std::min(uri.find(','), uri.size());
    const std::string_view kind = uri.substr(0, comma), data = uri.substr(std::min(comma + 1, uri.size()));
    const bool is_base64 =
        kind.size() >= kBase64.size() && is_same_word(kind.substr(kind.size() - kBase64.size()), kBase64);
    if (!is_base64) return percent_decoded(data);
    if (data.find('%') == data.npos) return base64_decoded(data);
    const auto text = percent_decoded(data);
    return text ? base64_decoded(*text) : std::nullopt;
}

std::optional<std::filesystem::path> path_in_folder(const std::filesystem::path& folder, std::string_view text) {
    const std::filesystem::path path(text);
    if (path.has_root_path()) return std::nullopt;
    // Links are followed: what an archive unpacks may be a link to any file.
    std::error_code error;
    const std::filesystem::path root = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, error);
    if (error) return std::nullopt;
    const std::filesystem::path file = std::filesystem::weakly_canonical(root / path, error);
    if (error) return std::nullopt;
    const auto [end_of_root, in_file] = std::mismatch(root.begin(), root.end(), file.begin(), file.end());
    if (end_of_root != root.end()) return std::nullopt;
    return file;
}

}  // namespace castor
