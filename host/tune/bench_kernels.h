#pragma once

#include "opencl/kernel_source.h"

namespace castor::kernels {

extern const SourceTable bench_kernels;  // kernels/bench/*.cl, for castor bench alone

}  // namespace castor::kernels
