#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/range.h"
#include "castor/scene.h"
#include "opencl/device_column.h"
#include "opencl/device_context.h"
#include "render/render_arguments.h"
#include "render/render_features.h"
#include "render/wave_aovs.h"
#include "trace/device_scene.h"
#include "trace/distributed_trace.h"
#include "trace/strategy.h"
#include "trace/surface_kernels.h"

namespace castor {

/// Surfaces that are there in part which a ray can pass: the next one stops it.
inline constexpr std::uint32_t kMostPassed = 4096;
/// How often a path can be scattered within a solid, from one surface to the next: after that it ends.
inline constexpr std::uint32_t kMostScattered = 16384;

/// The settings that all waves of a picture share.
struct WaveSettings {
    shared::Camera camera;
    shared::RenderParams params;  // without counts and sample
    std::uint32_t max_depth = 0;
    std::optional<PathTracing> path_tracing{};  // empty: by the format's rules
    float sample_spread = 1.0f;  // of traced paths: the width of a sample's cone, where that of a pixel's is 1
    std::uint32_t background_texture = CASTOR_INVALID_INDEX;
    std::uint32_t light_node_count = 0;  // of the tree of lights
    std::uint32_t first_far = 0;         // lights [first_far, far_end) have all environments and suns
    std::uint32_t far_end = 0;
    std::uint32_t first_unmet = 0;  // lights [first_unmet, unmet_end) have all of is_met_by_none
    std::uint32_t unmet_end = 0;
    Range lights{};               // whose light is added; params.light_count: all that there are
    bool wants_uv = false;        // whether trace_aovs finds texture coordinates; else they are zeros
    bool wants_features = false;  // whether sums of what eye rays met are kept (film_features)
    // The group of each light, then that of what is no light's, which is the last; and of each material's emission.
    // Empty: there are no groups.
    std::vector<std::uint32_t> light_groups{}, emission_groups{};
    Coherence eye_rays = Coherence::coherent;   // as which rays those of the eye, and from what they met, are traced
    bool any_reflective = false;                // whether any material can send mirror rays under these rules
    RenderFeatures features{};                  // of the scene
    std::vector<bool> solid_materials{};        // of traced paths: what solid_materials says
    std::shared_ptr<ChunkExchange> exchange{};  // with those who keep the other chunks; null: this device has all

    std::uint32_t group_count() const { return light_groups.empty() ? 0 : light_groups.back() + 1; }
};

/// The columns of a wave on its device, named as in wave_columns.h.
struct WaveColumns {
#define CASTOR_WAVE_MEMBER(name, host, device, per) DeviceColumn<columns::name> name;
    CASTOR_WAVE_COLUMNS(CASTOR_WAVE_MEMBER)
#undef CASTOR_WAVE_MEMBER
};

/// How much a device renders at a time.
struct WaveSize {
    std::uint64_t blocks = 0;  // pixel blocks, at most
    std::uint64_t room = 0;    // blocks that its wave has place for: several samples of each where the picture has few
};

/// Returns how many levels of branches there can be below eye rays (see path_states.lanes.cl): 0 where no path
/// branches.
std::uint32_t branch_levels(const RenderFeatures& features, std::uint32_t max_depth);
/// Returns the most terms that a path adds to its pixel, which a wave keeps apart where it sums deviations: 1 where
/// slots have sums.
std::uint64_t terms_of_sample(const WaveSettings& settings);
/// Terms that a wave can keep apart for each slot: those of one pixel block take 64 MiB then, half of what any device
/// allows.
inline constexpr std::uint64_t kMostTermsApart = 65536;
/// Returns the size of waves for a picture of so many blocks and samples, in pieces of at most `tile_size` x
/// `tile_size` pixels, or 0: what suits the device. No buffer of a wave exceeds the device's largest allocation, unless
/// one block's does. `feature_rows`: the most that film_features has.
WaveSize wave_size(const Device& device, std::uint64_t picture_blocks, std::uint32_t samples_per_pixel,
                   std::uint32_t tile_size, std::uint32_t feature_rows = CASTOR_FEATURES);
/// Returns the most bytes that a wave with room for so many pixel blocks takes on its device, without planes.
/// `branch_levels`: of the function above.
std::uint64_t wave_bytes(std::uint64_t room, std::uint32_t branch_levels);

/// The buffers and kernels with which one device renders some pixel blocks at a time, wave by wave. Pixels are numbered
/// as in CASTOR_PIXEL_BLOCK, slots as in slots.cl. For one thread.
///
/// A sample of a pixel is a path with a slot of its own. Stages (kernels) run over the queue of the paths that are
/// still on their way: a work-item is a place in the queue, `path_slot` names the slot of the path there. Rays, hits
/// and surfaces stand at the place, and what a path takes along stands at the slot (wave_columns.h lists which is
/// which). After a bounce, `scatter` marks the paths that go on, `rank_paths` counts them in each block of 64 places,
/// the host adds these counts up, and `compact_paths` moves them together, in the order of before. So neighbours in the
/// picture stay neighbours in the queue, and no stage is launched for paths that ended. The order of the queue shows in
/// no result: each path owns its slot.
///
/// Where the scene has dielectrics, paths branch. Levels of the trees of rays follow one another, in queues of a
/// limited length: trace_branches follows the branches of one queue to their leaves, queue after queue, before it takes
/// the next ones of their level. Where trees can be deep, queues are shorter, so that two of each level have room
/// (slots_at_once).
///
/// All kinds of material share a queue: stages shade the lanes of a work-item side by side, and leave out what none of
/// them has. Where neighbours in the queue had the same material, for nothing, 16 lanes of PoCL would be faster by 3 %
/// in country-kitchen (88 materials), and by a tenth among metal, glass and matt balls, less what the sorting takes.
class Wave {
public:
    /// For at most `room` pixel blocks at a time, traced with one sample of each of their pixels, or block after block
    /// with several side by side.
    Wave(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning, const WaveSettings& settings,
         std::size_t room);
    Wave(const Wave&) = delete;
    Wave& operator=(const Wave&) = delete;
    /// Waits for copies that are under way.
    ~Wave();

    /// Sets the picture to render from the next `begin` on, which the wave suits.
    void set_picture(const WaveSettings& settings);
    /// Returns whether the buffers and kernels suit a picture of the scene: it is path traced, and has groups of
    /// lights, as the first one, or not.
    bool suits(const RenderFeatures& features) const {
        return features.traces_paths == traces_paths() &&
               features.has_light_groups == settings_.features.has_light_groups;
    }
    bool traces_paths() const { return settings_.features.traces_paths; }
    /// Begins the pixel blocks with these codes (see PixelBlocks), in the place of the last ones. `sums_before`, if it
    /// is not empty, is what `sums` gave for these blocks; tracing goes on with the samples after those.
    void begin(std::span<const std::uint32_t> blocks, std::span<const glm::vec4> sums_before = {});
    /// How many samples of each pixel are traced side by side. Multiples of this number use the device best.
    std::uint32_t samples_at_once() const { return samples_at_once(pixel_count_); }
    /// The same for as many blocks as the wave has room for.
    std::uint32_t samples_of_bundle() const { return samples_at_once(most_slots_); }
    /// How many paths are traced side by side, at most.
    std::uint64_t most_slots() const { return most_slots_; }
    /// Enqueues the tracing and shading of samples [first, first + count) of every pixel. The sums have the same bits
    /// however the samples are divided among calls and waves.
    void trace_samples(std::uint32_t first, std::uint32_t count);
    /// Returns when all that is enqueued is done, about `expected_seconds` from now.
    void wait(double expected_seconds) { context_.wait(expected_seconds); }
    /// Returns the means over `sample_count` samples, one a pixel.
    std::vector<glm::vec3> resolve(std::uint32_t sample_count);
    /// Returns the sums over the samples, one a pixel, then the rows of film_features, if there are any. w is
    /// the sum of squared deviations of the samples' luminances where CASTOR_RENDER_DEVIATIONS is set, else 0.
    std::vector<glm::vec4> sums();
    /// Counts the rays traced since the last `begin`: eye, shadow and mirror rays.
    std::uint64_t ray_count();
    /// Counts the paths for which stages were launched since the last `begin`, once for each bounce.
    std::uint64_t launched_paths() const { return launched_paths_; }
    /// Returns whether, since the last call, a ray met more than kMostPassed surfaces that it would have passed.
    bool take_met_most_passed() { return std::exchange(met_most_passed_, false); }
    /// The same of paths that were scattered more than kMostScattered times within a solid.
    bool take_met_most_scattered() { return std::exchange(met_most_scattered_, false); }
    /// Traces eye rays through the centres of these blocks' pixels and returns their hits. `begin` must follow before
    /// any sample is traced.
    WaveAovs trace_aovs(std::span<const std::uint32_t> blocks);

private:
    /// Which rays of a bounce are sent on: those that pass surfaces, and those that are scattered.
    enum class RaysThatGoOn { passing, passing_to_lights, scattered };
    void share_shadow_rays();
    void find_uvs();
    std::uint32_t samples_at_once(std::uint64_t pixels) const;
    bool branches() const { return settings_.features.has_dielectrics && !traces_paths(); }
    std::uint64_t slots_at_once(bool keeps_terms) const;
    std::uint64_t counted_slots() const;
    Coherence coherence_at(std::uint32_t depth) const;
    void trace_side_by_side();
    void trace_queue(std::uint32_t depth, std::uint32_t node);
    bool sums_deviations() const { return settings_.params.flags & CASTOR_RENDER_DEVIATIONS; }
    void make_room_for_terms();
    void begin_features(std::span<const glm::vec4> sums_before);
    void trace_branches();
    void begin_queue(std::size_t level);
    std::uint32_t scatter_branches(std::size_t level);
    void add_branches(std::size_t level);
    void make_room_for_records();
    void trace_paths();
    void find_media_of_eye();
    void find_base_colors(const shared::PathParams& path);
    void shade_paths(const shared::PathParams& path);
    void accumulate(std::uint32_t light_count, std::uint32_t first_term);
    void begin_ranking(std::uint32_t place_count);
    std::uint32_t end_ranking(std::uint32_t place_count);
    void write_block_places(std::uint32_t place_count);
    void replace_queue();
    void generate_rays(const shared::Camera& camera);
    void trace_closest_hits(const shared::Camera& camera, std::uint32_t depth);
    void trace_closest_hits(std::uint32_t depth, const TraceKernels::RayBuffers& rays,
                            const DeviceColumn<columns::hits>& hits, std::size_t count, bool culls);
    void trace_shadow_rays(std::uint32_t depth, std::uint32_t ray_count);
    void pass_surfaces(const shared::PathParams& path, const SurfaceKernels::Query& rays, bool are_shadow_rays);
    void find_passed(const SurfaceKernels::Bounce& bounce, const SurfaceKernels::Query& query);
    std::uint32_t go_on_beyond(const SurfaceKernels::Query& rays, const SurfaceKernels::Query& query, bool has_places,
                               RaysThatGoOn kind, bool is_last);
    SurfaceKernels::Query trace_on(std::uint32_t depth, std::uint32_t count);
    bool are_any_at_panes(std::size_t count);
    void pass_panes(const shared::PathParams& path, SurfaceKernels::Query query, const SurfaceKernels::Bounce& bounce,
                    bool has_places);
    void trace_shadow_rays_through(const shared::PathParams& path);
    void scatter_within_solids(const shared::PathParams& path, bool finds_lights);
    void scatter_until_surfaces(const shared::PathParams& path, bool sees_lights);
    void add_light_of_one(const shared::PathParams& path);
    void draw_times();
    DeviceColumn<columns::ray_origin_tmin> moved_origins(const SurfaceKernels::Query& query,
                                                         const DeviceColumn<columns::ray_time>& time,
                                                         const DeviceColumn<columns::rest_origin_tmin>& rest);
    void find_surfaces();
    bool has_background_texture() const;
    void texture_background();
    SurfaceKernels::Query surface_query() const;
    void find_surfaces(SurfaceKernels::Query query);
    void shade(std::uint32_t depth);
    void add_lights(std::uint32_t depth, std::uint32_t node);
    void add_lights(std::uint32_t first, std::uint32_t count, std::uint32_t first_term, std::uint32_t depth,
                    std::uint32_t node);
    std::uint32_t row_length() const;
    void scatter(std::uint32_t node);
    std::size_t feature_rows() const;
    void add_features();
    void add_groups();
    void add_samples();

    /// Branches that are equally deep, of which one queue after another is traced.
    struct BranchLevel {
        // Made when the level is first reached; of eye rays the sums alone are in use.
        DeviceColumn<columns::next_origin_tmin> origin_tmin;
        DeviceColumn<columns::next_direction_tmax> direction_tmax;
        DeviceColumn<columns::next_throughput> throughput;
        DeviceColumn<columns::next_state> state;
        DeviceColumn<columns::branch_list> list;
        DeviceColumn<columns::branch_sums> sums;
        std::uint64_t room = 0;                        // numbers of branches
        std::uint32_t count = 0;                       // branches in the list
        std::uint32_t queue_begin = 0, queue_end = 0;  // of the list: the branches in the queue
    };

    DeviceContext& context_;
    const DeviceScene& scene_;
    WaveSettings settings_;
    shared::RenderParams params_;
    std::uint64_t most_slots_;
    std::uint64_t terms_of_sample_;  // the most that a path adds to its pixel
    std::uint32_t pixel_count_ = 0;  // of the blocks that are begun
    std::uint64_t launched_paths_ = 0;
    /// Materials of the solid in which eye rays begin, and of the one around that; CASTOR_INVALID_INDEX: none. Unknown
    /// until it is needed.
    std::optional<std::array<std::uint32_t, 2>> media_of_eye_;

    TraceKernels trace_kernels_;
    DistributedTrace distributed_trace_;  // in use where the settings have an exchange
    Kernel<GenerateRays> generate_rays_kernel_;
    SurfaceKernels surface_kernels_;
    std::optional<Kernel<TextureBackground>> texture_background_kernel_;  // of scenes that have textures
    Kernel<Accumulate> accumulate_kernel_;
    std::optional<Kernel<GoOnBeyond>> go_on_beyond_kernel_;          // of scenes with surfaces that rays pass
    std::optional<Kernel<PassPanes>> pass_panes_kernel_;             // of scenes with panes
    std::optional<Kernel<ScatterWithin>> scatter_within_kernel_;     // of scenes with solids that scatter light
    std::optional<Kernel<LightWithin>> light_within_kernel_;         // if there are lights that no ray meets, too
    std::optional<Kernel<FindBaseColors>> find_base_colors_kernel_;  // made when it is first wanted
    std::optional<Kernel<Shade>> shade_kernel_;  // of pictures that are not path traced, as the next two
    std::optional<Kernel<GenerateShadowRays>> generate_shadow_rays_kernel_;
    std::optional<Kernel<Scatter>> scatter_kernel_;
    std::optional<Kernel<ShadePaths>> shade_paths_kernel_;  // of pictures that are path traced, as the next one
    std::optional<Kernel<LimitSamples>> limit_samples_kernel_;
    Kernel<SelectRaysInside> select_rays_inside_kernel_;
    Kernel<TakeHitsInside> take_hits_inside_kernel_;
    Kernel<DrawTimes> draw_times_kernel_;
    Kernel<MoveRays> move_rays_kernel_;
    Kernel<MoveSurfaces> move_surfaces_kernel_;
    Kernel<RankPaths> rank_paths_kernel_;
    Kernel<CompactPaths> compact_paths_kernel_;
    Kernel<ListBranches> list_branches_kernel_;
    Kernel<TakeBranches> take_branches_kernel_;
    Kernel<AddBranches> add_branches_kernel_;
    std::optional<Kernel<AddFeatures>> add_features_kernel_;  // made when it is first wanted
    std::optional<Kernel<AddGroups>> add_groups_kernel_;      // likewise
    Kernel<AddSamples> add_samples_kernel_;
    Kernel<Resolve> resolve_kernel_;

    WaveColumns columns_;
    std::uint64_t film_terms_count_ = 0;
    std::vector<BranchLevel> branch_levels_;  // where paths branch; the first is that of eye rays
    std::uint64_t feature_count_ = 0;
    bool has_inside_hits_ = false;
    bool has_records_ = false;
    bool has_rest_origins_ = false;
    bool met_most_passed_ = false;
    bool met_most_scattered_ = false;
    std::vector<std::uint32_t> next_block_places_;
    cl::Event ranking_;                 // when these are read
    std::vector<std::uint8_t> passed_;  // what the column of this name says of the rays that are looked at
    std::uint32_t passing_turn_ = 0;    // which of passing_counts counts next: it is 0
};

}  // namespace castor
