// An OpenCL driver that ends every process that asks for platforms, as LLVM does if two copies of it meet.
#include <cstdlib>

extern "C" void* clGetExtensionFunctionAddress(const char*) {
    std::abort();
}
extern "C" int clIcdGetPlatformIDsKHR(unsigned, void**, unsigned*) {
    std::abort();
}
