// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/layer_source.h"

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace velatura::compositor::window {

/// What tells whether a file was replaced, without its content.
struct FileState {
    bool is_there = false;
    uint64_t device = 0, number = 0, size = 0;
    int64_t changed_s = 0, changed_ns = 0;

    bool operator==(const FileState&) const = default;
};

/// Of each path.
using FileStates = std::vector<FileState>;

FileStates states_of(const std::vector<std::string>& paths);

/// Files that are read again when they were replaced. Of one thread.
class FollowedFiles {
  public:
    /// Several paths: files of one AOV each. `view`: of a stereo file. `shown`: their state before
    /// they were read; empty: they were not.
    FollowedFiles(std::vector<std::string> paths, std::string view, FileStates shown);

    /// Looks once. Returns: nullopt while they are as they were, and while they are written.
    /// Errors: "io-open" (removed, or not yet there), those of load_levels; each state of the files
    ///         is read, and reported, once.
    std::optional<Result<std::shared_ptr<const Levels>>> check();

  private:
    std::vector<std::string> paths_;
    std::string view_;
    FileStates seen_;
    bool was_there_;
};

/// Follows files in a thread of its own.
class FileFollower : public LayerSource {
  public:
    /// Between two looks at the files, also at those that another machine writes [s].
    static constexpr double usual_interval_s = 0.5;

    /// `wake` is called from the thread whenever there is news.
    FileFollower(std::vector<std::string> paths,
                 const std::string& view,
                 FileStates shown,
                 std::function<void()> wake,
                 double interval_s = usual_interval_s);
    ~FileFollower() override;

    std::optional<Result<RenewedLayers>> take() override;
    std::string state() const override;

  private:
    void run(const std::stop_token& stop);

    std::string name_;
    std::function<void()> wake_;
    double interval_s_;
    FollowedFiles files_;  ///< of the thread alone
    std::mutex mutex_;
    std::condition_variable_any ended_;
    std::optional<Result<RenewedLayers>> news_;
    std::jthread thread_;  ///< last: it uses all of the above
};

}  // namespace velatura::compositor::window
