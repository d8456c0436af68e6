// SPDX-License-Identifier: Apache-2.0
#include "brute_force.h"

#include "accel/make_query.h"
#include "geometry/motion.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace velatura::accel::test {

namespace {

using Shapes = std::vector<TriangleSoupView>;

// Corner of a triangle that moves, at both ends of the segment.
struct Way {
    Vec3 from, to;
};

Way way_of(const TriangleSoupView& shape, uint32_t vertex, uint32_t segment) {
    return {segment == 0 ? shape.positions[vertex] : shape.later_positions[segment - 1][vertex],
            shape.later_positions[segment][vertex]};
}

// Whether the triangle is there in the segment.
bool is_usable(const TriangleSoupView& shape, size_t triangle, uint32_t segment) {
    for (const uint32_t vertex : shape.triangles[triangle]) {
        const Way way = way_of(shape, vertex, segment);
        if (!accel::is_usable(way.from) || !accel::is_usable(way.to)) return false;
    }
    return true;
}

// Those that move, where they are at that time.
template <class Body>
void for_each_moving_triangle(const Shapes& shapes, float time, const Body& body) {
    for (size_t s = 0; s < shapes.size(); ++s) {
        const TriangleSoupView& shape = shapes[s];
        if (shape.segments() == 0) continue;
        const auto at = geometry::motion_time(time, shape.segments());
        for (size_t i = 0; i < shape.triangles.size(); ++i) {
            if (!is_usable(shape, i, at.segment)) continue;
            Vec3 p[3];
            const size_t corners[3] = {0, shape.second(), shape.third()};
            for (size_t k = 0; k < 3; ++k) {
                const Way way = way_of(shape, shape.triangles[i][corners[k]], at.segment);
                p[k] = geometry::moved(way.from, way.to, at.f);
            }
            if (!is_degenerate(p[0], p[1], p[2])) body(uint32_t(s), uint32_t(i), p[0], p[1], p[2]);
        }
    }
}

// Those that do not.
template <class Body>
void for_each_triangle(const Shapes& shapes, const Body& body) {
    for (size_t s = 0; s < shapes.size(); ++s) {
        if (shapes[s].segments() > 0) continue;
        for (size_t i = 0; i < shapes[s].triangles.size(); ++i) {
            const auto& v = shapes[s].triangles[i];
            const auto& p = shapes[s].positions;
            const size_t second = v[shapes[s].second()], third = v[shapes[s].third()];
            if (!is_degenerate(p[v[0]], p[second], p[third])) {
                body(uint32_t(s), uint32_t(i), p[v[0]], p[second], p[third]);
            }
        }
    }
}

// Bodies of primitives are tested one by one, too.
template <class Body>
void for_each_primitive(const Shapes& shapes, const Body& body) {
    for (size_t s = 0; s < shapes.size(); ++s) {
        const geometry::PrimitiveSet* set = shapes[s].primitives.get();
        for (uint32_t i = 0; set && i < set->size(); ++i) {
            Box3 box;
            if (round_outward(set->bounds(i).box, box)) body(uint32_t(s), i, *set, box);
        }
    }
}

// What a ray meets: all of the scene, or some of its classes.
struct Met {
    const SoupScene& scene;
    const scene::LinkSet* set = nullptr;

    bool takes(const geometry::Hit& hit) const {
        return !set || set->holds(scene.classes.of(hit.instance, hit.shape));
    }
};

// Of equal hits one that enters a body comes before one that leaves it.
struct RankedHit : geometry::Hit {
    bool is_leaving = false;
};

void keep_better(const Met& met, RankedHit& best, const geometry::Hit& hit, bool is_leaving) {
    if (!met.takes(hit)) return;
    const auto rank = [](const geometry::Hit& h, bool leaving) {
        return std::make_tuple(h.t, leaving, h.instance, h.shape, h.triangle);
    };
    const bool is_better =
        best.is_valid() ? rank(hit, is_leaving) < rank(best, best.is_leaving) : hit.t < best.t;
    if (is_better) best = {hit, is_leaving};
}

void closest_primitive(const Shapes& shapes,
                       const Met& met,
                       const Vec3d& o,
                       const Vec3d& d,
                       uint32_t instance,
                       RankedHit& best) {
    for_each_primitive(
        shapes, [&](uint32_t s, uint32_t i, const geometry::PrimitiveSet& set, const Box3&) {
            const auto hit = set.intersect(i, o, d, std::numeric_limits<float>::infinity());
            if (hit) keep_better(met, best, {float(hit->t), hit->u, hit->v, instance, s, i}, false);
        });
}

// Rays are made ready for triangles by the bounds of triangles alone.
Box3 bounds_of_triangles(const Shapes& shapes) {
    Box3 box;
    for_each_triangle(shapes, [&](uint32_t, uint32_t, const Vec3& a, const Vec3& b, const Vec3& c) {
        box.extendBy(a);
        box.extendBy(b);
        box.extendBy(c);
    });
    return box;
}

// At all keys that they are there between.
Box3 bounds_of_moving_triangles(const Shapes& shapes) {
    Box3 box;
    for (const TriangleSoupView& shape : shapes) {
        for (uint32_t segment = 0; segment < shape.segments(); ++segment) {
            for (size_t i = 0; i < shape.triangles.size(); ++i) {
                if (!is_usable(shape, i, segment)) continue;
                for (const uint32_t vertex : shape.triangles[i]) {
                    const Way way = way_of(shape, vertex, segment);
                    box.extendBy(way.from);
                    box.extendBy(way.to);
                }
            }
        }
    }
    return box;
}

Box3 bounds_of(const Shapes& shapes) {
    Box3 box = bounds_of_triangles(shapes);
    box.extendBy(bounds_of_moving_triangles(shapes));
    for_each_primitive(shapes, [&](uint32_t, uint32_t, const geometry::PrimitiveSet&,
                                   const Box3& primitive) { box.extendBy(primitive); });
    return box;
}

// make(box, query) prepares the ray for the triangles within a box.
template <class Make>
void closest(const Shapes& shapes,
             const Met& met,
             const BruteForce::Bounds& bounds,
             float time,
             uint32_t instance,
             const Make& make,
             RankedHit& best) {
    QueryRay q;
    const auto test = [&](uint32_t s, uint32_t i, const Vec3& a, const Vec3& b, const Vec3& c) {
        TriangleHit hit;
        if (!hit_triangle(q, &a.x, &b.x, &c.x, 1, hit)) return;
        if (shapes[s].is_flipped) std::swap(hit.b1, hit.b2);
        keep_better(met, best, {hit.t, hit.b1, hit.b2, instance, s, i}, hit.is_leaving);
    };
    if (!bounds.still.isEmpty() && make(QueryBounds(bounds.still), q))
        for_each_triangle(shapes, test);
    if (!bounds.moving.isEmpty() && make(QueryBounds(bounds.moving), q))
        for_each_moving_triangle(shapes, time, test);
}

BruteForce::Bounds bounds_of_both(const Shapes& shapes) {
    return {bounds_of_triangles(shapes), bounds_of_moving_triangles(shapes)};
}

}  // namespace

BruteForce::BruteForce(const SoupScene& scene)
    : scene_(scene), direct_bounds_(bounds_of_both(scene.shapes)) {
    for (const Shapes& shapes : scene.prototypes)
        prototype_bounds_.push_back(bounds_of_both(shapes));
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        const SoupInstance& instance = scene.instances[i];
        const Box3 box = bounds_of(scene.prototypes[instance.prototype]);
        if (box.isEmpty()) continue;
        if (!instance.later.empty()) {
            MovingPlacement moving{
                instance.prototype, uint32_t(i), {instance.render_from_prototype}};
            moving.keys.insert(moving.keys.end(), instance.later.begin(), instance.later.end());
            std::vector<Box3d> key_boxes;
            if (place_keys(moving.keys, {&box, 1}, key_boxes)) moving_.push_back(std::move(moving));
            continue;
        }
        PlacedBox placed;
        placed.record.tree = instance.prototype;
        placed.record.instance = uint32_t(i);
        if (place(instance.render_from_prototype, {&box, 1}, placed))
            placed_.push_back(placed.record);
    }
}

geometry::Hit BruteForce::intersect(const geometry::Ray& ray, const scene::LinkSet* set) const {
    const Met met{scene_, set};
    RankedHit best;
    if (!velatura::is_finite(ray.o) || !velatura::is_finite(ray.d) || !(ray.t_max > 0)) return {};
    best.t = ray.t_max;
    closest(
        scene_.shapes, met, direct_bounds_, ray.time, scene::none,
        [&](const QueryBounds& box, QueryRay& q) { return make_query(ray, box, {}, q); }, best);
    if (ray.d == Vec3(0)) return {};
    closest_primitive(scene_.shapes, met, Vec3d(ray.o), Vec3d(ray.d), scene::none, best);
    const auto in_instance = [&](const InstanceRecord& record) {
        Vec3d o, d;
        enter(record, ray, o, d);
        const Shapes& shapes = scene_.prototypes[record.tree];
        closest(
            shapes, met, prototype_bounds_[record.tree], ray.time, record.instance,
            [&](const QueryBounds& box, QueryRay& q) { return make_query(o, d, box, {}, q); },
            best);
        closest_primitive(shapes, met, o, d, record.instance, best);
    };
    for (const InstanceRecord& record : placed_) in_instance(record);
    for (const MovingPlacement& moving : moving_) {
        InstanceRecord record;
        record.tree = moving.prototype;
        record.instance = moving.instance;
        if (place_at_time(moving.keys, ray.time, record)) in_instance(record);
    }
    return best.is_valid() ? geometry::Hit(best) : geometry::Hit{};
}

Box3 BruteForce::bounds() const {
    Box3 box = direct_bounds_.still;
    box.extendBy(direct_bounds_.moving);
    return box;
}

bool is_traced(const geometry::Ray& ray, const Box3& bounds) {
    QueryRay q;
    return make_query(ray, QueryBounds(bounds), {}, q);
}

OracleHit moller_trumbore(const SoupScene& scene, const geometry::Ray& ray) {
    using Real = long double;
    using V = Imath::Vec3<Real>;
    OracleHit best;
    best.t = double(ray.t_max);
    const V o(ray.o), d(ray.d);
    for_each_triangle(scene.shapes, [&](uint32_t s, uint32_t i, const Vec3& a, const Vec3& b,
                                        const Vec3& c) {
        const V e1 = V(b) - V(a), e2 = V(c) - V(a), p = d.cross(e2);
        const Real det = e1.dot(p);
        if (det == 0) return;
        const V r = o - V(a), n = r.cross(e1);
        const Real b1 = r.dot(p) / det, b2 = d.dot(n) / det, t = e2.dot(n) / det;
        const Real margin = std::min(std::min(b1, b2), 1 - b1 - b2);
        if (margin < 0 || t <= 0 || t >= Real(best.t)) return;
        best.t = double(t);
        best.margin = double(margin);
        const bool is_flipped = scene.shapes[s].is_flipped;
        best.hit = {
            float(t), float(is_flipped ? b2 : b1), float(is_flipped ? b1 : b2), scene::none, s, i};
    });
    return best;
}

}  // namespace velatura::accel::test
