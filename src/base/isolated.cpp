// SPDX-License-Identifier: Apache-2.0
#include "base/isolated.h"

#include "base/process/mapping_guard.h"
#include "base/process/process_limits.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <utility>

namespace velatura {

namespace {

/// The child's part; does not return.
[[noreturn]] void work_and_exit(int pipe_end,
                                const IsolationLimits& limits,
                                const std::function<std::string()>& work) {
    // Nobody waits for what a reader that is lost in a file may find
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    exit_on_truncated_files();
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

/// A child, from its start to its end, and what it has written so far.
class Child {
  public:
    Child(pid_t process, int pipe_end) : process_(process), pipe_end_(pipe_end) {}

    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    ~Child() { close(pipe_end_); }

    /// Reads until it ends. False, and the child is no more, when that takes longer than until the
    /// deadline.
    bool wait(std::chrono::steady_clock::time_point deadline) {
        bool is_written = false;
        while (!has_ended_) {
            // A negative descriptor is nothing to wait for but the time, short as its end is near
            pollfd end = {.fd = is_written ? -1 : pipe_end_, .events = POLLIN, .revents = 0};
            if (poll(&end, 1, is_written ? 1 : 100) > 0) {
                is_written = !read_some();
                continue;
            }
            // The pipe may stay open for longer than its child: others that were started meanwhile
            // have it, too
            join(WNOHANG);
            if (!has_ended_ && std::chrono::steady_clock::now() > deadline) {
                kill(process_, SIGKILL);
                join(0);
                return false;
            }
        }
        pollfd end = {.fd = pipe_end_, .events = POLLIN, .revents = 0};
        while (poll(&end, 1, 0) > 0 && read_some()) {
        }
        return true;
    }

    int status() const { return status_; }

    std::string take_bytes() { return std::move(bytes_); }

  private:
    /// False at the end of what is written.
    bool read_some() {
        std::array<char, 65536> buffer;
        const ssize_t n = read(pipe_end_, buffer.data(), buffer.size());
        if (n > 0) bytes_.append(buffer.data(), size_t(n));
        return n > 0 || (n < 0 && errno == EINTR);
    }

    void join(int options) {
        pid_t ended = -1;
        while ((ended = waitpid(process_, &status_, options)) < 0 && errno == EINTR) {
        }
        has_ended_ = ended != 0;
    }

    pid_t process_;
    int pipe_end_;
    int status_ = 0;
    bool has_ended_ = false;
    std::string bytes_;
};

}  // namespace

Result<std::string> run_isolated(const IsolationLimits& limits,
                                 const std::function<std::string()>& work) {
    std::array<int, 2> ends = {};
    if (pipe(ends.data()) != 0) return Error{"isolated-crashed", "cannot make a pipe"};
    const pid_t process = fork();
    if (process < 0) {
        close(ends[0]);
        close(ends[1]);
        return Error{"isolated-crashed", "cannot start a process"};
    }
    if (process == 0) {
        close(ends[0]);
        work_and_exit(ends[1], limits, work);
    }
    close(ends[1]);
    Child child(process, ends[0]);
    const auto now = std::chrono::steady_clock::now();
    if (!child.wait(now + std::chrono::seconds(limits.wall_seconds)))
        return Error{"isolated-timeout",
                     fmt::format("reading did not end within {} s", limits.wall_seconds)};
    const int status = child.status();
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return child.take_bytes();
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
        return Error{"isolated-timeout",
                     fmt::format("reading took more than {} s", limits.cpu_seconds)};
    return Error{"isolated-crashed",
                 WIFSIGNALED(status)
                     ? fmt::format("the decoder process was ended by signal {}", WTERMSIG(status))
                     : std::string("the decoder process ran out of memory")};
}

}  // namespace velatura
