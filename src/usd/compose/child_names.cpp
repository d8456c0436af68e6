// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"
#include "usd/layer/fields.h"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_set>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// Names of children, composed from the weakest site to the strongest.
class NameComposer {
  public:
    /// Adds what a site's layers name, in order. Few names at a time, so that most prims need no
    /// set.
    void add(const LayerStack& stack, Path site, bool properties) {
        for (auto entry = stack.layers().rbegin(); entry != stack.layers().rend(); ++entry) {
            const layer::Spec* spec = entry->layer->spec(site);
            if (!spec) continue;
            const auto names = properties ? spec->properties() : spec->prim_children();
            if (names_.empty() && present_.empty()) {
                names_.assign(names.begin(), names.end());
            } else if (!names.empty()) {
                fill_set();
                for (const Token& name : names) {
                    if (present_.insert(name).second) names_.push_back(name);
                }
            }
            const layer::Value* order =
                properties ? nullptr : spec->field(layer::fields().prim_order);
            if (!order) continue;
            const auto wanted = order->as_array<Token>();
            layer::reorder_items(names_, std::vector<Token>(wanted.begin(), wanted.end()));
        }
    }

    /// Moves names as the relocations of a stack say for the children of a site.
    void relocate(const Relocations& relocations, Path site) {
        std::map<Token, Token> renamed;
        std::set<Token> removed;
        std::set<Token> arrived;
        const auto& targets = relocations.target_of_source();
        for (auto it = targets.lower_bound(site); it != targets.end() && it->first.has_prefix(site);
             ++it) {
            if (it->first.parent() != site) continue;
            if (!it->second.is_empty() && it->second.parent() == site) {
                renamed.emplace(it->first.name(), it->second.name());
            } else {
                removed.insert(it->first.name());
            }
            prohibited_.insert(it->first.name());
        }
        fill_set();
        const auto& sources = relocations.source_of_target();
        for (auto it = sources.lower_bound(site); it != sources.end() && it->first.has_prefix(site);
             ++it) {
            if (it->first.parent() == site && it->second.parent() != site &&
                present_.count(it->first.name()) == 0) {
                arrived.insert(it->first.name());
            }
        }
        if (!renamed.empty() || !removed.empty()) {
            std::vector<Token> kept;
            for (const Token& name : names_) {
                const auto new_name = renamed.find(name);
                if (new_name != renamed.end()) {
                    present_.erase(name);
                    // A weaker child of the new name gives way to the one that is renamed
                    if (present_.insert(new_name->second).second) kept.push_back(new_name->second);
                } else if (removed.count(name) != 0) {
                    present_.erase(name);
                } else {
                    kept.push_back(name);
                }
            }
            names_ = std::move(kept);
        }
        names_.insert(names_.end(), arrived.begin(), arrived.end());
        present_.insert(arrived.begin(), arrived.end());
    }

    ChildNames result() {
        if (!prohibited_.empty())
            std::erase_if(names_, [&](Token name) { return prohibited_.count(name) != 0; });
        return {std::move(names_), {prohibited_.begin(), prohibited_.end()}};
    }

  private:
    void fill_set() {
        if (present_.empty()) present_.insert(names_.begin(), names_.end());
    }

    std::vector<Token> names_;
    std::unordered_set<Token> present_;
    std::set<Token> prohibited_;
};

/// Nodes that are not culled, weakest first: what hangs on a node before the node.
std::vector<int> weakest_first(const PrimGraph& graph) {
    std::vector<int> order;
    graph.visit(0, [&](int i) {
        if (graph[i].culled) return false;
        order.push_back(i);
        return true;
    });
    std::reverse(order.begin(), order.end());
    return order;
}

}  // namespace

ChildNames Composer::all_child_names(const PrimIndex& index, bool is_instance) const {
    NameComposer composer;
    for (const int i : weakest_first(index.graph())) {
        const Node& n = index.graph()[i];
        if (!n.contributes() || (is_instance && !index.is_instance_node(i))) continue;
        if (n.stack->has_relocates()) composer.relocate(n.stack->relocations(), n.path);
        if (n.has_specs) composer.add(*n.stack, n.path, false);
    }
    return composer.result();
}

std::vector<Token> Composer::property_names(const PrimIndex& index) const {
    NameComposer composer;
    for (const int i : weakest_first(index.graph())) {
        const Node& n = index.graph()[i];
        if (n.contributes() && n.has_specs) composer.add(*n.stack, n.path, true);
    }
    return composer.result().names;
}

}  // namespace velatura::usd::compose
