// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "lights/environment_image.h"
#include "sampling/distribution.h"
#include "scene/light.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::lights {

/// Bilinear lookup between texel centers; uv in [0,1]², (0,0) = upper left corner of the image;
/// edges are held.
Rgb bilinear_clamped(const EnvironmentImage& image, const Vec2d& uv);

/// Mean luminance of all texels, each counted alike.
float mean_luminance(const EnvironmentImage& image);

/// Sets NaN, infinite and negative texels to zero; returns how many there were.
size_t remove_bad_texels(EnvironmentImage& image);

/// A latlong image of what an image of another layout shows, of twice its height; LatLong and
/// Automatic come back as they are. Layouts: see README.md.
EnvironmentImage to_latlong(EnvironmentImage image, scene::DomeFormat format);

/// A latlong environment around the origin: pole +Y; left edge at longitude +180°, longitude 0 =
/// +Z, +90° = +X; top edge at latitude +90°. Radiance is bilinear between texel centers (wrapping
/// around, held at the poles). Directions are sampled from the bilinear interpolant of luminance ·
/// sinθ itself, so density and radiance agree inside texels too.
class EnvironmentMap {
  public:
    struct Sample {
        Vec3d direction;  ///< unit
        Rgb radiance;
        double pdf = 0;  ///< [1/sr]
    };

    /// Args: image not empty, finite, not negative. compensate_mis: see LightSetOptions.
    EnvironmentMap(EnvironmentImage image, bool compensate_mis);

    bool is_black() const { return !(total_ > 0.0); }

    /// Luminance averaged over the sphere.
    double mean_luminance() const { return mean_luminance_; }

    /// Part of the light that exceeds the mean, which MIS compensation leaves to sample(); 1
    /// without.
    double sampled_share() const { return sampled_share_; }

    /// What is seen in a unit direction, and the density with which sample() draws it.
    struct View {
        Rgb radiance;
        double pdf = 0;  ///< [1/sr]
    };

    View view(const Vec3d& direction) const;
    std::optional<Sample> sample(const Vec2& u) const;

    /// Probability with which sample() falls between the centers of the texels `column`, the next
    /// one to the right (around the map), row − 1 and row; row 0 and row `height` reach from the
    /// poles to the first and last centers.
    double cell_probability(size_t column, size_t row) const { return cells_.pmf(column, row); }

  private:
    /// The four texels around uv and where uv lies between them.
    struct Patch {
        size_t x0, x1, y0, y1;
        double fx, fy;
    };

    Patch patch_at(const Vec2d& uv) const;
    Rgb lookup(const Patch& patch) const;
    double pdf_at(const Vec2d& uv, Patch patch, double sin_theta) const;
    double weight(size_t x, size_t y) const;
    double interpolated_weight(const Patch& patch) const;
    double measure_mean() const;
    double mean_sine() const;
    double build(double floor);
    /// [1/sr] in a cell: what its probability leaves for this place, so that the density is that of
    /// the samples in the dimmest cell beside the brightest sun.
    double density(const Patch& patch, size_t column, size_t row, double sin_theta) const;

    EnvironmentImage image_;
    std::vector<double> row_sine_;  // sinθ at the texel centers
    double mean_luminance_ = 0;
    double sampled_share_ = 1;
    double floor_ = 0;  // luminance subtracted for MIS compensation
    double total_ = 0;  // integral of the interpolated weight over the unit square of uv
    sampling::Distribution2D cells_;  // [height + 1][width], between texel centers
};

}  // namespace velatura::lights
