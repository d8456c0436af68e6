// SPDX-License-Identifier: Apache-2.0
#include "integrator/specular_casters.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

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
    const auto is_constant = [](const scene::Input& i) {
        return i.source == scene::Input::Source::Constant;
    };
    if (!is_constant(m.normal) || !is_constant(m.ior)) return 0.0;
    if (m.is_bare) return 0.0;
    // What is behind a boundary of solids with priorities is not known to chains
    if (world.nested && world.materials.bounds_solid(id)) return 0.0;
    const auto can_be_smooth = [&](const scene::Input& roughness) {
        return !is_constant(roughness) ||
               square(double(roughness.value.x)) < double(shading::specular_switch_alpha);
    };
    // What passes is worth more than what a dielectric reflects
    constexpr double dielectric_reflection = 0.04;
    double weight = 0.0;
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
        if (!is_blurred) weight = 1.0;
    }
    if (m.has_specular && can_be_smooth(m.roughness)) {
        const double metallic = is_constant(m.metallic) ? double(m.metallic.value.x) : 1.0;
        const double specular = !m.use_specular_workflow ? 0.0
                                : is_constant(m.specular_color)
                                    ? double(max_component(m.specular_color.value))
                                    : 1.0;
        weight = std::max({weight, dielectric_reflection, metallic, specular});
    }
    const bool has_coat = !is_constant(m.clearcoat) || m.clearcoat.value.x > 0.0f;
    if (has_coat && can_be_smooth(m.clearcoat_roughness))
        weight = std::max(weight, dielectric_reflection);
    return std::min(weight, 1.0);
}

}  // namespace

BoundingSphere sphere_around(const Box3d& box) {
    const Vec3d half = (box.max - box.min) * 0.5;
    return {box.min + half, half.dot(half)};
}

SpecularCasters::SpecularCasters(const World& world) : world_(world) {
    for (scene::MaterialId m = 0; m < world.scene.materials.size(); ++m)
        weights_.push_back(material_weight(world, m));
    std::vector<double> weights;
    // keys: of the placement
    const auto add = [&](uint32_t instance, uint32_t shape, const geometry::TriangleMesh& mesh,
                         uint32_t pieces, std::span<const Mat4d> keys) {
        if (pieces == scene::none) return;
        // Weight over the mesh's own area, times how much the transform enlarges areas about
        const double area = pieces_[pieces].integral() * double(pieces_[pieces].size());
        if (!(area > 0.0)) return;
        const Box3 local = mesh.bounds();
        Box3d box;
        double enlarged = 0;
        for (const Mat4d& forward : keys) {
            enlarged = std::max(enlarged, square(std::cbrt(std::abs(determinant3(forward)))));
            for (int i = 0; i < 8; ++i) {
                const Vec3 corner(i & 1 ? local.max.x : local.min.x,
                                  i & 2 ? local.max.y : local.min.y,
                                  i & 4 ? local.max.z : local.min.z);
                box.extendBy(transform_point(Vec3d(corner), forward));
            }
        }
        if (!(enlarged > 0.0)) return;
        const BoundingSphere sphere = sphere_around(box);
        casters_.push_back({instance, shape, pieces, sphere});
        weights.push_back(area * enlarged);
    };
    const geometry::GeometrySet& geometry = world_.geometry;
    for (uint32_t s = 0; s < geometry.shapes().size(); ++s) {
        const geometry::TriangleMesh& mesh = geometry.shapes()[s];
        const Mat4d stays;
        add(scene::none, s, mesh, add_pieces(mesh, scene::none), {&stays, 1});
    }
    // Placements of one shape with one material share its pieces
    std::map<std::pair<std::pair<uint32_t, uint32_t>, scene::MaterialId>, uint32_t> known;
    for (uint32_t i = 0; i < geometry.instances().size(); ++i) {
        const scene::Instance& instance = world_.scene.instances[i];
        std::vector<Mat4d> keys = {Mat4d(instance.render_from_prototype)};
        for (const Mat4& key : instance.later_render_from_prototype) keys.emplace_back(key);
        if (keys.size() == 1 && !geometry.instances()[i].is_invertible) continue;
        const auto& shapes = geometry.prototypes()[instance.prototype];
        const scene::MaterialId override = instance.material_override;
        for (uint32_t s = 0; s < shapes.size(); ++s) {
            const auto key = std::make_pair(std::make_pair(instance.prototype, s), override);
            auto found = known.find(key);
            if (found == known.end())
                found = known.emplace(key, add_pieces(shapes[s], override)).first;
            add(i, s, shapes[s], found->second, keys);
        }
    }
    // By area, but half of it in equal shares: a bead beside a lake must be found, too
    double total = 0;
    for (const double w : weights) total += w;
    for (double& w : weights) w = 0.5 * w / total + 0.5 / double(weights.size());
    choice_ = sampling::Distribution1D(std::span<const double>(weights));
}

/// Returns: an index into pieces_, or none.
uint32_t SpecularCasters::add_pieces(const geometry::TriangleMesh& mesh,
                                     scene::MaterialId override) {
    const geometry::PrimitiveSet* primitives = mesh.primitives();
    // The largest one at the keys of its motion and halfway between
    const auto area = [&](uint32_t i) {
        if (primitives) return primitives->area(i);
        double largest = 0;
        for (uint32_t k = 0; k <= 2 * mesh.segments(); ++k) {
            const float time = k == 0 ? 0.0f : float(k) / float(2 * mesh.segments());
            const Vec3d c0(mesh.corner(i, 0, time)), c1(mesh.corner(i, 1, time)),
                c2(mesh.corner(i, 2, time));
            largest = std::max(largest, 0.5 * (c1 - c0).cross(c2 - c0).length());
        }
        return largest;
    };
    // Most meshes cast nothing, and need no memory
    const size_t count = primitives ? primitives->size() : mesh.triangle_count();
    std::vector<double> weights;
    for (uint32_t i = 0; i < count; ++i) {
        const double of_material = weight(override != scene::none ? override : mesh.material(i));
        if (!(of_material > 0.0)) continue;
        weights.resize(count);
        weights[i] = of_material * area(i);
    }
    if (weights.empty()) return scene::none;
    pieces_.emplace_back(std::span<const double>(weights));
    return uint32_t(pieces_.size() - 1);
}

double SpecularCasters::half_angle_of(const BoundingSphere& light) const {
    constexpr size_t max = 256;
    const size_t step = (casters_.size() + max - 1) / max;
    double largest = 0;
    for (size_t i = 0; i < casters_.size(); i += step) {
        const BoundingSphere& caster = casters_[i].sphere;
        const Vec3d away = caster.center - light.center;
        largest = std::max(largest, light.radius2 / std::max(away.dot(away), caster.radius2));
    }
    return std::sqrt(largest);
}

BoundingSphere SpecularCasters::sphere() const {
    Box3d box;
    for (const Caster& c : casters_) {
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
        const auto draw = choice_.sample(fraction(u.x + float(i) / float(caster_candidates)));
        candidates[i] = draw.index;
        const Caster& c = casters_[draw.index];
        const Vec3d away = c.sphere.center - x;
        sum += 1.0 / (away.dot(away) + c.sphere.radius2);
        sums[i] = sum;
    }
    int chosen = 0;
    while (chosen + 1 < caster_candidates && double(u.y) * sum >= sums[chosen]) ++chosen;

    // Of a caster all around most of the area is far aside
    const Caster& caster = casters_[candidates[chosen]];
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
Vec3d SpecularCasters::point_on(const Caster& caster,
                                float time,
                                float u_piece,
                                const Vec2& u) const {
    const bool is_instanced = caster.instance != scene::none;
    const geometry::GeometrySet& geometry = world_.geometry;
    const geometry::TriangleMesh& mesh =
        is_instanced
            ? geometry.prototypes()[geometry.instances()[caster.instance].prototype][caster.shape]
            : geometry.shapes()[caster.shape];
    const auto piece = uint32_t(pieces_[caster.pieces].sample(u_piece).index);
    Vec3d p;
    if (mesh.primitives()) {
        p = mesh.primitives()->point(piece, Vec2d(u));
    } else {
        const double root = std::sqrt(double(u.x));
        const double b1 = root * (1.0 - double(u.y)), b2 = root * double(u.y);
        const auto corner = [&](int k) { return Vec3d(mesh.corner(piece, k, time)); };
        p = corner(0) * (1.0 - b1 - b2) + corner(1) * b1 + corner(2) * b2;
    }
    if (!is_instanced) return p;
    const scene::Instance& instance = world_.scene.instances[caster.instance];
    return transform_point(p, Mat4d(geometry::render_from_prototype(instance, time)));
}

}  // namespace velatura::integrator
