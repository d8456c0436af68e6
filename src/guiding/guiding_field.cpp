// SPDX-License-Identifier: Apache-2.0
#include "guiding/guiding_field.h"

namespace velatura::guiding {

namespace {

/// Length of the unit normal in the tree's coordinates, where the box of all records is 1 long:
/// surfaces that face apart are told apart first, also the two sides of a thin wall.
constexpr float normal_scale = 1.0f;

}  // namespace

GuidingField::Coordinates GuidingField::coordinates(const GuidingPoint& place) const {
    const Vec3 p = (place.p - origin_) * inverse_extent_;
    const Vec3 n = place.n * normal_scale;
    return {{p.x, p.y, p.z, n.x, n.y, n.z}};
}

uint32_t GuidingField::cell_of(const Coordinates& at) const {
    const SpatialNode* node = nodes_.data();
    while (node->axis != leaf_axis) {
        node = nodes_.data() + node->next + (at.c[node->axis] < node->split ? 0 : 1);
    }
    return node->next;
}

std::optional<Guide> GuidingField::at(const GuidingPoint& place) const {
    if (is_empty()) return std::nullopt;
    const Cell& cell = cells_[cell_of(coordinates(place))];
    if (cell.root == no_tree) return std::nullopt;
    return Guide{DirectionTree(directions_.data() + cell.root), cell.mean};
}

size_t GuidingField::memory_bytes() const {
    return nodes_.capacity() * sizeof(SpatialNode) + cells_.capacity() * sizeof(Cell) +
           directions_.capacity() * sizeof(DirectionNode);
}

}  // namespace velatura::guiding
