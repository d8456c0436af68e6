// SPDX-License-Identifier: Apache-2.0
#include "lights/emitters.h"
#include "lights/environment_map.h"
#include "scene/effect_calls.h"

#include <cmath>
#include <limits>
#include <utility>

namespace velatura::lights {
namespace {

using scene::count_call;
using scene::Effect;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Rotation of a dome, scale and shear removed: the pole (+Y) keeps its direction, then +Z as far
/// as it can.
struct Orientation {
    Vec3d x, y, z;

    Vec3d to_dome(const Vec3d& v) const { return {v.dot(x), v.dot(y), v.dot(z)}; }

    Vec3d from_dome(const Vec3d& v) const { return x * v.x + y * v.y + z * v.z; }
};

double luminance_d(const Rgb& c) {
    return double(luminance(c));
}

/// The same radiance from everywhere.
class UniformDome final : public Emitter {
  public:
    UniformDome(const Rgb& Le, bool compensate_mis) : Le_(Le), compensate_mis_(compensate_mis) {}

    std::optional<EmitterSample> sample(const Vec3d&, const Vec2& u) const override {
        count_call(Effect::Environment);
        return EmitterSample{sample_cone(u, 2.0), infinity, Le_, 1.0 / (4.0 * pi_d)};
    }

    std::optional<EmitterHit> intersect(const Vec3d&, const Vec3d&) const override {
        count_call(Effect::Environment);
        return EmitterHit{infinity, Le_, 1.0 / (4.0 * pi_d)};
    }

    double power(double radius) const override {
        return 4.0 * pi_d * pi_d * radius * radius * luminance_d(Le_);
    }

    /// Nothing exceeds the mean: sampling the BSDF is the better way to all of it.
    double sampled_share() const override { return compensate_mis_ ? 0.0 : 1.0; }

    bool is_infinite() const override { return true; }

  private:
    Rgb Le_;
    bool compensate_mis_;
};

class TexturedDome final : public Emitter {
  public:
    TexturedDome(const Rgb& Le, const Orientation& orientation, EnvironmentMap map)
        : Le_(Le), orientation_(orientation), map_(std::move(map)) {}

    std::optional<EmitterSample> sample(const Vec3d&, const Vec2& u) const override {
        count_lookup();
        const std::optional<EnvironmentMap::Sample> s = map_.sample(u);
        if (!s) return std::nullopt;
        return EmitterSample{orientation_.from_dome(s->direction), infinity, Le_ * s->radiance,
                             s->pdf};
    }

    std::optional<EmitterHit> intersect(const Vec3d&, const Vec3d& d) const override {
        count_lookup();
        const EnvironmentMap::View seen = map_.view(orientation_.to_dome(d));
        return EmitterHit{infinity, Le_ * seen.radiance, seen.pdf};
    }

    double power(double radius) const override {
        return 4.0 * pi_d * pi_d * radius * radius * luminance_d(Le_) * map_.mean_luminance();
    }

    double sampled_share() const override { return map_.sampled_share(); }

    bool is_infinite() const override { return true; }

  private:
    static void count_lookup() {
        count_call(Effect::Environment);
        count_call(Effect::EnvironmentMaps);
    }

    Rgb Le_;
    Orientation orientation_;
    EnvironmentMap map_;
};

}  // namespace

EmitterResult make_dome(const EmitterInput& input) {
    const scene::Light& light = input.light;
    if (input.image == nullptr)
        return std::unique_ptr<Emitter>(new UniformDome(light.Le, input.compensate_mis));

    const Vec3d y_axis = axis_of(light.render_from_light, 1);
    const Vec3d z_axis = axis_of(light.render_from_light, 2);
    const Error broken{"light-degenerate",
                       "dome light emits nothing: its transform is flat or not finite"};
    if (!std::isfinite(y_axis.dot(y_axis)) || !std::isfinite(z_axis.dot(z_axis))) return broken;
    if (y_axis == Vec3d(0.0) || z_axis == Vec3d(0.0)) return broken;
    Orientation o;
    o.y = normalize(y_axis);
    const Vec3d z_unit = normalize(z_axis);
    const Vec3d across = z_unit - o.y * z_unit.dot(o.y);
    if (!(across.dot(across) > 1e-24)) return broken;
    o.z = normalize(across);
    o.x = o.y.cross(o.z);
    if (determinant3(light.render_from_light) < 0.0) o.x = -o.x;

    EnvironmentMap map(to_latlong(std::move(*input.image), light.dome_format),
                       input.compensate_mis);
    if (map.is_black()) {
        return Error{"light-black-texture", "dome light emits nothing: its texture is black"};
    }
    return std::unique_ptr<Emitter>(new TexturedDome(light.Le, o, std::move(map)));
}

}  // namespace velatura::lights
