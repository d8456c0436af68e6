// SPDX-License-Identifier: Apache-2.0
#include "lights/emissive_surfaces.h"

#include "base/box.h"
#include "base/tasks.h"
#include "geometry/geometry_set.h"
#include "lights/emitter.h"
#include "lights/length_of.h"
#include "lights/spherical_triangle.h"
#include "shading/material_evaluator.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

namespace velatura::lights {
namespace {

using geometry::Hit;

/// Share of a shape's power by which its triangles that look black are chosen all the same, since
/// a texture may hide a spot from a few lookups.
constexpr double dark_share = 0.02;
/// Luminance that the triangles of a shape are taken to have when all of them look black.
constexpr double min_luminance = 0x1p-20;

/// Steps along each side of a triangle when its texture is averaged: many for few triangles.
int lookup_steps(size_t triangles) {
    if (triangles <= 1024) return 8;
    return triangles <= 65536 ? 4 : 2;
}

/// Primvars that emission depends on, of those that instances hand down.
std::vector<scene::PrimvarId> emission_primvars(const scene::Scene& scene) {
    std::vector<scene::PrimvarId> names;
    for (const scene::InstanceValue& value : scene.instance_values) names.push_back(value.name);
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    std::erase_if(names, [&](scene::PrimvarId name) {
        return std::none_of(scene.materials.begin(), scene.materials.end(), [&](const auto& m) {
            return scene::reads_primvar(scene, m.emissive_color, name);
        });
    });
    return names;
}

template <class MayLight>
void list_triangles(TriangleList& list,
                    uint32_t shape,
                    const geometry::TriangleMesh& mesh,
                    MayLight can_light) {
    std::vector<uint32_t> emissive;
    const uint32_t count = uint32_t(mesh.triangle_count());
    for (uint32_t i = 0; i < count; ++i)
        if (can_light(i)) emissive.push_back(i);
    list.add(shape, std::move(emissive), count);
}

}  // namespace

EmissiveSurfaces::EmissiveSurfaces(const scene::Scene& scene,
                                   const geometry::GeometrySet& geometry,
                                   const shading::MaterialEvaluator& materials,
                                   const SurfaceEmission& emission,
                                   bool by_area)
    : scene_(scene),
      geometry_(geometry),
      materials_(materials),
      emission_(emission),
      smallest_(by_area ? std::numeric_limits<double>::infinity() : smallest_solid_angle) {
    if (!emission.has_any()) return;
    list_direct();
    list_instances();
}

void EmissiveSurfaces::list_direct() {
    for (uint32_t shape = 0; shape < geometry_.shapes().size(); ++shape) {
        const geometry::TriangleMesh& mesh = geometry_.shapes()[shape];
        list_triangles(direct_.triangles, shape, mesh, [&](uint32_t triangle) {
            return emission_.can_light(scene::none, shape, mesh.material(triangle));
        });
    }
    measure(direct_, scene::none);
}

void EmissiveSurfaces::list_instances() {
    // Prototype, override and the values that emission reads → group; a group without triangles
    // is not kept
    std::map<std::vector<uint32_t>, uint32_t> groups;
    const std::vector<scene::PrimvarId> read = emission_primvars(scene_);
    for (uint32_t i = 0; i < scene_.instances.size(); ++i) {
        const scene::Instance& instance = scene_.instances[i];
        if (!geometry_.instances()[i].is_invertible) continue;
        std::vector<uint32_t> key{instance.prototype, instance.material_override};
        for (const scene::PrimvarId name : read) {
            const scene::InstanceValue* value = scene::find_value(scene_, instance, name);
            if (value == nullptr) continue;
            key.push_back(name);
            for (const float v : value->values) key.push_back(std::bit_cast<uint32_t>(v));
        }
        const auto [at, is_new] = groups.try_emplace(key, scene::none);
        if (is_new) at->second = add_group(i);
        if (at->second == scene::none) continue;
        if (item_of_instance_.empty())
            item_of_instance_.assign(scene_.instances.size(), scene::none);
        item_of_instance_[i] = item_count();
        instances_.push_back({i, at->second, strength(groups_[at->second], i)});
    }
}

/// How much stronger the instance shines than the one that its group was measured by.
float EmissiveSurfaces::strength(const Group& group, uint32_t instance) const {
    if (instance == group.measured || scene_.mesh_lights.empty()) return 1.0f;
    // The strongest of its shapes stands for all: what none shines may not be lost
    double max = 0.0;
    const uint32_t shapes = uint32_t(scene_.prototypes[group.prototype].shapes.size());
    for (uint32_t shape = 0; shape < shapes; ++shape)
        if (emission_.light(instance, shape))
            max = std::max(max, emission_.ratio(instance, group.measured, shape));
    return max > 0.0 && std::isfinite(max) ? float(max) : 1.0f;
}

/// The emissive triangles of an instance as a new group; none when it has none.
uint32_t EmissiveSurfaces::add_group(uint32_t instance) {
    const scene::Instance& placed = scene_.instances[instance];
    const auto& meshes = geometry_.prototypes()[placed.prototype];
    Group group;
    group.prototype = placed.prototype;
    for (uint32_t shape = 0; shape < meshes.size(); ++shape) {
        list_triangles(group.triangles, shape, meshes[shape], [&](uint32_t triangle) {
            const bool is_overridden = placed.material_override != scene::none;
            return emission_.can_light(
                instance, shape,
                is_overridden ? placed.material_override : meshes[shape].material(triangle));
        });
    }
    group.measured = instance;
    if (group.triangles.size() == 0) return scene::none;
    measure(group, instance);
    groups_.push_back(std::move(group));
    const uint32_t index = uint32_t(groups_.size() - 1);
    Group& added = groups_[index];
    for (uint32_t part = 0; part < group_size(index); ++part) {
        added.power += part_power(index, part);
        if (added.luminance[part] > 0.0f) added.area += part_area(index, part);
    }
    return index;
}

/// Fills Listed::luminance as the given instance shows the triangles.
void EmissiveSurfaces::measure(Listed& listed, uint32_t instance) const {
    const uint32_t count = listed.triangles.size();
    listed.luminance.assign(count, 0.0f);
    const int steps = lookup_steps(count);
    parallel_for(
        count,
        [&](size_t i) {
            const TriangleList::Entry entry = listed.triangles[uint32_t(i)];
            listed.luminance[i] =
                mean_luminance({0.0f, 0.0f, 0.0f, instance, entry.shape, entry.triangle}, steps);
        },
        256);
    lift_dark_triangles(listed, instance);
}

/// Luminance that a triangle emits, presence included, averaged over its area: deterministic. Less
/// than zero when the triangle cannot emit.
float EmissiveSurfaces::mean_luminance(Hit place, int steps) const {
    const Triangle t = triangle(place);
    const double area = 0.5 * length_of(t.scaled_normal());
    if (!(area > 0.0) || !std::isfinite(area)) return -1.0f;
    geometry::SurfacePoint point = geometry::make_surface_point(scene_, geometry_, {}, place);
    const bool is_constant = emission_.is_constant(point.instance, point.shape, point.material) &&
                             !materials_.material_has_presence(point.material);
    const int n = is_constant ? 1 : steps;
    const float footprint = is_constant ? 0.0f : float(std::sqrt(area) / n);
    double sum = 0.0;
    for (int i = 0; i < n * n; ++i) {
        const Vec2 u((float(i % n) + 0.5f) / float(n), (float(i / n) + 0.5f) / float(n));
        const Vec2d b = sample_triangle_area(u);
        place.b1 = float(b.x);
        place.b2 = float(b.y);
        point = geometry::make_surface_point(scene_, geometry_, {}, place);
        const Rgb Le = emission_.mean_radiance(point, footprint);
        sum += double(luminance(Le)) * double(materials_.presence(point, footprint));
    }
    return float(std::min(sum / (n * n), double(std::numeric_limits<float>::max())));
}

/// Gives triangles that look black a little of their shape's luminance, and those that cannot emit
/// none: whatever may emit can be chosen.
void EmissiveSurfaces::lift_dark_triangles(Listed& listed, uint32_t instance) const {
    const uint32_t count = listed.triangles.size();
    for (uint32_t first = 0, end = 0; first < count; first = end) {
        const uint32_t shape = listed.triangles[first].shape;
        double flux = 0.0, all_area = 0.0;
        for (end = first; end < count; ++end) {
            const TriangleList::Entry entry = listed.triangles[end];
            if (entry.shape != shape) break;
            if (listed.luminance[end] < 0.0f) continue;
            const Triangle t = triangle({0, 0, 0, instance, entry.shape, entry.triangle});
            const double area = 0.5 * length_of(t.scaled_normal());
            all_area += area;
            flux += area * double(listed.luminance[end]);
        }
        const double mean = all_area > 0.0 ? flux / all_area : 0.0;
        const double min = mean > 0.0 ? dark_share * mean : min_luminance;
        const float lifted = std::max(float(min), std::numeric_limits<float>::min());
        for (uint32_t i = first; i < end; ++i) {
            const bool can_emit = listed.luminance[i] >= 0.0f;
            listed.luminance[i] = can_emit ? std::max(listed.luminance[i], lifted) : 0.0f;
        }
    }
}

Hit EmissiveSurfaces::place_of(LightId id) const {
    Hit place;
    const TriangleList* list = &direct_.triangles;
    uint32_t number = id.index;
    if (is_instance(id.index)) {
        const InstanceItem& item = instances_[id.index - direct_count()];
        place.instance = item.instance;
        list = &groups_[item.group].triangles;
        number = id.part;
    }
    const TriangleList::Entry entry = (*list)[number];
    place.shape = entry.shape;
    place.triangle = entry.triangle;
    return place;
}

/// In render space.
EmissiveSurfaces::Triangle EmissiveSurfaces::triangle(const Hit& place, float time) const {
    const geometry::TriangleMesh& mesh = geometry_.mesh(place);
    Vec3d v[3];
    for (int k = 0; k < 3; ++k) v[k] = Vec3d(mesh.corner(place.triangle, k, time));
    if (place.instance == scene::none) return {v[0], v[1] - v[0], v[2] - v[0]};
    // Edges go through the map as directions: no cancellation far from the origin
    const Mat4d forward(geometry::render_from_prototype(scene_.instances[place.instance], time));
    return {transform_point(v[0], forward), transform_direction(v[1] - v[0], forward),
            transform_direction(v[2] - v[0], forward)};
}

/// In the space of the prototype.
EmissiveSurfaces::Triangle EmissiveSurfaces::triangle(uint32_t group, uint32_t part) const {
    const TriangleList::Entry entry = groups_[group].triangles[part];
    const auto& mesh = geometry_.prototypes()[groups_[group].prototype][entry.shape];
    Vec3d v[3];
    for (int k = 0; k < 3; ++k) v[k] = Vec3d(mesh.corner(entry.triangle, k));
    return {v[0], v[1] - v[0], v[2] - v[0]};
}

uint32_t EmissiveSurfaces::part_count(uint32_t item) const {
    return is_instance(item) ? group_size(group_of(item)) : 1;
}

bool EmissiveSurfaces::is_on(uint32_t item, uint32_t part) const {
    return is_instance(item) ? groups_[group_of(item)].luminance[part] > 0.0f
                             : direct_.luminance[item] > 0.0f;
}

namespace {

/// Bounds of a flat emitter of both sides.
LightBounds bounds_of(const Vec3d& v0, const Vec3d& e1, const Vec3d& e2, float luminance) {
    LightBounds bounds;
    bounds.box.extendBy(v0);
    bounds.box.extendBy(v0 + e1);
    bounds.box.extendBy(v0 + e2);
    const Vec3d n = e1.cross(e2);
    if (n != Vec3d(0.0)) bounds.cone.axis = normalize(n);
    bounds.cone.normals = 0.0;
    bounds.cone.spread = pi_d / 2.0;
    bounds.cone.is_two_sided = true;
    bounds.cone.intensity = 0.5 * length_of(n) * double(luminance);
    return bounds;
}

}  // namespace

/// Of a triangle of a mesh that moves by its points, at all times, in the space of the mesh.
LightBounds EmissiveSurfaces::moving_bounds(const geometry::TriangleMesh& mesh,
                                            uint32_t triangle,
                                            float luminance) {
    const uint32_t segments = mesh.segments();
    LightBounds out;
    std::vector<Vec3d> normals;
    Vec3d e1_before(0.0), e2_before(0.0);
    double largest = 0.0;
    for (uint32_t key = 0; key <= segments; ++key) {
        const float time = float(key) / float(segments);
        Vec3d v[3];
        for (int k = 0; k < 3; ++k) {
            v[k] = Vec3d(mesh.corner(triangle, k, time));
            out.box.extendBy(v[k]);
        }
        const Vec3d e1 = v[1] - v[0], e2 = v[2] - v[0];
        // Edges go straight on, so that between keys the normal is a sum of these three
        if (key > 0) normals.push_back(e1_before.cross(e2) + e1.cross(e2_before));
        normals.push_back(e1.cross(e2));
        largest = std::max(largest, length_of(normals.back()));
        e1_before = e1;
        e2_before = e2;
    }
    out.cone = cone_around(normals, true);
    out.cone.spread = pi_d / 2.0;
    out.cone.intensity = 0.5 * largest * double(luminance);
    return out;
}

LightBounds EmissiveSurfaces::bounds(uint32_t item) const {
    const Hit place = place_of(LightId(item));
    const geometry::TriangleMesh& mesh = geometry_.mesh(place);
    if (mesh.segments() > 0) return moving_bounds(mesh, place.triangle, direct_.luminance[item]);
    const Triangle t = triangle(place);
    return bounds_of(t.v0, t.e1, t.e2, direct_.luminance[item]);
}

LightBounds EmissiveSurfaces::part_bounds(uint32_t group, uint32_t part) const {
    const TriangleList::Entry entry = groups_[group].triangles[part];
    const auto& mesh = geometry_.prototypes()[groups_[group].prototype][entry.shape];
    const float luminance = groups_[group].luminance[part];
    if (mesh.segments() > 0) return moving_bounds(mesh, entry.triangle, luminance);
    const Triangle t = triangle(group, part);
    return bounds_of(t.v0, t.e1, t.e2, luminance);
}

LightBounds EmissiveSurfaces::place(uint32_t item, const LightBounds& bounds) const {
    const scene::Instance& instance = scene_.instances[instances_[item - direct_count()].instance];
    const Mat4d m(instance.render_from_prototype);
    LightBounds placed;
    placed.box = transformed(bounds.box, m);
    placed.cone = bounds.cone;
    placed.cone.intensity *=
        std::cbrt(sqr(determinant3(m))) * double(instances_[item - direct_count()].strength);
    // Normals keep their angles under similarities only, but a single normal has none
    const Vec3d axis = bounds.cone.axis * cofactor_matrix(m);
    if (axis != Vec3d(0.0)) placed.cone.axis = normalize(axis);
    if (placed.cone.normals > 0.0 && !is_similarity(m)) placed.cone.normals = pi_d;
    const std::vector<Mat4>& later = instance.later_render_from_prototype;
    if (later.empty()) return placed;
    // Corners move straight on in render space, whatever the box around them does
    Box3d box = placed.box;
    const std::vector<Mat4d> keys(later.begin(), later.end());
    for (const Mat4d& key : keys) box.extendBy(transformed(bounds.box, key));
    placed = carried(placed, scene::AffineMotion(m, keys));
    placed.box = box;
    return placed;
}

Vec3d EmissiveSurfaces::to_prototype(uint32_t item, const Vec3d& p, float time) const {
    const uint32_t instance = instances_[item - direct_count()].instance;
    std::optional<geometry::InstanceTransform> storage;
    return transform_point(p, geometry_.instance(instance, time, storage).prototype_from_render);
}

Vec3d EmissiveSurfaces::normal_to_prototype(uint32_t item, const Vec3d& n, float time) const {
    const uint32_t instance = instances_[item - direct_count()].instance;
    const Mat4 m = geometry::render_from_prototype(scene_.instances[instance], time);
    Vec3d out(0.0);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) out[i] += double(m[i][j]) * n[j];
    return out != Vec3d(0.0) ? normalize(out) : out;
}

double EmissiveSurfaces::power(uint32_t item) const {
    if (!is_instance(item)) return 2.0 * pi_d * bounds(item).cone.intensity;
    const InstanceItem& placed = instances_[item - direct_count()];
    const Mat4d m(geometry_.instances()[placed.instance].render_from_prototype);
    return groups_[placed.group].power * std::cbrt(sqr(determinant3(m))) * double(placed.strength);
}

const scene::MeshLight* EmissiveSurfaces::mesh_light(LightId id) const {
    if (scene_.mesh_lights.empty()) return nullptr;
    const Hit place = place_of(id);
    return emission_.light(place.instance, place.shape);
}

scene::ProvenanceId EmissiveSurfaces::provenance(LightId id) const {
    const Hit place = place_of(id);
    if (place.instance == scene::none) return scene_.shapes[place.shape].provenance;
    const scene::Instance& instance = scene_.instances[place.instance];
    return scene_.prototypes[instance.prototype].shapes[place.shape].provenance;
}

double EmissiveSurfaces::area(uint32_t item) const {
    if (!is_instance(item))
        return 0.5 * length_of(triangle(place_of(LightId(item))).scaled_normal());
    const InstanceItem& placed = instances_[item - direct_count()];
    const Mat4d m(geometry_.instances()[placed.instance].render_from_prototype);
    return groups_[placed.group].area * std::cbrt(sqr(determinant3(m)));
}

double EmissiveSurfaces::part_area(uint32_t group, uint32_t part) const {
    return 0.5 * length_of(triangle(group, part).scaled_normal());
}

double EmissiveSurfaces::part_power(uint32_t group, uint32_t part) const {
    return 2.0 * pi_d * part_area(group, part) * double(groups_[group].luminance[part]);
}

std::optional<LightId> EmissiveSurfaces::find(const geometry::SurfacePoint& point) const {
    if (point.instance == scene::none) {
        const uint32_t number = direct_.triangles.find(point.shape, point.triangle);
        if (number == TriangleList::not_listed) return std::nullopt;
        return LightId(number);
    }
    if (item_of_instance_.empty()) return std::nullopt;
    const uint32_t item = item_of_instance_[point.instance];
    if (item == scene::none) return std::nullopt;
    const uint32_t part = groups_[group_of(item)].triangles.find(point.shape, point.triangle);
    if (part == TriangleList::not_listed) return std::nullopt;
    return LightId(item, part);
}

namespace {

/// Solid angle of a triangle as seen from p, 0 where it cannot be told from edge on: a point of the
/// triangle's own plane must not see it, on whichever side rounding has put the point.
double visible_solid_angle(const TriangleView& view, const Vec3& p) {
    const Vec3d n = view.e1.cross(view.e2);
    double rounding = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double own = std::abs(view.a[i]) + std::abs(view.e1[i]) + std::abs(view.e2[i]);
        rounding += std::abs(n[i]) * (0x1p-22 * std::abs(double(p[i])) + 0x1p-45 * own);
    }
    return view.triple() > rounding ? solid_angle(view) : 0.0;
}

/// Density of a point at distance d on the triangle, given the solid angle that it fills and the
/// smallest one that is sampled as such.
double density(const TriangleView& view, double omega, double d, double smallest) {
    if (omega >= smallest) return 1.0 / omega;
    // d² / (cosine · area); height over the plane and area are parts of the triple product
    return 2.0 * d * (d * d) / view.triple();
}

}  // namespace

std::optional<LightSample> EmissiveSurfaces::sample(
    LightId id, const Vec3& p, const Vec2& u, const RayCone& cone, float time) const {
    Hit place = place_of(id);
    const Triangle t = triangle(place, time);
    const TriangleView view{t.v0 - Vec3d(p), t.e1, t.e2};
    const double omega = visible_solid_angle(view, p);
    if (!(omega > 0.0)) return std::nullopt;
    const Vec2d b =
        omega >= smallest_ ? sample_solid_angle(view, omega, u) : sample_triangle_area(u);
    const Vec3d to_light = view.a + t.e1 * b.x + t.e2 * b.y;
    const double d = length_of(to_light);
    if (!(d > 0.0)) return std::nullopt;

    LightSample s;
    s.wi = to_float(to_light / d);
    s.distance = float(d);
    s.pdf = float(density(view, omega, d, smallest_));
    if (!std::isfinite(s.pdf) || !(s.pdf > 0.0f)) return std::nullopt;
    place.t = s.distance;
    place.b1 = float(b.x);
    place.b2 = float(b.y);
    geometry::Ray ray{p, s.wi};
    ray.time = time;
    geometry::SurfacePoint point = geometry::make_surface_point(scene_, geometry_, ray, place);
    const float footprint = cone.width + cone.spread * s.distance;
    s.Le = emission_.radiance(point, -s.wi, footprint, EmissionReceiver::Scattering, &p) *
           materials_.presence(point, footprint);
    s.is_surface = true;
    // The direction of a ray to there is rounded by its own length, not by that of the position
    for (int i = 0; i < 3; ++i) point.p_error[i] += 0x1p-23f * std::abs(p[i] - point.p[i]);
    s.target = geometry::offset_ray_origin(point, p - point.p);
    return s;
}

double EmissiveSurfaces::pdf(LightId id, const Vec3& p, const Vec3& q, float time) const {
    const Triangle t = triangle(place_of(id), time);
    const TriangleView view{t.v0 - Vec3d(p), t.e1, t.e2};
    const double omega = visible_solid_angle(view, p);
    return omega > 0.0 ? density(view, omega, length_of(Vec3d(q) - Vec3d(p)), smallest_) : 0.0;
}

std::optional<LightHit> EmissiveSurfaces::intersect(LightId id,
                                                    const Vec3& o,
                                                    const Vec3& d,
                                                    float time) const {
    Hit place = place_of(id);
    const Triangle t = triangle(place, time);
    const TriangleView view{t.v0 - Vec3d(o), t.e1, t.e2};
    const double omega = visible_solid_angle(view, o);
    if (!(omega > 0.0)) return std::nullopt;
    const Vec3d w = normalize(Vec3d(d)), n = t.scaled_normal();
    const double det = w.dot(n);
    const double distance = view.a.dot(n) / det;
    const double x = w.dot(t.e2.cross(view.a)) / det, y = w.dot(view.a.cross(t.e1)) / det;
    if (!(distance > 0.0) || !(x >= 0.0) || !(y >= 0.0) || !(x + y <= 1.0)) return std::nullopt;
    place.b1 = float(x);
    place.b2 = float(y);
    geometry::Ray ray{o, d};
    ray.time = time;
    const geometry::SurfacePoint point =
        geometry::make_surface_point(scene_, geometry_, ray, place);
    const Rgb Le = emission_.radiance(point, -d, 0.0f, EmissionReceiver::Scattering, &o) *
                   materials_.presence(point, 0.0f);
    return LightHit{id.index, float(distance), Le,
                    float(density(view, omega, distance, smallest_))};
}

}  // namespace velatura::lights
