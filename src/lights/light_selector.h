// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/light_set.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::lights {

enum class SelectionKind : uint8_t { Uniform, Power };

struct SelectorOptions {
    SelectionKind kind = SelectionKind::Power;
    double uniform_part = 0.1;  ///< of Power: share of the choices made uniformly, in (0, 1]
};

/// A chosen light and the probability of that choice.
struct LightChoice {
    uint32_t light = 0;
    float pmf = 0;
};

/// Chooses one light per vertex. Lights that are off have probability zero, all others a positive
/// one. The point is part of the interface so that a light tree can take its place; the two kinds
/// at hand do not look at it.
class LightSelector {
  public:
    /// Args: scene_bounds in render space: what lights at infinity shine on; may be empty.
    LightSelector(const LightSet& lights,
                  const Box3& scene_bounds,
                  const SelectorOptions& options = {});

    bool is_empty() const { return cdf_.empty(); }

    /// Chooses by u in [0,1) for the point p; nothing when no light is on.
    std::optional<LightChoice> select(const Vec3& p, float u) const;

    /// The probability with which select() chooses the light at p: the same number, bit for bit.
    float pmf(const Vec3& p, uint32_t light) const;

  private:
    std::vector<double> cdf_;   // over the lights that are on, ends with 1
    std::vector<uint32_t> on_;  // their indices
    std::vector<float> pmf_;    // of every light
};

}  // namespace velatura::lights
