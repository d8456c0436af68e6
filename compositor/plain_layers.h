// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "image/layer_header.h"
#include "image/strip_reader.h"

#include <string>
#include <unordered_map>

namespace velatura::compositor {

/// A file of another renderer as rows of a mixer: each colour layer is a row that it is a part of
/// the beauty, `rest` is what is left of the beauty without them. Names of data (albedo, normals,
/// Cycles' colour passes, Cryptomatte …) make no rows.
struct PlainLayers {
    image::LayerHeader header;  ///< rows as groups, layers of family "plain" or "data", no closure
    /// `R` … `A` of the beauty, `row.R` …
    std::unordered_map<std::string, image::ChannelPlace> channels;
};

/// The beauty is `R G B` of the first part that has them bare, else a layer `Combined`, `rgba` or
/// `beauty`. Errors: "not-layers" (no colours that could be a beauty).
Result<PlainLayers> plain_layers(const image::Image& image);

}  // namespace velatura::compositor
