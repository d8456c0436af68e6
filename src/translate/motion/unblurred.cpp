// SPDX-License-Identifier: Apache-2.0
// What moves and is rendered as it is at the frame's instant.
#include "translate/motion/unblurred.h"

#include "translate/motion/moving_points.h"
#include "translate/motion/pose.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "usd/stage/skeleton.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <vector>

namespace velatura::translate::motion {

namespace {

/// Attributes that hold the shape of prims that are no meshes, beside points.
constexpr const char* shape_attributes[] = {"widths", "normals", "radius", "radiusTop",
                                            "height", "size",    "width",  "length"};

/// Times at which what moves is asked for where it is.
std::vector<double> moments(const Shutter& shutter) {
    return {shutter.open, 0.5 * (shutter.open + shutter.close), shutter.close};
}

bool differs(const Context& ctx, const Attribute& attribute, double time) {
    return attribute.might_be_time_varying() &&
           !(attribute.value(time) == attribute.value(ctx.frame));
}

/// Points of the prim where its skeleton moves them.
std::vector<Vec3d> posed_points(Context& ctx, Prim prim, Prim frame, TimeCode time) {
    const ScopedTime at(ctx, time);
    const std::optional<Pose> pose = read_pose(ctx, prim, frame);
    std::vector<Vec3d> points = read_points(ctx, prim, pose ? &*pose : nullptr);
    if (pose && pose->skin)
        for (Vec3d& p : points) p = transform_point(p, pose->matrix);
    return points;
}

bool deforms(Context& ctx, Prim prim, Prim frame, const Shutter& shutter) {
    const std::vector<double> times = moments(shutter);
    const auto is_other = [&](const char* name) {
        return std::any_of(times.begin(), times.end(),
                           [&](double time) { return differs(ctx, prim.attribute(name), time); });
    };
    if (std::any_of(std::begin(shape_attributes), std::end(shape_attributes), is_other))
        return true;
    const bool can_move = has_velocities(ctx, prim) ||
                          prim.attribute("points").might_be_time_varying() ||
                          usd::stage::skel_binding(prim);
    if (!can_move) return false;
    const std::vector<Vec3d> now = posed_points(ctx, prim, frame, ctx.frame);
    return std::any_of(times.begin(), times.end(),
                       [&](double time) { return posed_points(ctx, prim, frame, time) != now; });
}

}  // namespace

void warn_if_it_moves(Context& ctx, Prim prim, Prim frame) {
    const std::optional<Shutter> shutter = shutter_of(ctx, prim);
    if (!shutter) return;
    const Mat4d now = carried_by(ctx, prim, frame, ctx.frame);
    const std::vector<double> times = moments(*shutter);
    const bool is_carried = std::any_of(times.begin(), times.end(), [&](double time) {
        if (carried_by(ctx, prim, frame, time) != now) return true;
        return differs(ctx, prim.attribute("positions"), time) ||
               differs(ctx, prim.attribute("orientations"), time) ||
               differs(ctx, prim.attribute("scales"), time);
    });
    if (!is_carried && !deforms(ctx, prim, frame, *shutter)) return;
    ctx.note_not_simulated(scene::Effect::TransformBlur, prim, "moves while the shutter is open");
    ctx.warn("unsupported-motion-blur", prim,
             fmt::format("a moving {}{} is rendered without motion blur, at the frame time: what a "
                         "joint carries together with its ancestors, or bends, is not blurred",
                         prim.type_name().str(), prim.is_instance() ? " as an instance" : ""));
}

bool changes_shape(Context& ctx, Prim prim, Prim frame) {
    const std::optional<Shutter> shutter = shutter_of(ctx, prim);
    return shutter && deforms(ctx, prim, frame, *shutter);
}

void warn_if_it_deforms(Context& ctx, Prim prim, Prim frame) {
    if (!changes_shape(ctx, prim, frame)) return;
    ctx.note_not_simulated(scene::Effect::DeformationBlur, prim,
                           "changes its shape while the shutter is open");
    ctx.warn(
        "unsupported-motion-blur", prim,
        fmt::format("a deforming {} is rendered without deformation blur, with its shape at the "
                    "frame time; supported are meshes, and up to a million Points with constant "
                    "ids, a material that does not read their position, and no skeleton",
                    prim.type_name().str()));
}

}  // namespace velatura::translate::motion
