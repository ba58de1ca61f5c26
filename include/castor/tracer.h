#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "castor/api.h"
#include "castor/device.h"
#include "castor/device_share.h"
#include "castor/scene.h"
#include "castor/scene_share.h"
#include "castor/shared/types.h"
#include "castor/tree_quality.h"

namespace castor {

class BuiltScene;
class Manager;
class RankServer;

using shared::Hit;
using shared::Ray;

/// How rays find their hits. Hits do not depend on it.
enum class Strategy {
    automatic,  // by device and kind of ray
    brute,      // every ray against every primitive: the reference
    simt,       // compressed 8-wide tree, one ray a work-item: for GPUs
    wide,       // 8-wide tree, vectors over boxes and triangles, several rays in turn: for CPUs
    packet,  // 8-wide tree, bundles of 16 coherent rays, vectors over rays; rays unlike each other one by one: for CPUs
};

/// "auto", "brute", "simt", "wide", "packet". strategy_from_string throws UsageError for any other word.
CASTOR_API std::string_view to_string(Strategy strategy);
CASTOR_API Strategy strategy_from_string(std::string_view word);

/// What the caller knows of a batch's rays. It may make them faster; it does not change their hits.
enum class Coherence {
    incoherent,  // neighbours have nothing in common
    coherent,    // 16 neighbours in the batch lie close and run alike, as in small blocks of pixels
};

/// What is asked of a ray: its nearest hit, whether there is any, how many crossings it has, or which ones.
enum class Query { closest, any, count, list };

/// "closest", "any", "count", "list". query_from_string throws UsageError for any other word.
CASTOR_API std::string_view to_string(Query query);
CASTOR_API Query query_from_string(std::string_view word);

/// All crossings of the rays of a batch.
struct CrossingLists {
    std::vector<std::uint64_t> first;  // the crossings of ray i are [first[i], first[i + 1]): one more than rays
    std::vector<Hit> crossings;        // of each ray sorted by (t, instance, primitive)
};

struct TracerOptions {
    Strategy strategy = Strategy::automatic;
    bool cull_back_faces = false;  // flat triangles seen from behind are not hit
    TreeQuality quality = TreeQuality::medium;
    bool use_profiles =
        true;  // what `castor tune` stored for the devices; may make rays faster, does not change their hits
    double deadline_seconds = 300.0;  // a device that does not answer for so long is dropped
    // One that does not answer for so long once a batch is done, as while its driver compiles kernels, is not waited
    // for: see RendererOptions.
    double stop_deadline_seconds = 300.0;
    SceneShare scene_share{};  // the chunks that stay on the devices, if not all; does not change hits
};

/// How many tests the rays of a batch took, all rays together. Those of a bundle of 16 rays count once for all of them.
struct TraceWork {
    // Of a ray, or a bundle, against nodes of trees.
    std::uint64_t compressed_nodes = 0;  // of the compressed tree, eight boxes each
    std::uint64_t wide_nodes = 0;        // of the wide tree, eight boxes each
    std::uint64_t bundle_nodes = 0;      // likewise, by a bundle's bounds
    std::uint64_t bundle_boxes = 0;      // one of the eight boxes, by each ray of a bundle
    std::uint64_t instance_nodes = 0;    // of the tree over instances
    // Against primitives.
    std::uint64_t triangles = 0;
    std::uint64_t spheres = 0;
    std::uint64_t planes = 0;
    std::uint64_t triangle_blocks = 0;  // four triangles each
    std::uint64_t sphere_blocks = 0;    // four spheres each
    std::uint64_t bundle_blocks = 0;    // the boxes of four triangles, by a bundle's bounds
    std::uint64_t bundle_triangles = 0;
    std::uint64_t bundle_spheres = 0;
};

/// Where a ray meets a primitive, in world space. Normals are unit vectors that point outward (for triangles, to the
/// side from which they wind counter-clockwise in their mesh's own space), and are not turned towards the ray.
struct Surface {
    glm::vec3 position{0.0f};
    glm::vec3 normal_geometric{0.0f};
    glm::vec3 normal_shading{0.0f};  // the interpolated one where a mesh has normals, else normal_geometric
    std::uint32_t material = CASTOR_INVALID_INDEX;
};

/// Finds hits of batches of rays in one scene. The answer is a function of ray and scene alone: the same bits on every
/// device and with every strategy. A batch is divided among all devices, and each gets as much as it can do; one that
/// fails is dropped, and the others do its work. Only where none is left does a DeviceError reach the caller. Usable
/// from several threads; batches take turns.
class CASTOR_API Tracer {
public:
    /// Flattens the scene, builds its tree and uploads both to every device. `scene` is not kept.
    /// Throws SceneError if the scene is wrong, DeviceError if a device refuses, UsageError if `devices` is empty.
    Tracer(const Scene& scene, const std::vector<Device>& devices, const TracerOptions& options = {});
    /// The same of a scene that is built already, and is kept: only a tree that it has not is built, with a warning.
    Tracer(const BuiltScene& scene, const std::vector<Device>& devices, const TracerOptions& options = {});
    ~Tracer();
    Tracer(Tracer&&) noexcept;
    Tracer& operator=(Tracer&&) noexcept;

    /// Writes the nearest hit of rays[i] to hits[i]. `hits` must have as many elements as `rays` (asserted). `go_on`,
    /// if there is one, is called by the caller's thread every 20 ms or so, once it is the batch's turn, and must not
    /// use the Tracer; where it returns false the batch is stopped. Returns whether all rays are answered, false only
    /// then. Throws DeviceError; answers may then be missing.
    bool closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint = Coherence::incoherent,
                     const std::function<bool()>& go_on = {});

    /// Writes 1 to occluded[i] where rays[i] hits anything, else 0. `occluded` must have as many elements as `rays`
    /// (asserted). All else as closest_hit.
    bool any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint = Coherence::incoherent,
                 const std::function<bool()>& go_on = {});

    /// Writes to counts[i] how many crossings rays[i] has in [t_min, t_max]: points where it passes through a surface.
    /// Of the triangles that share an edge or a vertex one is crossed there, a triangle seen edge-on never, a sphere
    /// where the ray enters it and where it leaves it, a plane once, neither where it is only touched. So a ray from
    /// outside a closed surface that reaches beyond it crosses it evenly, one from inside oddly, without exception,
    /// unless it begins or ends on the surface, within rounding, or the surface is closed only by triangles without
    /// area, of which the constructor warns. Back faces that are culled are not crossed; what is no ray, such as one
    /// with NaN, crosses nothing. `counts` must have as many elements as `rays` (asserted). All else as closest_hit.
    bool count_crossings(std::span<const Ray> rays, std::span<std::uint32_t> counts,
                         Coherence hint = Coherence::incoherent, const std::function<bool()>& go_on = {});

    /// Writes the first `limit` crossings of rays[i], sorted by (t, instance, primitive), to crossings[limit * i ...]:
    /// numbers, t, u and v as those of hits. What is left over becomes misses. Writes to counts[i] how many crossings
    /// there are in all: more than `limit` if some are missing. `crossings` must have limit times as many elements as
    /// `rays`, `counts` as many (asserted). Throws UsageError if the crossings of one ray do not fit into the largest
    /// buffer of a device. All else as count_crossings.
    bool list_crossings(std::span<const Ray> rays, std::size_t limit, std::span<Hit> crossings,
                        std::span<std::uint32_t> counts, Coherence hint = Coherence::incoherent,
                        const std::function<bool()>& go_on = {});

    /// Returns all crossings of all rays, which are counted first and then listed; nullopt where `go_on` has stopped
    /// it. Throws as list_crossings does, and bad_alloc.
    std::optional<CrossingLists> list_all_crossings(std::span<const Ray> rays, Coherence hint = Coherence::incoherent,
                                                    const std::function<bool()>& go_on = {});

    /// The same for the rays [first, first + count) on the caller's own queue and buffers, which must belong to
    /// context(device_index): `rays` holds Ray records, `hits` Hit records, `occluded` bytes, `counts` 32-bit numbers,
    /// `crossings` Hit records, `limit` of each ray (0: none, they are counted alone), all by the ray's number, of 2^31
    /// rays at most. The queue may run commands in any order: the caller then sees to it that the rays are
    /// there first. Enqueues all at once and returns; `event`, if not null, receives an event that is complete when all
    /// answers are (and perhaps not before earlier commands of the queue), which the caller releases. Throws
    /// DeviceError, and UsageError for another queue or more rays.
    void closest_hit(cl_command_queue queue, cl_mem rays, cl_mem hits, std::size_t first, std::size_t count,
                     cl_event* event = nullptr, Coherence hint = Coherence::incoherent);
    void any_hit(cl_command_queue queue, cl_mem rays, cl_mem occluded, std::size_t first, std::size_t count,
                 cl_event* event = nullptr, Coherence hint = Coherence::incoherent);

    void count_crossings(cl_command_queue queue, cl_mem rays, cl_mem counts, std::size_t first, std::size_t count,
                         cl_event* event = nullptr, Coherence hint = Coherence::incoherent);
    void list_crossings(cl_command_queue queue, cl_mem rays, std::uint32_t limit, cl_mem crossings, cl_mem counts,
                        std::size_t first, std::size_t count, cl_event* event = nullptr,
                        Coherence hint = Coherence::incoherent);

    /// The same on the first device alone, by the same kernels built so that they count what they do: for measuring.
    /// Slower, with the same answers.
    TraceWork count_closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint = Coherence::incoherent);
    TraceWork count_any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                            Coherence hint = Coherence::incoherent);

    /// Writes to surfaces[i] where rays[i] meets hits[i], which may be any answer of this tracer; for a miss, a default
    /// Surface. The position lies on the triangle or sphere, or on the ray where it meets a plane. Computed on the host
    /// in double precision, and rounded once. Bump and normal maps do not change the normals, and what moves is where
    /// it is at time 0. The spans must have as many elements as `rays` (asserted). Throws UsageError for a hit that
    /// names what the scene has not, and is no miss.
    void find_surfaces(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Surface> surfaces) const;

    /// The context and the (in-order) queue of the device_index-th device that the constructor was given.
    cl_context context(std::size_t device_index = 0) const;
    cl_command_queue queue(std::size_t device_index = 0) const;

    /// What the constructor noticed and went on, beside Scene::warnings: degenerate triangles, lamps that light
    /// otherwise than they are seen, device profiles that cannot be used, devices that failed.
    const std::vector<Warning>& warnings() const;
    /// The strategy in use for such rays (never `automatic`) on the device_index-th device that the constructor was
    /// given.
    Strategy strategy(Coherence hint = Coherence::incoherent, Query query = Query::closest,
                      std::size_t device_index = 0) const;
    /// Whether parts of the scene are brought to that device anew for each batch, since not all fit: few rays then take
    /// as long as many.
    bool streams(std::size_t device_index = 0) const;
    /// What the devices did for batches so far, in the constructor's order, also those that were dropped.
    std::vector<DeviceShare> shares() const;
    /// Seconds that the constructor spent on the tree, and on building programs and uploading.
    double build_seconds() const;
    double setup_seconds() const;

private:
    struct CASTOR_HIDDEN Implementation;
    // The library's own: work with, and for, other processes.
    friend bool trace_together(Tracer&, std::span<const Ray>, std::span<Hit>, Coherence, const std::function<bool()>&,
                               Manager&);
    friend bool trace_together(Tracer&, std::span<const Ray>, std::span<std::uint8_t>, Coherence,
                               const std::function<bool()>&, Manager&);
    friend bool count_together(Tracer&, std::span<const Ray>, std::span<std::uint32_t>, Coherence,
                               const std::function<bool()>&, Manager&);
    friend bool list_together(Tracer&, std::span<const Ray>, std::size_t, std::span<Hit>, std::span<std::uint32_t>,
                              Coherence, const std::function<bool()>&, Manager&);
    friend bool serve_trace(Tracer&, Query, std::size_t, Coherence, RankServer&);

    std::unique_ptr<Implementation> implementation_;
};

}  // namespace castor
