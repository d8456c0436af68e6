// SPDX-License-Identifier: Apache-2.0
#include "lights/surface_emission.h"

#include "geometry/geometry_set.h"
#include "lights/emitter.h"
#include "lights/length_of.h"
#include "scene/effect_calls.h"
#include "shading/material_evaluator.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace velatura::lights {

namespace {

/// Area of one side of a mesh under an affine map.
double area_of(const geometry::TriangleMesh& mesh, const Mat4d& m) {
    const Mat3d cofactors = cofactor_matrix(m);
    double sum = 0.0;
    for (uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const Vec3d v0(mesh.corner(i, 0));
        const Vec3d e1 = Vec3d(mesh.corner(i, 1)) - v0, e2 = Vec3d(mesh.corner(i, 2)) - v0;
        const Vec3d n = e1.cross(e2) * cofactors;
        sum += 0.5 * std::sqrt(n.dot(n));
    }
    return sum;
}

}  // namespace

SurfaceEmission::SurfaceEmission(const scene::Scene& scene,
                                 const geometry::GeometrySet& geometry,
                                 const shading::MaterialEvaluator& materials,
                                 const GobosOfLight& gobos,
                                 Diagnostics& diagnostics)
    : scene_(scene), geometry_(geometry), materials_(materials) {
    if (scene.mesh_lights.empty()) return;
    lacks_area_.assign(scene.mesh_lights.size(), false);
    place_direct(gobos);
    place_instances(gobos);
    for (uint32_t light = 0; light < lacks_area_.size(); ++light)
        if (lacks_area_[light]) warn_without_area(light, diagnostics);
}

void SurfaceEmission::warn_without_area(uint32_t light, Diagnostics& diagnostics) const {
    const scene::MeshLight& l = scene_.mesh_lights[light];
    SourceLoc loc;
    if (l.provenance < scene_.provenance.size()) loc = scene_.provenance[l.provenance].loc;
    diagnostics.warn("light-without-size", loc, l.name,
                     "normalized light emits nothing where its geometry has no area");
}

SurfaceEmission::Placed SurfaceEmission::place(uint32_t light,
                                               double area,
                                               const Mat4d& render_from_parent,
                                               const scene::AffineMotion& motion,
                                               const GobosOfLight& gobos) {
    const scene::MeshLight& l = scene_.mesh_lights[light];
    Placed out;
    out.light = light;
    out.Le = l.Le;
    if (l.is_normalized) {
        for (int c = 0; c < 3; ++c) out.Le[c] = float(double(l.Le[c]) / area);
        // Written so that NaN, of no strength on no area, is caught
        if (!(area > 0.0) || !is_finite(out.Le)) {
            out.Le = Rgb(0.0f);
            lacks_area_[light] = true;
        }
    }
    const LightShaping shaping(l.shaping, l.parent_from_light * render_from_parent);
    if (shaping.is_active()) {
        out.shaping = uint32_t(shapings_.size());
        shapings_.push_back({shaping, float(shaping.mean_over_sphere())});
    }
    if (!l.filters.empty()) {
        FilterChain filters(l.filters, render_from_parent, gobos(l));
        if (!filters.is_empty()) {
            out.filters = uint32_t(filters_.size());
            filters_.push_back(std::move(filters));
        }
    }
    const bool is_directed = out.shaping != scene::none || out.filters != scene::none;
    if (motion.moves() && is_directed) {
        out.motion = uint32_t(motions_.size());
        motions_.push_back(motion);
    }
    return out;
}

void SurfaceEmission::place_direct(const GobosOfLight& gobos) {
    of_shape_.assign(scene_.shapes.size(), scene::none);
    for (uint32_t shape = 0; shape < scene_.shapes.size(); ++shape) {
        const scene::MeshLightId light = scene_.shapes[shape].light;
        if (light == scene::none) continue;
        of_shape_[shape] = uint32_t(placed_.size());
        const scene::MeshLight& l = scene_.mesh_lights[light];
        const scene::AffineMotion motion(l.parent_from_light, l.later_parent_from_light);
        placed_.push_back(
            place(light, area_of(geometry_.shapes()[shape], Mat4d()), Mat4d(), motion, gobos));
    }
}

/// How shaping and filters of a mesh light move with an instance, and in it.
scene::AffineMotion SurfaceEmission::motion_of(size_t instance, uint32_t light) const {
    const scene::Instance& placed = scene_.instances[instance];
    const scene::MeshLight& l = scene_.mesh_lights[light];
    const size_t segments =
        std::max(placed.later_render_from_prototype.size(), l.later_parent_from_light.size());
    if (segments == 0) return {};
    const scene::AffineMotion within(l.parent_from_light, l.later_parent_from_light);
    const auto at = [&](size_t key) {
        const double time = double(key) / double(segments);
        return l.parent_from_light * within.at(time).to_render *
               Mat4d(geometry::render_from_prototype(placed, float(time)));
    };
    std::vector<Mat4d> later;
    for (size_t key = 1; key <= segments; ++key) later.push_back(at(key));
    return scene::AffineMotion(at(0), later);
}

void SurfaceEmission::place_instances(const GobosOfLight& gobos) {
    struct Lamp {
        uint32_t shape;
        scene::MeshLightId light;
        double area;  // in the prototype
    };

    std::vector<std::vector<Lamp>> lamps(scene_.prototypes.size());
    slot_.resize(scene_.prototypes.size());
    for (size_t p = 0; p < lamps.size(); ++p) {
        const std::vector<scene::Shape>& shapes = scene_.prototypes[p].shapes;
        for (uint32_t shape = 0; shape < shapes.size(); ++shape) {
            if (shapes[shape].light == scene::none) continue;
            slot_[p].resize(shapes.size(), scene::none);
            slot_[p][shape] = uint32_t(lamps[p].size());
            lamps[p].push_back(
                {shape, shapes[shape].light, area_of(geometry_.prototypes()[p][shape], Mat4d())});
        }
    }
    of_instance_.assign(scene_.instances.size(), scene::none);
    for (size_t i = 0; i < scene_.instances.size(); ++i) {
        const uint32_t p = scene_.instances[i].prototype;
        if (lamps[p].empty()) continue;
        of_instance_[i] = uint32_t(placed_.size());
        const Mat4d m(scene_.instances[i].render_from_prototype);
        const bool keeps_shapes = is_similarity(m);
        for (const Lamp& lamp : lamps[p]) {
            const double area = keeps_shapes ? lamp.area * std::cbrt(sqr(determinant3(m)))
                                             : area_of(geometry_.prototypes()[p][lamp.shape], m);
            placed_.push_back(place(lamp.light, area, m, motion_of(i, lamp.light), gobos));
        }
    }
}

const SurfaceEmission::Placed* SurfaceEmission::find(uint32_t instance, uint32_t shape) const {
    if (placed_.empty()) return nullptr;
    if (instance == scene::none) {
        const uint32_t at = of_shape_[shape];
        return at == scene::none ? nullptr : &placed_[at];
    }
    const std::vector<uint32_t>& slots = slot_[scene_.instances[instance].prototype];
    if (slots.empty() || slots[shape] == scene::none) return nullptr;
    return &placed_[of_instance_[instance] + slots[shape]];
}

bool SurfaceEmission::has_any() const {
    return materials_.has_emission() || !placed_.empty();
}

const scene::MeshLight* SurfaceEmission::light(uint32_t instance, uint32_t shape) const {
    const Placed* placed = find(instance, shape);
    return placed ? &scene_.mesh_lights[placed->light] : nullptr;
}

bool SurfaceEmission::can_light(uint32_t instance,
                                uint32_t shape,
                                scene::MaterialId material) const {
    const Placed* placed = find(instance, shape);
    if (!placed) return materials_.is_emissive(material);
    if (is_black(placed->Le)) return false;
    return !scene_.mesh_lights[placed->light].is_tinted_by_emission ||
           materials_.is_emissive(material);
}

bool SurfaceEmission::can_emit(const geometry::SurfacePoint& point) const {
    const bool glows = materials_.is_emissive(point.material);
    const Placed* placed = find(point.instance, point.shape);
    if (!placed || !is_black(placed->Le)) return placed || glows;
    return glows && scene_.mesh_lights[placed->light].shows_material;
}

Rgb SurfaceEmission::radiance(const geometry::SurfacePoint& point,
                              const Vec3& wo,
                              float footprint,
                              EmissionReceiver emission_receiver,
                              const Vec3* filtered_for) const {
    const Placed* placed = find(point.instance, point.shape);
    scene::count_call(placed ? scene::Effect::MeshLights : scene::Effect::SurfaceEmission);
    if (!placed) return materials_.emission(point, wo, footprint);
    const scene::MeshLight& l = scene_.mesh_lights[placed->light];
    if (emission_receiver == EmissionReceiver::Camera && l.shows_material)
        return materials_.emission(point, wo, footprint);
    Rgb Le = unshaped(*placed, point, wo, footprint);
    if (placed->motion != scene::none)
        return Le * directed(*placed, motions_[placed->motion], point, wo, filtered_for);
    if (placed->shaping != scene::none) Le *= shapings_[placed->shaping].shaping.factor(Vec3d(wo));
    if (placed->filters == scene::none || !filtered_for) return Le;
    const Vec3d p(*filtered_for);
    const double distance = length_of(Vec3d(point.p) - p);
    return filters_[placed->filters].apply(Le, {p, Vec3d(-wo), distance});
}

/// What shaping and filters of a light that moves leave, asked where they stood when the shutter
/// opened.
Rgb SurfaceEmission::directed(const Placed& placed,
                              const scene::AffineMotion& motion,
                              const geometry::SurfacePoint& point,
                              const Vec3& wo,
                              const Vec3* filtered_for) const {
    const scene::AffineMotion::Pose pose = motion.at(double(point.time));
    if (!(pose.volume > 0.0)) return Rgb(0.0f);
    Rgb left(1.0f);
    if (placed.shaping != scene::none)
        left *= shapings_[placed.shaping].shaping.factor(
            normalize(transform_direction(Vec3d(wo), pose.to_made)));
    if (placed.filters == scene::none || !filtered_for) return left;
    const Vec3d p = transform_point(Vec3d(*filtered_for), pose.to_made);
    const Vec3d way = transform_point(Vec3d(point.p), pose.to_made) - p;
    const double distance = length_of(way);
    return filters_[placed.filters].apply(left, {p, way / distance, distance});
}

Rgb SurfaceEmission::mean_radiance(const geometry::SurfacePoint& point, float footprint) const {
    const Placed* placed = find(point.instance, point.shape);
    if (!placed) return materials_.emission(point, point.ng, footprint);
    Rgb Le = unshaped(*placed, point, point.ng, footprint);
    if (placed->shaping != scene::none) Le *= shapings_[placed->shaping].mean;
    return placed->filters == scene::none ? Le : Le * float(filters_[placed->filters].peak());
}

Rgb SurfaceEmission::unshaped(const Placed& placed,
                              const geometry::SurfacePoint& point,
                              const Vec3& wo,
                              float footprint) const {
    const bool is_tinted = scene_.mesh_lights[placed.light].is_tinted_by_emission;
    return is_tinted ? placed.Le * materials_.emission(point, wo, footprint) : placed.Le;
}

bool SurfaceEmission::is_constant(uint32_t instance,
                                  uint32_t shape,
                                  scene::MaterialId material) const {
    const Placed* placed = find(instance, shape);
    if (placed && !scene_.mesh_lights[placed->light].is_tinted_by_emission) return true;
    return material >= scene_.materials.size() ||
           scene_.materials[material].emissive_color.source == scene::Input::Source::Constant;
}

double SurfaceEmission::ratio(uint32_t instance, uint32_t other, uint32_t shape) const {
    const Placed* a = find(instance, shape);
    const Placed* b = find(other, shape);
    if (!a || !b) return 1.0;
    const double of_b = double(luminance(b->Le));
    return of_b > 0.0 ? double(luminance(a->Le)) / of_b : 1.0;
}

}  // namespace velatura::lights
