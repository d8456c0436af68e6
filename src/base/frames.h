// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace velatura {

/// Frames of "1-10x2,15": 1 3 5 7 9 15, in the order written, each once. Frames may be fractional
/// ("1.5") and below zero ("-5--1"). Errors: "bad-frames" (syntax, step 0, more than 10^6 frames).
Result<std::vector<double>> parse_frames(std::string_view text);

/// The same, whole numbers alone and ascending: frames of files.
Result<std::vector<int>> parse_whole_frames(std::string_view text);

/// "1-4,7,-3--1": frames, ascending, as short as parse_frames reads them.
std::string frame_list(const std::vector<int>& frames);

/// True for a name of many files: one with a frame number's place. Places are `####` (a digit each,
/// more where they do not suffice), `%04d`, `%d`, `$F4`, `$F`, `<F4>`, `<F>`; of several that
/// differ the last counts, in the name of the file before those of its folders. Not one: `#` before
/// a digit (take#2), `%d` and `$F` before a letter (50%done). A file that is called like that
/// literally is that file, unless its name is plainly a pattern and frames of it are there.
bool is_sequence(const std::string& path);

/// The same, but only for names that nobody gives to a single file: `C#.exr` and `%d.exr` are none.
bool is_plainly_sequence(const std::string& path);

/// The frame that the name of a file tells: 7 of `v2/shot_v3.0007.exr`, -7 of `shot.-007.exr`.
std::optional<int> frame_in_name(const std::string& path);

/// The file of a frame: `shot.####.exr` is `shot.0007.exr`, `shot.-003.exr` or, of a fractional
/// frame, `shot.0001.500.exr`. A name that is no sequence stays as it is.
std::string frame_path(const std::string& path, double frame);

/// Frames whose file is there, ascending. Below zero `-0003` is read as well as `-003`.
std::vector<int> frames_on_disk(const std::string& path);

/// The same as frame_path for a file that is read: `-0003` where `-003` is not there.
std::string frame_file(const std::string& path, int frame);

/// The files that a name stands for: those of its frames, or it itself.
std::vector<std::string> files_of(const std::string& path);

/// With `####` in place of what stands for the frame, the one form that other programs share.
std::string with_hashes(const std::string& path);

}  // namespace velatura
