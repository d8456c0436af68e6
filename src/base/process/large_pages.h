// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>

namespace velatura {
inline namespace process {

/// Allocator that asks the kernel for large pages (2 MiB) where there is enough to fill some:
/// tables that are read at random miss the address cache less often. Memory is aligned to 64 bytes
/// at least.
template <class T>
struct LargePages {
    using value_type = T;

    static constexpr size_t page = size_t(1) << 21;

    LargePages() = default;

    template <class U>
    LargePages(const LargePages<U>&) {}

    T* allocate(size_t n) {
        if (n > (size_t(-1) >> 1) / sizeof(T)) throw std::bad_array_new_length();
        const bool is_large = n * sizeof(T) >= 2 * page;
        const size_t alignment = is_large ? page : 64;
        const size_t bytes = (n * sizeof(T) + alignment - 1) / alignment * alignment;
        void* const p = std::aligned_alloc(alignment, bytes);
        if (!p) throw std::bad_alloc();
        // A wish: where the kernel has none to give, small pages do
        if (is_large) madvise(p, bytes, MADV_HUGEPAGE);
        return static_cast<T*>(p);
    }

    void deallocate(T* p, size_t) { std::free(p); }

    bool operator==(const LargePages&) const { return true; }
};

}  // namespace process
}  // namespace velatura
