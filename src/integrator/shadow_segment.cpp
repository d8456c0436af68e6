// SPDX-License-Identifier: Apache-2.0
#include "integrator/shadow_segment.h"

namespace velatura::integrator {

Rgb straight_through(const shading::MaterialEvaluator& materials,
                     const geometry::SurfacePoint& point,
                     const Vec3& d,
                     float cone_width) {
    if (!materials.material_is_see_through(point.material)) return Rgb(0.0f);
    const auto passed =
        materials.make_bsdf(point, -d, cone_width).delta(shading::ScatterKind::Transmit);
    return passed && passed->eta == 1.0f ? passed->weight : Rgb(0.0f);
}

}  // namespace velatura::integrator
