// SPDX-License-Identifier: Apache-2.0
// Compiled once per instruction set by Highway; see the README of this tier for the seam.
#include "accel/traverse.h"

#include "accel/make_query.h"

#include <algorithm>
#include <bit>
#include <utility>

// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "accel/traverse.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Leaves are tested in the walk itself, not behind a call.
#undef VELATURA_LEAF
#define VELATURA_LEAF HWY_ATTR __attribute__((always_inline))

using Lanes8 = hn::CappedTag<float, wide>;

constexpr size_t stack_size = max_wide_depth * (wide - 1) + 1;

struct StackEntry {
    float t_near;
    ChildRef ref;
    float extent;
};

struct Stack {
    StackEntry entries[stack_size];
    StackEntry* top = entries;
};

// Children whose boxes the ray meets at scaled t <= t_far, as bits; entry distances into t_near.
HWY_INLINE uint32_t meet_children(const WideNode& node,
                                  const QueryRay& q,
                                  float t_far_bound,
                                  float* HWY_RESTRICT t_near) {
    const Lanes8 d;
    uint32_t bits = 0;
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        const auto slab = [&](const int32_t* row, const float* origin, const float* inverse,
                              int k) HWY_ATTR {
            const auto bound = hn::Load(d, node.bounds[row[k]] + i);
            return hn::Mul(hn::Sub(bound, hn::Set(d, origin[k])), hn::Set(d, inverse[k]));
        };
        const auto nx = slab(q.near_row, q.near_origin, q.near_inverse, 0);
        const auto ny = slab(q.near_row, q.near_origin, q.near_inverse, 1);
        const auto nz = slab(q.near_row, q.near_origin, q.near_inverse, 2);
        const auto fx = slab(q.far_row, q.far_origin, q.far_inverse, 0);
        const auto fy = slab(q.far_row, q.far_origin, q.far_inverse, 1);
        const auto fz = slab(q.far_row, q.far_origin, q.far_inverse, 2);
        const auto tn = hn::Max(hn::Max(nx, ny), hn::Max(nz, hn::Zero(d)));
        const auto tf = hn::Min(hn::Min(fx, fy), hn::Min(fz, hn::Set(d, t_far_bound)));
        hn::Store(tn, d, t_near + i);
        uint8_t mask[8] = {};
        hn::StoreMaskBits(d, hn::Le(tn, tf), mask);
        bits |= uint32_t(mask[0]) << i;
    }
    return bits;
}

// Bound of the float error of edge functions in a leaf that the ray enters at t_near: sheared
// coordinates are at most twice the extent, heights above the origin t_near·2 + extent.
HWY_INLINE float edge_error(const QueryRay& q, float t_near, float extent) {
    constexpr float u = machine_epsilon;
    const float r = 2.0f * (extent + q.slop) + 128.0f * u * t_near;
    const float shift = 16.0f * u * (t_near + 2.0f * r) + 2.0f * q.filter_error;
    return 8.0f * r * (shift + u * r) + 1e-37f;
}

// Which lanes a comparison holds for, as bits.
template <class D, class M>
HWY_INLINE uint32_t bits_of(D d, M mask) {
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return bytes[0];
}

// Triangles of a block, as bits.
struct Candidates {
    uint32_t possible = 0;  // hit_triangle must decide
    uint32_t certain = 0;   // of these: hit for sure at 0 < t < t_bound
};

// What the ray may hit at scaled t <= t_bound, and what it surely hits before certain_bound. Heights z along the ray's largest component bound t:
// the hit that hit_triangle computes lies between the smallest and the largest z times inverse_z,
// but for a rounding that the margins cover many times over.
HWY_INLINE Candidates filter_triangles(const LeafBlock& leaf,
                                       const QueryRay& q,
                                       float error,
                                       float t_bound,
                                       float certain_bound) {
    const Lanes8 d;
    const hn::RebindToUnsigned<Lanes8> du;
    Candidates found;
    const auto ox = hn::Set(d, q.filter_origin[0]);
    const auto oy = hn::Set(d, q.filter_origin[1]);
    const auto oz = hn::Set(d, q.filter_origin[2]);
    const auto sx = hn::Set(d, q.filter_shear_x);
    const auto sy = hn::Set(d, q.filter_shear_y);
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        const auto row = [&](size_t corner, uint32_t axis)
                             HWY_ATTR { return hn::Load(d, leaf.corner[corner][axis] + i); };
        const auto az = hn::Sub(row(0, q.kz), oz);
        const auto bz = hn::Sub(row(1, q.kz), oz);
        const auto cz = hn::Sub(row(2, q.kz), oz);
        const auto ax = hn::Sub(hn::Sub(row(0, q.kx), ox), hn::Mul(sx, az));
        const auto ay = hn::Sub(hn::Sub(row(0, q.ky), oy), hn::Mul(sy, az));
        const auto bx = hn::Sub(hn::Sub(row(1, q.kx), ox), hn::Mul(sx, bz));
        const auto by = hn::Sub(hn::Sub(row(1, q.ky), oy), hn::Mul(sy, bz));
        const auto cx = hn::Sub(hn::Sub(row(2, q.kx), ox), hn::Mul(sx, cz));
        const auto cy = hn::Sub(hn::Sub(row(2, q.ky), oy), hn::Mul(sy, cz));
        const auto u = hn::Sub(hn::Mul(cx, by), hn::Mul(cy, bx));
        const auto v = hn::Sub(hn::Mul(ax, cy), hn::Mul(ay, cx));
        const auto w = hn::Sub(hn::Mul(bx, ay), hn::Mul(by, ax));
        const auto low = hn::Min(u, hn::Min(v, w));
        const auto high = hn::Max(u, hn::Max(v, w));
        // Certainly outside: one edge function surely negative, another surely positive
        const auto outside =
            hn::And(hn::Lt(low, hn::Set(d, -error)), hn::Gt(high, hn::Set(d, error)));
        const uint32_t near_line = ~bits_of(d, outside) & ((1u << hn::Lanes(d)) - 1);
        if (near_line == 0) continue;

        // Certainly behind the origin or beyond the bound
        const auto inverse = hn::Set(d, q.filter_inverse_z);
        const auto t_low = hn::Mul(hn::Min(az, hn::Min(bz, cz)), inverse);
        const auto t_high = hn::Mul(hn::Max(az, hn::Max(bz, cz)), inverse);
        const auto margin = hn::Set(d, q.filter_t_margin);
        const auto shrink = hn::Set(d, 1.0f - 0x1p-18f), grow = hn::Set(d, 1.0f + 0x1p-18f);
        const auto first = hn::Sub(hn::Min(t_low, t_high), margin);
        const auto last = hn::Add(hn::Max(t_low, t_high), margin);
        const auto bound = hn::Set(d, t_bound), zero = hn::Zero(d);
        const auto beyond = hn::Gt(hn::Mul(first, shrink), bound);
        const auto behind = hn::Lt(last, zero);
        const auto unused = hn::Eq(hn::Load(du, leaf.id + i), hn::Set(du, unused_lane));
        const uint32_t possible =
            near_line & ~(bits_of(d, hn::Or(beyond, behind)) | bits_of(du, unused));
        found.possible |= possible << i;

        const auto inside = hn::Or(hn::Gt(low, hn::Set(d, error)), hn::Lt(high, hn::Set(d, -error)));
        const auto between = hn::And(hn::Gt(first, zero), hn::Lt(hn::Mul(last, grow), hn::Set(d, certain_bound)));
        found.certain |= (possible & bits_of(d, hn::And(inside, between))) << i;
    }
    return found;
}

HWY_INLINE bool hit_lane(const LeafBlock& leaf,
                         const QueryRay& q,
                         uint32_t lane,
                         TriangleHit& hit) {
    return hit_triangle(q, &leaf.corner[0][0][lane], &leaf.corner[1][0][lane],
                        &leaf.corner[2][0][lane], wide, hit);
}

// Fetches the lines of a child before its first load needs them.
HWY_INLINE void prefetch(const WideTree& tree, ChildRef ref) {
    const bool is_leaf = (ref & leaf_bit) != 0;
    const auto* base = is_leaf ? reinterpret_cast<const char*>(tree.leaves.data())
                               : reinterpret_cast<const char*>(tree.nodes.data());
    const char* p =
        base + size_t(ref & ~leaf_bit) * (is_leaf ? sizeof(LeafBlock) : sizeof(WideNode));
    __builtin_prefetch(p);
    __builtin_prefetch(p + 64);
    __builtin_prefetch(p + 128);
    __builtin_prefetch(p + 192);
    __builtin_prefetch(p + 256);
}

// Pushes all but the nearest of three or more children, the nearer on top; returns the nearest.
// near and far: two of them in order; bits: the others.
HWY_INLINE uint32_t push_sorted(Stack& stack,
                                const WideNode& node,
                                uint32_t near,
                                uint32_t far,
                                uint32_t bits,
                                const float* t_near) {
    StackEntry* const first = stack.top;
    *stack.top++ = {t_near[far], node.child[far], node.extent[far]};
    for (; bits != 0; bits &= bits - 1) {
        auto lane = uint32_t(std::countr_zero(bits));
        if (t_near[lane] < t_near[near]) std::swap(lane, near);
        const StackEntry entry{t_near[lane], node.child[lane], node.extent[lane]};
        StackEntry* place = stack.top++;
        for (; place != first && place[-1].t_near < entry.t_near; --place) *place = place[-1];
        *place = entry;
    }
    return near;
}

// Walks the tree front to back. on_leaf(ref, t_near, extent) may lower t_bound (scaled).
template <class OnLeaf>
HWY_INLINE void walk_closest(const WideTree& tree,
                             const QueryRay& q,
                             const float& t_bound,
                             const OnLeaf& on_leaf) {
    Stack stack;
    ChildRef ref = 0;
    float t_entry = 0, extent = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const WideNode& node = tree.nodes[ref];
            uint32_t bits = meet_children(node, q, t_bound, t_near);
            if (bits != 0) {
                // Go on with the nearest child; the usual one or two never wait for the stack
                auto lane = uint32_t(std::countr_zero(bits));
                bits &= bits - 1;
                if (bits != 0) {
                    auto other = uint32_t(std::countr_zero(bits));
                    bits &= bits - 1;
                    if (t_near[other] < t_near[lane]) std::swap(lane, other);
                    if (bits != 0)
                        lane = push_sorted(stack, node, lane, other, bits, t_near);
                    else
                        *stack.top++ = {t_near[other], node.child[other], node.extent[other]};
                }
                ref = node.child[lane];
                t_entry = t_near[lane];
                extent = node.extent[lane];
                prefetch(tree, ref);
                continue;
            }
        } else {
            on_leaf(ref & ~leaf_bit, t_entry, extent);
        }
        // Pop the nearest entry that is not behind the best hit
        do {
            if (stack.top == stack.entries) return;
            --stack.top;
        } while (stack.top->t_near > t_bound);
        ref = stack.top->ref;
        t_entry = stack.top->t_near;
        extent = stack.top->extent;
        prefetch(tree, ref);
    }
}

// Walks until on_leaf(ref, t_near, extent) returns true. No sorting; large children first.
template <class OnLeaf>
HWY_INLINE bool walk_any(const WideTree& tree,
                         const QueryRay& q,
                         float t_bound,
                         const OnLeaf& on_leaf) {
    Stack stack;
    StackEntry entry{0, 0, 0};
    alignas(64) float t_near[wide];
    while (true) {
        if (!(entry.ref & leaf_bit)) {
            const WideNode& node = tree.nodes[entry.ref];
            uint32_t bits = meet_children(node, q, t_bound, t_near);
            if (bits != 0) {
                // Go on with the largest child, leave the others for later
                const auto first = uint32_t(std::countr_zero(bits));
                entry = {t_near[first], node.child[first], node.extent[first]};
                prefetch(tree, entry.ref);
                for (bits &= bits - 1; bits != 0; bits &= bits - 1) {
                    const auto lane = uint32_t(std::countr_zero(bits));
                    *stack.top++ = {t_near[lane], node.child[lane], node.extent[lane]};
                }
                continue;
            }
        } else if (on_leaf(entry.ref & ~leaf_bit, entry.t_near, entry.extent)) {
            return true;
        }
        if (stack.top == stack.entries) return false;
        entry = *--stack.top;
        prefetch(tree, entry.ref);
    }
}

HWY_INLINE bool is_before(const TriangleHit& hit,
                          uint32_t instance,
                          uint32_t id,
                          const TreeHit& best) {
    if (hit.t != best.t) return hit.t < best.t;
    return best.id != scene::none &&
           (instance != best.instance ? instance < best.instance : id < best.id);
}

HWY_INLINE void closest_in_tree(const WideTree& tree,
                                const QueryRay& q,
                                uint32_t instance,
                                TreeHit& best) {
    float t_bound = float(double(best.t) * q.scaled_from_t);
    walk_closest(tree, q, t_bound, [&](uint32_t block, float t_entry, float extent) VELATURA_LEAF {
        const LeafBlock& leaf = tree.leaves[block];
        uint32_t bits =
            filter_triangles(leaf, q, edge_error(q, t_entry, extent), t_bound, 0).possible;
        for (; bits != 0; bits &= bits - 1) {
            const auto lane = uint32_t(std::countr_zero(bits));
            TriangleHit hit;
            if (!hit_lane(leaf, q, lane, hit)) continue;
            if (!is_before(hit, instance, leaf.id[lane], best)) continue;
            best = {hit.t, hit.b1, hit.b2, instance, leaf.id[lane]};
            t_bound = float(double(best.t) * q.scaled_from_t);
        }
    });
}

HWY_INLINE bool any_in_tree(const WideTree& tree, const QueryRay& q, float t_max) {
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    // No t that overflows on the way back from scaled t is a hit
    const float certain_bound = std::min(t_bound, float(0x1p126 * q.scaled_from_t));
    return walk_any(
        tree, q, t_bound, [&](uint32_t block, float t_entry, float extent) VELATURA_LEAF {
            const LeafBlock& leaf = tree.leaves[block];
            const Candidates found =
                filter_triangles(leaf, q, edge_error(q, t_entry, extent), t_bound, certain_bound);
            if (found.certain != 0) return true;
            uint32_t bits = found.possible;
            for (; bits != 0; bits &= bits - 1) {
                TriangleHit hit;
                if (hit_lane(leaf, q, uint32_t(std::countr_zero(bits)), hit) && hit.t < t_max)
                    return true;
            }
            return false;
        });
}

// The ray in prototype space, in double; d is not normalised, so t keeps its meaning.
HWY_INLINE bool enter_instance(const SceneTrees& trees,
                               const InstanceRecord& record,
                               const geometry::Ray& ray,
                               QueryRay& q) {
    const auto& m = record.prototype_from_render;
    Vec3d o, d;
    for (int k = 0; k < 3; ++k) {
        d[k] = double(ray.d.x) * m[0][k] + double(ray.d.y) * m[1][k] + double(ray.d.z) * m[2][k];
        o[k] = double(ray.o.x) * m[0][k] + double(ray.o.y) * m[1][k] + double(ray.o.z) * m[2][k] +
               m[3][k];
    }
    return make_query(o, d, trees.prototypes[record.tree].query_bounds, {}, q);
}

QuerySlack top_slack(const SceneTrees& trees) {
    QuerySlack slack;
    slack.inverse = 0x1p-18f;
    slack.origin = trees.top_origin_slack;
    return slack;
}

bool intersect(const SceneTrees& trees, const geometry::Ray& ray, TreeHit& best) {
    // make_query refuses what is not finite
    if (!(ray.t_max > 0.0f)) return false;
    best = {};
    best.t = ray.t_max;
    const Vec3d o(ray.o), d(ray.d);
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(o, d, trees.direct.query_bounds, {}, q)) {
        closest_in_tree(trees.direct, q, scene::none, best);
    }
    if (!trees.top.is_empty() && make_query(o, d, trees.top.query_bounds, top_slack(trees), q)) {
        float t_bound = float(double(best.t) * q.scaled_from_t);
        walk_closest(trees.top, q, t_bound, [&](uint32_t index, float, float) HWY_ATTR {
            const InstanceRecord& record = trees.instances[index];
            QueryRay inner;
            if (!enter_instance(trees, record, ray, inner)) return;
            closest_in_tree(trees.prototypes[record.tree], inner, record.instance, best);
            t_bound = float(double(best.t) * q.scaled_from_t);
        });
    }
    return best.id != scene::none;
}

bool is_occluded(const SceneTrees& trees, const geometry::Ray& ray) {
    if (!(ray.t_max > 0.0f)) return false;
    const Vec3d o(ray.o), d(ray.d);
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(o, d, trees.direct.query_bounds, {}, q) &&
        any_in_tree(trees.direct, q, ray.t_max)) {
        return true;
    }
    if (trees.top.is_empty() || !make_query(o, d, trees.top.query_bounds, top_slack(trees), q))
        return false;
    const float t_bound = float(double(ray.t_max) * q.scaled_from_t);
    return walk_any(trees.top, q, t_bound, [&](uint32_t index, float, float) HWY_ATTR {
        const InstanceRecord& record = trees.instances[index];
        QueryRay inner;
        return enter_instance(trees, record, ray, inner) &&
               any_in_tree(trees.prototypes[record.tree], inner, ray.t_max);
    });
}

}  // namespace

Kernels kernels();

Kernels kernels() {
    return {hwy::TargetName(HWY_TARGET), &intersect, &is_occluded};
}

}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace velatura::accel {

HWY_EXPORT(kernels);

namespace {

// The kernels that Highway chooses for the running processor.
Kernels chosen_kernels() {
    return HWY_DYNAMIC_DISPATCH(kernels)();
}

}  // namespace

const Kernels& best_kernels() {
    static const Kernels chosen = chosen_kernels();
    return chosen;
}

std::vector<Kernels> all_kernels() {
    std::vector<Kernels> all;
    for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        all.push_back(chosen_kernels());
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    return all;
}

}  // namespace velatura::accel
#endif
