// SPDX-License-Identifier: Apache-2.0
#include "base/process/memory_limit.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <new>
#include <string>
#include <string_view>

namespace velatura {
inline namespace process {

namespace {

constexpr size_t unlimited = std::numeric_limits<size_t>::max();

std::atomic<size_t> limit_bytes = unlimited;
std::atomic<const char*> now_doing = "";
std::atomic<size_t> last_refused = 0;
bool is_enforced = false;

/// What the kernel says of this process, bytes; see proc_pid_status(5).
struct ProcessMemory {
    size_t peak = 0;
    size_t writable = 0;  ///< private, whether resident or not: what RLIMIT_DATA counts
};

ProcessMemory process_memory() {
    std::ifstream status("/proc/self/status");
    ProcessMemory memory;
    size_t kilobytes = 0;
    for (std::string name; status >> name;) {
        const bool is_wanted = name == "VmHWM:" || name == "VmData:";
        if (is_wanted && status >> kilobytes)
            (name == "VmHWM:" ? memory.peak : memory.writable) = kilobytes * 1024;
        status.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    return memory;
}

/// The hard limit stays as it is: only then can a child, or the next phase, lift the other.
void limit_writable(rlim_t bytes) {
    rlimit limit = {};
    if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
    limit.rlim_cur = std::min(bytes, limit.rlim_max);
    setrlimit(RLIMIT_DATA, &limit);
}

/// What was put aside, if it is still there. Not from operator new, and never touched: it is not
/// resident.
std::atomic<void*> aside = nullptr;
constexpr size_t aside_bytes = size_t(4) << 20;

bool take_what_was_put_aside() {
    void* const memory = aside.exchange(nullptr);
    std::free(memory);
    return memory != nullptr;
}

/// What an Exemption lifts the limit by, each time.
constexpr size_t granted_bytes = size_t(4) << 20;
constexpr int max_granted_steps = 64;

constexpr size_t spare_bytes = MemoryLimit::kept_bytes - aside_bytes;

/// Of what is mapped and not resident, stacks and data of libraries stay so for the most part. What
/// the allocator has mapped and given back will be resident again without that the kernel is asked.
void limit_to_what_is_left() {
    const size_t left = MemoryLimit::left(),
                 kept = mallinfo2().fordblks + spare_bytes + (aside ? aside_bytes : 0);
    limit_writable(process_memory().writable + (left > kept ? left - kept : 0));
}

}  // namespace

size_t resident_bytes() {
    std::ifstream statm("/proc/self/statm");
    size_t total = 0, resident = 0;
    if (!(statm >> total >> resident)) return 0;
    return resident * size_t(sysconf(_SC_PAGESIZE));
}

// Not ru_maxrss of getrusage(2), which a program inherits from the one that started it
size_t peak_resident_bytes() {
    return process_memory().peak;
}

size_t machine_bytes() {
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    constexpr size_t unknown = size_t(8) << 30;
    return pages > 0 && page > 0 ? size_t(pages) * size_t(page) : unknown;
}

MemoryLimit::MemoryLimit(size_t bytes) {
    now_doing = "at the start";
    limit_bytes = bytes;
    if (resident_bytes() + kept_bytes > bytes) {
        limit_bytes = unlimited;
        throw std::bad_alloc();
    }
    // Large blocks that are freed are unmapped then, where the kernel sees it
    constexpr int large_block = 64 << 10;
    mallopt(M_MMAP_THRESHOLD, large_block);
    std::set_new_handler(find_memory_or_throw);
    enforce(now_doing);
}

MemoryLimit::~MemoryLimit() {
    watch();
    limit_bytes = unlimited;
}

/// For operator new that found nothing, and tries again.
void MemoryLimit::find_memory_or_throw() {
    rlimit limit = {};
    getrlimit(RLIMIT_DATA, &limit);
    // Refused within the hard limit, which is the machine's own, a thread is granted nothing
    if (is_set() && Exemption::depth > 0 && Exemption::steps < max_granted_steps &&
        limit.rlim_cur < limit.rlim_max) {
        ++Exemption::steps;
        return limit_writable(limit.rlim_cur + granted_bytes);
    }
    if (!take_what_was_put_aside()) throw std::bad_alloc();
}

void reserve_memory() {
    std::set_new_handler(MemoryLimit::find_memory_or_throw);
    if (!aside) aside = std::malloc(aside_bytes);
}

void MemoryLimit::enforce(const char* doing) {
    if (!is_set()) return;
    now_doing = doing;
    give_back();
    reserve_memory();
    limit_to_what_is_left();
    is_enforced = true;
}

void MemoryLimit::watch() {
    if (is_set()) limit_writable(RLIM_INFINITY);
    is_enforced = false;
}

MemoryLimit::Suspension::Suspension() : was_enforced_(is_enforced) {
    if (was_enforced_) limit_writable(RLIM_INFINITY);
}

MemoryLimit::Suspension::~Suspension() {
    if (was_enforced_) limit_to_what_is_left();
}

void MemoryLimit::give_back() {
    malloc_trim(0);
}

void MemoryLimit::note_rejection(size_t bytes) {
    last_refused = bytes;
}

size_t MemoryLimit::refused_bytes() {
    return last_refused;
}

bool MemoryLimit::is_set() {
    return limit_bytes != unlimited;
}

const char* MemoryLimit::doing() {
    return now_doing;
}

size_t MemoryLimit::allowed() {
    return is_set() ? limit_bytes.load() : machine_bytes();
}

size_t MemoryLimit::left() {
    const size_t all = allowed(), now = resident_bytes();
    return all > now ? all - now : 0;
}

}  // namespace process
}  // namespace velatura
