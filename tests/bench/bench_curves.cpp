// SPDX-License-Identifier: Apache-2.0
// Rays per second at a tuft of hair: round curves and ribbons of the own tree, beside those of
// Embree, robust. One thread, single rays, CPU time, rounds of both in turn.
#include "accel/bvh.h"
#include "bench_shapes.h"
#include "cpu_clock.h"
#include "geometry/ribbons.h"
#include "geometry/round_curves.h"
#include "parse_options.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <vector>

namespace velatura::bench {
namespace {

// Strands on a ball, of two cubic segments, bent down and tapering to a tip.
scene::Curves make_tuft(uint32_t count, bool are_ribbons) {
    scene::Curves curves;
    Random random(1);
    curves.width_interpolation = scene::Interpolation::Vertex;
    curves.normal_interpolation = scene::Interpolation::Uniform;
    const auto unit = [&] { return random() * 2.0f - 1.0f; };
    for (uint32_t i = 0; i < count; ++i) {
        Vec3 out(unit(), unit(), unit());
        while (out.length2() > 1 || out.length2() < 1e-3f) out = Vec3(unit(), unit(), unit());
        out = normalize(out);
        const Vec3 stray(unit(), unit(), unit());
        Vec3 p = out, step = (out + stray * 0.3f) * 0.08f;
        for (int k = 0; k < 7; ++k) {
            curves.points.push_back(p);
            curves.widths.push_back(0.004f * (1.0f - 0.16f * float(k)));
            step += Vec3(0.1f * unit(), -0.25f, 0.1f * unit()) * 0.03f;
            p += step;
        }
        // The joint in the middle of its neighbors: smooth
        const size_t joint = curves.points.size() - 4;
        curves.points[joint] = (curves.points[joint - 1] + curves.points[joint + 1]) * 0.5f;
        if (are_ribbons) curves.normals.push_back(normalize(stray + Vec3(0.01f)));
        curves.vertex_counts.push_back(7);
    }
    return curves;
}

struct Embree {
    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = nullptr;
    std::atomic<long long> bytes{0};
    double build_seconds = 0;

    explicit Embree(const scene::Curves& curves) {
        rtcSetDeviceMemoryMonitorFunction(
            device,
            [](void* sum, ssize_t change, bool) {
                *static_cast<std::atomic<long long>*>(sum) += change;
                return true;
            },
            &bytes);
        scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        const bool are_ribbons = !curves.normals.empty();
        RTCGeometry geometry =
            rtcNewGeometry(device, are_ribbons ? RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_BEZIER_CURVE
                                               : RTC_GEOMETRY_TYPE_ROUND_BEZIER_CURVE);
        const auto buffer = [&](RTCBufferType type, RTCFormat format, size_t stride, size_t n) {
            return rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, n);
        };
        auto* points = static_cast<float*>(
            buffer(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 16, curves.points.size()));
        for (size_t i = 0; i < curves.points.size(); ++i) {
            std::memcpy(points + 4 * i, &curves.points[i], sizeof(Vec3));
            points[4 * i + 3] = 0.5f * curves.widths[i];
        }
        if (are_ribbons) {
            auto* normals = static_cast<Vec3*>(
                buffer(RTC_BUFFER_TYPE_NORMAL, RTC_FORMAT_FLOAT3, 12, curves.points.size()));
            for (size_t i = 0; i < curves.points.size(); ++i) normals[i] = curves.normals[i / 7];
        }
        const size_t segments = 2 * curves.vertex_counts.size();
        auto* indices =
            static_cast<uint32_t*>(buffer(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, 4, segments));
        for (size_t i = 0; i < segments; ++i) indices[i] = uint32_t(7 * (i / 2) + 3 * (i % 2));
        const double start = cpu_seconds();
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        build_seconds = cpu_seconds() - start;
    }

    ~Embree() {
        rtcReleaseScene(scene);
        rtcReleaseDevice(device);
    }

    static RTCRay ray_of(const geometry::Ray& ray) {
        RTCRay r{};
        r.org_x = ray.o.x;
        r.org_y = ray.o.y;
        r.org_z = ray.o.z;
        r.dir_x = ray.d.x;
        r.dir_y = ray.d.y;
        r.dir_z = ray.d.z;
        r.tfar = ray.t_max;
        r.mask = ~0u;
        return r;
    }

    float closest(const geometry::Ray& ray) const {
        RTCRayHit hit{};
        hit.ray = ray_of(ray);
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(scene, &context, &hit);
        return hit.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<float>::infinity()
                                                         : hit.ray.tfar;
    }

    bool is_occluded(const geometry::Ray& ray) const {
        RTCRay r = ray_of(ray);
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcOccluded1(scene, &context, &r);
        return r.tfar < 0;
    }
};

struct RaySet {
    const char* name;
    bool is_shadow;
    std::vector<geometry::Ray> rays;
};

std::vector<RaySet> make_rays(const accel::Accelerator& tree, size_t count) {
    Random random(2);
    std::vector<RaySet> sets = {
        {"primary", false, {}}, {"bounce", false, {}}, {"shadow", true, {}}};
    const auto side = size_t(std::sqrt(double(count)));
    const auto unit = [&] { return random() * 2.0f - 1.0f; };
    for (size_t y = 0; y < side; ++y)
        for (size_t x = 0; x < side; ++x)
            sets[0].rays.push_back(
                {Vec3(0, 0.3f, 6), Vec3((float(x) + random()) / float(side) - 0.5f,
                                        (float(y) + random()) / float(side) - 0.5f, -1.9f)});
    for (const geometry::Ray& ray : sets[0].rays) {
        const geometry::Hit hit = tree.intersect(ray);
        if (!hit.is_valid()) continue;
        // A little in front of where it was met, as far as curves are thick
        const Vec3 p = ray.o + ray.d * (hit.t - 0.003f);
        sets[1].rays.push_back({p, normalize(Vec3(unit(), unit(), unit()) - ray.d * 0.5f)});
        sets[2].rays.push_back({p, Vec3(3, 5, 4) - p, 1.0f});
    }
    return sets;
}

template <class Trace>
double seconds_of(const RaySet& set, const Trace& trace, size_t& hits) {
    const double start = cpu_seconds();
    hits = 0;
    for (const geometry::Ray& ray : set.rays) hits += trace(ray);
    return cpu_seconds() - start;
}

void run(bool are_ribbons, uint32_t count, size_t ray_count, int rounds) {
    const scene::Curves curves = make_tuft(count, are_ribbons);
    double start = cpu_seconds();
    std::shared_ptr<const geometry::PrimitiveSet> set;
    if (are_ribbons)
        set = geometry::Ribbons::make(curves);
    else
        set = geometry::RoundCurves::make(curves);
    const double set_seconds = cpu_seconds() - start;
    accel::SoupScene scene;
    scene.shapes = {{{}, {}, set}};
    start = cpu_seconds();
    const auto own = build_bvh(scene);
    const double build_seconds = cpu_seconds() - start;
    const Embree embree(curves);
    fmt::print(
        "{} {}s of 2 segments: {} pieces, set {:.1f} MB {:.2f} s, tree {:.1f} MB {:.2f} s; Embree "
        "{:.1f} MB {:.2f} s (CPU)\n",
        count, set->kind(), set->size(), double(set->bytes()) / 1e6, set_seconds,
        double(own->stats().bytes) / 1e6, build_seconds, double(embree.bytes) / 1e6,
        embree.build_seconds);
    fmt::print("  {:10}{:>10}{:>10}{:>8}{:>12}{:>12}\n", "rays", "own", "Embree", "ratio",
               "own hits", "Embree's");
    for (const RaySet& rays : make_rays(*own, ray_count)) {
        double best[2] = {1e30, 1e30};
        size_t hits[2] = {0, 0};
        for (int round = 0; round < rounds; ++round) {
            best[0] = std::min(best[0], seconds_of(
                                            rays,
                                            [&](const geometry::Ray& ray) {
                                                return rays.is_shadow
                                                           ? own->is_occluded(ray)
                                                           : own->intersect(ray).is_valid();
                                            },
                                            hits[0]));
            best[1] = std::min(best[1], seconds_of(
                                            rays,
                                            [&](const geometry::Ray& ray) {
                                                return rays.is_shadow
                                                           ? embree.is_occluded(ray)
                                                           : std::isfinite(embree.closest(ray));
                                            },
                                            hits[1]));
        }
        const double millions = double(rays.rays.size()) / 1e6;
        fmt::print("  {:10}{:>10.3f}{:>10.3f}{:>8.2f}{:>12}{:>12}\n", rays.name, millions / best[0],
                   millions / best[1], best[1] / best[0], hits[0], hits[1]);
    }
}

}  // namespace
}  // namespace velatura::bench

int main(int argc, char** argv) {
    velatura::CommandLine app("Rays per second at hair, in Mrays/s of one core");
    uint32_t curves = 100000;
    size_t rays = 500000;
    int rounds = 3;
    app.add_option("--curves", curves, "strands of the tuft");
    app.add_option("--rays", rays, "of each kind, about");
    app.add_option("--rounds", rounds, "the best of so many");
    if (const auto code = velatura::bench::parse_options(app, argc, argv)) return *code;
    for (const bool are_ribbons : {false, true})
        velatura::bench::run(are_ribbons, curves, rays, rounds);
    return 0;
}
