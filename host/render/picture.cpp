#include "render/picture.h"

#include <algorithm>
#include <utility>

#include "render/aov.h"
#include "render/noise.h"

namespace castor {

Picture::Picture(Checkpoint begin, const PicturePart& part, std::optional<double> noise)
    : blocks_(begin.film.width, begin.film.height),
      part_(part),
      noise_(noise),
      state_(std::move(begin)),
      rows_of_sums_(castor::rows_of_sums(state_.film.planes)),
      wants_all_sums_(has_planes_of_sums(state_.film.planes)),
      has_planes_(blocks_.count()) {
    const bool has_planes = has_planes_of_eye_rays(state_.film.planes);
    for (std::uint32_t block = 0; block < blocks_.count(); ++block) has_planes_[block] = !has_planes || is_done(block);
    for (std::uint32_t block = 0; block < blocks_.count(); ++block)
        if (is_of_part(block))
            samples_to_do_ += std::uint64_t{blocks_.pixels_in_picture(block)} *
                              (is_done(block) ? samples_of(block) : samples_per_pixel());
}

namespace {

/// Returns the sums of the `place`-th block of a piece, row after row.
std::vector<glm::vec4> sums_of_block(const PieceState& piece, std::size_t place) {
    const std::size_t slots = piece.blocks.size() * PixelBlocks::kPixels;
    std::vector<glm::vec4> sums;
    for (std::size_t first = place * PixelBlocks::kPixels; first < piece.sums.size(); first += slots)
        sums.insert(sums.end(), piece.sums.begin() + static_cast<std::ptrdiff_t>(first),
                    piece.sums.begin() + static_cast<std::ptrdiff_t>(first + PixelBlocks::kPixels));
    return sums;
}

}  // namespace

bool Picture::is_done(std::uint32_t block) const {
    const glm::uvec2 corner = blocks_.corner(block);
    return state_.film.done[std::size_t{corner.y} * width() + corner.x] != 0;
}

std::uint32_t Picture::samples_of(std::uint32_t block) const {
    if (is_done(block)) {
        const auto stopped = state_.stopped_blocks.find(block);
        return stopped == state_.stopped_blocks.end() ? samples_per_pixel() : stopped->second;
    }
    const auto partial = state_.partial_blocks.find(block);
    return partial == state_.partial_blocks.end() ? 0 : partial->second.samples;
}

std::uint64_t Picture::pixels_of(std::span<const std::uint32_t> blocks) const {
    std::uint64_t pixels = 0;
    for (const std::uint32_t block : blocks) pixels += blocks_.pixels_in_picture(block);
    return pixels;
}

void Picture::join(const PieceState& piece, const std::optional<WaveAovs>& planes) {
    std::lock_guard lock(mutex_);
    for (std::size_t place = 0; place < piece.blocks.size(); ++place) {
        const std::uint32_t block = piece.blocks[place];
        if (piece.samples == samples_per_pixel())
            join_done(block, piece.samples, piece.means.data() + place * PixelBlocks::kPixels,
                      sums_of_block(piece, place));
        else if (piece.samples > 0)
            join_sums(block, piece.samples, sums_of_block(piece, place));
        if (planes) has_planes_[block] = true;
    }
    if (planes) store_aovs(state_.film, blocks_, piece.blocks, *planes);
}

std::vector<std::uint32_t> Picture::join(const Checkpoint& other) {
    std::lock_guard lock(mutex_);
    std::vector<std::uint32_t> joined;
    const auto copy_rows = [&](std::uint32_t block, const auto& from, auto& to, std::size_t channels) {
        blocks_.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
            std::copy_n(from.begin() + pixel * channels, count * channels, to.begin() + pixel * channels);
        });
    };
    for (std::uint32_t block = 0; block < blocks_.count(); ++block) {
        const glm::uvec2 corner = blocks_.corner(block);
        if (!other.film.done[std::size_t{corner.y} * width() + corner.x] || is_done(block)) continue;
        copy_rows(block, other.film.pixels, state_.film.pixels, 1);
        copy_rows(block, other.film.done, state_.film.done, 1);
        for (std::size_t i = 0; i < state_.film.planes.size(); ++i) {
            FilmPlane& plane = state_.film.planes[i];
            const FilmPlane& others = other.film.planes[i];
            if (plane.indices.empty())
                copy_rows(block, others.values, plane.values, plane.channels.size());
            else
                copy_rows(block, others.indices, plane.indices, plane.channels.size());
        }
        state_.partial_blocks.erase(block);
        const auto stopped = other.stopped_blocks.find(block);
        if (stopped != other.stopped_blocks.end()) set_stopped(block, stopped->second);
        has_planes_[block] = true;
        joined.push_back(block);
    }
    for (const auto& [block, partial] : other.partial_blocks)
        if (join_sums(block, partial.samples, partial.sums)) joined.push_back(block);
    return joined;
}

void Picture::join_done(std::uint32_t block, std::uint32_t samples, const glm::vec3* means,
                        std::span<const glm::vec4> sums) {
    if (is_done(block)) return;
    blocks_.for_each_row(block, 0, [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
        std::copy_n(means + slot, count, state_.film.pixels.begin() + pixel);
        std::fill_n(state_.film.done.begin() + pixel, count, std::uint8_t{1});
    });
    store_sums(state_.film, blocks_, block, samples, sums);
    state_.partial_blocks.erase(block);
    if (samples < samples_per_pixel()) set_stopped(block, samples);
}

void Picture::set_stopped(std::uint32_t block, std::uint32_t samples) {
    state_.stopped_blocks[block] = samples;
    if (is_of_part(block))
        samples_to_do_ -= std::uint64_t{blocks_.pixels_in_picture(block)} * (samples_per_pixel() - samples);
}

/// Returns whether a block is done with so many samples: only where noise is looked at.
bool Picture::stops(std::uint32_t block, std::uint32_t samples, std::span<const glm::vec4> sums) const {
    return noise_ && looks_at_noise(samples) && noise_of_block(blocks_, block, samples, sums) <= *noise_;
}

/// Returns whether these are more samples than there were.
bool Picture::join_sums(std::uint32_t block, std::uint32_t samples, std::vector<glm::vec4> sums) {
    if (is_done(block) || samples_of(block) >= samples) return false;
    if (stops(block, samples, sums)) {
        std::vector<glm::vec3> means;
        for (std::size_t slot = 0; slot < PixelBlocks::kPixels; ++slot)
            means.push_back(glm::vec3(sums[slot]) / static_cast<float>(samples));
        join_done(block, samples, means.data(), sums);
        return true;
    }
    PartialBlock& partial = state_.partial_blocks[block];
    partial.samples = samples;
    partial.sums = std::move(sums);
    return true;
}

BlocksLeft Picture::work_left(std::uint32_t samples) const {
    std::lock_guard lock(mutex_);
    std::map<std::uint32_t, std::vector<std::uint32_t>> blocks_by_samples;
    for (std::uint32_t block = 0; block < blocks_.count(); ++block) {
        if (!is_of_part(block) || is_done(block)) continue;
        const std::uint32_t taken = samples_of(block);
        if (taken < samples) blocks_by_samples[taken].push_back(block);
    }
    BlocksLeft work;
    for (const auto& [taken, blocks] : blocks_by_samples) {
        const std::size_t first = work.blocks.size();
        work.blocks.insert(work.blocks.end(), blocks.begin(), blocks.end());
        work.ranges.push_back({first, work.blocks.size()});
    }
    return work;
}

std::uint32_t Picture::fewest_samples() const {
    std::lock_guard lock(mutex_);
    std::uint32_t fewest = samples_per_pixel();
    for (std::uint32_t block = 0; block < blocks_.count(); ++block)
        if (is_of_part(block) && !is_done(block)) fewest = std::min(fewest, samples_of(block));
    return fewest;
}

std::uint32_t Picture::next_check(std::uint32_t samples) const {
    return noise_ ? std::min(samples_per_pixel(), next_look_at_noise(samples)) : samples_per_pixel();
}

std::uint64_t Picture::samples_to_do() const {
    std::lock_guard lock(mutex_);
    return samples_to_do_;
}

std::uint64_t Picture::samples_done_of_part() const {
    std::lock_guard lock(mutex_);
    std::uint64_t samples = 0;
    for (std::uint32_t block = 0; block < blocks_.count(); ++block)
        if (is_of_part(block)) samples += std::uint64_t{blocks_.pixels_in_picture(block)} * samples_of(block);
    return samples;
}

bool Picture::is_finished(std::uint32_t block) const {
    std::lock_guard lock(mutex_);
    return is_done(block);
}

std::optional<PieceOrder> Picture::order(std::span<const std::uint32_t> blocks, std::uint32_t samples) const {
    std::lock_guard lock(mutex_);
    for (const std::uint32_t block : blocks)
        if (is_done(block) || samples_of(block) >= samples) return std::nullopt;
    PieceOrder order;
    order.begin.blocks.assign(blocks.begin(), blocks.end());
    order.samples = samples;
    order.rows_of_sums = rows_of_sums_;
    order.wants_all_sums = wants_all_sums_;
    for (const std::uint32_t block : blocks) order.wants_planes |= !has_planes_[block];
    order.begin.samples = samples_of(blocks.front());
    if (order.begin.samples == 0) return order;
    const std::size_t slots = blocks.size() * PixelBlocks::kPixels;
    order.begin.sums.resize(rows_of_sums_ * slots);
    for (std::size_t place = 0; place < blocks.size(); ++place) {
        const std::vector<glm::vec4>& sums = state_.partial_blocks.at(blocks[place]).sums;
        for (std::size_t row = 0; row < rows_of_sums_; ++row)
            std::copy_n(
                sums.begin() + static_cast<std::ptrdiff_t>(row * PixelBlocks::kPixels), PixelBlocks::kPixels,
                order.begin.sums.begin() + static_cast<std::ptrdiff_t>(row * slots + place * PixelBlocks::kPixels));
    }
    return order;
}

std::uint64_t Picture::samples_done() const {
    std::lock_guard lock(mutex_);
    return castor::samples_done(state_);
}

std::map<std::uint32_t, std::uint64_t> Picture::pixels_by_samples() const {
    std::lock_guard lock(mutex_);
    std::map<std::uint32_t, std::uint64_t> pixels;
    for (std::uint32_t block = 0; block < blocks_.count(); ++block)
        if (is_done(block)) pixels[samples_of(block)] += blocks_.pixels_in_picture(block);
    return pixels;
}

Checkpoint Picture::copy() const {
    std::lock_guard lock(mutex_);
    return state_;
}

Film Picture::snapshot() const {
    std::lock_guard lock(mutex_);
    Film film = state_.film;
    show_partial_blocks(film);
    return film;
}

void Picture::finish_with(std::uint32_t samples) {
    std::lock_guard lock(mutex_);
    samples_to_do_ = 0;
    state_.film.samples_per_pixel = samples;
    std::erase_if(state_.stopped_blocks, [&](const auto& stopped) { return stopped.second >= samples; });
    show_partial_blocks(state_.film);
    std::fill(state_.film.done.begin(), state_.film.done.end(), std::uint8_t{1});
    state_.partial_blocks.clear();
    for (std::uint32_t block = 0; block < blocks_.count(); ++block)
        if (is_of_part(block)) samples_to_do_ += std::uint64_t{blocks_.pixels_in_picture(block)} * samples_of(block);
}

void Picture::show_partial_blocks() {
    std::lock_guard lock(mutex_);
    show_partial_blocks(state_.film);
}

void Picture::show_partial_blocks(Film& film) const {
    for (const auto& [block, state] : state_.partial_blocks) {
        store_sums(film, blocks_, block, state.samples, state.sums);
        blocks_.for_each_row(block, 0, [&, &partial = state](std::size_t pixel, std::size_t slot, std::uint32_t count) {
            for (std::uint32_t i = 0; i < count; ++i)
                film.pixels[pixel + i] = glm::vec3(partial.sums[slot + i]) / static_cast<float>(partial.samples);
        });
    }
}

}  // namespace castor
