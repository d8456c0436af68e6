// SPDX-License-Identifier: Apache-2.0
#include "integrator/specular_casters.h"

#include <algorithm>
#include <cmath>

namespace velatura::integrator {

namespace {

/// Shapes that a direction chooses among by distance; each is drawn by area.
constexpr int caster_candidates = 4;

double square(double x) {
    return x * x;
}

/// The part of a number in [0, 1).
float fraction(float x) {
    const float f = x - std::floor(x);
    return f < 1.0f ? f : 0.0f;
}

/// See SpecularCasters::weight.
double material_weight(const World& world, scene::MaterialId id) {
    const scene::Material& m = world.scene.materials[id];
    using scene::is_constant;
    if (!is_constant(m.normal) || !is_constant(m.ior)) return 0.0;
    if (m.is_bare) return 0.0;
    // Chains know of no wavelengths
    if (world.materials.is_dispersive(id)) return 0.0;
    // What is behind a boundary of solids with priorities is not known to chains
    if (world.nested && world.materials.bounds_solid(id)) return 0.0;
    const auto can_be_smooth = [&](const scene::Input& roughness) {
        return !is_constant(roughness) ||
               square(double(roughness.value.x)) < double(shading::specular_switch_alpha);
    };
    // Light passes thin walls straight: that is no part of a chain, what they reflect is
    if (world.materials.bounds_solid(id)) {
        // Only an interface that reflects blurs what it transmits (Bsdf::wants_rough_transmission)
        const double ior = double(m.ior.value.x);
        const double turn =
            square(double(m.roughness.value.x)) * std::abs(1.0 - ior) / std::max(ior, 1.0);
        const bool reflects =
            m.has_specular &&
            (m.use_specular_workflow || (is_constant(m.metallic) && m.metallic.value.x < 1.0f));
        const bool is_blurred = m.rough_transmission && is_constant(m.roughness) && reflects &&
                                turn >= double(shading::specular_switch_alpha);
        if (!is_blurred) return 1.0;
    }
    return reflected_weight(m, can_be_smooth);
}

std::vector<double> material_weights(const World& world) {
    std::vector<double> weights;
    for (scene::MaterialId m = 0; m < world.scene.materials.size(); ++m)
        weights.push_back(material_weight(world, m));
    return weights;
}

}  // namespace

SpecularCasters::SpecularCasters(const World& world)
    : world_(world), shapes_(world, material_weights(world)) {}

double SpecularCasters::half_angle_of(const BoundingSphere& light) const {
    constexpr size_t max = 256;
    const size_t step = (shapes_.casters().size() + max - 1) / max;
    double largest = 0;
    for (size_t i = 0; i < shapes_.casters().size(); i += step) {
        const BoundingSphere& caster = shapes_.casters()[i].sphere;
        const Vec3d away = caster.center - light.center;
        largest = std::max(largest, light.radius2 / std::max(away.dot(away), caster.radius2));
    }
    return std::sqrt(largest);
}

BoundingSphere SpecularCasters::sphere() const {
    Box3d box;
    for (const CasterShapes::Caster& c : shapes_.casters()) {
        const Vec3d reach(std::sqrt(c.sphere.radius2));
        box.extendBy(c.sphere.center - reach);
        box.extendBy(c.sphere.center + reach);
    }
    return sphere_around(box);
}

Vec3d SpecularCasters::direction_from(
    const Vec3d& x, float time, const Vec2& u, float u_piece, const Vec2& v) const {
    size_t candidates[caster_candidates];
    double sums[caster_candidates], sum = 0;
    for (int i = 0; i < caster_candidates; ++i) {
        const auto draw =
            shapes_.choice().sample(fraction(u.x + float(i) / float(caster_candidates)));
        candidates[i] = draw.index;
        const CasterShapes::Caster& c = shapes_.casters()[draw.index];
        const Vec3d away = c.sphere.center - x;
        sum += 1.0 / (away.dot(away) + c.sphere.radius2);
        sums[i] = sum;
    }
    int chosen = 0;
    while (chosen + 1 < caster_candidates && double(u.y) * sum >= sums[chosen]) ++chosen;

    // Of a caster all around most of the area is far aside
    const CasterShapes::Caster& caster = shapes_.casters()[candidates[chosen]];
    const Vec3d away = caster.sphere.center - x;
    if (away.dot(away) < square(0.5) * caster.sphere.radius2) {
        if (u_piece < 0.5f) {
            const double z = 1.0 - 2.0 * double(v.x), r = safe_sqrt(1.0 - z * z),
                         turn = 2.0 * pi_d * double(v.y);
            return Vec3d(r * std::cos(turn), r * std::sin(turn), z);
        }
        u_piece = 2.0f * u_piece - 1.0f;
    }
    const Vec3d to_point = point_on(caster, time, u_piece, v) - x;
    const double length = to_point.length();
    return length > 0.0 ? to_point / length : Vec3d(0.0);
}

/// A point of a caster at a time, by area.
Vec3d SpecularCasters::point_on(const CasterShapes::Caster& caster,
                                float time,
                                float u_piece,
                                const Vec2& u) const {
    const geometry::TriangleMesh& mesh = shapes_.mesh(caster);
    const auto piece = uint32_t(shapes_.choice_in(caster).sample(u_piece).index);
    Vec3d p;
    if (mesh.primitives()) {
        p = mesh.primitives()->point(piece, Vec2d(u));
    } else {
        const double root = std::sqrt(double(u.x));
        const double b1 = root * (1.0 - double(u.y)), b2 = root * double(u.y);
        const auto corner = [&](int k) { return Vec3d(mesh.corner(piece, k, time)); };
        p = corner(0) * (1.0 - b1 - b2) + corner(1) * b1 + corner(2) * b2;
    }
    if (caster.instance == scene::none) return p;
    const scene::Instance& instance = world_.scene.instances[caster.instance];
    return transform_point(p, Mat4d(geometry::render_from_prototype(instance, time)));
}

}  // namespace velatura::integrator
