// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "geometry/surface_point.h"
#include "shading/material_evaluator.h"

#include <array>
#include <cstdint>

namespace velatura::integrator {

/// The solids that a point lies in, by their materials, in the order of their priorities and of
/// equals in the order in which it got into them. The last one is what fills the space: a solid
/// inside another displaces it. Whoever goes through a surface tells; where nothing absorbs and
/// nothing has a priority nobody need.
class Interior {
  public:
    /// Light goes from wo to wi at the surface: into the solid behind it, out of it, or neither.
    void cross(const shading::MaterialEvaluator& materials,
               const geometry::SurfacePoint& point,
               const Vec3& wo,
               const Vec3& wi);

    /// False: there are too many, and it does not count.
    bool enter(const shading::MaterialEvaluator& materials, scene::MaterialId material);
    /// Undoes the last enter() of the material; false when there was none.
    bool leave(scene::MaterialId material);

    /// What fills the space; none = nothing.
    scene::MaterialId filling() const {
        return count_ == 0 ? scene::none : solids_[size_t(count_ - 1)];
    }

    bool is_empty() const { return count_ == 0; }

    /// Leaves out the solids whose material `keeps` does not want.
    template <class Keeps>
    void keep_only(const Keeps& keeps) {
        int kept = 0;
        for (int i = 0; i < count_; ++i)
            if (keeps(solids_[size_t(i)])) solids_[size_t(kept++)] = solids_[size_t(i)];
        count_ = kept;
    }

    /// What goes no further per unit of way through what fills the space.
    Rgb extinction(const shading::MaterialEvaluator& materials) const {
        return count_ == 0 ? Rgb(0.0f) : materials.extinction(solids_[size_t(count_ - 1)]);
    }

    /// Share of light that neither is lost nor scatters within a distance [scene units], which may
    /// be infinite.
    Rgb transmittance(const shading::MaterialEvaluator& materials, float distance) const;

  private:
    /// Solids within solids beyond this many do not count.
    static constexpr int deepest = 16;

    std::array<scene::MaterialId, deepest> solids_ = {};
    int count_ = 0;
};

}  // namespace velatura::integrator
