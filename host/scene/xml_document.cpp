#include "scene/xml_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>

#include "castor/error.h"

namespace castor {

namespace {

std::string read_text(const std::filesystem::path& file) {
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
        throw SceneError(file.string(), 0, "is a directory, not a scene file");
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw SceneError(file.string(), 0, fmt::format("cannot be opened: {}", std::strerror(errno)));
    constexpr std::size_t kChunk = std::size_t{1} << 16;
    std::string text;
    std::size_t size = 0;
    while (stream) {
        text.resize(std::max(size + kChunk, 2 * size));
        stream.read(text.data() + size, static_cast<std::streamsize>(text.size() - size));
        size += static_cast<std::size_t>(stream.gcount());
    }
    if (stream.bad()) throw SceneError(file.string(), 0, "cannot be read to its end");
    text.resize(size);
    return text;
}

/// Returns the offset of each line. Lines end with LF, CRLF or CR.
std::vector<std::size_t> find_line_starts(std::string_view text) {
    std::vector<std::size_t> starts{0};
    for (std::size_t i = text.find_first_of("\r\n"); i != text.npos; i = text.find_first_of("\r\n", i + 1)) {
        if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') ++i;
        starts.push_back(i + 1);
    }
    return starts;
}

bool contains(XmlNames names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the first character that is not white space; null if there is none.
const char* first_word(const char* text) {
    while (is_xml_space(*text)) ++text;
    return *text == '\0' ? nullptr : text;
}

bool is_text(pugi::xml_node node) {
    return node.type() == pugi::node_pcdata || node.type() == pugi::node_cdata;
}

}  // namespace

std::string xml_excerpt(std::string_view text) {
    constexpr std::size_t kLongest = 40;
    std::string excerpt;
    for (const char character : text) {
        if (is_xml_space(character) || character == '\0' || (character == '<' && !excerpt.empty())) break;
        if (excerpt.size() == kLongest) return excerpt + "...";
        excerpt += std::isprint(static_cast<unsigned char>(character)) ? character : '?';
    }
    return excerpt;
}

XmlDocument::XmlDocument(const std::filesystem::path& file, const Progress& progress)
    : file_(file), text_(read_text(file)), progress_(progress), total_bytes_(text_.size()) {
    line_starts_ = find_line_starts(text_);
    convert_json();
    parse();
    expect_single_root();
}

void XmlDocument::convert_json() {
    const std::string_view byte_order_mark = "\xef\xbb\xbf";
    std::size_t begin = text_.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
    while (begin < text_.size() && is_xml_space(text_[begin])) ++begin;
    if (begin == text_.size()) throw SceneError(file_.string(), 0, "is empty: a scene in XML or JSON was expected");
    if (const std::size_t zero = text_.find('\0'); zero != text_.npos)
        throw SceneError(file_.string(), line_at(zero),
                         fmt::format("byte {} is zero: this is neither XML nor JSON in UTF-8", zero));
    if (text_[begin] == '<') return;
    if (text_[begin] != '{' && text_[begin] != '[')
        throw SceneError(file_.string(), line_at(begin),
                         fmt::format("begins with '{}': a scene in XML or JSON was expected",
                                     xml_excerpt(text_.substr(begin, 100))));
    XmlFromJson xml = json_to_xml(text_, file_.string());
    text_ = std::move(xml.text);
    json_places_ = std::move(xml.places);
}

void XmlDocument::parse() {
    // Line ends are not converted, so that offsets in the text are offsets in the file.
    constexpr unsigned kOptions =
        pugi::parse_cdata | pugi::parse_escapes | pugi::parse_wconv_attribute | pugi::parse_fragment;
    const pugi::xml_parse_result result =
        document_.load_buffer_inplace(text_.data(), text_.size(), kOptions, pugi::encoding_utf8);
    if (result) return;
    const auto offset =
        std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0)), text_.size() - 1);
    // The text after the error has not been changed by the parser.
    const bool at_end = text_.find('>', offset) == text_.npos;
    throw SceneError(
        file_.string(), line_at(offset),
        at_end ? fmt::format("the file ends too early, or an element is not closed ({})", result.description())
               : fmt::format("is not well-formed XML: {}", result.description()));
}

void XmlDocument::expect_single_root() {
    const pugi::xml_node scene = root();
    if (!scene) throw SceneError(file_.string(), line_at(text_.size() - 1), "has no element: <Scene> was expected");
    if (scene.name() != std::string_view("Scene"))
        fail(scene, fmt::format("the root is <{}>: <Scene> was expected", scene.name()));
    for (const pugi::xml_node node : document_.children()) {
        if (const char* words = is_text(node) ? first_word(node.value()) : nullptr)
            warn(words, "text outside <Scene> is ignored");
        if (node.type() == pugi::node_element && node != scene)
            warn(node, fmt::format("<{}> outside <Scene> is ignored", node.name()));
    }
}

std::size_t XmlDocument::line_at(std::size_t offset) const {
    if (!json_places_.empty()) {
        const auto after = std::upper_bound(json_places_.begin(), json_places_.end(), offset,
                                            [](std::size_t value, const auto& place) { return value < place.offset; });
        return std::prev(after)->line;
    }
    const auto next = std::upper_bound(line_starts_.begin(), line_starts_.end(), offset);
    return static_cast<std::size_t>(next - line_starts_.begin());
}

bool XmlDocument::is_within(const char* text) const {
    // pugixml gives a constant for an empty value, and only std::less orders pointers into different objects.
    const std::less<const char*> before;
    const char* begin = text_.data();
    return !before(text, begin) && !before(begin + text_.size(), text);
}

std::size_t XmlDocument::line(const char* text) const {
    return is_within(text) ? line_at(static_cast<std::size_t>(text - text_.data())) : 0;
}

void XmlDocument::expect_file_bytes(std::uintmax_t bytes) {
    total_bytes_ = text_.size() + bytes;
}

void XmlDocument::reach(const char* text) const {
    if (!is_within(text)) return;
    text_passed_ = static_cast<std::uintmax_t>(text - text_.data());
    progress_.reach(static_cast<double>(text_passed_ + file_bytes_passed_) / static_cast<double>(total_bytes_));
}

Progress XmlDocument::next_file(std::uintmax_t bytes) {
    const auto share = [&] {
        return static_cast<double>(text_passed_ + file_bytes_passed_) / static_cast<double>(total_bytes_);
    };
    const double begin = share();
    file_bytes_passed_ += bytes;
    return progress_.part(begin, share());
}

void XmlDocument::fail(const char* text, const std::string& reason) const {
    throw SceneError(file_.string(), line(text), reason);
}

void XmlDocument::warn(const char* where, const std::string& text) {
    Notice& notice = notices_[text];
    const std::size_t here = line(where);
    if (notice.count == 0 || here < notice.line) notice.line = here;
    ++notice.count;
}

void XmlDocument::warn_unknown(pugi::xml_node element) {
    warn(element, fmt::format("<{}> is not known to Castor and is ignored", element.name()));
}

void XmlDocument::expect_children(pugi::xml_node element, XmlNames once, XmlNames repeated) {
    for (const pugi::xml_node child : element.children()) {
        if (is_text(child)) {
            if (const char* words = first_word(child.value()))
                warn(words, fmt::format("text in <{}> is ignored: '{}'", element.name(), xml_excerpt(words)));
            continue;
        }
        if (child.type() != pugi::node_element || contains(repeated, child.name())) continue;
        if (!contains(once, child.name()))
            warn_unknown(child);
        else if (child != element.child(child.name()))
            warn(child, fmt::format("<{}> occurs again in its <{}> and is ignored there: the first one counts",
                                    child.name(), element.name()));
    }
}

void XmlDocument::expect_text(pugi::xml_node element) {
    for (const pugi::xml_node child : element.children())
        if (child.type() == pugi::node_element) warn_unknown(child);
}

void XmlDocument::expect_attributes(pugi::xml_node element, XmlNames known) {
    for (const pugi::xml_attribute attribute : element.attributes()) {
        const std::string_view name = attribute.name();
        if (name == "id" || contains(known, name)) continue;
        warn(attribute.name(),
             fmt::format("the attribute {} of <{}> is not known to Castor and is ignored", name, element.name()));
    }
}

std::vector<Warning> XmlDocument::warnings() const {
    std::vector<Warning> warnings;
    for (const auto& [text, notice] : notices_)
        warnings.push_back(
            {file_.string(), notice.line,
             notice.count == 1 ? text : fmt::format("{} ({} times, the first here)", text, notice.count)});
    std::stable_sort(warnings.begin(), warnings.end(),
                     [](const Warning& a, const Warning& b) { return a.line < b.line; });
    return warnings;
}

}  // namespace castor
