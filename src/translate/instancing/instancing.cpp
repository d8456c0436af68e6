// SPDX-License-Identifier: Apache-2.0
#include "translate/instancing/instancing.h"

#include "base/hash.h"
#include "translate/context/instance_source.h"
#include "translate/context/missing_values.h"
#include "translate/context/values.h"
#include "translate/instancing/instancer_motion.h"
#include "translate/instancing/instancer_places.h"
#include "translate/instancing/instancer_primvars.h"
#include "translate/materials/materials.h"
#include "translate/motion/pose.h"
#include "translate/motion/velocities.h"
#include "usd/stage/imageable.h"
#include "usd/stage/material_binding.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <unordered_set>

namespace velatura::translate::instancing {

namespace {

/// What an instance hands down to its prototype's prims: two instances share geometry only if this
/// is the same.
std::string inherited_signature(Context& ctx, Prim instance) {
    const std::string purpose = usd::stage::computed_purpose(instance);
    std::string signature = "|" + purpose;
    if (!usd::stage::is_purpose_visible(instance, purpose)) signature += " invisible";
    // What a render pass shows may depend on where the instance stands
    if (ctx.rendered.pass) signature += "|" + instance.path_string();
    const auto binding = usd::stage::resolve_material(
        instance, ctx.state<materials::TranslatedMaterials>().purposes);
    if (binding.is_bound()) {
        signature += "|" + (binding.material ? binding.material.path_string() : "no material");
        const auto strength = binding.relation.metadata("bindMaterialAs");
        if (strength) {
            if (const auto* token = strength->get_if<usd::layer::Token>())
                signature += "|" + token->str();
        }
    }
    for (Prim prim = instance; prim && !prim.is_pseudo_root(); prim = prim.parent()) {
        // Collections may pick out prims below one instance and not below another
        for (const auto& name : prim.property_names())
            if (name.str().rfind("material:binding:collection", 0) == 0)
                return signature + "|" + instance.path_string();
    }
    for (const auto& primvar : usd::stage::find_primvars(instance)) {
        if (primvar.interpolation != usd::stage::Interpolation::Constant) continue;
        std::vector<double> rows;
        int width = 0;
        read_rows(primvar.attribute.value(ctx.time), rows, width);
        uint64_t hash = uint64_t(width);
        for (const double v : rows) hash = hash_combine(hash, std::bit_cast<uint64_t>(v));
        if (primvar.is_indexed())
            for (const int i : primvar.index_values(ctx.time))
                hash = hash_combine(hash, uint64_t(uint32_t(i)));
        const bool yields = ctx.is_outside_prototype(primvar.attribute.prim());
        signature += fmt::format("|{}={:x}{}", primvar.name, hash, yields ? "^" : "");
    }
    for (const char* scale : {"motion:blurScale", "motion:velocityScale"})
        signature += fmt::format("|{}", motion::inherited_number(ctx, instance, scale, 1.0));
    return signature + motion::skel_signature(ctx, instance);
}

/// The placeable under a key, and whether it is new.
std::pair<InstanceSource*, bool> placeable_of(Context& ctx, const std::string& key) {
    auto& slot = ctx.state<InstanceSources>().by_key[key];
    const bool is_new = !slot;
    if (is_new) slot = std::make_unique<InstanceSource>();
    return {slot.get(), is_new};
}

/// Which prototype each instance is of, and which are not shown.
struct InstancerArrays {
    std::vector<int64_t> prototype_indices, ids;
    std::unordered_set<int64_t> hidden_ids;
};

InstancerArrays read_arrays(Context& ctx, Prim prim) {
    InstancerArrays in;
    in.prototype_indices = read_ints(prim.attribute("protoIndices").value(ctx.time));
    const size_t n = in.prototype_indices.size();
    in.ids = read_ints(prim.attribute("ids").value(ctx.time));
    if (!in.ids.empty() && in.ids.size() != n) {
        ctx.warn("bad-instancer", prim.attribute("ids"),
                 fmt::format("ids has {} elements, expected {}; it is ignored, and instances are "
                             "identified by index",
                             in.ids.size(), n));
        in.ids.clear();
    }
    for (const int64_t id : read_ints(prim.attribute("invisibleIds").value(ctx.time)))
        in.hidden_ids.insert(id);
    if (const auto inactive = prim.metadata("inactiveIds")) {
        if (const auto* op = inactive->get_if<usd::layer::ListOp<int64_t>>())
            for (const int64_t id : op->applied()) in.hidden_ids.insert(id);
    }
    return in;
}

}  // namespace

InstanceSource* native_prototype(Context& ctx, Prim instance, Walk walk_children) {
    Prim prototype = instance.prototype();
    if (!prototype) prototype = instance;
    const std::string key = prototype.path_string() + inherited_signature(ctx, instance);
    const auto [instance_source, is_new] = placeable_of(ctx, key);
    if (instance_source->is_being_built) return nullptr;
    if (is_new) {
        instance_source->name = prototype.path_string();
        instance_source->frame = instance;
        instance_source->is_being_built = true;
        walk_children(ctx, instance, Mat4d(), *instance_source);
        instance_source->is_being_built = false;
    }
    return instance_source;
}

InstanceSource* point_prototype(Context& ctx, Prim root, const Prim& instancer, Walk walk) {
    const auto [instance_source, is_new] = placeable_of(ctx, "point " + root.path_string());
    if (instance_source->is_being_built) return nullptr;
    if (is_new) {
        instance_source->name = root.path_string();
        instance_source->frame = root.parent();
        instance_source->is_point_prototype = true;
        instance_source->is_being_built = true;
        ctx.point_prototypes.push_back({root.path(), primvar_names(instancer)});
        walk(ctx, root, Mat4d(), *instance_source);
        ctx.point_prototypes.pop_back();
        instance_source->is_being_built = false;
    }
    return instance_source;
}

void read_point_instancer(
    Context& ctx, Prim prim, const Mat4d& matrix, InstanceSource& out, Walk walk) {
    std::vector<InstanceSource*> prototypes;
    for (const auto& path : prim.relationship("prototypes").forwarded_targets()) {
        const Prim root = ctx.stage.prim_at(path);
        InstanceSource* instance_source = root ? point_prototype(ctx, root, prim, walk) : nullptr;
        prototypes.push_back(instance_source);
        if (instance_source == nullptr)
            ctx.warn("bad-instancer", prim,
                     fmt::format("prototype <{}> {}; its instances are skipped", path.to_string(),
                                 root ? "contains this instancer" : "does not exist"));
    }
    if (lacks_array(ctx, prim, {"protoIndices"}, "bad-instancer")) return;
    const InstancerArrays in = read_arrays(ctx, prim);
    const size_t n = in.prototype_indices.size();
    const InstancerPlaces places(ctx, prim, n);
    const InstanceRows rows = places.at(ctx.time);
    // Positions of another number than the instances have been named where they were read
    if (const std::string reason = missing_array(prim.attribute("positions"), ctx.frame);
        rows.positions.empty() && n > 0 && !reason.empty())
        ctx.warn("bad-instancer", prim, fmt::format("{}; all instances are at the origin", reason));
    InstancerPrimvars primvars(ctx, prim, n);
    primvars.warn_displacement(prototypes);
    const scene::ProvenanceId provenance = ctx.provenance(prim);
    const size_t first = out.placements.size();
    std::vector<size_t> placed;  // the instance of each placement from `first` on
    size_t outside = 0;
    for (size_t i = 0; i < n; ++i) {
        const int64_t id = in.ids.empty() ? int64_t(i) : in.ids[i];
        if (in.hidden_ids.contains(id)) continue;
        const int64_t which = in.prototype_indices[i];
        if (which < 0 || size_t(which) >= prototypes.size()) {
            ++outside;
            continue;
        }
        if (prototypes[size_t(which)] == nullptr) continue;
        Placement placement;
        placement.what = prototypes[size_t(which)];
        const Vec3d nowhere(0.0);
        const Mat4d local = between_origins(rows.matrix(i), placement.what->origin, nowhere);
        if (!out.is_stage && !out.is_origin_fixed)
            propose_origin(out,
                           transform_point(Vec3d(local[3][0], local[3][1], local[3][2]), matrix));
        placement.matrix = local * relative_to(matrix, out.origin);
        placement.provenance = provenance;
        const ValueRange values = primvars.of(i);
        placement.first_value = values.first;
        placement.value_count = values.count;
        out.placements.push_back(std::move(placement));
        placed.push_back(i);
        out.is_origin_fixed = true;
    }
    if (outside > 0)
        ctx.warn(
            "bad-instancer", prim.attribute("protoIndices"),
            fmt::format("{} of {} protoIndices name none of the {} prototypes, these instances "
                        "are skipped",
                        outside, n, prototypes.size()));
    read_instancer_motion(ctx, prim, matrix, places, out,
                          {std::span(out.placements).subspan(first), placed});
}

}  // namespace velatura::translate::instancing
