#include "render/device_worker.h"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "base/stopwatch.h"
#include "trace/device_pace.h"

namespace castor {

namespace {

// Each is some ten commands for the driver to queue.
constexpr std::uint64_t kMostWavesInSlice = 16;

// The first is not representative, the second is small.
constexpr int kMeasuredSlices = 3;

// A wave is made anew where there could be so many times as much room.
constexpr std::uint64_t kMuchRoom = 4;

class DeviceWorker : public PieceWorker {
public:
    /// `lock` is that of the team.
    DeviceWorker(std::shared_ptr<RenderDevice> device, RenderTeam& team, std::unique_lock<std::timed_mutex> lock,
                 const WaveSettings& settings, const PixelBlocks& blocks, std::uint32_t samples_per_pixel,
                 const WaveSize& size)
        : device_(std::move(device)),
          team_(team),
          lock_(std::move(lock)),
          blocks_(blocks),
          samples_per_pixel_(samples_per_pixel),
          most_blocks_(size.blocks),
          few_take_as_long_(device_->scene.streaming_count() > 0 || settings.exchange ||
                            (settings.path_tracing && settings.features.has_scattering)) {
        const Stopwatch watch;
        if (!team_.wave || team_.wave_room < size.blocks || kMuchRoom * team_.wave_room <= size.room ||
            !team_.wave->suits(settings.features)) {
            team_.wave.reset();
            team_.wave = std::make_unique<Wave>(*team_.context, device_->scene, device_->tuning, settings, size.room);
            team_.wave_room = size.room;
        }
        team_.wave->set_picture(settings);
        if (!team_.pace)
            team_.pace =
                first_pace(device_->tuning.strategies.of(Query::closest, Coherence::coherent), team_.context->device());
        setup_seconds_ = watch.seconds();
    }

    double setup_seconds() const override { return setup_seconds_; }
    double block_samples_per_second() const override { return team_.pace->items_per_second(); }
    std::uint64_t blocks_wanted() const override {
        // As many samples as are best traced side by side are to fit into a slice.
        const std::uint64_t samples = std::min(team_.wave->samples_of_bundle(), samples_per_pixel_);
        return few_take_as_long_
                   ? most_blocks_
                   : std::max<std::uint64_t>(1, team_.pace->items_in_slice(samples * most_blocks_) / samples);
    }
    std::uint64_t most_blocks() const override { return most_blocks_; }

    void measure(const Range& blocks, const std::function<bool()>& is_needed) override {
        if (team_.pace->is_known() || few_take_as_long_) return;
        with_device_errors(*device_, [&] {
            for (int i = 0; i < kMeasuredSlices && is_needed(); ++i) {
                const std::uint64_t count = team_.pace->items_in_slice(std::min(most_blocks_, blocks.size()));
                std::vector<std::uint32_t> codes;
                for (std::uint64_t k = 0; k < count; ++k)
                    codes.push_back(code_of(blocks.begin + k * blocks.size() / count));
                team_.wave->begin(codes);
                trace_slice(count, 0, 1);
            }
        });
    }

    PieceResult render(const PieceOrder& order, const OnSamples& on_samples) override {
        return with_device_errors(*device_, [&] { return render_piece(order, on_samples); });
    }

private:
    PieceResult render_piece(const PieceOrder& order, const OnSamples& on_samples) {
        std::vector<std::uint32_t> codes;
        for (const std::uint32_t block : order.begin.blocks) codes.push_back(code_of(block));
        Wave& wave = *team_.wave;
        PieceResult result;
        if (order.wants_planes) result.planes = wave.trace_aovs(codes);
        wave.begin(codes, order.begin.sums);
        std::uint32_t samples = order.begin.samples;
        for (bool goes_on = true; goes_on && samples < order.samples; goes_on = on_samples(samples)) {
            const std::uint64_t at_once = wave.samples_at_once();
            const std::uint64_t most =
                std::max(at_once, kMostWavesInSlice * wave.most_slots() / CASTOR_BLOCK_SLOTS / codes.size());
            const std::uint64_t left = std::min<std::uint64_t>(order.samples - samples, most);
            const std::uint64_t in_slice = team_.pace->items_in_slice(left * codes.size()) / codes.size();
            std::uint64_t now = std::clamp<std::uint64_t>(few_take_as_long_ ? at_once : in_slice, 1, left);
            if (now > at_once) now -= now % at_once;
            trace_slice(codes.size(), samples, static_cast<std::uint32_t>(now));
            samples += static_cast<std::uint32_t>(now);
        }
        result.state.blocks = order.begin.blocks;
        result.state.samples = samples;
        result.rays = wave.ray_count();
        result.met_most_passed = wave.take_met_most_passed();
        result.met_most_scattered = wave.take_met_most_scattered();
        if (samples == samples_per_pixel_) result.state.means = wave.resolve(samples);
        if (samples < samples_per_pixel_ || order.wants_all_sums) result.state.sums = wave.sums();
        return result;
    }

    void trace_slice(std::uint64_t blocks, std::uint32_t first_sample, std::uint32_t count) {
        const Stopwatch watch;
        team_.wave->trace_samples(first_sample, count);
        team_.wave->wait(team_.pace->expected_seconds(count * blocks));
        team_.pace->add(count * blocks, watch.seconds());
    }

    std::uint32_t code_of(std::uint64_t block) const { return blocks_.code(static_cast<std::uint32_t>(block)); }

    std::shared_ptr<RenderDevice> device_;
    RenderTeam& team_;  // of the device
    std::unique_lock<std::timed_mutex> lock_;
    PixelBlocks blocks_;
    std::uint32_t samples_per_pixel_;
    std::uint64_t most_blocks_;
    // Few samples take as long as many: chunks stream, or others keep some, or solids scatter light.
    bool few_take_as_long_;
    double setup_seconds_ = 0.0;
};

PieceWorkerOffer offer(const std::shared_ptr<RenderDevice>& device, RenderTeam& team, std::size_t number,
                       const WaveSettings& settings, const PixelBlocks& blocks, std::uint32_t samples_per_pixel,
                       std::uint32_t tile_size) {
    const WaveSize size = wave_size(team.context->device(), blocks.count(), samples_per_pixel, tile_size,
                                    CASTOR_FEATURES + settings.group_count());
    const auto make = [=, &team](const std::function<bool()>& is_needed) -> std::unique_ptr<PieceWorker> {
        auto lock = lock_for_work(team.mutex, is_needed);
        if (!lock) return nullptr;
        return with_device_errors(*device, [&] {
            return std::make_unique<DeviceWorker>(device, team, std::move(lock), settings, blocks, samples_per_pixel,
                                                  size);
        });
    };
    const Device& described = device->context.device();
    return {label(described),
            device->setup_seconds,
            device->context.quirks().stays_in_thread,
            make,
            described.host,
            number};
}

}  // namespace

RenderDevice::RenderDevice(const Device& device, const std::shared_ptr<SceneContents>& scene_contents,
                           const Tuning& device_tuning, const Range& kept_chunks)
    : SceneDevice(device, scene_contents, device_tuning, kept_chunks), whole(own_context, mutex) {
    // Chunks that take turns on the device do so for all of it.
    if (context.team_count() == 1 || scene.streaming_count() > 0) return;
    for (std::size_t i = 0; i < context.team_count(); ++i)
        teams.emplace_back(std::make_shared<DeviceContext>(context, i), team_mutexes.emplace_back());
}

std::vector<PieceWorkerOffer> offers_of(const std::shared_ptr<RenderDevice>& device, std::size_t number, bool by_teams,
                                        const WaveSettings& settings, const PixelBlocks& blocks,
                                        std::uint32_t samples_per_pixel, std::uint32_t tile_size) {
    const auto offer_for = [&](RenderTeam& team) {
        return offer(device, team, number, settings, blocks, samples_per_pixel, tile_size);
    };
    // Those who keep other chunks answer one question of a device at a time.
    if (!by_teams || device->teams.empty() || settings.exchange) return {offer_for(device->whole)};
    std::vector<PieceWorkerOffer> offers;
    for (RenderTeam& team : device->teams) offers.push_back(offer_for(team));
    return offers;
}

}  // namespace castor
