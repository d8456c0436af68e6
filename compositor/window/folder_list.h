// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::compositor::window {

/// What a folder offers to open.
struct FolderList {
    std::string folder;                ///< absolute
    std::vector<std::string> folders;  ///< names, sorted; hidden ones left out
    std::vector<std::string> files;    ///< names that end in the extension, sorted
};

/// A folder that cannot be read is an empty one.
FolderList list_folder(const std::string& folder, std::string_view extension);

/// False for a path that cannot be looked at as well: too long, or below a closed folder.
bool is_folder(const std::string& path);

/// `path` as it is, or seen from `folder` where it is relative; `~/` is the home.
std::string path_in(const std::string& folder, const std::string& path);

/// With the extension if it has none.
std::string with_extension(const std::string& path, std::string_view extension);

/// The file of a sequence (`shot.####.exr`) that is opened first: that of the frame if it is there,
/// else the first on the disk. A file that exists, or a path of none, is itself.
std::string file_to_open(const std::string& path, std::optional<double> frame);

/// The frame that is `step` frames on the disk after (before, if negative) a file like
/// `shot.0007.exr`: the last number of its name is that of the frame. None: there is no such file.
std::optional<std::string> frame_beside(const std::string& path, int step);

}  // namespace velatura::compositor::window
