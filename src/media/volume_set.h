// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "media/flight.h"
#include "media/medium.h"
#include "sampling/random_stream.h"
#include "scene/affine_motion.h"
#include "scene/linking.h"
#include "scene/scene.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::media {

/// What went wrong on the path through media.
struct TrackingCounts {
    uint64_t violations = 0;  ///< extinctions above their bound; see VolumeSet
    uint64_t capped = 0;      ///< ways that were cut because of too many meetings

    TrackingCounts& operator+=(const TrackingCounts& o) {
        violations += o.violations;
        capped += o.capped;
        return *this;
    }
};

/// All participating media of a scene.
///
/// Rays meet each medium at the points of a Poisson process whose rate is a bound of the extinction
/// in the brick that they go through. A meeting is a collision with the probability extinction over
/// rate, else nothing (Woodcock et al. 1965). Media that overlap are met each by its own process,
/// in the order along the ray: the first collision is then that of the sum. Where channels differ,
/// one process serves all: meetings are decided by the channels' extinctions weighed by what the
/// path carries, and the weights keep the mean of each, also where a bound were too low
/// (Galtier et al. 2013; Kutz et al. 2017, "Spectral and Decomposition Tracking").
/// Transmittance is the expectation of getting through by the part above the least extinction of
/// each brick (Novák et al. 2014, "Residual Ratio Tracking"), times what is known without chance.
class VolumeSet {
  public:
    /// Media of the volumes whose grids were read. The scene must outlive the set.
    explicit VolumeSet(const scene::Scene& scene, const MediumOptions& options = {});

    bool is_empty() const { return media_.empty(); }

    const Box3& bounds() const { return bounds_; }  ///< render space, at all times

    /// Whether some medium moves while the shutter is open.
    bool has_motion() const { return !motions_.empty(); }

    /// Follows light along o + t·d, d unit, until t_max, which may be infinite, or until it
    /// collides. carried: by the path, for the choice of events where channels differ.
    /// around: whatever else fills the space; goes no further than that. visible: what the light
    /// meets; null: all. time: of the ray, where media move. Writes `out` anew.
    void fly(const Vec3& o,
             const Vec3& d,
             float t_max,
             const Rgb& carried,
             const FreePath& around,
             sampling::RandomStream numbers,
             Flight& out,
             TrackingCounts& counts,
             const scene::LinkSet* visible = nullptr,
             float time = 0) const;

    /// Share of light that gets from o to o + t_max·d: an estimate with that mean, in [0, 1] but
    /// for rare survivors of roulette in thick media. casters: what may take light; null: all.
    Rgb transmittance(const Vec3& o,
                      const Vec3& d,
                      float t_max,
                      const scene::LinkSet* casters,
                      sampling::RandomStream& numbers,
                      TrackingCounts& counts,
                      float time = 0) const;

  private:
    /// A ray as a medium meets it where that was made.
    struct CarriedRay {
        Vec3 o, d;
    };

    /// Nothing: the medium is flat at that time.
    std::optional<CarriedRay> carried_ray(size_t medium,
                                          const Vec3& o,
                                          const Vec3& d,
                                          float time) const;

    std::vector<Medium> media_;
    std::vector<scene::AffineMotion> motions_;  ///< [medium]; empty: none moves
    Box3 bounds_;
};

}  // namespace velatura::media
