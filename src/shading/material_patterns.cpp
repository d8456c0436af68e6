// SPDX-License-Identifier: Apache-2.0
// Node graphs of materials at a surface point.
#include "geometry/geometry_set.h"
#include "geometry/triangle_mesh.h"
#include "scene/effect_calls.h"
#include "scene/pattern.h"
#include "shading/material_evaluator.h"

#include <array>
#include <cmath>

namespace velatura::shading {

using geometry::SurfacePoint;
using scene::count_call;
using scene::Effect;
using scene::PatternOp;
using scene::PatternStep;
using scene::PatternValue;

namespace {

/// The point in the space of its shape; of a mesh that moves where it was when the shutter opened,
/// so that a pattern moves along.
PatternValue shape_position(const scene::Scene& scene, const SurfacePoint& point) {
    if (point.mesh->segments() > 0) {
        const auto corner = [&](int k) { return Vec3d(point.mesh->corner(point.triangle, k)); };
        const Vec3d p0 = corner(0);
        const Vec3d e1 = corner(1) - p0, e2 = corner(2) - p0;
        const Vec3d p = p0 + e1 * double(point.b1) + e2 * double(point.b2);
        return {float(p.x), float(p.y), float(p.z), 0.0f};
    }
    if (point.instance == scene::none) return {point.p.x, point.p.y, point.p.z, 0.0f};
    const Mat4d forward(
        geometry::render_from_prototype(scene.instances[point.instance], point.time));
    const Vec3d p = Vec3d(point.p) * forward.inverse();
    return {float(p.x), float(p.y), float(p.z), 0.0f};
}

PatternValue padded(const Vec3& v) {
    return {v.x, v.y, v.z, 0.0f};
}

}  // namespace

/// What a step knows of the point itself.
PatternValue MaterialEvaluator::pattern_source(const scene::Pattern& pattern,
                                               const PatternStep& step,
                                               const PatternValue* values,
                                               const SurfacePoint& point,
                                               float footprint) const {
    switch (step.op) {
        case PatternOp::Constant:
            return pattern.constants[step.data];
        case PatternOp::Texture: {
            const TexelRgba c = texture(step.data, point, footprint);
            return {c[0], c[1], c[2], c[3]};
        }
        case PatternOp::TextureAt: {
            count_call(Effect::Textures);
            const PatternValue& st = values[step.in[0]];
            const Vec2 place(std::isfinite(st.x) ? st.x : 0.0f, std::isfinite(st.y) ? st.y : 0.0f);
            const TexelRgba c = textures_.lookup(texture_handles_[step.data], place, Vec2(0.0f));
            return {c[0], c[1], c[2], c[3]};
        }
        case PatternOp::Primvar: {
            count_call(Effect::VaryingColors);
            const PatternValue& fallback = values[step.in[0]];
            float out[4] = {fallback.x, fallback.y, fallback.z, fallback.w};
            const bool is_there = geometry::primvar(scene_, point, step.data, out);
            if (is_there && step.width == 1) return PatternValue(out[0]);
            return {out[0], out[1], out[2], out[3]};
        }
        case PatternOp::Position:
            return step.data == 0 ? padded(point.p) : shape_position(scene_, point);
        default:
            return padded(point.ns);
    }
}

PatternValue MaterialEvaluator::pattern(scene::PatternId id,
                                        const SurfacePoint& point,
                                        float footprint) const {
    count_call(Effect::Patterns);
    const scene::Pattern& pattern = scene_.patterns[id];
    // Not cleared: every step writes its own before another reads it
    std::array<PatternValue, scene::max_pattern_steps> values;
    size_t i = 0;
    for (const PatternStep& step : pattern.steps) {
        if (scene::is_pure(step.op)) {
            const PatternValue in[4] = {values[step.in[0]], values[step.in[1]], values[step.in[2]],
                                        values[step.in[3]]};
            values[i++] = scene::result_of(step, in);
        } else {
            values[i] = pattern_source(pattern, step, values.data(), point, footprint);
            ++i;
        }
    }
    const PatternValue& result = values[pattern.steps.size() - 1];
    const bool is_finite =
        std::isfinite(result.x) && std::isfinite(result.y) && std::isfinite(result.z);
    return is_finite ? result : PatternValue(0.0f);
}

}  // namespace velatura::shading
