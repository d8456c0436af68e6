// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "geometry/surface_point.h"
#include "lights/light_bounds.h"
#include "lights/light_sample.h"
#include "lights/surface_emission.h"
#include "lights/triangle_list.h"
#include "scene/scene.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace velatura::geometry {
class GeometrySet;
}

namespace velatura::shading {
class MaterialEvaluator;
}

namespace velatura::lights {

/// The triangles that light the scene, by their material or as mesh lights, ready to be sampled as
/// area lights; both sides emit.
///
/// An *item* is an emissive triangle of a shape that is placed directly, or an instance with
/// emissive triangles; its triangles are its *parts*. Instances of one prototype with one material
/// share one *group*, so that memory grows with what is stored, not with what is seen. Groups live
/// in the space of their prototype. Triangles are where they are at a time (Ray::time), bounds hold
/// all times; powers and areas are those when the shutter opens. Immutable after construction, safe
/// to share among threads; what it is made from must outlive it.
class EmissiveSurfaces {
  public:
    /// Below this solid angle [sr] triangles are sampled by area, where the density is smooth and
    /// free of cancellation.
    static constexpr double smallest_solid_angle = 1e-6;

    /// by_area: points of triangles are chosen by area, from wherever.
    EmissiveSurfaces(const scene::Scene& scene,
                     const geometry::GeometrySet& geometry,
                     const shading::MaterialEvaluator& materials,
                     const SurfaceEmission& emission,
                     bool by_area = false);

    /// Items: first the triangles placed directly, then the instances.
    uint32_t item_count() const { return direct_count() + uint32_t(instances_.size()); }

    uint32_t direct_count() const { return direct_.triangles.size(); }

    bool is_instance(uint32_t item) const { return item >= direct_count(); }

    uint32_t part_count(uint32_t item) const;

    /// Whether the triangle can contribute: it has an area.
    bool is_on(uint32_t item, uint32_t part) const;

    /// Bounds of a triangle placed directly; box and intensity in render space.
    LightBounds bounds(uint32_t item) const;

    uint32_t group_count() const { return uint32_t(groups_.size()); }

    uint32_t group_of(uint32_t item) const { return instances_[item - direct_count()].group; }

    uint32_t group_size(uint32_t group) const { return groups_[group].triangles.size(); }

    /// Bounds of one triangle of a group, in the space of the prototype.
    LightBounds part_bounds(uint32_t group, uint32_t part) const;

    /// Bounds in the space of its prototype, carried along with the instance `item`.
    LightBounds place(uint32_t item, const LightBounds& bounds) const;

    /// The instance's map from render space to the space of its prototype, at a time.
    Vec3d to_prototype(uint32_t item, const Vec3d& p, float time) const;
    /// Normal of a plane there (unit; zero stays zero): what is in front of it stays in front.
    Vec3d normal_to_prototype(uint32_t item, const Vec3d& n, float time) const;

    /// The mesh light that the item or its part is; null for surfaces that just emit.
    const scene::MeshLight* mesh_light(LightId id) const;

    /// Of the shape that the item or its part belongs to.
    scene::ProvenanceId provenance(LightId id) const;

    /// Emitted flux (luminance), about: both sides of every part. In render space.
    double power(uint32_t item) const;
    /// Of one side; of an instance as if its map kept proportions.
    double area(uint32_t item) const;
    /// Of one part of a group, in the space of the prototype.
    double part_area(uint32_t group, uint32_t part) const;
    /// As power(), of one part of a group, up to a factor common to the group.
    double part_power(uint32_t group, uint32_t part) const;

    /// Item and part of a triangle that was hit; nothing when its material does not emit.
    std::optional<LightId> find(const geometry::SurfacePoint& point) const;

    /// Samples the triangle by the solid angle that it fills as seen from p. Radiance is that of
    /// the material at the sampled point times its presence; `cone` filters textures as for a path
    /// that goes there.
    std::optional<LightSample> sample(
        LightId id, const Vec3& p, const Vec2& u, const RayCone& cone, float time) const;

    /// Density [1/sr] with which sample() finds the point q of the triangle.
    double pdf(LightId id, const Vec3& p, const Vec3& q, float time) const;

    /// What the ray o + t·d (d unit) sees of the triangle, as if nothing else were there.
    std::optional<LightHit> intersect(LightId id, const Vec3& o, const Vec3& d, float time) const;

  private:
    /// Listed triangles with the luminance that each emits on average; 0 = off.
    struct Listed {
        TriangleList triangles;
        std::vector<float> luminance;
    };

    struct Group : Listed {
        uint32_t prototype = 0;
        double power = 0;       ///< sum of part_power
        double area = 0;        ///< of the parts that are on
        uint32_t measured = 0;  ///< the instance by which the luminances are
    };

    struct InstanceItem {
        uint32_t instance = 0;
        uint32_t group = 0;
        float strength = 1;  // times the group's luminances, by mesh lights that are normalized
    };

    /// Corner and edges of a triangle in double.
    struct Triangle {
        Vec3d v0, e1, e2;

        Vec3d scaled_normal() const { return e1.cross(e2); }  ///< twice the area long
    };

    void list_direct();
    void list_instances();
    uint32_t add_group(uint32_t instance);
    float strength(const Group& group, uint32_t instance) const;
    void measure(Listed& listed, uint32_t instance) const;
    float mean_luminance(geometry::Hit place, int steps) const;
    void lift_dark_triangles(Listed& listed, uint32_t instance) const;

    geometry::Hit place_of(LightId id) const;
    Triangle triangle(const geometry::Hit& place, float time = 0) const;
    Triangle triangle(uint32_t group, uint32_t part) const;
    static LightBounds moving_bounds(const geometry::TriangleMesh& mesh,
                                     uint32_t triangle,
                                     float luminance);

    const scene::Scene& scene_;
    const geometry::GeometrySet& geometry_;
    const shading::MaterialEvaluator& materials_;
    const SurfaceEmission& emission_;
    double smallest_;  ///< solid angle that is sampled as such
    Listed direct_;
    std::vector<Group> groups_;
    std::vector<InstanceItem> instances_;
    std::vector<uint32_t> item_of_instance_;  // [instance], none = does not emit; empty = none does
};

}  // namespace velatura::lights
