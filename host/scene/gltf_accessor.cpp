#include "scene/gltf_accessor.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace castor {

namespace {

static_assert(std::endian::native == std::endian::little, "components are read as the file has them");

/// How many zeros an accessor without a buffer view may have where nothing else in the file requires so many: this
/// many, or this many for each element of its sparse part.
constexpr std::uint64_t kMostZeros = 1 << 16, kZerosAnElement = 1 << 10;
constexpr std::uint64_t kMostElements = 0xfffffffeu;

template <class T>
T value_at(const char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

struct TypeName {
    std::string_view name;
    std::size_t columns, rows;
};
constexpr TypeName kTypes[] = {{"SCALAR", 1, 1}, {"VEC2", 1, 2}, {"VEC3", 1, 3}, {"VEC4", 1, 4},
                               {"MAT2", 2, 2},   {"MAT3", 3, 3}, {"MAT4", 4, 4}};

}  // namespace

GltfAccessor::GltfAccessor(GltfDocument& document, const GltfValue& reference, std::optional<Requirement> required)
    : reference_(reference) {
    const GltfValue value = document.element("accessors", reference.index_of("accessors"));
    read_layout(value);
    if (required && count_ != required->count)
        reject(fmt::format("its accessor has {} elements, expected {}, {}", count_, required->count, required->what));
    const auto view = value.find("bufferView");
    const auto sparse = value.find("sparse");
    stride_ = element_size();
    if (view) {
        const std::size_t number = view->index_of("bufferViews");
        const GltfValue view_value = document.element("bufferViews", number);
        const std::uint64_t offset = value.whole("byteOffset", 0);
        if (const auto stride = view_value.find("byteStride")) {
            constexpr std::uint64_t kMostStride = 252;
            stride_ = stride->whole(kMostStride);
            if (stride_ < element_size())
                stride->reject(
                    fmt::format("{} bytes, but an element of {} has {}", stride_, value.path(), element_size()));
        }
        const std::string_view bytes = document.buffer_view(number);
        const std::uint64_t needed =
            count_ == 0 ? 0 : std::uint64_t{stride_} * (count_ - 1) + element_size();  // below 2^40
        if (offset > bytes.size() || needed > bytes.size() - offset)
            value.reject(
                fmt::format("{} elements of {} bytes, {} apart, from byteOffset {} on do not fit into the {} "
                            "bytes of bufferViews[{}]",
                            count_, element_size(), stride_, offset, bytes.size(), number));
        data_ = bytes.data() + offset;
    }
    if (sparse) read_sparse(document, *sparse);
    const std::uint64_t most_zeros = std::max(kMostZeros, kZerosAnElement * sparse_indices_.size());
    if (!view && !required && count_ > most_zeros)
        value.reject(fmt::format("{} elements without a bufferView, expected at most {}", count_, most_zeros));
}

GltfAccessor::GltfAccessor(const GltfDocument& document, const GltfValue& reference, const DracoAttribute& attribute)
    : reference_(reference) {
    read_layout(document.element("accessors", reference.index_of("accessors")));
    require_components(attribute.components, attribute.components);
    if (attribute.values.size() != count_ * rows_)
        reject(fmt::format("its accessor has {} elements, but the compressed mesh has {} vertices", count_,
                           attribute.values.size() / rows_));
    if (attribute.has_floats != has_floats())
        reject(fmt::format("its accessor has componentType {}, but the compressed mesh has {}",
                           static_cast<std::uint32_t>(component_), attribute.has_floats ? "floats" : "integers"));
    auto bytes = std::make_shared<std::string>();
    bytes->reserve(count_ * element_size());
    for (std::size_t i = 0; i < attribute.values.size(); ++i)
        if (!append_component(attribute.values[i], *bytes))
            reject(
                fmt::format("component {} of element {} of the compressed mesh is {}, which componentType {} does "
                            "not hold",
                            i % rows_, i / rows_, attribute.values[i], static_cast<std::uint32_t>(component_)));
    stride_ = element_size();
    data_ = bytes->data();
    own_bytes_ = std::move(bytes);
}

std::size_t GltfAccessor::count_of(const GltfDocument& document, const GltfValue& reference) {
    const GltfValue value = document.element("accessors", reference.index_of("accessors"));
    return static_cast<std::size_t>(value.require("count").whole(kMostElements));
}

bool GltfAccessor::has_view(const GltfDocument& document, const GltfValue& reference) {
    return document.element("accessors", reference.index_of("accessors")).find("bufferView").has_value();
}

bool GltfAccessor::append_component(double value, std::string& bytes) const {
    const auto append = [&](auto component) {
        bytes.append(reinterpret_cast<const char*>(&component), sizeof component);
        return true;
    };
    const auto append_whole = [&](auto type) {
        using T = decltype(type);
        const bool fits =
            value >= double{std::numeric_limits<T>::min()} && value <= double{std::numeric_limits<T>::max()};
        return fits && append(static_cast<T>(value));
    };
    switch (component_) {
        case Component::int8:
            return append_whole(std::int8_t{});
        case Component::uint8:
            return append_whole(std::uint8_t{});
        case Component::int16:
            return append_whole(std::int16_t{});
        case Component::uint16:
            return append_whole(std::uint16_t{});
        case Component::uint32:
            return append_whole(std::uint32_t{});
        case Component::float32:
            break;
    }
    return append(static_cast<float>(value));
}

void GltfAccessor::read_layout(const GltfValue& value) {
    const GltfValue component = value.require("componentType");
    switch (component.whole()) {
        case 5120:
        case 5121:
        case 5122:
        case 5123:
        case 5125:
        case 5126:
            component_ = static_cast<Component>(component.whole());
            break;
        default:
            component.reject(fmt::format("{} is none of 5120 to 5123, 5125 and 5126", component.whole()));
    }
    const GltfValue type = value.require("type");
    const auto known =
        std::find_if(std::begin(kTypes), std::end(kTypes), [&](const TypeName& t) { return t.name == type.text(); });
    if (known == std::end(kTypes)) type.reject(fmt::format("\"{}\" is no type of elements", type.text().substr(0, 40)));
    columns_ = known->columns;
    rows_ = known->rows;
    is_normalized_ = value.flag("normalized", false) && !has_floats() && component_ != Component::uint32;
    count_ = static_cast<std::size_t>(value.require("count").whole(kMostElements));
}

void GltfAccessor::read_sparse(GltfDocument& document, const GltfValue& sparse) {
    const GltfValue indices = sparse.require("indices"), values = sparse.require("values");
    const GltfValue count_value = sparse.require("count");
    const std::uint64_t count = count_value.whole(count_);
    const GltfValue type = indices.require("componentType");
    const std::uint64_t kind = type.whole();
    const std::size_t size = kind == 5121 ? 1 : kind == 5123 ? 2 : kind == 5125 ? 4 : 0;
    if (size == 0) type.reject(fmt::format("{} is none of 5121, 5123 and 5125", kind));
    const auto bytes_of_part = [&](const GltfValue& part, std::size_t element) {
        const std::string_view bytes = document.buffer_view(part.require("bufferView").index_of("bufferViews"));
        const std::uint64_t offset = part.whole("byteOffset", 0);
        if (offset > bytes.size() || count * element > bytes.size() - offset)
            part.reject(fmt::format("{} elements of {} bytes from byteOffset {} on do not fit into {} bytes", count,
                                    element, offset, bytes.size()));
        return bytes.data() + offset;
    };
    const char* const index_bytes = bytes_of_part(indices, size);
    sparse_data_ = bytes_of_part(values, element_size());
    sparse_indices_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        const char* const at = index_bytes + i * size;
        const std::uint32_t index = size == 1   ? value_at<std::uint8_t>(at)
                                    : size == 2 ? value_at<std::uint16_t>(at)
                                                : value_at<std::uint32_t>(at);
        if (index >= count_ || (i > 0 && index <= sparse_indices_[i - 1]))
            indices.reject(
                fmt::format("index {} is {}, expected one below {}, and larger than the one before", i, index, count_));
        sparse_indices_[i] = index;
    }
}

std::size_t GltfAccessor::component_size() const {
    switch (component_) {
        case Component::int8:
        case Component::uint8:
            return 1;
        case Component::int16:
        case Component::uint16:
            return 2;
        default:
            return 4;
    }
}

// The columns of matrices begin at multiples of 4 bytes.
std::size_t GltfAccessor::column_size() const {
    const std::size_t size = rows_ * component_size();
    return columns_ == 1 ? size : (size + 3) / 4 * 4;
}

void GltfAccessor::require_components(std::size_t least, std::size_t most) const {
    if (columns_ == 1 && rows_ >= least && rows_ <= most) return;
    reject(fmt::format("its accessor has {}, expected {}{}",
                       columns_ == 1 ? fmt::format("{} components", rows_) : "matrices",
                       least == most ? "" : fmt::format("{} or ", least), most));
}

void GltfAccessor::require_whole() const {
    const bool is_whole =
        component_ == Component::uint8 || component_ == Component::uint16 || component_ == Component::uint32;
    if (!is_whole || is_normalized_)
        reject(fmt::format("its accessor has componentType {}{}, expected unsigned integers",
                           static_cast<std::uint32_t>(component_), is_normalized_ ? ", normalized" : ""));
}

const char* GltfAccessor::bytes_of(std::size_t i) const {
    if (!sparse_indices_.empty()) {
        const auto found = std::lower_bound(sparse_indices_.begin(), sparse_indices_.end(), i);
        if (found != sparse_indices_.end() && *found == i)
            return sparse_data_ + static_cast<std::size_t>(found - sparse_indices_.begin()) * element_size();
    }
    return data_ == nullptr ? nullptr : data_ + i * stride_;
}

double GltfAccessor::component_at(const char* bytes) const {
    const auto scaled = [&](double value, double largest) {
        return is_normalized_ ? std::max(value / largest, -1.0) : value;
    };
    switch (component_) {
        case Component::int8:
            return scaled(value_at<std::int8_t>(bytes), 127.0);
        case Component::uint8:
            return scaled(value_at<std::uint8_t>(bytes), 255.0);
        case Component::int16:
            return scaled(value_at<std::int16_t>(bytes), 32767.0);
        case Component::uint16:
            return scaled(value_at<std::uint16_t>(bytes), 65535.0);
        case Component::uint32:
            return value_at<std::uint32_t>(bytes);
        case Component::float32:
            break;
    }
    return double{value_at<float>(bytes)};
}

std::array<float, GltfAccessor::kMostComponents> GltfAccessor::get(std::size_t i) const {
    std::array<float, kMostComponents> result{};
    const char* const bytes = bytes_of(i);
    if (bytes == nullptr) return result;
    for (std::size_t column = 0; column < columns_; ++column)
        for (std::size_t row = 0; row < rows_; ++row) {
            const double value = component_at(bytes + column * column_size() + row * component_size());
            if (!std::isfinite(value))
                reject(fmt::format("component {} of element {} of its accessor is {}, expected a finite number",
                                   column * rows_ + row, i, value));
            result[column * rows_ + row] = static_cast<float>(value);
        }
    return result;
}

glm::vec2 GltfAccessor::get_vec2(std::size_t i) const {
    const auto v = get(i);
    return {v[0], v[1]};
}

glm::vec3 GltfAccessor::get_vec3(std::size_t i) const {
    const auto v = get(i);
    return {v[0], v[1], v[2]};
}

glm::vec4 GltfAccessor::get_vec4(std::size_t i, float fourth) const {
    const auto v = get(i);
    return {v[0], v[1], v[2], rows_ > 3 ? v[3] : fourth};
}

std::array<std::uint32_t, 4> GltfAccessor::get_whole(std::size_t i) const {
    std::array<std::uint32_t, 4> result{};
    const char* const bytes = bytes_of(i);
    if (bytes == nullptr) return result;
    for (std::size_t row = 0; row < std::min<std::size_t>(rows_, 4); ++row) {
        const char* const at = bytes + row * component_size();
        result[row] = component_ == Component::uint8    ? value_at<std::uint8_t>(at)
                      : component_ == Component::uint16 ? value_at<std::uint16_t>(at)
                                                        : value_at<std::uint32_t>(at);
    }
    return result;
}

}  // namespace castor
