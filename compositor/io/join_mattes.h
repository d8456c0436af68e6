// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/image.h"
#include "layers/cryptomatte.h"

#include <span>
#include <string>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// What a file brings to joined Cryptomattes.
struct MatteInput {
    std::string path;
    image::Image image;  ///< its channels of Cryptomattes
    std::vector<layers::Cryptomatte> mattes;
    /// [height][width]: how much the file hides of those behind it, in [0, 1].
    std::vector<float> alpha;
    std::vector<std::string> notes;  ///< for people, without the name of the file
};

/// Reads the Cryptomattes of a file of this or another renderer, and the alpha of its beauty; of a
/// file without one the sum of its mattes. Errors: "io-open", "io-read", "matte-layer" (none of its
/// Cryptomattes has channels).
Result<MatteInput> read_mattes(const std::string& path);

struct JoinedMattes {
    image::Image image;              ///< a part per Cryptomatte, over all that the files cover
    std::vector<std::string> notes;  ///< for people: ids of two names, names of two ids
};

/// The Cryptomattes of files that are composited with `over`, the first in front: what a file
/// covers is scaled by the product of 1 − alpha of those before it. Layers of one kind are one,
/// with the name that they have in the front file; names are those of all files. Args: levels: ids
/// stored per pixel, in [1, 64]; 0: as many as the files have together. Errors: "files-differ"
/// (other display windows).
Result<JoinedMattes> join_mattes(std::span<const MatteInput> front_to_back, int levels = 0);

}  // namespace io
}  // namespace velatura::compositor
