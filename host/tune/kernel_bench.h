#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "castor/device.h"

namespace castor {

/// The measured times of one device function.
struct KernelMeasurement {
    std::string kernel;           // the function of kernels/device or the kernel
    std::string unit;             // what is counted: tests, rays or samples (of light)
    std::size_t count = 0;        // tests, rays or samples in a run
    std::size_t checked = 0;      // how many of them the reference judged
    std::vector<double> seconds;  // each run, from enqueue to finish
};

/// Times the triangle tests, sphere, plane, box, ray generation and shading on the device, with size * size rays or
/// points each; calls `report` after each. Compares their answers with a reference in double precision first; throws
/// DeviceError for a wrong one, naming kernel, input and both answers. Ends early if `go_on` returns false.
void bench_kernels(const Device& device, std::uint32_t size, std::uint32_t repeat, std::uint32_t seed,
                   const std::function<bool()>& go_on, const std::function<void(const KernelMeasurement&)>& report);

/// Makes the same checks of ray generation and shading alone, without timing. `size` is a multiple of 8.
void check_rays_and_shading(const Device& device, std::uint32_t size, std::uint32_t seed);

}  // namespace castor
