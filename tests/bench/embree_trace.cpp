// embree_trace: a file of rays through Embree, timed as `castor trace` times Castor, so that the two can be compared.
//
//   embree_trace SCENE --rays FILE [--hits FILE] [--query closest|any] [--hint incoherent|coherent] [--threads N]
//   [--repeat N]
//
// Embree is used as it comes: medium build quality, default (not robust) scene flags, the coherence hint that fits the
// rays, and calls of 1, 8 and 16 rays. A scene with instances becomes one of Embree's instances, each mesh a scene of
// its own; they are then all that may be placed. Prints one JSON document; files are those of `castor trace`.
#include <embree3/rtcore.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <barrier>
#include <functional>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "base/stopwatch.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "ray_file.h"

namespace {

using castor::Hit;
using castor::Ray;
using Json = nlohmann::ordered_json;

constexpr std::uint32_t kNothing = 0xffffffffu;
constexpr Hit kMiss{std::numeric_limits<float>::infinity(), 0.0f, 0.0f, kNothing, kNothing};
constexpr Hit kOccluded{0.0f, 0.0f, 0.0f, 0, 0};
constexpr std::size_t kChunk = 1024;  // rays that a thread takes at a time

struct Options {
    std::string scene, rays, hits;
    std::string query = "closest", hint = "incoherent";
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    unsigned repeat = 5;
};

struct ReleaseDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

/// The scene in Embree, with Castor's numbers for its primitives.
class EmbreeScene {
public:
    EmbreeScene(const castor::Scene& scene, unsigned threads)
        : device_(rtcNewDevice(("threads=" + std::to_string(threads)).c_str())) {
        if (!device_) throw castor::Error("Embree makes no device");
        if (!scene.planes.empty()) throw castor::UsageError("Embree has no infinite planes, and this scene has");
        scene_.reset(rtcNewScene(device_.get()));
        rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);
        has_instances_ = !scene.instances.empty();
        if (!has_instances_)
            for (const castor::Mesh& mesh : scene.meshes) add(mesh);
        if (!scene.spheres.empty()) add(scene.spheres);
        if (has_instances_) add_meshes_apart(scene);
        const castor::Stopwatch watch;
        for (const auto& part : parts_) rtcCommitScene(part.get());
        // In the order in which Castor numbers instances, from 1 on.
        for (const castor::MeshInstance& instance : scene.instances) place(instance.mesh, instance.transform);
        for (std::size_t i = 0; i < parts_.size(); ++i) place(i, scene.meshes[i].transform);
        rtcCommitScene(scene_.get());
        build_seconds_ = watch.seconds();
        if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
            throw castor::Error("Embree refuses the scene with error " + std::to_string(error));
    }

    RTCScene get() const { return scene_.get(); }
    double build_seconds() const { return build_seconds_; }

    std::string version() const {
        const auto part = [&](RTCDeviceProperty property) {
            return std::to_string(rtcGetDeviceProperty(device_.get(), property));
        };
        return part(RTC_DEVICE_PROPERTY_VERSION_MAJOR) + "." + part(RTC_DEVICE_PROPERTY_VERSION_MINOR) + "." +
               part(RTC_DEVICE_PROPERTY_VERSION_PATCH);
    }

    Hit hit(float t, float u, float v, std::uint32_t instance, std::uint32_t geometry, std::uint32_t local) const {
        if (has_instances_) return {t, u, v, local, instance + 1};
        return {t, u, v, first_[geometry] + local, 0};
    }

private:
    template <class T>
    T* buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t count) {
        void* data = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), count);
        if (!data) throw castor::Error("Embree gives no memory for the scene");
        return static_cast<T*>(data);
    }

    void attach(RTCGeometry geometry, std::size_t primitives) {
        attach(geometry, scene_.get());
        first_.push_back(next_);
        next_ += static_cast<std::uint32_t>(primitives);
    }

    static void attach(RTCGeometry geometry, RTCScene scene) {
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
    }

    void add_meshes_apart(const castor::Scene& scene) {
        for (const castor::Mesh& mesh : scene.meshes) {
            parts_.emplace_back(rtcNewScene(device_.get()));
            rtcSetSceneBuildQuality(parts_.back().get(), RTC_BUILD_QUALITY_MEDIUM);
            attach(geometry_of(mesh), parts_.back().get());
        }
    }

    void place(std::size_t part, const castor::Transform& transform) {
        RTCGeometry instance = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, parts_[part].get());
        rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &transform);
        attach(instance, scene_.get());
    }

    void add(const castor::Mesh& mesh) { attach(geometry_of(mesh), mesh.triangles.size()); }

    RTCGeometry geometry_of(const castor::Mesh& mesh) {
        RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        std::copy(mesh.positions.begin(), mesh.positions.end(),
                  buffer<glm::vec3>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.positions.size()));
        std::copy(mesh.triangles.begin(), mesh.triangles.end(),
                  buffer<glm::uvec3>(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles.size()));
        return geometry;
    }

    void add(const std::vector<castor::Sphere>& spheres) {
        struct CenterRadius {
            glm::vec3 center;
            float radius;
        };
        RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_SPHERE_POINT);
        std::transform(spheres.begin(), spheres.end(),
                       buffer<CenterRadius>(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, spheres.size()),
                       [](const castor::Sphere& sphere) {
                           return CenterRadius{sphere.center, sphere.radius};
                       });
        attach(geometry, spheres.size());
    }

    std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice> device_;
    std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene> scene_;
    std::vector<std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene>> parts_;  // of each mesh that is placed
    bool has_instances_ = false;
    std::vector<std::uint32_t> first_;
    std::uint32_t next_ = 0;
    double build_seconds_ = 0.0;
};

// One ray a call, and `Width` rays a call, behind the same names.
template <int Width>
struct Packet;

template <>
struct Packet<1> {
    RTCRayHit value;

    void set(int, const Ray& ray) {
        value.ray.org_x = ray.origin[0], value.ray.org_y = ray.origin[1], value.ray.org_z = ray.origin[2];
        value.ray.dir_x = ray.direction[0], value.ray.dir_y = ray.direction[1], value.ray.dir_z = ray.direction[2];
        value.ray.tnear = ray.t_min, value.ray.tfar = ray.t_max;
        value.ray.time = 0.0f, value.ray.mask = ~0u, value.ray.id = 0, value.ray.flags = 0;
        value.hit.geomID = value.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    }
    void closest(const int*, RTCScene scene, RTCIntersectContext* context) { rtcIntersect1(scene, context, &value); }
    void any(const int*, RTCScene scene, RTCIntersectContext* context) { rtcOccluded1(scene, context, &value.ray); }
    float t(int) const { return value.ray.tfar; }
    Hit hit(int, const EmbreeScene& scene) const {
        if (value.hit.geomID == RTC_INVALID_GEOMETRY_ID) return kMiss;
        return scene.hit(value.ray.tfar, value.hit.u, value.hit.v, value.hit.instID[0], value.hit.geomID,
                         value.hit.primID);
    }
};

template <int Width, class RayHitN, class RayN, auto Intersect, auto Occluded>
struct WidePacket {
    RayHitN value;

    void set(int k, const Ray& ray) {
        value.ray.org_x[k] = ray.origin[0], value.ray.org_y[k] = ray.origin[1], value.ray.org_z[k] = ray.origin[2];
        value.ray.dir_x[k] = ray.direction[0], value.ray.dir_y[k] = ray.direction[1],
        value.ray.dir_z[k] = ray.direction[2];
        value.ray.tnear[k] = ray.t_min, value.ray.tfar[k] = ray.t_max;
        value.ray.time[k] = 0.0f, value.ray.mask[k] = ~0u, value.ray.id[k] = 0, value.ray.flags[k] = 0;
        value.hit.geomID[k] = value.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    void closest(const int* valid, RTCScene scene, RTCIntersectContext* context) {
        Intersect(valid, scene, context, &value);
    }
    void any(const int* valid, RTCScene scene, RTCIntersectContext* context) {
        Occluded(valid, scene, context, &value.ray);
    }
    float t(int k) const { return value.ray.tfar[k]; }
    Hit hit(int k, const EmbreeScene& scene) const {
        if (value.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) return kMiss;
        return scene.hit(value.ray.tfar[k], value.hit.u[k], value.hit.v[k], value.hit.instID[0][k], value.hit.geomID[k],
                         value.hit.primID[k]);
    }
};
template <>
struct Packet<8> : WidePacket<8, RTCRayHit8, RTCRay8, rtcIntersect8, rtcOccluded8> {};
template <>
struct Packet<16> : WidePacket<16, RTCRayHit16, RTCRay16, rtcIntersect16, rtcOccluded16> {};

template <int Width>
void trace_chunk(const EmbreeScene& scene, const Options& options, const std::vector<Ray>& rays, std::vector<Hit>& hits,
                 std::size_t begin, std::size_t end) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags =
        options.hint == "coherent" ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    const bool any = options.query == "any";
    for (std::size_t first = begin; first < end; first += Width) {
        Packet<Width> packet;
        alignas(64) int valid[Width];
        const int count = static_cast<int>(std::min<std::size_t>(Width, end - first));
        for (int k = 0; k < Width; ++k) {
            valid[k] = k < count ? -1 : 0;
            packet.set(k, rays[first + std::min(k, count - 1)]);
        }
        if (any)
            packet.any(valid, scene.get(), &context);
        else
            packet.closest(valid, scene.get(), &context);
        for (int k = 0; k < count; ++k)
            hits[first + k] = any ? (packet.t(k) < 0.0f ? kOccluded : kMiss) : packet.hit(k, scene);
    }
}

/// Threads that stay for all runs, as those of an OpenCL driver do. The caller is one of them.
class Crew {
public:
    explicit Crew(unsigned threads) : start_(threads), end_(threads) {
        for (unsigned i = 1; i < threads; ++i) others_.emplace_back([this] { wait_for_work(); });
    }
    ~Crew() {
        work_ = nullptr;
        start_.arrive_and_wait();
        for (std::thread& other : others_) other.join();
    }
    Crew(const Crew&) = delete;
    Crew& operator=(const Crew&) = delete;

    /// Everyone does `work`, once.
    void run(const std::function<void()>& work) {
        work_ = &work;
        start_.arrive_and_wait();
        work();
        end_.arrive_and_wait();
    }

private:
    void wait_for_work() {
        while (true) {
            start_.arrive_and_wait();
            if (!work_) return;
            (*work_)();
            end_.arrive_and_wait();
        }
    }

    std::barrier<> start_, end_;
    const std::function<void()>* work_ = nullptr;
    std::vector<std::thread> others_;
};

/// Seconds for all rays, on all threads.
template <int Width>
double trace(Crew& crew, const EmbreeScene& scene, const Options& options, const std::vector<Ray>& rays,
             std::vector<Hit>& hits) {
    const castor::Stopwatch watch;
    std::atomic<std::size_t> next = 0;
    crew.run([&] {
        for (std::size_t begin; (begin = next.fetch_add(kChunk)) < rays.size();)
            trace_chunk<Width>(scene, options, rays, hits, begin, std::min(begin + kChunk, rays.size()));
    });
    return watch.seconds();
}

/// As Embree's manual recommends for speed: denormal numbers count as zero, here and in the threads that start later.
void ignore_denormals() {
#if defined(__SSE__)
    constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
    _mm_setcsr(_mm_getcsr() | kFlushToZero | kDenormalsAreZero);
#endif
}

Json run(const Options& options) {
    const castor::Scene scene = castor::load_scene(options.scene);
    const auto is_moved = [](const auto& object) { return object.transform != castor::Transform(1.0f); };
    if (scene.instances.empty() && (std::any_of(scene.meshes.begin(), scene.meshes.end(), is_moved) ||
                                    std::any_of(scene.spheres.begin(), scene.spheres.end(), is_moved)))
        throw castor::SceneError(scene.file, 0, "has transformations, which this comparison does not know");
    std::vector<bool> is_placed(scene.meshes.size(), false);
    for (const castor::MeshInstance& instance : scene.instances) is_placed.at(instance.mesh) = true;
    if (!scene.instances.empty() &&
        (!scene.spheres.empty() || std::find(is_placed.begin(), is_placed.end(), false) != is_placed.end()))
        throw castor::SceneError(scene.file, 0,
                                 "has instances and other objects, which this comparison does not know together");
    const std::vector<Ray> rays = castor::cli::read_rays(options.rays);
    ignore_denormals();
    const EmbreeScene embree(scene, options.threads);
    std::vector<Hit> hits(rays.size());
    Crew crew(options.threads);

    constexpr decltype(&trace<1>) kTraces[] = {trace<1>, trace<8>, trace<16>};
    constexpr const char* kWidths[] = {"1", "8", "16"};
    std::vector<double> seconds[std::size(kTraces)];
    for (const auto run_width : kTraces) run_width(crew, embree, options, rays, hits);  // to warm up
    for (unsigned i = 0; i < options.repeat; ++i)
        for (std::size_t w = 0; w < std::size(kTraces); ++w)
            seconds[w].push_back(kTraces[w](crew, embree, options, rays, hits));
    if (!options.hits.empty()) {
        trace<1>(crew, embree, options, rays, hits);
        castor::cli::write_answers(options.hits, {{}, hits});
    }

    Json widths, rates;
    for (std::size_t w = 0; w < std::size(kTraces); ++w) {
        widths[kWidths[w]] = seconds[w];
        const double best = *std::min_element(seconds[w].begin(), seconds[w].end());
        rates[kWidths[w]] = best > 0.0 ? static_cast<double>(rays.size()) / best / 1e6 : 0.0;
    }
    const auto hit_count =
        std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return hit.primitive != kNothing; });
    return {{"embree_version", embree.version()},
            {"scene", options.scene},
            {"rays", rays.size()},
            {"hits", hit_count},
            {"query", options.query},
            {"hint", options.hint},
            {"threads", options.threads},
            {"build_seconds", embree.build_seconds()},
            {"seconds", widths},
            {"mrays_per_second", rates}};
}

}  // namespace

int main(int argc, char** argv) try {
    Options options;
    CLI::App app("Traces a file of rays through Embree with calls of 1, 8 and 16 rays, and prints the times as JSON.",
                 "embree_trace");
    app.add_option("SCENE", options.scene, "scene (.xml) or mesh (.ply, .obj)")->required();
    app.add_option("--rays", options.rays, "file of rays to read")->required();
    app.add_option("--hits", options.hits, "file of hits to write");
    app.add_option("--query", options.query)->check(CLI::IsMember({"closest", "any"}))->capture_default_str();
    app.add_option("--hint", options.hint)->check(CLI::IsMember({"coherent", "incoherent"}))->capture_default_str();
    app.add_option("--threads", options.threads)->check(CLI::Range(1u, 1024u))->capture_default_str();
    app.add_option("--repeat", options.repeat, "timed runs")->check(CLI::Range(1u, 1000000u))->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    std::cout << run(options).dump(2) << '\n';
    return 0;
} catch (const std::exception& error) {
    std::cerr << "embree_trace: " << error.what() << '\n';
    return 1;
}
