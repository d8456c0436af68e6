// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_plan.h"

#include <algorithm>

namespace velatura::compositor::mix {

namespace {

using accumulate::LayerEntry;

/// The terms of the family and the black layers that lifted shadows light, in the order of the
/// header.
std::vector<MixPlan::Term> with_lit_layers(const MixPlan& mix,
                                           const std::vector<LayerEntry>& layers) {
    std::vector<MixPlan::Term> terms = mix.terms;
    const auto rank_of = [&layers](const std::string& layer) {
        return std::find_if(layers.begin(), layers.end(),
                            [&](const LayerEntry& e) { return e.name == layer; });
    };
    for (const MixPlan::Term& shadow : mix.shadow_terms) {
        const std::string& layer = shadow.direct_layer;
        const bool is_there = std::any_of(terms.begin(), terms.end(),
                                          [&](const auto& t) { return t.layer == layer; });
        if (is_there || layer.empty()) continue;
        const auto at = std::find_if(terms.begin(), terms.end(), [&](const auto& t) {
            return rank_of(t.layer) > rank_of(layer);
        });
        terms.insert(at, MixPlan::Term{layer});
    }
    return terms;
}

}  // namespace

std::string LayerChannel::full_name() const {
    return layer == "rgba" && !half.empty() ? "beauty" + half : layer + half;
}

LayeredPlan::LayeredPlan(const LayerStack& of_layout, const MixPlan& of_mix, float of_exposure)
    : layout(of_layout),
      mix(of_mix),
      exposure(of_exposure),
      outcomes(layer_outcomes(layout, mix, exposure)),
      terms(layout.is_plain() ? mix.terms : with_lit_layers(mix, layout.header().layers)) {
    const auto& layers = layout.header().layers;
    const bool has_halves = std::any_of(layers.begin(), layers.end(),
                                        [](const LayerEntry& e) { return e.family == "halves"; });
    if (has_halves) halves = {"", "_hA", "_hB"};
}

const MixPlan::Term* LayeredPlan::beside(const std::string& layer) const {
    const auto at = std::find_if(mix.beside.begin(), mix.beside.end(),
                                 [&](const auto& t) { return t.layer == layer; });
    return at == mix.beside.end() ? nullptr : &*at;
}

std::vector<std::string> LayeredPlan::sources_of(const LayerEntry& coarser) const {
    std::vector<std::string> sources;
    for (const MixPlan::Term& term : terms) {
        const LayerEntry* e = layout.header().find(term.layer);
        const bool is_of = e && (coarser.bounce.empty() || e->bounce == coarser.bounce) &&
                           (coarser.group.empty() || e->group == coarser.group);
        if (is_of) sources.push_back(term.layer);
    }
    return sources;
}

}  // namespace velatura::compositor::mix
