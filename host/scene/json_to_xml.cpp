#include "scene/json_to_xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "castor/error.h"

namespace castor {

namespace {

constexpr std::size_t kDeepest = 100;

/// Reads a text and tells how far it has been read.
class TextIterator {
public:
    using iterator_category = std::input_iterator_tag;
    using value_type = char;
    using difference_type = std::ptrdiff_t;
    using pointer = const char*;
    using reference = const char&;

    TextIterator(const char* at, const char** last) : at_(at), last_(last) {}
    reference operator*() const { return *at_; }
    TextIterator& operator++() {
        *last_ = at_++;
        return *this;
    }
    bool operator==(const TextIterator& other) const { return at_ == other.at_; }
    bool operator!=(const TextIterator& other) const { return at_ != other.at_; }

private:
    const char* at_;
    const char** last_;  // the character that was read last
};

/// Counts the lines of a text up to places that come in order. Lines end with LF, CRLF or CR.
class LineCounter {
public:
    explicit LineCounter(std::string_view text) : at_(text.data()), end_(text.data() + text.size()) {}

    /// Returns the line of a place. A line's end belongs to it.
    std::size_t at(const char* place) {
        for (; at_ < place; ++at_)
            if (*at_ == '\n' || (*at_ == '\r' && (at_ + 1 == end_ || at_[1] != '\n'))) ++line_;
        return line_;
    }

private:
    const char* at_;
    const char* end_;
    std::size_t line_ = 1;
};

struct Node {
    std::string name;
    std::string text;
    std::size_t line = 1;
    std::size_t text_line = 0;       // 0: that of the node
    std::vector<Node> attributes{};  // of each only name, text and line
    std::vector<Node> children{};
};

bool is_name(std::string_view name) {
    const auto is_letter = [](unsigned char c) { return std::isalpha(c) || c == '_' || c >= 0x80; };
    return !name.empty() && is_letter(static_cast<unsigned char>(name[0])) &&
           std::all_of(name.begin(), name.end(),
                       [&](unsigned char c) { return is_letter(c) || std::isdigit(c) || c == '-' || c == '.'; });
}

/// Returns text for a message: printable, and shortened.
std::string excerpt(std::string_view text, std::size_t longest = 40) {
    std::string result(text.substr(0, longest));
    std::replace_if(
        result.begin(), result.end(), [](unsigned char c) { return !std::isprint(c); }, '?');
    return text.size() > longest ? result + "..." : result;
}

/// Makes a tree of elements from the events of the parser.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
public:
    TreeBuilder(const std::string& file, std::string_view text) : file_(file), lines_(text), last_(text.data()) {}

    const char** last() { return &last_; }
    Node& tree() { return root_; }

    bool null() override { return value(""); }
    bool boolean(bool is_true) override { return value(is_true ? "true" : "false"); }
    bool number_integer(number_integer_t number) override { return number_value(std::to_string(number)); }
    bool number_unsigned(number_unsigned_t number) override { return number_value(std::to_string(number)); }
    bool number_float(number_float_t, const string_t& text) override { return number_value(text); }
    bool string(string_t& text) override { return value(std::move(text)); }
    bool binary(binary_t&) override { return value(""); }

    bool start_object(std::size_t) override {
        if (open_.empty()) {
            open_.push_back({&root_});
        } else {
            if (const Level& level = open_.back(); is_attribute(level.key))
                fail(fmt::format("\"{}\" holds an object: a string was expected", excerpt(level.key)));
            open_.push_back({&add_child()});
        }
        if (open_.size() > kDeepest) fail(fmt::format("objects are nested more than {} deep", kDeepest));
        return true;
    }

    bool key(string_t& name) override {
        Level& level = open_.back();
        const std::size_t line = this->line();
        const auto [before, is_new] = level.keys.emplace(name, line);
        const std::string_view element = is_attribute(name) ? std::string_view(name).substr(1) : name;
        if (!is_new)
            fail(
                fmt::format("the key \"{}\" is in its object twice, before in line {}", excerpt(name), before->second));
        if (!is_name(element)) fail(fmt::format("the key \"{}\" is not the name of an element", excerpt(name)));
        level.key = std::move(name);
        return true;
    }

    bool end_object() override {
        open_.pop_back();
        return true;
    }

    bool start_array(std::size_t) override {
        if (open_.empty()) fail("begins with an array: an object with the key \"Scene\" was expected");
        Level& level = open_.back();
        if (level.is_array) fail(fmt::format("\"{}\" holds an array in an array", excerpt(level.key)));
        if (is_attribute(level.key) && level.key != "_data")
            fail(fmt::format("\"{}\" holds an array: a string was expected", excerpt(level.key)));
        level.is_array = true;
        level.list = nullptr;
        return true;
    }

    bool end_array() override {
        open_.back().is_array = false;
        return true;
    }

    bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& error) override {
        // The library's text is "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error …".
        std::string reason = error.what();
        if (reason.starts_with("[")) reason.erase(0, reason.find("] ") + 2);
        if (reason.starts_with("parse error at")) reason.erase(0, reason.find(": ") + 2);
        if (reason.find("unexpected end of input") != reason.npos ||
            reason.find("missing closing quote") != reason.npos)
            reason = "the file ends too early";
        else
            reason = fmt::format("is not well-formed JSON: {}", excerpt(reason, 200));
        fail(reason);
    }

private:
    /// An object that is being read.
    struct Level {
        Node* node;
        std::map<std::string, std::size_t> keys{};  // with their lines
        std::string key{};
        bool is_array = false;
        Node* list = nullptr;  // the child that holds the numbers of the array so far
    };

    std::size_t line() { return lines_.at(last_); }
    [[noreturn]] void fail(const std::string& reason) { throw SceneError(file_, line(), reason); }

    /// Returns whether a key of the innermost object is an attribute, or `_data`.
    bool is_attribute(std::string_view key) const { return open_.size() > 1 && key.starts_with("_"); }

    Node& add_child() {
        Level& level = open_.back();
        Node& child = level.node->children.emplace_back();
        child.name = level.key;
        child.line = line();
        level.list = nullptr;
        return child;
    }

    bool value(std::string text) {
        if (open_.empty()) fail("is a single value: an object with the key \"Scene\" was expected");
        if (text.find('\0') != text.npos) fail("a string has a zero byte");
        Level& level = open_.back();
        if (is_attribute(level.key) && level.key == "_data") {
            std::string& all = level.node->text;
            if (all.empty()) level.node->text_line = line();
            if (!all.empty()) all += ' ';
            all += text;
        } else if (is_attribute(level.key)) {
            level.node->attributes.push_back({level.key.substr(1), std::move(text), line()});
        } else {
            add_child().text = std::move(text);
        }
        return true;
    }

    bool number_value(std::string text) {
        if (open_.empty() || !open_.back().is_array || open_.back().key == "_data") return value(std::move(text));
        Level& level = open_.back();
        if (level.list == nullptr) {
            Node& child = add_child();
            level.list = &child;
            child.text = std::move(text);
        } else {
            level.list->text += ' ';
            level.list->text += text;
        }
        return true;
    }

    const std::string& file_;
    LineCounter lines_;
    const char* last_;
    Node root_;
    std::vector<Level> open_;
};

/// Writes the tree as XML.
class XmlWriter {
public:
    void write(const Node& node) {
        mark(node.line);
        out_.text += '<';
        out_.text += node.name;
        for (const Node& attribute : node.attributes) {
            mark(attribute.line);
            out_.text += fmt::format(" {}=\"", attribute.name);
            escape(attribute.text);
            out_.text += '"';
        }
        mark(node.text_line != 0 ? node.text_line : node.line);
        out_.text += '>';
        escape(node.text);
        for (const Node& child : node.children) write(child);
        out_.text += fmt::format("</{}>", node.name);
    }

    XmlFromJson take() { return std::move(out_); }

private:
    void mark(std::size_t line) {
        if (out_.places.empty() || out_.places.back().line != line) out_.places.push_back({out_.text.size(), line});
    }

    void escape(std::string_view text) {
        for (const char c : text) {
            if (c == '&')
                out_.text += "&amp;";
            else if (c == '<')
                out_.text += "&lt;";
            else if (c == '>')
                out_.text += "&gt;";
            else if (c == '"')
                out_.text += "&quot;";
            else
                out_.text += c;
        }
    }

    XmlFromJson out_;
};

}  // namespace

XmlFromJson json_to_xml(std::string_view json, const std::string& file) {
    TreeBuilder builder(file, json);
    const TextIterator begin(json.data(), builder.last()), end(json.data() + json.size(), builder.last());
    nlohmann::json::sax_parse(begin, end, &builder);
    std::vector<Node>& roots = builder.tree().children;
    // A file has one root, which is looked for first among the keys.
    const auto scene = std::find_if(roots.begin(), roots.end(), [](const Node& node) { return node.name == "Scene"; });
    if (scene == roots.end()) throw SceneError(file, 1, "has no key \"Scene\" in its outermost object");
    std::rotate(roots.begin(), scene, scene + 1);
    XmlWriter writer;
    for (const Node& root : roots) writer.write(root);
    return writer.take();
}

}  // namespace castor
