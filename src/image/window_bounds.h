// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/window.h"

#include <algorithm>

namespace velatura::image {

/// Whether all pixels of `inner` are in `outer`.
inline bool contains(const Window& outer, const Window& inner) {
    return inner.x0 >= outer.x0 && inner.x1 <= outer.x1 && inner.y0 >= outer.y0 &&
           inner.y1 <= outer.y1;
}

/// The smallest window that holds both.
inline Window united(const Window& a, const Window& b) {
    return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

}  // namespace velatura::image
