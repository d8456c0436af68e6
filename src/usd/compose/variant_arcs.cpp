// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/variant_arcs.h"

#include "usd/compose/site.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// A path of a node's namespace as a site in its layers: inside the variants that it stands in.
Path into_variants(Path path, Path at_introduction) {
    if (!at_introduction.has_variant_selection()) return path;
    return path.replace_prefix(at_introduction.strip_variant_selections(), at_introduction, false);
}

}  // namespace

bool VariantArcs::can_have_opinions_at(int i, Path path) const {
    const size_t depth = graph_[i].restricted_depth;
    return depth == 0 || depth > path.element_count();
}

void VariantArcs::add_sets(int i, Path site, bool ancestral) {
    int number = 0;
    for (std::string& name : site_variant_sets(*graph_[i].stack, site)) {
        if (size_t(number) >= composer_.options().max_variant_sets) {
            build_.report(ErrorKind::CapacityExceeded, i, site_loc(*graph_[i].stack, site),
                          fmt::format("limit of {} variant sets reached", number));
            break;
        }
        pending_[ancestral ? 0 : 2].push_back({i, site, std::move(name), number++});
    }
}

void VariantArcs::eval_ancestral_sets(int i) {
    for (Path path = graph_[i].path.parent(); path.element_count() > 0; path = path.parent()) {
        if (!can_have_opinions_at(i, path)) continue;
        add_sets(i, path, true);
        // Sets further up have been seen to when this variant was chosen
        if (path.is_variant_selection()) break;
    }
}

void VariantArcs::eval_sets(int i) {
    if (graph_[i].contributes()) add_sets(i, graph_[i].path, false);
}

bool VariantArcs::run(Task task) {
    int queue = 0;
    switch (task) {
        case Task::AncestralVariants:
            queue = 0;
            break;
        case Task::AncestralFallbacks:
            queue = 1;
            break;
        case Task::Variants:
            queue = 2;
            break;
        case Task::Fallbacks:
            queue = 3;
            break;
        default:
            return false;
    }
    std::vector<Set>& pending = pending_[size_t(queue)];
    if (pending.empty()) return false;
    // The strongest node chooses first: what it brings may hold selections for the weaker ones
    auto best = pending.begin();
    for (auto it = best + 1; it != pending.end(); ++it) {
        const int order = graph_.compare(it->node, best->node);
        if (order < 0 ||
            (order == 0 && std::tie(it->site, it->number) < std::tie(best->site, best->number)))
            best = it;
    }
    const Set chosen = std::move(*best);
    pending.erase(best);
    eval(chosen, queue < 2, queue % 2 == 1);
    return true;
}

std::string VariantArcs::variant_fallback(const Set& set) const {
    const auto fallback = composer_.options().variant_fallbacks.find(set.name);
    if (fallback == composer_.options().variant_fallbacks.end()) return {};
    for (const std::string& name : fallback->second) {
        if (site_has_variant(*graph_[set.node].stack, set.site, set.name, name)) return name;
    }
    return {};
}

void VariantArcs::eval(const Set& set, bool ancestral, bool use_fallback) {
    // Every choice looks through the whole graph
    if (!composer_.spend(1 + graph_.size() / 16)) return;
    if (!can_have_opinions_at(set.node, set.site)) return;
    const std::string fallback = variant_fallback(set);
    const std::string selection =
        use_fallback ? fallback
                     : variant_selection(set.node, set.site, set.name).value_or(std::string());
    if (!selection.empty()) return add(set, selection, ancestral);
    if (!use_fallback && !fallback.empty()) {
        pending_[ancestral ? 1 : 3].push_back(set);
    } else {
        unselected_[ancestral ? 1 : 0].push_back(set);
    }
}

void VariantArcs::retry() {
    // New opinions may select what had to wait
    for (const bool ancestral : {true, false}) {
        std::vector<Set>& authored = pending_[ancestral ? 0 : 2];
        for (std::vector<Set>* waiting :
             {&pending_[ancestral ? 1 : 3], &unselected_[ancestral ? 1 : 0]}) {
            authored.insert(authored.end(), waiting->begin(), waiting->end());
            waiting->clear();
        }
    }
}

void VariantArcs::add(const Set& set, const std::string& selection, bool ancestral) {
    const Path variant = set.site.append_variant_selection(Token(set.name), Token(selection));
    if (variant.is_empty()) return;
    ArcRequest request;
    request.arc = ArcType::Variant;
    request.parent = request.origin = set.node;
    request.stack = graph_[set.node].stack;
    request.map = composer_.maps().identity();
    request.number = set.number;
    request.path = variant;
    if (ancestral) {
        request.path = graph_[set.node].path.replace_prefix(set.site, variant, false);
        request.namespace_depth = prim_depth(set.site);
        request.ancestral = true;
        // As below the class arc that this variant belongs to
        for (int i = set.node; i > 0 && !request.skip_duplicates; i = graph_[i].parent) {
            request.skip_duplicates = is_class_arc(graph_[i].arc) && graph_[i].contributes() &&
                                      graph_.depth_below_introduction(i) == 0;
        }
    }
    if (arcs_.add(request) >= 0) retry();
}

std::optional<std::string> VariantArcs::variant_selection(int i,
                                                          Path site,
                                                          const std::string& set) {
    // Find the strongest node that can see the prim of the set
    int top = i;
    Path path = site.strip_variant_selections();
    if (const Path at_root = graph_[i].to_root->to_target(path); !at_root.is_empty()) {
        top = 0;
        path = at_root;
    } else {
        while (top > 0) {
            const Path above = graph_[top].to_parent->to_target(path);
            if (above.is_empty()) break;
            path = above;
            top = graph_[top].parent;
        }
    }
    path = into_variants(path, graph_.path_at_introduction(top));

    // The path in each node, found on the way down
    std::vector<Path> paths(graph_.size());
    std::vector<int> order;
    graph_.visit(top, [&](int at) {
        const Path above = at == top ? Path() : paths[size_t(graph_[at].parent)];
        paths[size_t(at)] = at == top ? path : graph_[at].to_parent->to_source(above);
        if (!paths[size_t(at)].is_empty()) order.push_back(at);
        return !paths[size_t(at)].is_empty();
    });
    // What has been chosen for the prim before holds
    for (const int at : order) {
        if (graph_[at].arc != ArcType::Variant) continue;
        const Path variant = graph_.path_at_introduction(at);
        if (variant.variant_set() == set && variant.prim_path() == paths[size_t(at)])
            return variant.variant().str();
    }
    std::vector<CompositionError> errors;
    std::optional<std::string> result;
    for (const int at : order) {
        if (!can_have_opinions_at(at, paths[size_t(at)])) continue;
        const Path here = graph_[at].arc == ArcType::Variant
                              ? into_variants(paths[size_t(at)], graph_.path_at_introduction(at))
                              : paths[size_t(at)];
        result = site_variant_selection(*graph_[at].stack, here, set, &errors);
        if (result) break;
    }
    build_.report_all(errors, i);
    return result;
}

}  // namespace velatura::usd::compose
