// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/skeleton.h"

#include "usd/stage/prim_data.h"
#include "usd/stage/primvars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <string_view>
#include <unordered_map>

namespace velatura::usd::stage {

using layer::Token;

namespace {

constexpr std::string_view api = "SkelBindingAPI";

void warn(const Prim& prim, const char* code, SourceLoc loc, std::string message) {
    prim.diagnostics().warn(code, loc, prim.path_string(), std::move(message));
}

/// The first prim a relationship leads to; an invalid Prim when it names none.
Prim first_target(const Relationship& relation) {
    const auto targets = relation.forwarded_targets();
    if (targets.empty()) return Prim();
    return Prim(relation.prim().data()->stage->find(targets.front()));
}

Prim target_of_type(const Relationship& relation, const char* type) {
    const Prim target = first_target(relation);
    if (target && target.is_a(type)) return target;
    if (!relation.targets().empty())
        warn(relation.prim(), "usd-skel-target", relation.loc(),
             fmt::format("{} targets <{}>, which is not a {}", relation.name().str(),
                         relation.targets().front().to_string(), type));
    return Prim();
}

/// Takes over what `prim` says and what no descendant of it has said.
void inherit(SkelBinding& binding, bool& is_skeleton_decided, const Prim& prim) {
    if (!prim.has_api(api)) return;
    const auto take = [&](Attribute& attribute, const char* name) {
        if (attribute.is_valid()) return;
        const Attribute found = prim.attribute(name);
        if (found.has_authored_value()) attribute = found;
    };
    if (const Relationship relation = prim.relationship("skel:skeleton");
        !is_skeleton_decided && relation.has_authored_targets()) {
        is_skeleton_decided = true;
        binding.skeleton = target_of_type(relation, "Skeleton");
    }
    take(binding.joint_indices, "primvars:skel:jointIndices");
    take(binding.joint_weights, "primvars:skel:jointWeights");
    take(binding.joints, "skel:joints");
    take(binding.geom_bind, "primvars:skel:geomBindTransform");
    take(binding.skinning_method, "primvars:skel:skinningMethod");
}

/// Checks indices against weights; false when they cannot be used together.
bool read_influences(SkelBinding& binding, const Prim& prim) {
    if (!binding.joint_indices.is_valid() || !binding.joint_weights.is_valid()) {
        if (binding.joint_indices.is_valid() != binding.joint_weights.is_valid())
            warn(prim, "usd-skel-influences",
                 (binding.joint_indices.is_valid() ? binding.joint_indices : binding.joint_weights)
                     .loc(),
                 "jointIndices and jointWeights must both be authored, the prim is not skinned");
        return false;
    }
    const Primvar indices = as_primvar(binding.joint_indices, Interpolation::Constant);
    const Primvar weights = as_primvar(binding.joint_weights, Interpolation::Constant);
    const bool is_known = indices.interpolation == Interpolation::Constant ||
                          indices.interpolation == Interpolation::Vertex;
    if (indices.element_size != weights.element_size ||
        indices.interpolation != weights.interpolation || !is_known) {
        warn(prim, "usd-skel-influences", binding.joint_indices.loc(),
             fmt::format("jointIndices ({}, elementSize {}) and jointWeights ({}, elementSize {}) "
                         "must agree and be constant or vertex, the prim is not skinned",
                         interpolation_name(indices.interpolation), indices.element_size,
                         interpolation_name(weights.interpolation), weights.element_size));
        return false;
    }
    binding.influences = indices.element_size;
    binding.is_rigid = indices.interpolation == Interpolation::Constant;
    return true;
}

std::vector<Token> tokens(const Attribute& attribute) {
    return attribute.get<std::vector<Token>>().value_or(std::vector<Token>());
}

/// Index of the parent joint by joint, its nearest listed ancestor; -1 for roots.
std::vector<int> joint_parents(const std::vector<Token>& joints) {
    std::unordered_map<std::string_view, int> index;
    for (size_t i = 0; i < joints.size(); ++i) index.emplace(joints[i].view(), int(i));
    std::vector<int> parents(joints.size(), -1);
    for (size_t i = 0; i < joints.size(); ++i) {
        std::string_view at = joints[i].view();
        while (parents[i] < 0) {
            const size_t slash = at.rfind('/');
            if (slash == std::string_view::npos || slash == 0) break;
            at = at.substr(0, slash);
            const auto found = index.find(at);
            if (found != index.end()) parents[i] = found->second;
        }
    }
    return parents;
}

/// Joint matrices into the skeleton's space from those into the parent joint's.
std::vector<Mat4d> concatenated(const std::vector<Token>& joints, std::vector<Mat4d> local) {
    const std::vector<int> parents = joint_parents(joints);
    // The name of a parent is shorter than that of its child
    std::vector<size_t> order(joints.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return joints[a].view().size() < joints[b].view().size();
    });
    for (const size_t i : order)
        if (parents[i] >= 0) local[i] = local[i] * local[size_t(parents[i])];
    return local;
}

/// S · R · T with the rotation made unit.
Mat4d joint_matrix(const layer::Vec3d& scale,
                   const layer::QuatDouble& rotation,
                   const layer::Vec3d& translation) {
    const double length = std::sqrt(rotation.r * rotation.r + rotation.v.dot(rotation.v));
    const bool is_rotation = length > 0.0 && std::isfinite(length);
    const double w = is_rotation ? rotation.r / length : 1.0;
    const Vec3d v = is_rotation ? rotation.v / length : Vec3d(0.0);
    const double x = v.x, y = v.y, z = v.z;
    Mat4d m(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (z * x - y * w), 0,
            2 * (x * y - z * w), 1 - 2 * (z * z + x * x), 2 * (y * z + x * w), 0,
            2 * (z * x + y * w), 2 * (y * z - x * w), 1 - 2 * (y * y + x * x), 0, translation.x,
            translation.y, translation.z, 1);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) m[r][c] *= scale[r];
    return m;
}

/// Puts the animation's joint matrices in their places of `local`; `is_set` marks them.
void apply_animation(const Prim& animation,
                     const std::vector<Token>& joints,
                     TimeCode time,
                     std::vector<Mat4d>& local,
                     std::vector<bool>& is_set) {
    const std::vector<Token> order = tokens(animation.attribute("joints"));
    const auto translations = animation.attribute("translations")
                                  .get<std::vector<layer::Vec3d>>(time)
                                  .value_or(std::vector<layer::Vec3d>());
    const auto rotations = animation.attribute("rotations")
                               .get<std::vector<layer::QuatDouble>>(time)
                               .value_or(std::vector<layer::QuatDouble>());
    const auto scales = animation.attribute("scales").get<std::vector<layer::Vec3d>>(time).value_or(
        std::vector<layer::Vec3d>());
    // Without any of the three the animation says nothing about joints, which is its right
    if (translations.empty() || rotations.empty() || scales.empty()) return;
    if (translations.size() != order.size() || rotations.size() != order.size() ||
        scales.size() != order.size()) {
        warn(animation, "usd-skel-animation", animation.loc(),
             fmt::format("{} joints, but {} translations, {} rotations and {} scales; the joints "
                         "stay at rest",
                         order.size(), translations.size(), rotations.size(), scales.size()));
        return;
    }
    std::unordered_map<Token, size_t> index;
    for (size_t i = 0; i < order.size(); ++i) index.emplace(order[i], i);
    for (size_t j = 0; j < joints.size(); ++j) {
        const auto found = index.find(joints[j]);
        if (found == index.end()) continue;
        const size_t i = found->second;
        local[j] = joint_matrix(scales[i], rotations[i], translations[i]);
        is_set[j] = true;
    }
}

/// Joint matrices into the parent joint's space; nullopt with a warning when some joint has none.
std::optional<std::vector<Mat4d>> local_matrices(const Prim& skeleton,
                                                 const Prim& animation,
                                                 const std::vector<Token>& joints,
                                                 TimeCode time) {
    std::vector<Mat4d> local(joints.size());
    std::vector<bool> is_set(joints.size(), false);
    if (animation) apply_animation(animation, joints, time, local, is_set);
    if (std::find(is_set.begin(), is_set.end(), false) == is_set.end()) return local;
    const Attribute attribute = skeleton.attribute("restTransforms");
    const auto rest = attribute.get<std::vector<layer::Mat4d>>();
    if (!rest || rest->size() != joints.size()) {
        warn(skeleton, "usd-skel-rest", attribute.loc(),
             fmt::format("{} joints, but {} restTransforms; the skeleton is ignored", joints.size(),
                         rest ? rest->size() : 0));
        return std::nullopt;
    }
    for (size_t j = 0; j < joints.size(); ++j)
        if (!is_set[j]) local[j] = (*rest)[j];
    return local;
}

std::vector<Mat4d> skinning_matrices(const Prim& skeleton,
                                     const Prim& animation,
                                     const std::vector<Token>& joints,
                                     TimeCode time) {
    auto local = local_matrices(skeleton, animation, joints, time);
    if (!local) return {};
    const Attribute attribute = skeleton.attribute("bindTransforms");
    const auto bind = attribute.get<std::vector<layer::Mat4d>>();
    if (!bind || bind->size() != joints.size()) {
        warn(skeleton, "usd-skel-bind", attribute.loc(),
             fmt::format("{} joints, but {} bindTransforms; the skeleton is ignored", joints.size(),
                         bind ? bind->size() : 0));
        return {};
    }
    std::vector<Mat4d> skinning = concatenated(joints, *std::move(local));
    size_t singular = 0;
    for (size_t j = 0; j < joints.size(); ++j) {
        // What stands as it was bound must not move by a rounding error
        if (skinning[j] == (*bind)[j]) {
            skinning[j] = Mat4d();
        } else if (determinant3((*bind)[j]) == 0.0 || !is_finite((*bind)[j])) {
            ++singular;
            skinning[j] = Mat4d();
        } else {
            skinning[j] = (*bind)[j].inverse() * skinning[j];
        }
    }
    if (singular > 0)
        warn(skeleton, "usd-skel-bind", attribute.loc(),
             fmt::format("{} bindTransforms are singular; their joints are ignored", singular));
    return skinning;
}

std::vector<Vec3d> vectors(const Attribute& attribute) {
    return attribute.get<std::vector<layer::Vec3d>>().value_or(std::vector<layer::Vec3d>());
}

/// Adds the in-between shape of an attribute "inbetweens:NAME".
void add_inbetween(BlendShape& shape, const Attribute& attribute) {
    const auto metadata = attribute.metadata("weight");
    std::optional<double> weight;
    if (metadata) {
        if (const auto* f = metadata->get_if<float>()) weight = double(*f);
        if (const auto* d = metadata->get_if<double>()) weight = *d;
    }
    if (!weight || !std::isfinite(*weight) || std::abs(*weight) < 1e-6 ||
        std::abs(*weight - 1.0) < 1e-6) {
        warn(attribute.prim(), "usd-skel-inbetween", attribute.loc(),
             fmt::format("{} needs a weight that is neither 0 nor 1; it is ignored",
                         attribute.name().str()));
        return;
    }
    shape.targets.push_back(
        {*weight, vectors(attribute),
         vectors(attribute.prim().attribute(attribute.name().str() + ":normalOffsets"))});
}

}  // namespace

bool is_below_skel_root(Prim prim) {
    for (; prim && !prim.is_pseudo_root(); prim = prim.parent())
        if (prim.is_a("SkelRoot")) return true;
    return false;
}

std::optional<SkelBinding> skel_binding(Prim prim) {
    if (!prim.is_a("Boundable") || prim.is_a("Skeleton") || prim.is_a("SkelRoot") ||
        !is_below_skel_root(prim))
        return std::nullopt;
    SkelBinding binding;
    bool is_skeleton_decided = false;
    if (prim.has_api(api)) {
        const Attribute shapes = prim.attribute("skel:blendShapes");
        if (shapes.has_authored_value()) binding.blend_shapes = shapes;
        binding.blend_targets = prim.relationship("skel:blendShapeTargets");
    }
    for (Prim at = prim; at && !at.is_pseudo_root(); at = at.parent()) {
        // What a skeleton moves does not hold anything else that is moved
        const bool is_skinnable =
            at.is_a("Boundable") && !at.is_a("Skeleton") && !at.is_a("SkelRoot");
        if (at != prim && is_skinnable && is_below_skel_root(at)) return std::nullopt;
        inherit(binding, is_skeleton_decided, at);
        if (at.is_a("SkelRoot") && !is_below_skel_root(at.parent())) break;
    }
    const Attribute own_indices = prim.attribute("primvars:skel:jointIndices");
    if (own_indices.has_authored_value() && !prim.has_api(api))
        warn(prim, "usd-skel-api", own_indices.loc(),
             "the prim has joint indices but not SkelBindingAPI, they are ignored");
    if (!binding.skeleton) return std::nullopt;
    if (!read_influences(binding, prim)) {
        binding.joint_indices = {};
        binding.joint_weights = {};
        if (!binding.has_blend_shapes()) return std::nullopt;
    }
    return binding;
}

Prim animation_source(Prim prim) {
    for (; prim && !prim.is_pseudo_root(); prim = prim.parent()) {
        if (!prim.has_api(api)) continue;
        const Relationship relation = prim.relationship("skel:animationSource");
        if (relation.has_authored_targets()) return target_of_type(relation, "SkelAnimation");
    }
    return Prim();
}

SkeletonPose skeleton_pose(Prim skeleton, TimeCode time) {
    SkeletonPose pose;
    const Prim animation = animation_source(skeleton);
    pose.joints = tokens(skeleton.attribute("joints"));
    if (!pose.joints.empty())
        pose.skinning = skinning_matrices(skeleton, animation, pose.joints, time);
    if (!animation) return pose;
    const std::vector<Token> shapes = tokens(animation.attribute("blendShapes"));
    const auto weights = animation.attribute("blendShapeWeights").get<std::vector<double>>(time);
    if (!weights || weights->empty()) return pose;
    if (weights->size() != shapes.size()) {
        warn(animation, "usd-skel-animation", animation.attribute("blendShapeWeights").loc(),
             fmt::format("{} blendShapes, but {} blendShapeWeights; they are ignored",
                         shapes.size(), weights->size()));
        return pose;
    }
    for (size_t i = 0; i < shapes.size(); ++i)
        pose.blend_weights.emplace_back(shapes[i], (*weights)[i]);
    return pose;
}

BlendShape read_blend_shape(Prim prim) {
    BlendShape shape;
    const layer::Value indices = prim.attribute("pointIndices").value();
    // uint[] in files before 2019
    for (const uint32_t i : indices.as_array<uint32_t>()) shape.point_indices.push_back(i);
    for (const int32_t i : indices.as_array<int32_t>()) shape.point_indices.push_back(i);
    shape.targets.push_back(
        {1.0, vectors(prim.attribute("offsets")), vectors(prim.attribute("normalOffsets"))});
    constexpr std::string_view prefix = "inbetweens:";
    for (const Token& name : prim.property_names()) {
        if (!name.view().starts_with(prefix) ||
            name.view().find(':', prefix.size()) != std::string_view::npos)
            continue;
        add_inbetween(shape, prim.attribute(name.view()));
    }
    std::stable_sort(shape.targets.begin(), shape.targets.end(),
                     [](const auto& a, const auto& b) { return a.weight < b.weight; });
    return shape;
}

}  // namespace velatura::usd::stage
