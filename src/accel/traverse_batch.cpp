// SPDX-License-Identifier: Apache-2.0
// Many rays side by side: while one waits for memory, others go on. Compiled once per instruction
// set by Highway.
#include "accel/traverse.h"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <type_traits>
#include <vector>

// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "accel/traverse_batch.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "accel/kernel_motion.inl"
#include "accel/kernel_steps.inl"
// clang-format on

#ifndef VELATURA_ONCE_PER_BATCH
#define VELATURA_ONCE_PER_BATCH

namespace velatura::accel {
namespace {

// Rays that are traced side by side. Enough to hide the latency of memory, few enough for their
// states to stay in the nearest caches.
constexpr size_t batch_width = 32;

// Lies under each stack: no box is entered before it.
constexpr ChildRef end_of_ray = 0xffffffffu;

// For each set of children: their lanes, the last one first, as bytes; the rest has no meaning.
constexpr std::array<uint64_t, 256> make_reversed_lanes() {
    std::array<uint64_t, 256> table{};
    for (size_t bits = 0; bits < 256; ++bits) {
        size_t place = 0;
        for (size_t lane = wide; lane-- > 0;) {
            if ((bits >> lane & 1) == 0) continue;
            table[bits] |= uint64_t(lane) << (8 * place++);
        }
    }
    return table;
}

[[maybe_unused]] constexpr std::array<uint64_t, 256> reversed_lanes = make_reversed_lanes();

}  // namespace
}  // namespace velatura::accel
#endif

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {

#if HWY_CAP_GE256

namespace {

using Ints8 = hn::RebindToSigned<Lanes8>;

// The triangles that do not move, as a batch sees them.
class StillTriangles {
  public:
    // Nothing was found before them.
    static constexpr bool is_first = true;

    // What a ray keeps to see them.
    struct View {};

    explicit StillTriangles(const WideTree& tree) : tree_(tree) {}

    size_t depth() const { return tree_.depth; }

    HWY_INLINE bool prepare(const geometry::Ray& ray, QueryRay& q, View&) const {
        return !tree_.is_empty() && make_query(ray, tree_.query_bounds, {}, q);
    }

    HWY_INLINE void fetch(const View&, ChildRef ref) const { prefetch(tree_, ref); }

    HWY_INLINE const WideNode& node(const View&, ChildRef ref) const { return tree_.nodes[ref]; }

    HWY_INLINE Vector8 bound(const View&, const WideNode& node, int32_t row, size_t) const {
        return hn::Load(Lanes8(), node.bounds[row]);
    }

    // Calls visit(block, whether a lane counts).
    template <class Visit>
    HWY_INLINE bool at_leaf(const View&, uint32_t block, const Visit& visit) const {
        return visit(tree_.leaves[block], TakeAll());
    }

  private:
    const WideTree& tree_;
};

// And some that do.
class MovingTriangles {
  public:
    static constexpr bool is_first = false;

    struct View {
        SegmentTree tree;
    };

    MovingTriangles(const MovingTree& tree, const QueryBounds& bounds)
        : tree_(tree), bounds_(bounds) {}

    size_t depth() const { return tree_.depth; }

    HWY_INLINE bool prepare(const geometry::Ray& ray, QueryRay& q, View& view) const {
        view.tree = SegmentTree(tree_, ray.time);
        return make_query(ray, bounds_, {}, q);
    }

    HWY_INLINE void fetch(const View& view, ChildRef ref) const { prefetch(view.tree, ref); }

    HWY_INLINE const MovingNode& node(const View& view, ChildRef ref) const {
        return view.tree.node(ref);
    }

    HWY_INLINE Vector8 bound(const View& view,
                             const MovingNode& node,
                             int32_t row,
                             size_t k) const {
        const Lanes8 d;
        return hn::MulAdd(hn::Set(d, view.tree.f), hn::Set(d, node.change[k]),
                          hn::Load(d, node.bounds[row]));
    }

    template <class Visit>
    HWY_INLINE bool at_leaf(const View& view, uint32_t block, const Visit& visit) const {
        LeafBlock moved;
        move_block(view.tree.leaf(block), view.tree.f, moved);
        return visit(moved, TakeThoseWithArea());
    }

  private:
    const MovingTree& tree_;
    const QueryBounds& bounds_;
};

// A ray on its way.
template <class Triangles>
struct BatchRay : Triangles::View {
    QueryRay q;
    TreeHit best;         // closest hit: so far; any hit: t is the end of the ray
    float t_bound;        // of what is still to be found, scaled
    float certain_bound;  // only for any hit
    uint32_t number;      // of the ray in the batch
    ChildRef ref;         // to be visited next
    uint32_t height;      // of its stack
};

// Where the stacks of all rays lie: entry distances and children, apart so that both are stored as
// they come out of the registers.
class Stacks {
  public:
    explicit Stacks(size_t depth)
        : size_(depth * (wide - 1) + 2 * wide + 8),
          t_(size_ * batch_width),
          ref_(size_ * batch_width) {
        for (size_t i = 0; i < batch_width; ++i) {
            t(i)[0] = -1.0f;
            ref(i)[0] = end_of_ray;
        }
    }

    float* t(size_t slot) { return t_.data() + slot * size_; }

    ChildRef* ref(size_t slot) { return ref_.data() + slot * size_; }

  private:
    size_t size_;
    std::vector<float> t_;
    std::vector<ChildRef> ref_;
};

// The larger of two lanes to the lower place, by a permutation that exchanges them.
template <class V, class M>
HWY_INLINE V exchange(V v, V permuted, M is_lower) {
    return hn::IfThenElse(is_lower, hn::Max(v, permuted), hn::Min(v, permuted));
}

// Sorts eight integers, the largest first. Bitonic, without branches.
template <class D, class V>
HWY_INLINE V sort_falling(D d, V v) {
    alignas(32) static constexpr int32_t first_of_2[8] = {-1, 0, -1, 0, -1, 0, -1, 0};
    alignas(32) static constexpr int32_t first_2_of_4[8] = {-1, -1, 0, 0, -1, -1, 0, 0};
    alignas(32) static constexpr int32_t first_4_of_8[8] = {-1, -1, -1, -1, 0, 0, 0, 0};
    const auto of_2 = hn::MaskFromVec(hn::Load(d, first_of_2));
    const auto of_4 = hn::MaskFromVec(hn::Load(d, first_2_of_4));
    const auto of_8 = hn::MaskFromVec(hn::Load(d, first_4_of_8));
    v = exchange(v, hn::Shuffle2301(v), of_2);
    v = exchange(v, hn::Shuffle0123(v), of_4);
    v = exchange(v, hn::Shuffle2301(v), of_2);
    v = exchange(v, hn::Reverse(d, v), of_8);
    v = exchange(v, hn::Shuffle1032(v), of_4);
    v = exchange(v, hn::Shuffle2301(v), of_2);
    return v;
}

template <bool find_any, class Triangles>
class Batch {
  public:
    Batch(const Triangles& triangles, std::span<const geometry::Ray> rays)
        : triangles_(triangles), rays_(rays), stacks_(triangles.depth() + 1) {}

    using Found = std::conditional_t<find_any, uint8_t, TreeHit>;

    // done(number, best, is_hit) is called once for each ray, in no order. before: [ray] what was
    // found, unless these are the first triangles; rays go on from there.
    template <class Done>
    void run(const Found* before, const Done& done) {
        before_ = before;
        for (size_t slot = 0; slot < batch_width; ++slot) start(slot, done);
        while (inner_.count + leaf_.count > 0) {
            const Queue inner = inner_, leaf = leaf_;
            inner_.count = leaf_.count = ended_.count = 0;
            for (size_t i = 0; i < inner.count; ++i) visit_node(inner.slot[i]);
            for (size_t i = 0; i < leaf.count; ++i) {
                const size_t slot = leaf.slot[i];
                Ray& ray = ray_[slot];
                if (visit_leaf(ray)) {
                    done(ray.number, ray.best, true);
                    start(slot, done);
                } else {
                    pop(slot);
                }
            }
            for (size_t i = 0; i < ended_.count; ++i) {
                const size_t slot = ended_.slot[i];
                done(ray_[slot].number, ray_[slot].best,
                     !find_any && ray_[slot].best.id != scene::none);
                start(slot, done);
            }
        }
    }

  private:
    using Ray = BatchRay<Triangles>;

    struct Queue {
        uint8_t slot[2 * batch_width];
        size_t count = 0;
    };

    // Takes over the closest hit so far. True: any hit is enough, and there was one.
    HWY_INLINE bool found_before(size_t number, TreeHit& best) const {
        if constexpr (find_any)
            return before_[number] != 0;
        else if (before_[number].id != scene::none)
            best = before_[number];
        return false;
    }

    // Gives the slot the next ray that there is something to trace for.
    template <class Done>
    HWY_INLINE void start(size_t slot, const Done& done) {
        while (next_ < rays_.size()) {
            const size_t number = next_++;
            const geometry::Ray& from = rays_[number];
            Ray& ray = ray_[slot];
            ray.best = {};
            ray.best.t = from.t_max;
            if constexpr (!Triangles::is_first) {
                if (found_before(number, ray.best)) continue;
            }
            if (!(from.t_max > 0.0f) || !triangles_.prepare(from, ray.q, ray)) {
                done(number, ray.best, false);
                continue;
            }
            ray.number = uint32_t(number);
            ray.t_bound = float(double(ray.best.t) * ray.q.scaled_from_t);
            if constexpr (find_any) ray.certain_bound = certain_bound_of(ray.q, ray.t_bound);
            ray.ref = 0;
            ray.height = 1;
            inner_.slot[inner_.count++] = uint8_t(slot);
            return;
        }
    }

    // Takes what is next from the stack and queues the ray by what that is.
    HWY_INLINE void pop(size_t slot) {
        Ray& ray = ray_[slot];
        const float* const t = stacks_.t(slot);
        uint32_t height = ray.height - 1;
        if constexpr (!find_any) {
            while (t[height] > ray.t_bound) --height;
        }
        const ChildRef ref = stacks_.ref(slot)[height];
        ray.height = height;
        ray.ref = ref;
        triangles_.fetch(ray, ref == end_of_ray ? 0 : ref);
        Queue* const queues[3] = {&inner_, &leaf_, &ended_};
        Queue& queue = *queues[(ref >> 31) + uint32_t(ref == end_of_ray)];
        queue.slot[queue.count++] = uint8_t(slot);
    }

    HWY_INLINE void visit_node(size_t slot) {
        const Lanes8 d;
        const Ints8 di;
        Ray& ray = ray_[slot];
        const QueryRay& q = ray.q;
        const auto& node = triangles_.node(ray, ray.ref);
        const auto slab = [&](const int32_t* row, const float* origin, const float* inverse,
                              size_t k) HWY_ATTR {
            return hn::Mul(hn::Sub(triangles_.bound(ray, node, row[k], k), hn::Set(d, origin[k])),
                           hn::Set(d, inverse[k]));
        };
        const auto near = [&](size_t k) HWY_ATTR {
            return slab(q.near_row, q.near_origin, q.near_inverse, k);
        };
        const auto far = [&](size_t k)
                             HWY_ATTR { return slab(q.far_row, q.far_origin, q.far_inverse, k); };
        const auto tn = hn::Max(hn::Max(near(0), near(1)), hn::Max(near(2), hn::Zero(d)));
        const auto tf = hn::Min(hn::Min(far(0), far(1)), hn::Min(far(2), hn::Set(d, ray.t_bound)));
        const auto met = hn::Le(tn, tf);
        const auto children = hn::Load(di, reinterpret_cast<const int32_t*>(node.child));
        auto* const refs = reinterpret_cast<int32_t*>(stacks_.ref(slot) + ray.height);
        const uint32_t bits = bits_of(d, met);
        if constexpr (find_any) {
            // Largest child on top
            const hn::Rebind<uint8_t, Ints8> bytes;
            const auto lanes = hn::PromoteTo(
                di, hn::LoadU(bytes, reinterpret_cast<const uint8_t*>(&reversed_lanes[bits])));
            hn::StoreU(hn::TableLookupLanes(children, hn::IndicesFromVec(di, lanes)), di, refs);
        } else {
            // Nearest child on top: sorted by distance with the lane in the last bits
            const auto lane_bits = hn::Set(di, 7);
            const auto distance = hn::AndNot(lane_bits, hn::BitCast(di, tn));
            const auto key = hn::IfThenElse(hn::RebindMask(di, met),
                                            hn::Or(distance, hn::Iota(di, 0)), hn::Set(di, -1));
            const auto sorted = sort_falling(di, key);
            const auto indices = hn::IndicesFromVec(di, hn::And(sorted, lane_bits));
            hn::StoreU(hn::TableLookupLanes(children, indices), di, refs);
            hn::StoreU(hn::AndNot(lane_bits, sorted), di,
                       reinterpret_cast<int32_t*>(stacks_.t(slot) + ray.height));
        }
        ray.height += uint32_t(std::popcount(bits));
        pop(slot);
    }

    // Whether the ray has found all that it looks for.
    HWY_INLINE bool visit_leaf(Ray& ray) {
        const auto visit = [&](const LeafBlock& leaf, const auto& is_there) VELATURA_LEAF {
            if constexpr (find_any) {
                return is_block_hit(leaf, ray.q, ray.best.t, ray.t_bound, ray.certain_bound,
                                    is_there);
            } else {
                if (improve_hit(leaf, ray.q, scene::none, ray.t_bound, ray.best, is_there))
                    ray.t_bound = float(double(ray.best.t) * ray.q.scaled_from_t);
                return false;
            }
        };
        return triangles_.at_leaf(ray, ray.ref & ~leaf_bit, visit);
    }

    const Triangles triangles_;
    std::span<const geometry::Ray> rays_;
    size_t next_ = 0;
    Stacks stacks_;
    Queue inner_, leaf_, ended_;
    const Found* before_ = nullptr;
    Ray ray_[batch_width];
};

}  // namespace

void intersect_batch(const SceneTrees& trees,
                     std::span<const geometry::Ray> rays,
                     std::span<TreeHit> hits) {
    const auto run = [&](const auto& triangles) {
        Batch<false, std::decay_t<decltype(triangles)>> batch(triangles, rays);
        batch.run(hits.data(), [&](size_t number, const TreeHit& best, bool is_hit)
                                   HWY_ATTR { hits[number] = is_hit ? best : TreeHit{}; });
    };
    run(StillTriangles(trees.direct));
    for (const MovingTree& tree : trees.direct_motion.trees)
        run(MovingTriangles(tree, trees.direct_motion.query_bounds));
}

void occlude_batch(const SceneTrees& trees,
                   std::span<const geometry::Ray> rays,
                   std::span<uint8_t> occluded) {
    const auto run = [&](const auto& triangles) {
        Batch<true, std::decay_t<decltype(triangles)>> batch(triangles, rays);
        batch.run(occluded.data(), [&](size_t number, const TreeHit&, bool is_hit)
                                       HWY_ATTR { occluded[number] = is_hit; });
    };
    run(StillTriangles(trees.direct));
    for (const MovingTree& tree : trees.direct_motion.trees)
        run(MovingTriangles(tree, trees.direct_motion.query_bounds));
}

bool has_batch() {
    return true;
}

#else

void intersect_batch(const SceneTrees&, std::span<const geometry::Ray>, std::span<TreeHit>) {}

void occlude_batch(const SceneTrees&, std::span<const geometry::Ray>, std::span<uint8_t>) {}

bool has_batch() {
    return false;
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();
