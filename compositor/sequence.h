// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <string>
#include <vector>

namespace velatura::compositor {

/// True for a name with `####` (any number of them) or `%04d` in place of a frame number.
bool is_sequence(const std::string& path);

/// The file of a frame: `shot.####.exr` → `shot.0007.exr`; numbers of more digits are written
/// whole.
std::string frame_path(const std::string& pattern, int frame);

/// Frames whose file is there, ascending.
std::vector<int> frames_on_disk(const std::string& pattern);

/// `7`, `1-100`, `1-100x2`, and lists of them, `1-10,20`. Each once, ascending.
/// Errors: "bad-frames".
Result<std::vector<int>> parse_frames(const std::string& text);

/// `1-4,7`: the frames as short as parse_frames reads them.
std::string frame_list(const std::vector<int>& frames);

}  // namespace velatura::compositor
