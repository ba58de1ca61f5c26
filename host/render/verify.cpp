#include "render/verify.h"

#include <algorithm>
#include <cmath>

#include "render/film_comparison.h"

namespace castor {

namespace {

// Blocks that are chosen together, so that workers get more than single ones.
constexpr std::uint32_t kRun = 16;

bool is_chosen(std::uint32_t block, double share) {
    const double runs = block / kRun;
    return std::ceil((runs + 1) * share) > std::ceil(runs * share);
}

}  // namespace

Verification verify(RenderJob& job, const std::vector<PieceWorkerOffer>& workers, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress) {
    const Film& film = job.picture().film();
    const PixelBlocks& blocks = job.picture().blocks();
    const auto name_of = [&](std::size_t worker) {
        return worker < workers.size() ? workers[worker].name : std::string("an earlier run");
    };
    FilmComparison comparison(film);
    std::string gap;
    bool is_stopped = false;
    for (std::size_t worker = 0; worker < workers.size() && !is_stopped; ++worker) {
        std::vector<std::uint32_t> chosen;
        for (std::uint32_t block = 0; block < blocks.count(); ++block)
            if (is_chosen(block, options.verify_share) && (job.worker_of(block) + 1) % workers.size() == worker)
                chosen.push_back(block);
        if (chosen.empty()) continue;
        Checkpoint begin{.picture = "", .film = film, .partial_blocks = {}};
        for (const std::uint32_t block : chosen)
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                std::fill_n(begin.film.done.begin() + pixel, count, std::uint8_t{0});
            });
        RenderOptions again = options;
        again.checkpoint_file.clear();
        again.order = RenderOrder::pieces;
        const auto second = std::make_shared<RenderJob>(std::move(begin), std::vector{workers[worker]}, again);
        const Film& film_again = second->picture().film();
        second->run(deadlines, on_progress);
        for (const std::string& notice : second->tally().notices())
            job.tally().tell("while the picture was verified: " + notice);
        is_stopped = second->is_stopped();
        const std::string failure = second->tally().shares().front().failure;
        if (!failure.empty()) job.tally().set_failure(worker, failure);
        if (!film_again.complete()) gap = is_stopped ? "it was interrupted" : failure;
        for (const std::uint32_t block : chosen)
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                for (std::size_t i = pixel; i < pixel + count; ++i)
                    if (film_again.done[i])
                        comparison.compare(film_again, i, name_of(job.worker_of(block)), name_of(worker));
            });
    }
    Verification verification = comparison.result();
    verification.gap = gap;
    return verification;
}

}  // namespace castor
