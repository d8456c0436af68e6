// SPDX-License-Identifier: Apache-2.0
#include "base/isolated.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>

namespace velatura {

namespace {

// Sanitizers reserve more addresses than any limit
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool limits_addresses = false;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool limits_addresses = false;
#else
constexpr bool limits_addresses = true;
#endif
#else
constexpr bool limits_addresses = true;
#endif

void set_limit(__rlimit_resource resource, size_t value) {
    rlimit limit = {};
    if (getrlimit(resource, &limit) != 0) return;
    limit.rlim_cur =
        limit.rlim_max == RLIM_INFINITY ? rlim_t(value) : std::min(rlim_t(value), limit.rlim_max);
    setrlimit(resource, &limit);
}

/// The child's part; does not return.
[[noreturn]] void work_and_exit(int pipe_end,
                                const IsolationLimits& limits,
                                const std::function<std::string()>& work) {
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_CPU, limits.cpu_seconds);
    if (limits_addresses) set_limit(RLIMIT_AS, limits.address_bytes);
    int code = 1;
    try {
        const std::string bytes = work();
        size_t written = 0;
        while (written < bytes.size()) {
            const ssize_t n = write(pipe_end, bytes.data() + written, bytes.size() - written);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0) break;
            written += size_t(n);
        }
        code = written == bytes.size() ? 0 : 1;
    } catch (...) {
        // Out of memory, most likely; the parent says so
    }
    _exit(code);
}

std::string read_all(int pipe_end) {
    std::string bytes;
    std::array<char, 65536> buffer;
    for (;;) {
        const ssize_t n = read(pipe_end, buffer.data(), buffer.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return bytes;
        bytes.append(buffer.data(), size_t(n));
    }
}

}  // namespace

Result<std::string> run_isolated(const IsolationLimits& limits,
                                 const std::function<std::string()>& work) {
    std::array<int, 2> ends = {};
    if (pipe(ends.data()) != 0) return Error{"isolated-crashed", "cannot make a pipe"};
    const pid_t child = fork();
    if (child < 0) {
        close(ends[0]);
        close(ends[1]);
        return Error{"isolated-crashed", "cannot start a process"};
    }
    if (child == 0) {
        close(ends[0]);
        work_and_exit(ends[1], limits, work);
    }
    close(ends[1]);
    std::string bytes = read_all(ends[0]);
    close(ends[0]);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return bytes;
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
        return Error{"isolated-timeout",
                     fmt::format("reading took more than {} s", limits.cpu_seconds)};
    return Error{"isolated-crashed",
                 WIFSIGNALED(status) ? fmt::format("reading ended with signal {}", WTERMSIG(status))
                                     : std::string("reading ran out of memory")};
}

}  // namespace velatura
