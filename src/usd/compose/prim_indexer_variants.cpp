// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/composer.h"
#include "usd/compose/prim_indexer.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace velatura::usd::compose {

using layer::Path;
using layer::Token;

namespace {

/// A path of a node's namespace as a site in its layers: inside the variants that the node stands
/// in.
Path site_in_variants(const Node& n, Path path) {
    Path variant = n.path;
    while (!variant.is_empty() && variant.element_count() > 0 && !variant.is_variant_selection()) {
        variant = variant.parent();
    }
    if (variant.is_empty() || !variant.is_variant_selection()) return path;
    const Path plain = variant.strip_variant_selections();
    return path.has_prefix(plain) ? path.replace_prefix(plain, variant, false) : path;
}

}  // namespace

std::optional<std::string> PrimIndexer::selection_below(int top,
                                                        Path path,
                                                        const std::string& set) const {
    // Strength order, specializes after everything else
    std::vector<std::pair<int, Path>> deferred = {{top, path}};
    for (size_t d = 0; d < deferred.size(); ++d) {
        std::vector<std::pair<int, Path>> open = {deferred[d]};
        while (!open.empty()) {
            const int i = open.back().first;
            const Path here = open.back().second;
            open.pop_back();
            if (!node(i).inert) {
                auto found =
                    site_variant_selection(*node(i).stack, site_in_variants(node(i), here), set);
                if (found) return found;
            }
            const size_t first = open.size();
            for (int c = node(i).first_child; c >= 0; c = node(c).next_sibling) {
                const Path below = node(c).to_parent->to_source(here);
                if (below.is_empty()) continue;
                if (node(c).arc == ArcType::Specialize) {
                    deferred.emplace_back(c, below);
                } else {
                    open.emplace_back(c, below);
                }
            }
            std::reverse(open.begin() + std::ptrdiff_t(first), open.end());
        }
    }
    return std::nullopt;
}

std::optional<std::string> PrimIndexer::variant_selection(int i, const std::string& set) const {
    // Express the prim that owns the set in every waiting graph that can see it
    std::vector<std::pair<const PrimIndexer*, Path>> views;
    const PrimIndexer* at = this;
    Path path = node(i).to_root->to_target(node(i).path.strip_variant_selections());
    while (!path.is_empty()) {
        views.emplace_back(at, path);
        const IndexFrame* f = at->frame_;
        if (!f) break;
        at = f->indexer;
        // An internal arc leads about in one namespace: a path outside of what it maps means itself
        const Path outside = path;
        path = f->to_parent->to_target(path);
        if (path.is_empty() && at->node(f->parent).stack == f->stack) path = outside;
        if (!path.is_empty()) path = at->node(f->parent).to_root->to_target(path);
    }
    // The outermost graph holds the strongest opinions
    for (auto view = views.rbegin(); view != views.rend(); ++view) {
        auto found = view->first->selection_below(0, view->second, set);
        if (found) return found;
    }
    return site_variant_selection(*node(i).stack, node(i).path, set);
}

bool PrimIndexer::eval_variant(const VariantTask& task, bool use_fallback) {
    if (node(task.node).inert) return true;
    std::optional<std::string> selection = variant_selection(task.node, task.set);
    const auto fallback = composer_.options().variant_fallbacks.find(task.set);
    if (!selection && fallback != composer_.options().variant_fallbacks.end()) {
        if (!use_fallback) return false;
        for (const std::string& name : fallback->second) {
            if (!site_has_variant(*node(task.node).stack, node(task.node).path, task.set, name))
                continue;
            selection = name;
            break;
        }
    }
    if (!selection) return use_fallback;
    if (selection->empty()) return true;

    const Path path =
        node(task.node).path.append_variant_selection(Token(task.set), Token(*selection));
    if (path.is_empty()) return true;
    ArcRequest request{ArcType::Variant,      task.node, task.node,
                       node(task.node).stack, path,      MapFunction::identity()};
    request.number = task.number;
    request.ancestral = false;
    add_arc(request);
    return true;
}

bool PrimIndexer::eval_next_variant() {
    const bool use_fallback = variants_.empty();
    std::vector<VariantTask>& pending = use_fallback ? fallbacks_ : variants_;
    if (pending.empty()) return false;
    // The strongest node chooses first: what it brings may hold selections for the weaker ones
    auto best = pending.begin();
    for (auto it = pending.begin(); it != pending.end(); ++it) {
        if (it->node == best->node ? it->number < best->number : precedes(it->node, best->node))
            best = it;
    }
    const VariantTask task = *best;
    pending.erase(best);
    const size_t before = nodes().size();
    const bool done = eval_variant(task, use_fallback);
    if (!done) fallbacks_.push_back(task);
    // New opinions may select what had to wait
    if (nodes().size() != before) {
        variants_.insert(variants_.end(), fallbacks_.begin(), fallbacks_.end());
        fallbacks_.clear();
    }
    return true;
}

// ---- Ranking ----

void PrimIndexer::collect(int i, std::vector<int>& plain, std::vector<int>& deferred) const {
    plain.push_back(i);
    for (int c = node(i).first_child; c >= 0; c = node(c).next_sibling) {
        if (node(c).arc == ArcType::Specialize) {
            deferred.push_back(c);
        } else {
            collect(c, plain, deferred);
        }
    }
}

bool PrimIndexer::is_stronger_specialize(int a, int b) const {
    // The specializes that a node stands in, outermost first; each with the arc it repeats and how
    // often
    struct Link {
        int node;
        int origin;
        size_t steps;
    };

    const auto chain_of = [&](int i) {
        std::vector<Link> chain;
        while (i >= 0) {
            if (node(i).arc != ArcType::Specialize) {
                i = node(i).parent;
                continue;
            }
            Link link{i, i, 0};
            while (node(link.origin).origin != node(link.origin).parent) {
                link.origin = node(link.origin).origin;
                ++link.steps;
            }
            chain.push_back(link);
            // An implied arc stands where the arc that it repeats was introduced
            i = node(link.origin).parent;
        }
        std::reverse(chain.begin(), chain.end());
        return chain;
    };
    const std::vector<Link> x = chain_of(a);
    const std::vector<Link> y = chain_of(b);
    for (size_t i = 0; i < x.size() && i < y.size(); ++i) {
        if (x[i].origin == y[i].origin) continue;
        // Below copies of one arc the stronger copy decides, else the order of what introduced the
        // arcs
        if (i > 0 && x[i - 1].node != y[i - 1].node) return x[i - 1].steps > y[i - 1].steps;
        return precedes(x[i].origin, y[i].origin);
    }
    // What contains is stronger than what it contains; the same class seen from further up is
    // stronger
    if (x.size() != y.size()) return x.size() < y.size();
    for (size_t i = 0; i < x.size(); ++i) {
        if (x[i].steps != y[i].steps) return x[i].steps > y[i].steps;
    }
    return false;
}

void PrimIndexer::rank() {
    std::vector<int> order;
    std::vector<int> deferred;
    collect(0, order, deferred);
    // Specializes nested in specializes are weaker than everything about the outer one
    std::vector<int> specializes;
    for (size_t i = 0; i < deferred.size(); ++i) {
        std::vector<int> ignored;
        specializes.push_back(deferred[i]);
        collect(deferred[i], ignored, deferred);
    }
    std::stable_sort(specializes.begin(), specializes.end(),
                     [this](int a, int b) { return is_stronger_specialize(a, b); });
    for (const int i : specializes) {
        std::vector<int> ignored;
        collect(i, order, ignored);
    }
    index_.contributing_.clear();
    for (const int i : order) {
        if (node(i).has_specs && !node(i).inert) index_.contributing_.push_back(i);
    }
}

}  // namespace velatura::usd::compose
