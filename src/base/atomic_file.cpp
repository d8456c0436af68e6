// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"

#include "base/file_descriptor.h"
#include "base/input_guard.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

namespace velatura {

namespace {

std::string reason() {
    return std::error_code(errno, std::generic_category()).message();
}

Error write_error(const std::string& path, const std::string& why) {
    return {"io-write", fmt::format("cannot write {}: {}", path, why)};
}

/// An interrupted close has closed nevertheless (Linux), and what was written is flushed by then.
bool close_file(int fd) {
    return ::close(fd) == 0 || errno == EINTR;
}

Result<void> flush_to_disk(const std::string& path, int open_flags) {
    const int fd = uninterrupted([&] { return ::open(path.c_str(), open_flags | O_CLOEXEC); });
    if (fd < 0) return write_error(path, reason());
    const bool ok = uninterrupted([&] { return ::fsync(fd); }) == 0;
    const std::string why = ok ? std::string() : reason();
    if (!close_file(fd) || !ok) return write_error(path, ok ? reason() : why);
    return {};
}

constexpr std::string_view temporary_mark = ".tmp.";
constexpr size_t random_letters = 6;

/// Whether a name is that of a temporary file of write_atomically for some file with this stem, of
/// whatever extension.
bool is_temporary_name(std::string_view name, const std::string& stem) {
    const std::string begin = "." + stem + std::string(temporary_mark);
    if (!name.starts_with(begin) || name.size() < begin.size() + random_letters) return false;
    const std::string_view end = name.substr(begin.size() + random_letters);
    return end.empty() || end[0] == '.';
}

/// Users know the file they asked for and not its temporary.
Error with_path(Error error, const std::string& temporary, const std::string& path) {
    for (size_t at = error.message.find(temporary); at != std::string::npos;
         at = error.message.find(temporary, at + path.size()))
        error.message.replace(at, temporary.size(), path);
    return error;
}

/// A temporary file that is locked as long as the descriptor is open: one without a lock belongs to
/// nobody any more.
int make_temporary(const std::string& pattern, int extension_size, std::string& temporary) {
    for (;;) {
        temporary = pattern;
        const int fd =
            uninterrupted([&] { return ::mkostemps(temporary.data(), extension_size, O_CLOEXEC); });
        if (fd < 0) return fd;

        struct ::stat info {};

        // Somebody who sweeps may have been faster. Where there are no locks, nobody sweeps
        const bool is_taken = ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
        if (!is_taken && (::fstat(fd, &info) != 0 || info.st_nlink > 0)) return fd;
        ::close(fd);
    }
}

/// A temporary file until it is renamed, however its writing ends; nothing is written through its
/// descriptor, which only holds the lock.
class Temporary {
  public:
    Temporary(const std::string& path, int fd) : path_(path), fd_(fd) {}

    ~Temporary() {
        ::unlink(path_.c_str());
        ::close(fd_);
    }

    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

  private:
    const std::string& path_;
    int fd_;
};

}  // namespace

Result<void> make_folder_of(const std::string& path) {
    // A file with another's name in the place of a folder is what open() will complain of
    for (size_t slash = path.find('/', 1); slash != std::string::npos;
         slash = path.find('/', slash + 1)) {
        const std::string folder = path.substr(0, slash);
        if (::access(folder.c_str(), F_OK) == 0) continue;
        if (::mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST)
            return write_error(path, reason());
    }
    return {};
}

void sweep_temporaries(const std::string& path) {
    const std::filesystem::path target(path);
    const std::string stem = target.stem().string();
    // Not std::filesystem::directory_iterator, which ends the process where memory is short
    const std::unique_ptr<DIR, int (*)(DIR*)> folder(
        ::opendir(target.has_parent_path() ? target.parent_path().c_str() : "."), ::closedir);
    if (!folder) return;
    while (const dirent* entry = ::readdir(folder.get())) {
        if (!is_temporary_name(entry->d_name, stem)) continue;
        // Not waiting for a FIFO, nor following a link, of that name
        const int fd = ::openat(::dirfd(folder.get()), entry->d_name,
                                O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
        if (fd < 0) continue;

        struct ::stat info {};

        if (::fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && ::flock(fd, LOCK_EX | LOCK_NB) == 0)
            ::unlinkat(::dirfd(folder.get()), entry->d_name, 0);
        ::close(fd);
    }
}

Result<void> write_atomically(const std::string& path,
                              const std::function<Result<void>(const std::string&)>& write) {
    namespace fs = std::filesystem;
    if (auto allowed = check_output(path); !allowed) return allowed;
    if (auto made = make_folder_of(path); !made) return made;
    const fs::path target(path);
    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");

    // Create the temporary exclusively, keeping the extension: image libraries choose the format by
    // it
    const std::string pattern = (folder / fmt::format(".{}{}XXXXXX{}", target.stem().string(),
                                                      temporary_mark, target.extension().string()))
                                    .string();
    std::string temporary;
    const int fd = make_temporary(pattern, int(target.extension().string().size()), temporary);
    if (fd < 0) return write_error(path, reason());
    // mkostemps makes the file private; give it the mode any new file would have
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(fd, 0666 & ~mask);

    const Temporary file(temporary, fd);
    Result<void> done = write(temporary);
    if (done) done = flush_to_disk(temporary, O_RDONLY);
    if (done && uninterrupted([&] { return ::rename(temporary.c_str(), path.c_str()); }) != 0)
        done = write_error(path, reason());
    if (!done) return with_path(done.error(), temporary, path);
    if (const Result<void> flushed = flush_to_disk(folder.string(), O_RDONLY | O_DIRECTORY);
        !flushed)
        return Error{
            "io-flush",
            fmt::format(
                "{} is written, but not flushed to disk, and can be lost if the system stops: {}",
                path, flushed.error().message)};
    return {};
}

Result<void> write_file_atomically(const std::string& path, std::string_view content) {
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        const int fd = uninterrupted(
            [&] { return ::open(temporary.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC); });
        if (fd < 0) return write_error(path, reason());
        size_t written = 0;
        while (written < content.size()) {
            const ssize_t n = ::write(fd, content.data() + written, content.size() - written);
            if (n < 0 && errno == EINTR) continue;
            if (n < 0) {
                const std::string why = reason();
                ::close(fd);
                return write_error(path, why);
            }
            written += size_t(n);
        }
        if (!close_file(fd)) return write_error(path, reason());
        return {};
    });
}

Result<std::string> read_file(const std::string& path, size_t size_limit_bytes) {
    // O_NONBLOCK: a FIFO in place of a file must not make the program wait
    const int fd =
        uninterrupted([&] { return ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC); });
    if (fd < 0) return Error{"io-open", fmt::format("cannot open {}: {}", path, reason())};

    struct ::stat info {};

    if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        ::close(fd);
        return Error{"io-open", fmt::format("cannot open {}: not a regular file", path)};
    }
    if (size_t(info.st_size) > size_limit_bytes) {
        ::close(fd);
        return Error{"io-open", fmt::format("cannot open {}: {} bytes exceed the limit of {}", path,
                                            info.st_size, size_limit_bytes)};
    }
    std::string content(size_t(info.st_size), '\0');
    size_t filled = 0;
    while (filled < content.size()) {
        const ssize_t n = ::read(fd, content.data() + filled, content.size() - filled);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            const std::string why = reason();
            ::close(fd);
            return Error{"io-read", fmt::format("cannot read {}: {}", path, why)};
        }
        if (n == 0) break;
        filled += size_t(n);
    }
    ::close(fd);
    content.resize(filled);
    return content;
}

}  // namespace velatura
