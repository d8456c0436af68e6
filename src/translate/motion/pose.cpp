// SPDX-License-Identifier: Apache-2.0
#include "translate/motion/pose.h"

#include "base/hash.h"
#include "translate/context/values.h"
#include "translate/motion/moving_points.h"
#include "translate/motion/scoped_time.h"
#include "translate/motion/skinning.h"
#include "usd/stage/skeleton.h"
#include "usd/stage/xform.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <unordered_map>

namespace velatura::translate::motion {

namespace {

using usd::layer::Token;
using usd::stage::SkelBinding;
using usd::stage::SkeletonPose;

/// State of this module: poses of skeletons, by path and time.
struct KnownPoses {
    std::unordered_map<std::string, SkeletonPose> by_key;
};

const SkeletonPose& skeleton_pose(Context& ctx, Prim skeleton) {
    std::string key = skeleton.path_string();
    if (!ctx.time.is_default()) key += fmt::format(" {}", ctx.time.value());
    const auto [found, is_new] = ctx.state<KnownPoses>().by_key.try_emplace(std::move(key));
    if (is_new) found->second = usd::stage::skeleton_pose(skeleton, ctx.time);
    return found->second;
}

/// Joint matrices in the order that the prim's joint indices count in.
std::vector<Mat4d> ordered_joints(Context& ctx,
                                  Prim prim,
                                  const SkelBinding& binding,
                                  const SkeletonPose& pose) {
    const auto order = binding.joints.is_valid() ? binding.joints.get<std::vector<Token>>()
                                                 : std::optional<std::vector<Token>>();
    if (!order) return pose.skinning;
    std::unordered_map<Token, size_t> index;
    for (size_t j = 0; j < pose.joints.size(); ++j) index.emplace(pose.joints[j], j);
    std::vector<Mat4d> joints(order->size());
    std::string missing;
    for (size_t j = 0; j < order->size(); ++j) {
        const auto found = index.find((*order)[j]);
        if (found != index.end())
            joints[j] = pose.skinning[found->second];
        else if (missing.empty())
            missing = (*order)[j].str();
    }
    if (!missing.empty())
        ctx.warn("bad-skel-binding", prim,
                 fmt::format("skel:joints names \"{}\", which is not a joint of <{}>; such joints "
                             "have no effect",
                             missing, binding.skeleton.path_string()));
    return joints;
}

/// The influences of `points` elements; nullopt with a warning when they do not fit.
std::optional<Skin> read_skin(
    Context& ctx, Prim prim, const SkelBinding& binding, const SkeletonPose& pose, size_t points) {
    Skin skin;
    skin.joints = ordered_joints(ctx, prim, binding, pose);
    skin.influences = size_t(binding.influences);
    const std::vector<int64_t> indices = read_ints(binding.joint_indices.value(ctx.time));
    int width = 0;
    if (!read_rows(binding.joint_weights.value(ctx.time), skin.weights, width)) skin.weights = {};
    const size_t expected = points * skin.influences;
    if (indices.size() != expected || skin.weights.size() != expected) {
        ctx.warn(
            "bad-skel-binding", binding.joint_indices,
            fmt::format("{} joint indices and {} weights, expected {} ({} for each of {} "
                        "points); the prim keeps its points",
                        indices.size(), skin.weights.size(), expected, skin.influences, points));
        return std::nullopt;
    }
    skin.indices.reserve(indices.size());
    for (size_t i = 0; i < indices.size(); ++i) {
        const bool is_joint = indices[i] >= 0 && size_t(indices[i]) < skin.joints.size();
        if (!is_joint && skin.weights[i] != 0.0) {
            ctx.warn(
                "bad-skel-binding", binding.joint_indices,
                fmt::format("joint index {} at {}, expected 0 to {}; the prim keeps its points",
                            indices[i], i, int64_t(skin.joints.size()) - 1));
            return std::nullopt;
        }
        skin.indices.push_back(is_joint ? uint32_t(indices[i]) : 0);
    }
    if (binding.geom_bind.is_valid())
        skin.geom_bind =
            binding.geom_bind.get<usd::layer::Mat4d>(ctx.time).value_or(usd::layer::Mat4d());
    const std::string method = binding.skinning_method.is_valid()
                                   ? read_text(binding.skinning_method, "classicLinear", ctx.time)
                                   : "classicLinear";
    if (method == "dualQuaternion") {
        skin.method = SkinningMethod::DualQuaternion;
    } else if (method != "classicLinear") {
        ctx.warn("bad-skel-binding", binding.skinning_method,
                 fmt::format("skinningMethod is \"{}\", expected classicLinear or dualQuaternion; "
                             "classicLinear is used",
                             method));
    }
    return skin;
}

/// Adds `factor` times a shape's offsets; false when they do not fit the points.
bool add_target(const usd::stage::BlendShape& shape,
                const usd::stage::BlendShape::Target& target,
                double factor,
                size_t points,
                Pose& pose) {
    if (target.offsets.empty() && target.normal_offsets.empty()) return true;
    const auto fits = [&](const std::vector<Vec3d>& offsets) {
        const size_t expected = shape.point_indices.empty() ? points : shape.point_indices.size();
        return offsets.empty() || offsets.size() == expected;
    };
    if (!fits(target.offsets) || !fits(target.normal_offsets)) return false;
    const size_t count = std::max(target.offsets.size(), target.normal_offsets.size());
    for (size_t i = 0; i < count; ++i) {
        const int64_t point = shape.point_indices.empty() ? int64_t(i) : shape.point_indices[i];
        if (point < 0 || size_t(point) >= points) return false;
        Pose::Offset offset;
        offset.point = size_t(point);
        if (!target.offsets.empty()) offset.point_offset = target.offsets[i] * factor;
        if (!target.normal_offsets.empty()) {
            offset.normal_offset = target.normal_offsets[i] * factor;
            pose.has_normal_offsets = true;
        }
        pose.offsets.push_back(offset);
    }
    return true;
}

void read_blend_shapes(Context& ctx,
                       Prim prim,
                       const SkelBinding& binding,
                       const SkeletonPose& skeleton,
                       size_t points,
                       Pose& pose) {
    const auto names = binding.blend_shapes.get<std::vector<Token>>();
    const auto targets = binding.blend_targets.forwarded_targets();
    if (!names || names->size() != targets.size()) {
        ctx.warn("bad-blend-shapes", binding.blend_shapes,
                 fmt::format("{} skel:blendShapes, but {} skel:blendShapeTargets; they are ignored",
                             names ? names->size() : 0, targets.size()));
        return;
    }
    std::unordered_map<Token, double> weights;
    for (const auto& [name, weight] : skeleton.blend_weights) weights.emplace(name, weight);
    for (size_t i = 0; i < targets.size(); ++i) {
        const auto weight = weights.find((*names)[i]);
        if (weight == weights.end() || weight->second == 0.0) continue;
        const Prim target = ctx.stage.prim_at(targets[i]);
        if (!target || !target.is_a("BlendShape")) {
            ctx.warn("bad-blend-shapes", prim,
                     fmt::format("skel:blendShapeTargets names <{}>, which is not a BlendShape",
                                 targets[i].to_string()));
            continue;
        }
        const usd::stage::BlendShape shape = usd::stage::read_blend_shape(target);
        std::vector<double> keys;
        for (const auto& t : shape.targets) keys.push_back(t.weight);
        const size_t kept = pose.offsets.size();
        for (const auto& [index, factor] : blend_factors(keys, weight->second)) {
            if (add_target(shape, shape.targets[index], factor, points, pose)) continue;
            pose.offsets.resize(kept);
            ctx.warn("bad-blend-shapes", target,
                     fmt::format("offsets do not fit pointIndices or the {} points of <{}>; the "
                                 "blend shape is ignored",
                                 points, prim.path_string()));
            break;
        }
    }
}

bool is_at_or_below(Prim prim, Prim above) {
    for (; prim && !prim.is_pseudo_root(); prim = prim.parent())
        if (prim == above) return true;
    return false;
}

}  // namespace

void Pose::deform_points(std::vector<Vec3d>& points) const {
    for (const Offset& offset : offsets) points[offset.point] += offset.point_offset;
    if (!skin) return;
    const Skinner skinner(*skin);
    for (size_t i = 0; i < points.size(); ++i) points[i] = skinner.point(i, points[i]);
}

void Pose::deform_normals(std::vector<Vec3d>& normals, const std::vector<uint32_t>& owners) const {
    if (has_normal_offsets) {
        std::unordered_map<size_t, Vec3d> by_point;
        for (const Offset& offset : offsets)
            by_point.try_emplace(offset.point, Vec3d(0.0)).first->second += offset.normal_offset;
        for (size_t i = 0; i < normals.size(); ++i) {
            const auto found = by_point.find(owners[i]);
            if (found != by_point.end()) normals[i] += found->second;
        }
    }
    if (!skin) return;
    const Skinner skinner(*skin);
    const size_t points = skin->indices.size() / skin->influences;
    for (size_t i = 0; i < normals.size(); ++i)
        if (owners[i] < points) normals[i] = skinner.normal(owners[i], normals[i]);
}

Vec3d Pose::posed_point(const Vec3d& point) const {
    if (!skin || skin->indices.empty()) return point;
    const Mat4d& joint = skin->joints[skin->indices[0]];
    return transform_point(transform_point(point, skin->geom_bind), joint * matrix);
}

Mat4d matrix_in_frame(Context& ctx, Prim prim, Prim frame) {
    std::vector<Prim> chain;
    Prim at = prim;
    for (; at && !at.is_pseudo_root() && !(frame && at == frame); at = at.parent())
        chain.push_back(at);
    Mat4d matrix;
    for (size_t i = chain.size(); i-- > 0;) {
        const auto local = usd::stage::local_transform(chain[i], ctx.time);
        matrix = local.resets_stack ? local.matrix : local.matrix * matrix;
    }
    const bool is_inside = !frame || frame.is_pseudo_root() || (at && at == frame);
    return is_inside ? matrix : matrix * usd::stage::world_transform(frame, ctx.time).inverse();
}

std::optional<Pose> read_pose(Context& ctx, Prim prim, Prim frame) {
    const std::optional<SkelBinding> binding = usd::stage::skel_binding(prim);
    if (!binding) return std::nullopt;
    const SkeletonPose& skeleton = skeleton_pose(ctx, binding->skeleton);
    Pose pose;
    const bool has_joints = binding->has_joints() && !skeleton.skinning.empty();
    const bool is_point_based = prim.is_a("PointBased");
    if (has_joints && binding->is_rigid) {
        if (const auto skin = read_skin(ctx, prim, *binding, skeleton, 1)) {
            pose.is_rigid = true;
            pose.matrix = Skinner(*skin).matrix(0) * matrix_in_frame(ctx, binding->skeleton, frame);
        }
    }
    if (!is_point_based) {
        if (has_joints && !binding->is_rigid)
            ctx.warn("bad-skel-binding", binding->joint_indices,
                     fmt::format("a {} has no points; only constant joint indices can move it",
                                 prim.type_name().str()));
        return pose.is_rigid ? std::optional<Pose>(pose) : std::nullopt;
    }
    const auto count_points = [&] {
        const ScopedTime quietly(ctx, ctx.time);
        return read_points(ctx, prim, nullptr).size();
    };
    const size_t points = count_points();
    if (binding->has_blend_shapes()) read_blend_shapes(ctx, prim, *binding, skeleton, points, pose);
    if (has_joints && !binding->is_rigid) {
        pose.skin = read_skin(ctx, prim, *binding, skeleton, points);
        if (pose.skin) pose.matrix = matrix_in_frame(ctx, binding->skeleton, frame);
    }
    if (!pose.is_rigid && !pose.skin && pose.offsets.empty()) return std::nullopt;
    return pose;
}

std::string skel_signature(Context& ctx, Prim instance) {
    const bool is_below_root = usd::stage::is_below_skel_root(instance);
    const Prim animation = usd::stage::animation_source(instance);
    if (!is_below_root && !animation) return {};
    const auto relative = [&](const usd::layer::Path& path) {
        const std::string text = path.to_string(), above = instance.path_string();
        return text.starts_with(above + "/") ? "." + text.substr(above.size()) : text;
    };
    std::string signature = is_below_root ? "|skel root" : "|skel";
    // Skeletons of the prototype may take their animation from above it
    if (animation) signature += " " + relative(animation.path());
    for (Prim prim = instance; prim && !prim.is_pseudo_root(); prim = prim.parent()) {
        if (!prim.has_api("SkelBindingAPI")) continue;
        for (const std::string& joint : read_texts(prim.attribute("skel:joints"), ctx.time))
            signature += " " + joint;
        signature += " " + read_text(prim.attribute("primvars:skel:skinningMethod"), "", ctx.time);
        const auto bind = prim.attribute("primvars:skel:geomBindTransform")
                              .get<usd::layer::Mat4d>(ctx.time)
                              .value_or(usd::layer::Mat4d());
        uint64_t hash = 0;
        for (int i = 0; i < 16; ++i)
            hash = hash_combine(hash, std::bit_cast<uint64_t>(bind[i / 4][i % 4]));
        for (const char* name : {"primvars:skel:jointIndices", "primvars:skel:jointWeights"}) {
            std::vector<double> rows;
            int width = 0;
            read_rows(prim.attribute(name).value(ctx.time), rows, width);
            for (const double v : rows) hash = hash_combine(hash, std::bit_cast<uint64_t>(v));
        }
        signature += fmt::format(" {:x}", hash);
        for (const auto& target : prim.relationship("skel:skeleton").forwarded_targets()) {
            const Prim skeleton = ctx.stage.prim_at(target);
            // Where a skeleton from outside stands depends on where the instance stands
            const bool is_inside = skeleton && is_at_or_below(skeleton, instance);
            signature += " " + (is_inside ? relative(target) : instance.path_string());
        }
    }
    return signature;
}

}  // namespace velatura::translate::motion
