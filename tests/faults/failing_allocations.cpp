// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), lets allocations fail that it makes within main(), by
// whatever library. Other programs that it starts are left alone; copies of it go on counting. What
// fails is set by the environment: VELATURA_FAULT_PROGRAM  last part of the program's path: no
// other one is touched VELATURA_FAULT_AT       1 = the first allocation VELATURA_FAULT_HOW alone:
// that one fails; exhausted: from that one on the program has no more memory than it has by then,
// so
//                         that it may allocate what it has freed
// VELATURA_FAULT_LOG      receives a line: how many allocations there were, and how many of them
// failed. Not written by a program that
//                         ends otherwise than by exit()
#include <dlfcn.h>
#include <fcntl.h>
#include <malloc.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* memory);
int __libc_start_main(int (*main)(int, char**, char**),
                      int argc,
                      char** argv,
                      int (*init)(int, char**, char**),
                      void (*fini)(),
                      void (*rtld_fini)(),
                      void* stack_end);
}

namespace {

std::atomic<bool> is_counting = false;
std::atomic<uint64_t> allocations = 0, failures = 0;
std::atomic<int64_t> used = 0, allowed = INT64_MAX;
uint64_t failing = 0;
bool is_alone = true;
const char* log_path = nullptr;

/// Counts an allocation; true when it is to fail, errno being set.
bool fails(size_t size) {
    if (!is_counting.load(std::memory_order_relaxed)) return false;
    const uint64_t number = allocations.fetch_add(1, std::memory_order_relaxed) + 1;
    if (number == failing && !is_alone) allowed = used.load();
    const bool is_refused =
        is_alone ? number == failing : used.load() + int64_t(size) > allowed.load();
    if (!is_refused) return false;
    failures.fetch_add(1, std::memory_order_relaxed);
    errno = ENOMEM;
    return true;
}

void* taken(void* memory) {
    if (memory) used.fetch_add(int64_t(malloc_usable_size(memory)), std::memory_order_relaxed);
    return memory;
}

void given_back(void* memory) {
    if (memory) used.fetch_sub(int64_t(malloc_usable_size(memory)), std::memory_order_relaxed);
}

void write_log() {
    is_counting = false;
    char line[64];
    const int length = std::snprintf(line, sizeof(line), "%llu %llu\n",
                                     static_cast<unsigned long long>(allocations.load()),
                                     static_cast<unsigned long long>(failures.load()));
    const long fd = ::syscall(SYS_openat, AT_FDCWD, log_path, O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::syscall(SYS_write, fd, line, length);
    ::syscall(SYS_close, fd);
}

int (*real_main)(int, char**, char**) = nullptr;

int counted_main(int argc, char** argv, char** environment) {
    const char* at = std::getenv("VELATURA_FAULT_AT");
    const char* how = std::getenv("VELATURA_FAULT_HOW");
    const char* program = std::getenv("VELATURA_FAULT_PROGRAM");
    const char* slash = std::strrchr(argv[0], '/');
    if (at && program && std::strcmp(slash ? slash + 1 : argv[0], program) == 0) {
        failing = std::strtoull(at, nullptr, 10);
        is_alone = !how || std::strcmp(how, "exhausted") != 0;
        log_path = std::getenv("VELATURA_FAULT_LOG");
        if (log_path) std::atexit(write_log);
        is_counting = failing > 0;
    }
    return real_main(argc, argv, environment);
}

}  // namespace

extern "C" {

void* malloc(size_t size) noexcept {
    return fails(size) ? nullptr : taken(__libc_malloc(size));
}

void* calloc(size_t count, size_t size) noexcept {
    return fails(count * size) ? nullptr : taken(__libc_calloc(count, size));
}

void* realloc(void* memory, size_t size) noexcept {
    if (fails(size)) return nullptr;
    const int64_t before = memory ? int64_t(malloc_usable_size(memory)) : 0;
    void* const moved = __libc_realloc(memory, size);
    if (moved || size == 0) used.fetch_sub(before, std::memory_order_relaxed);
    return taken(moved);
}

void* memalign(size_t alignment, size_t size) noexcept {
    return fails(size) ? nullptr : taken(__libc_memalign(alignment, size));
}

void* aligned_alloc(size_t alignment, size_t size) noexcept {
    return fails(size) ? nullptr : taken(__libc_memalign(alignment, size));
}

int posix_memalign(void** memory, size_t alignment, size_t size) noexcept {
    if (fails(size)) return ENOMEM;
    *memory = taken(__libc_memalign(alignment, size));
    return *memory ? 0 : ENOMEM;
}

void free(void* memory) noexcept {
    given_back(memory);
    __libc_free(memory);
}

// What the startup code calls with main()
int __libc_start_main(int (*main)(int, char**, char**),
                      int argc,
                      char** argv,
                      int (*init)(int, char**, char**),
                      void (*fini)(),
                      void (*rtld_fini)(),
                      void* stack_end) {
    real_main = main;
    return reinterpret_cast<decltype(&__libc_start_main)>(::dlsym(RTLD_NEXT, "__libc_start_main"))(
        counted_main, argc, argv, init, fini, rtld_fini, stack_end);
}

}  // extern "C"
