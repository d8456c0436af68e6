// SPDX-License-Identifier: Apache-2.0
// The own tree against Embree (robust), a second implementation that shares no traversal and no
// intersection test with it.
//
// What must agree: whether a ray hits, which triangle, t and barycentric weights within rounding.
// What may differ, and is counted: `ties`, another triangle at the same t within rounding (coplanar
// or neighboring ones), and `edges`, hits within rounding of an edge, which Embree may miss or
// give to nobody. Anything else is `unexplained`, of which there must be none.
//
// Rounding: a float test knows a triangle's corners relative to the origin of the ray up to
// 2^-24·r, r being the largest distance of a corner. Seen along the ray, whose angle to the
// triangle's normal has the cosine c, that moves the hit across an edge by r·2^-24/(c·h), in
// barycentric units, where h is the smallest height of the triangle, and t by as much times the
// longest edge. The tolerance is `slack` times that.
#include "accel/accelerator_factory.h"
#include "compare.h"
#include "geometry/motion.h"
#include "plugin/registry.h"
#include "soups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace velatura::accel::test {
namespace {

using geometry::Hit;
using geometry::Ray;

constexpr double slack = 16;

struct Differences {
    size_t rays = 0, hits = 0, ties = 0, edges = 0, unexplained = 0, occlusion = 0;
    double worst_t = 0;  // of |t − t'| for the same triangle, in multiples of the rounding
};

class EmbreeTest : public testing::Test {
  protected:
    void SetUp() override {
        Diagnostics diagnostics;
        const plugin::Registry registry({{VELATURA_BUILT_PLUGINS}}, diagnostics);
        const plugin::Manifest* manifest =
            registry.find(accelerator_interface, {"option", "accel=embree"});
#ifndef VELATURA_HAVE_EMBREE_PLUGIN
        GTEST_SKIP() << "built without the plugin embree";
#endif
        ASSERT_NE(manifest, nullptr);
        factory_ = static_cast<const AcceleratorFactory*>(plugin::open_interface(
            *manifest, accelerator_interface, accelerator_interface_version, diagnostics));
        ASSERT_NE(factory_, nullptr);
    }

    std::unique_ptr<Accelerator> embree(const SoupScene& scene) const {
        auto built = factory_->build(scene);
        EXPECT_TRUE(built) << (built ? "" : built.error().message);
        return built ? std::move(*built) : nullptr;
    }

    const AcceleratorFactory* factory_ = nullptr;
};

// Where a vertex is at that time.
Vec3 position(const TriangleSoupView& shape, uint32_t vertex, float time) {
    if (shape.segments() == 0) return shape.positions[vertex];
    const auto at = geometry::motion_time(time, shape.segments());
    const Vec3& from =
        at.segment == 0 ? shape.positions[vertex] : shape.later_positions[at.segment - 1][vertex];
    return geometry::moved(from, shape.later_positions[at.segment][vertex], at.f);
}

Mat4 matrix(const SoupInstance& instance, float time) {
    if (instance.later.empty()) return instance.render_from_prototype;
    const auto at = geometry::motion_time(time, uint32_t(instance.later.size()));
    const Mat4& from =
        at.segment == 0 ? instance.render_from_prototype : instance.later[at.segment - 1];
    return geometry::moved(from, instance.later[at.segment], at.f);
}

// The triangle of a hit in render space.
struct Corners {
    Vec3d p[3];
};

Corners corners_of(const SoupScene& scene, const Hit& hit, float time) {
    const bool is_direct = hit.instance == scene::none;
    const TriangleSoupView& shape =
        is_direct ? scene.shapes[hit.shape]
                  : scene.prototypes[scene.instances[hit.instance].prototype][hit.shape];
    Corners c;
    for (size_t k = 0; k < 3; ++k) {
        c.p[k] = Vec3d(position(shape, shape.triangles[hit.triangle][k], time));
        if (!is_direct)
            c.p[k] = transform_point(c.p[k], Mat4d(matrix(scene.instances[hit.instance], time)));
    }
    return c;
}

// How far rounding may move a hit.
struct Rounding {
    double barycentric = 0;
    double t = 0;
};

// `reach`: how far from its own origin things are when an instance's float matrices see them.
Rounding rounding_of(const Corners& c, const Ray& ray, double reach) {
    const Vec3d o(ray.o), d(ray.d);
    const Vec3d n = (c.p[1] - c.p[0]).cross(c.p[2] - c.p[0]);
    double r = reach, longest = 0;
    for (size_t k = 0; k < 3; ++k) {
        r = std::max(r, (c.p[k] - o).length());
        longest = std::max(longest, (c.p[(k + 1) % 3] - c.p[k]).length());
    }
    const double height = n.length() / longest;
    const double cosine = std::abs(n.dot(d)) / (n.length() * d.length());
    const double moved = r * 0x1p-24 / cosine;
    return {moved / height, moved * (longest / height) / d.length()};
}

double margin(const Hit& hit) {
    const double b1 = double(hit.b1), b2 = double(hit.b2);
    return std::min(std::min(b1, b2), 1.0 - b1 - b2);
}

class Comparison {
  public:
    Comparison(const SoupScene& scene,
               const Accelerator& own,
               const Accelerator& other,
               double reach)
        : scene_(scene), own_(own), other_(other), reach_(reach) {}

    Differences run(const std::vector<Ray>& rays) {
        for (const Ray& ray : rays) add(ray);
        return result_;
    }

  private:
    bool is_at_edge(const Hit& hit, const Ray& ray) const {
        if (!hit.is_valid()) return false;
        const Rounding r = rounding_of(corners_of(scene_, hit, ray.time), ray, reach_);
        // The end of the ray is an edge too
        return !(margin(hit) > slack * r.barycentric) ||
               !(std::abs(double(ray.t_max) - double(hit.t)) > slack * r.t) ||
               !(double(hit.t) > slack * r.t);
    }

    bool is_same_distance(const Hit& a, const Hit& b, const Ray& ray) const {
        if (!a.is_valid() || !b.is_valid()) return false;
        const double t = rounding_of(corners_of(scene_, a, ray.time), ray, reach_).t +
                         rounding_of(corners_of(scene_, b, ray.time), ray, reach_).t;
        return !(std::abs(double(a.t) - double(b.t)) > slack * t);
    }

    void add(const Ray& ray) {
        const Hit a = own_.intersect(ray), b = other_.intersect(ray);
        ++result_.rays;
        result_.hits += a.is_valid();
        const bool is_edge = is_at_edge(a, ray) || is_at_edge(b, ray);
        // Each must find the same by either question
        result_.occlusion += own_.is_occluded(ray) != a.is_valid();
        result_.occlusion += other_.is_occluded(ray) != b.is_valid() && !is_edge;
        if (a.is_valid() == b.is_valid() && a.instance == b.instance && a.shape == b.shape &&
            a.triangle == b.triangle) {
            if (a.is_valid()) compare_values(a, b, ray);
        } else if (is_same_distance(a, b, ray)) {
            ++result_.ties;
        } else if (is_edge) {
            ++result_.edges;
        } else {
            ++result_.unexplained;
        }
    }

    void compare_values(const Hit& a, const Hit& b, const Ray& ray) {
        const Rounding r = rounding_of(corners_of(scene_, a, ray.time), ray, reach_);
        const double t = std::abs(double(a.t) - double(b.t)) / r.t;
        if (t > result_.worst_t) result_.worst_t = t;
        const double b1 = std::abs(double(a.b1) - double(b.b1));
        const double b2 = std::abs(double(a.b2) - double(b.b2));
        // A float of its own is as fine as 2^-24
        if (t > slack || std::max(b1, b2) > slack * (r.barycentric + 0x1p-24))
            ++result_.unexplained;
    }

    const SoupScene& scene_;
    const Accelerator &own_, &other_;
    double reach_;
    Differences result_;
};

// `can_differ`: the share of rays that may be ties or edges.
void expect_agreement(const SoupScene& scene,
                      const std::unique_ptr<Accelerator>& embree,
                      const std::vector<Ray>& rays,
                      size_t min_hits,
                      double can_differ,
                      double reach = 0) {
    ASSERT_TRUE(embree);
    const auto own = build_bvh(scene);
    const Differences d = Comparison(scene, *own, *embree, reach).run(rays);
    EXPECT_EQ(d.unexplained, 0u) << "of " << d.rays;
    EXPECT_EQ(d.occlusion, 0u) << "of " << d.rays;
    EXPECT_GE(d.hits, min_hits);
    EXPECT_LE(double(d.ties + d.edges), can_differ * double(d.rays));
    testing::Test::RecordProperty("ties", int(d.ties));
    testing::Test::RecordProperty("edges", int(d.edges));
    testing::Test::RecordProperty("worst_t_in_roundings", std::to_string(d.worst_t));
    if (scene.instances.empty()) {
        EXPECT_EQ(own->bounds(), embree->bounds());
    }
    // The own tree fits instances more closely, but for the rounding of what moves in them
    const Vec3 room = (own->bounds().max - own->bounds().min) * 0x1p-20f;
    const Box3 max(embree->bounds().min - room, embree->bounds().max + room);
    EXPECT_TRUE(max.intersects(own->bounds().min) && max.intersects(own->bounds().max));
    EXPECT_EQ(own->stats().instances, embree->stats().instances);
}

}  // namespace

TEST_F(EmbreeTest, AgreesOnRandomTriangles) {
    const std::vector<Soup> soups = {random_soup(20000, 0.1f, 1), random_soup(300, 0.5f, 2)};
    const SoupScene scene = scene_of(soups);
    expect_agreement(scene, embree(scene), mixed_rays(200000, 3), 100000, 1e-3);
}

TEST_F(EmbreeTest, AgreesOnNeedlesAndSlivers) {
    const std::vector<Soup> soups = {needles(2000, 1e2f, 4), needles(2000, 1e4f, 5)};
    const SoupScene scene = scene_of(soups);
    expect_agreement(scene, embree(scene), mixed_rays(40000, 6), 4000, 0.02);
    const std::vector<Soup> finest = {needles(2000, 1e6f, 7)};
    const SoupScene fine = scene_of(finest);
    expect_agreement(fine, embree(fine), mixed_rays(40000, 8), 1, 0.02);
}

TEST_F(EmbreeTest, AgreesOnFlatBoxesAndCoplanarOverlap) {
    const std::vector<Soup> soups = {flat_triangles(800, 9), box(Vec3(-1), Vec3(1))};
    const SoupScene scene = scene_of(soups);
    // Rays from and along the grid's planes: many meet edges
    expect_agreement(scene, embree(scene), mixed_rays(100000, 10), 50000, 0.5);
    Random random(11);
    Soup plane;
    for (int i = 0; i < 2000; ++i) {
        Vec3 p[3];
        for (Vec3& v : p) v = Vec3(random.between(-1, 1), random.between(-1, 1), 0.5f);
        plane.add(p[0], p[1], p[2]);
    }
    const std::vector<Soup> planes = {plane, plane};
    const SoupScene overlap = scene_of(planes);
    std::vector<Ray> rays;
    for (int i = 0; i < 4000; ++i) rays.push_back({random.in_cube(0.4f), Vec3(0, 0, 1)});
    expect_agreement(overlap, embree(overlap), rays, rays.size(), 1);
}

TEST_F(EmbreeTest, AgreesFarFromTheOriginAndOnHugeAndTinyCoordinates) {
    const Vec3 center(148376, 1234, -223423);
    Soup far = star_mesh(80, 100, 1000.0, 0.5, Vec3d(center), 12);
    const std::vector<Soup> far_soups = {far};
    const SoupScene far_scene = scene_of(far_soups);
    auto rays = mixed_rays(50000, 13);
    for (Ray& ray : rays) {
        ray.o = ray.o * 1000.0f + center;
        ray.t_max = ray.t_max * 1000.0f;
    }
    expect_agreement(far_scene, embree(far_scene), rays, 20000, 0.01);
    // Embree drops triangles beyond 1.8e18, and its products of three lengths end at 1e38
    for (const float size : {1e-6f, 1e6f, 1e10f}) {
        std::vector<Soup> soups = {random_soup(5000, 0.2f, 14)};
        for (Vec3& p : soups[0].positions) p *= size;
        auto scaled = mixed_rays(50000, 15);
        for (Ray& ray : scaled) {
            ray.o *= size;
            ray.t_max *= size;
        }
        const SoupScene scene = scene_of(soups);
        expect_agreement(scene, embree(scene), scaled, 20000, 1e-3);
    }
}

TEST_F(EmbreeTest, AgreesOnWhatMoves) {
    // Shapes of one to three segments, one that stays, and a prototype that moves
    std::vector<Soup> soups = {random_soup(5000, 0.1f, 61), random_soup(3000, 0.2f, 62),
                               star_mesh(20, 30, 0.5, 0.5, Vec3d(0), 63),
                               random_soup(500, 0.2f, 64)};
    Random random(65);
    for (uint32_t i = 0; i < 3; ++i) {
        std::vector<Vec3> key = soups[i].positions;
        for (uint32_t segment = 0; segment <= i; ++segment) {
            const Vec3 drift = random.in_cube(0.3f);
            for (Vec3& p : key) p += drift + random.in_cube(0.05f);
            soups[i].later_positions.push_back(key);
        }
    }
    auto rays = mixed_rays(200000, 66);
    for (Ray& ray : rays) ray.time = random.unit();
    const SoupScene scene = scene_of(soups);
    // Interpolated points differ by roundings of their own
    expect_agreement(scene, embree(scene), rays, 80000, 2e-3, 10);
    SoupScene placed;
    placed.prototypes = {scene.shapes};
    for (uint32_t i = 0; i < 20; ++i) {
        Mat4d scale, turn, move;
        scale.setScale(Vec3d(0.3));
        turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
        move.setTranslation(Vec3d(random.in_cube(1)));
        placed.instances.push_back({0, Mat4(scale * turn * move)});
    }
    expect_agreement(placed, embree(placed), rays, 80000, 0.01, 10 / 0.3);
    // The instances move as well, over one and two segments
    std::vector<std::vector<Mat4>> later;
    for (size_t i = 0; i < placed.instances.size(); ++i) {
        Mat4 key = placed.instances[i].render_from_prototype;
        later.emplace_back();
        for (size_t k = 0; k < 1 + i % 2; ++k) {
            for (int row = 0; row < 4; ++row)
                for (int c = 0; c < 3; ++c) key[row][c] += random.between(-0.05f, 0.05f);
            later.back().push_back(key);
        }
    }
    for (size_t i = 0; i < later.size(); ++i) placed.instances[i].later = later[i];
    expect_agreement(placed, embree(placed), rays, 80000, 0.01, 10 / 0.3);
}

TEST_F(EmbreeTest, AgreesOnInstances) {
    const std::vector<Soup> prototypes = {random_soup(300, 0.5f, 16),
                                          star_mesh(12, 18, 1, 0.5, Vec3d(0), 17),
                                          box(Vec3(-1), Vec3(1))};
    const std::vector<Soup> direct = {random_soup(100, 0.2f, 18)};
    SoupScene scene = scene_of(direct);
    for (const Soup& soup : prototypes) scene.prototypes.push_back({soup.view(), soup.view()});
    Random random(19);
    for (uint32_t i = 0; i < 200; ++i) {
        Mat4d scale, turn, move;
        scale.setScale(i % 3 == 1 ? Vec3d(-0.2, 0.1, 0.05) : Vec3d(0.15));
        turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
        move.setTranslation(Vec3d(random.in_cube(1)));
        scene.instances.push_back({i % 3, Mat4(scale * turn * move)});
    }
    // Some that cannot be hit
    Mat4 flat, broken;
    flat[0][0] = 0;
    broken[3][1] = std::numeric_limits<float>::quiet_NaN();
    scene.instances.push_back({0, flat});
    scene.instances.push_back({1, broken});
    // Shapes of a prototype coincide: the first one wins in both
    expect_agreement(scene, embree(scene), mixed_rays(100000, 20), 40000, 0.01, 4 / 0.05);
}

TEST_F(EmbreeTest, AgreesAmongSomeOfTheGeometry) {
    Random random(71);
    std::vector<Soup> soups, inner;
    for (uint64_t i = 0; i < 20; ++i) soups.push_back(random_soup(300, 0.2f, 72 + i));
    for (uint64_t i = 0; i < 4; ++i) inner.push_back(random_soup(100, 0.5f, 100 + i));
    SoupScene scene = scene_of(soups);
    scene.prototypes = {{inner[0].view(), inner[1].view()}, {inner[2].view(), inner[3].view()}};
    constexpr scene::LinkClass classes = 40;
    for (size_t i = 0; i < soups.size(); ++i)
        scene.classes.of_shape.push_back(random.below(classes));
    for (int row = 0; row < 8; ++row)
        scene.classes.rows.push_back({random.below(classes), random.below(classes)});
    for (uint32_t i = 0; i < 50; ++i) {
        Mat4d scale, move;
        scale.setScale(Vec3d(0.2));
        move.setTranslation(Vec3d(random.in_cube(1)));
        scene.instances.push_back({i % 2, Mat4(scale * move)});
        scene.classes.row_of_instance.push_back(i % 9 == 8 ? scene::none : i % 9);
    }
    const auto peer = embree(scene);
    ASSERT_TRUE(peer);
    const auto own = build_bvh(scene);
    for (const float share : {0.1f, 0.5f}) {
        scene::LinkSet met(classes);
        for (scene::LinkClass c = 0; c < classes; ++c)
            if (random.unit() < share) met.add(c);
        const Some some(*own, met), others(*peer, met);
        const Differences d = Comparison(scene, some, others, 4 / 0.2).run(mixed_rays(50000, 73));
        EXPECT_EQ(d.unexplained, 0u) << "of " << d.rays;
        EXPECT_EQ(d.occlusion, 0u) << "of " << d.rays;
        EXPECT_GE(d.hits, 2000u);
        EXPECT_LE(double(d.ties + d.edges), 0.01 * double(d.rays));
    }
}

TEST_F(EmbreeTest, MeetsPrimitivesWhereTheOwnTreeDoes) {
    // Both ask the primitives, in double: what is left is whether their trees lead there
    SoupScene scene;
    const Soup soup = random_soup(60, 0.2f, 26);
    scene.shapes = {soup.view()};
    for (const TriangleSoupView& body : quadrics(40, 0.3, 27)) scene.shapes.push_back(body);
    scene.shapes.push_back(discs(60, 0.3, 28));
    const auto peer = embree(scene);
    ASSERT_TRUE(peer);
    const auto own = build_bvh(scene);
    EXPECT_EQ(own->bounds(), peer->bounds());
    EXPECT_EQ(own->stats().primitives, peer->stats().primitives);
    size_t primitives = 0;
    for (const Ray& ray : mixed_rays(100000, 29)) {
        const Hit a = own->intersect(ray), b = peer->intersect(ray);
        if (a.is_valid() && a.shape != 0) {
            ++primitives;
            ASSERT_TRUE(is_same(a, b)) << a.shape << ' ' << b.shape << ' ' << a.t << ' ' << b.t;
        } else {
            ASSERT_TRUE(!b.is_valid() || b.shape == 0);
        }
        if (a.is_valid() == b.is_valid()) {
            ASSERT_EQ(own->is_occluded(ray), peer->is_occluded(ray));
        }
    }
    EXPECT_GT(primitives, 40000u);
}

TEST_F(EmbreeTest, MeetsPrimitivesOfInstancesWhereTheOwnTreeDoes) {
    SoupScene scene;
    const Soup star = star_mesh(12, 18, 0.5, 0.5, Vec3d(0.5, 0, 0), 30);
    scene.prototypes = {quadrics(6, 0.8, 31), {star.view(), discs(10, 0.8, 32)}};
    Random random(33);
    for (uint32_t i = 0; i < 100; ++i) {
        Mat4d scale, turn, move;
        scale.setScale(i % 4 == 1 ? Vec3d(-0.2, 0.1, 0.05) : Vec3d(0.15));
        turn.setAxisAngle(Vec3d(random.direction()), double(random.between(0, 6)));
        move.setTranslation(Vec3d(random.in_cube(1)));
        scene.instances.push_back({i % 2, Mat4(scale * turn * move)});
    }
    const auto peer = embree(scene);
    ASSERT_TRUE(peer);
    const auto own = build_bvh(scene);
    size_t primitives = 0, different = 0;
    constexpr size_t count = 100000;
    for (const Ray& ray : mixed_rays(count, 34)) {
        const Hit a = own->intersect(ray), b = peer->intersect(ray);
        const auto is_primitive = [&](const Hit& hit) {
            if (!hit.is_valid()) return false;
            const SoupInstance& instance = scene.instances[hit.instance];
            return scene.prototypes[instance.prototype][hit.shape].primitives != nullptr;
        };
        primitives += is_primitive(a);
        // Embree carries rays into prototypes in float: near an outline its boxes may miss
        different += (is_primitive(a) || is_primitive(b)) && !is_same(a, b);
    }
    EXPECT_GT(primitives, 20000u);
    EXPECT_LE(different, count / 10000);
    testing::Test::RecordProperty("different", int(different));
}

TEST_F(EmbreeTest, DropsTheSameTrianglesAndRays) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    inf = std::numeric_limits<float>::infinity();
    Soup soup = random_soup(500, 0.3f, 21);
    Random random(22);
    for (int i = 0; i < 500; ++i) {
        const Vec3 a = random.in_cube(1), b = random.in_cube(1);
        soup.add(a, a, b);
        soup.add(a, Vec3(nan, 0, 0), b);
        soup.add(a, Vec3(0, i % 2 ? inf : -inf, 0), b);
        soup.add(Vec3(0), Vec3(0.25f), Vec3(0.75f));
    }
    const std::vector<Soup> soups = {soup};
    const SoupScene scene = scene_of(soups);
    const auto peer = embree(scene);
    expect_agreement(scene, peer, mixed_rays(50000, 23), 10000, 1e-3);
    EXPECT_EQ(peer->stats().triangles, 500u);
    std::vector<Ray> bad;
    for (const float value : {nan, inf, -inf}) {
        for (int component = 0; component < 7; ++component) {
            for (Ray ray : mixed_rays(100, 24)) {
                // A ray without end is a good one
                if (component == 6 && value == inf) continue;
                if (component == 6) ray.t_max = value;
                if (component < 6) (component < 3 ? ray.o : ray.d)[component % 3] = value;
                bad.push_back(ray);
            }
        }
    }
    for (const Ray& ray : bad) {
        EXPECT_FALSE(peer->intersect(ray).is_valid());
        EXPECT_FALSE(peer->is_occluded(ray));
    }
    expect_agreement(scene, peer, bad, 0, 0);
}

TEST_F(EmbreeTest, GivesExactDuplicatesToTheFirst) {
    // Whatever order a tree keeps them in: of each triangle there are nine, in two orders
    const Soup soup = random_soup(2000, 0.2f, 25);
    Soup reversed = soup;
    std::reverse(reversed.triangles.begin(), reversed.triangles.end());
    std::vector<Soup> soups;
    for (int i = 0; i < 8; ++i) soups.push_back(i % 2 ? soup : reversed);
    SoupScene scene = scene_of(soups);
    scene.shapes.push_back(soup.view());
    scene.prototypes = {{soup.view()}};
    for (int i = 0; i < 3; ++i) {
        const auto peer = embree(scene);
        size_t hits = 0, wrong = 0;
        for (const Ray& ray : mixed_rays(20000, 26)) {
            const Hit hit = peer->intersect(ray);
            hits += hit.is_valid();
            // Instances come before what is placed directly
            wrong += hit.is_valid() && (hit.shape != 0 || hit.instance != (i ? 0 : scene::none));
        }
        EXPECT_EQ(wrong, 0u) << "with " << i << " instances, of " << hits;
        EXPECT_GT(hits, 5000u);
        scene.instances.push_back({0, Mat4()});
    }
}

}  // namespace velatura::accel::test
