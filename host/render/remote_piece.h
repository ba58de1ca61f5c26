#pragma once

#include <cstdint>
#include <span>

#include "remote/bytes.h"
#include "remote/rank_server.h"
#include "render/piece_worker.h"

namespace castor {

// Orders and results as bytes. What is read from bytes has the lengths that its blocks ask for; else DeviceError is
// thrown.

Bytes bytes_of(const PieceOrder& order);
PieceOrder order_of(std::span<const std::byte> bytes);

Bytes bytes_of(const PieceResult& result);
/// `order`: what was ordered; `samples_per_pixel`: of the picture.
PieceResult result_of(std::span<const std::byte> bytes, const PieceOrder& order, std::uint32_t samples_per_pixel);

/// Offers a worker of this process to the manager of a picture with so many blocks.
OrderedWorkerOffer ordered(const PieceWorkerOffer& offer, std::uint64_t block_count, std::uint32_t samples_per_pixel);

}  // namespace castor
