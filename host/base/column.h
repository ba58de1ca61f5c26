#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace castor {

/// Allocates whole pages, so that a device that shares the host's memory can use a column in place
/// (CL_MEM_USE_HOST_PTR wants page-aligned storage, sized in cache lines). A vector made or resized with a count alone
/// leaves plain values as they are, to be written by several threads. Large columns get huge pages where the system has
/// them for the asking: rays jump about in a tree, and each jump to another small page waits for the address as well as
/// for the memory.
template <class T>
struct PageAllocator {
    using value_type = T;
    static constexpr std::size_t kPageBytes = 4096;
    static constexpr std::size_t kHugePageBytes = std::size_t{2} << 20;

    PageAllocator() = default;
    /// See column_in_place.
    explicit PageAllocator(T* in_place) : in_place_(in_place) {}
    template <class U>
    PageAllocator(const PageAllocator<U>&) {}

    T* allocate(std::size_t count) {
        if (in_place_) return in_place_;
        const std::size_t page = count * sizeof(T) >= kHugePageBytes / 2 ? kHugePageBytes : kPageBytes;
        const std::size_t bytes = (count * sizeof(T) + page - 1) / page * page;
        void* const memory = std::aligned_alloc(page, bytes);
        if (!memory) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
        if (page == kHugePageBytes)
            madvise(memory, bytes, MADV_HUGEPAGE);  // only advice: where it is not taken, pages are small
#endif
        return static_cast<T*>(memory);
    }
    void deallocate(T* memory, std::size_t) {
        if (memory != in_place_) std::free(memory);
    }

    template <class U>
    void construct(U* value) {
        if constexpr (!std::is_trivially_default_constructible_v<U>) ::new (static_cast<void*>(value)) U;
    }
    template <class U, class... Arguments>
    void construct(U* value, Arguments&&... arguments) {
        ::new (static_cast<void*>(value)) U(std::forward<Arguments>(arguments)...);
    }

    using propagate_on_container_move_assignment = std::true_type;
    using propagate_on_container_swap = std::true_type;
    PageAllocator select_on_container_copy_construction() const {
        return {};
    }
    bool operator==(const PageAllocator& other) const {
        return in_place_ == other.in_place_;
    }

private:
    T* in_place_ = nullptr;
};

/// One value a primitive, vertex, node …: a column of the scene as devices read it.
template <class T>
using Column = std::vector<T, PageAllocator<T>>;

/// A column of values that stand in memory already, such as in a mapped file, which must outlive it and what it is
/// moved to; a copy has memory of its own. Only to be read, and never to grow.
template <class T>
Column<T> column_in_place(const T* values, std::size_t count) {
    static_assert(std::is_trivially_default_constructible_v<T> && std::is_trivially_copyable_v<T>);
    return Column<T>(count, PageAllocator<T>(const_cast<T*>(values)));
}

}  // namespace castor
