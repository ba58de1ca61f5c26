#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "base/range.h"
#include "opencl/device_column.h"
#include "opencl/device_context.h"
#include "trace/scene_contents.h"

namespace castor {

/// Waits for what a failure may have left in the queue: commands read host memory that the scene shares, and that goes
/// next.
inline void finish_before_release(DeviceContext& context) noexcept {
    try {
        context.finish();
    } catch (const std::exception&) {
        // The device failed before, too.
    }
}

/// The columns of a chunk on one device.
struct DeviceColumns {
#define CASTOR_DEVICE_COLUMN(name, host, device, per, place, made, trace, surface) DeviceColumn<columns::name> name;
    CASTOR_SCENE_COLUMNS(CASTOR_DEVICE_COLUMN)
#undef CASTOR_DEVICE_COLUMN
};

/// A scene on one device: as many chunks as its memory holds stay there, the others take turns in the place that is
/// left. It may use the memory of `contents` in place, which must outlive it. Usable from several threads.
class DeviceScene {
public:
    /// Columns of trees that `contents` has not are empty. `context` must outlive it, too. `kept`: the numbers of the
    /// chunks that may stay.
    DeviceScene(DeviceContext& context, const SceneContents& contents, const Range& kept = kAllChunks);
    DeviceScene(DeviceScene&&) noexcept;
    ~DeviceScene();

    /// The columns of the whole scene, which every chunk has too; the others have no buffer.
    const DeviceColumns& columns() const;

    static constexpr Range kAllChunks{0, ~std::uint64_t{0}};

    std::size_t chunk_count() const;
    /// Of those that may stay, how many stream.
    std::size_t streaming_count() const;
    bool has_spheres() const;
    bool has_planes() const;
    bool has_instances() const;
    std::uint32_t compressed_levels() const;  // of the highest compressed tree
    std::uint64_t most_brute_tests() const;   // of a chunk
    bool has_pieces() const;                  // a tree has a primitive more than once; looks at all of them

    /// A chunk's turn. `params`: with its counts and numbers, and CASTOR_TRACE_GOES_ON and CASTOR_TRACE_MORE_FOLLOWS
    /// where they apply.
    struct Turn {
        const DeviceColumns& chunk;
        shared::TraceParams params;
        std::uint64_t brute_tests;  // bounded primitives of all instances: what brute force tests for a ray
        bool is_last;
    };
    /// Some of the chunks, whose answers go on from those of others, or are gone on with: where others have the rest.
    struct Subset {
        std::vector<std::size_t> chunks;
        bool goes_on = false, more_follows = false;
    };
    /// Calls visit(turn) for every chunk, or every one of the subset if there is one, which enqueues on `queue` what
    /// works with it: those that are on the device first, and of these and the others the near ones first, as seen from
    /// `from` if it is given. Commands of different chunks do not overlap. Returns when all is enqueued; where a chunk
    /// streams, its commands are waited for, since the next one takes its place.
    void visit_chunks(const cl::CommandQueue& queue, const std::optional<glm::vec3>& from,
                      const std::function<void(const Turn&)>& visit, const Subset* subset = nullptr) const;

    /// In which order chunks would have their turns if all were on the device.
    std::vector<std::size_t> order_from(const std::optional<glm::vec3>& from) const;

private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace castor
