// SPDX-License-Identifier: Apache-2.0
#include "base/asset_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <system_error>

namespace velatura {

namespace {

class OwnedBytes final : public AssetBytes {
  public:
    explicit OwnedBytes(std::string bytes) : bytes_(std::move(bytes)) {}

    std::string_view bytes() const override { return bytes_; }

  private:
    std::string bytes_;
};

class MappedBytes final : public AssetBytes {
  public:
    MappedBytes(void* start, size_t size) : start_(start), size_(size) {}

    MappedBytes(const MappedBytes&) = delete;
    MappedBytes& operator=(const MappedBytes&) = delete;

    ~MappedBytes() override { ::munmap(start_, size_); }

    std::string_view bytes() const override { return {static_cast<const char*>(start_), size_}; }

  private:
    void* start_;
    size_t size_;
};

class FileDescriptor {
  public:
    explicit FileDescriptor(int fd) : fd_(fd) {}

    FileDescriptor(const FileDescriptor&) = delete;
    FileDescriptor& operator=(const FileDescriptor&) = delete;

    ~FileDescriptor() {
        if (fd_ >= 0) ::close(fd_);
    }

    int get() const { return fd_; }

  private:
    int fd_;
};

Error unreadable(const std::string& file, int error) {
    return {"file-unreadable",
            fmt::format("cannot read \"{}\": {}", file, std::generic_category().message(error))};
}

}  // namespace

AssetBytesPtr make_asset_bytes(std::string bytes) {
    return std::make_shared<OwnedBytes>(std::move(bytes));
}

Result<AssetBytesPtr> open_asset_bytes(const std::string& file) {
    // Opening a pipe must not wait for its other end
    const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (fd.get() < 0) {
        if (errno == ENOENT || errno == ENOTDIR) {
            return Error{"file-not-found", fmt::format("file \"{}\" does not exist", file)};
        }
        return unreadable(file, errno);
    }

    struct stat status {};

    if (::fstat(fd.get(), &status) != 0) return unreadable(file, errno);
    if (!S_ISREG(status.st_mode)) {
        return Error{"file-unreadable", fmt::format("\"{}\" is not a regular file", file)};
    }
    if (status.st_size == 0) return make_asset_bytes({});

    const auto size = static_cast<size_t>(status.st_size);
    void* start = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd.get(), 0);
    if (start == MAP_FAILED) return unreadable(file, errno);
    return AssetBytesPtr(std::make_shared<MappedBytes>(start, size));
}

}  // namespace velatura
