// embree_build: the trees of Castor and of Embree over the same triangles: how long they take to build, and how much of
// them rays visit.
//
//   embree_build SCENE [--rays FILE] [--quality medium|high] [--threads N] [--repeat N]
//
// Both are 8-wide with blocks of four triangles. Embree's time is that of rtcCommitScene. It does not show that tree,
// so visits are counted in the one that rtcBuildBVH makes by the same builder with the settings of BVH8 over Triangle4.
// One plain traversal counts both trees' visits. Prints one JSON document.
#include <embree3/rtcore.h>
#include <oneapi/tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "base/stopwatch.h"
#include "bvh/wide.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "ray_file.h"
#include "scene/scene_arrays.h"

namespace {

using castor::Ray;
using castor::SceneArrays;
using castor::WideBvh;
using Json = nlohmann::ordered_json;

struct Options {
    std::string scene, rays, quality = "medium";
    unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    unsigned repeat = 5;

    RTCBuildQuality embree_quality() const {
        return quality == "high" ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM;
    }
};

struct ReleaseDevice {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
struct ReleaseBvh {
    void operator()(RTCBVH bvh) const { rtcReleaseBVH(bvh); }
};
using EmbreeDevice = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice>;

void check(RTCDevice device) {
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE)
        throw castor::Error("Embree fails with error " + std::to_string(error));
}

/// Seconds of one rtcCommitScene.
double commit_seconds(RTCDevice device, const castor::Scene& scene, RTCBuildQuality quality) {
    const std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene> embree(rtcNewScene(device));
    rtcSetSceneBuildQuality(embree.get(), quality);
    for (const castor::Mesh& mesh : scene.meshes) {
        const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                  sizeof(glm::vec3), mesh.positions.size());
        void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                  sizeof(glm::uvec3), mesh.triangles.size());
        check(device);
        std::memcpy(positions, mesh.positions.data(), mesh.positions.size() * sizeof(glm::vec3));
        std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(glm::uvec3));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(embree.get(), geometry);
        rtcReleaseGeometry(geometry);
    }
    const castor::Stopwatch watch;
    rtcCommitScene(embree.get());
    const double seconds = watch.seconds();
    check(device);
    return seconds;
}

/// What rtcBuildBVH makes: inner nodes, and leaves with `primitives`.
struct EmbreeNode {
    std::array<EmbreeNode*, 8> child{};
    std::array<RTCBounds, 8> bounds{};
    std::vector<std::uint32_t> primitives;
};

RTCBuildPrimitive build_primitive(const SceneArrays& arrays, std::uint32_t number) {
    const glm::uvec3& triangle = arrays.triangle_vertices[number];
    const glm::vec3 &a = arrays.vertex_position[triangle.x], &b = arrays.vertex_position[triangle.y],
                    &c = arrays.vertex_position[triangle.z];
    const glm::vec3 lower = glm::min(a, glm::min(b, c)), upper = glm::max(a, glm::max(b, c));
    return {lower.x, lower.y, lower.z, 0, upper.x, upper.y, upper.z, number};
}

/// Embree's nodes as Castor's.
class Conversion {
public:
    explicit Conversion(const SceneArrays& arrays) : arrays_(arrays) {}

    WideBvh run(const EmbreeNode& root) {
        wide_.root = add(root);
        return std::move(wide_);
    }

private:
    std::uint32_t add(const EmbreeNode& node) {
        if (!node.primitives.empty()) return add_leaf(node);
        const auto index = static_cast<std::uint32_t>(wide_.nodes.size());
        castor::shared::WideNode wide{};
        for (int place = 0; place < 8; ++place) {
            const bool exists = node.child[place];
            const RTCBounds& bounds = node.bounds[place];
            const float lower[3] = {bounds.lower_x, bounds.lower_y, bounds.lower_z};
            const float upper[3] = {bounds.upper_x, bounds.upper_y, bounds.upper_z};
            for (int axis = 0; axis < 3; ++axis) {
                wide.planes[axis][0][place] = exists ? lower[axis] : std::numeric_limits<float>::infinity();
                wide.planes[axis][1][place] = exists ? upper[axis] : -std::numeric_limits<float>::infinity();
            }
            wide.child[place] = CASTOR_INVALID_INDEX;
        }
        wide_.nodes.push_back(wide);
        for (int place = 0; place < 8; ++place)
            if (node.child[place]) {
                const std::uint32_t code = add(*node.child[place]);
                wide_.nodes[index].child[place] = code;
            }
        return index;
    }

    std::uint32_t add_leaf(const EmbreeNode& leaf) {
        const auto first = static_cast<std::uint32_t>(wide_.triangle_blocks.size());
        for (std::size_t i = 0; i < leaf.primitives.size(); i += 4) {
            castor::shared::TriangleBlock block{};
            for (std::size_t lane = 0; lane < 4; ++lane) {
                const bool exists = i + lane < leaf.primitives.size();
                block.primitive[lane] = exists ? leaf.primitives[i + lane] : CASTOR_INVALID_INDEX;
                for (int vertex = 0; vertex < 3 && exists; ++vertex)
                    for (int axis = 0; axis < 3; ++axis)
                        block.vertex[vertex][axis][lane] =
                            arrays_.vertex_position[arrays_.triangle_vertices[leaf.primitives[i + lane]][vertex]][axis];
            }
            wide_.triangle_blocks.push_back(block);
        }
        const auto blocks = static_cast<std::uint32_t>(wide_.triangle_blocks.size()) - first;
        return CASTOR_WIDE_LEAF | (blocks - 1) << CASTOR_WIDE_COUNT_SHIFT | first;
    }

    const SceneArrays& arrays_;
    WideBvh wide_;
};

/// Embree's tree with the settings that it uses for BVH8 over Triangle4: as many as 7 blocks a leaf, all prices 1.
WideBvh embree_tree(RTCDevice device, const SceneArrays& arrays, RTCBuildQuality quality) {
    std::vector<RTCBuildPrimitive> primitives;
    for (std::uint32_t i = 0; i < arrays.triangle_count(); ++i)
        if (arrays.triangle_vertices[i].x != arrays.triangle_vertices[i].y)
            primitives.push_back(build_primitive(arrays, i));
    const std::size_t count = primitives.size();
    if (quality == RTC_BUILD_QUALITY_HIGH) primitives.resize(2 * count);  // room for pieces

    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    const std::unique_ptr<std::remove_pointer_t<RTCBVH>, ReleaseBvh> bvh(rtcNewBVH(device));
    arguments.bvh = bvh.get();
    arguments.buildQuality = quality;
    arguments.maxBranchingFactor = 8;
    arguments.sahBlockSize = 4;
    arguments.minLeafSize = 4;
    arguments.maxLeafSize = 28;
    arguments.traversalCost = 1.0f;
    arguments.intersectionCost = 1.0f;
    arguments.primitives = primitives.data();
    arguments.primitiveCount = count;
    arguments.primitiveArrayCapacity = primitives.size();
    arguments.userPtr = const_cast<SceneArrays*>(&arrays);
    arguments.createNode = [](RTCThreadLocalAllocator, unsigned, void*) -> void* { return new EmbreeNode; };
    arguments.setNodeChildren = [](void* node, void** children, unsigned children_count, void*) {
        for (unsigned i = 0; i < children_count; ++i)
            static_cast<EmbreeNode*>(node)->child[i] = static_cast<EmbreeNode*>(children[i]);
    };
    arguments.setNodeBounds = [](void* node, const RTCBounds** bounds, unsigned children_count, void*) {
        for (unsigned i = 0; i < children_count; ++i) static_cast<EmbreeNode*>(node)->bounds[i] = *bounds[i];
    };
    arguments.createLeaf = [](RTCThreadLocalAllocator, const RTCBuildPrimitive* first, std::size_t leaf_count,
                              void*) -> void* {
        auto* leaf = new EmbreeNode;
        for (std::size_t i = 0; i < leaf_count; ++i) leaf->primitives.push_back(first[i].primID);
        return leaf;
    };
    arguments.splitPrimitive = [](const RTCBuildPrimitive* primitive, unsigned axis, float position, RTCBounds* left,
                                  RTCBounds* right, void* user) {
        const auto& scene = *static_cast<const SceneArrays*>(user);
        const glm::vec3 whole[2] = {{primitive->lower_x, primitive->lower_y, primitive->lower_z},
                                    {primitive->upper_x, primitive->upper_y, primitive->upper_z}};
        glm::vec3 lower[2] = {glm::vec3(INFINITY), glm::vec3(INFINITY)},
                  upper[2] = {glm::vec3(-INFINITY), glm::vec3(-INFINITY)};
        const auto extend = [&](int side, const glm::vec3& p) {
            lower[side] = glm::min(lower[side], p);
            upper[side] = glm::max(upper[side], p);
        };
        const glm::uvec3& triangle = scene.triangle_vertices[primitive->primID];
        for (int i = 0; i < 3; ++i) {
            const glm::vec3 &a = scene.vertex_position[triangle[i]], &b = scene.vertex_position[triangle[(i + 1) % 3]];
            const float da = a[axis] - position, db = b[axis] - position;
            if (da <= 0) extend(0, a);
            if (da >= 0) extend(1, a);
            if ((da < 0) != (db < 0) && da != 0 && db != 0) {
                const glm::vec3 p = a + (b - a) * (da / (da - db));
                extend(0, p);
                extend(1, p);
            }
        }
        const auto store = [&](int side, RTCBounds* bounds) {
            const glm::vec3 l = glm::max(lower[side], whole[0]), u = glm::min(upper[side], whole[1]);
            *bounds = {l.x, l.y, l.z, 0, u.x, u.y, u.z, 0};
        };
        store(0, left);
        store(1, right);
    };
    const auto* root = static_cast<const EmbreeNode*>(rtcBuildBVH(&arguments));
    check(device);
    if (!root) throw castor::Error("Embree builds no tree");
    return Conversion(arrays).run(*root);  // the program ends soon, and its nodes with it
}

/// Means over all rays.
struct Visits {
    double nodes = 0.0, blocks = 0.0;
};

/// Finds the nearest hit as the strategy `wide` does, nearest child first, and counts.
class CountingTraversal {
public:
    explicit CountingTraversal(const WideBvh& tree) : tree_(tree) {}

    Visits run(const std::vector<Ray>& rays) {
        for (const Ray& ray : rays) trace(ray);
        const double count = std::max<double>(1.0, static_cast<double>(rays.size()));
        return {static_cast<double>(nodes_) / count, static_cast<double>(blocks_) / count};
    }

private:
    struct Waiting {
        float entry;
        std::uint32_t code;
    };

    void trace(const Ray& ray) {
        best_ = ray.t_max;
        const glm::vec3 origin(ray.origin[0], ray.origin[1], ray.origin[2]),
            direction(ray.direction[0], ray.direction[1], ray.direction[2]);
        std::vector<Waiting> waiting{{ray.t_min, tree_.root}};
        while (!waiting.empty()) {
            const Waiting next = waiting.back();
            waiting.pop_back();
            if (next.entry > best_) continue;
            if (next.code & CASTOR_WIDE_LEAF)
                visit_leaf(next.code, origin, direction, ray.t_min);
            else
                visit_node(tree_.nodes[next.code], origin, direction, ray.t_min, waiting);
        }
    }

    void visit_node(const castor::shared::WideNode& node, const glm::vec3& origin, const glm::vec3& direction,
                    float t_min, std::vector<Waiting>& waiting) {
        ++nodes_;
        const std::size_t base = waiting.size();
        for (int place = 0; place < 8; ++place) {
            if (node.child[place] == CASTOR_INVALID_INDEX) continue;
            float entry = t_min, exit = best_;
            for (int axis = 0; axis < 3; ++axis) {
                const float inverse = 1.0f / direction[axis];
                const float a = (node.planes[axis][0][place] - origin[axis]) * inverse;
                const float b = (node.planes[axis][1][place] - origin[axis]) * inverse;
                entry = std::max(entry, std::min(a, b));
                exit = std::min(exit, std::max(a, b));
            }
            if (entry <= exit) waiting.push_back({entry, node.child[place]});
        }
        std::sort(waiting.begin() + static_cast<std::ptrdiff_t>(base), waiting.end(),
                  [](const Waiting& a, const Waiting& b) { return a.entry > b.entry; });
    }

    void visit_leaf(std::uint32_t code, const glm::vec3& origin, const glm::vec3& direction, float t_min) {
        const std::uint32_t first = code & CASTOR_WIDE_FIRST_MASK;
        const std::uint32_t count = ((code >> CASTOR_WIDE_COUNT_SHIFT) & CASTOR_WIDE_COUNT_MASK) + 1;
        blocks_ += count;
        for (std::uint32_t i = first; i < first + count; ++i) {
            const castor::shared::TriangleBlock& block = tree_.triangle_blocks[i];
            for (int lane = 0; lane < 4; ++lane) {
                if (block.primitive[lane] == CASTOR_INVALID_INDEX) continue;
                const auto vertex = [&](int k) {
                    return glm::vec3(block.vertex[k][0][lane], block.vertex[k][1][lane], block.vertex[k][2][lane]);
                };
                test(vertex(0), vertex(1), vertex(2), origin, direction, t_min);
            }
        }
    }

    // Möller, Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".
    void test(const glm::vec3& p0, const glm::vec3& p1, const glm::vec3& p2, const glm::vec3& origin,
              const glm::vec3& direction, float t_min) {
        const glm::vec3 e1 = p1 - p0, e2 = p2 - p0, p = glm::cross(direction, e2), s = origin - p0,
                        q = glm::cross(s, e1);
        const float inverse = 1.0f / glm::dot(e1, p);
        const float u = glm::dot(s, p) * inverse, v = glm::dot(direction, q) * inverse, t = glm::dot(e2, q) * inverse;
        if (u >= 0 && v >= 0 && u + v <= 1 && t >= t_min && t < best_) best_ = t;
    }

    const WideBvh& tree_;
    float best_ = 0.0f;
    std::uint64_t nodes_ = 0, blocks_ = 0;
};

Json part(const std::vector<double>& seconds, std::size_t triangles, const Visits* visits) {
    std::vector<double> sorted = seconds;
    std::sort(sorted.begin(), sorted.end());
    const double median = 0.5 * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
    Json json = {{"build_seconds", seconds},
                 {"median_seconds", median},
                 {"mtriangles_per_second", median > 0.0 ? static_cast<double>(triangles) / median / 1e6 : 0.0}};
    if (visits) json.update({{"nodes_per_ray", visits->nodes}, {"blocks_per_ray", visits->blocks}});
    return json;
}

Json run(const Options& options) {
    const castor::Scene scene = castor::load_scene(options.scene);
    if (!scene.spheres.empty() || !scene.planes.empty())
        throw castor::UsageError("only scenes of triangles alone are compared");
    const SceneArrays arrays = castor::flatten(scene);
    if (!arrays.instances.empty())
        throw castor::SceneError(scene.file, 0, "has instances, which this comparison does not know");
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism, options.threads);
    const EmbreeDevice device(rtcNewDevice(("threads=" + std::to_string(options.threads)).c_str()));
    if (!device) throw castor::Error("Embree makes no device");

    castor::BvhOptions bvh_options = castor::kForBlocks;
    bvh_options.quality = castor::tree_quality_from_string(options.quality);
    const auto build = [&] {
        return castor::collapse_bvh(primitives_of(arrays), castor::build_bvh(primitives_of(arrays), bvh_options));
    };
    std::vector<double> castor_seconds, embree_seconds;
    for (unsigned i = 0; i <= options.repeat; ++i) {
        const castor::Stopwatch watch;
        build();
        const double seconds = watch.seconds();
        const double commit = commit_seconds(device.get(), scene, options.embree_quality());
        if (i == 0) continue;  // to warm up
        castor_seconds.push_back(seconds);
        embree_seconds.push_back(commit);
    }
    Visits castor_visits, embree_visits;
    if (!options.rays.empty()) {
        const std::vector<Ray> rays = castor::cli::read_rays(options.rays);
        castor_visits = CountingTraversal(build()).run(rays);
        embree_visits = CountingTraversal(embree_tree(device.get(), arrays, options.embree_quality())).run(rays);
    }
    return {{"scene", options.scene},
            {"triangles", arrays.triangle_count()},
            {"threads", options.threads},
            {"quality", options.quality},
            {"castor", part(castor_seconds, arrays.triangle_count(), options.rays.empty() ? nullptr : &castor_visits)},
            {"embree", part(embree_seconds, arrays.triangle_count(), options.rays.empty() ? nullptr : &embree_visits)}};
}

}  // namespace

int main(int argc, char** argv) try {
    Options options;
    CLI::App app(
        "Builds trees over a scene's triangles by Castor and by Embree, in turns, and prints times and visits as JSON.",
        "embree_build");
    app.add_option("SCENE", options.scene, "scene (.xml) or mesh (.ply, .obj), of triangles alone")->required();
    app.add_option("--rays", options.rays, "file of rays whose visits to count");
    app.add_option("--quality", options.quality)->check(CLI::IsMember({"medium", "high"}))->capture_default_str();
    app.add_option("--threads", options.threads)->check(CLI::Range(1u, 1024u))->capture_default_str();
    app.add_option("--repeat", options.repeat, "timed builds of each")
        ->check(CLI::Range(1u, 1000000u))
        ->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    std::cout << run(options).dump(2) << '\n';
    return 0;
} catch (const std::exception& error) {
    std::cerr << "embree_build: " << error.what() << '\n';
    return 1;
}
