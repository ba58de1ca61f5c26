#include "trace/ray_worker.h"

#include <algorithm>
#include <cstring>

#include "base/stopwatch.h"
#include "trace/device_pace.h"

namespace castor {

void answer_pieces(RayWorker& worker, const RayBatch& batch, Schedule& schedule, std::size_t number,
                   const OnRaysAnswered& on_answered) {
    schedule.set_speed(number, worker.items_per_second());
    while (const auto piece = schedule.take(number, worker.items_wanted(), worker.most_items())) {
        const Stopwatch watch;
        const std::size_t first = piece->begin * kRaysPerItem;
        const std::size_t count = std::min<std::size_t>(piece->end * kRaysPerItem, batch.count) - first;
        const auto load = [&](Ray* rays) {
            return schedule.keep(number, [&] { std::memcpy(rays, batch.rays + first, count * sizeof(Ray)); });
        };
        const auto store = [&](const std::byte* answers) {
            return schedule.finish(number, [&] {
                std::memcpy(batch.answers + first * batch.answer_bytes, answers, count * batch.answer_bytes);
                on_answered(count, watch.seconds());
            });
        };
        if (worker.answer(count, load, store)) schedule.set_speed(number, worker.items_per_second());
    }
}

}  // namespace castor
