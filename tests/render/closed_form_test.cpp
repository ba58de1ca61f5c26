// Scenes whose pixels have a known value. Most are looked at by single rays (see Probe); the derivation stands at each.
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <numbers>
#include <string>
#include <utility>

#include "castor/image_io.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

constexpr RuleSet kAllRules[] = {RuleSet::r2022, RuleSet::r795, RuleSet::r2020, RuleSet::r2018};
const glm::vec3 kDown(0, -1, 0);
const glm::vec3 kUp(0, 1, 0);
const glm::dvec3 kBlack(0.0);

RenderOptions depth_limit(std::uint32_t depth) {
    RenderOptions options;
    options.max_recursion_depth = depth;
    return options;
}

/// A floor, the plane y = 0, of the given material.
Scene floor_scene(const Material& material) {
    Scene scene;
    scene.planes.push_back({{0, 0, 0}, kUp, add_material(scene, material), 0});
    return scene;
}

/// The unit square around the origin in the plane y = 0, seen from above; its outside is above.
Mesh unit_tile(std::uint32_t material) {
    return rectangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, material);
}

}  // namespace

TEST_CASE("ambient light alone is reflected by every primitive, and a miss shows the background", "[closed_form]") {
    // ka * Ia, channel by channel.
    Scene scene;
    scene.background = {3, 5, 7};
    scene.ambient_light = {10, 20, 40};
    const std::uint32_t material = add_material(scene, ambient_material({0.5f, 0.25f, 2.0f}));
    scene.meshes.push_back(rectangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, material));
    scene.spheres.push_back({{10, 0, 0}, 1.0f, material, 0});
    scene.planes.push_back({{0, -5, 0}, kUp, material, 0});
    Probe probe(scene);
    for (const float x : {0.25f, 10.0f, 20.0f}) {
        CAPTURE(x);
        CASTOR_CHECK_CLOSE(probe({x, 4, 0.125f}, kDown), glm::dvec3(5, 5, 80));
    }
    CASTOR_CHECK_CLOSE(probe({0.25f, 4, 0}, kUp), glm::dvec3(3, 5, 7));
}

TEST_CASE("a diffuse floor under a point light falls off with the square of the distance and the cosine",
          "[closed_form]") {
    // Light of intensity I at height h, point at distance s from its foot: r^2 = h^2 + s^2 and n.l = h / r, so that
    // kd I / r^2 * n.l = kd I h / (h^2 + s^2)^(3/2); straight below, kd I / h^2.
    const double h = 3.0;
    Scene scene = floor_scene(diffuse_material({0.5f, 1.0f, 0.25f}));
    scene.lights = {point_light({0, 3, 0}, {900, 450, 1800})};
    Probe probe(scene);
    for (const double s : {0.0, 0.5, 2.0, 40.0}) {
        CAPTURE(s);
        const double arriving = h / std::pow(h * h + s * s, 1.5);
        CASTOR_CHECK_CLOSE(probe({static_cast<float>(s), 1, 0}, kDown), glm::dvec3(450, 450, 450) * arriving);
    }
}

TEST_CASE("light with a range ends there", "[closed_form]") {
    // The light of above times 1 - (r / range)^4; of a spot straight down as well.
    const double h = 3.0;
    for (const bool is_spot : {false, true})
        for (const double range : {2.9, 4.0, 5.0, 1e6}) {
            Scene scene = floor_scene(diffuse_material(glm::vec3(0.5f)));
            Light light = point_light({0, 3, 0}, glm::vec3(900.0f));
            light.kind = is_spot ? Light::Kind::spot : Light::Kind::point;
            light.spot = {{0, 3, 0}, {0, -1, 0}, glm::vec3(900.0f), 3.1f, 3.0f};
            light.point.range = light.spot.range = static_cast<float>(range);
            scene.lights = {light};
            Probe probe(scene);
            for (const double s : {0.0, 1.0, 3.0, 3.9999, 4.0001}) {
                const double r = std::hypot(h, s), share = std::pow(r / range, 4);
                CAPTURE(is_spot, range, s);
                const double expected = share < 1.0 ? 450.0 * h / (r * r * r) * (1.0 - share) : 0.0;
                const double found = double{probe({static_cast<float>(s), 1, 0}, kDown).x};
                CHECK(std::abs(found - expected) <= 2e-5 * 450.0 * h / (r * r * r));
            }
        }
    Scene scene = floor_scene(diffuse_material(glm::vec3(0.5f)));
    scene.lights = {point_light({0, 3, 0}, glm::vec3(900.0f))};
    scene.lights[0].point.range = 0.0f;
    CHECK_THROWS_WITH(Probe(scene), Catch::Contains("range is 0, expected at least 1e-30"));
}

TEST_CASE("a directional light arrives with its radiance times the cosine, wherever the surface lies",
          "[closed_form]") {
    // Direction (3, -4, 0), of length 5: n.l = 4/5.
    Scene scene = floor_scene(diffuse_material(glm::vec3(0.5f)));
    scene.lights = {directional_light({3, -4, 0}, {100, 200, 300})};
    Probe probe(scene);
    CASTOR_CHECK_CLOSE(probe({0, 1, 0}, kDown), glm::dvec3(40, 80, 120));
    CASTOR_CHECK_CLOSE(probe({1000, 1, -500}, kDown), glm::dvec3(40, 80, 120));
}

TEST_CASE("lights of all kinds add up", "[closed_form]") {
    // The three terms of the tests beside this one: 0.5 * 400 / 2^2 + 0.5 * 100 + ambient 0.25 * 8.
    Material material = diffuse_material(glm::vec3(0.5f));
    material.ambient = glm::vec3(0.25f);
    Scene scene = floor_scene(material);
    scene.ambient_light = glm::vec3(8);
    scene.lights = {point_light({0, 2, 0}, glm::vec3(400)), directional_light({0, -1, 0}, glm::vec3(100))};
    CASTOR_CHECK_CLOSE(Probe(scene)({0, 1, 0}, kDown), glm::dvec3(102));
}

TEST_CASE("a spot light is full inside the falloff cone, dark outside the coverage cone, and falls off between",
          "[closed_form]") {
    // Spot at height 1 over the floor, pointing down: at distance s from its foot cos theta = 1 / sqrt(1 + s^2) = n.l,
    // r^2 = 1 + s^2.
    const double half_coverage = 0.6, half_falloff = 0.3;
    Scene scene = floor_scene(diffuse_material(glm::vec3(1.0f)));
    Light light;
    light.kind = Light::Kind::spot;
    light.spot.position = {0, 1, 0};
    light.spot.direction = {0, -5, 0};
    light.spot.intensity = glm::vec3(100);
    light.spot.coverage_radians = static_cast<float>(2 * half_coverage);
    light.spot.falloff_radians = static_cast<float>(2 * half_falloff);
    scene.lights = {light};
    Probe probe(scene);
    scene.lights[0].spot.falloff = SpotFalloff::square;
    Probe square_probe(scene);
    const auto expected = [&](double s, double f) { return glm::dvec3(100 * f / std::pow(1 + s * s, 1.5)); };
    for (const double angle : {0.0, 0.1, 0.29}) {
        CAPTURE(angle);
        const float s = static_cast<float>(std::tan(angle));
        CASTOR_CHECK_CLOSE(probe({s, 0.5f, 0}, kDown), expected(s, 1.0));
    }
    for (const double angle : {0.35, 0.45, 0.5}) {
        CAPTURE(angle);
        const float s = static_cast<float>(std::tan(angle));
        const double cos_coverage = std::cos(half_coverage), cos_falloff = std::cos(half_falloff);
        const double part = (std::cos(angle) - cos_coverage) / (cos_falloff - cos_coverage);
        // The fourth power of a small difference of cosines: 1e-5 holds as long as the difference is not tiny.
        CASTOR_CHECK_CLOSE(probe({s, 0.5f, 0}, kDown), expected(s, std::pow(part, 4)));
        CASTOR_CHECK_CLOSE(square_probe({s, 0.5f, 0}, kDown), expected(s, part * part));
    }
    for (const double angle : {0.61, 1.0}) {
        CAPTURE(angle);
        CASTOR_CHECK_CLOSE(probe({static_cast<float>(std::tan(angle)), 0.5f, 0}, kDown), kBlack);
    }
}

TEST_CASE("the highlight is full in the mirror direction and falls as a power of n.h", "[closed_form]") {
    // Viewer at (-2, 2, 0) and light at (2, 2, 0) over the origin: h = n, so ks E is full, and not multiplied by n.l.
    // r^2 = 8, n.l = 1/sqrt(2).
    Material material;
    material.diffuse = glm::vec3(0.25f);
    material.specular = {1.0f, 0.5f, 2.0f};
    material.phong_exponent = 37.0f;
    Scene scene = floor_scene(material);
    scene.lights = {point_light({2, 2, 0}, glm::vec3(800))};
    Probe probe(scene);
    const glm::dvec3 diffuse(0.25 * 100 / std::numbers::sqrt2);
    const glm::dvec3 highlight(100, 50, 200);
    CASTOR_CHECK_CLOSE(probe({-2, 2, 0}, {2, -2, 0}), diffuse + highlight);
    // Viewer straight above: h halves the angle of 45 degrees between n and l, so n.h = cos(pi / 8).
    const double part = std::pow(std::cos(std::numbers::pi / 8), 37.0);
    CASTOR_CHECK_CLOSE(probe({0, 5, 0}, kDown), diffuse + highlight * part);
}

TEST_CASE("the edge of a shadow lies where geometry says", "[closed_form]") {
    // Light at (0, 2, 0); a half plane x <= 0.5 at height 1 (a rectangle that reaches far) throws a shadow that ends at
    // x = 1 - eps / 2 on the floor: the shadow ray from (x, eps, 0) passes height 1 at x (1 - eps') with eps' = (1 -
    // eps) / (2 - eps), at x / (2 - eps) from the light's axis. Seen from below the blocker; no pixel's centre lies
    // within eps of the edge.
    Scene scene = floor_scene(diffuse_material(glm::vec3(1.0f)));
    scene.lights = {point_light({0, 2, 0}, glm::vec3(100))};
    scene.meshes = {rectangle({-49.5f, 1, 0}, {50, 0, 0}, {0, 0, 50}, 0)};
    constexpr std::uint32_t kSize = 64;
    const Camera camera = square_camera({1, 0.5f, 0}, kDown, 1.0f, kSize);  // covers x in [0.5, 1.5], z likewise
    RenderOptions options;
    options.aovs = {"position"};
    const Film film = Renderer(scene, {test_device()}).render(camera, options);
    std::size_t lit = 0;
    for (std::size_t i = 0; i < film.pixels.size(); ++i) {
        const float x = film.planes[0].values[3 * i];
        CAPTURE(i, x);
        REQUIRE(std::abs(x - 1.0f) > 0.002f);
        REQUIRE((film.pixels[i].x > 0.0f) == (x > 1.0f));
        lit += film.pixels[i].x > 0.0f;
    }
    CHECK(lit == kSize * kSize / 2);
}

TEST_CASE("a light that lies exactly on a surface is hidden, one just before it is not", "[closed_form]") {
    Scene scene = floor_scene(diffuse_material(glm::vec3(1.0f)));
    SECTION("on a plane") {
        scene.planes.push_back({{0, 2, 0}, kDown, 0, 0});
    }
    SECTION("on a triangle") {
        scene.meshes = {rectangle({0, 2, 0}, {10, 0, 0}, {0, 0, 10}, 0)};
    }
    SECTION("on a sphere") {
        scene.spheres = {{{0, 4, 0}, 2.0f, 0, 0}};
    }
    scene.lights = {point_light({0, 2, 0}, glm::vec3(4))};
    Probe hidden(scene);
    CASTOR_CHECK_CLOSE(hidden({0, 1, 0}, kDown), kBlack);
    CASTOR_CHECK_CLOSE(hidden({0.25f, 1, 0.5f}, kDown), kBlack);
    scene.lights[0].point.position.y = 1.999f;
    const double h = 1.999f;
    CASTOR_CHECK_CLOSE(Probe(scene)({0, 1, 0}, kDown), glm::dvec3(4 / (h * h)));
}

TEST_CASE("every primitive throws a shadow, and nothing beyond the light does", "[closed_form]") {
    Scene scene = floor_scene(diffuse_material(glm::vec3(1.0f)));
    SECTION("plane") {
        scene.planes.push_back({{0, 5, 0}, kUp, 0, 0});
    }
    SECTION("triangle") {
        scene.meshes = {rectangle({0, 5, 0}, {1, 0, 0}, {0, 0, 1}, 0)};
    }
    SECTION("sphere") {
        scene.spheres = {{{0, 5, 0}, 0.5f, 0, 0}};
    }
    scene.lights = {point_light({0, 10, 0}, glm::vec3(100))};
    CASTOR_CHECK_CLOSE(Probe(scene)({0, 1, 0}, kDown), kBlack);
    scene.lights[0].point.position.y = 4.0f;
    CASTOR_CHECK_CLOSE(Probe(scene)({0, 1, 0}, kDown), glm::dvec3(100.0 / 16));
    scene.lights = {directional_light(kDown, glm::vec3(100))};
    CASTOR_CHECK_CLOSE(Probe(scene)({0, 1, 0}, kDown), kBlack);
}

TEST_CASE("a mirror ray that leaves the scene brings black, not the background", "[closed_form]") {
    Scene scene = floor_scene(mirror_material(glm::vec3(1.0f)));
    scene.background = glm::vec3(200);
    Probe probe(scene);
    CASTOR_CHECK_CLOSE(probe({0, 1, 0}, {1, -1, 0}), kBlack);
    CASTOR_CHECK_CLOSE(probe({0, 1, 0}, {1, 1, 0}), glm::dvec3(200));
}

TEST_CASE("two parallel mirrors give a geometric series that ends at the recursion depth", "[closed_form]") {
    // Each hit adds ka Ia = a, weakened by km = 1/2 a reflection: a (1 + 1/2 + ... + 1/2^depth) = 2 a (1 - 2^-(depth +
    // 1)).
    Material material = mirror_material(glm::vec3(0.5f));
    material.ambient = glm::vec3(1.0f);
    Scene scene = floor_scene(material);
    scene.planes.push_back({{0, 2, 0}, kDown, 0, 0});
    scene.ambient_light = glm::vec3(10, 20, 30);
    const auto expected = [](double depth) { return glm::dvec3(10, 20, 30) * (2 - std::pow(2.0, -depth)); };
    Probe probe(scene);
    for (const std::uint32_t depth : {0u, 1u, 2u, 6u, 20u}) {
        CAPTURE(depth);
        CASTOR_CHECK_CLOSE(probe({0, 1, 0}, kDown, depth_limit(depth)), expected(depth));
        CASTOR_CHECK_CLOSE(probe({0, 1, 0}, {0.25f, -1, 0.5f}, depth_limit(depth)), expected(depth));
    }
    CASTOR_CHECK_CLOSE(probe({0, 1, 0}, kDown), expected(6));  // the scene's own, by default
    scene.max_recursion_depth = 3;
    CASTOR_CHECK_CLOSE(Probe(scene)({0, 1, 0}, kDown), expected(3));
}

TEST_CASE("a mirror shows what stands where the reflected ray goes, tinted", "[closed_form]") {
    // From (-1, 1, 0) down at 45 degrees to the origin, and up again to a wall at x = 3, which it meets at height 3.
    Scene scene = floor_scene(mirror_material({0.5f, 0.25f, 1.0f}));
    scene.ambient_light = glm::vec3(1);
    scene.meshes = {
        rectangle({3, 3, 0}, {0, 0, 0.1f}, {0, 0.1f, 0}, add_material(scene, ambient_material({100, 40, 20})))};
    Probe probe(scene);
    CASTOR_CHECK_CLOSE(probe({-1, 1, 0}, {1, -1, 0}), glm::dvec3(50, 10, 20));
    CASTOR_CHECK_CLOSE(probe({-1, 1, 0}, {1, -0.9f, 0}), kBlack);
}

TEST_CASE("the silhouette of a sphere is the analytic ellipse", "[closed_form]") {
    // The tangent cone has half angle alpha, sin alpha = R / D. On the image plane at distance 1, whose axis is theta
    // off the cone's, it cuts an ellipse with semi-axes sin a cos a / (cos^2 t - sin^2 a) and sin a / sqrt(cos^2 t -
    // sin^2 a).
    const glm::vec3 centre = GENERATE(glm::vec3(0, 0, -4), glm::vec3(1.25f, -0.5f, -4), glm::vec3(0.3f, 0.2f, -400));
    const float radius = std::abs(centre.z) / 4;
    Scene scene;
    scene.ambient_light = glm::vec3(1);
    scene.spheres = {{centre, radius, add_material(scene, ambient_material(glm::vec3(1))), 0}};
    constexpr std::uint32_t kSize = 64;
    const float half_width = 0.75f;
    Camera camera = square_camera({0, 0, 0}, {0, 0, -1}, half_width, kSize);
    const Film film = Renderer(scene, {test_device()}).render(camera);

    const glm::dvec3 c(centre);
    const double step = 2.0 * half_width / kSize, tangent_squared = glm::dot(c, c) - double(radius) * radius;
    std::size_t inside = 0, undecided = 0;
    for (std::uint32_t y = 0; y < kSize; ++y) {
        for (std::uint32_t x = 0; x < kSize; ++x) {
            const glm::dvec3 d(-half_width + (x + 0.5) * step, half_width - (y + 0.5) * step, -1);
            const double along = glm::dot(d, c), margin = along * along / glm::dot(d, d) / tangent_squared - 1;
            const bool is_hit = film.pixels[y * kSize + x].x > 0;
            inside += is_hit;
            undecided += std::abs(margin) < 1e-6;
            CAPTURE(x, y, margin);
            REQUIRE((std::abs(margin) < 1e-6 || is_hit == (margin > 0)));
        }
    }
    CHECK(undecided <= 2);

    const double sin_a = radius / glm::length(c), cos_t = -c.z / glm::length(c);
    const double cos_a = std::sqrt(1 - sin_a * sin_a), spread = cos_t * cos_t - sin_a * sin_a;
    const double major = sin_a * cos_a / spread / step, minor = sin_a / std::sqrt(spread) / step;
    const double area = std::numbers::pi * major * minor;
    // Of the pixels that the outline crosses (at most about its length times 4/pi), as many are counted in as out but
    // for chance.
    const double boundary_pixels = 8 * (major + minor) / 2;
    CAPTURE(inside, area, boundary_pixels);
    CHECK(std::abs(inside - area) < std::sqrt(boundary_pixels));
}

TEST_CASE("a normal is never turned towards the viewer", "[closed_form]") {
    // Seen from its inner side, a surface gets ambient light, and light from its outer side as if seen from there.
    Material material = diffuse_material(glm::vec3(1.0f));
    material.ambient = glm::vec3(0.5f);
    Scene scene;
    scene.ambient_light = glm::vec3(4);
    const std::uint32_t number = add_material(scene, material);
    SECTION("triangle") {
        scene.meshes = {unit_tile(number)};
    }
    SECTION("plane") {
        scene.planes = {{{0, 0, 0}, kUp, number, 0}};
    }
    SECTION("sphere, from within") {
        scene.spheres = {{{0, -2, 0}, 2.0f, number, 0}};
    }
    const glm::vec3 inner(0.0f, -1.0f, 0.0f);
    scene.lights = {point_light(inner, glm::vec3(100))};
    CASTOR_CHECK_CLOSE(Probe(scene)(inner, kUp), glm::dvec3(2));
    scene.lights = {point_light({0, 5, 0}, glm::vec3(100))};
    CASTOR_CHECK_CLOSE(Probe(scene)(inner, kUp), glm::dvec3(2 + 100.0 / 25));
}

TEST_CASE("smooth normals are interpolated by the barycentric coordinates and normalised", "[closed_form]") {
    Scene scene;
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}};
    mesh.normals = {glm::normalize(glm::vec3(-1, 2, -1)), glm::normalize(glm::vec3(0, 1, 1)),
                    glm::normalize(glm::vec3(3, 4, 0))};
    mesh.triangles = {{0, 1, 2}};
    mesh.material = add_material(scene, diffuse_material(glm::vec3(1.0f)));
    scene.meshes = {rectangle({50, 0, 0}, {0, 0, 1}, {1, 0, 0}, mesh.material),
                    mesh};  // not the first mesh: the normals are found by an offset
    const glm::vec3 to_light = glm::normalize(glm::vec3(1, 3, 2));
    scene.lights = {directional_light(-to_light, glm::vec3(100))};
    Probe probe(scene);
    for (const auto& [u, v] : {std::pair(0.25, 0.25), std::pair(0.125, 0.75), std::pair(0.5, 0.0625)}) {
        CAPTURE(u, v);
        const glm::dvec3 mean = (1 - u - v) * glm::dvec3(mesh.normals[0]) + u * glm::dvec3(mesh.normals[1]) +
                                v * glm::dvec3(mesh.normals[2]);
        const double cosine = glm::dot(glm::normalize(mean), glm::dvec3(to_light));
        CASTOR_CHECK_CLOSE(probe({float(v), 1, float(u)}, kDown), glm::dvec3(100 * cosine));
    }
    // The flat one beside it: n = y.
    CASTOR_CHECK_CLOSE(probe({50.25f, 1, 0}, kDown), glm::dvec3(100.0 * to_light.y));
}

TEST_CASE("a hit on a smooth mesh with zero normals is shaded with the triangle's own", "[closed_form]") {
    Scene scene;
    Mesh mesh = unit_tile(add_material(scene, diffuse_material(glm::vec3(1.0f))));
    mesh.normals.assign(4, glm::vec3(0.0f));
    scene.meshes = {mesh};
    scene.lights = {directional_light({3, -4, 0}, glm::vec3(100))};
    CASTOR_CHECK_CLOSE(Probe(scene)({0.25f, 1, 0}, kDown), glm::dvec3(80));
}

TEST_CASE("rules: 8-bit pictures are rounded by r2022 and truncated by the others", "[closed_form][rules]") {
    Scene scene = floor_scene(ambient_material({100.75f, 254.5f, 300.0f}));
    scene.ambient_light = glm::vec3(1);
    Renderer renderer(scene, {test_device()});
    const TemporaryDirectory folder;
    for (const RuleSet rules : kAllRules) {
        CAPTURE(to_string(rules));
        RenderOptions options;
        options.rules = rules;
        const Film film = renderer.render(square_camera({0, 1, 0}, kDown, 1.0f, 1), options);
        write_image(folder.path() / "pixel.ppm", film, {quantization(rules)});
        std::ifstream file(folder.path() / "pixel.ppm");
        std::string magic;
        int width = 0, height = 0, largest = 0, red = 0, green = 0, blue = 0;
        REQUIRE(file >> magic >> width >> height >> largest >> red >> green >> blue);
        const bool rounds = rules == RuleSet::r2022;
        CHECK(red == (rounds ? 101 : 100));
        CHECK(green == (rounds ? 255 : 254));
        CHECK(blue == 255);
    }
}

TEST_CASE("rules: what reflects", "[closed_form][rules]") {
    // A floor that reflects half of a ceiling of 100, looked at straight down.
    Material material = mirror_material(glm::vec3(0.5f));
    material.refraction_index = 0.2f;
    material.absorption_index = 3.5f;
    material.kind = GENERATE(MaterialKind::plain, MaterialKind::mirror, MaterialKind::conductor);
    Scene scene = floor_scene(material);
    scene.ambient_light = glm::vec3(1);
    scene.planes.push_back({{0, 2, 0}, kDown, add_material(scene, ambient_material(glm::vec3(100))), 0});
    Probe probe(scene);
    // Fresnel at normal incidence: ((n-1)^2 + k^2) / ((n+1)^2 + k^2).
    const double n = material.refraction_index, k = material.absorption_index;
    const double fresnel = ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k);
    for (const RuleSet rules : kAllRules) {
        CAPTURE(to_string(rules), static_cast<int>(material.kind));
        const bool by_value = rules == RuleSet::r2020 || rules == RuleSet::r2018;
        double part = by_value || material.kind == MaterialKind::mirror ? 1 : 0;
        if (material.kind == MaterialKind::conductor && rules == RuleSet::r795) part = fresnel;
        CASTOR_CHECK_CLOSE(probe({0, 1, 0}, kDown, rules), glm::dvec3(50 * part));
    }
}

TEST_CASE("rules: a conductor of r795 reflects more at grazing angles, by Fresnel", "[closed_form][rules]") {
    // rs = (n^2+k^2 - 2n cos + cos^2) / (n^2+k^2 + 2n cos + cos^2), rp = ((n^2+k^2) cos^2 - 2n cos + 1) / (... + 2n cos
    // + 1); their mean.
    Material material = mirror_material({1.0f, 0.5f, 0.25f}, MaterialKind::conductor);
    material.refraction_index = 1.5f;
    material.absorption_index = 2.0f;
    Scene scene = floor_scene(material);
    scene.ambient_light = glm::vec3(1);
    scene.planes.push_back({{0, 2, 0}, kDown, add_material(scene, ambient_material(glm::vec3(100))), 0});
    Probe probe(scene);
    const double n = 1.5, s = n * n + 4.0;
    for (const float slope : {0.1f, 0.5f, 2.0f}) {
        CAPTURE(slope);
        const double cosine = slope / std::sqrt(1.0 + double(slope) * slope), cos2 = cosine * cosine;
        const double rs = (s - 2 * n * cosine + cos2) / (s + 2 * n * cosine + cos2);
        const double rp = (s * cos2 - 2 * n * cosine + 1) / (s * cos2 + 2 * n * cosine + 1);
        CASTOR_CHECK_CLOSE(probe({0, 1, 0}, {1, -slope, 0}, RuleSet::r795),
                           glm::dvec3(100, 50, 25) * (0.5 * (rs + rp)));
    }
}

TEST_CASE("rules: r2020 adds the highlight of a light behind the surface", "[closed_form][rules]") {
    // The triangle lies in y = 0 but its normals lean: n = (0.8, 0.6, 0). Light from l = (-0.8, 0.6, 0): n.l = -0.28,
    // and nothing is in the way. Seen from wo = (0.8, 0.6, 0): h = (0, 1, 0), n.h = 0.6.
    Material material = diffuse_material(glm::vec3(1.0f));
    material.specular = glm::vec3(1.0f);
    material.phong_exponent = 2.0f;
    Scene scene;
    Mesh mesh = unit_tile(add_material(scene, material));
    mesh.normals.assign(4, glm::vec3(0.8f, 0.6f, 0.0f));
    scene.meshes = {mesh};
    scene.lights = {directional_light({0.8f, -0.6f, 0}, glm::vec3(100))};
    Probe probe(scene);
    for (const RuleSet rules : kAllRules) {
        CAPTURE(to_string(rules));
        CASTOR_CHECK_CLOSE(probe({0.8f, 0.6f, 0}, {-0.8f, -0.6f, 0}, rules),
                           glm::dvec3(rules == RuleSet::r2020 ? 36.0 : 0.0));
    }
}

TEST_CASE("rules: where a shadow ray begins", "[closed_form][rules]") {
    // eps = 1/2. Light at (4, 4, 0), seen from the origin along x = y; from (0, 1/2, 0), the origin moved along the
    // normal, along y = 1/2 + 7/8 x. A small sphere at (2, 2.25, 0) stands in the second way and not in the first, from
    // which it is 0.177 away.
    Scene scene = floor_scene(diffuse_material(glm::vec3(1.0f)));
    scene.shadow_ray_epsilon = 0.5f;
    scene.lights = {point_light({4, 4, 0}, glm::vec3(3200))};
    scene.spheres = {{{2, 2.25f, 0}, 0.05f, 0, 0}};
    Probe probe(scene);
    for (const RuleSet rules : kAllRules) {
        CAPTURE(to_string(rules));
        const double lit = 100 / std::numbers::sqrt2;  // n.l; l is that of the unmoved point under all rules
        CASTOR_CHECK_CLOSE(probe({0, 3, 0}, kDown, rules), glm::dvec3(rules == RuleSet::r2018 ? lit : 0.0));
    }
}

TEST_CASE("rules: where a mirror ray begins", "[closed_form][rules]") {
    // eps = 1/2; the reflected ray runs along (1, 1, 0), from (0, 1/2, 0) or on the line x = y. A small bright sphere
    // stands in the first way, 0.35 from the second.
    Scene scene = floor_scene(mirror_material(glm::vec3(1.0f)));
    scene.shadow_ray_epsilon = 0.5f;
    scene.ambient_light = glm::vec3(1);
    scene.spheres = {{{2, 2.5f, 0}, 0.05f, add_material(scene, ambient_material(glm::vec3(100))), 0}};
    Probe probe(scene);
    for (const RuleSet rules : kAllRules) {
        CAPTURE(to_string(rules));
        const bool along_normal = rules == RuleSet::r2022 || rules == RuleSet::r795;
        CASTOR_CHECK_CLOSE(probe({-4, 4, 0}, {1, -1, 0}, rules), glm::dvec3(along_normal ? 100.0 : 0.0));
    }
}

TEST_CASE("back-face culling hides flat triangles from behind, and nothing else", "[closed_form][culling]") {
    Scene scene;
    scene.background = glm::vec3(7);
    scene.ambient_light = glm::vec3(1);
    const std::uint32_t bright = add_material(scene, ambient_material(glm::vec3(100)));
    scene.meshes = {unit_tile(bright), unit_tile(bright)};
    for (glm::vec3& position : scene.meshes[1].positions) position.x += 10;
    scene.meshes[1].normals.assign(4, kUp);
    scene.spheres = {{{20, 0, 0}, 1.0f, bright, 0}};
    scene.planes = {{{30, 0, 0}, {-1, 0, 0}, bright, 0}};
    const RendererOptions strategy{GENERATE(Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet)};
    Probe probe(scene, strategy);
    RenderOptions culling;
    culling.cull_back_faces = true;
    const glm::dvec3 seen(100), background(7);

    CASTOR_CHECK_CLOSE(probe({0.25f, 1, 0}, kDown, culling), seen);
    CASTOR_CHECK_CLOSE(probe({0.25f, -1, 0}, kUp, culling), background);
    CASTOR_CHECK_CLOSE(probe({0.25f, -1, 0}, kUp), seen);
    for (const RuleSet rules : kAllRules) {
        CAPTURE(to_string(rules));
        CASTOR_CHECK_CLOSE(probe({0.25f, -1, 0}, kUp, rules), rules == RuleSet::r795 ? background : seen);
    }
    CASTOR_CHECK_CLOSE(probe({10.25f, -1, 0}, kUp, culling), seen);    // smooth
    CASTOR_CHECK_CLOSE(probe({20, 0, 0}, kUp, culling), seen);         // a sphere, from within
    CASTOR_CHECK_CLOSE(probe({31, 5, 0}, {-1, 0, 0}, culling), seen);  // a plane, from behind
}

TEST_CASE("back-face culling holds for mirror rays and not for shadow rays", "[closed_form][culling]") {
    // A mirror floor under a tile at height 1 whose outside is above, under a bright ceiling at 2. The mirror ray comes
    // to the tile from behind.
    Scene scene = floor_scene(mirror_material(glm::vec3(1.0f)));
    scene.ambient_light = glm::vec3(1);
    scene.meshes = {unit_tile(add_material(scene, ambient_material(glm::vec3(40))))};
    for (glm::vec3& position : scene.meshes[0].positions) position.y = 1;
    scene.planes.push_back({{0, 2, 0}, kDown, add_material(scene, ambient_material(glm::vec3(100))), 0});
    RenderOptions culling;
    culling.cull_back_faces = true;
    Probe mirror(scene);
    CASTOR_CHECK_CLOSE(mirror({0, 0.5f, 0}, {0.25f, -1, 0}), glm::dvec3(40));
    CASTOR_CHECK_CLOSE(mirror({0, 0.5f, 0}, {0.25f, -1, 0}, culling), glm::dvec3(100));

    // The same tile between a diffuse floor and a light: its shadow stays.
    scene.materials[0] = diffuse_material(glm::vec3(1.0f));
    scene.planes.pop_back();
    scene.lights = {point_light({0, 4, 0}, glm::vec3(100))};
    Probe shadow(scene);
    CASTOR_CHECK_CLOSE(shadow({0.25f, 0.5f, 0}, kDown, culling), kBlack);
}

}  // namespace castor::test
