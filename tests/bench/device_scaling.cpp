// How well several devices share a picture: the parts of one device, some of them slowed down. A slow device traces all
// rays several times over. Each alone and all together take turns: the rate of all should be the sum of the rates of
// each. Pictures must be the same bytes.
//
// usage: device_scaling [SIZE] [RUNS] [FACTORS ...]     2048, 3, and 1,1 1,2 1,4 3,5: one device for each number, so
// many times slower than it is
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "failures/opencl_shim.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "support/picture.h"
#include "support/reference.h"

namespace castor::test {
namespace {

Scene many_triangles() {
    RandomSource random(3);
    Scene scene = scene_of({random_triangles(random, 100000, 0.03f)});
    scene.materials.at(0) = diffuse_material({0.7f, 0.7f, 0.7f});
    scene.lights = {point_light({3, 3, 3}, {900, 900, 900}), point_light({-3, 3, 3}, {500, 500, 500})};
    return scene;
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

std::vector<int> factors_of(std::string_view text) {
    std::vector<int> factors;
    for (const char* at = text.data(); at < text.data() + text.size();) {
        int factor = 0;
        const auto [end, error] = std::from_chars(at, text.data() + text.size(), factor);
        if (error != std::errc() || factor < 1) throw UsageError(fmt::format("\"{}\" is not a list such as 1,2", text));
        factors.push_back(factor);
        at = end + 1;
    }
    return factors;
}

/// Renders the same picture again and again, and keeps the rates.
class Contestant {
public:
    Contestant(const BuiltScene& scene, const std::vector<Device>& devices, const std::vector<int>& factors)
        : renderer_((slow_down_queues(factors), Renderer(scene, devices))) {}

    void render(std::uint32_t size) {
        film_ = renderer_.render(square_camera({0, 0, 3}, {0, 0, -1}, 0.4f, size));
        const RenderStatistics statistics = renderer_.statistics();
        rates_.push_back(static_cast<double>(statistics.rays) / statistics.render_seconds / 1e6);
    }
    /// What the first renders took was compiling, and memory's first use.
    void forget() { rates_.clear(); }
    const std::vector<double>& rates() const { return rates_; }
    const Film& film() const { return film_; }
    std::vector<DeviceShare> shares() const { return renderer_.statistics().devices; }

private:
    Renderer renderer_;
    std::vector<double> rates_;  // Mray/s
    Film film_;
};

int run(int argc, char** argv) {
    const auto number = [&](int i, int otherwise) { return i < argc ? std::stoi(argv[i]) : otherwise; };
    const auto size = static_cast<std::uint32_t>(number(1, 2048));
    const int runs = number(2, 3);
    std::vector<std::string> cases{"1,1", "1,2", "1,4", "3,5"};
    if (argc > 3) cases.assign(argv + 3, argv + argc);
    bool all_equal = true;
    for (const std::string& text : cases) {
        const std::vector<int> factors = factors_of(text);
        const std::vector<Device> devices = select_devices(fmt::format("0/{}", factors.size()));
        const BuiltScene scene(many_triangles(), devices);
        std::vector<std::unique_ptr<Contestant>> contestants;  // each device alone, and all together
        for (std::size_t i = 0; i < devices.size(); ++i)
            contestants.push_back(
                std::make_unique<Contestant>(scene, std::vector{devices[i]}, std::vector{factors[i]}));
        contestants.push_back(std::make_unique<Contestant>(scene, devices, factors));
        for (int run = -1; run < runs; ++run)
            for (const auto& contestant : contestants) {
                contestant->render(size);
                if (run < 0) contestant->forget();
                all_equal &= same_bytes(contestant->film(), contestants.front()->film());
            }
        const Contestant& together = *contestants.back();
        double sum = 0.0;
        std::string alone, shares;
        for (std::size_t i = 0; i < devices.size(); ++i) {
            sum += median(contestants[i]->rates());
            alone += fmt::format("{}{:.2f}", i ? " + " : "", median(contestants[i]->rates()));
            shares += fmt::format(" {}", together.shares()[i].tiles);
        }
        const auto [least, most] = std::minmax_element(together.rates().begin(), together.rates().end());
        fmt::print("{}: alone {} Mray/s, together {:.2f} (from {:.2f} to {:.2f}): {:.1f} % of the sum; tiles{}\n", text,
                   alone, median(together.rates()), *least, *most, 100 * median(together.rates()) / sum, shares);
        std::fflush(stdout);
    }
    fmt::print("pictures: {}\n", all_equal ? "all the same bytes" : "DIFFERENT");
    return all_equal ? 0 : 1;
}

}  // namespace
}  // namespace castor::test

int main(int argc, char** argv) try { return castor::test::run(argc, argv); } catch (const std::exception& error) {
    fmt::print(stderr, "device_scaling: {}\n", error.what());
    return 2;
}
