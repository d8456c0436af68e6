// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

namespace velatura {

namespace {

std::string reason() { return std::error_code(errno, std::generic_category()).message(); }

Error write_error(const std::string& path, const std::string& why) {
    return {"io-write", fmt::format("cannot write {}: {}", path, why)};
}

Result<void> flush_to_disk(const std::string& path, int open_flags) {
    const int fd = ::open(path.c_str(), open_flags);
    if (fd < 0) return write_error(path, reason());
    const bool ok = ::fsync(fd) == 0;
    const std::string why = ok ? std::string() : reason();
    if (::close(fd) != 0 || !ok) return write_error(path, ok ? reason() : why);
    return {};
}

}  // namespace

Result<void> write_atomically(const std::string& path,
                              const std::function<Result<void>(const std::string&)>& write) {
    namespace fs = std::filesystem;
    const fs::path target(path);
    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");

    // Create the temporary exclusively, keeping the extension: image libraries choose the format by it
    std::string temporary = (folder / fmt::format(".{}.tmp.XXXXXX{}", target.stem().string(), target.extension().string())).string();
    const int fd = ::mkstemps(temporary.data(), int(target.extension().string().size()));
    if (fd < 0) return write_error(path, reason());
    // mkstemps makes the file private; give it the mode any new file would have
    const mode_t mask = ::umask(0);
    ::umask(mask);
    ::fchmod(fd, 0666 & ~mask);
    ::close(fd);

    Result<void> done = write(temporary);
    if (done) done = flush_to_disk(temporary, O_RDONLY);
    if (done && ::rename(temporary.c_str(), path.c_str()) != 0) done = write_error(path, reason());
    if (!done) {
        ::unlink(temporary.c_str());
        return done;
    }
    return flush_to_disk(folder.string(), O_RDONLY | O_DIRECTORY);
}

Result<void> write_file_atomically(const std::string& path, std::string_view content) {
    return write_atomically(path, [&](const std::string& temporary) -> Result<void> {
        const int fd = ::open(temporary.c_str(), O_WRONLY | O_TRUNC);
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
        if (::close(fd) != 0) return write_error(path, reason());
        return {};
    });
}

Result<std::string> read_file(const std::string& path, size_t size_limit_bytes) {
    // O_NONBLOCK: a FIFO in place of a file must not make the program wait
    const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) return Error{"io-open", fmt::format("cannot open {}: {}", path, reason())};
    struct ::stat info {};
    if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        ::close(fd);
        return Error{"io-open", fmt::format("cannot open {}: not a regular file", path)};
    }
    if (size_t(info.st_size) > size_limit_bytes) {
        ::close(fd);
        return Error{"io-open", fmt::format("cannot open {}: {} bytes exceed the limit of {}", path, info.st_size, size_limit_bytes)};
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
