#pragma once

// The one place that configures the C++ bindings. Target 1.2: nothing newer is used, and old drivers have no more.
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#define CL_HPP_ENABLE_EXCEPTIONS
#include <CL/opencl.hpp>
