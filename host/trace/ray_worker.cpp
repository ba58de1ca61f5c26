#include "trace/ray_worker.h"

#include <cstring>

#include "base/stopwatch.h"

namespace castor {

void answer_pieces(RayWorker& worker, const RayBatch& batch, Schedule& schedule, std::size_t number,
                   const OnRaysAnswered& on_answered) {
    schedule.set_speed(number, worker.items_per_second());
    while (const auto piece = schedule.take(number, worker.items_wanted(), worker.most_items())) {
        const Stopwatch watch;
        const std::span<const Ray> rays = batch.rays_of(*piece);
        const auto load = [&](Ray* target) {
            return schedule.keep(number, [&] { std::memcpy(target, rays.data(), rays.size_bytes()); });
        };
        const auto store = [&](std::span<const std::byte* const> answers) {
            return schedule.finish(number, [&] {
                for (std::size_t i = 0; i < answers.size(); ++i) {
                    const AnswerColumn& column = batch.answers[i];
                    std::memcpy(column.data + batch.first_ray(*piece) * column.bytes, answers[i],
                                rays.size() * column.bytes);
                }
                on_answered(rays.size(), watch.seconds());
            });
        };
        if (worker.answer(rays.size(), load, store)) schedule.set_speed(number, worker.items_per_second());
    }
}

}  // namespace castor
