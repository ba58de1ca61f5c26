// The functions of kernels/device against references in double precision, for named and for random cases.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doctor/check.h"
#include "reference/box_cases.h"
#include "reference/elementary.h"
#include "reference/plane_cases.h"
#include "reference/sphere_cases.h"
#include "reference/triangle_cases.h"
#include "reference/ulp.h"
#include "tune/kernel_bench.h"

namespace castor::doctor {

namespace {

using reference::RandomSource;

/// Whether a device must give this result of these arguments: what is denormal it may flush if it says so.
bool counts(const Device& device, std::initializer_list<float> arguments, long double exact) {
    if (device.denormals) return true;
    for (const float x : arguments)
        if (std::fpclassify(x) == FP_SUBNORMAL) return false;
    return std::fabs(exact) >= std::numeric_limits<float>::min();
}

/// Runs an elementary function as renders do: for as many lanes.
std::vector<float> elementary(Patient& patient, std::size_t count, std::uint32_t number, const std::vector<float>& x,
                              const std::vector<float>& y) {
    return patient.runner.run_in_lanes<float>("doctor/elementary_test", patient.runner.context().quirks().lanes, count,
                                              cl_uint{number}, x, y);
}

std::string elementary_of_one(Patient& patient, const reference::ElementaryFunction& function, std::size_t size,
                              RandomSource& random) {
    const float infinity = std::numeric_limits<float>::infinity();
    std::vector<float> x;
    for (const float value : {0.0f, -0.0f, 1.0f, -1.0f, 0.5f, -0.5f, infinity, -infinity, std::nanf("")})
        if (!(std::fabs(value) > function.largest_argument)) x.push_back(value);
    while (x.size() < size) {
        const float value = random.below(2) ? random.any_float() : random.uniform_float(-4, 4);
        if (!(std::fabs(value) > function.largest_argument)) x.push_back(value);
    }
    const auto found = elementary(patient, x.size(), function.number, x, x);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const long double exact = function.reference(x[i]);
        if (!counts(patient.device, {x[i]}, exact)) continue;
        const double error = reference::ulp_error(found[i], exact);
        if (!(error <= function.stated_error))
            return fmt::format("{}({:a}): found {:a}, expected {:a} within {} ulp", function.name, x[i], found[i],
                               static_cast<float>(exact), function.stated_error);
    }
    return "";
}

template <class Reference>
std::string elementary_of_two(Patient& patient, const char* name, std::uint32_t number, double stated_error,
                              const std::vector<float>& a, const std::vector<float>& b, const Reference& reference) {
    const auto found = elementary(patient, a.size(), number, a, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
        const long double exact = reference(static_cast<long double>(a[i]), static_cast<long double>(b[i]));
        if (!counts(patient.device, {a[i], b[i]}, exact)) continue;
        if (!(reference::ulp_error(found[i], exact) <= stated_error))
            return fmt::format("{}({:a}, {:a}): found {:a}, expected {:a} within {} ulp", name, a[i], b[i], found[i],
                               static_cast<float>(exact), stated_error);
    }
    return "";
}

std::string elementary_functions(Patient& patient, Rounds& rounds) {
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        for (const reference::ElementaryFunction& function : reference::kElementaryFunctions) {
            const std::string wrong = elementary_of_one(patient, function, size, random);
            if (!wrong.empty()) return wrong;
        }
        std::vector<float> x, y, z;
        for (std::size_t i = 0; i < size; ++i) {
            // Any x, and the cosines and Phong exponents of highlights.
            x.push_back(i % 2 ? std::fabs(random.any_float()) : random.uniform_float(0, 1));
            y.push_back(i % 2 ? random.uniform_float(-1e4f, 1e4f) : static_cast<float>(random.below(10001)));
            z.push_back(i % 2 ? random.any_float() : random.uniform_float(-1, 1));
        }
        std::string wrong = elementary_of_two(patient, "power", reference::kPower, reference::kPowerError, x, y,
                                              [](long double a, long double b) { return std::pow(a, b); });
        if (wrong.empty())
            wrong = elementary_of_two(patient, "arc_tangent2", reference::kArcTangent2, reference::kArcTangent2Error, z,
                                      x, [](long double a, long double b) { return std::atan2(a, b); });
        if (!wrong.empty()) return wrong;
    }
    return "";
}

std::string text(float t) {
    return std::isnan(t) ? "a miss" : fmt::format("t {:a}", t);
}
std::string text(const reference::triangle_cases::Answer& answer) {
    return answer.hit() ? fmt::format("t {:a} u {:a} v {:a}", answer.t, answer.u, answer.v) : "a miss";
}
std::string text(const reference::triangle_cases::Named& named) {
    return named.hit ? fmt::format("t {:a} u {:a} v {:a}", named.t, named.u, named.v) : "a miss";
}
template <class Named>
std::string text(const Named& named) {
    return text(named.t);
}

/// A function that tests a ray against a primitive. `run`(cases) gives the answers.
template <class Case, class Named, class Run>
std::string check_cases(Patient& patient, Rounds& rounds, const char* function, const std::vector<Named>& named,
                        Case (*random_case)(RandomSource&, std::size_t), const Run& run) {
    std::vector<Case> cases;
    for (const Named& one : named) cases.push_back(one.input);
    const auto answers = run(cases);
    for (std::size_t i = 0; i < named.size(); ++i)
        if (!is_right(named[i], answers[i]))
            return fmt::format("{}, case \"{}\", {}: found {}, expected {}", function, named[i].name,
                               describe(cases[i]), text(answers[i]), text(named[i]));
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        cases.clear();
        for (std::size_t i = 0; i < size; ++i) cases.push_back(random_case(random, i));
        const auto found = run(cases);
        for (std::size_t i = 0; i < size; ++i)
            if (!agrees(cases[i], found[i]))
                return fmt::format("{}, {}: found {}, which double precision does not allow", function,
                                   describe(cases[i]), text(found[i]));
    }
    return "";
}

Check triangle_check(cl_uint function) {
    using namespace reference::triangle_cases;
    return {kFunctions[function], [function](Patient& patient, Rounds& rounds) {
                return check_cases(
                    patient, rounds, kFunctions[function], named_cases(), random_case,
                    [&](const std::vector<Case>& cases) { return run(patient.runner, function, cases); });
            }};
}

std::string spheres(Patient& patient, Rounds& rounds) {
    using namespace reference::sphere_cases;
    return check_cases(patient, rounds, "intersect_sphere", named_cases(), random_case,
                       [&](const std::vector<Case>& cases) { return run(patient.runner, cases); });
}

std::string planes(Patient& patient, Rounds& rounds) {
    using namespace reference::plane_cases;
    return check_cases(patient, rounds, "intersect_plane", named_cases(), random_case,
                       [&](const std::vector<Case>& cases) { return run(patient.runner, cases); });
}

std::string boxes(Patient& patient, Rounds& rounds) {
    using namespace reference::box_cases;
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        Boxes cases;
        for (std::size_t i = 0; i < size; ++i) {
            const Ray ray = random_ray(random);
            const vec3 corner = random.in_box(-1, 1);
            cases.add(ray, corner, random_corner(random, corner));
        }
        const std::vector<vec2> found = cases.run(patient.runner, cases.largest);
        for (std::size_t i = 0; i < size; ++i)
            if (!cases.agrees(i, found[i]))
                return fmt::format("box_interval, {}: found {:a} to {:a}, which double precision does not allow",
                                   cases.describe(i), found[i].x, found[i].y);
    }
    return "";
}

std::string eye_rays_and_shading(Patient& patient, Rounds& rounds) {
    while (const std::size_t size = rounds.next()) {
        const auto edge = std::max(8u, static_cast<std::uint32_t>(std::sqrt(static_cast<double>(size))) / 8 * 8);
        check_rays_and_shading(patient.device, edge, patient.seed + rounds.number());
    }
    return "";
}

}  // namespace

std::vector<Check> function_checks() {
    return {
        {"elementary functions", elementary_functions},
        triangle_check(0),
        triangle_check(1),
        triangle_check(2),
        {"intersect_sphere", spheres},
        {"intersect_plane", planes},
        {"box_interval", boxes},
        {"eye rays and shading", eye_rays_and_shading},
    };
}

}  // namespace castor::doctor
