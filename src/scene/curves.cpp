// SPDX-License-Identifier: Apache-2.0
#include "scene/curves.h"

namespace velatura::scene {

size_t segment_count(Curves::Basis basis, Curves::Wrap wrap, size_t vertices) {
    using Basis = Curves::Basis;
    const bool is_periodic = wrap == Curves::Wrap::Periodic;
    switch (basis) {
        case Basis::Linear:
            if (is_periodic) return vertices >= 3 ? vertices : 0;
            return vertices >= 2 ? vertices - 1 : 0;
        case Basis::Bezier:
            if (is_periodic) return vertices % 3 == 0 ? vertices / 3 : 0;
            return vertices >= 4 && vertices % 3 == 1 ? vertices / 3 : 0;
        default:
            if (is_periodic) return vertices >= 3 ? vertices : 0;
            if (wrap == Curves::Wrap::Pinned) return vertices >= 2 ? vertices - 1 : 0;
            return vertices >= 4 ? vertices - 3 : 0;
    }
}

size_t varying_count(Curves::Basis basis, Curves::Wrap wrap, size_t vertices) {
    const size_t segments = segment_count(basis, wrap, vertices);
    return segments == 0 || wrap == Curves::Wrap::Periodic ? segments : segments + 1;
}

}  // namespace velatura::scene
