// A library between a test program and the OpenCL loader: all contexts of a device are one, and in it each program is
// built once. Castor makes a context for every scene on every device; PoCL takes some 25 ms for each program in each of
// them, even where its cache has the result, which was half of the time of many tests. The programs that tests start
// have the loader alone. While CASTOR_TEST_OWN_CONTEXTS is set, each context is one of its own.
#include <dlfcn.h>

#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <tuple>

#include "opencl/cl.h"

namespace {

template <class Function>
Function* real(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

cl_context context_of(cl_program program) {
    cl_context context = nullptr;
    static auto* const ask = real<decltype(clGetProgramInfo)>("clGetProgramInfo");
    ask(program, CL_PROGRAM_CONTEXT, sizeof(context), &context, nullptr);
    return context;
}

std::string source_of(cl_program program) {
    std::size_t size = 0;
    static auto* const ask = real<decltype(clGetProgramInfo)>("clGetProgramInfo");
    if (ask(program, CL_PROGRAM_SOURCE, 0, nullptr, &size) != CL_SUCCESS) return {};
    std::string source(size, '\0');
    if (ask(program, CL_PROGRAM_SOURCE, size, source.data(), nullptr) != CL_SUCCESS) return {};
    return source.c_str();
}

class SharedPrograms {
public:
    /// A reference to the device's context, which `make` makes for the first that wants it. It is never released, so
    /// that no other device comes to have this one's address.
    template <class Make>
    cl_context context(cl_device_id device, const Make& make) {
        std::lock_guard lock(mutex_);
        cl_context& shared = contexts_[device];
        if (!shared) shared = make();
        static auto* const retain = real<decltype(clRetainContext)>("clRetainContext");
        if (shared) retain(shared);
        return shared;
    }

    /// Calls `build`, unless a program of the same source, options and context stands in for this one.
    template <class Build>
    cl_int build(cl_program program, const char* options, const Build& build) {
        const Key key{context_of(program), options ? options : "", source_of(program)};
        {
            std::lock_guard lock(mutex_);
            stand_ins_.erase(program);  // of one that had this address before
            if (const auto found = built_.find(key); found != built_.end()) {
                stand_ins_[program] = found->second;
                return CL_SUCCESS;
            }
        }
        const cl_int status = build();
        std::lock_guard lock(mutex_);
        const bool is_source = !std::get<2>(key).empty();  // and no binary
        static auto* const retain = real<decltype(clRetainProgram)>("clRetainProgram");
        if (status == CL_SUCCESS && is_source && built_.emplace(key, program).second) retain(program);
        return status;
    }

    cl_program stand_in(cl_program program) {
        std::lock_guard lock(mutex_);
        const auto found = stand_ins_.find(program);
        return found == stand_ins_.end() ? program : found->second;
    }

private:
    using Key = std::tuple<cl_context, std::string, std::string>;  // context, options, source

    std::mutex mutex_;
    std::map<cl_device_id, cl_context> contexts_;
    std::map<Key, cl_program> built_;
    std::map<cl_program, cl_program> stand_ins_;
};

// Never destroyed: threads may outlive main.
SharedPrograms& shared_programs() {
    static SharedPrograms& only = *new SharedPrograms;
    return only;
}

}  // namespace

extern "C" {

cl_context CL_API_CALL clCreateContext(const cl_context_properties* properties, cl_uint count,
                                       const cl_device_id* devices,
                                       void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* data,
                                       cl_int* errcode) {
    static auto* const handed_on = real<decltype(clCreateContext)>("clCreateContext");
    const auto make = [&] { return handed_on(properties, count, devices, notify, data, errcode); };
    if (properties || count != 1 || notify || std::getenv("CASTOR_TEST_OWN_CONTEXTS")) return make();
    if (errcode) *errcode = CL_SUCCESS;
    return shared_programs().context(devices[0], make);
}

cl_int CL_API_CALL clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                                  void(CL_CALLBACK* notify)(cl_program, void*), void* data) {
    static auto* const handed_on = real<decltype(clBuildProgram)>("clBuildProgram");
    const auto build = [&] { return handed_on(program, count, devices, options, notify, data); };
    return count == 1 && !notify ? shared_programs().build(program, options, build) : build();
}

cl_kernel CL_API_CALL clCreateKernel(cl_program program, const char* name, cl_int* errcode) {
    static auto* const handed_on = real<decltype(clCreateKernel)>("clCreateKernel");
    return handed_on(shared_programs().stand_in(program), name, errcode);
}

cl_int CL_API_CALL clGetProgramInfo(cl_program program, cl_program_info name, size_t size, void* value,
                                    size_t* written) {
    static auto* const handed_on = real<decltype(clGetProgramInfo)>("clGetProgramInfo");
    return handed_on(shared_programs().stand_in(program), name, size, value, written);
}

cl_int CL_API_CALL clGetProgramBuildInfo(cl_program program, cl_device_id device, cl_program_build_info name,
                                         size_t size, void* value, size_t* written) {
    static auto* const handed_on = real<decltype(clGetProgramBuildInfo)>("clGetProgramBuildInfo");
    return handed_on(shared_programs().stand_in(program), device, name, size, value, written);
}

}  // extern "C"
