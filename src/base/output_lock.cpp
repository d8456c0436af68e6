// SPDX-License-Identifier: Apache-2.0
#include "base/output_lock.h"

#include "base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

namespace velatura {

namespace {

std::string reason() {
    return std::error_code(errno, std::generic_category()).message();
}

/// "process 123 on farm7": what the one that holds the lock wrote.
std::string holder(int fd) {
    std::array<char, 128> text{};
    const ssize_t size = ::pread(fd, text.data(), text.size(), 0);
    return size > 0 ? std::string(text.data(), size_t(size)) : std::string("another process");
}

void write_holder(int fd) {
    std::array<char, 65> host{};
    ::gethostname(host.data(), host.size() - 1);
    const std::string text = fmt::format("process {} on {}", ::getpid(), host.data());
    // Only for a message: that nothing could be written is found out by who writes the image
    [[maybe_unused]] const bool is_done =
        ::ftruncate(fd, 0) == 0 && ::pwrite(fd, text.data(), text.size(), 0) >= 0;
}

/// The file may have been removed by its last holder since it was opened.
bool is_same_file(int fd, const std::string& path) {
    struct ::stat opened {
    }, named{};

    return ::fstat(fd, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
           opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

Result<OutputLock> OutputLock::take(const std::string& path) {
    if (auto made = make_folder_of(path); !made) return made.error();
    const std::filesystem::path target(path);
    const std::string lock_path =
        (target.parent_path() / fmt::format(".{}.lock", target.filename().string())).string();
    for (;;) {
        const int fd =
            ::open(lock_path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
        if (fd < 0 && errno == EINTR) continue;
        if (fd < 0) return Error{"io-write", fmt::format("cannot write {}: {}", path, reason())};
        if (::flock(fd, LOCK_EX | LOCK_NB) == 0) {
            if (is_same_file(fd, lock_path)) {
                write_holder(fd);
                return OutputLock(lock_path, fd, true);
            }
            ::close(fd);
            continue;
        }
        if (errno == EINTR) {
            ::close(fd);
            continue;
        }
        if (errno != EWOULDBLOCK) return OutputLock(lock_path, fd, false);
        Error error{"output-locked", fmt::format("{} is being rendered by {}", path, holder(fd))};
        ::close(fd);
        return error;
    }
}

Result<OutputLock> OutputLock::wait_for(const std::string& path, double seconds) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    for (;;) {
        Result<OutputLock> lock = take(path);
        if (lock || lock.error().code != "output-locked") return lock;
        if (std::chrono::duration<double>(Clock::now() - begin).count() >= seconds) return lock;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
}

OutputLock::OutputLock(OutputLock&& other) noexcept
    : lock_path_(std::move(other.lock_path_)),
      fd_(std::exchange(other.fd_, -1)),
      is_held_(other.is_held_) {}

OutputLock::~OutputLock() {
    if (fd_ < 0) return;
    // While the lock is held: afterwards it could be the file of another
    ::unlink(lock_path_.c_str());
    ::close(fd_);
}

}  // namespace velatura
