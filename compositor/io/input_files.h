// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "layers/strip_reader.h"

#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// What a mix is made of.
struct InputFile {
    layers::StripReader file;
    LayerStack layout;  ///< without pixels
};

/// One file or, for one AOV in each, several as one mix: the beauty of each is a row by what tells
/// their names apart, and the file that is left without a name, or is called `beauty`, is the
/// beauty. `view`: of a stereo file. Errors: those of StripReader and LayerStack; "files-differ"
/// (also: other color spaces, unless `input_space` says what they are).
Result<InputFile> open_input(const std::vector<std::string>& paths,
                             const std::string& view = "",
                             const std::string& input_space = "");

/// The same with pixels.
Result<LayerStack> load_input(const std::vector<std::string>& paths, const std::string& view = "");

/// What tells names of files apart, by words and without extension: `shot_key.0007.exr` and
/// `shot_fill.0007.exr` are `key` and `fill`. Empty: all of its words are in the others.
std::vector<std::string> names_of_files(const std::vector<std::string>& paths);

/// True where the names differ in a number of three or more digits alone: frames, not AOVs.
bool are_frames(const std::vector<std::string>& paths);

}  // namespace io
}  // namespace velatura::compositor
