#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/stopwatch.h"
#include "castor/renderer.h"
#include "remote/manager.h"
#include "render/checkpoint_keeper.h"
#include "render/picture.h"
#include "render/piece_worker.h"
#include "render/render_tally.h"
#include "schedule/crew.h"
#include "schedule/schedule.h"

namespace castor {

class ChunkExchange;

/// One render: divides a picture among workers, joins what they give back, keeps checkpoints and tells progress. Shared
/// with the workers' threads, one of which may outlive the render.
class RenderJob : public std::enable_shared_from_this<RenderJob>, RemoteJob {
public:
    /// Goes on from a state whose film has its size at least. `manager`, if not null, has further workers, of other
    /// processes; their numbers follow those of `workers`. `is_left_out`: a flag a worker that is to get no work;
    /// empty: all get some.
    RenderJob(Checkpoint begin, std::vector<PieceWorkerOffer> workers, const RenderOptions& options,
              Manager* manager = nullptr, const std::vector<bool>& is_left_out = {});
    ~RenderJob() override;

    /// Returns when the picture is done, `on_progress` has stopped it, or no worker is left. Whatever it throws, what
    /// is done is in the checkpoint.
    /// `exchange`: with those who keep other chunks, if there are any; there is no manager then.
    void run(const Deadlines& deadlines, const ProgressCallback& on_progress, ChunkExchange* exchange = nullptr);

    bool is_stopped() const { return is_stopped_; }  // by on_progress
    Picture& picture() { return picture_; }
    RenderTally& tally() { return tally_; }
    /// Returns all workers; those of other processes make nothing here.
    const std::vector<PieceWorkerOffer>& workers() const { return workers_; }
    /// Returns whether a worker, or another team of its device, was dropped.
    bool is_dropped(std::size_t worker) const { return is_dropped_[worker] || tally_.failure_of_device(worker); }
    /// Returns the number of the worker that finished a block; kNoWorker: none did in this run.
    std::size_t worker_of(std::uint32_t block) const { return worker_of_block_[block]; }
    static constexpr std::uint16_t kNoWorker = 0xffff;

private:
    /// What the order of work asks for next: so many samples of all blocks that have fewer.
    struct Pass {
        std::uint32_t samples;
        std::uint32_t samples_each;  // that most blocks lack
        BlocksLeft work;             // an item of the schedule is a place in it
    };
    class PieceInWork;

    // For workers of other processes.
    const std::string& description() const override { return picture_.state().picture; }
    bool takes_part(std::size_t worker) const override { return !is_dropped_[worker]; }
    void ready(std::size_t worker, const WorkerState& state) override;
    std::optional<Bytes> begin(std::size_t worker, const Range& places) override;
    Answer progress(std::size_t worker, std::uint64_t samples) override;
    std::optional<Bytes> take(std::size_t worker, std::span<const std::byte> result) override;
    void end(std::size_t worker) override;

    void run_passes(const Deadlines& deadlines, const ProgressCallback& on_progress, ChunkExchange* exchange);
    std::shared_ptr<const Pass> next_pass() const;
    void render_pieces(const PieceWorkerOffer& offer, const std::shared_ptr<Schedule>& schedule, std::size_t number,
                       const std::shared_ptr<const Pass>& pass);
    static std::optional<Bytes> bytes_of_next(PieceInWork& piece);
    std::optional<Checkpoint> gather_sums(bool is_late);
    RenderProgress progress();
    Film snapshot();

    Picture picture_;
    Manager* const manager_;
    std::size_t local_workers_;              // those after them are of other processes
    std::vector<PieceWorkerOffer> workers_;  // those of other processes make nothing
    const RenderOrder order_;
    const std::optional<double> stop_after_seconds_;
    const Stopwatch watch_;
    const bool keeps_all_;  // a checkpoint also of what is complete
    RenderTally tally_;
    std::vector<std::uint16_t> worker_of_block_;  // written while a finished piece is stored

    // Sums that workers are asked to give back early: how often that was asked, and for each worker up to which time it
    // has done so.
    std::atomic<std::uint32_t> asked_for_sums_ = 0;
    std::vector<std::atomic<std::uint32_t>> given_sums_;

    // For the thread that runs the job.
    CheckpointKeeper keeper_;
    std::optional<std::uint32_t> gathering_;  // value of asked_for_sums_ that a checkpoint waits for
    std::vector<bool> is_dropped_;            // one a worker; also those that are left out
    bool is_stopped_ = false;
    std::shared_ptr<const Pass> pass_;  // that is under way
    std::shared_ptr<Schedule> schedule_;
    std::vector<std::unique_ptr<PieceInWork>> remote_pieces_;  // one a worker; null: none
};

}  // namespace castor
