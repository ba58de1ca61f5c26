#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/gltf_document.h"
#include "scene/gltf_draco.h"

namespace castor {

/// The elements of a glTF accessor, read one by one. Whoever made one has checked that all of its bytes, sparse ones
/// too, lie within their buffers; `min` and `max` are not looked at.
class GltfAccessor {
public:
    static constexpr std::size_t kMostComponents = 16;

    /// The number of elements that an accessor must have, since other data of the file have as many. `what` they are
    /// for ends the message.
    struct Requirement {
        std::size_t count;
        std::string_view what;
    };

    /// `reference` is the index of the accessor, where the file names it; messages about values begin with its path.
    /// An accessor without a buffer view has zeros. Without a requirement their number is limited, so that few bytes
    /// cannot ask for much memory. Throws SceneError.
    GltfAccessor(GltfDocument& document, const GltfValue& reference,
                 std::optional<Requirement> required = std::nullopt);
    /// An accessor whose elements a compressed mesh has: they must be what the accessor says they are.
    GltfAccessor(const GltfDocument& document, const GltfValue& reference, const DracoAttribute& attribute);
    /// Returns how many elements the accessor should have, without looking at any.
    static std::size_t count_of(const GltfDocument& document, const GltfValue& reference);
    /// Returns whether the accessor has a buffer view.
    static bool has_view(const GltfDocument& document, const GltfValue& reference);

    std::size_t count() const { return count_; }
    /// The number of components of an element: 1 for SCALAR, 2 for VEC2 ...
    std::size_t component_count() const { return columns_ * rows_; }
    bool has_floats() const { return component_ == Component::float32; }
    bool is_normalized() const { return is_normalized_; }
    /// Throws SceneError unless an element has one of these numbers of components, in one column.
    void require_components(std::size_t least, std::size_t most) const;

    /// Returns an element's components, finite; integers as they are, or in [0, 1] or [-1, 1] where they are
    /// normalised. Those that it does not have are 0.
    std::array<float, kMostComponents> get(std::size_t i) const;
    glm::vec2 get_vec2(std::size_t i) const;
    glm::vec3 get_vec3(std::size_t i) const;
    glm::vec4 get_vec4(std::size_t i, float fourth) const;
    /// Returns the components of an element as whole numbers. `require_whole` has been called.
    std::array<std::uint32_t, 4> get_whole(std::size_t i) const;
    /// Throws SceneError unless components are unsigned integers.
    void require_whole() const;

    [[noreturn]] void reject(std::string_view reason) const { reference_.reject(reason); }

private:
    enum class Component : std::uint32_t { int8 = 5120, uint8, int16, uint16, uint32 = 5125, float32 };

    void read_layout(const GltfValue& value);
    void read_sparse(GltfDocument& document, const GltfValue& sparse);
    std::size_t component_size() const;
    std::size_t column_size() const;
    std::size_t element_size() const { return columns_ * column_size(); }
    /// Returns the first byte of an element; null where it is all zeros.
    const char* bytes_of(std::size_t i) const;
    double component_at(const char* bytes) const;
    /// Appends a component; false if its type does not hold the value.
    bool append_component(double value, std::string& bytes) const;

    GltfValue reference_;
    Component component_ = Component::float32;
    bool is_normalized_ = false;
    std::size_t count_ = 0, columns_ = 1, rows_ = 1, stride_ = 0;
    const char* data_ = nullptr;  // null: zeros
    std::vector<std::uint32_t> sparse_indices_;
    const char* sparse_data_ = nullptr;
    std::shared_ptr<const std::string> own_bytes_;  // what data_ points into, of a compressed mesh
};

}  // namespace castor
