// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "integrator/path_tracer.h"
#include "integrator/world.h"
#include "lux_forms.h"
#include "scene/scene.h"
#include "usd/stage/stage.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>

namespace velatura::test {

/// Folder of luxtest among the test files; may be absent.
std::filesystem::path luxtest_folder();

/// Opens a sheet; whatever its composition has to say is a failure.
usd::stage::Stage open_stage(const std::filesystem::path& path);

/// Translates a frame; the codes of all warnings go into `warnings`, errors are failures.
scene::Scene translate_frame(const usd::stage::Stage& stage,
                             double frame,
                             std::set<std::string>& warnings);

LuxImage read_image(const std::filesystem::path& path);

/// Expects that what is seen lies between the texel and its neighbors; false where these are too
/// unlike each other to tell.
bool expect_texel(const LuxImage& image, int x, int y, const Vec3d& seen);

/// A deviation of this many standard errors is found by a test at 4 with a probability of 0.9.
inline constexpr double detectable_sigmas = 4.0 + 1.2816;

/// Some pixels of the image that see one point.
struct PixelWindow {
    int x = 0, y = 0;             ///< upper left pixel
    Vec3d position = Vec3d(0.0);  ///< world, what its middle shows
};

/// Mean radiance over a window, whose pixels are independent estimates.
struct RadianceEstimate {
    Vec3d mean = Vec3d(0.0), standard_error = Vec3d(0.0);
};

/// Direct light of one scene as its own camera sees it, in an image so fine that a window of some
/// pixels is a point. Seeds are fixed.
class FrameRenderer {
  public:
    /// The scene must outlive this.
    explicit FrameRenderer(const scene::Scene& scene);

    /// Where the plane through the world's origin with this normal shows the world point p.
    PixelWindow window_at(const Vec3d& p, const Vec3d& normal) const;

    /// A part of the image, as shares of its width and height, and what it looks along:
    /// `position` is a unit vector.
    PixelWindow window_along(double x, double y) const;

    /// Light of bounce `bounce` (0 = emission seen directly). Takes more samples until an error of
    /// `visible_error` per channel can be seen.
    RadianceEstimate measure(const PixelWindow& window,
                             int bounce,
                             const Vec3d& visible_error) const;

    /// Emission seen in a direction of the world from the camera; nullopt outside the image.
    std::optional<Vec3d> see(const Vec3d& direction) const;

  private:
    std::optional<Vec2d> pixel_of(const Vec3d& direction) const;
    Vec3d direction_of(const Vec2d& pixel) const;
    RadianceEstimate render(const PixelWindow& window, int bounce, uint64_t samples) const;

    const scene::Scene& scene_;
    film::LayerSet layers_;
    std::unique_ptr<integrator::World> world_;
    std::unique_ptr<integrator::PathTracer> tracer_;
};

/// Puts a white matte patch at `p`, relative to the camera, and compares its irradiance.
void expect_patch_irradiance(
    scene::Scene scene, const Vec3d& p, const Vec3d& n, const Vec3d& expected, double bound);

}  // namespace velatura::test
