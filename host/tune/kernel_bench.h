#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "castor/device.h"

namespace castor {

/// How long one small function of the kernels takes, by itself.
struct KernelMeasurement {
    std::string kernel;           // the function of kernels/device or the kernel
    std::string unit;             // what is counted: tests, rays or samples (of light)
    std::size_t count = 0;        // of these in a run
    std::size_t checked = 0;      // of these that the reference judged
    std::vector<double> seconds;  // of each run, from enqueue to finish
};

/// Times the triangle tests, sphere, plane, box, ray generation and shading on the device, with size * size rays or
/// points each; calls `report` after each. Before, their answers are held against a reference in double precision; a
/// wrong one throws DeviceError, naming kernel, input and both answers. Ends early where `go_on` returns false.
void bench_kernels(const Device& device, std::uint32_t size, std::uint32_t repeat, std::uint32_t seed,
                   const std::function<bool()>& go_on, const std::function<void(const KernelMeasurement&)>& report);

/// The same checks of ray generation and shading alone, timing nothing. `size` is a multiple of 8.
void check_rays_and_shading(const Device& device, std::uint32_t size, std::uint32_t seed);

}  // namespace castor
