// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/moving_shape.h"

#include "translate/context/instance_source.h"
#include "translate/instancing/instancing.h"
#include "translate/instancing/placement_motion.h"
#include "translate/lights/mesh_lights.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/shutter.h"
#include "translate/motion/unblurred.h"

#include <fmt/format.h>

#include <memory>
#include <utility>

namespace velatura::translate::instancing {

bool place_moving_shape(Context& ctx,
                        Prim prim,
                        const Mat4d& matrix,
                        const Vec3d& near,
                        const MovingPrim& moving,
                        InstanceSource& parent) {
    if (!ctx.shutter) return false;
    motion::warn_if_it_deforms(ctx, prim, parent.frame);
    if (!motion::can_be_carried(ctx, prim, parent.frame)) return false;
    auto own = std::make_unique<InstanceSource>();
    own->name = prim.path_string();
    own->frame = prim;
    propose_origin(*own, near);
    {
        // What is wrong with it was said
        const motion::ScopedTime quietly(ctx, ctx.time);
        std::optional<scene::Shape> shape = moving.read(relative_to(Mat4d(), own->origin));
        if (!shape) return false;
        own->shapes.push_back(std::move(*shape));
    }
    Placement placement;
    placement.what = own.get();
    placement.matrix = between_origins(matrix, own->origin, parent.origin);
    placement.provenance = own->shapes[0].provenance;
    read_placement_motion(ctx, prim, parent, placement);
    if (placement.later.empty()) return false;
    if (moving.is_light)
        lights::make_mesh_light(ctx, {prim, relative_to(Mat4d(), own->origin)}, own->shapes[0]);
    // A prim may be read for several prototypes
    auto& known = ctx.state<InstanceSources>().by_key;
    known[fmt::format("moving {} {}", known.size(), own->name)] = std::move(own);
    parent.placements.push_back(std::move(placement));
    return true;
}

}  // namespace velatura::translate::instancing
