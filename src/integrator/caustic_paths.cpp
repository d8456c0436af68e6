// SPDX-License-Identifier: Apache-2.0
#include "integrator/caustic_paths.h"

#include "integrator/tracer_context.h"

#include <algorithm>

namespace velatura::integrator {

namespace {

/// How much light a material passes on by narrow lobes, very roughly, in [0, 1].
double narrow_weight(const scene::Material& m) {
    if (m.is_bare || m.hair) return 0.0;
    const auto can_be_narrow = [](const scene::Input& roughness) {
        return !scene::is_constant(roughness) ||
               roughness.value.x * roughness.value.x <= shading::narrow_lobe_alpha;
    };
    const bool transmits = scene::can_transmit(m) && !m.thin_walled &&
                           (!m.rough_transmission || can_be_narrow(m.roughness));
    return transmits ? 1.0 : reflected_weight(m, can_be_narrow);
}

std::vector<double> narrow_weights(const World& world) {
    std::vector<double> weights;
    for (scene::MaterialId m = 0; m < world.scene.materials.size(); ++m) {
        // Of coincident faces of solids with priorities one scatters, and it depends on the side
        const bool has_priority = world.nested && world.materials.bounds_solid(m);
        weights.push_back(has_priority ? 0.0 : narrow_weight(world.scene.materials[m]));
    }
    return weights;
}

bool can_be_taken(const scene::Light& light) {
    // Domes may be sampled by what compensates for BSDF sampling, not for all of their light
    return light.kind != scene::LightKind::Dome;
}

}  // namespace

bool CausticPaths::can_exist(const scene::Scene& scene) {
    return std::any_of(scene.lights.begin(), scene.lights.end(), can_be_taken) &&
           std::any_of(scene.materials.begin(), scene.materials.end(),
                       [](const scene::Material& m) { return narrow_weight(m) > 0.0; });
}

namespace {

/// Casters beyond these would take too much memory: 16 bytes per triangle, 64 per placed shape.
constexpr size_t max_triangles = size_t(1) << 24, max_placed_shapes = size_t(1) << 20;

bool has_too_many_shapes(const World& world) {
    size_t placed = world.geometry.shapes().size();
    for (const geometry::InstanceTransform& i : world.geometry.instances())
        placed += world.geometry.prototypes()[i.prototype].size();
    return placed > max_placed_shapes || world.geometry.triangle_count() > max_triangles;
}

}  // namespace

std::string CausticPaths::why_not(const World& world, const PathTracerOptions& options) {
    if (world.volumes || world.interior_media) return "the scene has volumes or interior media";
    if (world.materials.has_dispersion()) return "some solid is dispersive";
    if (world.tells_rays_apart)
        return "some geometry is a matte or a catcher, or is invisible to some kinds of rays";
    if (world.has_custom_shadows) return "a light has shadow linking or UsdLuxShadowAPI settings";
    if (world.has_lobe_multipliers) return "a light has diffuse or specular multipliers";
    if (options.estimator.light_sampling != LightSampling::Mis ||
        options.estimator.specular_chains_only)
        return "it is part of the default integrator only";
    if (has_too_many_shapes(world))
        return "the scene has more than 16 million triangles or a million placed shapes";
    return {};
}

CausticPaths::CausticPaths(const World& world) : casters_(world, narrow_weights(world)) {
    for (uint32_t i = 0; i < world.lights.size(); ++i) {
        const bool takes = world.lights.is_on(i) && can_be_taken(world.lights.light(i));
        takes_light_.push_back(takes);
        has_light_ = has_light_ || takes;
    }
}

}  // namespace velatura::integrator
