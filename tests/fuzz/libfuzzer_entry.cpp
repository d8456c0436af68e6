// SPDX-License-Identifier: Apache-2.0
// Compiled once for every program, with VELATURA_FUZZ_TARGET as the name of its function.
#include "fuzz_targets.h"

#include <pthread.h>
#include <sanitizer/allocator_interface.h>
#include <sanitizer/asan_interface.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    velatura::fuzz::VELATURA_FUZZ_TARGET(
        std::string_view(reinterpret_cast<const char*>(data), size));
    return 0;
}

// A library that is run in a child process may end that child, and this is no find: the child
// leaves without a report, a stack with names or a file, which take a second each. What
// UndefinedBehaviorSanitizer says is of our own code and is kept.
namespace {

/// As much as -rss_limit_mb gives this process; limits of addresses mean nothing under sanitizers.
constexpr size_t max_child_bytes = size_t(512) << 20;

bool is_child = false;
std::atomic<size_t> child_bytes = 0;

void enter_child() {
    is_child = true;
    child_bytes = 0;
    // libFuzzer's and AddressSanitizer's
    for (const int signal :
         {SIGSEGV, SIGBUS, SIGABRT, SIGILL, SIGFPE, SIGINT, SIGTERM, SIGXFSZ, SIGUSR1, SIGUSR2})
        std::signal(signal, SIG_DFL);
}

void count_allocated(const volatile void*, size_t size) {
    if (is_child && (child_bytes += size) > max_child_bytes) _exit(1);
}

void count_freed(const volatile void* memory) {
    // What was there before the fork is freed without having been counted
    if (is_child)
        child_bytes -= std::min(child_bytes.load(), __sanitizer_get_allocated_size(memory));
}

[[maybe_unused]] const bool has_hooks =
    pthread_atfork(nullptr, nullptr, enter_child) == 0 &&
    __sanitizer_install_malloc_and_free_hooks(count_allocated, count_freed) != 0;

}  // namespace

void __asan_on_error() {
    if (is_child) _exit(1);
}
