// How well several devices share a picture: the parts of one device, some of them slowed down. A slow device traces all rays several times over. Each works alone first, then
// all together: the rate of all should be the sum of the rates of each. Pictures must be the same bytes.
//
// usage: device_scaling [SIZE] [RUNS] [FACTORS ...]     2048, 3, and 1,1 1,2 1,4 3,5: one device for each number, so many times slower than it is
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "failures/opencl_shim.h"
#include "support/meshes.h"
#include "support/picture.h"
#include "support/random_source.h"

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

/// Mray/s of pictures, and the last of them.
struct Rates {
    std::vector<double> rates;
    Film film;
    std::vector<DeviceShare> shares;
};

Rates measure(const BuiltScene& scene, const std::vector<Device>& devices, const std::vector<int>& factors, std::uint32_t size, int runs) {
    slow_down_queues(factors);
    Renderer renderer(scene, devices);
    const Camera camera = square_camera({0, 0, 3}, {0, 0, -1}, 0.4f, size);
    Rates rates;
    for (int run = 0; run <= runs; ++run) {
        rates.film = renderer.render(camera);
        const RenderStatistics statistics = renderer.statistics();
        rates.shares = statistics.devices;
        if (run > 0) rates.rates.push_back(static_cast<double>(statistics.rays) / statistics.render_seconds / 1e6);  // the first one compiles
    }
    return rates;
}

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
        double sum = 0.0;
        std::string alone;
        std::optional<Film> expected;
        for (std::size_t i = 0; i < devices.size(); ++i) {
            const Rates rates = measure(scene, {devices[i]}, {factors[i]}, size, runs);
            sum += median(rates.rates);
            alone += fmt::format("{}{:.2f}", i ? " + " : "", median(rates.rates));
            if (!expected) expected = rates.film;
            all_equal &= same_bytes(rates.film, *expected);
        }
        const Rates together = measure(scene, devices, factors, size, runs);
        all_equal &= same_bytes(together.film, *expected);
        std::string shares;
        for (const DeviceShare& share : together.shares) shares += fmt::format(" {}", share.tiles);
        fmt::print("{}: alone {} Mray/s, together {:.2f} (from {:.2f} to {:.2f}): {:.1f} % of the sum; tiles{}\n", text, alone, median(together.rates),
                   *std::min_element(together.rates.begin(), together.rates.end()), *std::max_element(together.rates.begin(), together.rates.end()),
                   100 * median(together.rates) / sum, shares);
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
