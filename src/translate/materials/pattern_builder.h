// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

namespace velatura::translate::materials {

/// Row-vector map st' = st · (a b; c d) + (x, y), in double.
struct Map2 {
    double a = 1, b = 0, c = 0, d = 1;
    double x = 0, y = 0;

    /// First this, then `next`.
    Map2 then(const Map2& next) const {
        return {a * next.a + b * next.c,          a * next.b + b * next.d,
                c * next.a + d * next.c,          c * next.b + d * next.d,
                x * next.a + y * next.c + next.x, x * next.b + y * next.d + next.y};
    }
};

/// Counter-clockwise; multiples of 90 degrees without rounding errors, which would smear texels.
Map2 rotation_map(double degrees);

/// Something that a step gives.
struct Port {
    uint16_t step = 0;
    uint8_t width = 1;  ///< 1 (in all channels), 2, 3 or 4
};

/// Texture coordinates that are an affine map of one primvar.
struct AffineCoordinates {
    scene::PrimvarId st = scene::none;
    Vec2 fallback = Vec2(0.0f);  ///< of the primvar
    Map2 map = {};
};

/// Puts a node graph together step by step: what is constant becomes one, what neither changes nor
/// is changed is left out, equal steps are one.
class PatternBuilder {
  public:
    explicit PatternBuilder(scene::Scene& scene) : scene_(scene) {}

    Port constant(const scene::PatternValue& value, int width);

    Port constant(float value) { return constant(scene::PatternValue(value), 1); }

    Port color(const Rgb& c) { return constant({c.x, c.y, c.z, 0.0f}, 3); }

    Port texture(scene::TextureId id);
    Port texture_at(scene::TextureId id, Port coordinates);
    /// fallback: has the width of the result.
    Port primvar(scene::PrimvarId id, Port fallback);
    Port position(bool in_shape_space);
    Port normal();
    /// A pure step. width: of the result.
    Port apply(scene::PatternOp op, int width, std::initializer_list<Port> in, uint32_t data = 0);

    // Short names; the width is that of the wider one.
    Port add(Port a, Port b);
    Port subtract(Port a, Port b);
    Port multiply(Port a, Port b);
    Port divide(Port a, Port b);
    Port mix(Port from, Port to, Port share);

    Port invert(Port a) { return subtract(constant(1.0f), a); }

    Port clamp(Port a, Port low, Port high);
    Port dot(Port a, Port b);
    Port swizzle(Port a, int width, uint32_t x, uint32_t y = 4, uint32_t z = 4, uint32_t w = 4);

    Port channel(Port a, uint32_t i) { return swizzle(a, 1, i, i, i, i); }

    const scene::PatternValue* constant_value(Port p) const;
    bool is_constant(Port p, float value) const;
    /// Coordinates of this port as a map of a primvar; nothing when they are more, or less.
    std::optional<AffineCoordinates> affine(Port p) const;
    /// The texture that a port is, without anything done to it.
    std::optional<scene::TextureId> whole_texture(Port p) const;

    /// The input that the port feeds: as simple as it can be. stand_in: its Input::value where it
    /// varies. Nothing when the graph has more than scene::max_pattern_steps.
    std::optional<scene::Input> input(Port p, const Rgb& varying_value);

  private:
    using Key = std::tuple<uint8_t, uint8_t, uint16_t, uint16_t, uint16_t, uint16_t, uint32_t>;

    Port add_step(const scene::PatternStep& step, int width);
    std::optional<Port> simplified(scene::PatternOp op, int width, const std::vector<Port>& in);
    Port widened(Port p, int width);
    void follow_coordinates(const scene::PatternStep& step, Port made);

    scene::Scene& scene_;
    std::vector<scene::PatternStep> steps_;
    std::vector<scene::PatternValue> constants_;
    std::vector<std::optional<AffineCoordinates>> affine_;  // [step]
    std::map<Key, uint16_t> known_;
    std::map<std::array<uint32_t, 4>, uint32_t> known_constants_;  // by their bits
    bool is_full_ = false;                                         // steps are missing
};

}  // namespace velatura::translate::materials
