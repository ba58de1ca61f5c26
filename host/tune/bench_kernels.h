#pragma once

#include "opencl/kernel_source.h"

namespace castor::kernels {

extern const SourceTable bench_kernels;  // kernels/bench/*.cl, which only castor bench needs

}  // namespace castor::kernels
