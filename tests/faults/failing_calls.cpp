// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), makes its n-th call on files of one folder fail. What
// fails is set by the environment: VELATURA_FAULT_FOLDER   only files below it count; an absolute
// path without links VELATURA_FAULT_AT       1 = the first call VELATURA_FAULT_READS    set: calls
// that only read count, too VELATURA_FAULT_ALWAYS   set: later calls fail, too, as on a full disk
// VELATURA_FAULT_HOW      ENOSPC, EIO, EROFS, EACCES, EINTR, or short: half of the bytes are
// written or read VELATURA_FAULT_LOG      a line per failed call is added here: its name and number
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<long> calls = 0;

/// A function of the C library by its name, behind the one of that name in this file.
template <class Function>
Function* real(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool is_watched(const char* path) {
    const char* folder = std::getenv("VELATURA_FAULT_FOLDER");
    if (!folder || !path) return false;
    char absolute[PATH_MAX];
    if (path[0] != '/') {
        if (!::getcwd(absolute, sizeof(absolute))) return false;
        std::strncat(absolute, "/", sizeof(absolute) - std::strlen(absolute) - 1);
        std::strncat(absolute, path, sizeof(absolute) - std::strlen(absolute) - 1);
        path = absolute;
    }
    return std::strncmp(path, folder, std::strlen(folder)) == 0;
}

bool is_watched(int fd) {
    char link[64], path[PATH_MAX];
    std::snprintf(link, sizeof(link), "/proc/self/fd/%d", fd);
    const ssize_t length = ::readlink(link, path, sizeof(path) - 1);
    if (length < 0) return false;
    path[length] = '\0';
    return is_watched(path);
}

bool is_short() {
    const char* how = std::getenv("VELATURA_FAULT_HOW");
    return how && std::strcmp(how, "short") == 0;
}

int error_number() {
    const char* how = std::getenv("VELATURA_FAULT_HOW");
    if (!how) return EIO;
    if (std::strcmp(how, "ENOSPC") == 0) return ENOSPC;
    if (std::strcmp(how, "EROFS") == 0) return EROFS;
    if (std::strcmp(how, "EACCES") == 0) return EACCES;
    if (std::strcmp(how, "EINTR") == 0) return EINTR;
    return EIO;
}

/// Notes the call without the functions of this file.
void note(const char* name, long number) {
    const char* log = std::getenv("VELATURA_FAULT_LOG");
    if (!log) return;
    char line[128];
    const int length = std::snprintf(line, sizeof(line), "%s %ld\n", name, number);
    const long fd = ::syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::syscall(SYS_write, fd, line, length);
    ::syscall(SYS_close, fd);
}

/// Counts a call on a watched file; true when it is to fail, errno being set.
template <class File>
bool fails(const char* name, File file) {
    const int before = errno;
    const bool counts = is_watched(file);
    errno = before;
    if (!counts) return false;
    const char* at = std::getenv("VELATURA_FAULT_AT");
    const long number = ++calls, wanted = at ? std::atol(at) : 0;
    if (wanted <= 0 || number < wanted ||
        (number > wanted && !std::getenv("VELATURA_FAULT_ALWAYS")))
        return false;
    note(name, number);
    errno = error_number();
    return true;
}

template <class File>
bool fails_to_read(const char* name, File file) {
    return std::getenv("VELATURA_FAULT_READS") && fails(name, file);
}

}  // namespace

extern "C" {

#define VELATURA_FAULT_OPEN(NAME)                                                     \
    int NAME(const char* path, int flags, ...) {                                      \
        va_list rest;                                                                 \
        va_start(rest, flags);                                                        \
        const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest);                                                                 \
        if (fails("open", path) && !is_short()) return -1;                            \
        return real<int(const char*, int, ...)>(#NAME)(path, flags, mode);            \
    }
VELATURA_FAULT_OPEN(open)
VELATURA_FAULT_OPEN(open64)

int openat(int folder, const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    // Names from a folder are those of confined scenes, which nothing here breaks
    if (folder == AT_FDCWD && fails_to_read("open", path) && !is_short()) return -1;
    return real<int(int, const char*, int, ...)>("openat")(folder, path, flags, mode);
}

FILE* fopen(const char* path, const char* mode) {
    if (fails("open", path) && !is_short()) return nullptr;
    return real<FILE*(const char*, const char*)>("fopen")(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
    if (fails("open", path) && !is_short()) return nullptr;
    return real<FILE*(const char*, const char*)>("fopen64")(path, mode);
}

int mkostemps(char* pattern, int suffix, int flags) {
    if (fails("open", static_cast<const char*>(pattern)) && !is_short()) return -1;
    return real<int(char*, int, int)>("mkostemps")(pattern, suffix, flags);
}

ssize_t write(int fd, const void* bytes, size_t size) {
    if (fails("write", fd)) {
        if (!is_short() || size < 2) return -1;
        size /= 2;
    }
    return real<ssize_t(int, const void*, size_t)>("write")(fd, bytes, size);
}

ssize_t pwrite(int fd, const void* bytes, size_t size, off_t at) {
    if (fails("pwrite", fd)) {
        if (!is_short() || size < 2) return -1;
        size /= 2;
    }
    return real<ssize_t(int, const void*, size_t, off_t)>("pwrite")(fd, bytes, size, at);
}

ssize_t writev(int fd, const iovec* parts, int count) {
    if (fails("write", fd)) {
        if (!is_short() || count < 1 || parts[0].iov_len < 2) return -1;
        return real<ssize_t(int, const void*, size_t)>("write")(fd, parts[0].iov_base,
                                                                parts[0].iov_len / 2);
    }
    return real<ssize_t(int, const iovec*, int)>("writev")(fd, parts, count);
}

ssize_t read(int fd, void* bytes, size_t size) {
    if (fails_to_read("read", fd)) {
        if (!is_short() || size < 2) return -1;
        size /= 2;
    }
    return real<ssize_t(int, void*, size_t)>("read")(fd, bytes, size);
}

ssize_t pread(int fd, void* bytes, size_t size, off_t at) {
    if (fails_to_read("pread", fd)) {
        if (!is_short() || size < 2) return -1;
        size /= 2;
    }
    return real<ssize_t(int, void*, size_t, off_t)>("pread")(fd, bytes, size, at);
}

int fstat(int fd, struct stat* info) noexcept {
    if (fails_to_read("fstat", fd) && !is_short()) return -1;
    return real<int(int, struct stat*)>("fstat")(fd, info);
}

int stat(const char* path, struct stat* info) noexcept {
    if (fails_to_read("stat", path) && !is_short()) return -1;
    return real<int(const char*, struct stat*)>("stat")(path, info);
}

#define VELATURA_FAULT_MMAP(NAME)                                                                \
    void* NAME(void* place, size_t size, int protection, int flags, int fd, off_t at) noexcept { \
        if (fd >= 0 && fails_to_read("mmap", fd) && !is_short()) return MAP_FAILED;              \
        return real<void*(void*, size_t, int, int, int, off_t)>(#NAME)(place, size, protection,  \
                                                                       flags, fd, at);           \
    }
VELATURA_FAULT_MMAP(mmap)
VELATURA_FAULT_MMAP(mmap64)

int fsync(int fd) {
    if (fails("fsync", fd) && !is_short()) return -1;
    return real<int(int)>("fsync")(fd);
}

// As on Linux, the descriptor is gone whatever close says
int close(int fd) {
    const bool failed = fails("close", fd) && !is_short();
    const int why = errno;
    const int result = real<int(int)>("close")(fd);
    if (!failed) return result;
    errno = why;
    return -1;
}

int rename(const char* from, const char* to) noexcept {
    if (fails("rename", to) && !is_short()) return -1;
    return real<int(const char*, const char*)>("rename")(from, to);
}

int ftruncate(int fd, off_t size) noexcept {
    if (fails("ftruncate", fd) && !is_short()) return -1;
    return real<int(int, off_t)>("ftruncate")(fd, size);
}

int mkdir(const char* path, mode_t mode) noexcept {
    if (fails("mkdir", path) && !is_short()) return -1;
    return real<int(const char*, mode_t)>("mkdir")(path, mode);
}

}  // extern "C"
