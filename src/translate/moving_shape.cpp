// SPDX-License-Identifier: Apache-2.0
#include "translate/another_time.h"
#include "translate/motion.h"
#include "translate/parts.h"

#include <fmt/format.h>

#include <memory>
#include <utility>

namespace velatura::translate {

bool place_moving_shape(Context& ctx,
                        Prim prim,
                        const Mat4d& matrix,
                        const Vec3d& near,
                        const ShapeReader& read,
                        Placeable& holder) {
    if (!ctx.shutter) return false;
    warn_if_it_deforms(ctx, prim, holder.frame);
    if (!may_be_carried(ctx, prim, holder.frame)) return false;
    auto own = std::make_unique<Placeable>();
    own->name = prim.path_string();
    own->frame = prim;
    propose_origin(*own, near);
    {
        // What is wrong with it was said
        const AnotherTime quietly(ctx, ctx.time);
        std::optional<scene::Shape> shape = read(relative_to(Mat4d(), own->origin));
        if (!shape) return false;
        own->shapes.push_back(std::move(*shape));
    }
    Placement placement;
    placement.what = own.get();
    placement.matrix = between_origins(matrix, own->origin, holder.origin);
    placement.provenance = own->shapes[0].provenance;
    read_placement_motion(ctx, prim, holder, placement);
    if (placement.later.empty()) return false;
    // A prim may be read for several prototypes
    ctx.placeables[fmt::format("moving {} {}", ctx.placeables.size(), own->name)] = std::move(own);
    holder.placements.push_back(std::move(placement));
    return true;
}

}  // namespace velatura::translate
