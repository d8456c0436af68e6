// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/prim_index.h"

#include <fmt/format.h>

#include <functional>

namespace velatura::usd::compose {

const char* arc_name(ArcType arc) {
    switch (arc) {
        case ArcType::Root:
            return "root";
        case ArcType::Inherit:
            return "inherit";
        case ArcType::Variant:
            return "variant";
        case ArcType::Relocate:
            return "relocate";
        case ArcType::Reference:
            return "reference";
        case ArcType::Payload:
            return "payload";
        case ArcType::Specialize:
            return "specialize";
    }
    return "?";
}

bool PrimIndex::is_instance_node(int i) const {
    for (; i > 0; i = nodes_[size_t(i)].parent) {
        if (!nodes_[size_t(i)].due_to_ancestor) return true;
    }
    return false;
}

bool PrimIndex::has_direct_arc() const {
    for (size_t i = 1; i < nodes_.size(); ++i) {
        if (nodes_[i].has_specs && !nodes_[i].inert && is_instance_node(int(i))) return true;
    }
    return false;
}

std::string PrimIndex::instance_key() const {
    std::string key;
    for (const int i : contributing_) {
        if (!is_instance_node(i)) continue;
        const Node& n = nodes_[size_t(i)];
        const TimeOffset& t = n.to_root->time_offset();
        key += fmt::format("{}:{}:{}:{}:{};", int(n.arc), static_cast<const void*>(n.stack),
                           n.path.to_string(), t.offset, t.scale);
    }
    if (!key.empty()) key += payloads_included_ ? "loaded" : "";
    return key;
}

std::string PrimIndex::to_string() const {
    std::string text;
    const std::function<void(int, int)> print = [&](int i, int depth) {
        const Node& n = nodes_[size_t(i)];
        text +=
            fmt::format("{:{}}{} {} <{}>{}{}{}\n", "", 2 * depth, arc_name(n.arc),
                        n.stack->identifier(), n.path.to_string(), n.has_specs ? "" : " no-specs",
                        n.inert ? " inert" : "", n.due_to_ancestor ? " ancestral" : "");
        for (int c = n.first_child; c >= 0; c = nodes_[size_t(c)].next_sibling) print(c, depth + 1);
    };
    if (is_valid()) print(0, 0);
    return text;
}

}  // namespace velatura::usd::compose
