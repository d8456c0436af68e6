// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/mesh.h"

#include <cstddef>

namespace velatura::scene {

/// Number of segments of a curve of so many vertices; 0: no such curve. Pinned wrapping is
/// nonperiodic where the curve meets its end points anyway. Ref: UsdGeomBasisCurves.
size_t segment_count(Curves::Basis basis, Curves::Wrap wrap, size_t vertices);

/// Number of values of a varying primvar on such a curve: one at each end of a segment, those of
/// neighbors shared.
size_t varying_count(Curves::Basis basis, Curves::Wrap wrap, size_t vertices);

}  // namespace velatura::scene
