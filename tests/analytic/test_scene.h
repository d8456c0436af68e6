// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "hard_case.h"
#include "integrator/path_tracer.h"
#include "scene/scene.h"

#include <cstdint>
#include <functional>
#include <string>

namespace velatura::test {

/// A mean over pixels that are independent estimates of one number, with its standard error.
struct Estimate {
    double mean = 0;
    double standard_error = 0;

    /// Smallest deviation that a 4-sigma test would see with 90 % power: (4 + 1.2816) standard
    /// errors.
    double detectable() const { return 5.2816 * standard_error; }
};

/// Scenes made by hand. Camera at the render-space origin, looking along −Z.
class TestScene {
  public:
    TestScene();

    /// Lambert (or UsdPreviewSurface) material.
    scene::MaterialId add_matte(const Rgb& albedo, const Rgb& emission = Rgb(0.0f));
    scene::MaterialId add_material(const scene::Material& material);

    /// Horizontal square at z = `z`, facing +Z, centered on the axis.
    void add_square(float z, float half_size, scene::MaterialId material);
    void add_sphere(const Vec3& center, double radius, scene::MaterialId material);
    /// Closed, facing outward.
    void add_box(const Vec3& low, const Vec3& high, scene::MaterialId material);
    /// Closed ball of flat facets around the origin: no interpolated normals, whose bending would
    /// lose energy.
    void add_faceted_ball(float radius, scene::MaterialId material);

    /// Takes the last shape out of the scene and places it as an instance instead.
    void make_instance(const Mat4& render_from_prototype);

    /// Makes the last shape a light in a group of its own; returns the light to be changed.
    scene::MeshLight& make_mesh_light();

    /// A light in a group of its own; returns the light to be changed.
    scene::Light& add_light(scene::LightKind kind, const Mat4d& render_from_light);

    /// Orthographic camera that sees a window of this half size around the axis: all pixels see one
    /// point.
    void look_at_point(double half_window);
    void look_with_perspective(double half_window_at_1);

    scene::Scene scene;
};

/// Six matte walls around the camera that emit `Le`: bounce k brings Le · albedo^k, wherever one
/// looks. Rays meet twelve triangles at most: for tests that follow many bounces.
TestScene closed_room(float albedo, float Le);

/// What a rendered layer holds.
struct RenderedLayers {
    film::Film film;
    int groups = 0;
    integrator::RayCounts rays = {};

    /// Mean of channel `channel` of a (bounce column, group) cell over the pixels; group < 0 = all
    /// groups.
    Estimate bounce(int column, int group = -1, int channel = 0) const;
    Estimate beauty(int channel = 0) const;
    Estimate unoccluded(int group, int channel = 0) const;
};

struct TestRenderOptions {
    int size = 32;
    uint64_t samples = 64;
    int last_bounce = 4;
    int max_depth = 0;
    integrator::EstimatorOptions estimator = {};
    uint64_t seed = 1;
    lights::SelectionKind light_selection = lights::SelectionKind::Tree;
    integrator::Caustics caustics = integrator::Caustics::Path;
    media::MediumOptions media = {};
    sampling::SamplerKind sampler = sampling::SamplerKind::Sobol;
    bool samples_light_area = false;
    bool shadow_layers = true;  ///< every bounce samples a light for them, whatever the estimator
    const integrator::RouletteGains* roulette = nullptr;  ///< of Roulette::Efficiency
};

RenderedLayers render(const TestScene& test, const TestRenderOptions& options = {});

/// Of light that matter of depth 1e-3 scatters once, relative: few samples of every commit see as
/// much.
inline double thin_media_bound() {
    return hardcase::size() == hardcase::Size::Commit ? 2e-2 : 1e-3;
}

/// A number of renders with `seeds` seeds, where even pixels tell nothing of the error: the numbers
/// of Sobol' points are spread too well.
Estimate over_seeds(const TestScene& test,
                    TestRenderOptions options,
                    int seeds,
                    const std::function<double(const RenderedLayers&)>& number);

/// Expects |mean − expected| within 4 standard errors and within `relative` of it, and that the
/// test could see a deviation of `relative`; prints the smallest detectable error.
void expect_close(const Estimate& estimate,
                  double expected,
                  double relative,
                  const std::string& what);

/// Expects two images of one scene with independent noise to agree: the mean of their differences
/// is zero within 4 standard errors, which are below `relative` of the image's mean.
void expect_agreement(const RenderedLayers& a,
                      const RenderedLayers& b,
                      double relative,
                      const std::string& what);

/// Glass and metal that scatter without blur.
scene::Material smooth_glass(float ior = 1.5f);
scene::Material mirror(const Rgb& reflectance);

/// A translation.
Mat4d at(const Vec3d& where);

}  // namespace velatura::test
