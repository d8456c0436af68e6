// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/open_layer.h"

#include "base/check.h"

#include <string>
#include <utility>

namespace velatura::usd::stage {

Result<Stage> open_layer(std::shared_ptr<layer::Layer> root,
                         StageOptions options,
                         Diagnostics& diagnostics) {
    VELATURA_CHECK(root && !options.made_layer, "one layer in memory is the root layer");
    const std::string name = root->identifier();
    options.made_layer = std::move(root);
    return Stage::open(name, options, diagnostics);
}

}  // namespace velatura::usd::stage
