// SPDX-License-Identifier: Apache-2.0
// The worked example of docs/reference/plugins.md: an accelerator that tests every triangle.
#include "accel/accelerator_factory.h"
#include "brute_force.h"
#include "plugin/plugin_api.h"

#include <exception>
#include <vector>

namespace {

using namespace velatura;

// BruteForce refers to triangles; an Accelerator must not need those of its caller.
struct Copies {
    std::vector<std::vector<Vec3>> positions;
    std::vector<std::vector<std::array<uint32_t, 3>>> triangles;
    std::vector<std::vector<std::vector<Vec3>>> later_positions;

    accel::TriangleSoupView add(const accel::TriangleSoupView& view) {
        positions.emplace_back(view.positions.begin(), view.positions.end());
        triangles.emplace_back(view.triangles.begin(), view.triangles.end());
        later_positions.emplace_back(view.later_positions.begin(), view.later_positions.end());
        return {positions.back(), triangles.back(), view.primitives, later_positions.back()};
    }
};

class BruteForceAccelerator final : public accel::Accelerator {
  public:
    explicit BruteForceAccelerator(const accel::SoupScene& scene) : brute_(copy(scene)) {
        // Lights are chosen by the bounds of the scene: to give the same image, they are those
        // that the own tree says
        bounds_ = accel::build_bvh(scene)->bounds();
    }

    geometry::Hit intersect(const geometry::Ray& ray) const override {
        return brute_.intersect(ray);
    }

    bool is_occluded(const geometry::Ray& ray) const override { return brute_.is_occluded(ray); }

    geometry::Hit intersect_some(const geometry::Ray& ray,
                                 const scene::LinkSet& met) const override {
        return brute_.intersect_some(ray, met);
    }

    bool is_occluded_by_some(const geometry::Ray& ray, const scene::LinkSet& met) const override {
        return brute_.is_occluded_by_some(ray, met);
    }

    Box3 bounds() const override { return bounds_; }

    accel::AcceleratorStats stats() const override { return {}; }

  private:
    accel::SoupScene copy(const accel::SoupScene& scene) {
        accel::SoupScene mine;
        for (const auto& shape : scene.shapes) mine.shapes.push_back(copies_.add(shape));
        for (const auto& shapes : scene.prototypes) {
            mine.prototypes.emplace_back();
            for (const auto& shape : shapes) mine.prototypes.back().push_back(copies_.add(shape));
        }
        mine.instances = scene.instances;
        mine.classes = scene.classes;
        return mine;
    }

    Copies copies_;
    accel::test::BruteForce brute_;
    Box3 bounds_;
};

class BruteForceFactory final : public accel::AcceleratorFactory {
  public:
    Result<std::unique_ptr<accel::Accelerator>> build(
        const accel::SoupScene& scene) const override {
        try {
            return std::unique_ptr<accel::Accelerator>(new BruteForceAccelerator(scene));
        } catch (const std::exception& e) {
            return Error{"accelerator", e.what()};
        }
    }
};

const BruteForceFactory factory;
const plugin::InterfaceEntry interfaces[] = {
    {accel::accelerator_interface, accel::accelerator_interface_version,
     static_cast<const accel::AcceleratorFactory*>(&factory)}};
const plugin::PluginInfo info = {plugin::abi_version, "brute_force", interfaces, 1};

}  // namespace

extern "C" [[gnu::visibility("default")]] const plugin::PluginInfo* velatura_plugin_v1();

const plugin::PluginInfo* velatura_plugin_v1() {
    return &info;
}
