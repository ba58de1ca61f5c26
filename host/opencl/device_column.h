#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <string_view>
#include <utility>

#include "castor/shared/scene_columns.h"
#include "castor/shared/types.h"
#include "castor/shared/wave_columns.h"
#include "opencl/device_context.h"

namespace castor {

// A type for the column `name`, which tells columns of the same elements apart.
#define CASTOR_COLUMN_TYPE(name, host, device)               \
    struct name {                                            \
        using Element = host;                                \
        static constexpr const char* kName = #name;          \
        static constexpr const char* kElementName = #device; \
    };

/// A type for every column of a scene and of a wave.
namespace columns {
#define CASTOR_COLUMN_TYPE_OF_SCENE(name, host, device, per, place, made, trace, surface) \
    CASTOR_COLUMN_TYPE(name, host, device)
#define CASTOR_COLUMN_TYPE_OF_WAVE(name, host, device, per) CASTOR_COLUMN_TYPE(name, host, device)
CASTOR_SCENE_COLUMNS(CASTOR_COLUMN_TYPE_OF_SCENE)
CASTOR_WAVE_COLUMNS(CASTOR_COLUMN_TYPE_OF_WAVE)
#undef CASTOR_COLUMN_TYPE_OF_SCENE
#undef CASTOR_COLUMN_TYPE_OF_WAVE
}  // namespace columns

/// A column on a device. `Name` is one of the types in `columns`: two columns do not convert to each other, also where
/// their elements are the same.
template <class Name>
class DeviceColumn {
public:
    /// No buffer yet.
    DeviceColumn() = default;
    /// The caller says that the buffer holds this column.
    explicit DeviceColumn(cl::Buffer buffer) : buffer_(std::move(buffer)) {}

    const cl::Buffer& buffer() const { return buffer_; }
    operator const cl::Buffer&() const { return buffer_; }

    /// The same buffer in the place of another column with the same elements, such as shadow rays as the rays of a
    /// trace kernel.
    template <class Other>
    DeviceColumn<Other> as() const {
        static_assert(std::string_view(Name::kElementName) == Other::kElementName);
        return DeviceColumn<Other>(buffer_);
    }

private:
    cl::Buffer buffer_;
};

/// A column of `count` elements, as DeviceContext::make_buffer makes it.
template <class Name>
DeviceColumn<Name> make_column(DeviceContext& context, std::size_t count) {
    return DeviceColumn<Name>(context.make_buffer(count * sizeof(typename Name::Element), Name::kName));
}

}  // namespace castor
