#pragma once

#include <atomic>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "castor/renderer.h"
#include "render/checkpoint.h"
#include "render/pixel_blocks.h"
#include "render/wave.h"
#include "schedule/crew.h"
#include "schedule/pace.h"
#include "schedule/schedule.h"
#include "trace/scene_devices.h"

namespace castor {

/// One picture: which device does what of it, and what there is of it so far. Shared with the devices' threads, one of
/// which may outlive the render.
class RenderJob : public std::enable_shared_from_this<RenderJob> {
public:
    /// What there is already; a film has its size at least. Another checkpoint is written every so many seconds to a
    /// file, unless that has no name.
    RenderJob(Checkpoint begin, const WaveSettings& settings, std::vector<std::shared_ptr<SceneDevice>> devices,
              const RenderOptions& options);

    /// Returns when the picture is done, `on_progress` has stopped it, or no device is left. Whatever it throws, what
    /// is done is in the checkpoint.
    void run(const Deadlines& deadlines, const ProgressCallback& on_progress);

    bool is_stopped() const { return is_stopped_; }  // by on_progress
    std::uint64_t samples_at_begin() const { return samples_at_begin_; }
    std::uint64_t samples_in_film() const;
    void tell(const std::string& notice);
    /// What a device did wrong after the picture was done.
    void set_failure(std::size_t device, const std::string& failure);
    /// The number of the device that made a block; kNoDevice: none did in this run.
    std::size_t device_of(std::uint32_t block) const { return device_of_block_[block]; }
    static constexpr std::uint16_t kNoDevice = 0xffff;
    /// Afterwards: what there is, what the devices did, in their order, what there was to tell, and why the last device
    /// was dropped.
    Film& film() { return state_.film; }
    std::vector<DeviceShare> shares() const;
    std::vector<std::string> notices() const;
    const std::optional<DeviceError>& last_failure() const { return last_failure_; }

private:
    void render_pieces(SceneDevice& device, Schedule& schedule, std::size_t worker);
    void render_piece(Wave& wave, Pace& pace, const Range& piece, Schedule& schedule, std::size_t worker);
    std::uint32_t samples_before(const Range& piece, std::vector<glm::vec4>& sums);
    void store_pixels(const Range& piece, const std::vector<glm::vec3>& means, const WaveAovs& aovs, bool is_done);
    void store_sums(const Range& piece, std::uint32_t samples, const std::vector<glm::vec4>& sums);
    std::vector<Range> work_left() const;
    RenderProgress progress();
    void drop(std::size_t worker, const DeviceError& why);
    void forget_piece(std::size_t worker);
    void show_partial_blocks();
    void keep_checkpoints();
    void begin_checkpoint();
    void tell_of_checkpoint(const std::string& problem);
    void write_last_checkpoint();

    const std::uint32_t width_, height_, samples_per_pixel_;
    const bool has_planes_;
    PixelBlocks blocks_;
    WaveSettings settings_;
    std::vector<std::shared_ptr<SceneDevice>> devices_;
    std::uint32_t tile_size_;
    std::filesystem::path checkpoint_file_;
    double checkpoint_seconds_;
    std::uint64_t samples_at_begin_ = 0;
    Stopwatch watch_;

    // For the thread that runs the job.
    Stopwatch since_checkpoint_;
    std::future<std::string> writing_;  // gives what went wrong
    std::string last_problem_;          // with a checkpoint
    bool is_waiting_for_sums_ = false;
    bool is_stopped_ = false;

    std::atomic<std::uint32_t> wanted_sums_ = 0;  // goes up when all devices are to give the sums of what they are at

    mutable std::mutex mutex_;  // of what follows
    Checkpoint state_;
    std::vector<DeviceShare> shares_;
    std::vector<std::uint64_t> samples_under_way_;  // of each device's piece, that are not in state_
    std::vector<bool> has_piece_;                   // each device
    std::vector<std::uint32_t> given_sums_;  // wanted_sums_ when each device last gave them, or had nothing to give
    std::vector<std::uint16_t> device_of_block_;
    std::vector<std::string> notices_;
    std::size_t told_notices_ = 0;
    std::optional<DeviceError> last_failure_;
};

}  // namespace castor
