#include "render/verify.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "render/film_comparison.h"

namespace castor {

namespace {

// Blocks that are chosen together, so that workers get more than single ones.
constexpr std::uint32_t kRun = 16;

bool is_chosen(std::uint32_t block, double share) {
    const double runs = block / kRun;
    return std::ceil((runs + 1) * share) > std::ceil(runs * share);
}

/// Two groups of workers that verify each other's blocks.
struct Groups {
    std::vector<std::uint8_t> of_worker;
    bool can_verify = true;  // both have a worker that is not dropped
};

/// Keeps workers of one host together if there are several hosts, else those of one device, and gives both groups about
/// as many samples of the picture, so that none has much more to do than the other.
Groups divide(const RenderJob& job, const std::vector<DeviceShare>& shares) {
    const std::vector<PieceWorkerOffer>& workers = job.workers();
    std::set<std::string> hosts;
    for (const PieceWorkerOffer& worker : workers) hosts.insert(worker.host);
    struct Unit {
        bool is_alive = false;
        std::uint64_t samples = 0;
        std::vector<std::size_t> workers;
    };
    std::map<std::string, Unit> units;
    for (std::size_t i = 0; i < workers.size(); ++i) {
        Unit& unit = units[hosts.size() > 1 ? workers[i].host : std::to_string(workers[i].device)];
        unit.is_alive |= !job.is_dropped(i);
        unit.samples += shares[i].samples;
        unit.workers.push_back(i);
    }
    // The dead ones last, so that both groups get someone who lives.
    std::vector<Unit> sorted;
    for (auto& [name, unit] : units) sorted.push_back(std::move(unit));
    std::stable_sort(sorted.begin(), sorted.end(), [](const Unit& a, const Unit& b) {
        return std::tie(a.is_alive, a.samples) > std::tie(b.is_alive, b.samples);
    });
    Groups groups;
    groups.of_worker.resize(workers.size());
    std::pair<std::uint64_t, std::size_t> loads[2] = {};  // samples, and units
    bool is_alive[2] = {};
    for (const Unit& unit : sorted) {
        const std::uint8_t group = loads[1] < loads[0];
        loads[group].first += unit.samples;
        ++loads[group].second;
        is_alive[group] |= unit.is_alive;
        for (const std::size_t worker : unit.workers) groups.of_worker[worker] = group;
    }
    groups.can_verify = is_alive[0] && is_alive[1];
    return groups;
}

}  // namespace

Verification verify(RenderJob& job, const std::vector<PieceWorkerOffer>& workers, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress, Manager* manager) {
    const Film& film = job.picture().film();
    const PixelBlocks& blocks = job.picture().blocks();
    const std::size_t worker_count = job.workers().size();
    const auto name_of = [&](std::size_t worker) {
        return worker < worker_count ? job.workers()[worker].name : std::string("an earlier run");
    };
    const auto skip_jobs = [&](int count) {
        for (; manager && count > 0; --count) manager->skip_job();
    };
    const auto give_up = [&](const char* gap) {
        skip_jobs(kVerificationJobs);
        Verification nothing;
        nothing.gap = gap;
        return nothing;
    };
    if (!film.complete()) return give_up("the picture is not complete");
    const Groups groups = divide(job, job.tally().shares());
    if (!groups.can_verify)
        return give_up(worker_count == 0 || job.workers().back().device == 0 ? "there is one device"
                                                                             : "a device was dropped");

    FilmComparison comparison(film);
    std::string gap;
    bool is_stopped = false;
    for (int group = 0; group < kVerificationJobs; ++group) {
        std::vector<std::uint32_t> chosen;
        for (std::uint32_t block = 0; block < blocks.count(); ++block) {
            const std::size_t maker = job.worker_of(block);
            // What an earlier run has made is divided among both.
            const int group_of_maker = maker < worker_count ? groups.of_worker[maker] : int(block / kRun % 2);
            if (is_chosen(block, options.verify_share) && group_of_maker != group) chosen.push_back(block);
        }
        if (chosen.empty() || is_stopped) {
            skip_jobs(1);
            continue;
        }
        const Checkpoint& made = job.picture().state();
        Checkpoint begin{
            .picture = made.picture, .film = film, .partial_blocks = {}, .stopped_blocks = made.stopped_blocks};
        for (const std::uint32_t block : chosen) {
            begin.stopped_blocks.erase(block);
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                std::fill_n(begin.film.done.begin() + pixel, count, std::uint8_t{0});
            });
        }
        RenderOptions again = options;
        again.checkpoint_file.clear();
        again.order = RenderOrder::pieces;
        std::vector<bool> is_left_out(worker_count);
        for (std::size_t worker = 0; worker < worker_count; ++worker)
            is_left_out[worker] = groups.of_worker[worker] != group || job.is_dropped(worker);
        const auto second = std::make_shared<RenderJob>(std::move(begin), workers, again, manager, is_left_out);
        const Film& film_again = second->picture().film();
        second->run(deadlines, on_progress);
        for (const std::string& notice : second->tally().notices())
            job.tally().tell("while the picture was verified: " + notice);
        is_stopped = second->is_stopped();
        const std::vector<DeviceShare> shares = second->tally().shares();
        for (std::size_t worker = 0; worker < worker_count; ++worker)
            if (!shares[worker].failure.empty()) job.tally().set_failure(worker, shares[worker].failure);
        if (!film_again.complete()) {
            const auto failure = second->tally().last_failure();
            gap = is_stopped ? "it was interrupted" : failure ? failure->what() : "no device was left for it";
        }
        for (const std::uint32_t block : chosen)
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                for (std::size_t i = pixel; i < pixel + count; ++i)
                    if (film_again.done[i])
                        comparison.compare(film_again, i, name_of(job.worker_of(block)),
                                           name_of(second->worker_of(block)));
            });
    }
    Verification verification = comparison.result();
    verification.gap = gap;
    return verification;
}

}  // namespace castor
