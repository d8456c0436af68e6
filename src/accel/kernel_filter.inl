// SPDX-License-Identifier: Apache-2.0
// What rays meet of a scene: all of it, or some classes of its geometry. Included once per
// instruction set by the walks.
#if defined(VELATURA_KERNEL_FILTER) == defined(HWY_TARGET_TOGGLE)
#ifdef VELATURA_KERNEL_FILTER
#undef VELATURA_KERNEL_FILTER
#else
#define VELATURA_KERNEL_FILTER
#endif

#include "accel/kernel_motion.inl"
#include "accel/kernel_steps.inl"

HWY_BEFORE_NAMESPACE();

namespace velatura::accel {
namespace HWY_NAMESPACE {
namespace {

// Everything, of a scene or of a tree: no instruction is spent on asking.
struct MeetAll {
    HWY_INLINE MeetAll direct() const { return {}; }

    HWY_INLINE MeetAll top() const { return {}; }

    HWY_INLINE MeetAll in_instance(uint32_t) const { return {}; }

    HWY_INLINE bool enters(uint32_t) const { return true; }

    HWY_INLINE bool takes(uint32_t) const { return true; }

    HWY_INLINE SlabLanes slabs(const QueryRay& q) const { return SlabLanes(q); }

    HWY_INLINE TakeAll in_blocks() const { return {}; }

    HWY_INLINE TakeThoseWithArea in_moved_blocks() const { return {}; }
};

// The slab constants of a ray that meets some classes only.
struct FilteredSlabs : SlabLanes {
    uint32_t folded;  // LinkSet::folded of them

    HWY_INLINE FilteredSlabs(const QueryRay& q, uint32_t classes) : SlabLanes(q), folded(classes) {}
};

// Leaves out children without any of the classes.
HWY_INLINE uint32_t meet_children(const WideNode& node,
                                  const FilteredSlabs& q,
                                  float t_far_bound,
                                  float* HWY_RESTRICT t_near) {
    const hn::CappedTag<uint32_t, wide> d;
    const SlabLanes& slabs = q;
    const uint32_t bits = meet_children(node, slabs, t_far_bound, t_near);
    uint32_t allowed = 0;
    for (size_t i = 0; i < wide; i += hn::Lanes(d)) {
        const auto common = hn::And(hn::Load(d, node.classes + i), hn::Set(d, q.folded));
        allowed |= bits_of(d, hn::Ne(common, hn::Zero(d))) << i;
    }
    return bits & allowed;
}

// Triangles of a block that count. Of what moves those that have an area at that time.
template <class Tree, bool with_area>
struct TakeSome {
    const Tree& tree;

    HWY_INLINE bool operator()(const LeafBlock& leaf, uint32_t lane) const {
        return tree.takes(leaf.id[lane]) && (!with_area || TakeThoseWithArea()(leaf, lane));
    }

    // What is surely hit has an area
    HWY_INLINE bool has_any(const LeafBlock& leaf, uint32_t certain) const {
        for (; certain != 0; certain &= certain - 1) {
            if (tree.takes(leaf.id[std::countr_zero(certain)])) return true;
        }
        return false;
    }
};

// Some of the geometry in one tree.
struct MeetSomeOfTree {
    const scene::LinkSet& met;
    const std::vector<uint32_t>* first;             // numbers of the shapes' first triangles
    const std::vector<scene::LinkClass>* of_shape;  // null: all of it
    uint32_t folded;

    HWY_INLINE bool takes(uint32_t id) const {
        if (!of_shape) return true;
        const auto after = std::upper_bound(first->begin(), first->end(), id);
        return met.holds((*of_shape)[size_t(after - first->begin()) - 1]);
    }

    HWY_INLINE FilteredSlabs slabs(const QueryRay& q) const { return {q, folded}; }

    HWY_INLINE TakeSome<MeetSomeOfTree, false> in_blocks() const { return {*this}; }

    HWY_INLINE TakeSome<MeetSomeOfTree, true> in_moved_blocks() const { return {*this}; }
};

// Some of the geometry of a scene.
struct MeetSome {
    const SceneClasses& classes;
    const scene::LinkSet& met;

    HWY_INLINE MeetSomeOfTree direct() const {
        return {met, &classes.direct_first, &classes.of_shape, met.folded()};
    }

    // Of the tree over instances and primitives placed directly, which are those of direct()
    HWY_INLINE MeetSomeOfTree top() const { return direct(); }

    // Nodes within prototypes do not know the classes that instances give them
    HWY_INLINE MeetSomeOfTree in_instance(uint32_t instance) const {
        const SceneClasses::Row& row = classes.row(instance);
        const bool takes_all = row.is_uniform && met.holds(row.of_shape[0]);
        return {met, &classes.prototype_first[row.prototype], takes_all ? nullptr : &row.of_shape,
                ~0u};
    }

    // Whether the instance has anything to meet.
    HWY_INLINE bool enters(uint32_t instance) const {
        const SceneClasses::Row& row = classes.row(instance);
        return (row.folded & met.folded()) != 0 && (!row.is_uniform || met.holds(row.of_shape[0]));
    }
};

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace velatura::accel

HWY_AFTER_NAMESPACE();

#endif
