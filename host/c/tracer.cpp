#include "castor/tracer.h"

#include <chrono>

#include "c/handle.h"

using namespace castor;
using namespace castor::c;

static_assert(sizeof(castor_ray) == sizeof(Ray) && alignof(castor_ray) == alignof(Ray));
static_assert(offsetof(castor_ray, origin) == offsetof(Ray, origin));
static_assert(offsetof(castor_ray, t_min) == offsetof(Ray, t_min));
static_assert(offsetof(castor_ray, direction) == offsetof(Ray, direction));
static_assert(offsetof(castor_ray, t_max) == offsetof(Ray, t_max));
static_assert(sizeof(castor_hit) == sizeof(Hit) && alignof(castor_hit) == alignof(Hit));
static_assert(offsetof(castor_hit, t) == offsetof(Hit, t));
static_assert(offsetof(castor_hit, u) == offsetof(Hit, u));
static_assert(offsetof(castor_hit, v) == offsetof(Hit, v));
static_assert(offsetof(castor_hit, primitive) == offsetof(Hit, primitive));
static_assert(offsetof(castor_hit, instance) == offsetof(Hit, instance));
static_assert(CASTOR_MISS == CASTOR_INVALID_INDEX);
static_assert(static_cast<int>(Strategy::packet) == CASTOR_STRATEGY_PACKET);
static_assert(static_cast<int>(TreeQuality::high) == CASTOR_TREE_QUALITY_HIGH);
static_assert(static_cast<int>(Coherence::coherent) == CASTOR_COHERENCE_COHERENT);

namespace {

TracerOptions tracer_options(const castor_tracer_options* options) {
    const castor_tracer_options given = read_options(options);
    auto made = to_options<TracerOptions>(given);
    made.cull_back_faces = flag(given.cull_back_faces, "cull_back_faces");
    return made;
}

/// What the options of a batch say.
struct BatchOptions {
    explicit BatchOptions(const castor_batch_options* options) {
        const castor_batch_options given = read_options(options);
        hint = to_coherence(given.coherence);
        require_zero(given.reserved);
        if (given.go_on) go_on = [given] { return given.go_on(given.user) != 0; };
    }
    Coherence hint;
    std::function<bool()> go_on;
};

void require_complete(bool is_complete) {
    if (!is_complete) throw Interrupted();
}

Tracer& tracer_of(castor_tracer* tracer) {
    return require(tracer, "tracer").tracer;
}

/// The tracer, with a device of this number.
const Tracer& tracer_with_device(const castor_tracer* tracer, std::size_t i) {
    const castor_tracer& asked = require(tracer, "tracer");
    position(i, asked.device_count, "the devices");
    return asked.tracer;
}

/// Calls go_on every 20 ms or so.
class Ticker {
public:
    explicit Ticker(const std::function<bool()>& go_on) : go_on_(go_on) {}
    bool operator()() {
        const auto now = std::chrono::steady_clock::now();
        if (!go_on_ || now < next_) return true;
        next_ = now + std::chrono::milliseconds(20);
        return go_on_();
    }

private:
    const std::function<bool()>& go_on_;
    std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now();
};

}  // namespace

castor_status castor_tracer_create(const castor_scene* scene, const castor_devices* devices,
                                   const castor_tracer_options* options, castor_tracer** tracer) {
    return guarded([&] {
        make_handle(tracer, "tracer", [&] {
            const Scene& from = require(scene, "scene").scene;
            const TracerOptions made = tracer_options(options);
            return new castor_tracer(from, devices_of(devices), made);
        });
    });
}

castor_status castor_tracer_create_from_built(const castor_built_scene* built, const castor_devices* devices,
                                              const castor_tracer_options* options, castor_tracer** tracer) {
    return guarded([&] {
        make_handle(tracer, "tracer", [&] {
            const BuiltScene& from = require(built, "built").built;
            const TracerOptions made = tracer_options(options);
            return new castor_tracer(from, devices_of(devices), made);
        });
    });
}

void castor_tracer_retain(castor_tracer* tracer) {
    retain(tracer);
}
void castor_tracer_release(castor_tracer* tracer) {
    release(tracer);
}

castor_status castor_tracer_closest_hit(castor_tracer* tracer, const castor_ray* rays, size_t count, castor_hit* hits,
                                        const castor_batch_options* options) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        const auto given = array<Ray>(rays, count, "rays");
        const auto answers = array<Hit>(hits, count, "hits");
        const BatchOptions batch(options);
        require_complete(asked.closest_hit(given, answers, batch.hint, batch.go_on));
    });
}

castor_status castor_tracer_any_hit(castor_tracer* tracer, const castor_ray* rays, size_t count, uint8_t* occluded,
                                    const castor_batch_options* options) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        const auto given = array<Ray>(rays, count, "rays");
        const auto answers = array<std::uint8_t>(occluded, count, "occluded");
        const BatchOptions batch(options);
        require_complete(asked.any_hit(given, answers, batch.hint, batch.go_on));
    });
}

castor_status castor_tracer_count_crossings(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                            uint32_t* counts, const castor_batch_options* options) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        const auto given = array<Ray>(rays, count, "rays");
        const auto answers = array<std::uint32_t>(counts, count, "counts");
        const BatchOptions batch(options);
        require_complete(asked.count_crossings(given, answers, batch.hint, batch.go_on));
    });
}

castor_status castor_tracer_list_crossings(castor_tracer* tracer, const castor_ray* rays, size_t count, size_t limit,
                                           castor_hit* crossings, uint32_t* counts,
                                           const castor_batch_options* options) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        const auto given = array<Ray>(rays, count, "rays");
        if (limit > 0 && count > std::numeric_limits<std::size_t>::max() / limit)
            throw ArgumentError("limit", fmt::format("is {}, for {} rays: more than memory can hold", limit, count));
        const auto listed = array<Hit>(crossings, count * limit, "crossings");
        const auto answers = array<std::uint32_t>(counts, count, "counts");
        const BatchOptions batch(options);
        require_complete(asked.list_crossings(given, limit, listed, answers, batch.hint, batch.go_on));
    });
}

castor_status castor_tracer_list_all_crossings(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                               const castor_batch_options* options, castor_crossings** crossings) {
    return guarded([&] {
        make_handle(crossings, "crossings", [&] {
            Tracer& asked = tracer_of(tracer);
            const auto given = array<Ray>(rays, count, "rays");
            const BatchOptions batch(options);
            std::optional<CrossingLists> lists = asked.list_all_crossings(given, batch.hint, batch.go_on);
            require_complete(lists.has_value());
            return new castor_crossings(std::move(*lists));
        });
    });
}

void castor_crossings_retain(castor_crossings* crossings) {
    retain(crossings);
}
void castor_crossings_release(castor_crossings* crossings) {
    release(crossings);
}

castor_status castor_crossings_get_arrays(const castor_crossings* crossings, castor_crossings_arrays* arrays) {
    return guarded([&] {
        const CrossingLists& lists = require(crossings, "crossings").lists;
        castor_crossings_arrays told{};
        told.ray_count = lists.first.size() - 1;
        told.first = lists.first.data();
        told.hits = reinterpret_cast<const castor_hit*>(lists.crossings.data());
        write_struct(arrays, told, "arrays");
    });
}

castor_status castor_tracer_find_surfaces(castor_tracer* tracer, const castor_ray* rays, const castor_hit* hits,
                                          size_t count, float* points, float* normals_geometric, float* normals_shading,
                                          uint32_t* materials, const castor_batch_options* options) {
    return guarded([&] {
        const Tracer& asked = tracer_of(tracer);
        const auto all_rays = array<Ray>(rays, count, "rays");
        const auto all_hits = array<Hit>(hits, count, "hits");
        const auto wanted = [&]<class Element>(auto* first, Element, const char* name) {
            return first ? array<Element>(first, count, name) : std::span<Element>();
        };
        const auto point = wanted(points, glm::vec3(), "points");
        const auto normal_geometric = wanted(normals_geometric, glm::vec3(), "normals_geometric");
        const auto normal_shading = wanted(normals_shading, glm::vec3(), "normals_shading");
        const auto material = wanted(materials, std::uint32_t(), "materials");
        const BatchOptions batch(options);
        Ticker tick(batch.go_on);
        std::vector<Surface> surfaces(std::min(count, std::size_t{1} << 16));
        for (std::size_t begin = 0; begin < count; begin += surfaces.size()) {
            require_complete(tick());
            const std::size_t n = std::min(surfaces.size(), count - begin);
            asked.find_surfaces(all_rays.subspan(begin, n), all_hits.subspan(begin, n), std::span(surfaces).first(n));
            const auto store = [&](const auto& target, auto Surface::*member) {
                if (target.empty()) return;
                for (std::size_t i = 0; i < n; ++i) target[begin + i] = surfaces[i].*member;
            };
            store(point, &Surface::position);
            store(normal_geometric, &Surface::normal_geometric);
            store(normal_shading, &Surface::normal_shading);
            store(material, &Surface::material);
        }
    });
}

castor_status castor_tracer_enqueue_closest_hit(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                struct _cl_mem* rays, struct _cl_mem* hits, size_t first, size_t count,
                                                castor_coherence coherence, struct _cl_event** event) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        asked.closest_hit(&require(queue, "queue"), &require(rays, "rays"), &require(hits, "hits"), first, count, event,
                          to_coherence(coherence));
    });
}

castor_status castor_tracer_enqueue_any_hit(castor_tracer* tracer, struct _cl_command_queue* queue,
                                            struct _cl_mem* rays, struct _cl_mem* occluded, size_t first, size_t count,
                                            castor_coherence coherence, struct _cl_event** event) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        asked.any_hit(&require(queue, "queue"), &require(rays, "rays"), &require(occluded, "occluded"), first, count,
                      event, to_coherence(coherence));
    });
}

castor_status castor_tracer_enqueue_count_crossings(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                    struct _cl_mem* rays, struct _cl_mem* counts, size_t first,
                                                    size_t count, castor_coherence coherence,
                                                    struct _cl_event** event) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        asked.count_crossings(&require(queue, "queue"), &require(rays, "rays"), &require(counts, "counts"), first,
                              count, event, to_coherence(coherence));
    });
}

castor_status castor_tracer_enqueue_list_crossings(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                   struct _cl_mem* rays, uint32_t limit, struct _cl_mem* crossings,
                                                   struct _cl_mem* counts, size_t first, size_t count,
                                                   castor_coherence coherence, struct _cl_event** event) {
    return guarded([&] {
        Tracer& asked = tracer_of(tracer);
        asked.list_crossings(&require(queue, "queue"), &require(rays, "rays"), limit, &require(crossings, "crossings"),
                             &require(counts, "counts"), first, count, event, to_coherence(coherence));
    });
}

castor_status castor_tracer_get_context(const castor_tracer* tracer, size_t i, struct _cl_context** context) {
    return guarded([&] { require(context, "context") = tracer_with_device(tracer, i).context(i); });
}

castor_status castor_tracer_get_queue(const castor_tracer* tracer, size_t i, struct _cl_command_queue** queue) {
    return guarded([&] { require(queue, "queue") = tracer_with_device(tracer, i).queue(i); });
}

castor_status castor_tracer_get_strategy(const castor_tracer* tracer, size_t i, castor_query query,
                                         castor_coherence coherence, castor_strategy* strategy) {
    return guarded([&] {
        require(strategy, "strategy") = static_cast<castor_strategy>(
            tracer_with_device(tracer, i).strategy(to_coherence(coherence), to_query(query), i));
    });
}

castor_status castor_tracer_get_info(const castor_tracer* tracer, castor_tracer_info* info) {
    return guarded([&] {
        const castor_tracer& asked = require(tracer, "tracer");
        castor_tracer_info told{};
        told.device_count = asked.device_count;
        told.build_seconds = asked.tracer.build_seconds();
        told.setup_seconds = asked.tracer.setup_seconds();
        write_struct(info, told, "info");
    });
}

castor_status castor_tracer_get_share(const castor_tracer* tracer, size_t i, castor_device_share* share) {
    return guarded([&] {
        const castor_tracer& asked = require(tracer, "tracer");
        get_share(asked.tracer.shares(), i, asked.texts, share);
    });
}

castor_status castor_tracer_get_warning_count(const castor_tracer* tracer, size_t* count) {
    return guarded([&] { require(count, "count") = require(tracer, "tracer").tracer.warnings().size(); });
}

castor_status castor_tracer_get_warning(const castor_tracer* tracer, size_t i, castor_warning* warning) {
    return guarded([&] { get_warning(require(tracer, "tracer").tracer.warnings(), i, warning); });
}
