#pragma once

#include <CL/cl.h>

#include <map>
#include <string>
#include <vector>

namespace castor::test {

// Between Castor and the OpenCL loader: every OpenCL function that Castor calls is defined in opencl_shim.cpp too,
// which counts the calls, lets some of them fail or hang as it is told, and hands the others on.

/// What is to go wrong: call number `call` (from 0 on) of `function` since reset_shim().
struct Fault {
    std::string function;
    int call = 0;
    cl_int status = CL_OUT_OF_RESOURCES;
    bool lasts = false;        // also all later calls with the same first argument (a queue, a context ...)
    bool hangs = false;        // it does not return before release_hanging_calls()
    bool corrupts = false;     // clEnqueueReadBuffer: it works, and one bit of what it reads is wrong
    bool of_command = false;   // clGetEventInfo: it works, and tells that the command ended with `status`
    cl_mem_flags flags = 0;    // clCreateBuffer: all calls with these flags fail, whatever `call` is
    cl_event delay = nullptr;  // clEnqueueNDRangeKernel: it works, and the command waits for this event too
};

/// Counts from 0 on again; nothing goes wrong, or what `fault` says.
void reset_shim();
void reset_shim(const Fault& fault);
void release_hanging_calls();

/// Whether the fault has happened.
bool fault_happened();
/// Calls of each function since reset_shim().
std::map<std::string, int> shim_calls();
/// OpenCL objects that exist, with a count for each reference: contexts, queues, buffers, programs, kernels and events.
std::map<std::string, long> live_objects();

/// From now on no kernel may have more than `most` work-items in a group: drivers say so, and refuse launches with
/// more. 0: as many as the driver says.
void limit_groups(std::size_t most);

/// From now on trace kernels of the n-th queue that is made run so many times over, n counting from now on: a device
/// that is that much slower. Later queues: once.
void slow_down_queues(const std::vector<int>& times);

}  // namespace castor::test
