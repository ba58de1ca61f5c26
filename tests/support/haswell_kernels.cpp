// Preloaded, lets PoCL 3.1 compile for a processor with AVX2 and without AVX-512, which is what Valgrind shows
// programs: it asks LLVM for the processor's features, and knows "haswell" by them. scripts/check_counters compiles
// kernels with it, and then runs them under Valgrind, where compiling takes a minute and more.
#include <dlfcn.h>
#include <link.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace llvm {

class MallocAllocator;

/// As llvm/ADT/StringMap.h has it: a hash table of pointers to entries, of which the key follows.
template <typename Value, typename Allocator>
class StringMap {
public:
    struct Entry {
        std::size_t key_length;
        Value value;
    };
    Entry** table;
    unsigned buckets;
    unsigned items;
    unsigned tombstones;
    unsigned entry_size;
};

namespace sys {

using Features = StringMap<bool, MallocAllocator>;

extern "C" int open_llvm(dl_phdr_info* object, std::size_t, void* llvm) {
    if (!std::strstr(object->dlpi_name, "libLLVM")) return 0;
    *static_cast<void**>(llvm) = dlopen(object->dlpi_name, RTLD_NOW | RTLD_NOLOAD);
    return 1;
}

bool getHostCPUFeatures(Features& features) {
    constexpr const char* name = "_ZN4llvm3sys18getHostCPUFeaturesERNS_9StringMapIbNS_15MallocAllocatorEEE";
    void* llvm = nullptr;
    dl_iterate_phdr(open_llvm, &llvm);
    const auto get = llvm ? reinterpret_cast<bool (*)(Features&)>(dlsym(llvm, name)) : nullptr;
    if (!get || !get(features)) return false;
    Features::Entry* const tombstone = reinterpret_cast<Features::Entry*>(~std::uintptr_t{0} << 3);
    for (unsigned i = 0; i < features.buckets; ++i) {
        Features::Entry* entry = features.table[i];
        if (!entry || entry == tombstone) continue;
        if (std::strncmp(reinterpret_cast<const char*>(entry + 1), "avx512", 6) == 0) entry->value = false;
    }
    return true;
}

}  // namespace sys
}  // namespace llvm
