// SPDX-License-Identifier: Apache-2.0
#include "translate/linking/caster_tree.h"

namespace velatura::translate::linking {

using usd::layer::Path;

uint32_t CasterTree::add_node(uint32_t parent, Path key, Path prim) {
    const auto [at, is_new] = child_.try_emplace({parent, key}, uint32_t(nodes_.size()));
    if (is_new) {
        nodes_[parent].children.push_back(at->second);
        nodes_.push_back({prim, parent, false, false, false, {}});
    }
    return at->second;
}

void CasterTree::add(const std::vector<Step>& way) {
    uint32_t node = 0;
    for (const Step& step : way) {
        node = add_node(node, step.prim, step.prim);
        nodes_[node].is_object = step.is_object;
    }
    add_node(node, Path(), nodes_[node].prim);
}

void CasterTree::add_other(const std::vector<Step>& way) {
    uint32_t node = 0;
    for (const Step& step : way) {
        nodes_[node].holds_others = true;
        const auto at = child_.find({node, step.prim});
        if (at == child_.end()) return;
        node = at->second;
    }
}

std::vector<uint32_t> CasterTree::parts_of(uint32_t id, bool opens_objects) const {
    // Through prims that hold one other prim alone
    for (uint32_t at = id;; at = nodes_[at].children.front()) {
        const Node& node = nodes_[at];
        if (at != id && node.is_object && !opens_objects) return {};
        if (at == 0 || node.holds_others || node.children.size() != 1) return node.children;
    }
}

void CasterTree::divide(size_t others) {
    std::vector<uint32_t> level = {0};
    size_t count = others + 1;
    for (bool is_divided = true; is_divided;) {
        is_divided = false;
        const bool is_alone = count == 1, are_few = count < few_casters;
        std::vector<uint32_t> next;
        for (const uint32_t id : level) {
            const bool is_first = id == 0 || is_alone, holds_others = nodes_[id].holds_others;
            const bool is_wanted = is_first || holds_others || (are_few && !nodes_[id].is_object);
            const std::vector<uint32_t> parts =
                is_wanted ? parts_of(id, is_first) : std::vector<uint32_t>();
            const bool is_useful =
                parts.size() > 1 || (parts.size() == 1 && (id == 0 || holds_others));
            if (!is_useful || (!is_first && count - 1 + parts.size() > many_casters)) {
                next.push_back(id);
                continue;
            }
            count += parts.size() - 1;
            next.insert(next.end(), parts.begin(), parts.end());
            is_divided = true;
        }
        level = std::move(next);
    }
    for (const uint32_t id : level) nodes_[id].is_caster = true;
}

Path CasterTree::caster_of(const std::vector<Step>& way) const {
    uint32_t node = 0;
    const auto go = [&](Path key) {
        const auto at = child_.find({node, key});
        if (at != child_.end()) node = at->second;
    };
    for (const Step& step : way) go(step.prim);
    go(Path());
    while (node != 0 && !nodes_[node].is_caster) node = nodes_[node].parent;
    return nodes_[node].prim;
}

}  // namespace velatura::translate::linking
