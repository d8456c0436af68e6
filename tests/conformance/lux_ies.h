// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace velatura::test {

/// The table of an IES file of luxtest as it is written, in degrees, looked up by folding angles
/// into it.
class LuxIes {
  public:
    explicit LuxIes(const std::filesystem::path& file);

    /// The intensity [candela], linear between angles; the horizontal one in [0, 360].
    double at(double vertical, double horizontal) const;

    /// Its mean over the sphere, or over a hemisphere, by sums over 0.1° x 0.5°.
    double mean() const;

    /// What a light of that angleScale shines with at an angle off its axis. UsdLux ShapingAPI.
    double scaled(double vertical, double horizontal, double angle_scale) const;

  private:
    double folded(double horizontal) const;

    std::vector<double> vertical_, horizontal_;
    std::vector<std::vector<double>> rows_;
};

}  // namespace velatura::test
