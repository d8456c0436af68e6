// SPDX-License-Identifier: Apache-2.0
// What all kernels do at a node and at a leaf. Included once per instruction set by each of them.
#if defined(VELATURA_KERNEL_STEPS) == defined(HWY_TARGET_TOGGLE)
#ifdef VELATURA_KERNEL_STEPS
#undef VELATURA_KERNEL_STEPS
#else
#define VELATURA_KERNEL_STEPS
#endif

#include "accel/make_query.h"
#include "accel/traverse.h"

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <limits>

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {

// In traverse_batch.cpp
void intersect_batch(const SceneTrees& trees,
                     std::span<const geometry::Ray> rays,
                     std::span<TreeHit> hits);
void occlude_batch(const SceneTrees& trees,
                   std::span<const geometry::Ray> rays,
                   std::span<uint8_t> occluded);
bool has_batch();

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

// The boxes of a node as the ray meets them.
struct StillBoxes {
    const float* bounds;

    // place: row·wide + lane; of axis k
    HWY_INLINE Vector8 load(size_t, size_t place) const {
        return hn::Load(Lanes8(), bounds + place);
    }
};

HWY_INLINE StillBoxes boxes_of(const WideNode& node, const SlabLanes&) {
    return {&node.bounds[0][0]};
}

// Children whose boxes the ray meets at scaled t <= t_far, as bits; entry distances into t_near.
template <class Node, class Slabs>
HWY_INLINE uint32_t
meet_children(const Node& node, const Slabs& q, float t_far_bound, float* HWY_RESTRICT t_near) {
    const Lanes8 d;
    const auto boxes = boxes_of(node, q);
    uint32_t bits = 0;
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        const auto near = [&](size_t k) HWY_ATTR {
            return hn::Mul(hn::Sub(boxes.load(k, q.near_row[k] + i), q.near_origin[k]),
                           q.near_inverse[k]);
        };
        const auto far = [&](size_t k) HWY_ATTR {
            return hn::Mul(hn::Sub(boxes.load(k, q.far_row[k] + i), q.far_origin[k]),
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
        // Certainly outside: one edge function surely negative, another surely positive
        const auto outside = hn::And(hn::Lt(low, hn::Neg(error)), hn::Gt(high, error));
        // Corners of unused lanes are not a number
        const auto used = hn::Eq(az, az);
        const uint32_t near_line = bits_of(d, used) & ~bits_of(d, outside);
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
        const auto inside = hn::Or(hn::Gt(low, error), hn::Lt(high, hn::Neg(error)));
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
    uint32_t leaving = 0;  // lanes, as bits
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
        hits.leaving |= bits_of(d, hn::Lt(hn::Mul(det, hn::Set(d, q.inverse_z)), zero)) << i;
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
    // A node has no fifth line
    __builtin_prefetch(is_leaf ? p + 256 : p);
}

HWY_INLINE bool is_before(
    float t, bool is_leaving, uint32_t instance, uint32_t id, const TreeHit& best) {
    if (t != best.t) return t < best.t;
    if (best.id == scene::none) return false;
    if (is_leaving != best.is_leaving) return best.is_leaving;
    return instance != best.instance ? instance < best.instance : id < best.id;
}

// For blocks from which the builder has dropped what is degenerate.
struct TakeAll {
    HWY_INLINE bool operator()(const LeafBlock&, uint32_t) const { return true; }

    // Of those that are surely hit, as bits
    HWY_INLINE bool has_any(const LeafBlock&, uint32_t certain) const { return certain != 0; }
};

// Takes the closest hit in the block into `best`, if it is before that. t_bound: best.t, scaled;
// is_there(leaf, lane) whether the triangle in that lane counts. Returns: whether there was one.
template <class IsThere = TakeAll>
HWY_INLINE bool improve_hit(const LeafBlock& leaf,
                            const QueryRay& q,
                            uint32_t instance,
                            float t_bound,
                            TreeHit& best,
                            const IsThere& is_there = {}) {
    const uint32_t possible = filter_triangles<false>(leaf, q, t_bound, 0).possible;
    if (possible == 0) return false;
    bool is_better = false;
    LeafHits hits;
    for (uint32_t bits = hit_block(leaf, q, possible, best.t, hits); bits != 0; bits &= bits - 1) {
        const auto lane = uint32_t(std::countr_zero(bits));
        const bool is_leaving = (hits.leaving >> lane & 1) != 0;
        if (!is_before(hits.t[lane], is_leaving, instance, leaf.id[lane], best) ||
            !is_there(leaf, lane))
            continue;
        best = {hits.t[lane], hits.b1[lane], hits.b2[lane], instance, leaf.id[lane], is_leaving};
        is_better = true;
    }
    return is_better;
}

// No t that overflows on the way back from scaled t is a hit.
HWY_INLINE float certain_bound_of(const QueryRay& q, float t_bound) {
    return std::min(t_bound, float(0x1p126 * q.scaled_from_t));
}

// Whether the ray hits anything in the block at t < t_max, scaled: t_bound.
template <class IsThere = TakeAll>
HWY_INLINE bool is_block_hit(const LeafBlock& leaf,
                             const QueryRay& q,
                             float t_max,
                             float t_bound,
                             float certain_bound,
                             const IsThere& is_there = {}) {
    const Candidates found = filter_triangles<true>(leaf, q, t_bound, certain_bound);
    if (is_there.has_any(leaf, found.certain)) return true;
    if (found.possible == 0) return false;
    LeafHits hits;
    uint32_t bits = hit_block(leaf, q, found.possible, t_max, hits);
    while (bits != 0 && (hits.t[std::countr_zero(bits)] >= t_max ||
                         !is_there(leaf, uint32_t(std::countr_zero(bits)))))
        bits &= bits - 1;
    return bits != 0;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#endif
