#include "remote/protocol.h"

namespace castor {

namespace {

void add(ByteWriter& writer, const std::vector<std::string>& texts) {
    writer.add(std::uint64_t{texts.size()});
    for (const std::string& text : texts) writer.add(std::string_view(text));
}

std::vector<std::string> take_texts(ByteReader& reader) {
    std::vector<std::string> texts;
    for (auto left = reader.take<std::uint64_t>(); left > 0; --left) texts.push_back(reader.take_text());
    return texts;
}

}  // namespace

Bytes bytes_of(const RankIntroduction& introduction) {
    ByteWriter writer;
    writer.add(std::string_view(introduction.version));
    writer.add(std::string_view(introduction.host));
    writer.add(std::string_view(introduction.failure));
    add(writer, introduction.workers);
    add(writer, introduction.faults);
    add(writer, introduction.warnings);
    return writer.take();
}

RankIntroduction introduction_of(std::span<const std::byte> bytes) {
    ByteReader reader(bytes);
    RankIntroduction introduction;
    introduction.version = reader.take_text();
    introduction.host = reader.take_text();
    introduction.failure = reader.take_text();
    introduction.workers = take_texts(reader);
    introduction.faults = take_texts(reader);
    introduction.warnings = take_texts(reader);
    reader.expect_end();
    if (introduction.faults.size() != introduction.workers.size())
        throw DeviceError("", "", 0, "introduced itself with faults of other workers than it has");
    return introduction;
}

Bytes bytes_of(const DeviceError& failure) {
    return ByteWriter().add(std::uint32_t{!failure.device().empty()}).add(std::string_view(failure.what())).take();
}

DeviceError failure_of(const std::string& name, std::span<const std::byte> bytes) {
    ByteReader reader(bytes);
    const bool has_name = reader.take<std::uint32_t>() != 0;
    const std::string text = reader.take_text();
    reader.expect_end();
    return DeviceError(has_name ? std::string() : name, "", 0, text);
}

Bytes bytes_of_text(std::string_view text) {
    return ByteWriter().add(text).take();
}

std::string text_of(std::span<const std::byte> bytes) {
    ByteReader reader(bytes);
    std::string text = reader.take_text();
    reader.expect_end();
    return text;
}

}  // namespace castor
