// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"
#include "usd/compose/prim_indexer.h"
#include "usd/layer/fields.h"

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

bool PrimIndexer::may_speak_at(int i, Path path) const {
    const size_t depth = node(i).restricted_depth;
    return depth == 0 || depth > path.element_count();
}

void PrimIndexer::add_variant_tasks(int i, Path site, bool ancestral) {
    int number = 0;
    for (std::string& set : site_variant_sets(*node(i).stack, site)) {
        if (size_t(number) >= composer_.options().max_variant_sets) {
            report(ErrorKind::CapacityExceeded, i, site_loc(*node(i).stack, site),
                   fmt::format("limit of {} variant sets reached", number));
            break;
        }
        variants_[ancestral ? 0 : 2].push_back({i, site, std::move(set), number++});
    }
}

void PrimIndexer::scan_ancestral_variants(int i) {
    const Node& n = node(i);
    Path path = n.path.parent();
    while (n.restricted_depth != 0 && path.element_count() >= n.restricted_depth)
        path = path.parent();
    for (; path.element_count() > 0; path = path.parent()) {
        if (site_arcs(*n.stack, path).variants) return add_task(AncestralVariantSets, i);
    }
}

void PrimIndexer::eval_ancestral_variant_sets(int i) {
    for (Path path = node(i).path.parent(); path.element_count() > 0; path = path.parent()) {
        if (!may_speak_at(i, path)) continue;
        add_variant_tasks(i, path, true);
        // Sets further up have been seen to when this variant was chosen
        if (path.is_variant_selection()) break;
    }
}

bool PrimIndexer::run_variant(Task task) {
    int queue = 0;
    switch (task) {
        case AncestralVariants:
            queue = 0;
            break;
        case AncestralFallbacks:
            queue = 1;
            break;
        case Variants:
            queue = 2;
            break;
        case Fallbacks:
            queue = 3;
            break;
        default:
            return false;
    }
    std::vector<VariantTask>& pending = variants_[size_t(queue)];
    if (pending.empty()) return false;
    // The strongest node chooses first: what it brings may hold selections for the weaker ones
    auto best = pending.begin();
    for (auto it = best + 1; it != pending.end(); ++it) {
        const int order = graph().compare(it->node, best->node);
        if (order < 0 ||
            (order == 0 && std::tie(it->site, it->number) < std::tie(best->site, best->number)))
            best = it;
    }
    const VariantTask chosen = std::move(*best);
    pending.erase(best);
    eval_variant(chosen, queue < 2, queue % 2 == 1);
    return true;
}

std::string PrimIndexer::variant_fallback(const VariantTask& task) const {
    const auto fallback = composer_.options().variant_fallbacks.find(task.set);
    if (fallback == composer_.options().variant_fallbacks.end()) return {};
    for (const std::string& name : fallback->second) {
        if (site_has_variant(*node(task.node).stack, task.site, task.set, name)) return name;
    }
    return {};
}

void PrimIndexer::eval_variant(const VariantTask& task, bool ancestral, bool use_fallback) {
    // Every choice looks through the whole graph
    if (!composer_.spend(1 + graph().size() / 16)) return;
    if (!may_speak_at(task.node, task.site)) return;
    const std::string fallback = variant_fallback(task);
    const std::string selection =
        use_fallback ? fallback
                     : variant_selection(task.node, task.site, task.set).value_or(std::string());
    if (!selection.empty()) return add_variant_arc(task, selection, ancestral);
    if (!use_fallback && !fallback.empty()) {
        variants_[ancestral ? 1 : 3].push_back(task);
    } else {
        unselected_[ancestral ? 1 : 0].push_back(task);
    }
}

void PrimIndexer::retry_variants() {
    // New opinions may select what had to wait
    for (const bool ancestral : {true, false}) {
        std::vector<VariantTask>& authored = variants_[ancestral ? 0 : 2];
        for (std::vector<VariantTask>* waiting :
             {&variants_[ancestral ? 1 : 3], &unselected_[ancestral ? 1 : 0]}) {
            authored.insert(authored.end(), waiting->begin(), waiting->end());
            waiting->clear();
        }
    }
}

void PrimIndexer::add_variant_arc(const VariantTask& task,
                                  const std::string& selection,
                                  bool ancestral) {
    const Path variant = task.site.append_variant_selection(Token(task.set), Token(selection));
    if (variant.is_empty()) return;
    ArcRequest request;
    request.arc = ArcType::Variant;
    request.parent = request.origin = task.node;
    request.stack = node(task.node).stack;
    request.map = composer_.maps().identity();
    request.number = task.number;
    request.path = variant;
    if (ancestral) {
        request.path = node(task.node).path.replace_prefix(task.site, variant, false);
        request.namespace_depth = prim_depth(task.site);
        request.ancestral = true;
        // As below the class arc that this variant belongs to
        for (int i = task.node; i > 0 && !request.skip_duplicates; i = node(i).parent) {
            request.skip_duplicates = is_class_arc(node(i).arc) && node(i).contributes() &&
                                      graph().depth_below_introduction(i) == 0;
        }
    }
    if (add_arc(request) >= 0) retry_variants();
}

std::optional<std::string> PrimIndexer::variant_selection(int i,
                                                          Path site,
                                                          const std::string& set) {
    // Find the strongest node that can see the prim of the set
    int top = i;
    Path path = site.strip_variant_selections();
    if (const Path at_root = node(i).to_root->to_target(path); !at_root.is_empty()) {
        top = 0;
        path = at_root;
    } else {
        while (top > 0) {
            const Path above = node(top).to_parent->to_target(path);
            if (above.is_empty()) break;
            path = above;
            top = node(top).parent;
        }
    }
    path = into_variants(path, graph().path_at_introduction(top));

    // The path in each node, found on the way down
    std::vector<Path> paths(graph().size());
    std::vector<int> order;
    graph().visit(top, [&](int at) {
        const Path above = at == top ? Path() : paths[size_t(node(at).parent)];
        paths[size_t(at)] = at == top ? path : node(at).to_parent->to_source(above);
        if (!paths[size_t(at)].is_empty()) order.push_back(at);
        return !paths[size_t(at)].is_empty();
    });
    // What has been chosen for the prim before holds
    for (const int at : order) {
        if (node(at).arc != ArcType::Variant) continue;
        const Path variant = graph().path_at_introduction(at);
        if (variant.variant_set() == set && variant.prim_path() == paths[size_t(at)])
            return variant.variant().str();
    }
    std::vector<CompositionError> errors;
    std::optional<std::string> result;
    for (const int at : order) {
        if (!may_speak_at(at, paths[size_t(at)])) continue;
        const Path here = node(at).arc == ArcType::Variant
                              ? into_variants(paths[size_t(at)], graph().path_at_introduction(at))
                              : paths[size_t(at)];
        result = site_variant_selection(*node(at).stack, here, set, &errors);
        if (result) break;
    }
    report_all(errors, i);
    return result;
}

}  // namespace velatura::usd::compose
