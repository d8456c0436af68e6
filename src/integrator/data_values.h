// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/layer_set.h"
#include "film/sample_radiance.h"
#include "integrator/motion_vectors.h"
#include "integrator/world.h"

#include <optional>
#include <vector>

namespace velatura::integrator {

/// Fills the named data layers of camera samples.
class DataValues {
  public:
    DataValues(const World& world, const film::LayerSet& layers);

    bool is_empty() const { return layers_.empty(); }

    /// Of the first surface.
    void record_surface(const geometry::SurfacePoint& point,
                        const Vec3& ns,
                        const Rgb& albedo,
                        film::SampleRadiance& out) const;

    /// Of the first collision in a volume.
    void record_collision(const Vec3& p, const Rgb& albedo, film::SampleRadiance& out) const;

    /// Of a ray that meets nothing: what is infinitely far moves with the camera.
    void record_background(const Vec3& direction, film::SampleRadiance& out) const;

    /// Of a sample that meets a catcher.
    void record_catcher(film::SampleRadiance& out) const;

    /// Whether the background has values.
    bool has_background() const { return motion_.has_value(); }

  private:
    static constexpr int all_groups = -1;

    struct Layer {
        accumulate::DataSource source;
        scene::PrimvarId primvar = scene::none;
        int group = all_groups;
    };

    const World& world_;
    std::vector<Layer> layers_;
    std::optional<MotionVectors> motion_;
};

}  // namespace velatura::integrator
