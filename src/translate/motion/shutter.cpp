// SPDX-License-Identifier: Apache-2.0
#include "translate/motion/shutter.h"

#include "translate/motion/pose.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/velocities.h"
#include "usd/stage/skeleton.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::translate::motion {

std::vector<Prim> chain_of(Prim prim, Prim frame) {
    std::vector<Prim> chain;
    for (Prim at = prim; at && !at.is_pseudo_root() && !(frame && at == frame); at = at.parent())
        chain.push_back(at);
    return chain;
}

bool can_be_carried(Context& ctx, Prim prim, Prim frame) {
    const std::vector<Prim> chain = chain_of(prim, frame);
    return std::any_of(chain.begin(), chain.end(), [&](Prim at) {
        return usd::stage::local_transform(at, ctx.time).might_be_varying ||
               usd::stage::skel_binding(at);
    });
}

Mat4d carried_by(Context& ctx, Prim prim, Prim frame, TimeCode time) {
    const ScopedTime at(ctx, time);
    const std::optional<Pose> pose = read_pose(ctx, prim, frame);
    return pose && pose->is_rigid ? pose->matrix : matrix_in_frame(ctx, prim, frame);
}

std::optional<Shutter> shutter_of(Context& ctx, Prim prim) {
    if (!ctx.shutter) return std::nullopt;
    double scale = inherited_number(ctx, prim, "motion:blurScale", 1.0);
    if (scale < 0.0) {
        ctx.warn("bad-motion-scale", prim, fmt::format("motion:blurScale is {}, 1 is used", scale));
        scale = 1.0;
    }
    if (scale == 0.0) {
        using enum scene::Effect;
        for (const scene::Effect blur : {CameraBlur, TransformBlur, DeformationBlur})
            if ((blur == CameraBlur) == prim.is_a("Camera"))
                ctx.note_zero(blur, prim, "motion:blurScale 0");
        return std::nullopt;
    }
    const auto scaled = [&](double time) {
        return scale == 1.0 ? time : ctx.frame.value() + scale * (time - ctx.frame.value());
    };
    return Shutter{scaled(ctx.shutter->open), scaled(ctx.shutter->close)};
}

}  // namespace velatura::translate::motion
