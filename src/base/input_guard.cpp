// SPDX-License-Identifier: Apache-2.0
#include "base/input_guard.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

namespace velatura {

namespace {

using FileId = std::pair<dev_t, ino_t>;

/// Of a regular file, links followed.
std::optional<FileId> file_id(const std::string& path) {
    struct ::stat info {};

    if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return std::nullopt;
    return FileId(info.st_dev, info.st_ino);
}

std::atomic<bool> is_guarding = false;
std::mutex mutex;

/// Paths as they were read. Never destroyed: tasks may read until the program ends.
std::map<FileId, std::string>& inputs() {
    static auto* const files = new std::map<FileId, std::string>();
    return *files;
}

}  // namespace

void start_guarding_inputs() {
    const std::scoped_lock lock(mutex);
    inputs().clear();
    is_guarding = true;
}

void stop_guarding_inputs() {
    is_guarding = false;
}

void guard_input(const std::string& path) {
    if (!is_guarding) return;
    const std::optional<FileId> id = file_id(path);
    if (!id) return;
    const std::scoped_lock lock(mutex);
    inputs().try_emplace(*id, path);
}

Result<void> check_output(const std::string& path) {
    if (!is_guarding) return {};
    const std::optional<FileId> id = file_id(path);
    if (!id) return {};
    const std::scoped_lock lock(mutex);
    const auto input = inputs().find(*id);
    if (input == inputs().end()) return {};
    const std::string same =
        input->second == path ? "an input" : fmt::format("the input {}", input->second);
    return Error{
        "overwrites-input",
        fmt::format(
            "{} is {} and would be overwritten; choose another name, or use --overwrite-input",
            path, same)};
}

}  // namespace velatura
