// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/instance_source.h"

#include <memory>
#include <string>
#include <unordered_map>

namespace velatura::translate::instancing {

/// State of this module: what is placed, by what it is made of.
struct InstanceSources {
    std::unordered_map<std::string, std::unique_ptr<InstanceSource>> by_key;
};

/// Collects what stands at or below a prim, given the matrix of what is above it: translate/walk.h.
using Walk = void (*)(Context& ctx, Prim prim, const Mat4d& matrix, InstanceSource& out);

/// Placements of a PointInstancer in the space of its holder. walk: see point_prototype.
void read_point_instancer(
    Context& ctx, Prim prim, const Mat4d& matrix, InstanceSource& out, Walk walk);
/// Prototype of a native instance, whose children are walked on first use; nullptr inside itself.
InstanceSource* native_prototype(Context& ctx, Prim instance, Walk walk_children);
/// Prototype of a point instancer: the prim with its own transform and everything below, which is
/// walked on first use; nullptr inside itself.
InstanceSource* point_prototype(Context& ctx, Prim root, const Prim& instancer, Walk walk);

}  // namespace velatura::translate::instancing
