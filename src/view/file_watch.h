// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace velatura::view {

/// Looks twice a second whether files have changed: their time, length or inode, or whether they
/// are there.
class FileWatch {
  public:
    /// `changed` is called from a thread of its own, once files have changed and are then the same
    /// for half a second: an editor may write a file in several steps.
    explicit FileWatch(std::function<void()> changed);
    ~FileWatch();

    FileWatch(const FileWatch&) = delete;
    FileWatch& operator=(const FileWatch&) = delete;

    /// Watches these files, as they are now, instead of those before.
    void watch(const std::vector<std::string>& files);

    /// Those that differ from what they were when watch() was called.
    std::vector<std::string> changed_files() const;

  private:
    struct State {
        int64_t time_ns = -1, bytes = -1;  ///< -1: it is not there
        uint64_t inode = 0;

        bool operator==(const State&) const = default;
    };

    using States = std::map<std::string, State>;

    static State state_of(const std::string& file);
    static States now(const States& files);
    void run(const std::stop_token& stop);

    std::function<void()> changed_;
    mutable std::mutex mutex_;
    std::condition_variable_any wake_;
    States first_;     ///< as of watch()
    States reported_;  ///< when `changed` was called last
    std::jthread thread_;
};

}  // namespace velatura::view
