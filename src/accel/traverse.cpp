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

using Vector8 = hn::Vec<Lanes8>;

constexpr size_t stack_size = max_wide_depth * (wide - 1) + 1;

// Which lanes a comparison holds for, as bits.
template <class D, class M>
HWY_INLINE uint32_t bits_of(D d, M mask) {
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return bytes[0];
}

// The slab constants of a ray in every lane.
struct SlabLanes {
    Vector8 near_origin[3], far_origin[3], near_inverse[3], far_inverse[3];
    size_t near_row[3], far_row[3];  // in floats from WideNode::bounds

    HWY_INLINE explicit SlabLanes(const QueryRay& q) {
        const Lanes8 d;
        for (size_t k = 0; k < 3; ++k) {
            near_origin[k] = hn::Set(d, q.near_origin[k]);
            far_origin[k] = hn::Set(d, q.far_origin[k]);
            near_inverse[k] = hn::Set(d, q.near_inverse[k]);
            far_inverse[k] = hn::Set(d, q.far_inverse[k]);
            near_row[k] = size_t(q.near_row[k]) * wide;
            far_row[k] = size_t(q.far_row[k]) * wide;
        }
    }
};

// Children whose boxes the ray meets at scaled t <= t_far, as bits; entry distances into t_near.
HWY_INLINE uint32_t meet_children(const WideNode& node,
                                  const SlabLanes& q,
                                  float t_far_bound,
                                  float* HWY_RESTRICT t_near) {
    const Lanes8 d;
    const float* const bounds = &node.bounds[0][0];
    uint32_t bits = 0;
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        const auto near = [&](size_t k) HWY_ATTR {
            return hn::Mul(hn::Sub(hn::Load(d, bounds + q.near_row[k] + i), q.near_origin[k]),
                           q.near_inverse[k]);
        };
        const auto far = [&](size_t k) HWY_ATTR {
            return hn::Mul(hn::Sub(hn::Load(d, bounds + q.far_row[k] + i), q.far_origin[k]),
                           q.far_inverse[k]);
        };
        const auto tn = hn::Max(hn::Max(near(0), near(1)), hn::Max(near(2), hn::Zero(d)));
        const auto tf = hn::Min(hn::Min(far(0), far(1)), hn::Min(far(2), hn::Set(d, t_far_bound)));
        hn::Store(tn, d, t_near + i);
        bits |= bits_of(d, hn::Le(tn, tf)) << i;
    }
    return bits;
}

// Triangles of a block, as bits.
struct Candidates {
    uint32_t possible = 0;  // hit_triangle must decide
    uint32_t certain = 0;   // of these: hit for sure at 0 < t < certain_bound
};

// What the ray may hit at scaled t <= t_bound, and what it surely hits before certain_bound.
// Sheared coordinates err by filter_error, so edge functions by less than that times the sizes of
// their factors. Heights z along the ray's largest component bound t: the hit that hit_triangle
// computes lies between the smallest and the largest z times inverse_z, but for a rounding that the
// margins cover many times over.
template <bool find_certain>
HWY_INLINE Candidates
filter_triangles(const LeafBlock& leaf, const QueryRay& q, float t_bound, float certain_bound) {
    const Lanes8 d;
    Candidates found;
    const auto ox = hn::Set(d, q.filter_origin[0]);
    const auto oy = hn::Set(d, q.filter_origin[1]);
    const auto oz = hn::Set(d, q.filter_origin[2]);
    const auto sx = hn::Set(d, q.filter_shear_x);
    const auto sy = hn::Set(d, q.filter_shear_y);
    const auto slip = hn::Set(d, q.filter_error);
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        const auto row = [&](size_t corner, uint32_t axis)
                             HWY_ATTR { return hn::Load(d, leaf.corner[corner][axis] + i); };
        const auto az = hn::Sub(row(0, q.kz), oz);
        const auto bz = hn::Sub(row(1, q.kz), oz);
        const auto cz = hn::Sub(row(2, q.kz), oz);
        const auto ax = hn::NegMulAdd(sx, az, hn::Sub(row(0, q.kx), ox));
        const auto ay = hn::NegMulAdd(sy, az, hn::Sub(row(0, q.ky), oy));
        const auto bx = hn::NegMulAdd(sx, bz, hn::Sub(row(1, q.kx), ox));
        const auto by = hn::NegMulAdd(sy, bz, hn::Sub(row(1, q.ky), oy));
        const auto cx = hn::NegMulAdd(sx, cz, hn::Sub(row(2, q.kx), ox));
        const auto cy = hn::NegMulAdd(sy, cz, hn::Sub(row(2, q.ky), oy));
        const auto u = hn::NegMulAdd(cy, bx, hn::Mul(cx, by));
        const auto v = hn::NegMulAdd(ay, cx, hn::Mul(ax, cy));
        const auto w = hn::NegMulAdd(by, ax, hn::Mul(bx, ay));
        const auto size_x = hn::Add(hn::Abs(ax), hn::Add(hn::Abs(bx), hn::Abs(cx)));
        const auto size_y = hn::Add(hn::Abs(ay), hn::Add(hn::Abs(by), hn::Abs(cy)));
        const auto error = hn::MulAdd(slip, hn::Add(size_x, size_y), hn::Set(d, q.filter_error_2));
        const auto low = hn::Min(u, hn::Min(v, w));
        const auto high = hn::Max(u, hn::Max(v, w));
        // Not certainly outside: no edge function surely negative or none surely positive. No
        // comparison holds for unused lanes, which are not a number.
        const uint32_t near_line =
            bits_of(d, hn::Or(hn::Ge(hn::Add(low, error), hn::Zero(d)), hn::Le(high, error)));
        if (near_line == 0) continue;

        // Not certainly behind the origin or beyond the bound
        const auto inverse = hn::Set(d, q.filter_inverse_z);
        const auto t_a = hn::Mul(hn::Min(az, hn::Min(bz, cz)), inverse);
        const auto t_b = hn::Mul(hn::Max(az, hn::Max(bz, cz)), inverse);
        const auto margin = hn::Set(d, q.filter_t_margin);
        const auto shrink = hn::Set(d, 1.0f - 0x1p-18f), grow = hn::Set(d, 1.0f + 0x1p-18f);
        const auto first = hn::Sub(hn::Min(t_a, t_b), margin);
        const auto last = hn::Add(hn::Max(t_a, t_b), margin);
        const auto zero = hn::Zero(d);
        const auto in_range =
            hn::And(hn::Le(hn::Mul(first, shrink), hn::Set(d, t_bound)), hn::Ge(last, zero));
        const uint32_t possible = near_line & bits_of(d, in_range);
        found.possible |= possible << i;
        if (!find_certain || possible == 0) continue;
        const auto inside = hn::Or(hn::Gt(low, error), hn::Lt(hn::Add(high, error), zero));
        const auto between =
            hn::And(hn::Gt(first, zero), hn::Lt(hn::Mul(last, grow), hn::Set(d, certain_bound)));
        found.certain |= (possible & bits_of(d, hn::And(inside, between))) << i;
    }
    return found;
}

// Hits of a ray in the lanes of a block.
struct LeafHits {
    alignas(32) float t[wide];
    alignas(32) float b1[wide], b2[wide];
};

// hit_triangle for lanes of a block, operation by operation, so with the same bits.
// Returns: the candidates that are hit at t <= t_last, as bits.
HWY_INLINE uint32_t hit_block(
    const LeafBlock& leaf, const QueryRay& q, uint32_t candidates, float t_last, LeafHits& hits) {
    // Registers of 512 bits measure slower
    using Doubles = hn::CappedTag<double, 4>;
    using Floats = hn::Rebind<float, Doubles>;
    const Doubles d;
    const Floats f;
    const auto ox = hn::Set(d, q.permuted_origin[0]);
    const auto oy = hn::Set(d, q.permuted_origin[1]);
    const auto oz = hn::Set(d, q.permuted_origin[2]);
    const auto sx = hn::Set(d, q.shear_x);
    const auto sy = hn::Set(d, q.shear_y);
    uint32_t found = 0;
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        if (((candidates >> i) & ((1u << hn::Lanes(d)) - 1)) == 0) continue;
        const auto from_origin = [&](size_t corner, uint32_t axis, auto origin) HWY_ATTR {
            return hn::Sub(hn::PromoteTo(d, hn::Load(f, leaf.corner[corner][axis] + i)), origin);
        };
        const auto az = from_origin(0, q.kz, oz);
        const auto bz = from_origin(1, q.kz, oz);
        const auto cz = from_origin(2, q.kz, oz);
        const auto ax = hn::Sub(from_origin(0, q.kx, ox), hn::Mul(sx, az));
        const auto ay = hn::Sub(from_origin(0, q.ky, oy), hn::Mul(sy, az));
        const auto bx = hn::Sub(from_origin(1, q.kx, ox), hn::Mul(sx, bz));
        const auto by = hn::Sub(from_origin(1, q.ky, oy), hn::Mul(sy, bz));
        const auto cx = hn::Sub(from_origin(2, q.kx, ox), hn::Mul(sx, cz));
        const auto cy = hn::Sub(from_origin(2, q.ky, oy), hn::Mul(sy, cz));
        const auto u = hn::Sub(hn::Mul(cx, by), hn::Mul(cy, bx));
        const auto v = hn::Sub(hn::Mul(ax, cy), hn::Mul(ay, cx));
        const auto w = hn::Sub(hn::Mul(bx, ay), hn::Mul(by, ax));
        const auto zero = hn::Zero(d);
        const auto inside = hn::Or(hn::Ge(hn::Min(u, hn::Min(v, w)), zero),
                                   hn::Le(hn::Max(u, hn::Max(v, w)), zero));
        if (hn::AllFalse(d, inside)) continue;

        const auto det = hn::Add(hn::Add(u, v), w);
        const auto inverse_det = hn::Div(hn::Set(d, 1.0), det);
        const auto height = hn::Add(hn::Add(hn::Mul(u, az), hn::Mul(v, bz)), hn::Mul(w, cz));
        const auto t = hn::Mul(hn::Mul(height, hn::Set(d, q.inverse_z)), inverse_det);
        const auto forward = hn::And(hn::And(inside, hn::Ne(det, zero)), hn::Gt(t, zero));
        const uint32_t forward_bits = bits_of(d, forward);
        if (forward_bits == 0) continue;

        // Keep t inside the own box
        alignas(32) float bounds[6][wide];
        auto widest = hn::Zero(f);
        for (size_t k = 0; k < 3; ++k) {
            const auto a = hn::Load(f, leaf.corner[0][k] + i);
            const auto b = hn::Load(f, leaf.corner[1][k] + i);
            const auto c = hn::Load(f, leaf.corner[2][k] + i);
            const auto lower = hn::Min(a, hn::Min(b, c)), upper = hn::Max(a, hn::Max(b, c));
            hn::Store(lower, f, bounds[k]);
            hn::Store(upper, f, bounds[k + 3]);
            widest = hn::Max(widest, hn::Sub(upper, lower));
        }
        const auto slab = [&](const int32_t* row, const float* origin, const float* inverse,
                              size_t k) HWY_ATTR {
            return hn::Mul(hn::Sub(hn::Load(f, bounds[row[k]]), hn::Set(f, origin[k])),
                           hn::Set(f, inverse[k]));
        };
        const auto near = [&](size_t k) HWY_ATTR {
            return slab(q.near_row, q.near_origin, q.near_inverse, k);
        };
        const auto far = [&](size_t k)
                             HWY_ATTR { return slab(q.far_row, q.far_origin, q.far_inverse, k); };
        const auto t_near = hn::Max(hn::Max(near(0), near(1)), hn::Max(near(2), hn::Zero(f)));
        const auto t_far = hn::Min(hn::Min(far(0), far(1)), far(2));
        const auto edge = hn::PromoteTo(d, widest), last = hn::PromoteTo(d, t_far);
        const auto clamped = hn::Min(hn::Max(t, hn::PromoteTo(d, t_near)), last);
        const auto edge_on =
            hn::Lt(hn::Abs(det), hn::Mul(hn::Mul(hn::Set(d, 0x1p-32), edge), edge));
        const auto hit_t = hn::DemoteTo(
            f, hn::Mul(hn::IfThenElse(edge_on, last, clamped), hn::Set(d, q.t_from_scaled)));
        const auto finite = hn::Lt(hit_t, hn::Set(f, std::numeric_limits<float>::infinity()));
        const auto in_range = hn::And(hn::And(hn::Le(t_near, t_far), hn::Gt(hit_t, hn::Zero(f))),
                                      hn::And(finite, hn::Le(hit_t, hn::Set(f, t_last))));
        found |= (forward_bits & bits_of(f, in_range)) << i;
        hn::Store(hit_t, f, hits.t + i);
        hn::Store(hn::DemoteTo(f, hn::Mul(v, inverse_det)), f, hits.b1 + i);
        hn::Store(hn::DemoteTo(f, hn::Mul(w, inverse_det)), f, hits.b2 + i);
    }
    return found & candidates;
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

struct StackEntry {
    float t_near;
    ChildRef ref;
};

struct Stack {
    StackEntry entries[stack_size];
    StackEntry* top = entries;
};

// Pushes all but the nearest of three or more children, the nearer on top; returns the nearest.
// near and far: two of them in order; bits: the others.
HWY_INLINE uint32_t push_sorted(Stack& stack,
                                const WideNode& node,
                                uint32_t near,
                                uint32_t far,
                                uint32_t bits,
                                const float* t_near) {
    StackEntry* const first = stack.top;
    *stack.top++ = {t_near[far], node.child[far]};
    for (; bits != 0; bits &= bits - 1) {
        auto lane = uint32_t(std::countr_zero(bits));
        if (t_near[lane] < t_near[near]) std::swap(lane, near);
        const StackEntry entry{t_near[lane], node.child[lane]};
        StackEntry* place = stack.top++;
        for (; place != first && place[-1].t_near < entry.t_near; --place) *place = place[-1];
        *place = entry;
    }
    return near;
}

// Walks the tree front to back. on_leaf(ref) may lower t_bound (scaled).
template <class OnLeaf>
HWY_INLINE void walk_closest(const WideTree& tree,
                             const QueryRay& q,
                             const float& t_bound,
                             const OnLeaf& on_leaf) {
    const SlabLanes slabs(q);
    Stack stack;
    ChildRef ref = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const WideNode& node = tree.nodes[ref];
            uint32_t bits = meet_children(node, slabs, t_bound, t_near);
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
                        *stack.top++ = {t_near[other], node.child[other]};
                }
                ref = node.child[lane];
                prefetch(tree, ref);
                continue;
            }
        } else {
            on_leaf(ref & ~leaf_bit);
        }
        // Pop the nearest entry that is not behind the best hit
        do {
            if (stack.top == stack.entries) return;
            --stack.top;
        } while (stack.top->t_near > t_bound);
        ref = stack.top->ref;
        prefetch(tree, ref);
    }
}

// Walks until on_leaf(ref) returns true. No sorting; large children first.
template <class OnLeaf>
HWY_INLINE bool walk_any(const WideTree& tree,
                         const QueryRay& q,
                         float t_bound,
                         const OnLeaf& on_leaf) {
    const SlabLanes slabs(q);
    ChildRef stack[stack_size];
    ChildRef* top = stack;
    ChildRef ref = 0;
    alignas(64) float t_near[wide];
    while (true) {
        if (!(ref & leaf_bit)) {
            const WideNode& node = tree.nodes[ref];
            uint32_t bits = meet_children(node, slabs, t_bound, t_near);
            if (bits != 0) {
                // Go on with the largest child, leave the others for later
                ref = node.child[std::countr_zero(bits)];
                prefetch(tree, ref);
                for (bits &= bits - 1; bits != 0; bits &= bits - 1)
                    *top++ = node.child[std::countr_zero(bits)];
                continue;
            }
        } else if (on_leaf(ref & ~leaf_bit)) {
            return true;
        }
        if (top == stack) return false;
        ref = *--top;
        prefetch(tree, ref);
    }
}

HWY_INLINE bool is_before(float t, uint32_t instance, uint32_t id, const TreeHit& best) {
    if (t != best.t) return t < best.t;
    return best.id != scene::none &&
           (instance != best.instance ? instance < best.instance : id < best.id);
}

HWY_INLINE void closest_in_tree(const WideTree& tree,
                                const QueryRay& q,
                                uint32_t instance,
                                TreeHit& best) {
    float t_bound = float(double(best.t) * q.scaled_from_t);
    walk_closest(tree, q, t_bound, [&](uint32_t block) VELATURA_LEAF {
        const LeafBlock& leaf = tree.leaves[block];
        const uint32_t possible = filter_triangles<false>(leaf, q, t_bound, 0).possible;
        if (possible == 0) return;
        LeafHits hits;
        for (uint32_t bits = hit_block(leaf, q, possible, best.t, hits); bits != 0;
             bits &= bits - 1) {
            const auto lane = uint32_t(std::countr_zero(bits));
            if (!is_before(hits.t[lane], instance, leaf.id[lane], best)) continue;
            best = {hits.t[lane], hits.b1[lane], hits.b2[lane], instance, leaf.id[lane]};
            t_bound = float(double(best.t) * q.scaled_from_t);
        }
    });
}

HWY_INLINE bool any_in_tree(const WideTree& tree, const QueryRay& q, float t_max) {
    const float t_bound = float(double(t_max) * q.scaled_from_t);
    // No t that overflows on the way back from scaled t is a hit
    const float certain_bound = std::min(t_bound, float(0x1p126 * q.scaled_from_t));
    return walk_any(tree, q, t_bound, [&](uint32_t block) VELATURA_LEAF {
        const LeafBlock& leaf = tree.leaves[block];
        const Candidates found = filter_triangles<true>(leaf, q, t_bound, certain_bound);
        if (found.certain != 0) return true;
        if (found.possible == 0) return false;
        LeafHits hits;
        uint32_t bits = hit_block(leaf, q, found.possible, t_max, hits);
        while (bits != 0 && hits.t[std::countr_zero(bits)] >= t_max) bits &= bits - 1;
        return bits != 0;
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
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(ray, trees.direct.query_bounds, {}, q)) {
        closest_in_tree(trees.direct, q, scene::none, best);
    }
    if (!trees.top.is_empty() && make_query(ray, trees.top.query_bounds, top_slack(trees), q)) {
        float t_bound = float(double(best.t) * q.scaled_from_t);
        walk_closest(trees.top, q, t_bound, [&](uint32_t index) HWY_ATTR {
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
    QueryRay q;
    if (!trees.direct.is_empty() && make_query(ray, trees.direct.query_bounds, {}, q) &&
        any_in_tree(trees.direct, q, ray.t_max)) {
        return true;
    }
    if (trees.top.is_empty() || !make_query(ray, trees.top.query_bounds, top_slack(trees), q))
        return false;
    const float t_bound = float(double(ray.t_max) * q.scaled_from_t);
    return walk_any(trees.top, q, t_bound, [&](uint32_t index) HWY_ATTR {
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
