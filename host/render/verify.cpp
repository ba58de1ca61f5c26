#include "render/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace castor {

namespace {

// Blocks that are chosen together, so that devices get more than single ones.
constexpr std::uint32_t kRun = 16;

bool is_chosen(std::uint32_t block, double share) {
    const double runs = block / kRun;
    return std::ceil((runs + 1) * share) > std::ceil(runs * share);
}

/// Floats as integers in the same order.
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

Verification verify(RenderJob& job, const WaveSettings& settings,
                    const std::vector<std::shared_ptr<SceneDevice>>& devices, const RenderOptions& options,
                    const Deadlines& deadlines, const ProgressCallback& on_progress) {
    const Film& film = job.film();
    const PixelBlocks blocks(film.width, film.height);
    const auto name_of = [&](std::size_t device) {
        return device < devices.size() ? label(devices[device]->context.device()) : std::string("an earlier run");
    };
    Comparison comparison(film);
    bool is_stopped = false;
    for (std::size_t device = 0; device < devices.size() && !is_stopped; ++device) {
        std::vector<std::uint32_t> chosen;
        for (std::uint32_t block = 0; block < blocks.count(); ++block)
            if (is_chosen(block, options.verify_share) && (job.device_of(block) + 1) % devices.size() == device)
                chosen.push_back(block);
        if (chosen.empty()) continue;
        Checkpoint begin{.picture = "", .film = film, .partial_blocks = {}};
        for (const std::uint32_t block : chosen)
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                std::fill_n(begin.film.done.begin() + pixel, count, std::uint8_t{0});
            });
        RenderOptions again = options;
        again.checkpoint_file.clear();
        const auto second =
            std::make_shared<RenderJob>(std::move(begin), settings, std::vector{devices[device]}, again);
        second->run(deadlines, on_progress);
        for (const std::string& notice : second->notices()) job.tell("while the picture was verified: " + notice);
        is_stopped = second->is_stopped();
        if (const std::string failure = second->shares().front().failure; !failure.empty())
            job.set_failure(device, failure);
        if (!second->film().complete())
            comparison.result.gap = is_stopped ? "it was interrupted" : second->shares().front().failure;
        for (const std::uint32_t block : chosen)
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                for (std::size_t i = pixel; i < pixel + count; ++i)
                    if (second->film().done[i])
                        comparison.compare(second->film(), i, name_of(job.device_of(block)), name_of(device));
            });
    }
    return comparison.result;
}

}  // namespace castor
