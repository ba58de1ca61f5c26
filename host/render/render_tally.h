#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/stopwatch.h"
#include "castor/device_share.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "render/piece_worker.h"

namespace castor {

/// Progress and statistics of a render: what each worker did and is doing, and what there is to tell the user. Usable
/// from several threads.
class RenderTally {
public:
    RenderTally(const std::vector<PieceWorkerOffer>& workers, std::uint64_t samples_total,
                std::uint64_t samples_at_begin);

    void add_setup(std::size_t worker, double seconds);
    void begin_piece(std::size_t worker);
    /// Sets the number of samples, of all pixels, that the worker has taken but not given back.
    void set_under_way(std::size_t worker, std::uint64_t samples);
    /// Sets the number of samples, of all pixels, that the picture will have: fewer where blocks stop.
    void set_samples_total(std::uint64_t samples);
    bool has_piece(std::size_t worker) const;
    /// Counts what the worker has given back of its piece.
    void count(std::size_t worker, std::uint64_t samples, std::uint64_t rays, double seconds, bool ends_piece);
    /// The worker has no piece any more; samples under way are lost.
    void end_piece(std::size_t worker);

    /// The worker failed: no team of its device is to go on.
    void drop(std::size_t worker, const DeviceError& why);
    /// Returns why a worker of the same device, or this one, was dropped; nullopt: none was.
    std::optional<DeviceError> failure_of_device(std::size_t worker) const;
    /// The worker was not waited for, `is_stopped`: because the render was stopped.
    void leave(std::size_t worker, bool is_stopped);
    /// Sets why a worker is dropped after the picture was done.
    void set_failure(std::size_t worker, const std::string& failure);
    void tell(const std::string& notice);
    /// The same, unless it is told already.
    void tell_once(const std::string& notice);

    /// Returns the progress without a snapshot, with the notices since the last call.
    RenderProgress progress();
    std::uint64_t samples_at_begin() const { return samples_at_begin_; }
    /// Returns what each worker did.
    std::vector<DeviceShare> shares() const;
    /// Returns what each device did, in the order of PieceWorkerOffer::device: the sums of its teams, the time that one
    /// of them was busy in the mean, and the longest setup.
    std::vector<DeviceShare> shares_of_devices() const;
    std::vector<std::string> notices() const;
    /// Returns why the last dropped worker was dropped.
    std::optional<DeviceError> last_failure() const;

private:
    std::vector<DeviceShare> join_teams(const std::vector<DeviceShare>& shares) const;

    const std::uint64_t samples_at_begin_;
    const Stopwatch watch_;
    mutable std::mutex mutex_;
    std::uint64_t samples_total_;
    std::vector<DeviceShare> shares_;              // one a worker
    std::vector<std::size_t> device_of_;           // one a worker
    std::map<std::size_t, DeviceError> failures_;  // of devices
    std::vector<std::uint64_t> under_way_;         // one a worker, in samples
    std::vector<bool> has_piece_;                  // one a worker
    std::vector<std::string> notices_;
    std::size_t told_notices_ = 0;
    std::optional<DeviceError> last_failure_;
};

}  // namespace castor
