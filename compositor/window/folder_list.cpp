// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/folder_list.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace velatura::compositor::window {

namespace fs = std::filesystem;

FolderList list_folder(const std::string& folder, std::string_view extension) {
    FolderList list;
    std::error_code failed;
    list.folder = fs::absolute(folder.empty() ? "." : folder, failed).lexically_normal().string();
    for (auto it = fs::directory_iterator(list.folder, failed);
         !failed && it != fs::directory_iterator(); it.increment(failed)) {
        const std::string name = it->path().filename().string();
        std::error_code unknown;
        if (name.starts_with(".")) continue;
        if (it->is_directory(unknown)) {
            list.folders.push_back(name);
        } else if (name.ends_with(extension)) {
            list.files.push_back(name);
        }
    }
    std::sort(list.folders.begin(), list.folders.end());
    std::sort(list.files.begin(), list.files.end());
    return list;
}

bool is_folder(const std::string& path) {
    std::error_code unknown;
    return fs::is_directory(path, unknown);
}

std::string path_in(const std::string& folder, const std::string& path) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody changes the environment
    const char* home = std::getenv("HOME");
    if (path.starts_with("~/") && home) return home + path.substr(1);
    return (fs::path(folder) / path).lexically_normal().string();
}

std::string with_extension(const std::string& path, std::string_view extension) {
    return fs::path(path).has_extension() ? path : path + std::string(extension);
}

}  // namespace velatura::compositor::window
