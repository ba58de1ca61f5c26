#include "trace/remote_batch.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "castor/error.h"

namespace castor {

namespace {

class OrderedRayWorker : public OrderedWorker {
public:
    OrderedRayWorker(std::unique_ptr<RayWorker> worker, std::vector<std::size_t> answer_bytes, double setup_seconds)
        : worker_(std::move(worker)), answer_bytes_(std::move(answer_bytes)), setup_seconds_(setup_seconds) {}

    WorkerState state() const override {
        return {setup_seconds_, worker_->items_per_second(), worker_->items_wanted(), worker_->most_items()};
    }
    Bytes work(std::span<const std::byte> order, const OnProgress&) override {
        if (order.size() % sizeof(Ray) != 0) throw DeviceError("", "", 0, "the manager sent a part of a ray");
        const std::size_t count = order.size() / sizeof(Ray);
        Bytes answers;
        const auto load = [&](Ray* rays) {
            std::memcpy(rays, order.data(), order.size());
            return true;
        };
        const auto store = [&](std::span<const std::byte* const> columns) {
            for (std::size_t i = 0; i < columns.size(); ++i)
                answers.insert(answers.end(), columns[i], columns[i] + count * answer_bytes_[i]);
            return true;
        };
        worker_->answer(count, load, store);
        return answers;
    }

private:
    std::unique_ptr<RayWorker> worker_;
    std::vector<std::size_t> answer_bytes_;  // a ray, column by column
    double setup_seconds_;
};

}  // namespace

RemoteBatch::RemoteBatch(const RayBatch& batch, std::string description, std::shared_ptr<Schedule> schedule,
                         std::size_t worker_count, OnAnswered on_answered)
    : batch_(batch),
      description_(std::move(description)),
      schedule_(std::move(schedule)),
      on_answered_(std::move(on_answered)),
      pieces_(worker_count) {}

void RemoteBatch::ready(std::size_t worker, const WorkerState& state) {
    schedule_->set_speed(worker, state.items_per_second);
}

std::optional<Bytes> RemoteBatch::begin(std::size_t worker, const Range& piece) {
    const std::span<const Ray> rays = batch_.rays_of(piece);
    pieces_[worker] = {batch_.first_ray(piece), rays.size(), {}};
    const auto bytes = std::as_bytes(rays);
    return Bytes(bytes.begin(), bytes.end());
}

RemoteJob::Answer RemoteBatch::progress(std::size_t worker, std::uint64_t) {
    return schedule_->is_wanted(worker) ? Answer::go_on : Answer::abandon;
}

std::optional<Bytes> RemoteBatch::take(std::size_t worker, std::span<const std::byte> result) {
    const Piece& piece = pieces_[worker];
    std::size_t expected = 0;
    for (const AnswerColumn& column : batch_.answers) expected += piece.count * column.bytes;
    if (result.size() != expected) throw DeviceError("", "", 0, "sent answers to another number of rays than asked");
    const double seconds = piece.watch.seconds();
    const bool counts = schedule_->finish(worker, [&] {
        auto from = result.begin();
        for (const AnswerColumn& column : batch_.answers) {
            const auto end = from + static_cast<std::ptrdiff_t>(piece.count * column.bytes);
            std::copy(from, end, column.data + piece.first * column.bytes);
            from = end;
        }
        on_answered_(worker, piece.count, seconds);
    });
    if (counts)
        schedule_->set_speed(worker,
                             static_cast<double>(piece.count) / static_cast<double>(batch_.rays_per_item) / seconds);
    return std::nullopt;
}

std::unique_ptr<OrderedWorker> ordered(std::unique_ptr<RayWorker> worker, std::vector<std::size_t> answer_bytes,
                                       double setup_seconds) {
    return std::make_unique<OrderedRayWorker>(std::move(worker), std::move(answer_bytes), setup_seconds);
}

}  // namespace castor
