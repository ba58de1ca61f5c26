#include "render/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace castor {

namespace {

// Blocks that are chosen together, so that workers get more than single ones.
constexpr std::uint32_t kRun = 16;

bool is_chosen(std::uint32_t block, double share) {
    const double runs = block / kRun;
    return std::ceil((runs + 1) * share) > std::ceil(runs * share);
}

/// Maps floats to integers in the same order.
std::int64_t ordered(float value) {
    const auto bits = std::bit_cast<std::int32_t>(value);
    return bits >= 0 ? bits : std::int64_t{INT32_MIN} - bits;
}
std::uint64_t distance(float a, float b) {
    return static_cast<std::uint64_t>(std::abs(ordered(a) - ordered(b)));
}
std::uint64_t distance(std::uint32_t a, std::uint32_t b) {
    return a < b ? b - a : a - b;
}

class Comparison {
public:
    explicit Comparison(const Film& first) : first_(first) {}

    void compare(const Film& second, std::size_t pixel, const std::string& first_device,
                 const std::string& second_device) {
        ++result.pixels;
        bool is_equal = true;
        const auto check = [&](const std::string& channel, const auto& a, const auto& b) {
            if (std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b)) return;
            const auto x = static_cast<std::uint32_t>(pixel % first_.width),
                       y = static_cast<std::uint32_t>(pixel / first_.width);
            if (is_equal) ++result.differing_pixels;
            is_equal = false;
            if (result.first && std::pair(result.first->y, result.first->x) <= std::pair(y, x)) return;
            result.first =
                PixelDifference{x, y, channel, {first_device, second_device}, {double(a), double(b)}, distance(a, b)};
        };
        for (int i = 0; i < 3; ++i) check(std::string(1, "RGB"[i]), first_.pixels[pixel][i], second.pixels[pixel][i]);
        for (std::size_t p = 0; p < first_.planes.size(); ++p) {
            const FilmPlane &a = first_.planes[p], &b = second.planes[p];
            const std::size_t channels = a.channels.size();
            for (std::size_t c = 0; c < channels; ++c) {
                const std::string name = a.name + "." + a.channels[c];
                if (a.indices.empty())
                    check(name, a.values[pixel * channels + c], b.values[pixel * channels + c]);
                else
                    check(name, a.indices[pixel * channels + c], b.indices[pixel * channels + c]);
            }
        }
    }

    Verification result;

private:
    const Film& first_;
};

}  // namespace

Verification verify(RenderJob& job, const std::vector<PieceWorkerOffer>& workers, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress) {
    const Film& film = job.picture().film();
    const PixelBlocks& blocks = job.picture().blocks();
    const auto name_of = [&](std::size_t worker) {
        return worker < workers.size() ? workers[worker].name : std::string("an earlier run");
    };
    Comparison comparison(film);
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
        if (!film_again.complete()) comparison.result.gap = is_stopped ? "it was interrupted" : failure;
        for (const std::uint32_t block : chosen)
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                for (std::size_t i = pixel; i < pixel + count; ++i)
                    if (film_again.done[i])
                        comparison.compare(film_again, i, name_of(job.worker_of(block)), name_of(worker));
            });
    }
    return comparison.result;
}

}  // namespace castor
