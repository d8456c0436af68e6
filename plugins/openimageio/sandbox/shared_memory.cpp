// SPDX-License-Identifier: Apache-2.0
#include "plugins/openimageio/sandbox/shared_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace velatura::plugins::openimageio {

namespace {

Error no_memory(int number) {
    return {"shared-memory", std::string("cannot share memory: ") + std::strerror(number)};
}

}  // namespace

Result<SharedMemory> SharedMemory::create() {
    FileDescriptor file(::memfd_create("velatura_decoder", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (!file.is_open() || ::fcntl(file.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_SEAL) != 0)
        return no_memory(errno);
    return SharedMemory(std::move(file));
}

SharedMemory::~SharedMemory() {
    unmap();
}

void SharedMemory::unmap() {
    if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
    bytes_ = {};
}

Result<void> SharedMemory::reserve(size_t bytes) {
    if (bytes <= backed_) return {};
    // A page that cannot be had would end the process that touches it
    if (::fallocate(file_.get(), 0, off_t(backed_), off_t(bytes - backed_)) != 0)
        return no_memory(errno);
    backed_ = bytes;
    return map(bytes);
}

Result<void> SharedMemory::map(size_t bytes) {
    if (bytes <= bytes_.size()) return {};
    struct stat status = {};
    if (::fstat(file_.get(), &status) != 0) return no_memory(errno);
    if (size_t(status.st_size) < bytes) return no_memory(EFBIG);
    void* const place = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), 0);
    if (place == MAP_FAILED) return no_memory(errno);
    unmap();
    bytes_ = {static_cast<char*>(place), bytes};
    return {};
}

void SharedMemory::forget_beyond(size_t bytes) {
    if (bytes >= backed_) return;
    (void)::fallocate(file_.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, off_t(bytes),
                      off_t(backed_ - bytes));
    backed_ = bytes;
}

}  // namespace velatura::plugins::openimageio
