#include "render/wave.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <iterator>
#include <limits>
#include <numeric>
#include <string_view>
#include <utility>

#include "castor/shared/sample_order.h"
#include "opencl/quirks.h"
#include "render/pixel_blocks.h"

namespace castor {

namespace {

static_assert(PixelBlocks::kPixels == CASTOR_BLOCK_SLOTS);

// Terms for which a wave has memory, per slot: 512 bytes. A sample with more takes several slots' share, so that fewer
// samples are traced side by side.
constexpr std::uint64_t kTermsOfSlot = 32;

// Where paths branch, the same memory holds the sums of the slots and what the levels of branches have.
constexpr std::uint64_t kBranchBytes =
    sizeof(columns::next_origin_tmin::Element) + sizeof(columns::next_direction_tmax::Element) +
    sizeof(columns::next_throughput::Element) + sizeof(columns::next_state::Element) +
    sizeof(columns::branch_list::Element) + sizeof(columns::branch_sums::Element);
constexpr std::uint64_t kBranchBytesOfSlot = (kTermsOfSlot - 1) * sizeof(columns::film_terms::Element);
// A branch has two children, so that a level can have as many branches as two queues.
constexpr std::uint64_t kQueuesOfLevel = 2;

// Samples of a pixel that are traced side by side even where there are pixels enough: a bundle of rays (see
// traverse_packet.cl) that are as alike as can be.
constexpr std::uint64_t kSamplesOfBundle = 16;

// Elements that a column has for a pixel block, or for as many slots, when a wave is made: by the words of
// wave_columns.h.
constexpr std::size_t kPerBlock_place = CASTOR_BLOCK_SLOTS, kPerBlock_slot = CASTOR_BLOCK_SLOTS,
                      kPerBlock_pixel = CASTOR_BLOCK_SLOTS, kPerBlock_texture = CASTOR_BLOCK_SLOTS,
                      kPerBlock_attribute = CASTOR_BLOCK_SLOTS, kPerBlock_block = 1, kPerBlock_none = 0;

/// Puts another buffer in the place of a column's. Assigning over it would leave a buffer whose release fails in its
/// place, to be released once more.
template <class Column>
void replace(Column& column, Column other) {
    std::exchange(column, std::move(other));
}

// Bytes of so many flags, one a place, in whole words, as they are filled. There is room for those: see kPerBlock.
constexpr std::size_t in_words(std::size_t flags) {
    return (flags + 3) / 4 * 4;
}

/// Counts the terms of a bounce: an ambient one, and one of each light.
std::uint32_t terms_of_bounce(const WaveSettings& settings) {
    return 1 + static_cast<std::uint32_t>(settings.lights.size());
}

std::size_t blocks_of_places(std::uint32_t place_count) {
    return (place_count + CASTOR_BLOCK_SLOTS - 1) / CASTOR_BLOCK_SLOTS;
}

/// Returns the width of a pixel's cone at distance 1: of one in the middle of the picture. Of parallel rays it is 0.
float pixel_spread(const shared::Camera& camera) {
    if (camera.projection == CASTOR_PROJECTION_PARALLEL) return 0.0f;
    glm::dvec3 middle, step;
    for (int axis = 0; axis < 3; ++axis) {
        step[axis] = camera.step_y[axis];
        middle[axis] = camera.corner[axis] + 0.5 * camera.width * double{camera.step_x[axis]} -
                       0.5 * camera.height * double{camera.step_y[axis]};
    }
    return static_cast<float>(glm::length(step) / glm::length(middle));
}

/// Returns for how many pixel blocks a wave has room: where paths branch, their children need two places each.
std::size_t room_for(const WaveSettings& settings, std::size_t room) {
    return branch_levels(settings.features, 1) > 0 ? std::max<std::size_t>(room, kQueuesOfLevel) : room;
}

/// Returns the node that reflection leads to, as next_node of random.lanes.cl does.
std::uint32_t next_node(std::uint32_t node) {
    std::uint32_t x = node ^ (CASTOR_NODE_REFLECTION + 0x9e3779b9u + (node << 6) + (node >> 2));
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

}  // namespace

/// Gives no more than 2^32.
std::uint64_t terms_of_sample(const WaveSettings& settings) {
    if (settings.features.has_slot_sums()) return 1 + settings.group_count();
    constexpr std::uint64_t kMany = std::uint64_t{1} << 32;
    const std::uint64_t bounces = settings.any_reflective ? std::uint64_t{settings.max_depth} + 1 : 1;
    const std::uint64_t terms = terms_of_bounce(settings);
    return bounces < kMany / terms ? bounces * terms : kMany;
}

std::uint32_t branch_levels(const RenderFeatures& features, std::uint32_t max_depth) {
    return features.has_dielectrics && !features.traces_paths ? max_depth : 0;
}

std::uint64_t wave_bytes(std::uint64_t room, std::uint32_t branch_levels) {
    if (branch_levels > 0) room = std::max(room, std::min(room, std::uint64_t{1}) * kQueuesOfLevel);
    std::uint64_t bytes_of_block =
        CASTOR_BLOCK_SLOTS * (sizeof(columns::ray_time::Element) + sizeof(columns::next_origin_tmin::Element) +
                              sizeof(columns::next_direction_tmax::Element) + sizeof(columns::inside_hits::Element) +
                              sizeof(columns::passed::Element) + sizeof(columns::passing_places::Element) +
                              sizeof(columns::next_passing_places::Element) + sizeof(columns::passing_slot::Element) +
                              sizeof(columns::passing_time::Element) + sizeof(columns::passing_origin_tmin::Element) +
                              sizeof(columns::passing_direction_tmax::Element) +
                              sizeof(columns::rest_origin_tmin::Element) + sizeof(columns::shadow_length::Element) +
                              sizeof(columns::shadow_medium::Element) + sizeof(columns::shadow_outer::Element));
#define CASTOR_ADD_BYTES(name, host, device, per) bytes_of_block += kPerBlock_##per * sizeof(host);
    CASTOR_WAVE_COLUMNS(CASTOR_ADD_BYTES)
#undef CASTOR_ADD_BYTES
    const std::uint64_t terms = room * CASTOR_BLOCK_SLOTS * kTermsOfSlot * sizeof(columns::film_terms::Element);
    const std::uint64_t branches = branch_levels * kQueuesOfLevel * CASTOR_BLOCK_SLOTS * kBranchBytes;  // of one block
    return room * bytes_of_block + std::max(terms, room > 0 ? branches : 0);
}

WaveSize wave_size(const Device& device, std::uint64_t picture_blocks, std::uint32_t samples_per_pixel,
                   std::uint32_t tile_size, std::uint32_t feature_rows) {
    std::uint64_t largest = 1;  // column, in bytes a block
#define CASTOR_COMPARE_BYTES(name, host, device, per) \
    largest = std::max<std::uint64_t>(largest, kPerBlock_##per * sizeof(host));
    CASTOR_WAVE_COLUMNS(CASTOR_COMPARE_BYTES)
#undef CASTOR_COMPARE_BYTES
    largest =
        std::max<std::uint64_t>(largest, feature_rows * CASTOR_BLOCK_SLOTS * sizeof(columns::film_features::Element));
    const std::uint64_t most = std::max<std::uint64_t>(1, device.max_allocation_bytes / largest);
    const std::uint64_t own_edge = device_quirks(device).tile_size / CASTOR_PIXEL_BLOCK;
    const std::uint64_t edge = tile_size ? tile_size / CASTOR_PIXEL_BLOCK : own_edge;
    WaveSize size;
    size.blocks = std::min({edge * edge, picture_blocks, most});
    size.room = std::max(size.blocks, std::min({own_edge * own_edge, picture_blocks * samples_per_pixel, most}));
    return size;
}

Wave::Wave(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning, const WaveSettings& settings,
           std::size_t room)
    : context_(context),
      scene_(scene),
      settings_(settings),
      params_(settings.params),
      most_slots_(room_for(settings, room) * CASTOR_BLOCK_SLOTS),
      terms_of_sample_(terms_of_sample(settings)),
      trace_kernels_(context, scene, tuning),
      distributed_trace_(context, scene, tuning, trace_kernels_),
      generate_rays_kernel_(context, wave_program(settings.features)),
      surface_kernels_(context, settings.features.has_textures, wave_program(settings.features)),
      accumulate_kernel_(context, wave_program(settings.features)),
      select_rays_inside_kernel_(context, wave_program(settings.features)),
      take_hits_inside_kernel_(context, wave_program(settings.features)),
      draw_times_kernel_(context, wave_program(settings.features)),
      move_rays_kernel_(context, wave_program(settings.features)),
      move_surfaces_kernel_(context, wave_program(settings.features)),
      rank_paths_kernel_(context, wave_program(settings.features)),
      compact_paths_kernel_(context, wave_program(settings.features)),
      list_branches_kernel_(context, wave_program(settings.features)),
      take_branches_kernel_(context, wave_program(settings.features)),
      add_branches_kernel_(context, wave_program(settings.features)),
      add_samples_kernel_(context, wave_program(settings.features)),
      resolve_kernel_(context, wave_program(settings.features)),
      next_block_places_(most_slots_ / CASTOR_BLOCK_SLOTS) {
    room = next_block_places_.size();
    if (settings.features.has_textures) texture_background_kernel_.emplace(context, wave_program(settings.features));
    if (settings.features.traces_paths) {
        shade_paths_kernel_.emplace(context, build_options(settings.features));
        limit_samples_kernel_.emplace(context, wave_program(settings.features));
    } else {
        shade_kernel_.emplace(context, build_options(settings.features));
        generate_shadow_rays_kernel_.emplace(context, build_options(settings.features));
        scatter_kernel_.emplace(context, build_options(settings.features));
    }
    if (settings.features.sends_rays_on()) go_on_beyond_kernel_.emplace(context);
    if (settings.features.traces_paths && settings.features.has_scattering)
        scatter_within_kernel_.emplace(context, build_options(settings.features));
    if (scatter_within_kernel_ && settings.first_unmet < settings.unmet_end)
        light_within_kernel_.emplace(context, build_options(settings.features));
    if (settings.features.traces_paths && settings.features.has_panes)
        pass_panes_kernel_.emplace(context, build_options(settings.features));
    const auto is_made = [&](std::string_view per) {
        if (per == "texture") return settings.features.has_textures || settings.features.has_attributes;
        if (per == "attribute") return settings.features.has_attributes;
        return true;
    };
#define CASTOR_MAKE_COLUMN(name, host, device, per) \
    columns_.name = make_column<columns::name>(context, is_made(#per) ? room * kPerBlock_##per : 0);
    CASTOR_WAVE_COLUMNS(CASTOR_MAKE_COLUMN)
#undef CASTOR_MAKE_COLUMN
    if (settings.features.has_motion)
        columns_.ray_time = make_column<columns::ray_time>(context, room * CASTOR_BLOCK_SLOTS);
    if (settings.features.sends_rays_on()) {
        columns_.inside_hits = make_column<columns::inside_hits>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.passed = make_column<columns::passed>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.passing_places = make_column<columns::passing_places>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.next_passing_places = make_column<columns::next_passing_places>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.passing_counts = make_column<columns::passing_counts>(context, 2);
        context.fill_zero(columns_.passing_counts, 2 * sizeof(columns::passing_counts::Element));
        columns_.passing_slot = make_column<columns::passing_slot>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.passing_origin_tmin = make_column<columns::passing_origin_tmin>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.passing_direction_tmax =
            make_column<columns::passing_direction_tmax>(context, room * CASTOR_BLOCK_SLOTS);
        if (settings.features.has_motion)
            columns_.passing_time = make_column<columns::passing_time>(context, room * CASTOR_BLOCK_SLOTS);
        if (pass_panes_kernel_)
            columns_.shadow_length = make_column<columns::shadow_length>(context, room * CASTOR_BLOCK_SLOTS);
        if (settings.features.has_matched_solids) {
            columns_.shadow_medium = make_column<columns::shadow_medium>(context, room * CASTOR_BLOCK_SLOTS);
            columns_.shadow_outer = make_column<columns::shadow_outer>(context, room * CASTOR_BLOCK_SLOTS);
        }
        has_inside_hits_ = true;
    }
    if (traces_paths()) {
        // A bounce draws the next rays before its shadow rays are traced.
        columns_.next_origin_tmin = make_column<columns::next_origin_tmin>(context, room * CASTOR_BLOCK_SLOTS);
        columns_.next_direction_tmax = make_column<columns::next_direction_tmax>(context, room * CASTOR_BLOCK_SLOTS);
    } else {
        share_shadow_rays();
    }
    set_picture(settings);
}

Wave::~Wave() {
    try {
        context_.finish();
    } catch (const DeviceError&) {
        // Whoever uses the device next is told.
    }
}

/// Lets the next bounce's rays, which `scatter` writes, use the memory of the shadow rays.
void Wave::share_shadow_rays() {
    replace(columns_.next_origin_tmin, columns_.shadow_origin_tmin.as<columns::next_origin_tmin>());
    replace(columns_.next_direction_tmax, columns_.shadow_direction_tmax.as<columns::next_direction_tmax>());
}

void Wave::set_picture(const WaveSettings& settings) {
    settings_ = settings;
    params_ = settings.params;
    terms_of_sample_ = terms_of_sample(settings);
    if (settings_.exchange) distributed_trace_.set_exchange(settings_.exchange);
    if (settings_.light_groups.empty()) return;
    const auto upload = [&]<class Column>(DeviceColumn<Column>& column, const std::vector<std::uint32_t>& groups) {
        replace(column, make_column<Column>(context_, groups.size()));
        context_.write(column, groups.data(), groups.size() * sizeof groups[0]);
    };
    upload(columns_.light_groups, settings_.light_groups);
    upload(columns_.emission_groups, settings_.emission_groups);
}

void Wave::begin(std::span<const std::uint32_t> blocks, std::span<const glm::vec4> sums_before) {
    pixel_count_ = static_cast<std::uint32_t>(blocks.size()) * CASTOR_BLOCK_SLOTS;
    launched_paths_ = 0;
    context_.write(columns_.pixel_blocks, blocks.data(), blocks.size_bytes());
    context_.fill_zero(columns_.film_sum, pixel_count_ * sizeof(glm::vec4));
    context_.fill_zero(columns_.ray_counts, counted_slots() * sizeof(cl_uint));
    const auto of_film = sums_before.first(std::min<std::size_t>(sums_before.size(), pixel_count_));
    context_.write(columns_.film_sum, of_film.data(), of_film.size_bytes());
    if (feature_rows() > 0) begin_features(sums_before.subspan(of_film.size()));
}

/// Counts the rows of film_features.
std::size_t Wave::feature_rows() const {
    return (settings_.wants_features ? CASTOR_FEATURES : 0) + settings_.group_count();
}

/// Begins the sums of what eye rays met, and of groups of lights: with those that there are, if there are any.
void Wave::begin_features(std::span<const glm::vec4> sums_before) {
    if (settings_.wants_features && !add_features_kernel_)
        add_features_kernel_.emplace(context_, build_options(settings_.features));
    if (settings_.group_count() > 0 && !add_groups_kernel_) add_groups_kernel_.emplace(context_);
    const std::uint64_t count = std::uint64_t{pixel_count_} * feature_rows();
    if (count > feature_count_) {
        replace(columns_.film_features, make_column<columns::film_features>(context_, count));
        feature_count_ = count;
    }
    context_.fill_zero(columns_.film_features, count * sizeof(glm::vec4));
    context_.write(columns_.film_features, sums_before.data(), sums_before.size_bytes());
}

/// Returns how many places the queues of the blocks that are begun can have.
std::uint64_t Wave::counted_slots() const {
    if (branches()) return slots_at_once(true);
    return std::min(most_slots_, std::uint64_t{pixel_count_} * samples_at_once());
}

/// Returns how alike the rays of neighbours in the queue are after so many bounces. Eye rays of a pixel block are
/// coherent, and so are the shadow rays from their hits. Mirrors and glass keep the samples of a pixel, and its
/// neighbours, together for several bounces; what is scattered diffusely goes anywhere.
Coherence Wave::coherence_at(std::uint32_t depth) const {
    return depth == 0 || !traces_paths() ? settings_.eye_rays : Coherence::incoherent;
}

/// Returns how many places the shadow rays to one light have.
std::uint32_t Wave::row_length() const {
    return (params_.path_count + CASTOR_BLOCK_SLOTS - 1) / CASTOR_BLOCK_SLOTS * CASTOR_BLOCK_SLOTS;
}

/// Returns how many slots, and places of a queue, have room for the levels of their branches and, where `keeps_terms`,
/// for their terms.
std::uint64_t Wave::slots_at_once(bool keeps_terms) const {
    const std::uint64_t largest = context_.device().max_allocation_bytes;
    std::uint64_t slots = most_slots_;
    if (keeps_terms) {
        const std::uint64_t most_terms =
            std::min<std::uint64_t>(most_slots_ * kTermsOfSlot, largest / sizeof(columns::film_terms::Element));
        slots = std::min(slots, most_terms / terms_of_sample_);
        if (sums_deviations()) slots = std::max<std::uint64_t>(slots, CASTOR_BLOCK_SLOTS);  // see kMostTermsApart
    }
    if (const std::uint64_t levels = branch_levels(settings_.features, settings_.max_depth)) {
        // The levels of one block have columns of 2 KiB.
        const std::uint64_t of_levels = most_slots_ * kBranchBytesOfSlot / (levels * kQueuesOfLevel * kBranchBytes);
        slots = std::min({slots, most_slots_ / kQueuesOfLevel, of_levels}) / CASTOR_BLOCK_SLOTS * CASTOR_BLOCK_SLOTS;
        slots = std::max<std::uint64_t>(slots, CASTOR_BLOCK_SLOTS);
    }
    return slots;
}

std::uint32_t Wave::samples_at_once(std::uint64_t pixels) const {
    if (pixels == 0) return 1;
    const std::uint64_t wanted = std::max(kSamplesOfBundle, most_slots_ / pixels);
    const std::uint64_t possible = slots_at_once(true) / CASTOR_BLOCK_SLOTS;  // by blocks, one after another
    return static_cast<std::uint32_t>(std::bit_floor(std::max<std::uint64_t>(1, std::min(wanted, possible))));
}

void Wave::trace_samples(std::uint32_t first, std::uint32_t count) {
    while (count > 0) {
        const std::uint32_t now = std::bit_floor(std::min(count, samples_at_once()));
        const std::uint64_t blocks =
            slots_at_once(now > 1 || sums_deviations() || settings_.group_count() > 0) / now / CASTOR_BLOCK_SLOTS;
        const auto pixels =
            static_cast<std::uint32_t>(std::min<std::uint64_t>(pixel_count_, blocks * CASTOR_BLOCK_SLOTS));
        params_.sample = first;
        params_.sample_shift = static_cast<std::uint32_t>(std::countr_zero(now));
        for (params_.first_pixel = 0; params_.first_pixel < pixel_count_; params_.first_pixel += pixels) {
            params_.pixel_count = std::min(pixels, pixel_count_ - params_.first_pixel);
            trace_side_by_side();
        }
        first += now;
        count -= now;
    }
}

/// Traces some samples, side by side, of each of some pixels.
void Wave::trace_side_by_side() {
    params_.path_count = params_.pixel_count << params_.sample_shift;
    if (traces_paths()) return trace_paths();
    if (branches()) return trace_branches();
    const bool keeps_terms = params_.sample_shift > 0 || sums_deviations();
    if (keeps_terms) make_room_for_terms();
    std::uint32_t node = CASTOR_NODE_EYE;
    params_.flags = settings_.params.flags | CASTOR_RENDER_FIRST_BOUNCE;
    generate_rays(settings_.camera);
    for (std::uint32_t depth = 0; params_.path_count > 0; ++depth) {
        trace_queue(depth, node);
        if (!settings_.any_reflective || depth == settings_.max_depth) break;
        scatter(node);
        begin_ranking(params_.path_count);
        replace_queue();
        node = next_node(node);
        params_.flags = settings_.params.flags;
    }
    if (keeps_terms) add_samples();
}

/// Traces and shades the rays in the queue, after so many bounces. `node`: of all paths, where they do not branch.
void Wave::trace_queue(std::uint32_t depth, std::uint32_t node) {
    launched_paths_ += params_.path_count;
    draw_times();
    trace_closest_hits(settings_.camera, depth);
    find_surfaces();
    if (depth == 0 && settings_.wants_features) add_features();
    if (depth == 0 && has_background_texture()) texture_background();
    shade(depth);
    add_lights(depth, node);
}

/// The same by path tracing. No path branches, so that all paths of a queue have bounced as often.
void Wave::trace_paths() {
    const PathTracing& tracing = *settings_.path_tracing;
    const RenderFeatures& features = settings_.features;
    const std::uint32_t bounces = tracing.bounces.value_or(CASTOR_MOST_BOUNCES);
    const bool shines = features.has_emission || features.has_environment || features.has_suns || features.has_textures;
    make_room_for_terms();
    make_room_for_records();
    shared::PathParams path{};
    path.node = CASTOR_NODE_EYE;
    path.largest_sample = tracing.largest_sample;
    path.pixel_spread = pixel_spread(settings_.camera) * settings_.sample_spread;
    if (tracing.light_choice == LightChoice::tree) path.light_node_count = settings_.light_node_count;
    path.first_far = settings_.first_far;
    path.far_end = settings_.far_end;
    path.first_unmet = settings_.first_unmet;
    path.unmet_end = settings_.unmet_end;
    if (!media_of_eye_) find_media_of_eye();
    path.eye_medium = (*media_of_eye_)[0];
    path.eye_outer = (*media_of_eye_)[1];
    params_.flags = settings_.params.flags | CASTOR_RENDER_FIRST_BOUNCE;
    const std::uint32_t flags = (tracing.samples_brdf ? CASTOR_PATH_BY_BRDF : 0) |
                                (tracing.samples_lights ? CASTOR_PATH_LIGHTS : 0) |
                                (tracing.weighs ? CASTOR_PATH_WEIGHS : 0);
    generate_rays(settings_.camera);
    // After the last bounce rays that find light are followed through panes.
    const bool passes_panes = pass_panes_kernel_ && shines;
    for (; params_.path_count > 0; ++path.depth) {
        launched_paths_ += params_.path_count;
        const bool is_last = path.depth + 1 == bounces, ends = path.depth >= bounces;
        const bool has_roulette = tracing.roulette_from && path.depth >= *tracing.roulette_from;
        const bool drops_weak_light = tracing.roulette_from && path.depth > 0;
        path.flags = flags | (has_roulette ? CASTOR_PATH_ROULETTE : 0) |
                     (drops_weak_light ? CASTOR_PATH_LIGHT_ROULETTE : 0) | (is_last ? CASTOR_PATH_LAST : 0) |
                     (ends ? CASTOR_PATH_ENDS : 0);
        draw_times();
        trace_closest_hits(settings_.camera, path.depth);
        if (features.has_opacity) pass_surfaces(path, surface_query(), false);
        const bool has_features = path.depth == 0 && settings_.wants_features;
        if (has_features) {  // of what is seen before anything is scattered
            find_surfaces();
            find_base_colors(path);
            add_features();
        }
        const bool may_scatter = scatter_within_kernel_ && (path.depth > 0 || path.eye_medium != CASTOR_INVALID_INDEX);
        if (may_scatter) scatter_within_solids(path, tracing.samples_lights && !ends);
        if (may_scatter || !has_features) find_surfaces();
        if (path.depth == 0 && has_background_texture()) texture_background();
        shade_paths(path);
        if (ends && !passes_panes) break;
        const bool goes_on = !is_last || shines;
        if (goes_on) begin_ranking(params_.path_count);  // first, so that the device has work while the host waits
        if (params_.light_count > 0 && tracing.samples_lights && !ends) add_light_of_one(path);
        if (!goes_on) break;
        replace_queue();
        path.node = next_node(path.node);
        params_.flags = settings_.params.flags;
    }
    if (tracing.largest_sample < std::numeric_limits<float>::infinity())
        limit_samples_kernel_->enqueue(std::size_t{params_.pixel_count} << params_.sample_shift,
                                       {.params = params_,
                                        .path = path,
                                        .group_count = settings_.group_count(),
                                        .film_terms = columns_.film_terms});
    add_samples();
    if (settings_.group_count() > 0) add_groups();
}

/// Finds the solids around where eye rays begin, in the middle of the picture: follows a ray from there through all
/// that it meets. What it leaves without having entered it is around the eye.
void Wave::find_media_of_eye() {
    media_of_eye_ = {CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX};
    if (settings_.solid_materials.empty()) return;
    const shared::Camera& camera = settings_.camera;
    glm::vec3 origin = glm::make_vec3(camera.position);
    glm::vec3 direction = glm::make_vec3(camera.corner) +
                          0.5f * static_cast<float>(camera.width) * glm::make_vec3(camera.step_x) -
                          0.5f * static_cast<float>(camera.height) * glm::make_vec3(camera.step_y);
    if (camera.projection == CASTOR_PROJECTION_PARALLEL) {
        origin += direction;
        direction = glm::make_vec3(camera.lens_x);
    }
    const shared::RenderParams params = params_;
    params_.path_count = 1;
    params_.flags = settings_.params.flags | CASTOR_RENDER_FIRST_BOUNCE;
    TraceKernels::RayBuffers rays{columns_.ray_origin_tmin, columns_.ray_direction_tmax};
    if (settings_.features.has_motion) {
        rays.time = columns_.ray_time;
        context_.fill_zero(columns_.ray_time, sizeof(columns::ray_time::Element));
    }
    std::vector<std::uint32_t> entered;
    std::size_t found = 0;
    float t_min = camera.t_min;
    for (std::uint32_t i = 0; i < kMostPassed && found < media_of_eye_->size(); ++i) {
        const glm::vec4 origin_tmin(origin, t_min), direction_tmax(direction, std::numeric_limits<float>::infinity());
        context_.write(columns_.ray_origin_tmin, &origin_tmin, sizeof origin_tmin);
        context_.write(columns_.ray_direction_tmax, &direction_tmax, sizeof direction_tmax);
        trace_closest_hits(1, rays, columns_.hits, 1, false);
        find_surfaces();
        Hit hit;
        glm::vec4 normal;
        std::uint32_t material = CASTOR_INVALID_INDEX;
        context_.read(columns_.hits, &hit, sizeof hit);
        context_.read(columns_.surface_normal, &normal, sizeof normal);
        context_.read(columns_.surface_material, &material, sizeof material);
        if (hit.primitive == CASTOR_INVALID_INDEX) break;
        t_min = std::nextafter(hit.t, std::numeric_limits<float>::infinity());
        if (!settings_.solid_materials[material]) continue;
        const auto is_entered = std::find(entered.rbegin(), entered.rend(), material);
        if (glm::dot(glm::vec3(normal), direction) < 0.0f)
            entered.push_back(material);
        else if (is_entered != entered.rend())
            entered.erase(std::next(is_entered).base());
        else
            (*media_of_eye_)[found++] = material;
    }
    params_ = params;
}

/// Makes the column of what traced paths take along, and begins the sums of the slots.
void Wave::make_room_for_records() {
    if (!has_records_) replace(columns_.path_state, make_column<columns::path_state>(context_, most_slots_));
    has_records_ = true;
    context_.fill_zero(columns_.film_terms,
                       params_.path_count * terms_of_sample_ * sizeof(columns::film_terms::Element));
}

void Wave::make_room_for_terms() {
    const std::uint64_t terms = params_.path_count * terms_of_sample_;
    if (terms <= film_terms_count_) return;
    replace(columns_.film_terms, make_column<columns::film_terms>(context_, terms));
    film_terms_count_ = terms;
}

/// The same where paths branch (see path_states.lanes.cl).
void Wave::trace_branches() {
    const std::uint32_t slots = params_.path_count;
    const auto most = static_cast<std::uint32_t>(slots_at_once(true));  // in the queue
    make_room_for_terms();
    context_.fill_zero(columns_.film_terms, slots * sizeof(columns::film_terms::Element));
    const auto sums = columns_.film_terms;
    const auto throughput = columns_.path_throughput;
    if (branch_levels_.empty()) branch_levels_.resize(1);
    branch_levels_[0].sums = sums.as<columns::branch_sums>();
    branch_levels_[0].count = slots;
    branch_levels_[0].queue_begin = branch_levels_[0].queue_end = 0;
    for (std::size_t level = 0;;) {
        BranchLevel& of = branch_levels_[level];
        if (of.queue_end == of.count) {
            if (level == 0) break;
            add_branches(--level);
            continue;
        }
        of.queue_begin = std::exchange(of.queue_end, std::min(of.count, of.queue_end + most));
        begin_queue(level);
        trace_queue(static_cast<std::uint32_t>(level), CASTOR_NODE_EYE);
        if (settings_.any_reflective && level < settings_.max_depth && scatter_branches(level) > 0) ++level;
    }
    replace(columns_.film_terms, sums);
    replace(columns_.path_throughput, throughput);
    add_samples();
}

/// Puts branches of a level into the queue.
void Wave::begin_queue(std::size_t level) {
    const BranchLevel& of = branch_levels_[level];
    replace(columns_.film_terms, of.sums.as<columns::film_terms>());
    params_.path_count = of.queue_end - of.queue_begin;
    params_.flags = settings_.params.flags | (level == 0 ? CASTOR_RENDER_FIRST_BOUNCE : CASTOR_RENDER_BRANCHES);
    if (level == 0) return generate_rays(settings_.camera);
    replace(columns_.path_throughput, of.throughput.as<columns::path_throughput>());
    replace(columns_.path_state, of.state.as<columns::path_state>());
    take_branches_kernel_.enqueue(params_.path_count, {.path_count = params_.path_count,
                                                       .first = of.queue_begin,
                                                       .branch_list = of.list,
                                                       .next_origin_tmin = of.origin_tmin,
                                                       .next_direction_tmax = of.direction_tmax,
                                                       .path_slot = columns_.path_slot,
                                                       .ray_origin_tmin = columns_.ray_origin_tmin,
                                                       .ray_direction_tmax = columns_.ray_direction_tmax});
}

/// Makes the next level of the branches in the queue, which are of this level, and returns how many there are.
std::uint32_t Wave::scatter_branches(std::size_t level) {
    const std::uint32_t place_count = kQueuesOfLevel * row_length();
    if (branch_levels_.size() == level + 1) branch_levels_.emplace_back();
    BranchLevel& next = branch_levels_[level + 1];
    if (next.room < place_count) {
        replace(next.origin_tmin, make_column<columns::next_origin_tmin>(context_, place_count));
        replace(next.direction_tmax, make_column<columns::next_direction_tmax>(context_, place_count));
        replace(next.throughput, make_column<columns::next_throughput>(context_, place_count));
        replace(next.state, make_column<columns::next_state>(context_, place_count));
        replace(next.list, make_column<columns::branch_list>(context_, place_count));
        replace(next.sums, make_column<columns::branch_sums>(context_, place_count));
        next.room = place_count;
    }
    replace(columns_.next_origin_tmin, next.origin_tmin);
    replace(columns_.next_direction_tmax, next.direction_tmax);
    replace(columns_.next_throughput, next.throughput);
    replace(columns_.next_state, next.state);
    scatter(CASTOR_NODE_EYE);
    begin_ranking(place_count);
    next.count = end_ranking(place_count);
    next.queue_begin = next.queue_end = 0;
    if (next.count == 0) return 0;
    write_block_places(place_count);
    list_branches_kernel_.enqueue(place_count, {.place_count = place_count,
                                                .next_rank = columns_.next_rank,
                                                .next_block_places = columns_.next_block_places,
                                                .branch_list = next.list});
    context_.fill_zero(next.sums, place_count * sizeof(columns::branch_sums::Element));
    return next.count;
}

/// Adds the sums of the next level, which is done, to those of this level's branches that had been in the queue.
void Wave::add_branches(std::size_t level) {
    const BranchLevel& of = branch_levels_[level];
    params_.path_count = of.queue_end - of.queue_begin;
    add_branches_kernel_.enqueue(params_.path_count, {.path_count = params_.path_count,
                                                      .first = of.queue_begin,
                                                      .is_eye = level == 0 ? 1u : 0u,
                                                      .row_length = row_length(),
                                                      .branch_list = level == 0 ? branch_levels_[1].list : of.list,
                                                      .branch_sums = branch_levels_[level + 1].sums,
                                                      .film_terms = of.sums.as<columns::film_terms>()});
}

void Wave::generate_rays(const shared::Camera& camera) {
    generate_rays_kernel_.enqueue(params_.path_count, {.params = params_,
                                                       .camera = camera,
                                                       .pixel_blocks = columns_.pixel_blocks,
                                                       .ray_origin_tmin = columns_.ray_origin_tmin,
                                                       .ray_direction_tmax = columns_.ray_direction_tmax,
                                                       .ray_counts = columns_.ray_counts});
}

/// `camera`: whose rays these are at depth 0.
void Wave::trace_closest_hits(const shared::Camera& camera, std::uint32_t depth) {
    // What was scattered diffusely meets both sides of surfaces.
    const bool culls = (params_.flags & CASTOR_RENDER_CULL_BACK_FACES) && (depth == 0 || !traces_paths());
    TraceKernels::RayBuffers rays{columns_.ray_origin_tmin, columns_.ray_direction_tmax};
    const float(&eye)[3] = camera.position;
    if (depth == 0 && camera.projection == CASTOR_PROJECTION_PINHOLE) rays.from = {eye[0], eye[1], eye[2]};
    if (settings_.features.has_motion) rays.time = columns_.ray_time;
    trace_closest_hits(depth, rays, columns_.hits, params_.path_count, culls);
    if (depth == 0 || !culls || !branches()) return;
    // Rays inside dielectrics meet back faces, and flags are those of a launch: they are traced once more, apart.
    if (!has_inside_hits_) replace(columns_.inside_hits, make_column<columns::inside_hits>(context_, most_slots_));
    has_inside_hits_ = true;
    select_rays_inside_kernel_.enqueue(params_.path_count, {.params = params_,
                                                            .path_slot = columns_.path_slot,
                                                            .path_state = columns_.path_state,
                                                            .ray_origin_tmin = columns_.ray_origin_tmin,
                                                            .ray_direction_tmax = columns_.ray_direction_tmax,
                                                            .shadow_origin_tmin = columns_.shadow_origin_tmin,
                                                            .shadow_direction_tmax = columns_.shadow_direction_tmax});
    TraceKernels::RayBuffers inside{columns_.shadow_origin_tmin.as<columns::ray_origin_tmin>(),
                                    columns_.shadow_direction_tmax.as<columns::ray_direction_tmax>()};
    inside.time = rays.time;
    trace_closest_hits(depth, inside, columns_.inside_hits.as<columns::hits>(), params_.path_count, false);
    take_hits_inside_kernel_.enqueue(params_.path_count, {.params = params_,
                                                          .path_slot = columns_.path_slot,
                                                          .path_state = columns_.path_state,
                                                          .inside_hits = columns_.inside_hits,
                                                          .hits = columns_.hits});
}

void Wave::trace_closest_hits(std::uint32_t depth, const TraceKernels::RayBuffers& rays,
                              const DeviceColumn<columns::hits>& hits, std::size_t count, bool culls) {
    const std::uint32_t flags = culls ? CASTOR_TRACE_CULL_BACK_FACES : 0;
    if (settings_.exchange)
        distributed_trace_.closest_hit(rays, hits, count, flags, coherence_at(depth));
    else
        trace_kernels_.closest_hit(context_.queue(), scene_, rays, hits, 0, count, flags, coherence_at(depth));
}

void Wave::trace_shadow_rays(std::uint32_t depth, std::uint32_t ray_count) {
    TraceKernels::RayBuffers rays{columns_.shadow_origin_tmin.as<columns::ray_origin_tmin>(),
                                  columns_.shadow_direction_tmax.as<columns::ray_direction_tmax>()};
    if (settings_.features.has_motion) rays.time = columns_.ray_time;
    if (settings_.exchange)
        distributed_trace_.any_hit(rays, columns_.occluded, ray_count, 0, coherence_at(depth));
    else
        trace_kernels_.any_hit(context_.queue(), scene_, rays, columns_.occluded, 0, ray_count, 0, coherence_at(depth));
}

/// Sends rays on beyond the surfaces that they pass, one after another; those that go on are put side by side. `rays`:
/// all of the queue, with what they met. Of shadow rays this finds those that a surface stops, and what is left of the
/// light of those that pass panes; of others the hits. After kMostPassed surfaces the next one stops a ray.
void Wave::pass_surfaces(const shared::PathParams& path, const SurfaceKernels::Query& rays, bool are_shadow_rays) {
    SurfaceKernels::Query query = rays;
    SurfaceKernels::Bounce bounce{
        params_, path.node, 0, columns_.pixel_blocks, columns_.path_slot, pixel_count_ / CASTOR_BLOCK_SLOTS};
    const std::uint32_t dimension = are_shadow_rays ? CASTOR_DIMENSION_SHADOW_OPACITY : CASTOR_DIMENSION_OPACITY;
    for (std::uint32_t i = 0;; ++i) {
        const bool has_places = i > 0, is_last = i == kMostPassed;
        bounce.dimension = CASTOR_OPACITY_DIMENSION(dimension, i);
        find_passed(bounce, query);
        if (are_shadow_rays && pass_panes_kernel_ &&
            (settings_.features.has_matched_solids || are_any_at_panes(query.count))) {
            bounce.dimension = CASTOR_OPACITY_DIMENSION(CASTOR_DIMENSION_PANE_TEXEL, i);
            pass_panes(path, query, bounce, has_places);
        }
        const std::uint32_t count =
            go_on_beyond(rays, query, has_places,
                         are_shadow_rays ? RaysThatGoOn::passing_to_lights : RaysThatGoOn::passing, is_last);
        if (count == 0) return;
        met_most_passed_ |= is_last;
        if (is_last) return;
        query = trace_on(path.depth, count);
        bounce.params.path_count = count;
        bounce.params.flags &= ~CASTOR_RENDER_FIRST_BOUNCE;
        bounce.path_slot = columns_.passing_slot.as<columns::path_slot>();
    }
}

/// Traces the rays that go_on_beyond has listed.
SurfaceKernels::Query Wave::trace_on(std::uint32_t depth, std::uint32_t count) {
    const SurfaceKernels::Query query{columns_.passing_origin_tmin.as<columns::ray_origin_tmin>(),
                                      columns_.passing_direction_tmax.as<columns::ray_direction_tmax>(),
                                      columns_.inside_hits.as<columns::hits>(), count};
    TraceKernels::RayBuffers rays{query.origin_tmin, query.direction_tmax};
    if (settings_.features.has_motion) rays.time = columns_.passing_time.as<columns::ray_time>();
    trace_closest_hits(depth, rays, query.hits, count, false);
    return query;
}

/// Adds the light of one light a path, to which shadow rays are made.
void Wave::add_light_of_one(const shared::PathParams& path) {
    if (settings_.features.are_shadows_passed())
        trace_shadow_rays_through(path);
    else
        trace_shadow_rays(path.depth, params_.path_count);
    accumulate(1, 0);
}

/// Sends paths through the solids in which they are, where these scatter light, to the next surface. `finds_lights`:
/// adds the light of those lights, too, that no path meets.
void Wave::scatter_within_solids(const shared::PathParams& path, bool finds_lights) {
    const bool sees_lights = light_within_kernel_ && finds_lights;
    scatter_until_surfaces(path, sees_lights);
    if (!sees_lights) return;
    light_within_kernel_->enqueue(params_.path_count, {.params = params_,
                                                       .path_slot = columns_.path_slot,
                                                       .path_state = columns_.path_state,
                                                       .shadow_origin_tmin = columns_.shadow_origin_tmin,
                                                       .shadow_direction_tmax = columns_.shadow_direction_tmax,
                                                       .shadow_contribution = columns_.shadow_contribution,
                                                       .shadow_length = columns_.shadow_length,
                                                       .ray_counts = columns_.ray_counts});
    add_light_of_one(path);
}

/// Sends paths through the solids in which they are, where these scatter light, until each meets a surface or ends. A
/// step of all paths that are still within is: draw how far they go and in which direction (scatter_within), trace
/// their rays. These steps are no bounces. Those that are still within are put side by side after some steps: after
/// twice as many as before where most of them were, since such a list makes the host wait.
void Wave::scatter_until_surfaces(const shared::PathParams& path, bool sees_lights) {
    constexpr std::uint32_t kMostStepsAtOnce = 64;
    SurfaceKernels::Query query = surface_query();
    shared::RenderParams params = params_;
    DeviceColumn<columns::path_slot> path_slot = columns_.path_slot;
    std::uint32_t steps_at_once = 1;
    params_.flags |= CASTOR_RENDER_RECORDS;
    for (std::uint32_t step = 0; step <= kMostScattered;) {
        for (std::uint32_t i = 0; i < steps_at_once && step <= kMostScattered; ++i, ++step) {
            if (i > 0) trace_on(path.depth, params.path_count);
            scatter_within_kernel_->enqueue(query.count,
                                            {.params = params,
                                             .path = path,
                                             .step = step,
                                             .is_last = step == kMostScattered ? 1u : 0u,
                                             .has_roulette = settings_.path_tracing->roulette_from ? 1u : 0u,
                                             .sees_lights = sees_lights ? 1u : 0u,
                                             .materials = scene_.columns().materials,
                                             .principled_materials = scene_.columns().principled_materials,
                                             .lights = scene_.columns().lights,
                                             .light_groups = columns_.light_groups,
                                             .pixel_blocks = columns_.pixel_blocks,
                                             .path_slot = path_slot,
                                             .passing_places = columns_.passing_places,
                                             .inside_hits = query.hits.as<columns::inside_hits>(),
                                             .hits = columns_.hits,
                                             .ray_origin_tmin = columns_.ray_origin_tmin,
                                             .ray_direction_tmax = columns_.ray_direction_tmax,
                                             .passing_origin_tmin = columns_.passing_origin_tmin,
                                             .passing_direction_tmax = columns_.passing_direction_tmax,
                                             .path_throughput = columns_.path_throughput,
                                             .path_state = columns_.path_state,
                                             .passed = columns_.passed,
                                             .shadow_origin_tmin = columns_.shadow_origin_tmin,
                                             .shadow_direction_tmax = columns_.shadow_direction_tmax,
                                             .shadow_contribution = columns_.shadow_contribution,
                                             .shadow_medium = columns_.shadow_medium,
                                             .shadow_outer = columns_.shadow_outer});
        }
        const bool is_last = step > kMostScattered, has_places = step > 1;  // the first time is step 0 alone
        const std::uint32_t count = go_on_beyond(surface_query(), query, has_places, RaysThatGoOn::scattered, is_last);
        if (count == 0) return;
        if (is_last) {
            met_most_scattered_ = true;
            return;
        }
        steps_at_once = 4 * std::uint64_t{count} > 3 * query.count ? std::min(2 * steps_at_once, kMostStepsAtOnce)
                                                                   : std::max(steps_at_once / 2, 1u);
        query = trace_on(path.depth, count);
        params.path_count = count;
        params.flags &= ~CASTOR_RENDER_FIRST_BOUNCE;
        path_slot = columns_.passing_slot.as<columns::path_slot>();
    }
}

/// Finds which of the rays pass what they met.
void Wave::find_passed(const SurfaceKernels::Bounce& bounce, const SurfaceKernels::Query& query) {
    if (settings_.exchange) {
        context_.fill_zero(columns_.passed, in_words(query.count));  // of surfaces that others have
        distributed_trace_.find_passed(surface_kernels_, query, bounce, columns_.passed);
    } else {
        surface_kernels_.find_passed(scene_, query, bounce, columns_.passed);
    }
}

/// Returns whether find_passed left any of so many rays at panes.
bool Wave::are_any_at_panes(std::size_t count) {
    passed_.resize(count);
    context_.read(columns_.passed, passed_.data(), count);
    return std::find(passed_.begin(), passed_.end(), CASTOR_AT_PANE) != passed_.end();
}

/// Lists the rays that pass what they met, with what they are traced on with, and returns how many there are. `rays`:
/// all of the queue. `query`: those that were listed before, if `has_places`; else all.
std::uint32_t Wave::go_on_beyond(const SurfaceKernels::Query& rays, const SurfaceKernels::Query& query, bool has_places,
                                 RaysThatGoOn kind, bool is_last) {
    go_on_beyond_kernel_->enqueue(query.count, {.params = params_,
                                                .count = static_cast<cl_uint>(query.count),
                                                .has_places = has_places ? 1u : 0u,
                                                .are_shadow_rays = kind == RaysThatGoOn::passing_to_lights ? 1u : 0u,
                                                .are_scattered = kind == RaysThatGoOn::scattered ? 1u : 0u,
                                                .is_last = is_last ? 1u : 0u,
                                                .has_times = settings_.features.has_motion ? 1u : 0u,
                                                .turn = passing_turn_,
                                                .passing_places = columns_.passing_places,
                                                .inside_hits = query.hits.as<columns::inside_hits>(),
                                                .passed = columns_.passed,
                                                .path_slot = columns_.path_slot,
                                                .ray_time = columns_.ray_time,
                                                .ray_origin_tmin = rays.origin_tmin,
                                                .ray_direction_tmax = rays.direction_tmax,
                                                .hits = columns_.hits,
                                                .occluded = columns_.occluded,
                                                .passing_counts = columns_.passing_counts,
                                                .next_passing_places = columns_.next_passing_places,
                                                .passing_slot = columns_.passing_slot,
                                                .passing_time = columns_.passing_time,
                                                .passing_origin_tmin = columns_.passing_origin_tmin,
                                                .passing_direction_tmax = columns_.passing_direction_tmax});
    std::uint32_t counts[2];
    context_.read(columns_.passing_counts, counts, sizeof counts);
    const auto places = columns_.passing_places;
    replace(columns_.passing_places, columns_.next_passing_places.as<columns::passing_places>());
    replace(columns_.next_passing_places, places.as<columns::next_passing_places>());
    return counts[std::exchange(passing_turn_, 1 - passing_turn_)];
}

/// Finds which of the shadow rays at panes pass them. Overwrites the surfaces, which a bounce needs no more.
void Wave::pass_panes(const shared::PathParams& path, SurfaceKernels::Query query, const SurfaceKernels::Bounce& bounce,
                      bool has_places) {
    if (settings_.features.has_motion) {
        if (!has_rest_origins_)
            replace(columns_.rest_origin_tmin, make_column<columns::rest_origin_tmin>(context_, most_slots_));
        has_rest_origins_ = true;
        const auto time = has_places ? columns_.passing_time.as<columns::ray_time>() : columns_.ray_time;
        query.origin_tmin = moved_origins(query, time, columns_.rest_origin_tmin);
    }
    find_surfaces(query);
    pass_panes_kernel_->enqueue(query.count, {.params = bounce.params,
                                              .path = path,
                                              .dimension = bounce.dimension,
                                              .has_places = has_places ? 1u : 0u,
                                              .materials = scene_.columns().materials,
                                              .principled_materials = scene_.columns().principled_materials,
                                              .textures = scene_.columns().textures,
                                              .texture_images = scene_.columns().texture_images,
                                              .texels = scene_.columns().texels,
                                              .pixel_blocks = columns_.pixel_blocks,
                                              .path_slot = bounce.path_slot,
                                              .passing_places = columns_.passing_places,
                                              .ray_origin_tmin = query.origin_tmin,
                                              .ray_direction_tmax = query.direction_tmax,
                                              .hits = query.hits,
                                              .surface_normal = columns_.surface_normal,
                                              .surface_material = columns_.surface_material,
                                              .surface_uvs = columns_.surface_uvs,
                                              .surface_tangent = columns_.surface_tangent,
                                              .surface_color = columns_.surface_color,
                                              .shadow_length = columns_.shadow_length,
                                              .shadow_medium = columns_.shadow_medium,
                                              .shadow_outer = columns_.shadow_outer,
                                              .shadow_contribution = columns_.shadow_contribution,
                                              .passed = columns_.passed});
}

/// Finds the shadow rays that a surface stops, where they may pass some.
void Wave::trace_shadow_rays_through(const shared::PathParams& path) {
    const SurfaceKernels::Query query{columns_.shadow_origin_tmin.as<columns::ray_origin_tmin>(),
                                      columns_.shadow_direction_tmax.as<columns::ray_direction_tmax>(),
                                      columns_.inside_hits.as<columns::hits>(), params_.path_count};
    TraceKernels::RayBuffers rays{query.origin_tmin, query.direction_tmax};
    if (settings_.features.has_motion) rays.time = columns_.ray_time;
    context_.fill_zero(columns_.occluded, in_words(query.count));
    trace_closest_hits(path.depth, rays, query.hits, query.count, false);
    pass_surfaces(path, query, true);
}

/// Draws the times of the paths in the queue.
void Wave::draw_times() {
    if (!settings_.features.has_motion || params_.path_count == 0) return;
    draw_times_kernel_.enqueue(params_.path_count, {.params = params_,
                                                    .pixel_blocks = columns_.pixel_blocks,
                                                    .path_slot = columns_.path_slot,
                                                    .path_state = columns_.path_state,
                                                    .ray_time = columns_.ray_time});
}

/// Writes origins of rays that are moved instead of what they met, which is then found as it rests.
DeviceColumn<columns::ray_origin_tmin> Wave::moved_origins(const SurfaceKernels::Query& query,
                                                           const DeviceColumn<columns::ray_time>& time,
                                                           const DeviceColumn<columns::rest_origin_tmin>& rest) {
    move_rays_kernel_.enqueue(query.count, {.params = params_,
                                            .instances = scene_.columns().instances,
                                            .ray_time = time,
                                            .hits = query.hits,
                                            .ray_origin_tmin = query.origin_tmin,
                                            .rest_origin_tmin = rest});
    return rest.as<columns::ray_origin_tmin>();
}

/// Finds what moves as it rests, and moves the points that were met.
void Wave::find_surfaces() {
    SurfaceKernels::Query query = surface_query();
    if (!settings_.features.has_motion) return find_surfaces(query);
    query.origin_tmin =
        moved_origins(query, columns_.ray_time, columns_.shadow_origin_tmin.as<columns::rest_origin_tmin>());
    find_surfaces(query);
    move_surfaces_kernel_.enqueue(params_.path_count, {.params = params_,
                                                       .instances = scene_.columns().instances,
                                                       .ray_time = columns_.ray_time,
                                                       .hits = columns_.hits,
                                                       .surface_position = columns_.surface_position});
}

SurfaceKernels::Query Wave::surface_query() const {
    return {columns_.ray_origin_tmin, columns_.ray_direction_tmax, columns_.hits, params_.path_count};
}

void Wave::find_surfaces(SurfaceKernels::Query query) {
    if (traces_paths()) query.flags = CASTOR_TRACE_BENDS_NORMALS;  // the course's rules take normals as they are
    const SurfaceKernels::Surfaces surfaces{columns_.surface_position, columns_.surface_normal,
                                            columns_.surface_material, columns_.surface_diffuse,
                                            columns_.surface_specular};
    if (settings_.exchange)
        distributed_trace_.find_surfaces(surface_kernels_, query, surfaces, pixel_spread(settings_.camera));
    else
        surface_kernels_.find(scene_, query, surfaces, pixel_spread(settings_.camera));
    if (!settings_.features.has_attributes) return;
    const SurfaceKernels::Attributes attributes{columns_.surface_uvs, columns_.surface_tangent, columns_.surface_color};
    if (settings_.exchange)
        distributed_trace_.find_attributes(surface_kernels_, query, attributes);
    else
        surface_kernels_.find_attributes(scene_, query, attributes);
}

bool Wave::has_background_texture() const {
    return params_.flags & CASTOR_RENDER_BACKGROUND_TEXTURE;
}

/// Gives the eye rays that met nothing a texel of the background.
void Wave::texture_background() {
    const shared::TextureParams texture_params{.path_count = params_.path_count,
                                               .background = settings_.background_texture,
                                               .pixel_spread = pixel_spread(settings_.camera),
                                               .reserved = 0};
    texture_background_kernel_->enqueue(params_.path_count, {.texture_params = texture_params,
                                                             .params = params_,
                                                             .camera = settings_.camera,
                                                             .textures = scene_.columns().textures,
                                                             .texture_images = scene_.columns().texture_images,
                                                             .texels = scene_.columns().texels,
                                                             .pixel_blocks = columns_.pixel_blocks,
                                                             .surface_material = columns_.surface_material,
                                                             .surface_diffuse = columns_.surface_diffuse});
}

void Wave::shade(std::uint32_t depth) {
    shade_kernel_->enqueue(params_.path_count, {.params = params_,
                                                .depth = depth,
                                                .terms_of_bounce = terms_of_bounce(settings_),
                                                .materials = scene_.columns().materials,
                                                .lights = scene_.columns().lights,
                                                .texture_images = scene_.columns().texture_images,
                                                .texels = scene_.columns().texels,
                                                .path_slot = columns_.path_slot,
                                                .path_state = columns_.path_state,
                                                .ray_direction_tmax = columns_.ray_direction_tmax,
                                                .hits = columns_.hits,
                                                .surface_normal = columns_.surface_normal,
                                                .surface_material = columns_.surface_material,
                                                .surface_diffuse = columns_.surface_diffuse,
                                                .path_throughput = columns_.path_throughput,
                                                .path_terms = columns_.path_terms,
                                                .film_sum = columns_.film_sum,
                                                .film_terms = columns_.film_terms});
}

/// Adds the light of all lights: of as many at a time as there is room for, since many launches for few paths would
/// cost more than their work.
void Wave::add_lights(std::uint32_t depth, std::uint32_t node) {
    // What moves has a time for each place, not for each ray.
    const std::uint64_t most =
        settings_.features.has_motion ? 1 : std::max<std::uint64_t>(1, counted_slots() / row_length());
    std::uint32_t term = depth * terms_of_bounce(settings_) + 1;
    for (Range left = settings_.lights; left.size() > 0;) {
        const auto count = static_cast<std::uint32_t>(std::min(most, left.size()));
        add_lights(static_cast<std::uint32_t>(left.begin), count, term, depth, node);
        left.begin += count;
        term += count;
    }
}

void Wave::add_lights(std::uint32_t first, std::uint32_t count, std::uint32_t first_term, std::uint32_t depth,
                      std::uint32_t node) {
    const std::uint32_t row_length = this->row_length();
    generate_shadow_rays_kernel_->enqueue(std::uint64_t{count} * row_length,
                                          {.params = params_,
                                           .node = node,
                                           .first_light = first,
                                           .light_count = count,
                                           .row_length = row_length,
                                           .first_term = first_term,
                                           .lights = scene_.columns().lights,
                                           .emitters = scene_.columns().emitters,
                                           .instances = scene_.columns().instances,
                                           .texture_images = scene_.columns().texture_images,
                                           .texels = scene_.columns().texels,
                                           .environment_parts = scene_.columns().environment_parts,
                                           .pixel_blocks = columns_.pixel_blocks,
                                           .materials = scene_.columns().materials,
                                           .path_slot = columns_.path_slot,
                                           .path_state = columns_.path_state,
                                           .ray_time = columns_.ray_time,
                                           .surface_position = columns_.surface_position,
                                           .surface_normal = columns_.surface_normal,
                                           .ray_direction_tmax = columns_.ray_direction_tmax,
                                           .surface_material = columns_.surface_material,
                                           .surface_diffuse = columns_.surface_diffuse,
                                           .surface_specular = columns_.surface_specular,
                                           .path_throughput = columns_.path_throughput,
                                           .shadow_origin_tmin = columns_.shadow_origin_tmin,
                                           .shadow_direction_tmax = columns_.shadow_direction_tmax,
                                           .shadow_contribution = columns_.shadow_contribution,
                                           .film_terms = columns_.film_terms,
                                           .ray_counts = columns_.ray_counts});
    trace_shadow_rays(depth, (count - 1) * row_length + params_.path_count);
    accumulate(count, first_term);
}

/// Adds what shadow rays that were not stopped contribute.
void Wave::accumulate(std::uint32_t light_count, std::uint32_t first_term) {
    accumulate_kernel_.enqueue(params_.path_count, {.params = params_,
                                                    .light_count = light_count,
                                                    .row_length = row_length(),
                                                    .first_term = first_term,
                                                    .path_slot = columns_.path_slot,
                                                    .shadow_contribution = columns_.shadow_contribution,
                                                    .occluded = columns_.occluded,
                                                    .film_sum = columns_.film_sum,
                                                    .film_terms = columns_.film_terms});
}

/// Sends paths on. `node`: of all paths, where they do not branch.
void Wave::scatter(std::uint32_t node) {
    scatter_kernel_->enqueue(branches() ? row_length() : params_.path_count,
                             {.params = params_,
                              .node = node,
                              .row_length = row_length(),
                              .materials = scene_.columns().materials,
                              .pixel_blocks = columns_.pixel_blocks,
                              .path_slot = columns_.path_slot,
                              .path_state = columns_.path_state,
                              .surface_position = columns_.surface_position,
                              .surface_normal = columns_.surface_normal,
                              .ray_direction_tmax = columns_.ray_direction_tmax,
                              .surface_material = columns_.surface_material,
                              .surface_diffuse = columns_.surface_diffuse,
                              .surface_specular = columns_.surface_specular,
                              .path_throughput = columns_.path_throughput,
                              .next_slot = columns_.next_slot,
                              .next_origin_tmin = columns_.next_origin_tmin,
                              .next_direction_tmax = columns_.next_direction_tmax,
                              .next_throughput = columns_.next_throughput,
                              .next_state = columns_.next_state,
                              .next_rank = columns_.next_rank,
                              .ray_counts = columns_.ray_counts});
}

/// Ranks the paths at the first places of the next queue that go on. While end_ranking waits for their number, the
/// device does what is enqueued in between.
void Wave::begin_ranking(std::uint32_t place_count) {
    const std::size_t blocks = blocks_of_places(place_count);
    rank_paths_kernel_.enqueue(
        blocks,
        {.place_count = place_count, .next_rank = columns_.next_rank, .next_block_places = columns_.next_block_places});
    ranking_ = context_.begin_read(columns_.next_block_places, next_block_places_.data(), blocks * sizeof(cl_uint));
}

/// Returns how many paths go on, when that is known.
std::uint32_t Wave::end_ranking(std::uint32_t place_count) {
    context_.wait(std::exchange(ranking_, {}));
    std::uint32_t next_count = 0;
    for (std::size_t block = 0; block < blocks_of_places(place_count); ++block)
        next_count += std::exchange(next_block_places_[block], next_count);
    return next_count;
}

/// Tells the device where the paths of each block begin.
void Wave::write_block_places(std::uint32_t place_count) {
    context_.begin_write(columns_.next_block_places, next_block_places_.data(),
                         blocks_of_places(place_count) * sizeof(cl_uint));
}

/// Replaces the queue by that of the paths that go on, after begin_ranking.
void Wave::replace_queue() {
    const std::uint32_t next_count = end_ranking(params_.path_count);
    if (next_count == params_.path_count) {
        // All paths go on, each at its place: the next rays and slots become the present ones where they stand.
        const auto slot = columns_.path_slot;
        replace(columns_.path_slot, columns_.next_slot.as<columns::path_slot>());
        replace(columns_.next_slot, slot.as<columns::next_slot>());
        const auto origin_tmin = columns_.ray_origin_tmin;
        const auto direction_tmax = columns_.ray_direction_tmax;
        replace(columns_.ray_origin_tmin, columns_.next_origin_tmin.as<columns::ray_origin_tmin>());
        replace(columns_.ray_direction_tmax, columns_.next_direction_tmax.as<columns::ray_direction_tmax>());
        if (traces_paths()) {
            replace(columns_.next_origin_tmin, origin_tmin.as<columns::next_origin_tmin>());
            replace(columns_.next_direction_tmax, direction_tmax.as<columns::next_direction_tmax>());
        } else {
            replace(columns_.shadow_origin_tmin, origin_tmin.as<columns::shadow_origin_tmin>());
            replace(columns_.shadow_direction_tmax, direction_tmax.as<columns::shadow_direction_tmax>());
            share_shadow_rays();
        }
    } else if (next_count > 0) {
        write_block_places(params_.path_count);
        compact_paths_kernel_.enqueue(params_.path_count, {.params = params_,
                                                           .next_rank = columns_.next_rank,
                                                           .next_block_places = columns_.next_block_places,
                                                           .next_slot = columns_.next_slot,
                                                           .next_origin_tmin = columns_.next_origin_tmin,
                                                           .next_direction_tmax = columns_.next_direction_tmax,
                                                           .path_slot = columns_.path_slot,
                                                           .ray_origin_tmin = columns_.ray_origin_tmin,
                                                           .ray_direction_tmax = columns_.ray_direction_tmax});
    }
    params_.path_count = next_count;
}

/// Finds the colours of principled surfaces that planes of albedos have.
void Wave::find_base_colors(const shared::PathParams& path) {
    if (!settings_.features.has_attributes) return;
    if (!find_base_colors_kernel_) find_base_colors_kernel_.emplace(context_, build_options(settings_.features));
    find_base_colors_kernel_->enqueue(params_.path_count,
                                      {.params = params_,
                                       .path = path,
                                       .materials = scene_.columns().materials,
                                       .principled_materials = scene_.columns().principled_materials,
                                       .textures = scene_.columns().textures,
                                       .texture_images = scene_.columns().texture_images,
                                       .texels = scene_.columns().texels,
                                       .pixel_blocks = columns_.pixel_blocks,
                                       .path_slot = columns_.path_slot,
                                       .ray_direction_tmax = columns_.ray_direction_tmax,
                                       .hits = columns_.hits,
                                       .surface_normal = columns_.surface_normal,
                                       .surface_material = columns_.surface_material,
                                       .surface_uvs = columns_.surface_uvs,
                                       .surface_tangent = columns_.surface_tangent,
                                       .surface_color = columns_.surface_color,
                                       .surface_diffuse = columns_.surface_diffuse});
}

void Wave::shade_paths(const shared::PathParams& path) {
    shade_paths_kernel_->enqueue(params_.path_count, {.params = params_,
                                                      .path = path,
                                                      .materials = scene_.columns().materials,
                                                      .principled_materials = scene_.columns().principled_materials,
                                                      .lights = scene_.columns().lights,
                                                      .emitters = scene_.columns().emitters,
                                                      .instances = scene_.columns().instances,
                                                      .textures = scene_.columns().textures,
                                                      .texture_images = scene_.columns().texture_images,
                                                      .texels = scene_.columns().texels,
                                                      .environment_parts = scene_.columns().environment_parts,
                                                      .light_nodes = scene_.columns().light_nodes,
                                                      .light_groups = columns_.light_groups,
                                                      .emission_groups = columns_.emission_groups,
                                                      .pixel_blocks = columns_.pixel_blocks,
                                                      .path_slot = columns_.path_slot,
                                                      .ray_time = columns_.ray_time,
                                                      .ray_origin_tmin = columns_.ray_origin_tmin,
                                                      .ray_direction_tmax = columns_.ray_direction_tmax,
                                                      .hits = columns_.hits,
                                                      .surface_position = columns_.surface_position,
                                                      .surface_normal = columns_.surface_normal,
                                                      .surface_material = columns_.surface_material,
                                                      .surface_diffuse = columns_.surface_diffuse,
                                                      .surface_specular = columns_.surface_specular,
                                                      .surface_uvs = columns_.surface_uvs,
                                                      .surface_tangent = columns_.surface_tangent,
                                                      .surface_color = columns_.surface_color,
                                                      .path_throughput = columns_.path_throughput,
                                                      .path_state = columns_.path_state,
                                                      .film_terms = columns_.film_terms,
                                                      .shadow_origin_tmin = columns_.shadow_origin_tmin,
                                                      .shadow_direction_tmax = columns_.shadow_direction_tmax,
                                                      .shadow_contribution = columns_.shadow_contribution,
                                                      .shadow_length = columns_.shadow_length,
                                                      .shadow_medium = columns_.shadow_medium,
                                                      .shadow_outer = columns_.shadow_outer,
                                                      .next_slot = columns_.next_slot,
                                                      .next_origin_tmin = columns_.next_origin_tmin,
                                                      .next_direction_tmax = columns_.next_direction_tmax,
                                                      .next_rank = columns_.next_rank,
                                                      .ray_counts = columns_.ray_counts});
}

/// Adds what the eye rays met, before the background's texture takes the place of surfaces that there are none of.
void Wave::add_features() {
    add_features_kernel_->enqueue(params_.pixel_count, {.params = params_,
                                                        .row_length = pixel_count_,
                                                        .materials = scene_.columns().materials,
                                                        .hits = columns_.hits,
                                                        .surface_position = columns_.surface_position,
                                                        .surface_normal = columns_.surface_normal,
                                                        .surface_material = columns_.surface_material,
                                                        .surface_diffuse = columns_.surface_diffuse,
                                                        .film_features = columns_.film_features});
}

/// Adds what the samples found of groups of lights.
void Wave::add_groups() {
    add_groups_kernel_->enqueue(params_.pixel_count, {.params = params_,
                                                      .row_length = pixel_count_,
                                                      .first_row = settings_.wants_features ? CASTOR_FEATURES : 0,
                                                      .group_count = settings_.group_count(),
                                                      .film_terms = columns_.film_terms,
                                                      .film_features = columns_.film_features});
}

void Wave::add_samples() {
    add_samples_kernel_.enqueue(params_.pixel_count, {.params = params_,
                                                      .path_terms = columns_.path_terms,
                                                      .film_terms = columns_.film_terms,
                                                      .film_sum = columns_.film_sum});
}

std::vector<glm::vec3> Wave::resolve(std::uint32_t sample_count) {
    resolve_kernel_.enqueue(pixel_count_, {.pixel_count = pixel_count_,
                                           .sample_count = sample_count,
                                           .film_sum = columns_.film_sum,
                                           .pixel_means = columns_.pixel_means});
    std::vector<glm::vec3> means(pixel_count_);
    context_.read(columns_.pixel_means, means.data(), means.size() * sizeof(glm::vec3));
    return means;
}

std::vector<glm::vec4> Wave::sums() {
    const std::size_t rows = 1 + feature_rows();
    std::vector<glm::vec4> sums(pixel_count_ * rows);
    context_.read(columns_.film_sum, sums.data(), pixel_count_ * sizeof(glm::vec4));
    if (rows > 1)
        context_.read(columns_.film_features, sums.data() + pixel_count_,
                      (rows - 1) * pixel_count_ * sizeof(glm::vec4));
    return sums;
}

std::uint64_t Wave::ray_count() {
    std::vector<std::uint32_t> counts(counted_slots());
    context_.read(columns_.ray_counts, counts.data(), counts.size() * sizeof(std::uint32_t));
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

/// Finds the texture coordinates of what eye rays met, where a plane wants them.
void Wave::find_uvs() {
    context_.fill_zero(columns_.surface_uv, pixel_count_ * sizeof(glm::vec2));
    if (!settings_.wants_uv) return;
    const SurfaceKernels::Query query = surface_query();
    if (settings_.exchange)
        distributed_trace_.find_uvs(surface_kernels_, query, columns_.surface_uv);
    else
        surface_kernels_.find_uvs(scene_, query, columns_.surface_uv);
}

WaveAovs Wave::trace_aovs(std::span<const std::uint32_t> blocks) {
    begin(blocks);
    const std::size_t count = pixel_count_;
    params_.path_count = params_.pixel_count = pixel_count_;
    params_.first_pixel = params_.sample_shift = params_.sample = 0;
    params_.flags = settings_.params.flags | CASTOR_RENDER_PIXEL_CENTRES | CASTOR_RENDER_FIRST_BOUNCE;
    replace(columns_.aov_position_depth, make_column<columns::aov_position_depth>(context_, count));
    replace(columns_.aov_normal, make_column<columns::aov_normal>(context_, count));
    replace(columns_.aov_barycentric_t, make_column<columns::aov_barycentric_t>(context_, count));
    replace(columns_.aov_primitive_instance_material,
            make_column<columns::aov_primitive_instance_material>(context_, count));
    replace(columns_.aov_albedo, make_column<columns::aov_albedo>(context_, count));
    replace(columns_.aov_uv, make_column<columns::aov_uv>(context_, count));
    replace(columns_.surface_uv, make_column<columns::surface_uv>(context_, count));
    shared::Camera pinhole = settings_.camera;
    if (pinhole.projection == CASTOR_PROJECTION_LENS) pinhole.projection = CASTOR_PROJECTION_PINHOLE;
    generate_rays(pinhole);
    if (settings_.features.has_motion) context_.fill_zero(columns_.ray_time, count * sizeof(float));
    trace_closest_hits(pinhole, 0);
    shared::PathParams path{};
    path.node = CASTOR_NODE_EYE;
    path.pixel_spread = pixel_spread(settings_.camera);
    if (settings_.features.has_opacity) pass_surfaces(path, surface_query(), false);
    find_surfaces();
    find_uvs();
    find_base_colors(path);
    RenderFeatures of_scene = settings_.features;
    of_scene.traces_paths = of_scene.has_attributes;
    Kernel<WriteAovs>(context_, build_options(of_scene))
        .enqueue(count, {.params = params_,
                         .materials = scene_.columns().materials,
                         .ray_origin_tmin = columns_.ray_origin_tmin,
                         .hits = columns_.hits,
                         .surface_position = columns_.surface_position,
                         .surface_normal = columns_.surface_normal,
                         .surface_material = columns_.surface_material,
                         .surface_diffuse = columns_.surface_diffuse,
                         .surface_uv = columns_.surface_uv,
                         .aov_position_depth = columns_.aov_position_depth,
                         .aov_normal = columns_.aov_normal,
                         .aov_barycentric_t = columns_.aov_barycentric_t,
                         .aov_primitive_instance_material = columns_.aov_primitive_instance_material,
                         .aov_albedo = columns_.aov_albedo,
                         .aov_uv = columns_.aov_uv});

    WaveAovs aovs;
    const auto read = [&](const cl::Buffer& column, auto& values) {
        values.resize(4 * count);
        context_.read(column, values.data(), values.size() * sizeof values[0]);
    };
    read(columns_.aov_position_depth, aovs.position_depth);
    read(columns_.aov_normal, aovs.normal);
    read(columns_.aov_barycentric_t, aovs.barycentric_t);
    read(columns_.aov_primitive_instance_material, aovs.primitive_instance_material);
    read(columns_.aov_albedo, aovs.albedo);
    read(columns_.aov_uv, aovs.uv);
    return aovs;
}

}  // namespace castor
