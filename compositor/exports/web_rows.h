// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "compositor/io/layer_stack.h"
#include "compositor/look/controls.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace velatura::compositor::exports {

/// What the page's faders are and which layers they need. Cells count as in Selection
/// (look/row_names.h): bounce by bounce, in each all groups.
struct WebRows {
    /// families: of each its `terms` {plane, cell}, in the order in which they are added up.
    /// rows: `lights`, `bounces`, `grid` {groups, columns}, `shadows`, `casters`.
    /// targets: for each name of a control the cells, shadows or casters that it stands for.
    /// look: exposure, display, view, rows and controls, each with its value as numbers.
    nlohmann::ordered_json data;
    std::vector<std::string> layers;  ///< that the page stores: a plane each
    std::vector<size_t> unity;        ///< of them, those whose sum is the render
};

/// `family`: as WebOptions::layers. Errors: those of plan_mix, "export-matte", "export-clamp",
/// "mix-not-stored".
Result<WebRows> web_rows(const LayerStack& stack, const Look& look, const std::string& family);

}  // namespace velatura::compositor::exports
