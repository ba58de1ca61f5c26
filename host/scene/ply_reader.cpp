#include "scene/ply_reader.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "base/mapped_file.h"
#include "castor/error.h"
#include "scene/ply_codec.h"

namespace castor {

namespace {

// The records of an element are cut into blocks, which are decoded in parallel. The beginnings of the blocks are
// guessed first: from the size of a record (binary) or from the ends of lines (ASCII), assuming that every face has as
// many vertices as the first. Decoding checks the guess, since each block must end where the next one begins. If the
// guess is wrong, one sequential pass over the records finds the blocks, the number of triangles before each, and any
// error in the file. Progress is counted in bytes of the file; the sequential pass then counts for half of its element.
// The pages of the file are released as soon as they have been read, so that memory holds the arrays and a few blocks.

/// Progress is reported once in this number of records.
constexpr std::uint64_t kOften = 1 << 14;
constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kNoList = 0;

struct Block {
    std::uint64_t first_record;
    std::uint64_t record_count;
    std::uint64_t first_triangle;
    const char* begin;
    const char* end;  // where the next record begins; null: not known, so not checked
};

// The use of a property: none, a number of a vertex (0 to 7: x y z nx ny nz u v), or the list of vertices of a face.
constexpr int kUnused = -1;
constexpr int kFirstNormal = 3;
constexpr int kFirstTextureCoordinate = 6;
constexpr int kIndices = 8;
constexpr std::array<const char*, 6> kVertexFields = {"x", "y", "z", "nx", "ny", "nz"};
constexpr std::array<std::array<const char*, 2>, 3> kTextureCoordinateNames = {
    {{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}}};

struct Field {
    PlyProperty property;
    int use = kUnused;
};

/// The reason for which a record cannot be used, with the value and the field that some kinds name.
struct Fault {
    enum class Kind { none, truncated, not_a_number, list_length, not_finite, index, other_length } kind = Kind::none;
    std::int64_t value = 0;
    const Field* field = nullptr;

    explicit operator bool() const { return kind != Kind::none; }
};

Fault to_fault(PlyFault fault, const Field& field) {
    if (fault == PlyFault::none) return {};
    return {fault == PlyFault::truncated ? Fault::Kind::truncated : Fault::Kind::not_a_number, 0, &field};
}

bool is_float(double value) {
    return std::abs(value) <= std::numeric_limits<float>::max();  // false for NaN
}

/// Returns the normal as `Mesh` has it: of length one, or zero if the one of the file has no direction.
glm::vec3 unit_or_zero(const double* normal) {
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    if (!(length > 0.0) || std::isinf(length)) return glm::vec3(0.0f);
    return {normal[0] / length, normal[1] / length, normal[2] / length};
}

/// Returns the texture coordinates of a vertex; (0, 0) if they are not finite.
glm::vec2 finite_or_zero(const double* pair) {
    return is_float(pair[0]) && is_float(pair[1]) ? glm::vec2(pair[0], pair[1]) : glm::vec2(0.0f);
}

/// Resizes `values`. Asks the system for huge pages before the memory is first touched: many gigabytes of small pages
/// take it longer than reading the file.
template <class T>
void resize(std::vector<T>& values, std::uint64_t count) {
    values.reserve(count);
#ifdef MADV_HUGEPAGE
    constexpr std::uintptr_t kPage = 4096;
    const auto begin = reinterpret_cast<std::uintptr_t>(values.data() + values.size()) / kPage * kPage + kPage;
    const auto end = reinterpret_cast<std::uintptr_t>(values.data() + count) / kPage * kPage;
    if (begin < end)
        ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);  // only advice, which may fail
#endif
    values.resize(count);
}

template <class Codec>
class PlyBody {
public:
    PlyBody(const MappedFile& mapped, const PlyHeader& header, const std::string& file, Codec codec,
            const Progress& progress, std::uint64_t block_records)
        : mapped_(mapped),
          bytes_(mapped.bytes()),
          header_(header),
          file_(file),
          codec_(codec),
          progress_(progress),
          block_records_(block_records),
          at_(bytes_.data() + header.bytes) {}

    Mesh read() {
        for (const PlyElement& element : header_.elements) {
            if (element.name == "vertex") vertex_count_ = element.count;
        }
        if (vertex_count_ >= std::numeric_limits<std::uint32_t>::max()) {
            throw SceneError(file_, 0, fmt::format("{} vertices: a mesh has at most 2^32 - 2", vertex_count_));
        }
        for (const PlyElement& element : header_.elements) read_element(element);
        check_end();
        return std::move(mesh_);
    }

private:
    void read_element(const PlyElement& element) {
        element_ = &element;
        at_ = codec_.skip_space(at_);  // so that a message names the line of a record
        fields_.clear();
        plain_bytes_ = 0;
        for (const PlyProperty& property : element.properties) fields_.push_back({property});
        if (element.count == 0) return;
        if (element.name == "vertex") {
            read_vertices();
        } else if (element.name == "face") {
            use_index_list();
            read_faces();
        } else if (element.name == "tristrips") {
            use_index_list();
            read_strips();
        } else {
            skip_element();
        }
    }

    // ---- Which property is what

    Field* find_field(std::string_view name) {
        for (Field& field : fields_) {
            if (field.property.name == name) return &field;
        }
        return nullptr;
    }

    /// Marks x y z, and nx ny nz if there are all three. Returns whether there are normals.
    bool use_vertex_fields() {
        std::array<Field*, 6> found;
        for (int i = 0; i < 6; ++i) {
            found[i] = find_field(kVertexFields[i]);
            if (found[i] != nullptr && found[i]->property.is_list) found[i] = nullptr;
            if (i < 3 && found[i] == nullptr) {
                throw SceneError(file_, element_->line,
                                 fmt::format("the vertices have no number named '{}'", kVertexFields[i]));
            }
        }
        const bool has_normals = found[3] != nullptr && found[4] != nullptr && found[5] != nullptr;
        for (int i = 0; i < (has_normals ? kFirstTextureCoordinate : kFirstNormal); ++i) found[i]->use = i;
        return has_normals;
    }

    /// Marks the texture coordinates. Returns whether there are any.
    bool use_texture_coordinates() {
        for (const auto& [u_name, v_name] : kTextureCoordinateNames) {
            Field *u = find_field(u_name), *v = find_field(v_name);
            if (u == nullptr || v == nullptr || u->property.is_list || v->property.is_list) continue;
            u->use = kFirstTextureCoordinate;
            v->use = kFirstTextureCoordinate + 1;
            return true;
        }
        return false;
    }

    void use_index_list() {
        Field* list = find_field("vertex_indices");
        if (list == nullptr) list = find_field("vertex_index");
        if (list == nullptr || !list->property.is_list || !is_integer(list->property.type)) {
            throw SceneError(
                file_, element_->line,
                fmt::format("the element '{}' has no list of integers named vertex_indices", element_->name));
        }
        list->use = kIndices;
    }

    // ---- Fast paths for the most common binary layouts. They return false if the layout differs or a value is
    // invalid; the caller then uses the general reader, which also reports the error.

    /// Finds out whether the fields are x, y, z of type float32, no normals, and others of a fixed size.
    void find_plain_vertex() {
        std::size_t offset = 0;
        for (const Field& field : fields_) {
            const bool fits = field.use == kUnused || (field.use < 3 && field.property.type == PlyType::float32);
            if (field.property.is_list || !fits) return;
            if (field.use != kUnused) plain_offsets_[static_cast<std::size_t>(field.use)] = offset;
            offset += size_of(field.property.type);
        }
        plain_bytes_ = offset;
    }

    /// Finds out whether the only field is a list of 32-bit indices with a length of one byte.
    void find_plain_triangle() {
        const PlyProperty& list = fields_[0].property;
        const bool is_32_bits = list.type == PlyType::int32 || list.type == PlyType::uint32;
        if (fields_.size() > 1 || list.count_type != PlyType::uint8 || !is_32_bits) return;
        if (vertex_count_ <= std::uint64_t{1} << 31)
            plain_bytes_ = 13;  // so that a negative index reads as one past the vertices
    }

    bool read_plain_vertex(const char*& at, glm::vec3& position) const {
        if constexpr (std::is_same_v<Codec, PlyBinary>) {
            if (plain_bytes_ == 0 || static_cast<std::size_t>(file_end() - at) < plain_bytes_) return false;
            for (int i = 0; i < 3; ++i) {
                position[i] = std::bit_cast<float>(codec_.bits32(at + plain_offsets_[static_cast<std::size_t>(i)]));
                if (!is_float(position[i])) return false;
            }
            at += plain_bytes_;
            return true;
        }
        return false;
    }

    bool read_plain_triangle(const char*& at, glm::uvec3& triangle) const {
        if constexpr (std::is_same_v<Codec, PlyBinary>) {
            if (plain_bytes_ == 0 || static_cast<std::size_t>(file_end() - at) < plain_bytes_ || *at != 3) return false;
            const glm::uvec3 indices(codec_.bits32(at + 1), codec_.bits32(at + 5), codec_.bits32(at + 9));
            if (std::max({indices.x, indices.y, indices.z}) >= vertex_count_) return false;
            triangle = indices;
            at += plain_bytes_;
            return true;
        }
        return false;
    }

    // ---- One record

    /// Reads the length of a list.
    Fault read_length(const char*& at, const Field& field, std::uint64_t& length) const {
        std::int64_t value = 0;
        if (const Fault fault = to_fault(codec_.integer(at, field.property.count_type, value), field)) return fault;
        if (value < 0) return {Fault::Kind::list_length, value, &field};
        length = static_cast<std::uint64_t>(value);
        return {};
    }

    Fault skip_field(const char*& at, const Field& field) const {
        std::uint64_t length = 1;
        if (field.property.is_list) {
            if (const Fault fault = read_length(at, field, length)) return fault;
        }
        return to_fault(codec_.skip(at, field.property.type, length), field);
    }

    /// Skips one record. Sets `length` to that of its index list, if it has one.
    Fault walk_record(const char*& at, std::uint64_t& length) const {
        for (const Field& field : fields_) {
            if (field.use == kIndices) {
                if (const Fault fault = read_length(at, field, length)) return fault;
                if (const Fault fault = to_fault(codec_.skip(at, field.property.type, length), field)) return fault;
            } else if (const Fault fault = skip_field(at, field)) {
                return fault;
            }
        }
        return {};
    }

    Fault read_vertex(const char*& at, std::uint64_t index) {
        if (read_plain_vertex(at, mesh_.positions[index])) return {};
        double values[kIndices] = {};
        for (const Field& field : fields_) {
            if (field.use == kUnused) {
                if (const Fault fault = skip_field(at, field)) return fault;
                continue;
            }
            double& value = values[field.use];
            if (const Fault fault = to_fault(codec_.scalar(at, field.property.type, value), field)) return fault;
            if (field.use < kFirstNormal && !is_float(value)) return {Fault::Kind::not_finite, 0, &field};
        }
        mesh_.positions[index] = {values[0], values[1], values[2]};
        if (!mesh_.normals.empty()) mesh_.normals[index] = unit_or_zero(values + kFirstNormal);
        if (!mesh_.texture_coordinates.empty())
            mesh_.texture_coordinates[index] = finite_or_zero(values + kFirstTextureCoordinate);
        return {};
    }

    Fault read_index(const char*& at, const Field& field, std::uint32_t& index) const {
        std::int64_t value = 0;
        if (const Fault fault = to_fault(codec_.integer(at, field.property.type, value), field)) return fault;
        if (value < 0 || static_cast<std::uint64_t>(value) >= vertex_count_) return {Fault::Kind::index, value, &field};
        index = static_cast<std::uint32_t>(value);
        return {};
    }

    /// Writes the triangles of one face from the place `triangle` on, and moves it past them. If `expected_length` is
    /// not kNone, another number of vertices is a fault.
    Fault read_face(const char*& at, std::uint64_t& triangle, std::uint64_t expected_length) {
        if (expected_length == 3 && read_plain_triangle(at, mesh_.triangles[triangle])) {
            ++triangle;
            return {};
        }
        for (const Field& field : fields_) {
            if (field.use != kIndices) {
                if (const Fault fault = skip_field(at, field)) return fault;
                continue;
            }
            std::uint64_t length = 0;
            if (const Fault fault = read_length(at, field, length)) return fault;
            if (expected_length != kNone && length != expected_length) return {Fault::Kind::other_length, 0, &field};
            glm::uvec3 fan(0);
            for (std::uint64_t k = 0; k < length; ++k) {
                std::uint32_t index = 0;
                if (const Fault fault = read_index(at, field, index)) return fault;
                if (k == 0) fan.x = index;
                fan.y = fan.z;
                fan.z = index;
                if (k >= 2) mesh_.triangles[triangle++] = fan;
            }
        }
        return {};
    }

    // ---- Blocks

    /// Returns the length of the index list of the first record; 0 if it cannot be read.
    std::uint64_t first_length() const {
        const char* at = at_;
        std::uint64_t length = 0;
        return walk_record(at, length) ? 0 : length;
    }

    /// Returns the bytes of a record in a binary file if each index list has `length` values; nullopt if its size
    /// varies.
    std::optional<std::uint64_t> stride(std::uint64_t length) const {
        std::uint64_t bytes = 0;
        for (const Field& field : fields_) {
            const PlyProperty& property = field.property;
            if (property.is_list && field.use != kIndices) return std::nullopt;
            bytes += property.is_list ? size_of(property.count_type) + length * size_of(property.type)
                                      : size_of(property.type);
        }
        return bytes;
    }

    /// Returns the blocks under the assumption that each record takes the same number of bytes, or one line, and each
    /// index list has `length` values; nullopt if the file is too short for that.
    std::optional<std::vector<Block>> guess_blocks(std::uint64_t length) const {
        const std::uint64_t count = element_->count, triangles_each = std::max<std::uint64_t>(length, 2) - 2;
        const auto left = static_cast<std::uint64_t>(file_end() - at_);
        if constexpr (std::is_same_v<Codec, PlyBinary>) {
            const std::optional<std::uint64_t> stride = this->stride(length);
            if (!stride || *stride == 0 || count > left / *stride) return std::nullopt;
            return cut(count, triangles_each,
                       [&](const char* begin, std::uint64_t records) { return begin + records * *stride; });
        } else {
            // A value takes at least a digit and a separator; the last one may lack the separator.
            std::uint64_t values = fields_.size();
            for (const Field& field : fields_) values += field.use == kIndices ? length : 0;
            if (count > (left + 1) / (2 * values)) return std::nullopt;
            return cut(count, triangles_each, [&](const char* begin, std::uint64_t lines) {
                const char* end = skip_lines(begin, lines);
                if (end != nullptr) mapped_.release(begin, end);
                return end;
            });
        }
    }

    template <class Advance>
    std::optional<std::vector<Block>> cut(std::uint64_t count, std::uint64_t triangles_each,
                                          const Advance& advance) const {
        std::vector<Block> blocks;
        const char* begin = at_;
        for (std::uint64_t first = 0; first < count; first += block_records_) {
            const std::uint64_t records = std::min(block_records_, count - first);
            const char* end = advance(begin, records);
            if (end == nullptr) return std::nullopt;
            blocks.push_back({first, records, first * triangles_each, begin, end});
            begin = end;
        }
        blocks.back().end = nullptr;  // the last line may have no end, or the next element may begin on it
        return blocks;
    }

    const char* skip_lines(const char* at, std::uint64_t lines) const {
        for (; lines > 0; --lines) {
            if (at == file_end()) return nullptr;
            const void* line_end = std::memchr(at, '\n', static_cast<std::size_t>(file_end() - at));
            at = line_end == nullptr ? file_end() : static_cast<const char*>(line_end) + 1;
        }
        return at;
    }

    /// Finds the blocks by a pass over all records. Sets `triangle_count` to the number of triangles of all records.
    /// Throws SceneError if a record cannot be skipped.
    std::vector<Block> find_blocks(std::uint64_t& triangle_count) const {
        std::vector<Block> blocks;
        const char* at = at_;
        triangle_count = 0;
        std::uint64_t next_block = 0;
        for (std::uint64_t record = 0; record < element_->count; ++record) {
            if (record == next_block) {
                next_block += block_records_;
                if (!blocks.empty()) {
                    blocks.back().end = codec_.skip_space(at);
                    mapped_.release(blocks.back().begin, at);
                    progress_.reach(0.5 * (share_at(at_) + share_at(at)));
                }
                blocks.push_back(
                    {record, std::min(block_records_, element_->count - record), triangle_count, at, nullptr});
            }
            std::uint64_t length = 0;
            if (const Fault fault = walk_record(at, length)) fail(fault, record, at);
            if (length > 2) triangle_count += length - 2;
        }
        return blocks;
    }

    /// Decodes all blocks in parallel, by `read_record(at, record, triangle)` for each record. Returns kNone on success
    /// and moves past the element. Otherwise returns the first record with a fault, or the first record of a block that
    /// does not end where the next one begins; the result does not depend on the number of threads. The progress so far
    /// is `begin_share`.
    template <class ReadRecord>
    std::uint64_t decode(const std::vector<Block>& blocks, const ReadRecord& read_record, double begin_share) {
        std::atomic<std::uint64_t> first_bad{kNone};
        const char* element_end = nullptr;  // written by the last block only
        ProgressCount done(progress_.part(begin_share, share_at(blocks.back().begin)), blocks.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 1), [&](const auto& range) {
            for (std::size_t b = range.begin(); b < range.end(); ++b) {
                const Block& block = blocks[b];
                const char* at = block.begin;
                std::uint64_t triangle = block.first_triangle;
                std::uint64_t bad = kNone;
                for (std::uint64_t i = 0; i < block.record_count && bad == kNone; ++i) {
                    if (read_record(at, block.first_record + i, triangle)) bad = block.first_record + i;
                }
                if (bad == kNone && block.end != nullptr && codec_.skip_space(at) != codec_.skip_space(block.end)) {
                    bad = block.first_record;
                }
                if (b + 1 == blocks.size()) element_end = at;
                mapped_.release(block.begin, at);
                done.add(1);
                std::uint64_t seen = first_bad.load();
                while (bad < seen && !first_bad.compare_exchange_weak(seen, bad)) {
                }
            }
        });
        if (first_bad == kNone) at_ = element_end;
        return first_bad;
    }

    /// Decodes blocks that `find_blocks` found. Throws SceneError for the first record with a fault.
    template <class ReadRecord>
    void decode_or_fail(const std::vector<Block>& blocks, const ReadRecord& read_record) {
        const double walked = 0.5 * (share_at(blocks.front().begin) + share_at(blocks.back().begin));
        const std::uint64_t bad = decode(blocks, read_record, walked);
        if (bad == kNone) return;
        const Block& block = blocks[bad / block_records_];
        const char* at = block.begin;
        std::uint64_t triangle = block.first_triangle;
        for (std::uint64_t record = block.first_record;; ++record) {
            if (const Fault fault = read_record(at, record, triangle)) fail(fault, record, at);
        }
    }

    // ---- The elements

    void read_vertices() {
        const bool has_normals = use_vertex_fields();
        const bool has_texture_coordinates = use_texture_coordinates();
        find_plain_vertex();
        const auto read_record = [this](const char*& at, std::uint64_t record, std::uint64_t&) {
            return read_vertex(at, record);
        };
        std::optional<std::vector<Block>> guess = guess_blocks(kNoList);
        std::uint64_t triangles = 0;
        const std::vector<Block> blocks = guess ? std::move(*guess) : find_blocks(triangles);
        resize(mesh_.positions, element_->count);
        if (has_normals) resize(mesh_.normals, element_->count);
        if (has_texture_coordinates) resize(mesh_.texture_coordinates, element_->count);
        if (guess && decode(blocks, read_record, share_at(at_)) == kNone) return;
        decode_or_fail(guess ? find_blocks(triangles) : blocks, read_record);
    }

    void read_faces() {
        const std::uint64_t before = mesh_.triangles.size();
        const auto read_faces_of = [this, before](std::uint64_t length) {
            return [this, before, length](const char*& at, std::uint64_t, std::uint64_t& triangle) {
                std::uint64_t place = before + triangle;
                const Fault fault = read_face(at, place, length);
                triangle = place - before;
                return fault;
            };
        };
        find_plain_triangle();
        const std::uint64_t length = first_length();
        if (const std::optional<std::vector<Block>> guess = length < 3 ? std::nullopt : guess_blocks(length)) {
            resize(mesh_.triangles, before + element_->count * (length - 2));
            if (decode(*guess, read_faces_of(length), share_at(at_)) == kNone) return;
            mesh_.triangles.resize(before);
            mesh_.triangles.shrink_to_fit();
        }
        std::uint64_t count = 0;
        const std::vector<Block> blocks = find_blocks(count);
        if (count > mesh_.triangles.max_size() - before) throw std::bad_alloc();
        resize(mesh_.triangles, before + count);
        decode_or_fail(blocks, read_faces_of(kNone));
    }

    void read_strips() {
        for (std::uint64_t record = 0; record < element_->count; ++record) {
            if (record % kOften == 0) progress_.reach(share_at(at_));
            for (const Field& field : fields_) {
                const Fault fault = field.use == kIndices ? read_strip(field) : skip_field(at_, field);
                if (fault) fail(fault, record, at_);
            }
        }
    }

    /// Reads one strip. Every second triangle is wound the other way round, so that all face the same side.
    Fault read_strip(const Field& field) {
        std::uint64_t length = 0;
        if (const Fault fault = read_length(at_, field, length)) return fault;
        std::uint64_t corners = 0;
        glm::uvec3 last(0);
        for (std::uint64_t k = 0; k < length; ++k) {
            if (k % kOften == 0) progress_.reach(share_at(at_));
            const char* before = at_;
            std::int64_t value = 0;
            if (const Fault fault = to_fault(codec_.integer(at_, field.property.type, value), field)) return fault;
            if (value == -1) {
                corners = 0;
                continue;
            }
            at_ = before;
            std::uint32_t index = 0;
            if (const Fault fault = read_index(at_, field, index)) return fault;
            last = {last.y, last.z, index};
            if (++corners < 3 || last.x == last.y || last.y == last.z || last.x == last.z) continue;
            mesh_.triangles.push_back(corners % 2 == 1 ? last : glm::uvec3(last.y, last.x, last.z));
        }
        return {};
    }

    void skip_element() {
        if (fields_.empty()) return;  // records without properties take no bytes, whatever their number
        std::uint64_t ignored = 0;
        for (std::uint64_t record = 0; record < element_->count; ++record) {
            if (record % kOften == 0) progress_.reach(share_at(at_));
            if (const Fault fault = walk_record(at_, ignored)) fail(fault, record, at_);
        }
    }

    /// Throws SceneError if data follows the last element: then a count is too small, and the mesh is not the whole
    /// model.
    void check_end() const {
        const char* rest = std::find_if_not(at_, file_end(), PlyAscii::is_space);
        if (rest == file_end()) return;
        throw SceneError(file_, 0,
                         fmt::format("the header's elements end at byte {}, but {} bytes follow: a count is wrong",
                                     at_ - bytes_.data(), file_end() - rest));
    }

    double share_at(const char* at) const {
        return static_cast<double>(at - bytes_.data()) / static_cast<double>(bytes_.size());
    }

    // ---- Messages

    const char* file_end() const { return bytes_.data() + bytes_.size(); }

    [[noreturn]] void fail(const Fault& fault, std::uint64_t record, const char* at) const {
        constexpr bool is_text = std::is_same_v<Codec, PlyAscii>;
        const std::string place =
            fmt::format("{} {} of {} (counted from 0)", printable(element_->name), record, element_->count);
        const std::size_t line = is_text ? 1 + std::count(bytes_.data(), at, '\n') : 0;
        const std::string byte = is_text ? "" : fmt::format(", near byte {}", at - bytes_.data());
        const std::string name = printable(fault.field->property.name);
        switch (fault.kind) {
            case Fault::Kind::truncated:
                throw SceneError(file_, line, fmt::format("the file ends within {}, at byte {}", place, bytes_.size()));
            case Fault::Kind::list_length:
                throw SceneError(file_, line,
                                 fmt::format("{}: the list {} has length {}{}", place, name, fault.value, byte));
            case Fault::Kind::not_finite:
                throw SceneError(file_, line,
                                 fmt::format("{}: {} is not a finite number of single precision{}", place, name, byte));
            case Fault::Kind::index:
                throw SceneError(
                    file_, line,
                    fmt::format("{}: vertex index {} where 0 to {} was expected ({} vertices){}", place, fault.value,
                                std::max<std::uint64_t>(vertex_count_, 1) - 1, vertex_count_, byte));
            default:
                throw SceneError(file_, line,
                                 fmt::format("{}: found '{}' where a number for {} was expected", place,
                                             printable({at, std::find_if(at, file_end(), PlyAscii::is_space)}), name));
        }
    }

    const MappedFile& mapped_;
    std::string_view bytes_;
    const PlyHeader& header_;
    const std::string& file_;
    Codec codec_;
    Progress progress_;
    std::uint64_t block_records_;
    const char* at_;  // the first byte that is not read yet
    std::uint64_t vertex_count_ = 0;
    const PlyElement* element_ = nullptr;
    std::vector<Field> fields_;                   // of `element_`
    std::size_t plain_bytes_ = 0;                 // of a record with a fast path; 0: there is none
    std::array<std::size_t, 3> plain_offsets_{};  // of x, y, z in a vertex with a fast path
    Mesh mesh_;
};

/// Returns the number of elements of this name that the header counts.
std::uint64_t count_of(const PlyHeader& header, std::string_view name) {
    for (const PlyElement& element : header.elements)
        if (element.name == name) return element.count;
    return 0;
}

}  // namespace

Mesh read_ply(const std::filesystem::path& file, const Progress& progress, std::uint64_t block_records) {
    const MappedFile mapped(file);
    const std::string_view bytes = mapped.bytes();
    const std::string name = file.string();
    const PlyHeader header = parse_ply_header(bytes, name);
    const char* end = bytes.data() + bytes.size();
    Mesh mesh = header.format == PlyFormat::ascii
                    ? PlyBody(mapped, header, name, PlyAscii(end), progress, block_records).read()
                    : PlyBody(mapped, header, name, PlyBinary(end, header.format == PlyFormat::binary_big_endian),
                              progress, block_records)
                          .read();
    if (mesh.triangles.empty())
        throw SceneError(name, 0,
                         fmt::format("the file has no triangle, that is no face of three vertices or more: it has {} "
                                     "points and {} lines",
                                     count_of(header, "vertex"), count_of(header, "edge")));
    return mesh;
}

}  // namespace castor
