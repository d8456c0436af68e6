// SPDX-License-Identifier: Apache-2.0
#include "ray_sets.h"

#include "geometry/motion.h"

#include <cmath>
#include <limits>
#include <utility>

namespace velatura::bench {

namespace {

// A number in [0, 1) of the path's index alone.
float number(uint64_t path, uint64_t dimension) {
    uint64_t z = (path * 16 + dimension + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return float((z ^ (z >> 31)) >> 40) * 0x1p-24f;
}

// Where the vertex is at that time.
Vec3 position(const BenchMesh& mesh, uint32_t vertex, float time) {
    if (mesh.later_positions.empty()) return mesh.positions[vertex];
    const auto at = geometry::motion_time(time, uint32_t(mesh.later_positions.size()));
    const auto& from = at.segment == 0 ? mesh.positions : mesh.later_positions[at.segment - 1];
    return geometry::moved(from[vertex], mesh.later_positions[at.segment][vertex], at.f);
}

Mat4 matrix(const BenchScene& scene, uint32_t instance, float time) {
    const Mat4& first = scene.instances[instance].render_from_prototype;
    if (scene.later_instances.empty()) return first;
    const std::vector<Mat4>& later = scene.later_instances[instance];
    const auto at = geometry::motion_time(time, uint32_t(later.size()));
    return geometry::moved(at.segment == 0 ? first : later[at.segment - 1], later[at.segment],
                           at.f);
}

// Geometric normal in render space, towards where the ray came from.
Vec3 normal_at(const BenchScene& scene, const geometry::Ray& ray, const geometry::Hit& hit) {
    const bool is_direct = hit.instance == scene::none;
    const BenchMesh& mesh =
        is_direct ? scene.direct : scene.prototypes[scene.instances[hit.instance].prototype];
    const auto& v = mesh.triangles[hit.triangle];
    Vec3 p[3];
    for (size_t k = 0; k < 3; ++k) {
        p[k] = position(mesh, v[k], ray.time);
        if (!is_direct) p[k] = transform_point(p[k], matrix(scene, hit.instance, ray.time));
    }
    const Vec3 n = normalize(cross(p[1] - p[0], p[2] - p[0]));
    return n.dot(ray.d) > 0 ? -n : n;
}

class PathMaker {
  public:
    PathMaker(const BenchScene& scene, const accel::Accelerator& accelerator, int size)
        : scene_(scene), accelerator_(accelerator), size_(size), target_(size_t(size * size)) {}

    std::vector<RaySet> run() {
        constexpr uint64_t max_passes = 32;
        for (uint64_t pass = 0; pass < max_passes && !is_full(); ++pass) {
            for (size_t i = 0; i < target_; ++i) add_path(pass, i);
        }
        RaySet shuffled{"shuffled", false, bounce1_.rays};
        for (size_t i = shuffled.rays.size(); i > 1; --i) {
            std::swap(shuffled.rays[i - 1], shuffled.rays[size_t(number(i, 15) * float(i))]);
        }
        return {std::move(primary_), std::move(bounce1_), std::move(bounce2_),
                std::move(shuffled), std::move(shadow_),  std::move(ambient_)};
    }

  private:
    bool is_full() const { return bounce2_.rays.size() >= target_; }

    void add(RaySet& set, const geometry::Ray& ray) const {
        if (set.rays.size() < target_) set.rays.push_back(ray);
    }

    void add_path(uint64_t pass, size_t i) {
        const uint64_t path = pass * target_ + i;
        const geometry::Ray primary = primary_ray(path, i);
        add(primary_, primary);
        if (is_full()) return;
        const geometry::Hit hit = accelerator_.intersect(primary);
        if (!hit.is_valid()) return;
        const Vec3 n = normal_at(scene_, primary, hit), p = start(primary, hit, n);
        const Vec3 light =
            scene_.light + scene_.light_x * number(path, 4) + scene_.light_y * number(path, 5);
        const float time = primary.time;
        constexpr float endless = std::numeric_limits<float>::infinity();
        add(shadow_, {p, light - p, 0.999f, time});
        add(ambient_, {p, cosine(n, path, 6), scene_.ambient_distance, time});
        const geometry::Ray bounce{p, cosine(n, path, 2), endless, time};
        add(bounce1_, bounce);
        const geometry::Hit second = accelerator_.intersect(bounce);
        if (!second.is_valid()) return;
        const Vec3 m = normal_at(scene_, bounce, second);
        add(bounce2_, {start(bounce, second, m), cosine(m, path, 8), endless, time});
    }

    // Pixel i in the order of 16×16 tiles.
    geometry::Ray primary_ray(uint64_t path, size_t i) const {
        const size_t tiles = size_t(size_) / 16, tile = i / 256, in_tile = i % 256;
        const float x = float(tile % tiles * 16 + in_tile % 16) + number(path, 0);
        const float y = float(tile / tiles * 16 + in_tile / 16) + number(path, 1);
        const Vec3 forward = normalize(scene_.target - scene_.eye);
        const Vec3 right = normalize(cross(forward, Vec3(0, 1, 0)));
        const Vec3 up = cross(right, forward);
        const float s = 1.2f / float(size_);
        const Vec3 d = normalize(forward + right * (x * s - 0.6f) + up * (0.6f - y * s));
        return {scene_.eye, d, std::numeric_limits<float>::infinity(), number(path, 10)};
    }

    // Far enough from the surface that rounding decides nothing: tracers can be compared.
    static Vec3 start(const geometry::Ray& ray, const geometry::Hit& hit, const Vec3& n) {
        const Vec3 p = ray.o + ray.d * hit.t;
        return p + n * (1e-4f * hit.t + 1e-5f * p.length());
    }

    static Vec3 cosine(const Vec3& n, uint64_t path, uint64_t dimension) {
        const float r = std::sqrt(number(path, dimension));
        const float phi = 2 * pi * number(path, dimension + 1);
        const Vec3 local(r * std::cos(phi), r * std::sin(phi), safe_sqrt(1 - r * r));
        return normalize(Frame::from_z(n).from_local(local));
    }

    const BenchScene& scene_;
    const accel::Accelerator& accelerator_;
    int size_;
    size_t target_;
    RaySet primary_{"primary", false, {}}, bounce1_{"bounce1", false, {}};
    RaySet bounce2_{"bounce2", false, {}}, shadow_{"shadow", true, {}}, ambient_{"ao", true, {}};
};

}  // namespace

std::vector<RaySet> make_ray_sets(const BenchScene& scene,
                                  const accel::Accelerator& accelerator,
                                  int size) {
    return PathMaker(scene, accelerator, size).run();
}

}  // namespace velatura::bench
