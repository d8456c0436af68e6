// SPDX-License-Identifier: Apache-2.0
#include "view/file_watch.h"

#include <sys/stat.h>

#include <chrono>
#include <utility>

namespace velatura::view {

FileWatch::FileWatch(std::function<void()> changed)
    : changed_(std::move(changed)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

FileWatch::~FileWatch() = default;

FileWatch::State FileWatch::state_of(const std::string& file) {
    struct stat about {};

    if (::stat(file.c_str(), &about) != 0) return {};
    return {int64_t(about.st_mtim.tv_sec) * 1000000000 + about.st_mtim.tv_nsec,
            int64_t(about.st_size), uint64_t(about.st_ino)};
}

FileWatch::States FileWatch::now(const States& files) {
    States states;
    for (const auto& [file, ignored] : files) states[file] = state_of(file);
    return states;
}

void FileWatch::watch(const std::vector<std::string>& files) {
    States states;
    for (const std::string& file : files) states[file] = state_of(file);
    const std::lock_guard lock(mutex_);
    first_ = reported_ = std::move(states);
}

std::vector<std::string> FileWatch::changed_files() const {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> changed;
    for (const auto& [file, state] : first_)
        if (state_of(file) != state) changed.push_back(file);
    return changed;
}

void FileWatch::run(const std::stop_token& stop) {
    constexpr auto interval = std::chrono::milliseconds(500);
    States before;
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
        wake_.wait_for(lock, stop, interval, [] { return false; });
        if (stop.stop_requested()) return;
        States states = now(reported_);
        const bool is_still = states == before;
        before = states;
        if (states == reported_ || !is_still) continue;
        reported_ = std::move(states);
        lock.unlock();
        changed_();
        lock.lock();
    }
}

}  // namespace velatura::view
