// SPDX-License-Identifier: Apache-2.0
// What all kernels do at a node and at a leaf of what moves. Included once per instruction set by
// each of them.
#if defined(VELATURA_KERNEL_MOTION) == defined(HWY_TARGET_TOGGLE)
#ifdef VELATURA_KERNEL_MOTION
#undef VELATURA_KERNEL_MOTION
#else
#define VELATURA_KERNEL_MOTION
#endif

#include "accel/kernel_steps.inl"
#include "geometry/motion.h"

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {
namespace {

// One segment of a motion as kernels read it, f of the way to the next key.
struct SegmentTree {
    const char* base[2];  // of nodes and of the first keys of blocks
    size_t stride[2];
    float f;

    SegmentTree() = default;

    HWY_INLINE SegmentTree(const MovingTree& tree, float time) {
        const auto at = geometry::motion_time(time, tree.segments);
        const uint32_t slab = std::min(uint32_t(at.f * float(tree.slabs)), tree.slabs - 1);
        const size_t first_node = (at.segment * tree.slabs + slab) * tree.node_count;
        base[0] = reinterpret_cast<const char*>(tree.nodes.data() + first_node);
        base[1] = reinterpret_cast<const char*>(tree.leaves.data() + at.segment);
        stride[0] = sizeof(MovingNode);
        stride[1] = sizeof(LeafBlock) * (tree.segments + 1);
        f = at.f;
    }

    // Without branches: nothing predicts what comes next.
    HWY_INLINE const char* place(ChildRef ref) const {
        return base[ref >> 31] + (ref & ~leaf_bit) * stride[ref >> 31];
    }

    HWY_INLINE const MovingNode& node(ChildRef ref) const {
        return *reinterpret_cast<const MovingNode*>(base[0] + ref * sizeof(MovingNode));
    }

    // Two neighboring keys.
    HWY_INLINE const LeafBlock* leaf(uint32_t block) const {
        return reinterpret_cast<const LeafBlock*>(base[1] + block * stride[1]);
    }
};

HWY_INLINE void prefetch(const SegmentTree& tree, ChildRef ref) {
    const char* p = tree.place(ref);
    for (size_t line = 0; line < sizeof(MovingNode); line += 64) __builtin_prefetch(p + line);
    // A node has no more lines
    const size_t next = size_t(ref >> 31) * 64;
    p += sizeof(MovingNode) - 64;
    for (size_t line = sizeof(MovingNode); line < 2 * sizeof(LeafBlock); line += 64)
        __builtin_prefetch(p += next);
}

// The slab constants of a ray and its way from one key to the next in every lane.
struct MovingSlabs : SlabLanes {
    Vector8 f;

    HWY_INLINE MovingSlabs(const QueryRay& q, float way)
        : SlabLanes(q), f(hn::Set(Lanes8(), way)) {}
};

struct MovingBoxes {
    const float* bounds;
    Vector8 f, change[3];

    // Bounds have room for the rounding, once or twice.
    HWY_INLINE Vector8 load(size_t k, size_t place) const {
        return hn::MulAdd(f, change[k], hn::Load(Lanes8(), bounds + place));
    }
};

HWY_INLINE MovingBoxes boxes_of(const MovingNode& node, const MovingSlabs& q) {
    const Lanes8 d;
    return {&node.bounds[0][0],
            q.f,
            {hn::Set(d, node.change[0]), hn::Set(d, node.change[1]), hn::Set(d, node.change[2])}};
}

// The triangles of a block, f of the way between two keys: geometry::moved.
HWY_INLINE void move_block(const LeafBlock* keys, float f, LeafBlock& moved) {
    const Lanes8 d;
    const auto way = hn::Set(d, f);
    for (size_t corner = 0; corner < 3; ++corner) {
        for (size_t axis = 0; axis < 3; ++axis) {
            for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
                const auto from = hn::Load(d, keys[0].corner[corner][axis] + i);
                const auto to = hn::Load(d, keys[1].corner[corner][axis] + i);
                hn::Store(hn::Add(from, hn::Mul(way, hn::Sub(to, from))), d,
                          moved.corner[corner][axis] + i);
            }
        }
    }
    std::copy_n(keys->id, wide, moved.id);
}

// Triangles that have no area at the time of the ray are not there.
struct TakeThoseWithArea {
    HWY_INLINE bool operator()(const LeafBlock& leaf, uint32_t lane) const {
        Vec3 p[3];
        for (int corner = 0; corner < 3; ++corner) {
            for (int k = 0; k < 3; ++k) p[corner][k] = leaf.corner[corner][k][lane];
        }
        return !is_degenerate(p[0], p[1], p[2]);
    }

    // What is surely hit has an area
    HWY_INLINE bool has_any(const LeafBlock&, uint32_t certain) const { return certain != 0; }
};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#endif
