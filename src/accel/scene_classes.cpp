// SPDX-License-Identifier: Apache-2.0
#include "accel/scene_classes.h"

#include "accel/triangle_numbers.h"
#include "base/check.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace velatura::accel {

namespace {

using scene::LinkClass;
using scene::LinkSet;

std::vector<uint32_t> first_ids(std::span<const TriangleSoupView> shapes) {
    const TriangleNumbers numbers(shapes);
    std::vector<uint32_t> first;
    for (size_t i = 0; i < shapes.size(); ++i) first.push_back(numbers.first(i));
    return first;
}

SceneClasses::Row make_row(uint32_t prototype, std::vector<LinkClass> of_shape) {
    SceneClasses::Row row;
    row.prototype = prototype;
    for (const LinkClass c : of_shape) row.folded |= LinkSet::folded_bit(c);
    // A prototype without shapes is never entered
    row.is_uniform =
        !of_shape.empty() && std::all_of(of_shape.begin(), of_shape.end(),
                                         [&](LinkClass c) { return c == of_shape.front(); });
    row.of_shape = std::move(of_shape);
    return row;
}

// Rows of what is there: a prototype with a row of the soup, or with none.
void set_rows(const SoupScene& scene, SceneClasses& out) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;
    for (size_t i = 0; i < scene.instances.size(); ++i) {
        const uint32_t prototype = scene.instances[i].prototype;
        const uint32_t row = scene.classes.row_of_instance[i];
        const auto [it, is_new] =
            known.try_emplace(std::pair(prototype, row), uint32_t(out.rows.size()));
        out.row_of_instance.push_back(it->second);
        if (!is_new) continue;
        const size_t shapes = scene.prototypes[prototype].size();
        std::vector<LinkClass> of_shape =
            row == scene::none ? std::vector<LinkClass>(shapes, 0) : scene.classes.rows[row];
        VELATURA_CHECK(of_shape.size() == shapes, "a row of classes for another prototype");
        out.rows.push_back(make_row(prototype, std::move(of_shape)));
    }
}

// of_leaf(ref): bits of what is in a leaf.
template <class OfLeaf>
void fold_up(WideTree& tree, const OfLeaf& of_leaf) {
    constexpr float nothing = std::numeric_limits<float>::infinity();
    // Children come after their parents
    for (size_t n = tree.nodes.size(); n-- > 0;) {
        WideNode& node = tree.nodes[n];
        for (size_t lane = 0; lane < wide; ++lane) {
            const ChildRef ref = node.child[lane];
            uint32_t& bits = node.classes[lane];
            bits = 0;
            if (node.bounds[0][lane] == nothing) continue;
            if (ref & leaf_bit) {
                bits = of_leaf(ref & ~leaf_bit);
            } else {
                for (const uint32_t below : tree.nodes[ref].classes) bits |= below;
            }
        }
    }
}

void fold_direct(SceneTrees& trees) {
    const SceneClasses& classes = trees.classes;
    const auto of_id = [&](uint32_t id) {
        const auto after =
            std::upper_bound(classes.direct_first.begin(), classes.direct_first.end(), id);
        return LinkSet::folded_bit(
            classes.of_shape[size_t(after - classes.direct_first.begin()) - 1]);
    };
    fold_up(trees.direct, [&](uint32_t block) {
        uint32_t bits = 0;
        for (const uint32_t id : trees.direct.leaves[block].id)
            if (id != unused_lane) bits |= of_id(id);
        return bits;
    });
    fold_up(trees.top, [&](uint32_t index) {
        if (index >= trees.instances.size())
            return of_id(trees.primitives[index - trees.instances.size()].id);
        return classes.row(trees.instances[index].instance).folded;
    });
}

}  // namespace

void set_classes(const SoupScene& scene, SceneTrees& trees) {
    if (scene.classes.is_empty()) return;
    VELATURA_CHECK(scene.classes.of_shape.size() == scene.shapes.size() &&
                       scene.classes.row_of_instance.size() == scene.instances.size(),
                   "classes of another scene");
    SceneClasses& classes = trees.classes;
    classes = SceneClasses();
    classes.of_shape = scene.classes.of_shape;
    classes.direct_first = first_ids(scene.shapes);
    for (const auto& shapes : scene.prototypes)
        classes.prototype_first.push_back(first_ids(shapes));
    set_rows(scene, classes);
    fold_direct(trees);
    const auto set_all = [](WideTree& tree) {
        for (WideNode& node : tree.nodes) std::fill_n(node.classes, wide, ~0u);
    };
    for (WideTree& tree : trees.prototypes) set_all(tree);
    for (PrimitiveTree& set : trees.prototype_primitives) set_all(set.tree);
}

size_t bytes(const SceneClasses& classes) {
    size_t total = 0;
    const auto add = [&](const std::vector<uint32_t>& v) { total += v.size() * sizeof(uint32_t); };
    add(classes.of_shape);
    add(classes.direct_first);
    for (const auto& first : classes.prototype_first) add(first);
    for (const SceneClasses::Row& row : classes.rows) add(row.of_shape);
    add(classes.row_of_instance);
    return total;
}

}  // namespace velatura::accel
