#include "hits_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "base/checksum.h"
#include "base/description.h"
#include "base/section_file.h"
#include "castor/error.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBatch = "batch of rays", kRange = "range of rays", kCounts = "counts", kHits = "hits";
constexpr ElementType kText{"bytes", 1}, kNumber{"ulong", 8}, kCount{"uint", 4}, kHit{"hit", sizeof(Hit)};

std::string text(const Hit& hit) {
    return fmt::format("t {:.9g}, u {:.9g}, v {:.9g}, primitive {}, instance {}", hit.t, hit.u, hit.v, hit.primitive,
                       hit.instance);
}

/// Returns the first difference between the answers to one ray, `i` and `k` being its numbers in two parts; empty:
/// none. The second text is what the second part has.
std::optional<std::pair<std::string, std::string>> difference_of_ray(const HitsPart& a, std::size_t i,
                                                                     const HitsPart& b, std::size_t k) {
    if (a.counts() && a.answers.counts[i] != b.answers.counts[k])
        return std::pair(fmt::format("{} crossings", a.answers.counts[i]),
                         fmt::format("{} crossings", b.answers.counts[k]));
    const std::uint64_t each = a.hits_per_ray();
    for (std::uint64_t n = 0; n < each; ++n) {
        const Hit &x = a.answers.hits[i * each + n], &y = b.answers.hits[k * each + n];
        if (std::memcmp(&x, &y, sizeof(Hit)) != 0) return std::pair(text(x), text(y));
    }
    return std::nullopt;
}

/// Appends the answers to the rays of `part` from its `from`-th on.
void append(HitsPart& whole, const HitsPart& part, std::size_t from) {
    const auto append_to = [from](auto& to, const auto& column, std::uint64_t each) {
        to.insert(to.end(), column.begin() + static_cast<std::ptrdiff_t>(from * each), column.end());
    };
    if (part.counts()) append_to(whole.answers.counts, part.answers.counts, 1);
    append_to(whole.answers.hits, part.answers.hits, part.hits_per_ray());
    whole.rays += part.rays - from;
}

}  // namespace

std::string describe_batch(std::uint64_t scene_fingerprint, std::span<const Ray> rays, const std::string& query,
                           bool cull_back_faces) {
    const std::string_view bytes(reinterpret_cast<const char*>(rays.data()), rays.size_bytes());
    return fmt::format("castor {}\nscene {:016x}\nrays {} of checksum {:016x}\nquery {}\nback faces {}\n",
                       CASTOR_VERSION, scene_fingerprint, rays.size(), checksum(bytes), query,
                       cull_back_faces ? "culled" : "hit");
}

void save_hits_part(const fs::path& file, const HitsPart& part) {
    const std::uint64_t range[] = {part.ray_count, part.first_ray, part.rays};
    write_section_file(file, kHitsPartFile,
                       {{kBatch, kText, std::as_bytes(std::span(part.description))},
                        {kRange, kNumber, std::as_bytes(std::span(range))},
                        {kCounts, kCount, std::as_bytes(std::span(part.answers.counts))},
                        {kHits, kHit, std::as_bytes(std::span(part.answers.hits))}});
}

HitsPart load_hits_part(const fs::path& file) {
    SectionFile sections(file, kHitsPartFile);
    HitsPart part;
    const auto description = sections.section(kBatch, kText);
    part.description.assign(reinterpret_cast<const char*>(description.data()), description.size());
    const auto range = sections.section(kRange, kNumber);
    const auto counts = sections.section(kCounts, kCount);
    const auto hits = sections.section(kHits, kHit);
    sections.expect_no_more();
    std::uint64_t numbers[3] = {};
    if (range.size() == sizeof numbers) std::memcpy(numbers, range.data(), sizeof numbers);
    part.ray_count = numbers[0];
    part.first_ray = numbers[1];
    part.rays = numbers[2];
    const std::uint64_t hit_count = hits.size() / sizeof(Hit), count_count = counts.size() / sizeof(std::uint32_t);
    if (range.size() != sizeof numbers || part.first_ray > part.ray_count ||
        part.rays > part.ray_count - part.first_ray || (count_count != 0 && count_count != part.rays) ||
        (part.rays == 0 ? hit_count != 0 : hit_count % part.rays != 0))
        throw SceneError(file.string(), 0,
                         fmt::format("is damaged: it has {} hits and {} counts of {} rays from ray {} of {} on",
                                     hit_count, count_count, part.rays, part.first_ray, part.ray_count));
    part.answers.counts.resize(count_count);
    part.answers.hits.resize(hit_count);
    if (count_count > 0) std::memcpy(part.answers.counts.data(), counts.data(), counts.size());
    if (hit_count > 0) std::memcpy(part.answers.hits.data(), hits.data(), hits.size());
    return part;
}

bool is_hits_part(const fs::path& file) {
    return is_section_file(file) && !is_section_file_of_another_kind(file, kHitsPartFile);
}

HitsPart merge_hits(const std::vector<fs::path>& files) {
    struct Source {
        std::string name;
        HitsPart part;
    };
    std::vector<Source> sources;
    for (const fs::path& file : files) sources.push_back({file.string(), load_hits_part(file)});
    const std::string name = sources.front().name, description = sources.front().part.description;
    const std::uint64_t ray_count = sources.front().part.ray_count;
    for (const Source& source : sources)
        if (source.part.description != description || source.part.ray_count != ray_count)
            throw SceneError(source.name, 0,
                             "has hits of other rays: " + difference(source.part.description, description, name));
    const Source* example = nullptr;  // the first that has rays
    for (const Source& source : sources) {
        if (source.part.rays == 0) continue;
        if (!example) example = &source;
        if (source.part.hits_per_ray() != example->part.hits_per_ray() ||
            source.part.counts() != example->part.counts())
            throw SceneError(source.name, 0,
                             fmt::format("is damaged: it has {} hits of each ray, and {} has {}",
                                         source.part.hits_per_ray(), example->name, example->part.hits_per_ray()));
    }
    std::stable_sort(sources.begin(), sources.end(),
                     [](const Source& a, const Source& b) { return a.part.first_ray < b.part.first_ray; });
    HitsPart whole{description, ray_count, 0, 0, {}};
    std::vector<std::pair<std::uint64_t, const Source*>> begins;  // of the rays that a source has brought
    const auto expect_no_gap = [&](std::uint64_t next) {
        if (next > whole.rays)
            throw SceneError(name, 0,
                             fmt::format("rays {} to {} of {} are neither here nor in the other files", whole.rays,
                                         next - 1, ray_count));
    };
    for (const Source& source : sources) {
        const HitsPart& part = source.part;
        expect_no_gap(part.first_ray);
        const std::size_t common = std::min<std::uint64_t>(whole.rays - part.first_ray, part.rays);
        for (std::size_t i = 0; i < common; ++i) {
            const auto different = difference_of_ray(whole, part.first_ray + i, part, i);
            if (!different) continue;
            const auto owner =
                std::prev(std::upper_bound(begins.begin(), begins.end(), part.first_ray + i,
                                           [](std::uint64_t ray, const auto& begin) { return ray < begin.first; }));
            throw DeviceError(
                "", "", 0,
                fmt::format("ray {} has other hits in two files: {} in {}, {} in {}. castor doctor may "
                            "tell which device is wrong",
                            part.first_ray + i, different->first, owner->second->name, different->second, source.name));
        }
        if (common == part.rays) continue;
        begins.emplace_back(whole.rays, &source);
        append(whole, part, common);
    }
    expect_no_gap(ray_count);
    return whole;
}

}  // namespace castor::cli
