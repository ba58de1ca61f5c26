#include "hits_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

#include "base/checksum.h"
#include "base/description.h"
#include "base/section_file.h"
#include "castor/error.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBatch = "batch of rays", kRange = "rays", kHits = "hits";
constexpr ElementType kText{"bytes", 1}, kNumber{"ulong", 8}, kHit{"hit", sizeof(Hit)};

std::string text(const Hit& hit) {
    return fmt::format("t {:.9g}, u {:.9g}, v {:.9g}, primitive {}, instance {}", hit.t, hit.u, hit.v, hit.primitive,
                       hit.instance);
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
    const std::uint64_t range[] = {part.ray_count, part.first_ray};
    write_section_file(file, kHitsPartFile,
                       {{kBatch, kText, std::as_bytes(std::span(part.description))},
                        {kRange, kNumber, std::as_bytes(std::span(range))},
                        {kHits, kHit, std::as_bytes(std::span(part.hits))}});
}

HitsPart load_hits_part(const fs::path& file) {
    SectionFile sections(file, kHitsPartFile);
    HitsPart part;
    const auto description = sections.section(kBatch, kText);
    part.description.assign(reinterpret_cast<const char*>(description.data()), description.size());
    const auto range = sections.section(kRange, kNumber);
    const auto hits = sections.section(kHits, kHit);
    sections.expect_no_more();
    std::uint64_t numbers[2] = {};
    if (range.size() == sizeof numbers) std::memcpy(numbers, range.data(), sizeof numbers);
    part.ray_count = numbers[0];
    part.first_ray = numbers[1];
    const std::uint64_t count = hits.size() / sizeof(Hit);
    if (range.size() != sizeof numbers || part.first_ray > part.ray_count || count > part.ray_count - part.first_ray)
        throw SceneError(
            file.string(), 0,
            fmt::format("is damaged: it has {} hits from ray {} of {} on", count, part.first_ray, part.ray_count));
    part.hits.resize(count);
    if (count > 0) std::memcpy(part.hits.data(), hits.data(), hits.size());
    return part;
}

bool is_hits_part(const fs::path& file) {
    return is_section_file(file) && !is_section_file_of_another_kind(file, kHitsPartFile);
}

std::vector<Hit> merge_hits(const std::vector<fs::path>& files) {
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
    std::stable_sort(sources.begin(), sources.end(),
                     [](const Source& a, const Source& b) { return a.part.first_ray < b.part.first_ray; });
    std::vector<Hit> hits;
    std::vector<std::pair<std::uint64_t, const Source*>> begins;  // of the rays that a source has brought
    const auto expect_no_gap = [&](std::uint64_t next) {
        if (next > hits.size())
            throw SceneError(name, 0,
                             fmt::format("rays {} to {} of {} are neither here nor in the other files", hits.size(),
                                         next - 1, ray_count));
    };
    for (const Source& source : sources) {
        const HitsPart& part = source.part;
        expect_no_gap(part.first_ray);
        const std::size_t common = std::min<std::uint64_t>(hits.size() - part.first_ray, part.hits.size());
        for (std::size_t i = 0; i < common; ++i) {
            const Hit& before = hits[part.first_ray + i];
            if (std::memcmp(&before, &part.hits[i], sizeof(Hit)) == 0) continue;
            const auto owner =
                std::prev(std::upper_bound(begins.begin(), begins.end(), part.first_ray + i,
                                           [](std::uint64_t ray, const auto& begin) { return ray < begin.first; }));
            throw DeviceError(
                "", "", 0,
                fmt::format("ray {} has other hits in two files: {} in {}, {} in {}. castor doctor may "
                            "tell which device is wrong",
                            part.first_ray + i, text(before), owner->second->name, text(part.hits[i]), source.name));
        }
        if (common == part.hits.size()) continue;
        begins.emplace_back(hits.size(), &source);
        hits.insert(hits.end(), part.hits.begin() + static_cast<std::ptrdiff_t>(common), part.hits.end());
    }
    expect_no_gap(ray_count);
    return hits;
}

}  // namespace castor::cli
