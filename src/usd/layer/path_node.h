// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/path.h"

#include <cstdint>

namespace velatura::usd::layer {

/// One interned element of a path and, through its parent, everything before it.
struct Path::Node {
    const Node* parent = nullptr;
    PathKind kind = PathKind::Empty;
    bool is_absolute = false;
    bool has_variant = false;
    bool has_target = false;
    uint32_t depth = 0;  ///< elements below the root element
    Token name;
    Token variant;
    Path target;
};

}  // namespace velatura::usd::layer
