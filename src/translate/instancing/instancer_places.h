// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"
#include "translate/motion/velocities.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace velatura::translate::instancing {

/// Where a PointInstancer puts its instances at one time; arrays are empty where there are none.
struct InstanceRows {
    std::vector<double> positions;     ///< [instance][3]
    std::vector<double> scales;        ///< [instance][3]
    std::vector<double> orientations;  ///< [instance](x, y, z, w), length not promised

    /// S · R · T of instance i, row vectors. Ref: UsdGeomPointInstancer.
    Mat4d matrix(size_t i) const;
};

/// Where things are at any time that all move by themselves.
class MovingRows {
  public:
    virtual ~MovingRows() = default;

    /// Where something has another number of elements it stays as at the frame's instant.
    virtual InstanceRows at(TimeCode time) const = 0;

    /// Times at which motion may turn, ascending, without repeats.
    virtual std::vector<double> sample_times() const = 0;
};

/// Of ascending times, from the last before the shutter opens to the first after it closes.
std::vector<double> times_seen(std::vector<double> times, const Shutter& shutter);

/// Where a PointInstancer puts its instances: by velocities from the samples at or before the
/// frame's instant if it has such for positions or orientations, else from sample to sample. Ref:
/// UsdGeomPointInstancer::ComputeInstanceTransformsAtTimes.
class InstancerPlaces final : public MovingRows {
  public:
    /// Reads what holds at the frame's instant. What does not fit the number of instances is left
    /// out with a warning.
    InstancerPlaces(Context& ctx, Prim prim, size_t instances);

    InstanceRows at(TimeCode time) const override;
    std::vector<double> sample_times() const override;

    /// Whether they may be elsewhere at another time than the frame's instant.
    bool can_move() const;

    /// Whether samples that are interpolated while the shutter is open are of other instances.
    bool is_renumbered(const Shutter& shutter) const;

  private:
    bool has_velocities() const { return velocities_ || turning_; }

    Prim prim_;
    TimeCode frame_;
    Attribute positions_, scales_, orientations_;
    InstanceRows base_;  ///< at the frame's instant, or the samples that velocities go on from
    std::optional<motion::Velocities> velocities_, turning_;
};

}  // namespace velatura::translate::instancing
