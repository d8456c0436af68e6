// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "layers/layer_header.h"
#include "layers/strip_reader.h"

#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace velatura::compositor {
inline namespace io {

/// A file of another renderer as rows of the mixer: each color layer is a row, and `rest` is the
/// beauty minus all rows. Data layers (pass_names.h) and integers are no rows. Light that rows or
/// the beauty contain already (sums of rows, passes beside the beauty of a file that is a row) is
/// data, whose entry names in `of` the layer that contains it.
struct ForeignLayers {
    layers::LayerHeader header;  ///< rows as groups, layers of family "plain" or "data", no closure
    /// `R` … `A` of the beauty, `row.R` …; without a beauty `A` is that of the first row.
    std::unordered_map<std::string, layers::ChannelRef> channels;
    std::unordered_map<std::string, std::vector<layers::ChannelRef>> data;  ///< by layer
    std::vector<std::string> views;  ///< none where the file has only one
    std::string view;                ///< that of the layers
    std::vector<std::string> notes;  ///< choices that were made, as text
};

/// Files that were opened together: the beauty of each is a layer with the name of the file; of a
/// file without a name it is the beauty of all.
struct ForeignInputs {
    std::vector<std::string> names;
    std::vector<size_t> of_part;  ///< the file of each part
};

/// The beauty is `R G B` of the first part that has them bare, else a layer `Combined`, `rgba` or
/// `beauty`; of a file with light layers alone it is their sum. `view`: of a stereo file; empty
/// takes the first. Errors: "not-layers" (no colors that could be a beauty), "unknown-view".
Result<ForeignLayers> foreign_layers(const image::Image& image,
                                     const std::string& view = "",
                                     const ForeignInputs* files = nullptr);

}  // namespace io
}  // namespace velatura::compositor
