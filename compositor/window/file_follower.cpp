// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/file_follower.h"

#include "compositor/window/jobs.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

namespace velatura::compositor::window {

namespace {

FileState state_of(const std::string& path) {
    struct stat info {};

    if (::stat(path.c_str(), &info) != 0) return {};
    return {true,
            uint64_t(info.st_dev),
            uint64_t(info.st_ino),
            uint64_t(info.st_size),
            int64_t(info.st_mtim.tv_sec),
            int64_t(info.st_mtim.tv_nsec)};
}

}  // namespace

FileStates states_of(const std::vector<std::string>& paths) {
    FileStates states;
    for (const std::string& path : paths) states.push_back(state_of(path));
    return states;
}

FollowedFiles::FollowedFiles(std::vector<std::string> paths, std::string view, FileStates shown)
    : paths_(std::move(paths)),
      view_(std::move(view)),
      seen_(std::move(shown)),
      was_there_(!seen_.empty()) {}

std::optional<Result<std::shared_ptr<const Levels>>> FollowedFiles::check() {
    using LevelsPtr = std::shared_ptr<const Levels>;
    FileStates now = states_of(paths_);
    if (now == seen_) return std::nullopt;
    const auto missing =
        std::find_if(now.begin(), now.end(), [](const FileState& s) { return !s.is_there; });
    if (missing != now.end()) {
        const std::string& path = paths_[size_t(missing - now.begin())];
        seen_ = std::move(now);
        return Result<LevelsPtr>(
            Error{"io-open", was_there_ ? path + " was removed" : path + " not found"});
    }
    auto read = guarded<LevelsPtr>([this] { return load_levels(paths_, view_); });
    // Written while it was read: neither whole nor damaged. The next look finds another state
    if (states_of(paths_) != now) return std::nullopt;
    seen_ = std::move(now);
    was_there_ = true;
    return read;
}

FileFollower::FileFollower(std::vector<std::string> paths,
                           const std::string& view,
                           FileStates shown,
                           std::function<void()> wake,
                           double interval_s)
    : name_(std::filesystem::path(paths[0]).filename().string()),
      wake_(std::move(wake)),
      interval_s_(interval_s),
      files_(std::move(paths), view, std::move(shown)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

FileFollower::~FileFollower() {
    thread_.request_stop();
    ended_.notify_all();
}

void FileFollower::run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
        lock.unlock();
        auto found = files_.check();
        lock.lock();
        if (found) {
            news_ = *found ? Result<RenewedLayers>(RenewedLayers{std::move(**found)})
                           : Result<RenewedLayers>(found->error());
            lock.unlock();
            wake_();
            lock.lock();
        }
        ended_.wait_for(lock, stop, std::chrono::duration<double>(interval_s_),
                        [] { return false; });
    }
}

std::optional<Result<RenewedLayers>> FileFollower::take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(news_, std::nullopt);
}

std::string FileFollower::state() const {
    return "following " + name_;
}

}  // namespace velatura::compositor::window
