// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/recent_files.h"

#include "base/atomic_file.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

namespace velatura::compositor::window {

namespace {

namespace fs = std::filesystem;

constexpr size_t longest_list = 10;
constexpr size_t largest_list_bytes = size_t(1) << 16;

std::string environment(const char* name) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody changes the environment
    const char* value = std::getenv(name);
    return value ? value : "";
}

}  // namespace

RecentFiles::RecentFiles(std::string list_path) : list_path_(std::move(list_path)) {
    if (list_path_.empty()) return;
    const auto text = read_file(list_path_, largest_list_bytes);
    if (!text) return;
    std::istringstream lines(*text);
    for (std::string line; std::getline(lines, line) && paths_.size() < longest_list;) {
        if (!line.empty()) paths_.push_back(line);
    }
}

void RecentFiles::add(const std::string& path) {
    std::error_code failed;
    const fs::path absolute = fs::absolute(path, failed).lexically_normal();
    const std::string entry = failed ? path : absolute.string();
    std::erase(paths_, entry);
    paths_.insert(paths_.begin(), entry);
    if (paths_.size() > longest_list) paths_.resize(longest_list);
    if (list_path_.empty()) return;
    std::string text;
    for (const std::string& p : paths_) text += p + "\n";
    fs::create_directories(fs::path(list_path_).parent_path(), failed);
    [[maybe_unused]] const auto written = write_file_atomically(list_path_, text);
}

std::string recent_list_path() {
    const std::string state = environment("XDG_STATE_HOME"), home = environment("HOME");
    if (!state.empty()) return state + "/velatura/recent_layers";
    if (!home.empty()) return home + "/.local/state/velatura/recent_layers";
    return {};
}

}  // namespace velatura::compositor::window
