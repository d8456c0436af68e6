// SPDX-License-Identifier: Apache-2.0
#include "base/process/mapping_guard.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <mutex>

namespace velatura {
inline namespace process {

/// Where a file is mapped, if anywhere: places are never freed, so that a signal handler may walk
/// through them at any time.
struct MappedRange {
    std::atomic<uintptr_t> begin = 0;
    std::atomic<uintptr_t> end = 0;  ///< 0 = free
    std::atomic<bool> has_lost = false;
    std::string file;
    MappedRange* next = nullptr;
};

namespace {

std::atomic<MappedRange*> first_place = nullptr;
uintptr_t page_size = 4096;

struct sigaction earlier_action {};

static_assert(std::atomic<uintptr_t>::is_always_lock_free &&
                  std::atomic<bool>::is_always_lock_free &&
                  std::atomic<MappedRange*>::is_always_lock_free,
              "used in a signal handler");

/// Guards the changes of places, which handlers only look at.
std::mutex& places_mutex() {
    static std::mutex mutex;
    return mutex;
}

void on_bus_error(int signal, siginfo_t* info, void* context) {
    const auto address = reinterpret_cast<uintptr_t>(info->si_addr);
    // One that somebody has sent has no address
    for (MappedRange* place = info->si_code > 0 ? first_place.load() : nullptr; place;
         place = place->next) {
        if (address < place->begin || address >= place->end) continue;
        void* const page = reinterpret_cast<void*>(address & ~(page_size - 1));
        if (::mmap(page, page_size, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) ==
            MAP_FAILED)
            break;
        place->has_lost = true;
        return;
    }
    // Of no mapping here. A plugin has its own mappings, and its handler is called before that of
    // the program; else as without this handler, when the access is tried again
    if ((earlier_action.sa_flags & SA_SIGINFO) != 0)
        return earlier_action.sa_sigaction(signal, info, context);
    ::sigaction(SIGBUS, &earlier_action, nullptr);
}

/// A free place, or a new one. The caller holds the mutex.
MappedRange* take_place() {
    for (MappedRange* place = first_place; place; place = place->next)
        if (place->end == 0 && !place->has_lost) return place;
    auto* const made = new MappedRange;
    made->next = first_place;
    first_place = made;
    return made;
}

}  // namespace

void read_truncated_pages_as_zeros() {
    page_size = uintptr_t(::sysconf(_SC_PAGESIZE));

    struct sigaction action {};

    action.sa_sigaction = on_bus_error;
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    ::sigemptyset(&action.sa_mask);

    struct sigaction previous {};

    ::sigaction(SIGBUS, &action, &previous);
    const bool is_this =
        (previous.sa_flags & SA_SIGINFO) != 0 && previous.sa_sigaction == on_bus_error;
    if (!is_this) earlier_action = previous;
}

void exit_on_truncated_files() {
    struct sigaction action {};

    action.sa_handler = SIG_DFL;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGBUS, &action, nullptr);
}

std::vector<std::string> truncated_files() {
    const std::lock_guard lock(places_mutex());
    std::vector<std::string> files;
    for (MappedRange* place = first_place; place; place = place->next)
        if (place->has_lost) files.push_back(place->file);
    std::sort(files.begin(), files.end());
    files.erase(std::unique(files.begin(), files.end()), files.end());
    return files;
}

GuardedMapping::GuardedMapping(const void* start, size_t size, const std::string& file) {
    const std::lock_guard lock(places_mutex());
    place_ = take_place();
    place_->file = file;
    place_->begin = reinterpret_cast<uintptr_t>(start);
    place_->end = reinterpret_cast<uintptr_t>(start) + size;
}

GuardedMapping::~GuardedMapping() {
    const std::lock_guard lock(places_mutex());
    place_->end = 0;
}

}  // namespace process
}  // namespace velatura
