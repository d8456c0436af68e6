// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/folder_list.h"

#include "base/frames.h"

#include <algorithm>
#include <charconv>
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

std::string file_to_open(const std::string& path, std::optional<double> frame) {
    std::error_code unknown;
    if (fs::exists(path, unknown) || !is_sequence(path)) return path;
    const std::vector<int> frames = frames_on_disk(path);
    if (frames.empty()) return path;
    const bool has_frame =
        frame && std::find(frames.begin(), frames.end(), int(*frame)) != frames.end();
    return frame_path(path, has_frame ? int(*frame) : frames.front());
}

std::optional<std::string> frame_beside(const std::string& path, int step) {
    const std::string name = fs::path(path).filename().string();
    const size_t last = name.find_last_of("0123456789", name.rfind('.'));
    if (last == std::string::npos) return std::nullopt;
    size_t first = last;
    while (first > 0 && name[first - 1] >= '0' && name[first - 1] <= '9') --first;
    const size_t digits = last + 1 - first;
    int frame = 0;
    if (std::from_chars(name.data() + first, name.data() + last + 1, frame).ec != std::errc())
        return std::nullopt;
    // A number without leading zeros may have more digits than its neighbor
    const size_t width = name[first] == '0' ? digits : 1;
    const std::string pattern =
        (fs::path(path).parent_path() /
         (name.substr(0, first) + std::string(width, '#') + name.substr(last + 1)))
            .string();
    const std::vector<int> frames = frames_on_disk(pattern);
    const auto here = std::lower_bound(frames.begin(), frames.end(), frame);
    const long there = (here - frames.begin()) + step +
                       (step > 0 && here != frames.end() && *here != frame ? -1 : 0);
    if (there < 0 || there >= long(frames.size())) return std::nullopt;
    return frame_file(pattern, frames[size_t(there)]);
}

}  // namespace velatura::compositor::window
