// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/prim_index.h"

#include "usd/compose/site.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <map>

namespace velatura::usd::compose {

namespace {

/// Visits the nodes from a direct arc down, strongest first; false from `visit` leaves out what is
/// below.
template <class Visit>
void visit_instance_nodes(const PrimIndex& index, const Visit& visit) {
    index.graph().visit(0, [&](int i) {
        if (index.graph()[i].culled) return false;
        return !index.is_instance_node(i) || visit(i);
    });
}

}  // namespace

std::vector<int> PrimIndex::contributing() const {
    std::vector<int> result;
    for (size_t i = 0; i < nodes().size(); ++i) {
        const Node& n = nodes()[i];
        if (n.has_specs && n.contributes()) result.push_back(int(i));
    }
    return result;
}

bool PrimIndex::is_instance_node(int i) const {
    if (!graph_[i].has_specs || graph_[i].culled) return false;
    for (; i > 0; i = graph_[i].parent) {
        if (!graph_[i].due_to_ancestor) return true;
    }
    return false;
}

bool PrimIndex::has_direct_arc() const {
    for (size_t i = 1; i < nodes().size(); ++i) {
        if (is_instance_node(int(i))) return true;
    }
    return false;
}

bool PrimIndex::is_instanceable() const {
    if (!has_direct_arc()) return false;
    std::optional<bool> said;
    graph_.visit(0, [&](int i) {
        const Node& n = graph_[i];
        if (!said && n.contributes() && n.has_specs)
            said = site_bool(*n.stack, n.path, layer::fields().instanceable);
        return !said;
    });
    return said.value_or(false);
}

std::string PrimIndex::instance_key() const {
    std::string key;
    visit_instance_nodes(*this, [&](int i) {
        const Node& n = graph_[i];
        const TimeOffset& t = n.to_root->time_offset();
        key += fmt::format("{}:{}:{}:{}:{};", int(n.arc), static_cast<const void*>(n.stack),
                           n.path.to_string(), t.offset, t.scale);
        // What is below a node follows from it, but for payloads, which may be left out
        return has_payloads_;
    });
    if (key.empty()) return key;
    if (payloads_included_) key += "loaded;";
    std::map<std::string, std::string> selections;
    for (const int i : contributing())
        site_variant_selections(*graph_[i].stack, graph_[i].path, selections);
    for (const auto& selection : selections)
        key += fmt::format("{}={};", selection.first, selection.second);
    return key;
}

}  // namespace velatura::usd::compose
