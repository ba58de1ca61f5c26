#include "render/remote_piece.h"

#include <memory>
#include <utility>

#include "castor/error.h"
#include "render/pixel_blocks.h"

namespace castor {

namespace {

[[noreturn]] void refuse() {
    throw DeviceError("", "", 0, "sent a piece of the picture that does not fit its order");
}

std::size_t slots_of(const std::vector<std::uint32_t>& blocks) {
    return blocks.size() * PixelBlocks::kPixels;
}

void expect_size(std::size_t found, std::size_t expected) {
    if (found != expected) refuse();
}

class OrderedPieceWorker : public OrderedWorker {
public:
    explicit OrderedPieceWorker(std::unique_ptr<PieceWorker> worker) : worker_(std::move(worker)) {}

    WorkerState state() const override {
        return {worker_->setup_seconds(), worker_->block_samples_per_second(), worker_->blocks_wanted(),
                worker_->most_blocks()};
    }
    Bytes work(std::span<const std::byte> order, const OnProgress& on_progress) override {
        return bytes_of(worker_->render(order_of(order), on_progress));
    }

private:
    std::unique_ptr<PieceWorker> worker_;
};

}  // namespace

Bytes bytes_of(const PieceOrder& order) {
    return ByteWriter()
        .add(order.begin.blocks)
        .add(order.begin.samples)
        .add(order.samples)
        .add(order.rows_of_sums)
        .add(std::uint32_t{order.wants_planes})
        .add(std::uint32_t{order.wants_all_sums})
        .add(order.begin.sums)
        .take();
}

PieceOrder order_of(std::span<const std::byte> bytes) {
    ByteReader reader(bytes);
    PieceOrder order;
    order.begin.blocks = reader.take_vector<std::uint32_t>();
    order.begin.samples = reader.take<std::uint32_t>();
    order.samples = reader.take<std::uint32_t>();
    order.rows_of_sums = reader.take<std::uint32_t>();
    order.wants_planes = reader.take<std::uint32_t>() != 0;
    order.wants_all_sums = reader.take<std::uint32_t>() != 0;
    order.begin.sums = reader.take_vector<glm::vec4>();
    reader.expect_end();
    expect_size(order.begin.sums.size(),
                order.begin.samples > 0 ? order.rows_of_sums * slots_of(order.begin.blocks) : 0);
    return order;
}

Bytes bytes_of(const PieceResult& result) {
    ByteWriter writer;
    writer.add(result.state.blocks)
        .add(result.state.samples)
        .add(std::uint32_t{result.planes.has_value()})
        .add(result.rays)
        .add(std::uint32_t{result.met_most_passed})
        .add(std::uint32_t{result.met_most_scattered})
        .add(result.state.sums)
        .add(result.state.means);
    if (const auto& planes = result.planes)
        writer.add(planes->position_depth)
            .add(planes->normal)
            .add(planes->barycentric_t)
            .add(planes->primitive_instance_material)
            .add(planes->albedo)
            .add(planes->uv);
    return writer.take();
}

PieceResult result_of(std::span<const std::byte> bytes, const PieceOrder& order, std::uint32_t samples_per_pixel) {
    ByteReader reader(bytes);
    PieceResult result;
    PieceState& state = result.state;
    state.blocks = reader.take_vector<std::uint32_t>();
    state.samples = reader.take<std::uint32_t>();
    const bool has_planes = reader.take<std::uint32_t>() != 0;
    result.rays = reader.take<std::uint64_t>();
    result.met_most_passed = reader.take<std::uint32_t>() != 0;
    result.met_most_scattered = reader.take<std::uint32_t>() != 0;
    state.sums = reader.take_vector<glm::vec4>();
    state.means = reader.take_vector<glm::vec3>();
    const std::size_t slots = slots_of(order.begin.blocks);
    if (has_planes) {
        WaveAovs& planes = result.planes.emplace();
        planes.position_depth = reader.take_vector<float>();
        planes.normal = reader.take_vector<float>();
        planes.barycentric_t = reader.take_vector<float>();
        planes.primitive_instance_material = reader.take_vector<std::uint32_t>();
        planes.albedo = reader.take_vector<float>();
        planes.uv = reader.take_vector<float>();
        for (const std::size_t size :
             {planes.position_depth.size(), planes.normal.size(), planes.barycentric_t.size(),
              planes.primitive_instance_material.size(), planes.albedo.size(), planes.uv.size()})
            expect_size(size, 4 * slots);
    }
    reader.expect_end();
    if (state.blocks != order.begin.blocks || has_planes != order.wants_planes || state.samples > order.samples ||
        state.samples < order.begin.samples)
        refuse();
    const bool is_finished = state.samples == samples_per_pixel;
    expect_size(state.means.size(), is_finished ? slots : 0);
    const bool has_sums = state.samples > 0 && (!is_finished || order.wants_all_sums);
    expect_size(state.sums.size(), has_sums ? order.rows_of_sums * slots : 0);
    return result;
}

OrderedWorkerOffer ordered(const PieceWorkerOffer& offer, std::uint64_t block_count, std::uint32_t samples_per_pixel) {
    const auto make = [=](const std::function<bool()>& is_needed) -> std::unique_ptr<OrderedWorker> {
        std::unique_ptr<PieceWorker> worker = offer.make(is_needed);
        if (!worker) return nullptr;
        if (is_worth_measuring(*worker, block_count * samples_per_pixel)) worker->measure({0, block_count}, is_needed);
        return std::make_unique<OrderedPieceWorker>(std::move(worker));
    };
    return {offer.stays_in_callers_thread, make};
}

}  // namespace castor
